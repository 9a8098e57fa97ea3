//! COLLADA 1.4 and 1.5 (`.dae`).
//!
//! Supported are meshes, cameras, lights, materials of the common profile with their images (as the
//! nearest physical material), the node hierarchy with all kinds of transforms, and skins in their
//! bind pose; and the profile `CGL` (in older files `CMU462`) of a university course, which adds
//! spheres, area lights and physical materials. Animations, physics and splines are not supported;
//! the [warnings](Scene::warnings) list where a file has them.
//!
//! Sources: COLLADA Digital Asset Schema Release 1.4.1 and 1.5.0 (Khronos Group, 2008).

mod attenuation;
mod camera;
pub mod compat;
mod coordinates;
mod effect;
mod falloff;
mod geometry;
mod light;
mod material;
mod nodes;
mod pool;
mod primitives;
mod reader;
mod shape;
mod source;
mod texture;
mod transform;

use std::path::Path;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::Scene;
use reader::{ColladaReader, child};

use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::xml;
use crate::shared::xml::{XmlNode, XmlNumber};

/// Reads a COLLADA document.
///
/// The up axis of the file becomes +y; lengths keep the unit of the file.
///
/// # Errors
/// Returns an error with line and element if the file is no COLLADA, has unresolved references, or
/// contains invalid numbers.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    let text = xml::decode(bytes, path)?;
    let document = xml::XmlDocument::parse(&text, path, context.limits())?;
    let root = document.root();
    let tag = root.tag_name().name();
    if tag != "COLLADA" {
        let message = format!("found <{tag}>, expected <COLLADA>");
        return Err(document.error(root, message));
    }
    let mut reader = ColladaReader::new(&document, context);
    context.expect_pictures(texture::pictures(&reader));
    let asset = child(root, "asset");
    reader.scene.metres_per_unit = metres_per_unit(&mut reader, asset);
    let to_y_up = to_y_up(&reader, asset)?;
    let visual_scene = visual_scene(&mut reader)?;
    nodes::place(&mut reader, visual_scene, to_y_up)?;
    attenuation::settle(&mut reader);
    if let Some(at) = document.first_comma() {
        reader.warn_at(at, "decimal commas, here and below, are read as points".to_owned());
    }
    Ok(reader.finish())
}

/// Returns the length of the unit; 1 m by default.
fn metres_per_unit(reader: &mut ColladaReader<'_>, asset: Option<XmlNode<'_>>) -> f64 {
    let Some(unit) = asset.and_then(|a| child(a, "unit")) else { return 1.0 };
    let Some(written) = unit.attribute("meter") else { return 1.0 };
    let written = written.trim();
    match written.parse().ok().or_else(|| f64::with_comma(written)) {
        Some(metres) if metres > 0.0 && metres.is_finite() => metres,
        _ => {
            let message = format!(
                "found meter={}, expected a positive number; a unit of 1 m is used",
                crate::shared::names::quote(written)
            );
            reader.warn(unit, message);
            1.0
        }
    }
}

/// Returns the rotation from the axes of the file to those of [`Scene`].
fn to_y_up(reader: &ColladaReader<'_>, asset: Option<XmlNode<'_>>) -> Result<DAffine3, LoadError> {
    let Some(up_axis) = asset.and_then(|a| child(a, "up_axis")) else {
        return Ok(DAffine3::IDENTITY);
    };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    // Images of the axes of the file.
    let columns = match up_axis.text().unwrap_or_default().trim() {
        "X_UP" => DMat3::from_cols(y, x, -z),
        "Y_UP" => DMat3::IDENTITY,
        "Z_UP" => DMat3::from_cols(-x, z, y),
        other => {
            let message = format!(
                "found axis {}, expected X_UP, Y_UP or Z_UP",
                crate::shared::names::quote(other)
            );
            return Err(reader.document.error(up_axis, message));
        }
    };
    Ok(DAffine3::from_mat3(columns))
}

/// Returns the visual scene that the file instances.
fn visual_scene<'a>(reader: &mut ColladaReader<'a>) -> Result<XmlNode<'a>, LoadError> {
    let root = reader.document.root();
    let instance = child(root, "scene").and_then(|s| child(s, "instance_visual_scene"));
    if let Some(instance) = instance
        && let Some(found) = reader.resolve(instance, "url", &["visual_scene"])?
    {
        return Ok(found);
    }
    let first = reader.document.elements().find(|n| n.tag_name().name() == "visual_scene");
    let Some(first) = first else {
        let message = "missing scene; expected a <visual_scene> in <library_visual_scenes>, and \
                       <scene> with an <instance_visual_scene>";
        return Err(reader.document.error(root, message));
    };
    reader.warn(
        first,
        "missing <scene> with an <instance_visual_scene>; the first <visual_scene> is used",
    );
    Ok(first)
}
