//! `<sensor>` with its sampler.

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::{Camera, Fit, Motion, Placement, Projection, RenderHints};

use super::film::{self, SensorFilm, film};
use super::medium::MitsubaMediumCache;
use super::meter::{METERS, MeterSphere, meter};
use super::object::{MitsubaObject, ObjectTree, Parameters, error, unsupported};
use crate::LoadError;
use crate::mitsuba::seat::{Seat, shutter};
use crate::shared::names::quote;

const SENSORS: [&str; 7] = [
    "batch",
    "distant",
    "irradiancemeter",
    "orthographic",
    "perspective",
    "radiancemeter",
    "thinlens",
];
const SAMPLERS: [&str; 5] = ["independent", "ldsampler", "multijitter", "orthogonal", "stratified"];

/// Diagonal of 35 mm film in millimetres, to which focal lengths refer.
fn film_diagonal() -> f64 {
    f64::sqrt(36.0 * 36.0 + 24.0 * 24.0)
}

/// Returns the sensors of an object: several for a "batch", which share its film. A note reports
/// that they are not shown side by side.
pub(super) fn seats<'t>(
    tree: &'t ObjectTree,
    object: &'t MitsubaObject,
) -> Result<Vec<Seat<'t>>, LoadError> {
    if object.kind != "batch" {
        return Ok(vec![Seat::alone(object)]);
    }
    let mut parameters = Parameters::new(object);
    parameters.pass_over(&["srf"]);
    parameters.finish()?;
    let children = tree.children(object, &["film", "sampler", "sensor"])?;
    let sensors = children.iter().map(|i| &tree.objects[*i]).filter(|o| o.tag == "sensor");
    let sensors: Vec<_> = sensors.collect();
    let Ok(count @ 1..) = u32::try_from(sensors.len()) else {
        return Err(error(&object.at, "\"batch\" without a <sensor>, expected at least one"));
    };
    let [width, _] = film(tree, object)?.resolution;
    if width % count != 0 {
        let message = format!(
            "found a film width of {width} pixels, expected a multiple of the {count} sensors"
        );
        return Err(error(&object.at, message));
    }
    if let Some(inner) = sensors.iter().find(|sensor| sensor.kind == "batch") {
        return Err(error(&inner.at, "\"batch\" inside of another \"batch\""));
    }
    if count > 1 {
        let message = format!(
            "the {count} sensors are not combined in one image; each becomes a camera with its \
             part of the film"
        );
        tree.context.note(object.at.clone(), message);
    }
    let seat = |sensor| Seat { object: sensor, holder: object, count, surface: None };
    Ok(sensors.into_iter().map(seat).collect())
}

/// Returns the film of a sensor, or its part of the film of a "batch".
fn film_of(tree: &ObjectTree, seat: &Seat<'_>) -> Result<SensorFilm, LoadError> {
    let mut film = film(tree, seat.holder)?;
    film.resolution[0] /= seat.count;
    if seat.count > 1 && film.crop.take().is_some() {
        return Err(error(
            &seat.holder.at,
            "found a cropped film in a \"batch\", expected no crop window",
        ));
    }
    Ok(film)
}

/// Creates the camera of a sensor. `around` encloses all surfaces of the scene.
pub(super) fn camera(
    tree: &ObjectTree,
    seat: &Seat<'_>,
    media: &mut MitsubaMediumCache<'_>,
    around: MeterSphere,
) -> Result<Camera, LoadError> {
    let object = seat.object;
    if !SENSORS.contains(&object.kind.as_str()) {
        return Err(unsupported(object, &SENSORS));
    }
    let mut parameters = Parameters::new(object);
    let resolution = film_of(tree, seat)?.resolution;
    if METERS.contains(&object.kind.as_str()) {
        return meter(seat, media, around, resolution);
    }
    let [width, height] = resolution.map(f64::from);
    let aspect = width / height;
    let near = parameters.positive("near_clip", 0.01)?;
    let far = parameters.positive("far_clip", 10_000.0)?;
    if near >= far {
        let message = format!(
            "found far_clip = {far} and near_clip = {near}, expected far_clip greater than \
             near_clip"
        );
        return Err(parameters.refuse("far_clip", message));
    }
    let (to_world, motion) = parameters.placement("to_world")?;
    let mut camera = Camera {
        name: object.name().to_owned(),
        to_world,
        motion,
        shutter: shutter(&mut parameters)?,
        projection: Projection::Orthographic { half_width: 1.0, half_height: 1.0 / aspect },
        near,
        far,
        lens_radius: 0.0,
        aperture: None,
        focal_distance: parameters.positive("focus_distance", far)?,
        principal_point_offset: [0.0; 2],
        fit: Fit::Whole,
        medium: media.around(object)?,
        placement: Placement::Node,
        meter: None,
    };
    match object.kind.as_str() {
        "orthographic" => take_scale(&mut camera),
        "perspective" => camera.principal_point_offset = principal_point(&mut parameters)?,
        _ => camera.lens_radius = parameters.positive("aperture_radius", 0.0)?,
    }
    if object.kind != "orthographic" {
        let [x_fov, y_fov] = fields_of_view(&mut parameters, aspect)?;
        camera.projection = Projection::Perspective { x_fov, y_fov };
    }
    let keys = camera.motion.as_ref().map_or(&[][..], Motion::keys);
    let moved = keys.iter().map(|key| key.to_world.matrix3 * camera.to_world.matrix3);
    let still = keys.is_empty().then_some(camera.to_world.matrix3);
    moved.chain(still).try_for_each(|axes| require_axes(axes, &parameters))?;
    // Rotated from Mitsuba's axes to ours.
    camera.to_world *= DAffine3::from_scale(DVec3::new(-1.0, 1.0, -1.0));
    parameters.finish()?;
    Ok(camera)
}

/// Moves the scale of the node of an orthographic camera to its view. Along the axis, only the near
/// plane is scaled: the distance from the near to the far plane is unchanged.
///
/// The scale of an animated camera is that of its first key.
fn take_scale(camera: &mut Camera) {
    let lengths = |m: DMat3| [m.x_axis, m.y_axis, m.z_axis].map(DVec3::length);
    let first = camera.motion.as_ref().map(|motion| motion.keys()[0].to_world.matrix3);
    let [x, y, z] = lengths(first.unwrap_or(camera.to_world.matrix3));
    let axes = &mut camera.to_world.matrix3;
    *axes = DMat3::from_cols(axes.x_axis / x, axes.y_axis / y, axes.z_axis / z);
    if let Projection::Orthographic { half_width, half_height } = &mut camera.projection {
        *half_width *= x;
        *half_height *= y;
    }
    let depth = camera.far - camera.near;
    camera.near *= z;
    camera.far = camera.near + depth;
}

/// Checks that axes are orthogonal and of unit length.
fn require_axes(axes: DMat3, parameters: &Parameters<'_>) -> Result<(), LoadError> {
    const TOLERANCE: f64 = 1e-3; // matrices are written with a few digits
    let error = axes.transpose() * axes - DMat3::IDENTITY;
    if error.to_cols_array().iter().any(|x| x.abs() > TOLERANCE) {
        let message = "found a scaled or sheared camera, expected rotations and translations only, \
                       or for an orthographic camera a preceding scale that is the same at all \
                       times";
        return Err(parameters.refuse("to_world", message));
    }
    Ok(())
}

/// Reads the offset of the principal point, as a fraction of the size of the film.
fn principal_point(parameters: &mut Parameters<'_>) -> Result<[f64; 2], LoadError> {
    const MAX: f64 = 1000.0; // films away, far more than any lens shifts
    let mut offset = |name| {
        let x = parameters.float(name)?.unwrap_or(0.0);
        if x.abs() <= MAX {
            return Ok(x);
        }
        let message = format!("found {name} = {x}, expected a fraction of the film size");
        Err(parameters.refuse(name, message))
    };
    Ok([offset("principal_point_offset_x")?, offset("principal_point_offset_y")?])
}

/// Reads the horizontal and vertical field of view in degrees. `aspect` is width over height.
pub(super) fn fields_of_view(
    parameters: &mut Parameters<'_>,
    aspect: f64,
) -> Result<[f64; 2], LoadError> {
    let axis = parameters.text("fov_axis")?.unwrap_or("x");
    let (fov, focal_length) = (parameters.float("fov")?, parameters.text("focal_length")?);
    // Half the extent of the image at unit distance, along the axis.
    let (half, axis) = match (fov, focal_length) {
        (Some(_), Some(_)) => {
            return Err(parameters.refuse("fov", "expected fov or focal_length, found both"));
        }
        (Some(fov), None) if 0.0 < fov && fov < 180.0 => (libm::tan(0.5 * fov.to_radians()), axis),
        (Some(fov), None) => {
            let message = format!("found a fov of {fov}, expected degrees above 0 and below 180");
            return Err(parameters.refuse("fov", message));
        }
        (None, text) => {
            let text = text.unwrap_or("50mm");
            let length = text.strip_suffix("mm").unwrap_or(text).trim().parse().ok();
            let length = length.filter(|x: &f64| x.is_finite() && *x > 0.0);
            let length = length.ok_or_else(|| {
                let message = format!("found {}, expected a length such as \"50mm\"", quote(text));
                parameters.refuse("focal_length", message)
            })?;
            (0.5 * film_diagonal() / length, "diagonal")
        }
    };
    let half_x = match axis {
        "x" => half,
        "y" => half * aspect,
        "smaller" => half * aspect.max(1.0),
        "larger" => half * aspect.min(1.0),
        "diagonal" => half / (1.0 + 1.0 / (aspect * aspect)).sqrt(),
        other => {
            let message =
                format!("found {}, expected x, y, smaller, larger or diagonal", quote(other));
            return Err(parameters.refuse("fov_axis", message));
        }
    };
    let degrees = |half: f64| 2.0 * libm::atan(half).to_degrees();
    Ok([degrees(half_x), degrees(half_x / aspect)])
}

/// Reads the render settings of the film and sampler of a sensor.
pub(super) fn settings(tree: &ObjectTree, seat: &Seat<'_>) -> Result<RenderHints, LoadError> {
    let SensorFilm { resolution, crop, filter, has_alpha } = film_of(tree, seat)?;
    let settings = RenderHints {
        resolution: Some(resolution),
        crop,
        filter: Some(filter),
        aovs: if has_alpha { vec!["alpha"] } else { Vec::new() },
        ..RenderHints::default()
    };
    let Some(sampler) = tree.only(&film::parts(tree, seat.holder)?, "sampler")? else {
        return Ok(settings);
    };
    let sampler = &tree.objects[sampler];
    if !SAMPLERS.contains(&sampler.kind.as_str()) {
        return Err(unsupported(sampler, &SAMPLERS));
    }
    tree.children(sampler, &[])?;
    let mut parameters = Parameters::new(sampler);
    parameters.pass_over(&["jitter", "seed", "strength"]);
    let spp = parameters.count("sample_count", u32::MAX)?;
    parameters.finish()?;
    Ok(RenderHints { spp, ..settings })
}
