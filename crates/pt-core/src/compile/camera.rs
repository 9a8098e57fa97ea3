//! From the author's camera, or none, to the one that is looked through.

use pt_bvh::Knot;
use pt_math::{Bounds3, DAffine3, DVec3, Vec3};
use pt_scene::{Fit, Key, Projection as View, Scene, Span};

use super::{CompileError, CompileOptions, diagonal, motion, studio};
use crate::camera::{Aperture, Camera, Clip, Projection};
use crate::camera_motion::CameraMotion;

/// What a scene without a camera is seen through: 50 degrees at 4 : 3.
const DEFAULT_VIEW: View = View::Perspective { x_fov: 50.0, y_fov: 2.0 * 19.275_5 };
/// Width and height of a panorama, by which its size is chosen: 360 × 180 degrees.
const PANORAMA: [f64; 2] = [2.0, 1.0];
/// Distance from the middle of the scene, in diagonals of its box, where the program places a
/// camera.
const DISTANCE: f32 = 1.5;
/// The same in a studio, where the sphere around the box is seen in full: 1 / (2 sin 19.28°), and 6 % more.
const STUDIO_DISTANCE: f32 = 1.6;
/// What is said of a scene without a camera.
const FROM_Z: &str = "the scene has no camera: it is looked at from +z, in full";
/// The same in a studio.
const FROM_THE_FRONT: &str = "the scene has no camera: it is looked at from the front, the right and above, in full; +y is up";
/// The course's window, to which it fits the field of view before the size is known.
const COURSE_WINDOW: [f64; 2] = [800.0, 600.0];

/// The camera where it is when the shutter opens, and how it moves, if it does.
pub(super) fn compile(
    scene: &Scene,
    bounds: &Bounds3,
    metres: f64,
    shutter: [f64; 2],
    options: &CompileOptions,
    notes: &mut Vec<String>,
) -> Result<(Camera, Option<CameraMotion>), CompileError> {
    let explicit = options.camera.as_ref();
    let author = explicit.or_else(|| of_scene(scene, options.course, notes));
    let places = author.map(|c| motion::places(c.motion.as_ref(), c.to_world, shutter));
    let still = author.zip(places.as_ref()).map(|(camera, places)| pt_scene::Camera {
        to_world: places[0].to_world,
        motion: None,
        ..camera.clone()
    });
    let author = still.as_ref();
    if let Some(camera) = author {
        check(camera)?;
    }
    let view = match author {
        _ if options.panorama => View::Panorama,
        Some(camera) => camera.projection,
        None => DEFAULT_VIEW,
    };
    let extent = extent(view);
    let resolution = resolution(scene, extent, options);
    let mut camera = match author {
        Some(c) if explicit.is_some() || !options.course => placed(c, metres),
        _ => {
            let ahead = author.map_or(DVec3::ZERO, |c| c.to_world.transform_point3(DVec3::NEG_Z));
            let clip = author.map_or([0.0, f32::INFINITY], |c| [c.near as f32, c.far as f32]);
            if author.is_none() {
                notes.push(if options.studio { FROM_THE_FRONT.into() } else { FROM_Z.into() });
            }
            if author.is_none() && options.studio {
                framing(bounds, studio::camera().as_dvec3(), STUDIO_DISTANCE, clip)
            } else {
                framing(bounds, ahead, DISTANCE, clip)
            }
        }
    };
    camera.resolution = resolution;
    let offset = author.filter(|_| !options.course).map_or([0.0; 2], |c| c.film_offset);
    camera.principal_point = [0, 1].map(|i| ((0.5 - offset[i]) * f64::from(resolution[i])) as f32);
    camera.half_extent = match (options.course, explicit.is_some()) {
        (true, false) => course_extent(extent, resolution),
        (true, true) => extent.map(|e| e as f32),
        _ => {
            let file = scene.settings.resolution.filter(|_| explicit.is_none());
            let pixel = pixel_aspect(view, file);
            let [w, h] = resolution.map(f64::from);
            let keep = author.map_or(Fit::Whole, |camera| camera.fit);
            let [x, y] = fit([extent[0], pixel * extent[1]], w / h, keep);
            [x, y / pixel].map(|e| e as f32)
        }
    };
    if options.course {
        camera.clip = Clip::Ray;
        (camera.lens_radius, camera.focal_distance) = (0.0, 4.7);
    }
    project(&mut camera, view, author, metres);
    set_lens(&mut camera, metres as f32, options, notes)?;
    let knot = |key: &Key| Knot { time: key.time as f32, to_world: node(key.to_world, metres) };
    let moves = places.filter(|places| places.len() > 1);
    let motion = moves.map(|places| CameraMotion::new(places.iter().map(knot).collect()));
    Ok((camera, motion))
}

/// A node with its place in metres.
fn node(to_world: DAffine3, metres: f64) -> DAffine3 {
    DAffine3::from_mat3_translation(to_world.matrix3, to_world.translation * metres)
}

/// The camera that is used of those of the scene; the course's program knows perspective alone.
fn of_scene<'a>(
    scene: &'a Scene,
    course: bool,
    notes: &mut Vec<String>,
) -> Option<&'a pt_scene::Camera> {
    let is_known =
        |c: &&pt_scene::Camera| !course || matches!(c.projection, View::Perspective { .. });
    let known = scene.cameras.iter().filter(is_known).count();
    if known < scene.cameras.len() {
        notes.push("cameras that are not in perspective are left out, as in the course".into());
    }
    if known > 1 {
        notes.push(format!("the scene has {known} cameras; the last one is used"));
    }
    scene.cameras.iter().rfind(is_known)
}

/// Half width and height of what is seen: at distance 1 in perspective.
fn extent(view: View) -> [f64; 2] {
    match view {
        View::Perspective { x_fov, y_fov } => [x_fov, y_fov].map(half_tan),
        View::Orthographic { half_width, half_height } => [half_width, half_height],
        View::Panorama => PANORAMA,
    }
}

/// Width over height of what a pixel shows: parallel rays may be closer to each other in one
/// direction, by their extent and the size that their file gives the image.
fn pixel_aspect(view: View, file: Option<[u32; 2]>) -> f64 {
    match (view, file) {
        (View::Orthographic { half_width, half_height }, Some([w, h])) => {
            (half_width / f64::from(w)) / (half_height / f64::from(h))
        }
        _ => 1.0,
    }
}

/// Sets the projection, and what depends on it: the author's unit is one of parallel rays' extent
/// too, and a panorama has no axis along which distances could be measured.
fn project(camera: &mut Camera, view: View, author: Option<&pt_scene::Camera>, metres: f64) {
    camera.projection = match view {
        View::Perspective { .. } => Projection::Perspective,
        View::Orthographic { .. } => Projection::Orthographic,
        View::Panorama => Projection::Panorama,
    };
    match camera.projection {
        Projection::Perspective => {}
        Projection::Orthographic => {
            let scale = author.map_or([1.0; 2], node_scale).map(|s| (s * metres) as f32);
            (0..2).for_each(|i| camera.half_extent[i] *= scale[i]);
        }
        Projection::Panorama => camera.clip = Clip::Ray,
    }
}

/// The lengths of +x and +y of a camera's node in the world.
fn node_scale(camera: &pt_scene::Camera) -> [f64; 2] {
    let axes = camera.to_world.matrix3;
    [axes.x_axis.length(), axes.y_axis.length()]
}

/// Sets what is asked for of the lens, which perspective cameras alone have.
fn set_lens(
    camera: &mut Camera,
    metres: f32,
    options: &CompileOptions,
    notes: &mut Vec<String>,
) -> Result<(), CompileError> {
    if let Some(aperture) = &options.aperture {
        check_aperture(aperture).map_err(|message| refuse("aperture", message))?;
        camera.aperture = Some(compile_aperture(aperture));
    }
    if camera.projection == Projection::Perspective {
        camera.lens_radius = options.lens_radius.map_or(camera.lens_radius, |r| r * metres);
    } else if options.lens_radius.is_some_and(|r| r > 0.0) {
        let message = "only perspective cameras have one; expected a lens radius of 0";
        return Err(refuse("lens", message));
    } else if camera.lens_radius > 0.0 {
        notes.push("the camera's lens is left out: only perspective cameras have one".into());
        camera.lens_radius = 0.0;
    }
    camera.focal_distance = options.focal_distance.map_or(camera.focal_distance, |d| d * metres);
    Ok(())
}

fn compile_aperture(aperture: &pt_scene::Aperture) -> Aperture {
    let turns = aperture.rotation / 360.0;
    // A turn just below a whole one may round to it.
    let turn = ((turns - turns.floor()) as f32).min(1.0f32.next_down());
    Aperture { blades: aperture.blades, turn }
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

/// The author's view with one side changed to the shape of the image.
fn fit([x, y]: [f64; 2], aspect: f64, keep: Fit) -> [f64; 2] {
    let keeps_height = match keep {
        Fit::Whole => x / y < aspect,
        Fit::Width => false,
        Fit::Height => true,
    };
    if keeps_height { [y * aspect, y] } else { [x, x / aspect] }
}

/// The course fits the view to its window, then keeps the size of a pixel: another resolution
/// shows more or less.
fn course_extent(extent: [f64; 2], [w, h]: [u32; 2]) -> [f32; 2] {
    let [_, y] = fit(extent, COURSE_WINDOW[0] / COURSE_WINDOW[1], Fit::Whole);
    let screen_distance = COURSE_WINDOW[1] / (2.0 * y);
    [w, h].map(|n| (f64::from(n) / (2.0 * screen_distance)) as f32)
}

/// A camera where its author put it.
fn placed(camera: &pt_scene::Camera, metres: f64) -> Camera {
    let metric = |v: f64| (v * metres) as f32;
    let somewhere = Camera {
        position: Vec3::ZERO,
        right: Vec3::X,
        up: Vec3::Y,
        forward: Vec3::NEG_Z,
        projection: Projection::Perspective,
        half_extent: [1.0; 2],
        resolution: [1; 2],
        principal_point: [0.5; 2],
        near: metric(camera.near),
        far: metric(camera.far),
        clip: Clip::Axis,
        lens_radius: metric(camera.lens_radius),
        aperture: camera.aperture.as_ref().map(compile_aperture),
        focal_distance: metric(camera.focal_distance),
    };
    somewhere.placed(&node(camera.to_world, metres))
}

/// A camera that looks at the middle of the scene from the direction of `ahead`, a point, seen
/// from the origin; from +z if it is there. World +y is up.
fn framing(bounds: &Bounds3, ahead: DVec3, diagonals: f32, [near, far]: [f32; 2]) -> Camera {
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
    let distance = diagonals * diagonal(bounds);
    Camera {
        position: target + back.as_vec3() * distance,
        right: right.as_vec3(),
        up: back.cross(right).as_vec3(),
        forward: -back.as_vec3(),
        projection: Projection::Perspective,
        half_extent: [1.0; 2],
        resolution: [1; 2],
        principal_point: [0.5; 2],
        near,
        far,
        clip: Clip::Axis,
        lens_radius: 0.0,
        aperture: None,
        focal_distance: distance,
    }
}

fn check(camera: &pt_scene::Camera) -> Result<(), CompileError> {
    let near_far = camera.near >= 0.0 && camera.far > camera.near;
    let lens = camera.lens_radius >= 0.0 && camera.focal_distance > 0.0;
    let aperture = camera.aperture.as_ref().map_or(Ok(()), check_aperture);
    let message = if let Err(message) = check_view(camera).and(aperture) {
        message
    } else if !near_far {
        "the near plane must not be negative, and the far plane must be behind it"
    } else if camera.lens_radius > 0.0 && !lens {
        "the focal distance must be positive"
    } else if !camera.to_world.is_finite() {
        "the transformation has entries that are not finite numbers"
    } else if !camera.film_offset.iter().all(|x| x.is_finite()) {
        "the film offset must be two finite numbers"
    } else {
        return Ok(());
    };
    Err(refuse(&format!("camera \"{}\"", camera.name), message))
}

fn check_view(camera: &pt_scene::Camera) -> Result<(), &'static str> {
    let positive = |v: f64| v.is_finite() && v > 0.0;
    match camera.projection {
        View::Perspective { x_fov, y_fov } => {
            let fits = [x_fov, y_fov].iter().all(|&v| positive(v) && v < 180.0);
            fits.then_some(()).ok_or("the field of view must lie between 0 and 180 degrees")
        }
        View::Orthographic { half_width, half_height } => {
            let scale = node_scale(camera);
            let fits = positive(half_width * scale[0]) && positive(half_height * scale[1]);
            fits.then_some(()).ok_or("the width and height of the view must be positive")
        }
        View::Panorama => Ok(()),
    }
}

fn check_aperture(aperture: &pt_scene::Aperture) -> Result<(), &'static str> {
    const MOST_BLADES: u32 = 1000;
    if !(3..=MOST_BLADES).contains(&aperture.blades) {
        Err("the number of blades of the aperture must lie between 3 and 1000")
    } else if !aperture.rotation.is_finite() {
        Err("the rotation of the aperture must be a finite number of degrees")
    } else {
        Ok(())
    }
}

fn refuse(element: &str, message: &str) -> CompileError {
    let at = Span { element: element.into(), ..Span::default() };
    CompileError::Value { at, message: message.into() }
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
    fn the_side_that_is_asked_for_is_kept() {
        for (view, aspect, whole, width, height) in [
            ([1.0, 1.0], 2.0, [2.0, 1.0], [1.0, 0.5], [2.0, 1.0]),
            ([2.0, 1.0], 1.0, [2.0, 2.0], [2.0, 2.0], [1.0, 1.0]),
        ] {
            assert_eq!(fit(view, aspect, Fit::Whole), whole);
            assert_eq!(fit(view, aspect, Fit::Width), width);
            assert_eq!(fit(view, aspect, Fit::Height), height);
        }
    }
}
