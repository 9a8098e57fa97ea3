//! Geometries: meshes, and the spheres of the profile `CGL`.

use std::sync::Arc;

use pt_scene::Geometry;

use super::primitives;
use super::reader::{Reader, cgl_techniques, child, elements, name_of};
use crate::LoadError;
use crate::collada::shape::{Builder, Sets, Shape};
use crate::shared::xml::Node;

/// Reads a geometry, once per combination of sets of texture coordinates; `None`, with a warning,
/// if it has no surface.
pub(super) fn read<'a>(
    reader: &mut Reader<'a>,
    geometry: Node<'a>,
    sets: Sets<'a>,
) -> Result<Option<Shape<'a>>, LoadError> {
    let key = (geometry.id(), sets);
    if let Some(shape) = reader.shapes.get(&key) {
        return Ok(shape.clone());
    }
    let sphere = cgl_techniques(geometry).find_map(|t| child(t, "sphere"));
    let shape = match (child(geometry, "mesh"), sphere) {
        (Some(mesh), _) => read_mesh(reader, geometry, mesh, &key.1)?,
        (None, Some(sphere)) => Some(read_sphere(reader, sphere)?),
        (None, None) => {
            let message = match elements(geometry).map(|n| n.tag_name().name()).next() {
                Some(tag @ ("convex_mesh" | "spline" | "brep")) => {
                    format!("<{tag}> is not supported; it is omitted")
                }
                _ => "missing <mesh>; the geometry is omitted".to_owned(),
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
            reader.error(sphere, "missing <radius>; expected, for example, <radius>1</radius>")
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
                reader.warn(element, format!("<{tag}> have no area; they are omitted"));
            }
            _ => {}
        }
    }
    if builder.triangles.is_empty() {
        reader.warn(geometry, "geometry without triangles; it is omitted");
        return Ok(None);
    }
    let symbols = builder.symbols.as_slice().into();
    let mesh = builder.finish(name_of(geometry));
    Ok(Some(Shape { geometry: Geometry::Mesh(Arc::new(mesh)), symbols }))
}
