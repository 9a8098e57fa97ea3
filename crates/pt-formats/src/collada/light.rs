//! Lights.

use pt_math::DAffine3;
use pt_scene::{Light, LightKind};

use super::reader::{ColladaReader, cgl_techniques, child, children, elements, name_of};
use crate::LoadError;
use crate::shared::xml::XmlNode;

/// Reads an instanced light; unknown kinds are omitted with a warning.
pub(super) fn read<'a>(
    reader: &mut ColladaReader<'a>,
    light: XmlNode<'a>,
    instance: XmlNode<'a>,
    to_world: DAffine3,
) -> Result<Option<Light>, LoadError> {
    let Some(described) = description(light) else {
        let message = "unknown kind of light; expected <ambient>, <directional>, <point>, <spot> \
                       or <area> in its <technique_common>; the light is omitted";
        reader.warn(light, message);
        return Ok(None);
    };
    let kind = kind(reader, described)?;
    Ok(Some(Light { name: name_of(light), to_world, kind, at: reader.document.span(instance) }))
}

/// Returns the element that describes a light, which is named after its kind; `None` if that is
/// unknown.
///
/// The profile `CGL` has precedence over the common one; Blender's profile has the lowest
/// precedence.
pub(super) fn description(light: XmlNode<'_>) -> Option<XmlNode<'_>> {
    let blender = children(light, "extra")
        .flat_map(|extra| children(extra, "technique"))
        .filter(|t| t.attribute("profile") == Some("blender"));
    let mut techniques =
        cgl_techniques(light).chain(children(light, "technique_common")).chain(blender);
    techniques.find_map(|t| elements(t).next().filter(is_known))
}

fn is_known(element: &XmlNode<'_>) -> bool {
    matches!(element.tag_name().name(), "ambient" | "directional" | "point" | "spot" | "area")
}

/// Reads the light of an element named after its kind.
fn kind<'a>(reader: &mut ColladaReader<'a>, element: XmlNode<'a>) -> Result<LightKind, LoadError> {
    let color = color(reader, element)?;
    Ok(match element.tag_name().name() {
        "ambient" => LightKind::Hemisphere { radiance: color },
        "directional" => LightKind::Directional { irradiance: color },
        "area" => LightKind::Area { radiance: color },
        "spot" => {
            let falloff =
                |tag, default| match child(element, tag) {
                    Some(found) => match reader.scalar(found)? {
                        number if number >= 0.0 => Ok(number),
                        bad => Err(reader
                            .error(found, format!("expected a number from 0 up, found {bad}"))),
                    },
                    None => Ok(default),
                };
            LightKind::Spot {
                intensity: color,
                falloff_angle: falloff("falloff_angle", 180.0)?,
                falloff_exponent: falloff("falloff_exponent", 0.0)?,
            }
        }
        _ => LightKind::Point { intensity: color },
    })
}

/// Reads `<color>`, or `<red>`, `<green>` and `<blue>` times `<energy>`.
fn color<'a>(reader: &mut ColladaReader<'a>, element: XmlNode<'a>) -> Result<[f32; 3], LoadError> {
    if let Some(color) = child(element, "color") {
        return reader.rgb(color);
    }
    let part = |tag, default: f32| match child(element, tag) {
        Some(found) => match reader.scalar(found)? as f32 {
            number if number >= 0.0 && number.is_finite() => Ok(number),
            bad => Err(reader.error(found, format!("expected a number from 0 up, found {bad}"))),
        },
        None => Ok(default),
    };
    let rgb = [part("red", 1.0)?, part("green", 1.0)?, part("blue", 1.0)?];
    let energy = part("energy", 1.0)?;
    if !["red", "green", "blue", "energy"].iter().any(|tag| child(element, tag).is_some()) {
        reader.warn(element, "missing <color>; white (1 1 1) is used");
    }
    let color = rgb.map(|c| c * energy);
    if color.iter().all(|c| c.is_finite()) {
        Ok(color)
    } else {
        Err(reader
            .error(element, "the product of colour and energy is infinite; use smaller numbers"))
    }
}
