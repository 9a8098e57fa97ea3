//! Compiles the author's camera, or a default one.

use pt_bvh::MotionKey;
use pt_math::{DAffine3, DVec3, Vec3};
use pt_scene::extent::Extent;
use pt_scene::{Fit, Hint, Key, Notes, Placement, Projection as View, Scene, framing};

use super::{CompileError, CompileOptions, compat, meter, motion, studio};
use crate::camera::{Aperture, Camera, Clip, Projection};
use crate::camera_motion::CameraMotion;
use crate::compile::refuse;
use crate::meter::Meter;

/// View of a scene without a camera: 50 degrees at 4 : 3.
const DEFAULT_VIEW: View = View::Perspective { x_fov: 50.0, y_fov: 2.0 * 19.275_5 };
/// Width and height of a panorama, which determine its image size: 360 × 180 degrees.
const PANORAMA: [f64; 2] = [2.0, 1.0];
/// Distance of the default camera from the centre of the scene, in diagonals of the bounding box of
/// its surfaces.
const DISTANCE: f64 = 1.5;
/// Distance of the default camera in a studio, in the same unit. It shows the bounding sphere of
/// the box in full: 1 / (2 sin 19.28°), plus 6 %.
const STUDIO_DISTANCE: f64 = 1.6;
/// Note on a scene without a camera.
const FROM_Z: &str = "the scene has no camera: the view is from +z and contains the whole scene";
/// Note on a scene without a camera in a studio.
const FROM_THE_FRONT: &str = "the scene has no camera: the view is from the front, the right and \
                              above (+y is up) and contains the whole scene";
/// Note on a panorama with the placement `fit`.
const FITS_ANYWHERE: &str =
    "fitting the camera has no effect on a panorama, which shows all directions";

/// Compiles the camera at the opening of the shutter, and its motion; `None` if it does not move.
pub(super) fn compile(
    scene: &Scene,
    metres: f64,
    shutter: [f64; 2],
    options: &CompileOptions,
    notes: &mut Notes,
) -> Result<(Camera, Option<CameraMotion>), CompileError> {
    let author = options.camera.as_ref().or_else(|| of_scene(scene, options, notes));
    if let Some(camera) = author {
        check(camera)?;
    }
    let placement = placement(author, options);
    let stays = author.filter(|_| placement == Placement::Node);
    let places = stays.map(|c| motion::places(c.motion.as_ref(), c.to_world, shutter));
    let mut author = author.cloned();
    if let Some(camera) = &mut author {
        tell_placement(camera, placement, options, notes);
        camera.placement = placement;
    }
    if let (Some(camera), Some(places)) = (&mut author, &places) {
        (camera.to_world, camera.motion) = (places[0].to_world, None);
    }
    let view = view(author.as_ref(), options);
    let resolution = size(scene, extent(view), options);
    let keep = author.as_ref().map_or(Fit::Whole, |camera| camera.fit);
    let half = half_extent((scene, view, keep), placement, resolution, options);
    let surfaces = || framing::surface_extent(scene, Some(shutter));
    let (mut camera, half) = match &mut author {
        Some(camera) if placement == Placement::Node => (placed(camera, metres), half),
        Some(camera) => {
            let half = place(camera, view, half, surfaces(), options);
            (placed(camera, metres), half)
        }
        None => (placed(&default_camera(surfaces(), options, notes), metres), half),
    };
    camera.resolution = resolution;
    let pinhole = options.policies.camera.pinhole;
    let lens = author.as_ref().filter(|_| pinhole.is_none());
    let offset = lens.map_or([0.0; 2], |camera| camera.principal_point_offset);
    camera.principal_point = [0, 1].map(|i| ((0.5 - offset[i]) * f64::from(resolution[i])) as f32);
    camera.half_extent = half.map(|e| e as f32);
    if let Some(focal_distance) = pinhole {
        camera.clip = Clip::Ray;
        (camera.lens_radius, camera.focal_distance) = (0.0, focal_distance);
    }
    project(&mut camera, view, author.as_ref(), metres);
    set_lens(&mut camera, metres as f32, options, notes)?;
    let knot =
        |key: &Key| MotionKey { time: key.time as f32, to_world: node(key.to_world, metres) };
    let moves = places.filter(|places| places.len() > 1);
    let motion = moves.map(|places| CameraMotion::new(places.iter().map(knot).collect()));
    Ok((camera, motion))
}

/// Compiles the measurement that replaces the camera's image; `None` for a panorama, or if the
/// camera has no meter.
pub(super) fn meter(
    scene: &Scene,
    metres: f64,
    shutter: [f64; 2],
    options: &CompileOptions,
) -> Result<Option<Meter>, CompileError> {
    let author =
        options.camera.as_ref().or_else(|| of_scene(scene, options, &mut Notes::default()));
    let Some(author) = author.filter(|_| !options.panorama) else { return Ok(None) };
    let surfaces = || framing::surface_extent(scene, Some(shutter));
    meter::compile(author, surfaces, metres)
}

/// Placement of the camera: that of the options, that of the policies, or the author's.
pub(super) fn placement(author: Option<&pt_scene::Camera>, options: &CompileOptions) -> Placement {
    let of_author = author.map_or(Placement::Node, |camera| camera.placement);
    let of_policy = options.policies.camera.placement.filter(|_| options.camera.is_none());
    options.placement.or(of_policy).unwrap_or(of_author)
}

/// Notes that the camera is placed by the course's rule without a request for that, and that a
/// panorama has no placement `fit`.
fn tell_placement(
    camera: &pt_scene::Camera,
    placement: Placement,
    options: &CompileOptions,
    notes: &mut Notes,
) {
    let is_asked_for = !options.policies.is_physical() || options.placement.is_some();
    if placement == Placement::Course && !is_asked_for {
        notes.push(compat::CAMERA_NOTE);
        notes.suggest(Hint::CameraOfFile);
    }
    let is_panorama = options.panorama || camera.projection == View::Panorama;
    if placement == Placement::Fit && is_panorama {
        notes.push(FITS_ANYWHERE);
    }
}

/// Places a camera by its placement, and returns half of the extent of its view.
fn place(
    camera: &mut pt_scene::Camera,
    view: View,
    half: [f64; 2],
    surfaces: Option<Extent>,
    options: &CompileOptions,
) -> [f64; 2] {
    let of_node = (camera.near, camera.far);
    camera.projection = view;
    let scale = match view {
        View::Orthographic { .. } => node_scale(camera),
        _ => [1.0; 2],
    };
    let half = framing::place(camera, [half[0] * scale[0], half[1] * scale[1]], surfaces);
    if options.policies.camera.pinhole.is_some() {
        (camera.near, camera.far) = of_node;
    }
    half
}

/// Camera of a scene without one.
fn default_camera(
    surfaces: Option<Extent>,
    options: &CompileOptions,
    notes: &mut Notes,
) -> pt_scene::Camera {
    let is_of_course = options.placement == Some(Placement::Course);
    let (direction, diagonals, note) = if options.studio && !is_of_course {
        (studio::camera().as_dvec3(), STUDIO_DISTANCE, FROM_THE_FRONT)
    } else {
        (DVec3::Z, DISTANCE, FROM_Z)
    };
    notes.push(note);
    let (to_world, distance) = framing::looking_from(direction, diagonals, surfaces);
    pt_scene::Camera {
        name: String::new(),
        to_world,
        motion: None,
        shutter: [0.0; 2],
        projection: DEFAULT_VIEW,
        near: 0.0,
        far: f64::INFINITY,
        lens_radius: 0.0,
        aperture: None,
        focal_distance: distance,
        principal_point_offset: [0.0; 2],
        fit: Fit::Whole,
        medium: None,
        placement: Placement::Node,
        meter: None,
    }
}

/// Half of the width and height of the image, at distance 1 for a perspective.
fn half_extent(
    (scene, view, keep): (&Scene, View, Fit),
    placement: Placement,
    resolution: [u32; 2],
    options: &CompileOptions,
) -> [f64; 2] {
    let extent = extent(view);
    let is_explicit = options.camera.is_some();
    let keeps_pixel_size = options.policies.camera.keeps_pixel_size;
    if keeps_pixel_size && options.placement.is_none() && is_explicit {
        return extent;
    }
    let extent = match (placement, view) {
        (Placement::Course, _) if keeps_pixel_size => return compat::extent(extent, resolution),
        (Placement::Course, View::Perspective { .. }) => compat::extent(extent, compat::IMAGE),
        _ => extent,
    };
    let file = scene.settings.resolution.filter(|_| !is_explicit);
    let pixel = pixel_aspect(view, file);
    let [w, h] = resolution.map(f64::from);
    let [x, y] = fit([extent[0], pixel * extent[1]], w / h, keep);
    [x, y / pixel]
}

/// Transform of a node with its translation in metres.
fn node(to_world: DAffine3, metres: f64) -> DAffine3 {
    DAffine3::from_mat3_translation(to_world.matrix3, to_world.translation * metres)
}

/// Camera of the scene that is used.
fn of_scene<'a>(
    scene: &'a Scene,
    options: &CompileOptions,
    notes: &mut Notes,
) -> Option<&'a pt_scene::Camera> {
    let perspective_only = options.policies.camera.perspective_only;
    let is_known = |c: &&pt_scene::Camera| {
        !perspective_only || matches!(c.projection, View::Perspective { .. })
    };
    let known = scene.cameras.iter().filter(is_known).count();
    if known < scene.cameras.len() {
        notes.push("cameras other than perspective ones are omitted, as in the course");
    }
    scene.camera().filter(is_known).or_else(|| scene.cameras.iter().rfind(is_known))
}

/// Half width and height of the view: at distance 1 for a perspective.
fn extent(view: View) -> [f64; 2] {
    match view {
        View::Perspective { x_fov, y_fov } => [x_fov, y_fov].map(half_tan),
        View::Orthographic { half_width, half_height } => [half_width, half_height],
        View::Panorama => PANORAMA,
    }
}

/// Aspect ratio of a pixel. Parallel rays may be denser in one direction, by their extent and the
/// image size in their file.
fn pixel_aspect(view: View, file: Option<[u32; 2]>) -> f64 {
    match (view, file) {
        (View::Orthographic { half_width, half_height }, Some([w, h])) => {
            (half_width / f64::from(w)) / (half_height / f64::from(h))
        }
        _ => 1.0,
    }
}

/// Sets the projection and its dependent parameters: the extent of parallel rays is converted to
/// metres, and a panorama measures clip distances along rays, as it has no axis.
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

/// Lengths of +x and +y of a camera's node in the world.
fn node_scale(camera: &pt_scene::Camera) -> [f64; 2] {
    let axes = camera.to_world.matrix3;
    [axes.x_axis.length(), axes.y_axis.length()]
}

/// Applies the lens options; only perspective cameras have a lens.
fn set_lens(
    camera: &mut Camera,
    metres: f32,
    options: &CompileOptions,
    notes: &mut Notes,
) -> Result<(), CompileError> {
    if let Some(aperture) = &options.aperture {
        check_aperture(aperture).map_err(|message| refuse("aperture", message))?;
        camera.aperture = Some(compile_aperture(aperture));
    }
    if camera.projection == Projection::Perspective {
        camera.lens_radius = options.lens_radius.map_or(camera.lens_radius, |r| r * metres);
    } else if options.lens_radius.is_some_and(|r| r > 0.0) {
        let message =
            "found a lens of a camera that is not perspective, expected a lens radius of 0";
        return Err(refuse("lens", message));
    } else if camera.lens_radius > 0.0 {
        notes.push(
            "the lens of the camera is omitted: it is supported for perspective cameras only",
        );
        camera.lens_radius = 0.0;
    }
    camera.focal_distance = options.focal_distance.map_or(camera.focal_distance, |d| d * metres);
    Ok(())
}

fn compile_aperture(aperture: &pt_scene::Aperture) -> Aperture {
    let turns = aperture.rotation / 360.0;
    // A fraction just below 1 may round to 1.
    let turn = ((turns - turns.floor()) as f32).min(1.0f32.next_down());
    Aperture { blades: aperture.blades, turn }
}

fn half_tan(degrees: f64) -> f64 {
    libm::tan(0.5 * degrees.to_radians())
}

/// Returns the width and height of the image of a scene: those of the options or the file; by
/// default, 600 rows, and columns by the aspect ratio of the camera.
pub fn resolution(scene: &Scene, options: &CompileOptions) -> [u32; 2] {
    let of_scene = || of_scene(scene, options, &mut Notes::default());
    let author = options.camera.as_ref().or_else(of_scene);
    size(scene, extent(view(author, options)), options)
}

/// View of the author's camera, or of a default one.
fn view(author: Option<&pt_scene::Camera>, options: &CompileOptions) -> View {
    match author {
        _ if options.panorama => View::Panorama,
        Some(camera) => camera.projection,
        None => DEFAULT_VIEW,
    }
}

/// Resolution for a view of this extent.
fn size(scene: &Scene, [x, y]: [f64; 2], options: &CompileOptions) -> [u32; 2] {
    let suitable = || [((600.0 * x / y).round() as u32).clamp(1, 6000), 600];
    let fixed = options.policies.camera.resolution;
    options.resolution.or(fixed).or(scene.settings.resolution).unwrap_or_else(suitable)
}

/// Adjusts one side of the author's view to the aspect ratio of the image.
fn fit([x, y]: [f64; 2], aspect: f64, keep: Fit) -> [f64; 2] {
    let keeps_height = match keep {
        Fit::Whole => x / y < aspect,
        Fit::Width => false,
        Fit::Height => true,
    };
    if keeps_height { [y * aspect, y] } else { [x, x / aspect] }
}

/// Camera as placed by its author.
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

fn check(camera: &pt_scene::Camera) -> Result<(), CompileError> {
    let near_far = camera.near >= 0.0 && camera.far > camera.near;
    let lens = camera.lens_radius >= 0.0 && camera.focal_distance > 0.0;
    let aperture = camera.aperture.as_ref().map_or(Ok(()), check_aperture);
    let message = if let Err(message) = check_view(camera).and(aperture) {
        message
    } else if !near_far {
        "found an invalid clipping range, expected a near plane from 0 up and a far plane beyond it"
    } else if camera.lens_radius > 0.0 && !lens {
        "found an invalid focal distance, expected a number above 0"
    } else if !camera.to_world.is_finite() {
        "found a transform with entries that are not finite"
    } else if !camera.principal_point_offset.iter().all(|x| x.is_finite()) {
        "found an invalid film offset, expected two finite numbers"
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
            fits.then_some(()).ok_or(
                "found a field of view out of range, expected more than 0 and less than 180 \
                 degrees",
            )
        }
        View::Orthographic { half_width, half_height } => {
            let scale = node_scale(camera);
            let fits = positive(half_width * scale[0]) && positive(half_height * scale[1]);
            fits.then_some(()).ok_or("found an empty view, expected a width and a height above 0")
        }
        View::Panorama => Ok(()),
    }
}

fn check_aperture(aperture: &pt_scene::Aperture) -> Result<(), &'static str> {
    const MAX_BLADES: u32 = 1000;
    if !(3..=MAX_BLADES).contains(&aperture.blades) {
        Err("found an invalid number of aperture blades, expected 3 to 1000")
    } else if !aperture.rotation.is_finite() {
        Err("found an invalid rotation of the aperture, expected a finite number of degrees")
    } else {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
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
