//! Note about cameras that see nothing of a scene.
//!
//! A grid of rays through the image, and 26 more all around, detect three kinds of cameras that are
//! likely to be misplaced:
//!
//! 1. No ray of the image hits a surface or an infinite light, and no vertex is in view.
//! 2. At least half of the rays of the image go down and hit nothing, from a camera at or below the
//!    underside of all surfaces, or between them. Excluded are images in which all surfaces are in
//!    view, as of an object on a black background, unless they are only above the camera. Rays that
//!    hit an infinite light do not count.
//! 3. All rays, also those all around, hit the same opaque object, which does not emit light, and
//!    no lamp is in its bounding box: the camera is inside of it, in the dark.
//!
//! Up is the axis of the world that is closest to the up vector of the camera.

use pt_bvh::Hit;
use pt_core::RenderScene;
use pt_core::camera::{Camera, Projection};
use pt_cpu::Tracer;
use pt_math::{Bounds3, DVec3, Ray, Vec3};
use pt_scene::{Object, Scalar, Scene, Surface, framing};

/// Columns and rows of the grid.
const GRID: [u32; 2] = [24, 16];
/// Fraction of the height of all surfaces up to which a camera counts as at their underside.
const UNDERSIDE: f32 = 0.01;
/// Maximum number of consecutive transparent surfaces that a ray passes.
const MAX_HOLES: usize = 64;

/// Returns a note if the camera is likely to be misplaced.
pub(crate) fn note(scene: &Scene, compiled: &RenderScene) -> Option<String> {
    let bounds = compiled.bounds();
    if compiled.meter.is_some() || bounds.is_empty() || !compiled.media.is_empty() {
        return None; // Media are visible, and may hide surfaces inside.
    }
    let camera = compiled.camera_at(0.0);
    let rays = through_image(&camera);
    let seen = found(compiled, &rays);
    let up = nearest_axis(camera.up);
    let is_void = |i: usize| matches!(seen[i], CameraRayResult::Nothing);
    let void = (0..seen.len()).filter(|i| is_void(*i)).count();
    let below: Vec<_> = (0..seen.len()).filter(|i| rays[*i].direction.dot(up) < 0.0).collect();
    let void_below = below.iter().filter(|i| is_void(**i)).count();
    if void == seen.len() && !may_see(compiled, &camera) {
        return Some("the camera view is empty".to_owned());
    }
    let is_low = height(camera.position, up) <= underside(&bounds, up);
    let at = camera.position;
    let is_between = bounds.min.cmple(at).all() && at.cmple(bounds.max).all();
    let is_above = void_below == below.len() && void < seen.len();
    let is_whole = shows_all(&camera, &bounds) && !is_above;
    if 2 * void_below >= seen.len() && (is_low || is_between) && !is_whole {
        let place = if is_low { "below" } else { "between" };
        return Some(format!(
            "the camera is {place} the surfaces, and at least half of its view is empty"
        ));
    }
    let object = inside_of(scene, compiled, &camera, &seen)?;
    Some(format!(
        "the camera is inside of {}, which no light enters",
        if object.name.is_empty() {
            "an object".to_owned()
        } else {
            format!("\"{}\"", object.name)
        }
    ))
}

/// Result of a ray.
#[derive(Clone, Copy, PartialEq)]
enum CameraRayResult {
    /// Neither a surface nor an infinite light.
    Nothing,
    Sky,
    /// A surface of the object with this number.
    Object(u32),
}

fn through_image(camera: &Camera) -> Vec<Ray> {
    let [columns, rows] = GRID;
    let cell = [0, 1].map(|i| camera.resolution[i] as f32 / GRID[i] as f32);
    let at = |i: u32| [(i % columns) as f32 + 0.5, (i / columns) as f32 + 0.5];
    let at = (0..columns * rows).map(at);
    at.map(|[x, y]| camera.ray([x * cell[0], y * cell[1]], [0.0; 2])).collect()
}

fn found(scene: &RenderScene, rays: &[Ray]) -> Vec<CameraRayResult> {
    let mut tracer = Tracer::new(scene, false);
    let mut rays = rays.to_vec();
    let mut hits = Vec::new();
    let mut seen = vec![CameraRayResult::Nothing; rays.len()];
    let mut open: Vec<usize> = (0..rays.len()).collect();
    for _ in 0..MAX_HOLES {
        let batch: Vec<_> = open.iter().map(|&i| rays[i]).collect();
        tracer.intersect(&batch, |_| 0.0, &mut hits);
        open = open
            .iter()
            .zip(&hits)
            .filter_map(|(&i, hit)| {
                let hole = look(scene, &rays[i], hit.as_ref(), &mut seen[i])?;
                rays[i].t_min = hole.t.next_up();
                Some(i)
            })
            .collect();
        if open.is_empty() {
            break;
        }
    }
    seen
}

/// Records the result of a ray; returns the hit if the surface is transparent there.
fn look<'h>(
    scene: &RenderScene,
    ray: &Ray,
    hit: Option<&'h Hit>,
    seen: &mut CameraRayResult,
) -> Option<&'h Hit> {
    match hit {
        None => {
            let light = scene.le_infinite(ray.into(), &scene.infinite_lights);
            *seen = if light.is_black() { CameraRayResult::Nothing } else { CameraRayResult::Sky };
            None
        }
        Some(hit) if scene.has_alpha && scene.opacity(ray, hit, 0.0) <= 0.0 => Some(hit),
        Some(hit) => {
            *seen = CameraRayResult::Object(scene.object(hit.primitive));
            None
        }
    }
}

fn nearest_axis(up: Vec3) -> Vec3 {
    let axes = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| axis * up.dot(axis).signum());
    axes.into_iter().max_by(|a, b| up.dot(*a).total_cmp(&up.dot(*b))).unwrap_or(Vec3::Y)
}

fn height(p: Vec3, up: Vec3) -> f32 {
    p.dot(up)
}

/// Height up to which a camera counts as at the underside of a box.
fn underside(bounds: &Bounds3, up: Vec3) -> f32 {
    let [a, b] = [bounds.min, bounds.max].map(|corner| height(corner, up));
    a.min(b) + UNDERSIDE * (b - a).abs()
}

/// Returns true if all corners of a box are in the image.
fn shows_all(camera: &Camera, bounds: &Bounds3) -> bool {
    let [a, b] = [bounds.min, bounds.max];
    let corners = (0..8u32).map(|i| {
        let at = |axis: usize| if i >> axis & 1 == 0 { a[axis] } else { b[axis] };
        Vec3::new(at(0), at(1), at(2))
    });
    corners.into_iter().all(|corner| is_in_view(camera, corner))
}

/// Returns true if a point is in the image unless it is occluded.
fn is_in_view(camera: &Camera, p: Vec3) -> bool {
    let to = p - camera.position;
    let depth = to.dot(camera.forward);
    let [x, y] = [to.dot(camera.right), to.dot(camera.up)];
    let scale = match camera.projection {
        Projection::Panorama => return true,
        Projection::Orthographic => 1.0,
        Projection::Perspective => depth,
    };
    let place = [x / camera.half_extent[0], -y / camera.half_extent[1]];
    // The principal point may differ from the centre of the image.
    let is_on_film = |i: usize| {
        let size = camera.resolution[i] as f32;
        let pixel = camera.principal_point[i] + place[i] / scale * 0.5 * size;
        (0.0..=size).contains(&pixel)
    };
    depth > 0.0 && depth <= camera.far && is_on_film(0) && is_on_film(1)
}

/// Returns true if something too small for the grid may be in view.
fn may_see(scene: &RenderScene, camera: &Camera) -> bool {
    let shapes = &scene.shapes;
    let corners = shapes.triangles.iter().flatten().map(|&i| shapes.positions[i as usize]);
    let boxes = scene.instances.iter().flat_map(|placed| placed.boxes());
    corners
        .chain(shapes.spheres.iter().map(|sphere| sphere.center))
        .chain(boxes.map(|placed| placed.center()))
        .any(|p| is_in_view(camera, p))
}

/// Dark object that contains the camera, or `None`.
fn inside_of<'s>(
    scene: &'s Scene,
    compiled: &RenderScene,
    camera: &Camera,
    seen: &[CameraRayResult],
) -> Option<&'s Object> {
    let Some(CameraRayResult::Object(number)) = seen.first().copied() else { return None };
    let is_same =
        |seen: &[CameraRayResult]| seen.iter().all(|seen| *seen == CameraRayResult::Object(number));
    let object = scene.objects.get(number as usize)?;
    let surrounds = || is_same(&found(compiled, &all_around(camera.position)));
    (is_same(seen) && is_dark(scene, object) && surrounds()).then_some(object)
}

/// Rays to the corners, edges and faces of a cube.
fn all_around(origin: Vec3) -> Vec<Ray> {
    let step = |i: u32| (i % 3) as f32 - 1.0;
    let towards = |i: u32| Vec3::new(step(i), step(i / 3), step(i / 9));
    let directions = (0..27).map(towards).filter_map(Vec3::try_normalize);
    directions.map(|direction| Ray::new(origin, direction)).collect()
}

/// Returns true if an object is opaque, emits nothing, and has no lamp in its bounding box.
fn is_dark(scene: &Scene, object: &Object) -> bool {
    let mut materials = object.materials.iter().flatten().map(|&m| &scene.materials[m as usize]);
    let is_opaque = materials.all(|material| {
        let scatters_back = matches!(
            material.surface,
            Surface::Diffuse(_)
                | Surface::RoughDiffuse(_)
                | Surface::Mirror(_)
                | Surface::Conductor(_)
                | Surface::Plastic(_)
                | Surface::Black(_)
        );
        let emits = material.emission != [0.0; 3].into();
        scatters_back && !emits && material.opacity == Scalar::Value(1.0)
    });
    let alone = |object: &Object| {
        let scene = Scene { objects: vec![object.clone()].into(), ..Scene::default() };
        framing::surface_extent(&scene, None)
    };
    let Some([low, high]) = alone(object).filter(|_| is_opaque) else { return false };
    let lamps = scene.lights.iter().filter(|light| light.kind.is_local());
    let mut places = lamps.map(|light| light.to_world.translation);
    let emits = |object: &&Object| {
        let mut materials = object.materials.iter().flatten();
        materials.any(|&m| scene.materials[m as usize].emission != [0.0; 3].into())
    };
    let mut context = scene.objects.iter().filter(emits).filter_map(alone);
    let is_inside = |p: DVec3| low.cmple(p).all() && p.cmple(high).all();
    let meets =
        |[from, to]: pt_scene::extent::Extent| low.cmple(to).all() && from.cmple(high).all();
    !places.any(is_inside) && !context.any(meets)
}
