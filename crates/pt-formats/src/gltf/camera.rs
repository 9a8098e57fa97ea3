//! Cameras and lights, which face −z of their nodes. [glTF 2.0, §3.10; KHR_lights_punctual]

use pt_math::{DAffine3, DMat3};
use pt_scene::{Camera, Fit, Light, LightKind, Placement, Projection};

use super::GltfReader;
use super::item::Item;
use crate::LoadError;

/// Upper limit of numbers without a limit: the largest single-precision number.
const ANY: f64 = f32::MAX as f64;
/// Distance of the near plane if a file does not set it.
const DEFAULT_NEAR: f64 = 1e-3;
/// Distance of the far plane if a file does not set it.
const DEFAULT_FAR: f64 = 1e6;
/// Aspect ratio, width over height, if a file does not set it.
const DEFAULT_ASPECT: f64 = 4.0 / 3.0;

impl<'a> GltfReader<'a> {
    /// Adds the camera of a node, if it has one.
    pub(super) fn camera(&mut self, node: &Item<'a>, to_world: DAffine3) -> Result<(), LoadError> {
        let Some(index) = node.whole("camera")? else { return Ok(()) };
        let camera = self.root.member("cameras", index, node, "camera")?;
        let Some(to_world) = unscaled(to_world) else {
            self.warn(node, "found a transform that flattens space; the camera is omitted");
            return Ok(());
        };
        let kind = camera.text("type")?.unwrap_or_default();
        let view = match kind {
            "perspective" | "orthographic" => camera.child(kind)?,
            _ => return Err(camera.refuse("type", "expected perspective or orthographic")),
        };
        let missing = || camera.error(format!("missing \"{kind}\""));
        let view = view.ok_or_else(missing)?;
        let projection = if kind == "perspective" {
            Self::perspective(&view)?
        } else {
            let half = |field: &str| {
                let size = view.number(field)?.map(f64::abs).filter(|size| *size > 0.0);
                size.ok_or_else(|| {
                    view.refuse(field, "expected half the height or width of the view, above 0")
                })
            };
            Projection::Orthographic { half_width: half("xmag")?, half_height: half("ymag")? }
        };
        // Without an aspect ratio, that of the image is used. [glTF 2.0, §5.13]
        let is_free = kind == "perspective" && !view.has("aspectRatio");
        let fit = if is_free { Fit::Height } else { Fit::Whole };
        let near = view.number_in("znear", 0.0..=ANY, 0.0)?.max(DEFAULT_NEAR);
        let far = view.number_in("zfar", 0.0..=ANY, DEFAULT_FAR.max(2.0 * near))?;
        if near >= far {
            return Err(view.refuse(
                "zfar",
                format!("found zfar = {far}, expected more than znear, which is {near}"),
            ));
        }
        self.scene.cameras.push(Camera {
            name: node.name(),
            to_world,
            motion: None,
            shutter: [0.0; 2],
            projection,
            near,
            far,
            lens_radius: 0.0,
            aperture: None,
            focal_distance: 1.0,
            principal_point_offset: [0.0; 2],
            fit,
            medium: None,
            placement: Placement::Node,
            meter: None,
        });
        Ok(())
    }

    /// Reads a perspective camera, with tan(x/2) = aspect · tan(y/2).
    fn perspective(view: &Item<'a>) -> Result<Projection, LoadError> {
        let y = view.number("yfov")?.filter(|y| 0.0 < *y && *y < std::f64::consts::PI);
        let message = "expected an angle above 0 and below π, in radians";
        let y = y.ok_or_else(|| view.refuse("yfov", message))?;
        let aspect = view.number_in("aspectRatio", 1e-6..=1e6, DEFAULT_ASPECT)?;
        let x = 2.0 * libm::atan(aspect * libm::tan(0.5 * y));
        Ok(Projection::Perspective { x_fov: x.to_degrees(), y_fov: y.to_degrees() })
    }

    /// Adds the light of a node, if it has one. Candela, lux and nits are taken as W/sr, W/m² and
    /// radiance, so that the ratio of lights and emissive surfaces is kept.
    pub(super) fn light(&mut self, node: &Item<'a>, to_world: DAffine3) -> Result<(), LoadError> {
        let Some(reference) = node.extension("KHR_lights_punctual")? else { return Ok(()) };
        let index = reference.needed("light")?;
        let Some(all) = self.root.extension("KHR_lights_punctual")? else {
            return Err(reference.refuse("light", "missing list of lights in the file"));
        };
        let light = all.member("lights", index, &reference, "light")?;
        let color = light.color("color", ANY, [1.0; 3])?;
        let intensity = light.number_in("intensity", 0.0..=ANY, 1.0)?;
        let intensity = color.map(|c| (f64::from(c) * intensity) as f32);
        if !intensity.iter().all(|c| c.is_finite()) {
            return Err(light.refuse(
                "intensity",
                "the product of intensity and colour is infinite; use smaller numbers",
            ));
        }
        if light.has("range") {
            self.warn(
                &light,
                "range is ignored: the light falls off with the square of the distance",
            );
        }
        let kind = match light.text("type")? {
            Some("directional") => LightKind::Directional { irradiance: intensity },
            Some("point") => LightKind::Point { intensity },
            Some("spot") => cone(&light, intensity)?,
            _ => return Err(light.refuse("type", "expected directional, point or spot")),
        };
        self.scene.lights.push(Light { name: node.name(), to_world, kind, at: node.span() });
        Ok(())
    }
}

/// Removes the scale from the transform of a node, which cameras ignore; `None` if the transform is
/// singular. [glTF 2.0, §3.10.2]
pub(super) fn unscaled(DAffine3 { matrix3, translation }: DAffine3) -> Option<DAffine3> {
    let z = matrix3.z_axis.try_normalize()?;
    let x = matrix3.y_axis.try_normalize()?.cross(z).try_normalize()?;
    Some(DAffine3 { matrix3: DMat3::from_cols(x, z.cross(x), z), translation })
}

/// Reads a spot light. The default cone extends to 45° from the axis.
fn cone(light: &Item<'_>, intensity: [f32; 3]) -> Result<LightKind, LoadError> {
    const RIGHT_ANGLE: f64 = std::f64::consts::FRAC_PI_2;
    let none = || light.error("missing \"spot\"");
    let spot = light.child("spot")?.ok_or_else(none)?;
    let outer = spot.number_in("outerConeAngle", 0.0..=RIGHT_ANGLE + 1e-6, 0.5 * RIGHT_ANGLE)?;
    let inner = spot.number_in("innerConeAngle", 0.0..=RIGHT_ANGLE + 1e-6, 0.0)?;
    if inner >= outer {
        let message = format!("found {inner}, expected less than outerConeAngle, which is {outer}");
        return Err(spot.refuse("innerConeAngle", message));
    }
    Ok(LightKind::PunctualSpot {
        intensity,
        inner_angle: inner.to_degrees(),
        outer_angle: outer.to_degrees().min(90.0),
    })
}
