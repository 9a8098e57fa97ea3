//! Fast path for the rows of most binary files, whose size is constant.
//!
//! These are vertices without lists, and triangular faces. In all other cases, and for any error,
//! the functions return `None`, and the general reader of rows determines the problem.

use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::layout::{
    COLOR, ElementLayout, IMAGE_NAME, NORMAL, NumberType, POSITION, PlyProperty, PropertyKind,
    PropertyRole, UV,
};
use super::rows::ROWS;
use super::words::in_order;

/// Rows of constant size, big-endian if `BIG`.
struct FixedRows<'a, const BIG: bool> {
    bytes: &'a [u8],
    /// Bytes of a row, > 0.
    stride: usize,
}

/// A property of a row.
#[derive(Clone, Copy)]
struct PropertyColumn {
    /// Offset in the row.
    offset: usize,
    number: NumberType,
    levels: f32,
}

/// The lists of corners of triangles.
#[derive(Clone, Copy)]
struct Lists {
    /// Offset in the row.
    offset: usize,
    length: NumberType,
    of: NumberType,
    /// Number of vertices, below which corners are.
    vertices: u32,
}

/// Vertices, with the attributes of the file.
pub(super) struct PlyVertices {
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Option<Vec<[f32; 3]>>,
    pub(super) uvs: Option<Vec<[f32; 2]>>,
    pub(super) colors: Option<Vec<[f32; 3]>>,
}

/// Triangular faces, with colours, texture coordinates at their corners and image indices, if the
/// file has them.
#[derive(Default)]
pub(super) struct TriangleFaces {
    pub(super) corners: Vec<[u32; 3]>,
    pub(super) colors: Option<Vec<[f32; 3]>>,
    pub(super) uvs: Option<Vec<[[f32; 2]; 3]>>,
    pub(super) images: Option<Vec<i64>>,
}

/// Reads all vertices at the start of the bytes, and returns the number of bytes they take.
pub(super) fn vertices<const BIG: bool>(
    layout: &ElementLayout,
    bytes: &[u8],
) -> Option<(PlyVertices, usize)> {
    let sizes = layout.fields.iter().map(|field| match field.kind {
        PropertyKind::Scalar(number) => Some(number.size()),
        PropertyKind::List(..) => None,
    });
    let (rows, size) = FixedRows::<BIG>::new(layout, sizes, bytes)?;
    let (has_normals, has_uvs) = (layout.has(&["nx", "ny", "nz"]), layout.has_uvs());
    let has_colors = layout.color_levels().is_some();
    let vertices = PlyVertices {
        positions: rows.values(layout, POSITION)?,
        normals: if has_normals { Some(rows.values(layout, NORMAL)?) } else { None },
        uvs: if has_uvs { Some(rows.values(layout, UV)?) } else { None },
        colors: if has_colors { Some(rows.values(layout, COLOR)?) } else { None },
    };
    Some((vertices, size))
}

/// Reads all faces at the start of the bytes if they are triangles with corners below `vertices`,
/// and returns the number of bytes they take.
pub(super) fn triangles<const BIG: bool>(
    layout: &ElementLayout,
    vertices: u32,
    bytes: &[u8],
) -> Option<(TriangleFaces, usize)> {
    let (rows, size) = FixedRows::<BIG>::new(layout, sizes_of_triangles(layout), bytes)?;
    let is_list = |field: &PlyProperty| field.role == PropertyRole::Corners;
    let list = layout.fields.iter().position(is_list)?;
    if layout.fields.iter().rposition(is_list) != Some(list) || layout.has(&[IMAGE_NAME]) {
        return None;
    }
    let PropertyKind::List(length, of) = layout.fields[list].kind else { return None };
    let offset = sizes_of_triangles(layout).take(list).sum::<Option<usize>>()?;
    let corners = rows.corners(Lists { offset, length, of, vertices })?;
    let has_colors = layout.color_levels().is_some();
    let colors = if has_colors { Some(rows.values(layout, COLOR)?) } else { None };
    Some((TriangleFaces { corners, colors, ..TriangleFaces::default() }, size))
}

/// Returns the sizes of the properties of triangles, whose only list is that of the corners.
fn sizes_of_triangles(layout: &ElementLayout) -> impl Iterator<Item = Option<usize>> {
    layout.fields.iter().map(|field| match (field.kind, field.role) {
        (PropertyKind::Scalar(number), _) => Some(number.size()),
        (PropertyKind::List(length, of), PropertyRole::Corners) => {
            Some(length.size() + 3 * of.size())
        }
        (PropertyKind::List(..), _) => None,
    })
}

impl<'a, const BIG: bool> FixedRows<'a, BIG> {
    /// Creates a view of all rows of an element, whose properties have these sizes, and returns the
    /// number of bytes they take; `None` if they are few or truncated.
    fn new(
        layout: &ElementLayout,
        sizes: impl Iterator<Item = Option<usize>>,
        bytes: &'a [u8],
    ) -> Option<(Self, usize)> {
        let stride = sizes.sum::<Option<usize>>().filter(|stride| *stride > 0)?;
        let count = layout.element.count;
        let bytes = bytes.get(..count.checked_mul(stride)?)?;
        let is_plain = layout.unsupported.is_none() && count > ROWS;
        is_plain.then_some((Self { bytes, stride }, bytes.len()))
    }

    fn count(&self) -> usize {
        self.bytes.len() / self.stride
    }

    /// Reads the values of all rows in the slots from this one; `None` if any is not finite.
    fn values<const N: usize>(&self, layout: &ElementLayout, slot: usize) -> Option<Vec<[f32; N]>> {
        let columns: [_; N] = std::array::from_fn(|k| column(layout, slot + k));
        let mut values = pt_memory::zeros(self.count());
        let all_good = self.fill(&mut values, |out, rows| {
            for (k, column) in columns.iter().enumerate() {
                if let Some(column) = column {
                    self.column(rows, *column, out, k);
                }
            }
            out.as_flattened().iter().all(|x| x.is_finite())
        });
        all_good.then_some(values)
    }

    /// Fills values from rows in parallel. Returns true if `fill` returned true for all rows.
    fn fill<T: Send>(
        &self,
        values: &mut [T],
        fill: impl Fn(&mut [T], &[u8]) -> bool + Sync,
    ) -> bool {
        let all_good = AtomicBool::new(true);
        let chunks = values.par_chunks_mut(ROWS).zip(self.bytes.par_chunks(ROWS * self.stride));
        chunks.for_each(|(values, rows)| {
            if all_good.load(Ordering::Relaxed) && !fill(values, rows) {
                all_good.store(false, Ordering::Relaxed);
            }
        });
        all_good.into_inner()
    }

    /// Sets component `k` of the values to the numbers of a column.
    fn column<const N: usize>(
        &self,
        rows: &[u8],
        at: PropertyColumn,
        out: &mut [[f32; N]],
        k: usize,
    ) {
        match at.number {
            NumberType::Char => self.each(rows, at, out, k, |x| f32::from(i8::from_le_bytes(x))),
            NumberType::UChar => self.each(rows, at, out, k, |x| f32::from(u8::from_le_bytes(x))),
            NumberType::Short => self.each(rows, at, out, k, |x| f32::from(i16::from_le_bytes(x))),
            NumberType::UShort => self.each(rows, at, out, k, |x| f32::from(u16::from_le_bytes(x))),
            NumberType::Int => self.each(rows, at, out, k, |x| i32::from_le_bytes(x) as f32),
            NumberType::UInt => self.each(rows, at, out, k, |x| u32::from_le_bytes(x) as f32),
            NumberType::Float => self.each(rows, at, out, k, f32::from_le_bytes),
            NumberType::Double => self.each(rows, at, out, k, |x| f64::from_le_bytes(x) as f32),
        }
    }

    fn each<const N: usize, const BYTES: usize>(
        &self,
        rows: &[u8],
        at: PropertyColumn,
        out: &mut [[f32; N]],
        k: usize,
        number: impl Fn([u8; BYTES]) -> f32,
    ) {
        for (value, row) in out.iter_mut().zip(rows.chunks_exact(self.stride)) {
            if let Some(bytes) = row[at.offset..].first_chunk() {
                value[k] = number(in_order::<_, BIG>(*bytes)) / at.levels;
            }
        }
    }

    /// Reads the corners of triangles, whose lists are `at`; `None` if a list does not have three
    /// items, or one is no vertex.
    fn corners(&self, at: Lists) -> Option<Vec<[u32; 3]>> {
        match at.of {
            // Negative corners become larger than the number of vertices, and are rejected.
            NumberType::Char => self.lists(at, |x| i32::from(i8::from_le_bytes(x)) as u32),
            NumberType::UChar => self.lists(at, |x| u32::from(u8::from_le_bytes(x))),
            NumberType::Short => self.lists(at, |x| i32::from(i16::from_le_bytes(x)) as u32),
            NumberType::UShort => self.lists(at, |x| u32::from(u16::from_le_bytes(x))),
            NumberType::Int if i32::try_from(at.vertices).is_ok() => {
                self.lists(at, u32::from_le_bytes)
            }
            NumberType::UInt => self.lists(at, u32::from_le_bytes),
            NumberType::Int | NumberType::Float | NumberType::Double => None,
        }
    }

    fn lists<const BYTES: usize>(
        &self,
        at: Lists,
        number: impl Fn([u8; BYTES]) -> u32 + Sync,
    ) -> Option<Vec<[u32; 3]>> {
        let size = at.length.size();
        let mut three = [0; 4];
        three[if BIG { size - 1 } else { 0 }] = 3;
        let mut corners = pt_memory::zeros(self.count());
        let all_good = self.fill(&mut corners, |out: &mut [[u32; 3]], rows| {
            let (mut most, mut are_three) = (0, true);
            for (triangle, row) in out.iter_mut().zip(rows.chunks_exact(self.stride)) {
                let (length, items) = row[at.offset..].split_at(size);
                are_three &= length == &three[..size];
                for (corner, bytes) in triangle.iter_mut().zip(items.as_chunks().0) {
                    *corner = number(in_order::<_, BIG>(*bytes));
                    most = most.max(*corner);
                }
            }
            are_three && most < at.vertices
        });
        all_good.then_some(corners)
    }
}

/// Returns the column of a slot in the rows of an element; the last one if several have it.
fn column(layout: &ElementLayout, slot: usize) -> Option<PropertyColumn> {
    let mut offset = 0;
    let mut found = None;
    for (field, size) in layout.fields.iter().zip(sizes_of_triangles(layout)) {
        if let (PropertyRole::Slot { slot: its, levels }, PropertyKind::Scalar(number)) =
            (field.role, field.kind)
            && its == slot
        {
            found = Some(PropertyColumn { offset, number, levels });
        }
        offset += size.unwrap_or_default();
    }
    found
}
