//! Geometries: meshes, and the spheres of the profile `CGL`.

use std::sync::Arc;

use pt_scene::Geometry;

use super::primitives;
use super::reader::{ColladaReader, cgl_techniques, child, elements, name_of};
use crate::LoadError;
use crate::collada::shape::{ColladaShape, MeshBuilder, Sets};
use crate::shared::xml::XmlNode;

/// Reads a geometry, once per combination of sets of texture coordinates; `None`, with a warning,
/// if it has no surface.
pub(super) fn read<'a>(
    reader: &mut ColladaReader<'a>,
    geometry: XmlNode<'a>,
    sets: Sets<'a>,
) -> Result<Option<ColladaShape<'a>>, LoadError> {
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

fn read_sphere<'a>(
    reader: &mut ColladaReader<'a>,
    sphere: XmlNode<'a>,
) -> Result<ColladaShape<'a>, LoadError> {
    let Some(element) = child(sphere, "radius") else {
        return Err(
            reader.error(sphere, "missing <radius>; expected, for example, <radius>1</radius>")
        );
    };
    let radius = reader.scalar(element)?;
    if radius <= 0.0 {
        return Err(reader.error(element, format!("expected a radius above 0, found {radius}")));
    }
    Ok(ColladaShape { geometry: Geometry::Sphere { radius }, symbols: Arc::new([None]) })
}

fn read_mesh<'a>(
    reader: &mut ColladaReader<'a>,
    geometry: XmlNode<'a>,
    mesh: XmlNode<'a>,
    sets: &Sets<'a>,
) -> Result<Option<ColladaShape<'a>>, LoadError> {
    let mut builder = MeshBuilder::default();
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
    Ok(Some(ColladaShape { geometry: Geometry::Mesh(Arc::new(mesh)), symbols }))
}
