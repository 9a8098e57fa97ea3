//! From the author's camera, or none, to the one that is looked through.

use pt_math::{Bounds3, DVec3, Vec3};
use pt_scene::{Scene, Span};

use super::{CompileError, CompileOptions, diagonal};
use crate::camera::{Camera, Clip};

/// Field of view of a scene without a camera, in degrees.
const DEFAULT_X_FOV: f64 = 50.0;
const DEFAULT_Y_FOV: f64 = 2.0 * 19.275_5; // 50 degrees at 4 : 3
/// Distance from the middle of the scene, in diagonals of its box, where the program places a
/// camera.
const DISTANCE: f32 = 1.5;
/// The course's window, to which it fits the field of view before the size is known.
const COURSE_WINDOW: [f64; 2] = [800.0, 600.0];

pub(super) fn compile(
    scene: &Scene,
    bounds: &Bounds3,
    metres: f64,
    options: &CompileOptions,
    notes: &mut Vec<String>,
) -> Result<Camera, CompileError> {
    let explicit = options.camera.as_ref();
    let author = explicit.or(scene.cameras.last());
    if let Some(camera) = author {
        check(camera)?;
    }
    if scene.cameras.len() > 1 && explicit.is_none() {
        notes.push(format!("the scene has {} cameras; the last one is used", scene.cameras.len()));
    }
    let extent =
        author.map_or([DEFAULT_X_FOV, DEFAULT_Y_FOV], |c| [c.x_fov, c.y_fov]).map(half_tan);
    let resolution = resolution(scene, extent, options);
    let mut camera = match author {
        Some(c) if explicit.is_some() || !options.course => placed(c, metres),
        _ => {
            let ahead = author.map_or(DVec3::ZERO, |c| c.to_world.transform_point3(DVec3::NEG_Z));
            if author.is_none() {
                notes.push("the scene has no camera: it is looked at from +z, in full".into());
            }
            let clip = author.map_or([0.0, f32::INFINITY], |c| [c.near as f32, c.far as f32]);
            framing(bounds, ahead, clip)
        }
    };
    camera.resolution = resolution;
    camera.half_extent = match (options.course, explicit.is_some()) {
        (true, false) => course_extent(extent, resolution),
        (true, true) => extent.map(|e| e as f32),
        _ => fit(extent, f64::from(resolution[0]) / f64::from(resolution[1])).map(|e| e as f32),
    };
    if options.course {
        camera.clip = Clip::Ray;
        (camera.lens_radius, camera.focal_distance) = (0.0, 4.7);
    }
    let metres = metres as f32;
    camera.lens_radius = options.lens_radius.map_or(camera.lens_radius, |r| r * metres);
    camera.focal_distance = options.focal_distance.map_or(camera.focal_distance, |d| d * metres);
    Ok(camera)
}

fn half_tan(degrees: f64) -> f64 {
    libm::tan(0.5 * degrees.to_radians())
}

/// The size asked for, or the file's, or 600 rows and as many columns as the camera is wide.
fn resolution(scene: &Scene, [x, y]: [f64; 2], options: &CompileOptions) -> [u32; 2] {
    if options.course {
        return options.resolution.unwrap_or([800, 600]);
    }
    let suitable = || [((600.0 * x / y).round() as u32).clamp(1, 6000), 600];
    options.resolution.or(scene.settings.resolution).unwrap_or_else(suitable)
}

/// Widens the narrower side so that all of the author's view is in the image.
fn fit([x, y]: [f64; 2], aspect: f64) -> [f64; 2] {
    if x / y < aspect { [y * aspect, y] } else { [x, x / aspect] }
}

/// The course fits the view to its window, then keeps the size of a pixel: another resolution
/// shows more or less.
fn course_extent(extent: [f64; 2], [w, h]: [u32; 2]) -> [f32; 2] {
    let [_, y] = fit(extent, COURSE_WINDOW[0] / COURSE_WINDOW[1]);
    let screen_distance = COURSE_WINDOW[1] / (2.0 * y);
    [w, h].map(|n| (f64::from(n) / (2.0 * screen_distance)) as f32)
}

/// A camera where its author put it.
fn placed(camera: &pt_scene::Camera, metres: f64) -> Camera {
    let m = camera.to_world.matrix3;
    let forward = (-m.z_axis).normalize_or(DVec3::NEG_Z);
    let right = forward.cross(m.y_axis).normalize_or(forward.any_orthonormal_vector());
    let metric = |v: f64| (v * metres) as f32;
    Camera {
        position: (camera.to_world.translation * metres).as_vec3(),
        right: right.as_vec3(),
        up: right.cross(forward).as_vec3(),
        forward: forward.as_vec3(),
        half_extent: [1.0; 2],
        resolution: [1; 2],
        near: metric(camera.near),
        far: metric(camera.far),
        clip: Clip::Axis,
        lens_radius: metric(camera.lens_radius),
        focal_distance: metric(camera.focal_distance),
    }
}

/// A camera that looks at the middle of the scene from the direction of `ahead`, a point, seen
/// from the origin; from +z if it is there. World +y is up.
fn framing(bounds: &Bounds3, ahead: DVec3, [near, far]: [f32; 2]) -> Camera {
    const NUDGE: f64 = 1e-5;
    let d = ahead.normalize_or(DVec3::Z);
    // Straight from above or below, up would be undefined.
    let phi = libm::acos(d.y.clamp(-1.0, 1.0));
    let phi = phi.clamp(NUDGE, std::f64::consts::PI - NUDGE);
    let theta = libm::atan2(d.x, d.z);
    let back = DVec3::new(
        libm::sin(phi) * libm::sin(theta),
        libm::cos(phi),
        libm::sin(phi) * libm::cos(theta),
    );
    let right = DVec3::Y.cross(back).normalize();
    let target = if bounds.is_empty() { Vec3::ZERO } else { bounds.center() };
    let distance = DISTANCE * diagonal(bounds);
    Camera {
        position: target + back.as_vec3() * distance,
        right: right.as_vec3(),
        up: back.cross(right).as_vec3(),
        forward: -back.as_vec3(),
        half_extent: [1.0; 2],
        resolution: [1; 2],
        near,
        far,
        clip: Clip::Axis,
        lens_radius: 0.0,
        focal_distance: distance,
    }
}

fn check(camera: &pt_scene::Camera) -> Result<(), CompileError> {
    let fov = |v: f64| v.is_finite() && v > 0.0 && v < 180.0;
    let near_far = camera.near >= 0.0 && camera.far > camera.near;
    let lens = camera.lens_radius >= 0.0 && camera.focal_distance > 0.0;
    let message = if !fov(camera.x_fov) || !fov(camera.y_fov) {
        "the field of view must lie between 0 and 180 degrees"
    } else if !near_far {
        "the near plane must not be negative, and the far plane must be behind it"
    } else if camera.lens_radius > 0.0 && !lens {
        "the focal distance must be positive"
    } else if !camera.to_world.is_finite() {
        "the transformation has entries that are not finite numbers"
    } else {
        return Ok(());
    };
    let at = Span { element: format!("camera \"{}\"", camera.name), ..Span::default() };
    Err(CompileError::Value { at, message: message.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of a Cornell box: 875 pixels from eye to screen.
    #[test]
    fn course_framing_keeps_the_size_of_pixels() {
        let extent = [half_tan(49.134_34), half_tan(49.134_34) / 1.333_333];
        let [x, y] = course_extent(extent, [480, 360]);
        assert!((f64::from(y) - 180.0 / 875.0).abs() < 2e-4, "{y}");
        assert!((x / y - 480.0 / 360.0).abs() < 1e-6);
    }

    #[test]
    fn the_whole_view_is_kept() {
        assert_eq!(fit([1.0, 1.0], 2.0), [2.0, 1.0]);
        assert_eq!(fit([2.0, 1.0], 1.0), [2.0, 2.0]);
    }
}
