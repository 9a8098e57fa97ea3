//! Accessors: typed numbers in buffers. [glTF 2.0, §3.6.2]
//!
//! Floats and integers that can be used as stored are read in tight, parallel loops. All other
//! accessors are read as double-precision numbers, to which sparse substitution and normalization
//! are applied.

use std::cell::Cell;

use bytemuck::Zeroable;
use rayon::prelude::*;

use super::buffer::{BufferView, Buffers};
use super::item::Item;
use crate::LoadError;

/// Maximum number of elements of an accessor without a buffer view.
const MAX_ZEROS: usize = 1 << 22;
/// Maximum number of such elements in all accessors, counted each time they are read.
const MAX_ALL_ZEROS: usize = 1 << 24;
/// Maximum number of components read from all accessors of a scene, counted each time they are
/// read.
const MAX_NUMBERS: usize = 1 << 30;

/// Number of elements per parallel task.
const ELEMENTS: usize = 1 << 14;

/// Component type of an accessor.
#[derive(Clone, Copy, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: usize) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// Decodes the number in the first [`Self::size`] bytes.
    fn read(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Self::I8, &[a, ..]) => f64::from(a as i8),
            (Self::U8, &[a, ..]) => f64::from(a),
            (Self::I16, &[a, b, ..]) => f64::from(i16::from_le_bytes([a, b])),
            (Self::U16, &[a, b, ..]) => f64::from(u16::from_le_bytes([a, b])),
            (Self::U32, &[a, b, c, d, ..]) => f64::from(u32::from_le_bytes([a, b, c, d])),
            (Self::F32, &[a, b, c, d, ..]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => unreachable!("elements are cut to their size"),
        }
    }

    /// Divisor of normalized integers. [glTF 2.0, §3.11]
    fn highest(self) -> f64 {
        match self {
            Self::I8 => 127.0,
            Self::U8 => 255.0,
            Self::I16 => 32_767.0,
            Self::U16 => 65_535.0,
            Self::U32 | Self::F32 => 1.0,
        }
    }
}

/// Undecoded elements in a buffer view.
struct ElementBytes<'b> {
    bytes: &'b [u8],
    stride: usize,
    component: Component,
    count: usize,
    width: usize,
}

impl<'b> ElementBytes<'b> {
    /// Creates a column of `count` elements of `width` numbers that begins at byte `offset` of a
    /// view. The error is a message.
    fn new(
        view: BufferView<'b>,
        offset: usize,
        component: Component,
        count: usize,
        width: usize,
    ) -> Result<Self, String> {
        let size = component.size() * width;
        let stride = view.stride.unwrap_or(size);
        if stride < size {
            return Err(format!(
                "found a stride of {stride} bytes, expected at least the element size of {size}"
            ));
        }
        let span = count.checked_sub(1).map_or(Some(0), |steps| steps.checked_mul(stride));
        let end = span
            .and_then(|span| span.checked_add(if count == 0 { 0 } else { size }))
            .and_then(|span| span.checked_add(offset));
        if end.is_none_or(|end| end > view.bytes.len()) {
            let bytes = view.bytes.len();
            return Err(format!(
                "{count} elements of {size} bytes, every {stride} bytes from byte {offset} on, \
                 exceed the buffer view of {bytes} bytes"
            ));
        }
        Ok(Self { bytes: &view.bytes[offset..], stride, component, count, width })
    }

    /// Returns all numbers, element by element.
    fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let size = self.component.size();
        (0..self.count).flat_map(move |i| {
            let element = &self.bytes[i * self.stride..];
            (0..self.width).map(move |c| self.component.read(&element[c * size..][..size]))
        })
    }
}

impl ElementBytes<'_> {
    /// Reads all elements. `N` must be the width of the column, `SIZE` the size of its components
    /// in bytes.
    fn read<T: Zeroable + Send, const N: usize, const SIZE: usize>(
        &self,
        number: impl Fn([u8; SIZE]) -> T + Sync,
    ) -> Vec<[T; N]> {
        let mut elements: Vec<[T; N]> = pt_memory::zeros(self.count);
        let fill = |(chunk, elements): (usize, &mut [[T; N]])| {
            let bytes = &self.bytes[chunk * ELEMENTS * self.stride..];
            if self.stride == N * SIZE {
                let values = elements.as_flattened_mut().iter_mut();
                values.zip(bytes.as_chunks().0).for_each(|(value, bytes)| *value = number(*bytes));
                return;
            }
            let rows = bytes.chunks(self.stride);
            for (element, row) in elements.iter_mut().zip(rows) {
                for (value, bytes) in element.iter_mut().zip(row.as_chunks().0) {
                    *value = number(*bytes);
                }
            }
        };
        if self.count <= ELEMENTS {
            fill((0, &mut elements));
        } else {
            elements.par_chunks_mut(ELEMENTS).enumerate().for_each(fill);
        }
        elements
    }
}

/// An accessor with its component type and shape.
struct TypedAccessor<'a> {
    accessor: Item<'a>,
    component: Component,
    /// Number of elements.
    count: usize,
    /// Numbers per element.
    width: usize,
}

/// Reads accessors and limits the total number of components.
pub(super) struct Accessors<'a> {
    root: Item<'a>,
    buffers: &'a Buffers<'a>,
    left: usize,
    zeros_left: Cell<usize>,
}

/// Numbers of an accessor.
pub(super) struct AccessorNumbers {
    /// All elements, concatenated.
    pub(super) values: Vec<f64>,
    /// Numbers per element.
    pub(super) width: usize,
    /// Value that stands for 1 in integers that are not marked as normalized; `None` for floats and
    /// normalized integers.
    pub(super) highest: Option<f64>,
}

impl<'a> Accessors<'a> {
    pub(super) fn new(root: Item<'a>, buffers: &'a Buffers<'a>) -> Self {
        Self { root, buffers, left: MAX_NUMBERS, zeros_left: Cell::new(MAX_ALL_ZEROS) }
    }

    /// Returns the elements of the accessor to which field `by` of `from` refers, in single
    /// precision, or `None` if there is no such field.
    ///
    /// # Errors
    /// If the accessor does not have `N` numbers per element, exceeds its buffer, or has a number
    /// that is not finite.
    pub(super) fn vectors<const N: usize>(
        &mut self,
        from: &Item<'_>,
        by: &str,
    ) -> Result<Option<Vec<[f32; N]>>, LoadError> {
        let Some(found) = self.found(from, by, &[N])? else { return Ok(None) };
        if let (Component::F32, Some(column)) = (found.component, self.as_stored(&found)?) {
            let values = column.read(f32::from_le_bytes);
            check_finite(&found.accessor, values.as_flattened(), N)?;
            return Ok(Some(values));
        }
        let numbers = self.values(&found)?;
        let elements = numbers.as_chunks::<N>().0.iter();
        Ok(Some(elements.map(|element| element.map(|x| x as f32)).collect()))
    }

    /// Like [`Self::vectors`], for non-negative integers.
    pub(super) fn wholes<const N: usize>(
        &mut self,
        from: &Item<'_>,
        by: &str,
    ) -> Result<Option<Vec<[u32; N]>>, LoadError> {
        let Some(found) = self.found(from, by, &[N])? else { return Ok(None) };
        if let Some(column) = self.as_stored(&found)? {
            match found.component {
                Component::U8 => return Ok(Some(column.read(|[x]: [u8; 1]| x.into()))),
                Component::U16 => return Ok(Some(column.read(|x| u16::from_le_bytes(x).into()))),
                Component::U32 => return Ok(Some(column.read(u32::from_le_bytes))),
                Component::I8 | Component::I16 | Component::F32 => {}
            }
        }
        let numbers = self.values(&found)?;
        if let Some(bad) = numbers.iter().find(|x| **x < 0.0 || x.fract() != 0.0) {
            let message = format!("expected whole numbers from 0 up, found {bad}");
            return Err(from.refuse(by, message));
        }
        let elements = numbers.as_chunks::<N>().0.iter();
        Ok(Some(elements.map(|element| element.map(|x| x as u32)).collect()))
    }

    /// Returns the numbers of an accessor of one of the given widths, or `None` if there is no such
    /// field.
    pub(super) fn numbers(
        &mut self,
        from: &Item<'_>,
        by: &str,
        widths: &[usize],
    ) -> Result<Option<AccessorNumbers>, LoadError> {
        let Some(found) = self.found(from, by, widths)? else { return Ok(None) };
        let TypedAccessor { component, width, .. } = found;
        let is_marked = component == Component::F32 || found.accessor.flag("normalized")?;
        let highest = (!is_marked).then(|| component.highest());
        Ok(Some(AccessorNumbers { values: self.values(&found)?, width, highest }))
    }

    /// Looks up an accessor of one of the given widths and counts its numbers against the limit;
    /// `None` if there is no such field.
    fn found(
        &mut self,
        from: &Item<'_>,
        by: &str,
        widths: &[usize],
    ) -> Result<Option<TypedAccessor<'a>>, LoadError> {
        let Some(index) = from.whole(by)? else { return Ok(None) };
        let accessor = self.root.member("accessors", index, from, by)?;
        let width = width(&accessor)?;
        if !widths.contains(&width) {
            let expected: Vec<_> = widths.iter().map(ToString::to_string).collect();
            let message = format!(
                "found elements of {width} numbers in accessors[{index}], expected {}",
                expected.join(" or ")
            );
            return Err(from.refuse(by, message));
        }
        let component = component(&accessor)?;
        let count = accessor.needed("count")?;
        self.left = count
            .checked_mul(width)
            .and_then(|numbers| self.left.checked_sub(numbers))
            .ok_or_else(|| {
                let message = format!("the accessors of the scene exceed {MAX_NUMBERS} numbers");
                accessor.error(message)
            })?;
        Ok(Some(TypedAccessor { accessor, component, count, width }))
    }

    /// Returns the elements of an accessor in its buffer, or `None` if it is sparse, normalized or
    /// has no buffer view.
    fn as_stored(&self, found: &TypedAccessor<'a>) -> Result<Option<ElementBytes<'_>>, LoadError> {
        let accessor = &found.accessor;
        if accessor.child("sparse")?.is_some() || accessor.flag("normalized")? {
            return Ok(None);
        }
        self.column(found)
    }

    /// Reads all numbers of an accessor, with sparse substitution and normalization.
    fn values(&self, found: &TypedAccessor<'a>) -> Result<Vec<f64>, LoadError> {
        let &TypedAccessor { ref accessor, component, count, width } = found;
        let mut values = self.dense(found)?;
        if let Some(sparse) = accessor.child("sparse")? {
            self.replace(&sparse, component, width, count, &mut values)?;
        }
        if accessor.flag("normalized")? {
            let highest = component.highest();
            for value in &mut values {
                *value = (*value / highest).max(-1.0);
            }
        }
        check_finite(accessor, &values, width)?;
        Ok(values)
    }

    /// Reads the numbers in the buffer view of an accessor; zeros if it has none.
    fn dense(&self, found: &TypedAccessor<'a>) -> Result<Vec<f64>, LoadError> {
        if let Some(column) = self.column(found)? {
            return Ok(column.numbers().collect());
        }
        let TypedAccessor { accessor, count, width, .. } = found;
        if *count > MAX_ZEROS {
            let message = format!(
                "found {count} elements without a buffer view, expected at most {MAX_ZEROS}"
            );
            return Err(accessor.refuse("count", message));
        }
        let Some(left) = self.zeros_left.get().checked_sub(*count) else {
            let message =
                format!("the accessors without a buffer view exceed {MAX_ALL_ZEROS} elements");
            return Err(accessor.refuse("count", message));
        };
        self.zeros_left.set(left);
        Ok(vec![0.0; count * width])
    }

    /// Returns the elements of an accessor in its buffer, or `None` if it has no buffer view.
    fn column(&self, found: &TypedAccessor<'a>) -> Result<Option<ElementBytes<'_>>, LoadError> {
        let &TypedAccessor { ref accessor, component, count, width } = found;
        let Some(view) = accessor.whole("bufferView")? else { return Ok(None) };
        let view = self.buffers.view(&self.root, view, accessor, "bufferView")?;
        let offset = accessor.whole("byteOffset")?.unwrap_or(0);
        let column = ElementBytes::new(view, offset, component, count, width);
        column.map(Some).map_err(|message| accessor.error(message))
    }

    /// Applies sparse substitution to the values of an accessor. [glTF 2.0, §3.6.2.3]
    fn replace(
        &self,
        sparse: &Item<'a>,
        component: Component,
        width: usize,
        count: usize,
        values: &mut [f64],
    ) -> Result<(), LoadError> {
        let replaced = sparse.needed("count")?;
        let part = |name: &str, width: usize, given: Option<Component>| {
            let missing = || sparse.error(format!("missing \"{name}\""));
            let part = sparse.child(name)?.ok_or_else(missing)?;
            let view =
                self.buffers.view(&self.root, part.needed("bufferView")?, &part, "bufferView")?;
            let offset = part.whole("byteOffset")?.unwrap_or(0);
            let kind = given.map_or_else(|| self::component(&part), Ok)?;
            ElementBytes::new(view, offset, kind, replaced, width)
                .map_err(|message| part.error(message))
        };
        let indices = part("indices", 1, None)?;
        let others = part("values", width, Some(component))?;
        let others: Vec<f64> = others.numbers().collect();
        for (index, other) in indices.numbers().zip(others.chunks_exact(width)) {
            if !(0.0..count as f64).contains(&index) || index.fract() != 0.0 {
                let message =
                    format!("found the index {index}, expected an index of the {count} elements");
                return Err(sparse.refuse("indices", message));
            }
            let first = index as usize * width;
            values[first..first + width].copy_from_slice(other);
        }
        Ok(())
    }
}

/// Returns true if `test` holds for all parts of `values`. The parts are tested in parallel if
/// there are many values.
pub(super) fn all_parts<T: Sync>(values: &[T], test: impl Fn(&[T]) -> bool + Sync) -> bool {
    if values.len() <= ELEMENTS {
        return test(values);
    }
    values.par_chunks(ELEMENTS).all(&test)
}

/// Checks that all numbers of the elements of an accessor are finite.
fn check_finite<T: Copy + Into<f64> + Sync>(
    accessor: &Item<'_>,
    values: &[T],
    width: usize,
) -> Result<(), LoadError> {
    let are_finite = |part: &[T]| part.iter().fold(true, |all, x| all & (*x).into().is_finite());
    if all_parts(values, are_finite) {
        return Ok(());
    }
    let Some(place) = values.iter().position(|x| !(*x).into().is_finite()) else { return Ok(()) };
    let (element, bad) = (place / width, values[place].into());
    Err(accessor.error(format!("found {bad} in element {element}, expected finite numbers")))
}

/// Numbers per element.
fn width(accessor: &Item<'_>) -> Result<usize, LoadError> {
    Ok(match accessor.text("type")? {
        Some("SCALAR") => 1,
        Some("VEC2") => 2,
        Some("VEC3") => 3,
        Some("VEC4") => 4,
        Some("MAT4") => 16,
        _ => {
            let message = "expected SCALAR, VEC2, VEC3, VEC4 or MAT4";
            return Err(accessor.refuse("type", message));
        }
    })
}

fn component(item: &Item<'_>) -> Result<Component, LoadError> {
    let code = item.needed("componentType")?;
    Component::of(code).ok_or_else(|| {
        let message =
            format!("found number type {code}, expected 5120, 5121, 5122, 5123, 5125 or 5126");
        item.refuse("componentType", message)
    })
}
