//! Sensors with a single pixel: `radiancemeter`, `distant` and `irradiancemeter`.

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::{Camera, Fit, Geometry, Meter, Placement, Projection, Quantity, shapes};

use super::medium::MitsubaMediumCache;
use super::object::{MitsubaObject, Parameters, error};
use super::seat::{Seat, shutter};
use crate::LoadError;
use crate::shared::names::quote;
use crate::shared::transform::perpendicular;

pub(super) const METERS: [&str; 3] = ["distant", "irradiancemeter", "radiancemeter"];

/// A sphere in world space.
#[derive(Clone, Copy, Default)]
pub(super) struct MeterSphere {
    pub(super) center: DVec3,
    pub(super) radius: f64,
}

/// Creates the camera of a meter. `around` encloses all surfaces of the scene.
pub(super) fn meter(
    seat: &Seat<'_>,
    media: &mut MitsubaMediumCache<'_>,
    around: MeterSphere,
    resolution: [u32; 2],
) -> Result<Camera, LoadError> {
    /// Half the width of the bundle of rays, which cannot be 0.
    const HALF: f64 = 1e-6;
    let object = seat.object;
    if resolution != [1; 2] {
        let [width, height] = resolution;
        let message = format!(
            "{} {} requires a film of 1 x 1 pixels, found {width} x {height}",
            if object.kind.starts_with('i') { "an" } else { "a" },
            quote(&object.kind)
        );
        return Err(error(&object.at, message));
    }
    let mut parameters = Parameters::new(object);
    let (to_world, meter) = match object.kind.as_str() {
        "irradiancemeter" => irradiance(seat)?,
        "distant" => distant(seat, &mut parameters, around)?,
        _ => {
            let (direction, node) = direction(&mut parameters)?;
            let origin = parameters.vector("origin")?.unwrap_or(node.translation);
            (looking(direction, origin), None)
        }
    };
    let shutter = shutter(&mut parameters)?;
    parameters.pass_over(&["srf"]);
    parameters.finish()?;
    Ok(Camera {
        name: object.name().to_owned(),
        to_world,
        motion: None,
        shutter,
        projection: Projection::Orthographic { half_width: HALF, half_height: HALF },
        near: HALF,
        far: f64::INFINITY,
        lens_radius: 0.0,
        aperture: None,
        focal_distance: 1.0,
        principal_point_offset: [0.0; 2],
        fit: Fit::Whole,
        medium: media.around(object)?,
        placement: Placement::Node,
        meter,
    })
}

/// Irradiance at the shape that contains the sensor.
fn irradiance(seat: &Seat<'_>) -> Result<(DAffine3, Option<Meter>), LoadError> {
    let Some((geometry, to_world)) = seat.surface.clone() else {
        let message = "\"irradiancemeter\" without a surface; expected inside of a static <shape>, \
                       whose irradiance is measured";
        return Err(error(&seat.object.at, message));
    };
    let meter = Meter { quantity: Quantity::Irradiance, geometry, to_world };
    Ok((DAffine3::IDENTITY, Some(meter)))
}

/// Radiance along a direction from outside of the scene, towards a point, a shape, or the disk
/// around the scene.
fn distant(
    seat: &Seat<'_>,
    parameters: &mut Parameters<'_>,
    around: MeterSphere,
) -> Result<(DAffine3, Option<Meter>), LoadError> {
    let (direction, _) = direction(parameters)?;
    let target = parameters.vector("target")?;
    let (geometry, to_world) = match (target, seat.surface.clone()) {
        (Some(_), Some(_)) => {
            let message = "found a target point and a target shape, expected one of them";
            return Err(parameters.refuse("target", message));
        }
        (Some(point), None) => {
            let back = (point - around.center).length() + around.radius;
            return Ok((looking(direction, point - direction * back), None));
        }
        (None, Some(surface)) => surface,
        (None, None) => {
            let disk = looking(direction, around.center);
            let linear = disk.matrix3 * around.radius.max(f64::from(f32::MIN_POSITIVE));
            let disk = DAffine3::from_mat3_translation(linear, around.center);
            (Geometry::Mesh(shapes::disk().into()), disk)
        }
    };
    let meter = Meter { quantity: Quantity::Radiance, geometry, to_world };
    Ok((looking(direction, around.center), Some(meter)))
}

/// Reads the unit direction of a sensor, given explicitly or by its node, and the node.
fn direction(parameters: &mut Parameters<'_>) -> Result<(DVec3, DAffine3), LoadError> {
    let node = parameters.transform("to_world")?;
    let given = parameters.vector("direction")?;
    if given.is_some() && parameters.find("to_world").is_some() {
        let message = "expected direction or to_world, not both";
        return Err(parameters.refuse("direction", message));
    }
    let direction = given.unwrap_or(node.matrix3.z_axis);
    let Some(direction) = direction.try_normalize() else {
        return Err(
            parameters.refuse("direction", "found a zero direction, expected a non-zero direction")
        );
    };
    Ok((direction, node))
}

/// Returns the transform of a camera that faces a unit direction.
fn looking(direction: DVec3, origin: DVec3) -> DAffine3 {
    let z = -direction;
    let x = perpendicular(z);
    DAffine3::from_mat3_translation(DMat3::from_cols(x, z.cross(x), z), origin)
}

/// Returns true if a sensor may aim at a shape.
pub(super) fn is_aimed(sensor: &MitsubaObject) -> bool {
    sensor.kind == "distant"
}
