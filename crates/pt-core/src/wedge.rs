//! Origins of rays that leave a triangle next to others.
//!
//! A ray origin is a rounded point of a triangle, offset so that the ray does not hit the triangle
//! again. It may lie behind another wall that meets this one at an acute angle, and light would
//! leak from there into a closed room, or out of it. In double precision the point is on the
//! triangle, and so inside of the room. If another triangle crosses the segment from there to the
//! origin of a ray, the point is moved away from the edge, within its triangle.

use pt_bvh::{Bvh, Hit};
use pt_math::float_error::EPSILON;
use pt_math::{DVec3, Vec3};

/// Largest distance to an edge, relative to the distance from the point to the origins of its rays,
/// at which an origin can lie behind a wall that meets the triangle at 1° or more: cot 1° = 57.3,
/// doubled so that half of the space between the walls is left.
const COTANGENT: f32 = 128.0;

/// A point is moved by at most 2 to this power times the distance to the origins of its rays.
const STEPS: i32 = 12;

/// Smallest barycentric coordinate of points that are inside of their triangle despite rounding.
const MIN_SHARE: f64 = 1e-9;

/// Returns the additional offset of the origins of rays near the edges of a triangle of this size.
/// The vertices in the triangle test have errors of 17ε of their distance, and a ray that passes an
/// edge more closely than that may slip between the triangle that it leaves and the adjacent one.
#[inline(always)]
pub(crate) fn margin(size: f32) -> f32 {
    size * (64.0 * EPSILON)
}

/// Returns true if another wall may separate the point from the origins of its rays, which are
/// within `reach` of it.
#[inline(always)]
pub(crate) fn may_be_crossed(to_edge: f32, reach: f32) -> bool {
    to_edge < reach * COTANGENT
}

/// Returns the point of a triangle nearest to the hit, on the line from there to the centroid, from
/// which no other triangle is met on the way to the `origins` of rays, nor as far again beyond
/// them; `None` if there is none. Origins are within `reach`.
#[cold]
#[inline(never)]
pub(crate) fn clear(
    bvh: &Bvh,
    hit: &Hit,
    corners: [Vec3; 3],
    reach: f32,
    origins: impl Fn(DVec3) -> [DVec3; 2],
) -> Option<DVec3> {
    let corners = corners.map(Vec3::as_dvec3);
    let mean = |weights: [f64; 3]| (0..3).map(|i| corners[i] * weights[i]).sum::<DVec3>();
    let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
    let is_clear = |p: &DVec3| {
        let ends = origins(*p).map(|origin| *p + (origin - *p) * 2.0);
        !ends.into_iter().any(|end| bvh.is_crossed([*p, end], normal, hit.primitive))
    };
    let [b1, b2] = [hit.b1, hit.b2].map(f64::from);
    // Rounding may make some of them negative.
    let shares = [1.0 - b1 - b2, b1, b2].map(|b| b.max(0.0));
    let p = mean(shares.map(|b| b / shares.iter().sum::<f64>()));
    let is_inside = shares.iter().all(|&b| b > MIN_SHARE);
    let to_middle = mean([1.0 / 3.0; 3]) - p;
    let step = f64::from(reach) / to_middle.length();
    let shares = (0..=STEPS).map(|i| (step * f64::from(1 << i)).min(1.0));
    let moved = shares.map(|share| p + to_middle * share);
    is_inside.then_some(p).into_iter().chain(moved).find(is_clear)
}
