//! `<emitter>`: lights.

use pt_math::{DAffine3, DMat3, DVec3};

use super::object::{Object, Parameters, Role, Tree, error, unsupported};
use super::transform::perpendicular;
use crate::{Light, LightKind, LoadError};

const KINDS: [&str; 4] = ["area (inside a shape)", "constant", "directional", "point"];

/// The radiance of an emitter that belongs to a shape.
pub(super) fn area(tree: &Tree, object: &Object) -> Result<[f32; 3], LoadError> {
    if object.kind != "area" {
        return Err(unsupported(object, &["area (inside a shape)"]));
    }
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["sampling_weight"]);
    let radiance = parameters.color("radiance", Role::Emission, 1.0)?;
    parameters.finish()?;
    Ok(radiance)
}

/// An emitter that belongs to no shape.
pub(super) fn light(tree: &Tree, object: &Object) -> Result<Light, LoadError> {
    tree.children(object, &[])?;
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["sampling_weight"]);
    let (to_world, kind) = match object.kind.as_str() {
        "constant" => {
            let radiance = parameters.color("radiance", Role::Emission, 1.0)?;
            (DAffine3::IDENTITY, LightKind::Constant { radiance })
        }
        "point" => {
            let node = parameters.transform("to_world")?;
            let position = either(&mut parameters, "position")?.unwrap_or(node.translation);
            let intensity = parameters.color("intensity", Role::Emission, 1.0)?;
            (DAffine3::from_translation(position), LightKind::Point { intensity })
        }
        "directional" => {
            let node = parameters.transform("to_world")?;
            let direction = either(&mut parameters, "direction")?.unwrap_or(node.matrix3.z_axis);
            let Some(direction) = direction.try_normalize() else {
                return Err(parameters.refuse("direction", "the direction is zero"));
            };
            let irradiance = parameters.color("irradiance", Role::Emission, 1.0)?;
            (shining_along(direction), LightKind::Directional { irradiance })
        }
        "area" => {
            let message = "an emitter \"area\" belongs inside the <shape> that emits";
            return Err(error(&object.at, message));
        }
        _ => return Err(unsupported(object, &KINDS)),
    };
    parameters.finish()?;
    Ok(Light { name: object.name().to_owned(), to_world, kind, at: object.at.clone() })
}

/// A vector that may be given instead of `to_world`.
fn either(parameters: &mut Parameters<'_>, name: &'static str) -> Result<Option<DVec3>, LoadError> {
    let vector = parameters.vector(name)?;
    if vector.is_some() && parameters.find("to_world").is_some() {
        return Err(parameters.refuse(name, format!("expected {name} or to_world, not both")));
    }
    Ok(vector)
}

/// A node whose −z is a unit vector.
fn shining_along(direction: DVec3) -> DAffine3 {
    let z = -direction;
    let x = perpendicular(z);
    DAffine3::from_mat3(DMat3::from_cols(x, z.cross(x), z))
}
