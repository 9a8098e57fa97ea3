//! Where the surfaces of a scene are, and cameras that are placed by them.

use std::collections::HashMap;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3};

use crate::points;
use crate::{Camera, Geometry, Mesh, Object, Placement, Projection, Scene};

/// Most vertices that are placed one by one; of further copies the corners of their boxes are.
const MAX_PLACED: usize = 50_000_000;
/// Where the course's program places its camera, in diagonals of the box from its middle.
const COURSE_DISTANCE: f64 = 1.5;
/// By how much what is shown is wider and higher than a box that is to fit.
const MARGIN: f64 = 1.05;

/// A box: its least and its greatest coordinates.
pub type Extent = [DVec3; 2];

/// The box around all surfaces, at all keys of what moves or in a span of time, in seconds. Points
/// that belong to no triangle with an area are no surfaces; `None` if there are none.
pub fn surface_extent(scene: &Scene, span: Option<[f64; 2]>) -> Option<Extent> {
    let (mut known, mut clouds) = (HashMap::new(), HashMap::new());
    let mut left = MAX_PLACED;
    let mut all: Option<Extent> = None;
    for object in &scene.objects {
        for place in places(object, span) {
            let found = match &object.geometry {
                Geometry::Sphere { radius } => Some(extent_of_sphere(*radius, &place)),
                Geometry::Points { points, radius } => {
                    let (corners, default) = clouds
                        .entry(Arc::as_ptr(points))
                        .or_insert_with(|| (points.extent().map(corners), points.radius()));
                    let placed = corners.iter().flatten().map(|p| place.transform_point3(*p));
                    let reach = radius.unwrap_or(*default) * points::scale(place.matrix3);
                    extent_of(placed).map(|[low, high]| [low - reach, high + reach])
                }
                Geometry::Mesh(mesh) => {
                    let points =
                        known.entry(Arc::as_ptr(mesh)).or_insert_with(|| surface_points(mesh));
                    if points.len() > left {
                        *points = corners_of(points).into_iter().flatten().collect();
                    }
                    left = left.saturating_sub(points.len());
                    extent_of(points.iter().map(|p| place.transform_point3(*p)))
                }
            };
            let found = found.filter(|box_| box_.iter().all(|corner| corner.is_finite()));
            all = match (all, found) {
                (Some(a), Some(b)) => Some([a[0].min(b[0]), a[1].max(b[1])]),
                (a, b) => a.or(b),
            };
        }
    }
    all
}

/// Where an object is, to the world.
fn places(object: &Object, span: Option<[f64; 2]>) -> Vec<DAffine3> {
    let Some(motion) = &object.motion else { return vec![object.to_world] };
    let keys = match span {
        None => motion.keys().to_vec(),
        Some(span) => motion.knots(span),
    };
    keys.iter().map(|key| key.to_world * object.to_world).collect()
}

/// The box around a sphere that an affine map made an ellipsoid: along each axis it reaches as far
/// as that row of the map is long.
fn extent_of_sphere(radius: f64, place: &DAffine3) -> Extent {
    let rows = place.matrix3.transpose();
    let lengths = [rows.x_axis, rows.y_axis, rows.z_axis].map(DVec3::length);
    let reach = DVec3::from_array(lengths) * radius.abs();
    [place.translation - reach, place.translation + reach]
}

/// The vertices of all triangles with an area, each once.
fn surface_points(mesh: &Mesh) -> Vec<DVec3> {
    let point = |i: u32| mesh.positions.get(i as usize).map(|p| DVec3::from(p.map(f64::from)));
    let mut is_used = vec![false; mesh.positions.len()];
    for triangle in &mesh.triangles {
        let [Some(a), Some(b), Some(c)] = triangle.map(point) else { continue };
        let normal = (b - a).cross(c - a);
        if normal.is_finite() && normal != DVec3::ZERO {
            for i in triangle {
                is_used[*i as usize] = true;
            }
        }
    }
    (0..).zip(is_used).filter_map(|(i, is_used)| is_used.then(|| point(i))?).collect()
}

pub(crate) fn extent_of(points: impl Iterator<Item = DVec3>) -> Option<Extent> {
    points.map(|p| [p, p]).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

fn corners_of(points: &[DVec3]) -> Option<[DVec3; 8]> {
    extent_of(points.iter().copied()).map(corners)
}

/// The corners of a box.
fn corners([low, high]: Extent) -> [DVec3; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|i| {
        let at = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(at(0), at(1), at(2))
    })
}

/// The middle of a box, and the length of its diagonal; the origin and 1 without a box, and 1 for
/// one that is a point.
fn middle(extent: Option<Extent>) -> (DVec3, f64) {
    let [low, high] = extent.unwrap_or_default();
    let diagonal = (high - low).length();
    (0.5 * (low + high), if diagonal > 0.0 { diagonal } else { 1.0 })
}

/// Half of the width and height of what a camera shows: at distance 1 of a perspective, in the unit
/// of the world of parallel rays.
pub fn half_extent(camera: &Camera) -> [f64; 2] {
    let half_tan = |degrees: f64| libm::tan(0.5 * degrees.to_radians());
    let axes = camera.to_world.matrix3;
    match camera.projection {
        Projection::Perspective { x_fov, y_fov } => [x_fov, y_fov].map(half_tan),
        Projection::Orthographic { half_width, half_height } => {
            [half_width * axes.x_axis.length(), half_height * axes.y_axis.length()]
        }
        Projection::Panorama => [2.0, 1.0],
    }
}

/// Puts a camera to where its [`Placement`] says, for an image that shows this
/// [half of the width and height](half_extent), which is returned, changed for parallel rays that
/// are to fit. What is near or far of it, its lens, motion and medium belong to its node alone.
pub fn place(camera: &mut Camera, half: [f64; 2], extent: Option<Extent>) -> [f64; 2] {
    let placement = std::mem::take(&mut camera.placement);
    let (node, distance, half) = match placement {
        Placement::Node => return half,
        Placement::Course => {
            let ahead = camera.to_world.transform_point3(DVec3::NEG_Z);
            let (node, distance) = looking_from(ahead, COURSE_DISTANCE, extent);
            (node, distance, half)
        }
        Placement::Fit => match fitted(camera, half, extent) {
            Some(fitted) => fitted,
            None => return half,
        },
    };
    camera.to_world = node;
    (camera.near, camera.far) = (1e-3 * distance, f64::INFINITY);
    (camera.lens_radius, camera.focal_distance) = (0.0, distance);
    camera.principal_point_offset = [0.0; 2];
    (camera.motion, camera.medium) = (None, None);
    half
}

/// The node of a camera that looks at the middle of a box from the direction of a vector, +z if it
/// has no length, so many diagonals away, with +y up; and its distance from there.
pub fn looking_from(direction: DVec3, diagonals: f64, extent: Option<Extent>) -> (DAffine3, f64) {
    const NUDGE: f64 = 1e-5;
    let d = direction.normalize_or(DVec3::Z);
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
    let axes = DMat3::from_cols(right, back.cross(right), back);
    let (target, diagonal) = middle(extent);
    let distance = diagonals * diagonal;
    (DAffine3::from_mat3_translation(axes, target + back * distance), distance)
}

/// The node of a camera along its viewing axis through the middle of a box, as near as shows all of
/// the box; its distance from there; and half of the width and height of what it shows. `None` for
/// panoramas, which show all directions, and without a box.
fn fitted(
    camera: &Camera,
    half: [f64; 2],
    extent: Option<Extent>,
) -> Option<(DAffine3, f64, [f64; 2])> {
    /// The least share of the diagonal by which the box is in front of a perspective.
    const CLEARANCE: f64 = 0.01;
    let axes = camera.to_world.matrix3;
    let [right, up, back] = [axes.x_axis, axes.y_axis, axes.z_axis].map(DVec3::normalize_or_zero);
    let (target, diagonal) = middle(extent);
    let seen = corners(extent?).map(|corner| {
        let at = corner - target;
        let sides = [at.dot(right).abs(), at.dot(up).abs()];
        (at.dot(back), MARGIN * (sides[0] / half[0]).max(sides[1] / half[1]))
    });
    let greatest = |of: fn((f64, f64), f64) -> f64| {
        seen.iter().map(|corner| of(*corner, CLEARANCE * diagonal)).fold(0.0, f64::max)
    };
    let (distance, half) = match camera.projection {
        Projection::Panorama => return None,
        Projection::Perspective { .. } => {
            (greatest(|(depth, away), least| depth + away.max(least)), half)
        }
        Projection::Orthographic { .. } => {
            let scale = greatest(|(_, scale), _| scale);
            (diagonal, half.map(|x| if scale > 0.0 { x * scale } else { x }))
        }
    };
    let axes = DMat3::from_cols(right, up, back);
    Some((DAffine3::from_mat3_translation(axes, target + back * distance), distance, half))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Span;

    fn object(geometry: Geometry, to_world: DAffine3) -> Object {
        Object {
            name: String::new(),
            to_world,
            motion: None,
            geometry,
            materials: vec![None],
            media: None,
            at: Span::default(),
        }
    }

    fn camera(to_world: DAffine3, projection: Projection, placement: Placement) -> Camera {
        Camera {
            name: String::new(),
            to_world,
            motion: None,
            shutter: [0.0; 2],
            projection,
            near: 0.1,
            far: 5.0,
            lens_radius: 0.5,
            aperture: None,
            focal_distance: 1.0,
            principal_point_offset: [0.1; 2],
            fit: crate::Fit::Whole,
            medium: Some(0),
            placement,
            meter: None,
        }
    }

    const BOX: Extent = [DVec3::new(-1.0, 0.0, -3.0), DVec3::new(2.0, 1.5, 1.0)];

    /// A vertex that no triangle uses, one of a triangle without an area, and one that is not
    /// finite belong to no surface.
    #[test]
    fn surfaces_are_triangles_with_an_area() {
        let far = [1e6, 1e6, 1e6];
        let positions = vec![
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            far,
            [-9.0, 0.0, 0.0],
            [f32::NAN, 0.0, 0.0],
        ];
        let triangles = vec![[0, 1, 2], [0, 1, 4], [0, 1, 5]];
        let mesh = Geometry::Mesh(Arc::new(Mesh { positions, triangles, ..Mesh::default() }));
        let scene = Scene { objects: vec![object(mesh, DAffine3::IDENTITY)], ..Scene::default() };
        let expected = [DVec3::ZERO, DVec3::new(1.0, 2.0, 0.0)];
        assert_eq!(surface_extent(&scene, None), Some(expected));
        assert_eq!(surface_extent(&Scene::default(), None), None);
    }

    #[test]
    fn the_box_around_an_ellipsoid_has_its_axes() {
        let stretched = DAffine3::from_scale(DVec3::new(1.0, 2.0, 3.0));
        let sphere = object(Geometry::Sphere { radius: 2.0 }, stretched);
        let scene = Scene { objects: vec![sphere], ..Scene::default() };
        let reach = DVec3::new(2.0, 4.0, 6.0);
        assert_eq!(surface_extent(&scene, None), Some([-reach, reach]));
    }

    /// The point one unit in front of a node at (0, −4, 1) that looks along +y is (0, −3, 1).
    #[test]
    fn the_course_takes_a_direction_from_the_origin() {
        let turned = DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2);
        let node = DAffine3::from_translation(DVec3::new(0.0, -4.0, 1.0)) * turned;
        let view = Projection::Perspective { x_fov: 50.0, y_fov: 40.0 };
        let mut seen = camera(node, view, Placement::Course);
        let half = half_extent(&seen);
        assert_eq!(place(&mut seen, half, Some(BOX)), half);
        let middle = DVec3::new(0.5, 0.75, -1.0);
        let direction = DVec3::new(0.0, -3.0, 1.0).normalize();
        let distance = 1.5 * DVec3::new(3.0, 1.5, 4.0).length();
        let expected = middle + distance * direction;
        assert!(seen.to_world.translation.abs_diff_eq(expected, 1e-9));
        assert!(seen.to_world.matrix3.z_axis.abs_diff_eq(direction, 1e-12));
        assert!(seen.to_world.matrix3.x_axis.y.abs() < 1e-12, "no roll");
        assert!((seen.focal_distance - distance).abs() < 1e-12);
        assert_eq!((seen.lens_radius, seen.medium), (0.0, None));
    }

    /// All corners are in view, and one of them 1/1.05 of the way from the middle to an edge.
    #[test]
    fn what_fits_fills_the_view() {
        let node = DAffine3::from_rotation_y(0.4) * DAffine3::from_rotation_x(-0.6);
        let perspective = Projection::Perspective { x_fov: 40.0, y_fov: 30.0 };
        let parallel = Projection::Orthographic { half_width: 3.0, half_height: 1.0 };
        for projection in [perspective, parallel] {
            let mut seen = camera(node, projection, Placement::Fit);
            let before = half_extent(&seen);
            let half = place(&mut seen, before, Some(BOX));
            assert!((half[0] / half[1] - before[0] / before[1]).abs() < 1e-12);
            let to_camera = seen.to_world.inverse();
            let mut most = 0.0_f64;
            for corner in corners(BOX) {
                let p = to_camera.transform_point3(corner);
                assert!(p.z < 0.0, "{p}");
                let depth = if projection == parallel { 1.0 } else { -p.z };
                most = most.max(p.x.abs() / depth / half[0]).max(p.y.abs() / depth / half[1]);
            }
            assert!((most - 1.0 / 1.05).abs() < 1e-9, "{most}");
        }
    }
}
