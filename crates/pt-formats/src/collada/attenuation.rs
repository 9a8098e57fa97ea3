//! Attenuation of lights with distance.
//!
//! A light of the file has 1 / (c + l d + q d²) of its colour at the distance d; light of this
//! renderer falls off with the square. So its intensity is chosen such that both are equal at one
//! distance, which represents those in the scene: the root mean square distance to the points of
//! the bounding box of the scene. If the light of the file falls off with the square alone, both
//! are equal everywhere.

use pt_math::DVec3;
use pt_scene::{LightKind, framing};

use super::light;
use super::reader::{ColladaReader, child};
use crate::LoadError;
use crate::collada::falloff::{Attenuated, Attenuation};
use crate::shared::xml::XmlNode;

/// Records the attenuation of the light that is placed next, unless the file uses the
/// profile `CGL`, whose program ignores attenuation.
pub(super) fn note<'a>(
    reader: &mut ColladaReader<'a>,
    light: XmlNode<'a>,
) -> Result<(), LoadError> {
    let described = light::description(light);
    let fades = |n: &XmlNode<'_>| matches!(n.tag_name().name(), "point" | "spot");
    let Some(element) = described.filter(fades) else { return Ok(()) };
    let Some(attenuation) = read(reader, element)? else { return Ok(()) };
    if reader.has_cgl_shading || reader.context.options().ignore_attenuation {
        // The constant 1 and quadratic terms are defaults of exporters.
        if attenuation.linear != 0.0 || ![0.0, 1.0].contains(&attenuation.constant) {
            let message = "attenuation is ignored, as in the program of the course: light falls \
                           off with the square of the distance";
            reader.warn(element, message);
        }
    } else {
        let (light, at) = (reader.scene.lights.len(), reader.document.span(element));
        reader.attenuated.push(Attenuated { light, attenuation, at });
    }
    Ok(())
}

/// Reads the attenuation of an element; `None` if it has none or, with a warning, if a term is
/// negative or all are 0.
fn read<'a>(
    reader: &mut ColladaReader<'a>,
    element: XmlNode<'a>,
) -> Result<Option<Attenuation>, LoadError> {
    const TAGS: [&str; 3] = ["constant_attenuation", "linear_attenuation", "quadratic_attenuation"];
    if !TAGS.iter().any(|tag| child(element, tag).is_some()) {
        return Ok(None);
    }
    let term = |tag, default| child(element, tag).map_or(Ok(default), |n| reader.scalar(n));
    let [constant, linear, quadratic] =
        [term(TAGS[0], 1.0)?, term(TAGS[1], 0.0)?, term(TAGS[2], 0.0)?];
    let terms = [constant, linear, quadratic];
    if terms.iter().any(|term| *term < 0.0) || terms.iter().all(|term| *term == 0.0) {
        let message = "expected an attenuation of numbers from 0 up that are not all 0; the light \
                       falls off with the square of the distance";
        reader.warn(element, message);
        return Ok(None);
    }
    Ok(Some(Attenuation { constant, linear, quadratic }))
}

/// Sets the intensities of attenuated lights.
pub(super) fn settle(reader: &mut ColladaReader<'_>) {
    let attenuated = std::mem::take(&mut reader.attenuated);
    if attenuated.is_empty() {
        return;
    }
    let extent = framing::surface_extent(&reader.scene, None);
    let metres = reader.scene.metres_per_unit;
    let mut notes = Vec::new();
    for Attenuated { light, attenuation, at } in attenuated {
        let light = &mut reader.scene.lights[light];
        let position = light.to_world.translation;
        let distance = extent.map_or(1.0, |extent| middle_distance(position, extent));
        let scale = attenuation.scale(distance) * metres * metres;
        if let LightKind::Point { intensity } | LightKind::Spot { intensity, .. } = &mut light.kind
        {
            *intensity = intensity.map(|i| (f64::from(i) * scale).min(f64::from(f32::MAX)) as f32);
        }
        if attenuation.constant != 0.0 || attenuation.linear != 0.0 {
            let message = format!(
                "constant and linear attenuation are not supported: light falls off with the \
                 square of the distance, with the specified intensity at {distance:.3} units, the \
                 middle distance to the scene"
            );
            notes.push((at, message));
        }
    }
    for (at, message) in notes {
        reader.warn_at(at, message);
    }
}

/// Returns the root mean square distance to the points of a box; 1 if the box is a point at the
/// position of the light.
fn middle_distance(p: DVec3, [low, high]: pt_scene::extent::Extent) -> f64 {
    let (middle, size) = (0.5 * (low + high), high - low);
    let squared = (middle - p).length_squared() + size.length_squared() / 12.0;
    if squared > 0.0 { squared.sqrt() } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_the_middle_distance_both_are_alike() {
        let even = Attenuation { constant: 2.0, linear: 0.0, quadratic: 0.0 };
        assert_eq!(even.scale(3.0), 4.5);
        let square = Attenuation { constant: 0.0, linear: 0.0, quadratic: 4.0 };
        assert_eq!([square.scale(3.0), square.scale(100.0)], [0.25; 2]);
        let both = Attenuation { constant: 1.0, linear: 0.5, quadratic: 0.0 };
        assert_eq!(both.scale(2.0), 2.0);
    }

    /// The mean square distance is 1 from the centre of a cube of side 2, and 10 from a point at
    /// distance 3.
    #[test]
    fn distances_are_means_over_the_box() {
        let cube = [DVec3::NEG_ONE, DVec3::ONE];
        assert_eq!(middle_distance(DVec3::ZERO, cube), 1.0);
        assert_eq!(middle_distance(DVec3::X * 3.0, cube), 10f64.sqrt());
        assert_eq!(middle_distance(DVec3::X, [DVec3::X; 2]), 1.0);
    }
}
