//! Policies of the program of the course CS184 (assignment 3), whose images and numbers students
//! compare with; `docs/cs184.md` lists the differences from physics. Its lobes are in
//! `bsdf/compat.rs`, its estimator is the integrator `cs184`.

mod normals;

use pt_math::{DAffine3, DVec3, Spectrum};
use pt_scene::material::{Conductor, Glass, Plastic, Refraction, Roughness, Surface};
use pt_scene::{Light, LightKind, Placement, Scalar};

use super::policies::{CameraPolicies, LightPolicies, Policies, ShapePolicies};
use crate::bsdf::{
    self, Dielectric, EtaSquaredRefraction, RoughPlastic, SchlickGlass, SimplifiedConductor,
};
use crate::compile::emitters::area_square;
use crate::compile::textures::Lowering;
use crate::light::{
    AnyLight, Directional, EmitterTriangle, HemisphereLight, LightTables, MeshLight, PointLight,
};
use crate::material::Material;
use crate::surface::EmissiveSides;

/// Window size, to which the field of view is fitted before the image size is known.
const WINDOW: [u32; 2] = [800, 600];
/// Image size of which cameras with [`Placement::Course`] have the view, outside of these policies.
pub(super) const IMAGE: [u32; 2] = [480, 360];
/// Note on a camera that has [`Placement::Course`] without a request for that.
pub(super) const CAMERA_NOTE: &str = "CS184 scene: the camera is placed as in the program of the course, with a view of 480 x 360 \
     pixels";

/// Policies of the program.
pub const POLICIES: Policies = Policies {
    program: Some("cs184"),
    uses_units: false,
    media: false,
    exposure: false,
    surface,
    shapes: ShapePolicies {
        instancing: false,
        exact_transforms: false,
        vertex_normals: Some(normals::vertex_normals),
        emissive_sides: EmissiveSides::Both,
    },
    lights: LightPolicies { node: Some(light), samples_shapes: false, trees: false },
    camera: CameraPolicies {
        placement: Some(Placement::Course),
        keeps_pixel_size: true,
        perspective_only: true,
        resolution: Some(WINDOW),
        pinhole: Some(4.7),
    },
};

/// Converts a light node; the deviations of its brightness are in the integrator `cs184`.
fn light(
    node: &Light,
    to_world: DAffine3,
    tables: &mut LightTables,
) -> Result<Option<AnyLight>, &'static str> {
    let position = to_world.translation.as_vec3();
    let ahead = to_world.transform_point3(DVec3::NEG_Z).normalize_or_zero().as_vec3();
    Ok(Some(match node.kind {
        LightKind::Hemisphere { radiance } => HemisphereLight { radiance: radiance.into() }.into(),
        LightKind::Directional { irradiance } => {
            Directional { to_light: ahead, irradiance: irradiance.into() }.into()
        }
        LightKind::Point { intensity } => {
            PointLight { position, intensity: intensity.into() }.into()
        }
        LightKind::Area { radiance } => return Ok(area(to_world, radiance.into(), tables)),
        LightKind::Spot { .. }
        | LightKind::LinearSpot { .. }
        | LightKind::Projector { .. }
        | LightKind::PunctualSpot { .. } => {
            return Err("spot lights are black in the program of the course");
        }
        // The program, which no longer changes, has no other kinds.
        _ => return Err("the light is omitted: the program of the course does not support it"),
    }))
}

/// Converts a square light, which has no surface; `None` without area.
fn area(to_world: DAffine3, radiance: Spectrum, tables: &mut LightTables) -> Option<AnyLight> {
    let (origin, e1, e2) = area_square(to_world);
    let axis = (to_world.transform_vector3(DVec3::NEG_Z)).normalize_or_zero().as_vec3();
    let triangle = |e1, e2| EmitterTriangle { p0: origin, e1, e2, normal: axis, coat: 0.0 };
    let square = [triangle(e1, e1 + e2), triangle(e1 + e2, e2)];
    // The program samples by area everywhere.
    MeshLight::new(tables, &square, radiance).map(|light| MeshLight { near: 0.0, ..light }.into())
}

/// Half extent of the view, which is fitted to the window; then the size of a pixel is kept, so
/// that other resolutions show more or less.
pub(super) fn extent([x, y]: [f64; 2], resolution: [u32; 2]) -> [f64; 2] {
    let [width, height] = WINDOW.map(f64::from);
    let aspect = width / height;
    let y = if x / y < aspect { y } else { x / aspect };
    let screen_distance = height / (2.0 * y);
    resolution.map(|n| f64::from(n) / (2.0 * screen_distance))
}

/// Converts the materials that differ.
///
/// The program does not distinguish sides: a surface seen from behind is lit from its front. This
/// is not visible in closed scenes; here, a back side is black, as is light from below the front
/// in that program. It reads only the diffuse colour of common materials.
fn surface(surface: &Surface, cx: &mut Lowering) -> Option<Material> {
    Some(match surface {
        Surface::Diffuse(diffuse) => {
            let rho = cx.share(&diffuse.reflectance, bsdf::Diffuse::RHO);
            cx.lobe(bsdf::Diffuse { rho }, false)
        }
        Surface::Plastic(Plastic { diffuse, .. }) => {
            let rho = cx.share(diffuse, RoughPlastic::RHO);
            cx.lobe(bsdf::Diffuse { rho }, false)
        }
        Surface::Glass(Glass { reflectance, transmittance, ior, .. }) => {
            let reflectance = cx.share(reflectance, Dielectric::REFLECTANCE);
            let transmittance = cx.share(transmittance, Dielectric::TRANSMITTANCE);
            cx.lobe(SchlickGlass { reflectance, transmittance, ior: *ior }, false)
        }
        Surface::Refraction(Refraction { transmittance, ior }) => {
            let transmittance = cx.share(transmittance, bsdf::Refraction::TRANSMITTANCE);
            cx.lobe(EtaSquaredRefraction { transmittance, ior: *ior }, false)
        }
        Surface::Conductor(Conductor {
            eta,
            k,
            roughness: Some(Roughness { alpha: [alpha, _], .. }),
            ..
        }) => {
            let alpha = match alpha {
                Scalar::Value(alpha) => *alpha,
                texture @ Scalar::Texture(_) => cx.alpha(texture, SimplifiedConductor::ALPHA),
            };
            cx.lobe(SimplifiedConductor { eta: (*eta).into(), k: (*k).into(), alpha }, false)
        }
        // Smooth metals, and all kinds that the program, which no longer changes, does not have,
        // are as without these policies.
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Example of a Cornell box: 875 pixels from eye to screen.
    #[test]
    fn pixels_have_the_same_size_in_images_of_all_sizes() {
        let half_tan = |degrees: f64| libm::tan(0.5 * degrees.to_radians());
        let view = [half_tan(49.134_34), half_tan(49.134_34) / 1.333_333];
        let [x, y] = extent(view, [480, 360]);
        assert!((y - 180.0 / 875.0).abs() < 2e-4, "{y}");
        assert!((x / y - 480.0 / 360.0).abs() < 1e-6);
    }
}
