//! `<emitter>`: lights.

use std::sync::Arc;

use pt_image::{PixelEncoding, Transfer};
use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::texture::{Bitmap, Color, Input, Pattern, Texture};
use pt_scene::{Light, LightKind, Rows};

use super::daylight;
use super::object::{ColorRole, MitsubaObject, ObjectTree, Parameters, error, unsupported};
use super::sensor::fields_of_view;
use super::texture::MitsubaTextureCache;
use crate::LoadError;
use crate::mitsuba::turn::{TOLERANCE, turn, turned};
use crate::shared::placeholder;
use crate::shared::transform::perpendicular;

const KINDS: [&str; 10] = [
    "area (inside a shape)",
    "constant",
    "directional",
    "envmap",
    "ies",
    "point",
    "projector",
    "spot",
    "sunsky",
    "timed_sunsky",
];

/// Reads the radiance of an area emitter of a shape.
pub(super) fn area(
    textures: &mut MitsubaTextureCache<'_>,
    object: &MitsubaObject,
) -> Result<Color, LoadError> {
    if object.kind != "area" {
        return Err(unsupported(object, &["area (inside a shape)"]));
    }
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["sampling_weight"]);
    let radiance = match textures.of(object, "radiance")? {
        Some(texture) => Input::Texture(texture),
        None => Input::Value(parameters.color("radiance", ColorRole::Emission, 1.0)?),
    };
    parameters.finish()?;
    Ok(radiance)
}

/// Reads an emitter without a shape.
pub(super) fn light(
    textures: &mut MitsubaTextureCache<'_>,
    object: &MitsubaObject,
) -> Result<Light, LoadError> {
    let tree = textures.tree;
    let texture = match object.kind.as_str() {
        "spot" => textures.of(object, "texture")?,
        "projector" => textures.of(object, "irradiance")?,
        _ => {
            tree.children(object, &[])?;
            None
        }
    };
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["sampling_weight"]);
    let (to_world, kind) = match object.kind.as_str() {
        "constant" => {
            let radiance = parameters.color("radiance", ColorRole::Emission, 1.0)?;
            (DAffine3::IDENTITY, LightKind::Constant { radiance, portal: None })
        }
        "point" => {
            let node = parameters.transform("to_world")?;
            let position = either(&mut parameters, "position")?.unwrap_or(node.translation);
            let intensity = parameters.color("intensity", ColorRole::Emission, 1.0)?;
            (DAffine3::from_translation(position), LightKind::Point { intensity })
        }
        "directional" => {
            let node = parameters.transform("to_world")?;
            let direction = either(&mut parameters, "direction")?.unwrap_or(node.matrix3.z_axis);
            let Some(direction) = direction.try_normalize() else {
                return Err(parameters
                    .refuse("direction", "found a zero direction, expected a non-zero direction"));
            };
            let irradiance = parameters.color("irradiance", ColorRole::Emission, 1.0)?;
            (shining_along(direction), LightKind::Directional { irradiance })
        }
        "envmap" => envmap(tree, object, &mut parameters)?,
        "ies" => luminaire(tree, object, &mut parameters)?,
        "sunsky" => daylight::sunsky(&mut parameters)?,
        "timed_sunsky" => daylight::timed_sunsky(&mut parameters)?,
        "spot" => spot(&mut parameters, texture)?,
        "projector" => projector(&mut parameters, texture)?,
        "area" => {
            let message =
                "emitter \"area\" outside of a shape, expected inside of the <shape> that emits";
            return Err(error(&object.at, message));
        }
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    Ok(Light { name: object.name().to_owned(), to_world, kind, at: object.at.clone() })
}

/// Reads a spot light; with a texture, it projects an image.
fn spot(
    parameters: &mut Parameters<'_>,
    texture: Option<Arc<Texture>>,
) -> Result<(DAffine3, LightKind), LoadError> {
    let node = parameters.transform("to_world")?;
    let intensity = parameters.color("intensity", ColorRole::Emission, 1.0)?;
    let cutoff_angle = parameters.positive("cutoff_angle", 20.0)?;
    let beam_angle = parameters.float("beam_width")?.unwrap_or(0.75 * cutoff_angle);
    if !(0.0..=cutoff_angle).contains(&beam_angle) || cutoff_angle > 180.0 {
        let message = format!(
            "found a beam width of {beam_angle}° and a cutoff angle of {cutoff_angle}°, expected 0 \
             <= beam_width <= cutoff_angle <= 180"
        );
        return Err(parameters.refuse("beam_width", message));
    }
    let turn = match &texture {
        None => shining_along(node.matrix3.z_axis.normalize()).matrix3,
        Some(_) if cutoff_angle >= 90.0 => {
            let message = format!(
                "found a cutoff angle of {cutoff_angle}°, expected less than 90 with a texture"
            );
            return Err(parameters.refuse("cutoff_angle", message));
        }
        // In both systems, an image scales with x and y of the node; only the axis is reversed,
        // from +z to −z.
        Some(_) => {
            require_even(parameters, node.matrix3, "with a texture,")?;
            node.matrix3 * DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0))
        }
    };
    let to_world = DAffine3::from_mat3_translation(turn, node.translation);
    Ok((to_world, LightKind::LinearSpot { intensity, beam_angle, cutoff_angle, texture }))
}

/// Reads a projector: an image on a plane perpendicular to the z axis. Seen along that axis, +y is
/// up in the image and +x to the left.
///
/// For image values of 1, the irradiance on the plane at distance 1 is π, times the scale, and
/// times the size of the node (as measured with Mitsuba 3.9.1, whose documentation mentions
/// neither).
fn projector(
    parameters: &mut Parameters<'_>,
    texture: Option<Arc<Texture>>,
) -> Result<(DAffine3, LightKind), LoadError> {
    let node = parameters.transform("to_world")?;
    require_even(parameters, node.matrix3, "for a projector,")?;
    let scale = parameters.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        let message = format!("found \"scale\" = {scale}, expected a number of at least 0");
        return Err(parameters.refuse("scale", message));
    }
    let texture = if let Some(texture) = texture {
        texture
    } else {
        let color = parameters.color("irradiance", ColorRole::Emission, 1.0)?;
        Arc::new(Pattern::Checkerboard([color; 2]).into())
    };
    let aspect = match &texture.pattern {
        Pattern::Bitmap(Bitmap { image, .. }) => f64::from(image.width) / f64::from(image.height),
        _ => 1.0,
    };
    let [x_fov, y_fov] = fields_of_view(parameters, aspect)?;
    let intensity = std::f64::consts::PI * scale * node.matrix3.z_axis.length();
    let kind = LightKind::Projector { intensity: [intensity as f32; 3], x_fov, y_fov, texture };
    Ok((DAffine3 { matrix3: node.matrix3 * -1.0, ..node }, kind))
}

/// Checks that a transform consists of rotation, reflection and uniform scale.
fn require_even(parameters: &Parameters<'_>, node: DMat3, whom: &str) -> Result<(), LoadError> {
    let scale = node.x_axis.length_squared();
    let difference = node.transpose() * node - DMat3::from_diagonal(DVec3::splat(scale));
    if difference.to_cols_array().iter().any(|x| x.abs() > TOLERANCE * scale) {
        let message = format!(
            "{whom} expected a transform of rotations, reflections and uniform scales only"
        );
        return Err(parameters.refuse("to_world", message));
    }
    Ok(())
}

/// Reads an environment map. In Mitsuba, the image is seen unmirrored from inside, with its centre
/// along +z; here, its left edge is along −x and it continues towards +z. The axes x and z are
/// exchanged.
fn envmap(
    tree: &ObjectTree,
    object: &MitsubaObject,
    parameters: &mut Parameters<'_>,
) -> Result<(DAffine3, LightKind), LoadError> {
    parameters.pass_over(&["mis_compensation"]);
    let node = turn(parameters)?;
    let scale = parameters.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        return Err(
            parameters.refuse("scale", format!("found {scale}, expected a number of at least 0"))
        );
    }
    let text = file_name(object, parameters)?;
    let path = tree.resolve(text).ok_or_else(|| tree.not_found(text));
    let numbers = PixelEncoding::Light(Transfer::Srgb);
    let image = match path.and_then(|path| tree.context.pixels(&path, numbers)) {
        Ok(decoded) => decoded.image,
        Err(why) => {
            tree.miss(parameters.place("filename"), &why, placeholder::INSTEAD)?;
            placeholder::light()
        }
    };
    let swap = DMat3::from_cols(DVec3::Z, DVec3::Y, DVec3::X);
    let kind = LightKind::Environment {
        image: Arc::new(image),
        scale: scale as f32,
        rows: Rows::EndpointsAtPoles,
        portal: None,
    };
    Ok((DAffine3::from_mat3(node * swap), kind))
}

/// Reads a luminaire by its photometric file, which Mitsuba does not support. Like a spot light, it
/// is directed along +z.
fn luminaire(
    tree: &ObjectTree,
    object: &MitsubaObject,
    parameters: &mut Parameters<'_>,
) -> Result<(DAffine3, LightKind), LoadError> {
    let node = parameters.transform("to_world")?;
    let scale = parameters.color("intensity", ColorRole::Emission, 1.0)?;
    let text = file_name(object, parameters)?;
    let path = tree.resolve(text);
    let path = path.ok_or_else(|| parameters.refuse("filename", tree.not_found(text)))?;
    let bytes =
        tree.context.read(&path).map_err(|message| parameters.refuse("filename", message))?;
    let profile = crate::ies::parse(&bytes, &path);
    let profile = profile.map_err(|e| parameters.refuse("filename", e.to_string()))?;
    let hanging = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let to_world = DAffine3::from_mat3_translation(
        turned(parameters, node.matrix3, "a luminaire")? * hanging,
        node.translation,
    );
    Ok((to_world, LightKind::Ies { profile: Arc::new(profile), scale }))
}

/// Returns the required file name of an emitter.
fn file_name<'t>(
    object: &MitsubaObject,
    parameters: &mut Parameters<'t>,
) -> Result<&'t str, LoadError> {
    let missing = || error(&object.at, "missing <string name=\"filename\">");
    parameters.text("filename")?.ok_or_else(missing)
}

/// Reads a vector that may be given instead of `to_world`.
fn either(parameters: &mut Parameters<'_>, name: &'static str) -> Result<Option<DVec3>, LoadError> {
    let vector = parameters.vector(name)?;
    if vector.is_some() && parameters.find("to_world").is_some() {
        return Err(parameters.refuse(name, format!("expected {name} or to_world, not both")));
    }
    Ok(vector)
}

/// Returns a transform whose −z axis is a unit vector.
fn shining_along(direction: DVec3) -> DAffine3 {
    let z = -direction;
    let x = perpendicular(z);
    DAffine3::from_mat3(DMat3::from_cols(x, z.cross(x), z))
}
