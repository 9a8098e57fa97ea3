//! Triangle meshes.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::Shared;

/// A triangle mesh in its own coordinates.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Name in the file.
    pub name: String,
    /// Vertex positions.
    pub positions: Shared<[f32; 3]>,
    /// Corners of each triangle, as indices into `positions`, counter-clockwise as seen from the
    /// front.
    pub triangles: Shared<[u32; 3]>,
    /// Normals at corners, of any length; `None` for flat shading.
    pub normals: Option<Attribute<[f32; 3]>>,
    /// Texture coordinates at corners, v upwards. Those of Mitsuba scenes keep the convention of
    /// Mitsuba: v = 0 is the upper row of an image.
    pub uvs: Option<Attribute<[f32; 2]>>,
    /// Colours at corners, linear Rec. 709.
    pub colors: Option<Attribute<[f32; 3]>>,
    /// Colour of each triangle, linear Rec. 709.
    pub face_colors: Option<Shared<[f32; 3]>>,
    /// Named attributes.
    pub attributes: Attributes,
    /// Runs of triangles that share a material slot; together they cover all triangles in order.
    pub submeshes: Vec<Submesh>,
}

impl Mesh {
    /// Returns the memory of the arrays, in bytes.
    pub fn bytes(&self) -> u64 {
        fn list<T>(values: &[T]) -> u64 {
            size_of_val(values) as u64
        }
        fn attribute<T>(attribute: Option<&Attribute<T>>) -> u64 {
            attribute.map_or(0, |a| list(&a.values) + a.indices.as_deref().map_or(0, list))
        }
        list(&self.positions)
            + list(&self.triangles)
            + attribute(self.normals.as_ref())
            + attribute(self.uvs.as_ref())
            + attribute(self.colors.as_ref())
            + self.face_colors.as_deref().map_or(0, list)
            + self.attributes.all().map(|(_, values)| list(values)).sum::<u64>()
            + list(&self.submeshes)
    }
}

/// Named attributes of a mesh, with three channels each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attributes {
    /// One value per position, interpolated linearly over the triangles.
    pub vertices: BTreeMap<String, Shared<[f32; 3]>>,
    /// One value per triangle.
    pub faces: BTreeMap<String, Shared<[f32; 3]>>,
}

impl Attributes {
    /// Iterates over the attributes of positions, then over those of triangles.
    pub fn all(&self) -> impl Iterator<Item = (&String, &Shared<[f32; 3]>)> {
        self.vertices.iter().chain(&self.faces)
    }
}

/// Values at the corners of triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute<T> {
    /// Distinct values.
    pub values: Shared<T>,
    /// Three indices into `values` per triangle; `None` if they equal those of the positions.
    pub indices: Option<Shared<[u32; 3]>>,
}

impl<T: Copy> Attribute<T> {
    /// Returns the indices of the corners of a triangle whose position indices are `corners`.
    pub fn corners(&self, triangle: usize, corners: [u32; 3]) -> [u32; 3] {
        self.indices.as_ref().map_or(corners, |i| i[triangle])
    }
}

/// Triangles that share a material slot of their object.
#[derive(Clone, Debug, PartialEq)]
pub struct Submesh {
    /// Range of triangles.
    pub triangles: Range<u32>,
    /// Index into [`crate::Object::materials`].
    pub slot: u32,
}
