//! Bounds of the surfaces of a scene, and cameras that are placed by them.

use std::collections::HashMap;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3};

use crate::extent::{Extent, extent_of};
use crate::{Camera, Geometry, Mesh, Object, Placement, Projection, Scene, points};

/// Maximum number of vertices that are transformed one by one; beyond it, only the corners of the
/// bounding box of each copy are.
const MAX_PLACED: usize = 50_000_000;
/// Distance of the course program's camera from the centre of the bounding box, in diagonals.
const COURSE_DISTANCE: f64 = 1.5;
/// Ratio of the size of the view to that of the box for [`Placement::Fit`].
const MARGIN: f64 = 1.05;

/// Returns the bounding box of all surfaces, over all keys of animations or over a span of time in
/// seconds. Vertices without a triangle of positive area are ignored; `None` if no surface remains.
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

/// Returns the object-to-world transforms of an object at the keys of its motion, or at the knots
/// in a span of time.
fn places(object: &Object, span: Option<[f64; 2]>) -> Vec<DAffine3> {
    let Some(motion) = &object.motion else { return vec![object.to_world] };
    let keys = match span {
        None => motion.keys().to_vec(),
        Some(span) => motion.knots(span),
    };
    keys.iter().map(|key| key.to_world * object.to_world).collect()
}

/// Returns the bounding box of a sphere under an affine transform. Its half extent along an axis is
/// the radius times the length of that row of the matrix.
fn extent_of_sphere(radius: f64, place: &DAffine3) -> Extent {
    let rows = place.matrix3.transpose();
    let lengths = [rows.x_axis, rows.y_axis, rows.z_axis].map(DVec3::length);
    let reach = DVec3::from_array(lengths) * radius.abs();
    [place.translation - reach, place.translation + reach]
}

/// Returns the vertices of all triangles with positive area, each once.
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

fn corners_of(points: &[DVec3]) -> Option<[DVec3; 8]> {
    extent_of(points.iter().copied()).map(corners)
}

/// Returns the corners of a box.
fn corners([low, high]: Extent) -> [DVec3; 8] {
    [0, 1, 2, 3, 4, 5, 6, 7].map(|i| {
        let at = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
        DVec3::new(at(0), at(1), at(2))
    })
}

/// Returns the centre of a box and the length of its diagonal. Without a box, these are the origin
/// and 1; for a box that is a point, the length is 1.
fn middle(extent: Option<Extent>) -> (DVec3, f64) {
    let [low, high] = extent.unwrap_or_default();
    let diagonal = (high - low).length();
    (0.5 * (low + high), if diagonal > 0.0 { diagonal } else { 1.0 })
}

/// Returns half of the width and height of the view of a camera: at distance 1 for a perspective,
/// in world units for parallel rays.
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

/// Moves a camera according to its [`Placement`], for an image that shows this [half of the width
/// and height](half_extent). Returns the half extent, which changes for parallel rays with
/// [`Placement::Fit`]. Placements other than [`Placement::Node`] replace the clipping distances and
/// remove lens, motion and medium.
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

/// Returns the node of a camera that looks at the centre of a box, with +y up, and its distance
/// from the centre. The camera is in the given direction from the centre, or in +z if that has no
/// length, at a distance of this many diagonals.
pub fn looking_from(direction: DVec3, diagonals: f64, extent: Option<Extent>) -> (DAffine3, f64) {
    const NUDGE: f64 = 1e-5;
    let d = direction.normalize_or(DVec3::Z);
    // Exactly above or below, the up direction would be undefined.
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

/// Returns the node of a camera on the line through the centre of a box along its viewing axis, at
/// the smallest distance from which all of the box is visible; that distance; and half of the width
/// and height of the view. `None` for panoramas, which show all directions, and without a box.
fn fitted(
    camera: &Camera,
    half: [f64; 2],
    extent: Option<Extent>,
) -> Option<(DAffine3, f64, [f64; 2])> {
    /// Minimum distance of a perspective camera from the box, relative to the diagonal.
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

    /// Unreferenced vertices, vertices of triangles without area and vertices that are not finite
    /// are ignored.
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
        let mesh = Geometry::Mesh(Arc::new(Mesh {
            positions: positions.into(),
            triangles: triangles.into(),
            ..Mesh::default()
        }));
        let scene =
            Scene { objects: vec![object(mesh, DAffine3::IDENTITY)].into(), ..Scene::default() };
        let expected = [DVec3::ZERO, DVec3::new(1.0, 2.0, 0.0)];
        assert_eq!(surface_extent(&scene, None), Some(expected));
        assert_eq!(surface_extent(&Scene::default(), None), None);
    }

    #[test]
    fn the_box_around_an_ellipsoid_has_its_axes() {
        let stretched = DAffine3::from_scale(DVec3::new(1.0, 2.0, 3.0));
        let sphere = object(Geometry::Sphere { radius: 2.0 }, stretched);
        let scene = Scene { objects: vec![sphere].into(), ..Scene::default() };
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

    /// All corners are visible, and the outermost one is at 1/1.05 of the distance from the centre
    /// to an edge.
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
