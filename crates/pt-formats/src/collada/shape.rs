//! Meshes during reading.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use pt_math::DVec3;
use pt_scene::{Attribute, Attributes, Geometry, Mesh, Submesh};

use crate::collada::pool::Pool;

/// A geometry, which may be instanced several times.
#[derive(Clone)]
pub(super) struct ColladaShape<'a> {
    pub(super) geometry: Geometry,
    /// Symbol of each material slot, by which primitives refer to it.
    pub(super) symbols: Arc<[Option<&'a str>]>,
}

/// Set of texture coordinates by material symbol, as far as an instance specifies it.
pub(super) type Sets<'a> = BTreeMap<&'a str, usize>;

/// Index that marks a missing normal or texture coordinate of a corner.
pub(super) const MISSING: u32 = u32::MAX;

/// A mesh under construction.
#[derive(Default)]
pub(super) struct MeshBuilder<'a> {
    pub(super) positions: Pool<3>,
    pub(super) normals: Pool<3>,
    pub(super) uvs: Pool<2>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Indices of normals and texture coordinates, per triangle; may be [`MISSING`].
    pub(super) normal_corners: Vec<[u32; 3]>,
    pub(super) uv_corners: Vec<[u32; 3]>,
    pub(super) symbols: Vec<Option<&'a str>>,
    slots: HashMap<Option<&'a str>, u32>,
    parts: Vec<Submesh>,
}

impl<'a> MeshBuilder<'a> {
    /// Assigns the triangles that were added since the last call to the slot of a material symbol.
    pub(super) fn close_part(&mut self, symbol: Option<&'a str>) {
        let start = self.parts.last().map_or(0, |part| part.triangles.end);
        let end = self.triangles.len() as u32;
        if start == end {
            return;
        }
        let slot = *self.slots.entry(symbol).or_insert_with(|| {
            self.symbols.push(symbol);
            self.symbols.len() as u32 - 1
        });
        match self.parts.last_mut() {
            Some(part) if part.slot == slot => part.triangles.end = end,
            _ => self.parts.push(Submesh { triangles: start..end, slot }),
        }
    }

    pub(super) fn finish(self, name: String) -> Mesh {
        let (positions, triangles) = (self.positions.values, self.triangles);
        let flat_normal = |triangle: usize| {
            let [a, b, c] = triangles[triangle].map(|i| {
                let [x, y, z] = positions[i as usize].map(f64::from);
                DVec3::new(x, y, z)
            });
            (b - a).cross(c - a).normalize_or_zero().as_vec3().to_array()
        };
        let normals = attribute(self.normals.values, self.normal_corners, &triangles, flat_normal);
        let uvs = attribute(self.uvs.values, self.uv_corners, &triangles, |_| [0.0; 2]);
        Mesh {
            name,
            positions: positions.into(),
            triangles: triangles.into(),
            normals,
            uvs,
            colors: None,
            face_colors: None,
            attributes: Attributes::default(),
            submeshes: self.parts,
        }
    }
}

/// Creates an attribute; missing values are filled in per triangle. `None` if all are missing.
fn attribute<const N: usize>(
    mut values: Vec<[f32; N]>,
    mut corners: Vec<[u32; 3]>,
    triangles: &[[u32; 3]],
    fill: impl Fn(usize) -> [f32; N],
) -> Option<Attribute<[f32; N]>> {
    if values.is_empty() {
        return None;
    }
    for (triangle, indices) in corners.iter_mut().enumerate() {
        if indices.contains(&MISSING) {
            *indices = [values.len() as u32; 3];
            values.push(fill(triangle));
        }
    }
    let indices = (corners != triangles).then_some(corners);
    Some(Attribute { values: values.into(), indices: indices.map(Into::into) })
}
