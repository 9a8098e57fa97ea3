//! Geometries: meshes, and the spheres of the course's profile.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use pt_math::DVec3;

use super::primitives;
use super::reader::{Reader, child, course_techniques, elements, name_of};
use super::source::Pool;
use crate::format::xml::Node;
use crate::{Attribute, Attributes, Geometry, LoadError, Mesh, Submesh};

/// A geometry as it may be placed many times.
#[derive(Clone)]
pub(super) struct Shape<'a> {
    pub(super) geometry: Geometry,
    /// Symbol by which primitives refer to each material slot.
    pub(super) symbols: Arc<[Option<&'a str>]>,
}

/// Which set of texture coordinates the material of a symbol lies on, where an instance says so.
pub(super) type Sets<'a> = BTreeMap<&'a str, usize>;

/// Reads a geometry, once for the same sets of texture coordinates; `None`, with a warning, if
/// there is nothing to see.
pub(super) fn read<'a>(
    reader: &mut Reader<'a>,
    geometry: Node<'a>,
    sets: Sets<'a>,
) -> Result<Option<Shape<'a>>, LoadError> {
    let key = (geometry.id(), sets);
    if let Some(shape) = reader.shapes.get(&key) {
        return Ok(shape.clone());
    }
    let sphere = course_techniques(geometry).find_map(|t| child(t, "sphere"));
    let shape = match (child(geometry, "mesh"), sphere) {
        (Some(mesh), _) => read_mesh(reader, geometry, mesh, &key.1)?,
        (None, Some(sphere)) => Some(read_sphere(reader, sphere)?),
        (None, None) => {
            let message = match elements(geometry).map(|n| n.tag_name().name()).next() {
                Some(tag @ ("convex_mesh" | "spline" | "brep")) => {
                    format!("<{tag}> is not supported; it is left out")
                }
                _ => "it has no <mesh>; it is left out".to_owned(),
            };
            reader.warn(geometry, message);
            None
        }
    };
    reader.shapes.insert(key, shape.clone());
    Ok(shape)
}

fn read_sphere<'a>(reader: &mut Reader<'a>, sphere: Node<'a>) -> Result<Shape<'a>, LoadError> {
    let Some(element) = child(sphere, "radius") else {
        return Err(
            reader.error(sphere, "it has no <radius>; expected, for example, <radius>1</radius>")
        );
    };
    let radius = reader.scalar(element)?;
    if radius <= 0.0 {
        return Err(reader.error(element, format!("expected a radius above 0, found {radius}")));
    }
    Ok(Shape { geometry: Geometry::Sphere { radius }, symbols: Arc::new([None]) })
}

fn read_mesh<'a>(
    reader: &mut Reader<'a>,
    geometry: Node<'a>,
    mesh: Node<'a>,
    sets: &Sets<'a>,
) -> Result<Option<Shape<'a>>, LoadError> {
    let mut builder = Builder::default();
    for element in elements(mesh) {
        match element.tag_name().name() {
            "triangles" | "polylist" | "polygons" | "tristrips" | "trifans" => {
                primitives::read(reader, &mut builder, element, sets)?;
            }
            tag @ ("lines" | "linestrips") => {
                reader.warn(element, format!("<{tag}> have no area; they are left out"));
            }
            _ => {}
        }
    }
    if builder.triangles.is_empty() {
        reader.warn(geometry, "it has no triangles; it is left out");
        return Ok(None);
    }
    let symbols = builder.symbols.as_slice().into();
    let mesh = builder.finish(name_of(geometry));
    Ok(Some(Shape { geometry: Geometry::Mesh(Arc::new(mesh)), symbols }))
}

/// Stands for the normal or the texture coordinates of a corner whose primitive has none.
pub(super) const MISSING: u32 = u32::MAX;

/// A mesh to which primitives are added.
#[derive(Default)]
pub(super) struct Builder<'a> {
    pub(super) positions: Pool<3>,
    pub(super) normals: Pool<3>,
    pub(super) uvs: Pool<2>,
    pub(super) triangles: Vec<[u32; 3]>,
    /// Indices of normals and texture coordinates, per triangle; may be [`MISSING`].
    pub(super) normal_corners: Vec<[u32; 3]>,
    pub(super) uv_corners: Vec<[u32; 3]>,
    symbols: Vec<Option<&'a str>>,
    slots: HashMap<Option<&'a str>, u32>,
    parts: Vec<Submesh>,
}

impl<'a> Builder<'a> {
    /// Gives the triangles that were added since the last call to the slot of a material symbol.
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

    fn finish(self, name: String) -> Mesh {
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
            positions,
            triangles,
            normals,
            uvs,
            colors: None,
            face_colors: None,
            attributes: Attributes::default(),
            submeshes: self.parts,
        }
    }
}

/// Values at corners, with those that are missing filled in per triangle; `None` if all are.
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
    Some(Attribute { values, indices })
}
