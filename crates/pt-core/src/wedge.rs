//! Where rays begin that leave a triangle next to others.
//!
//! A point of a triangle is rounded, and moved off the triangle so that rays from it do not hit
//! that one again: what is reached thereby may lie beyond another wall that meets this one at an
//! acute angle, and light would leak from there into a closed room, or out of it. In double
//! precision the point is on the triangle, and so inside of the room. Where another triangle
//! crosses the way from there to the origin of a ray, the point is moved away from the edge, within
//! its triangle.

use pt_bvh::{Bvh, Hit};
use pt_math::float_error::EPSILON;
use pt_math::{DVec3, Vec3};

/// Origins of rays lie beyond a wall at an angle of 1° or more only where the edge is nearer than
/// so many times the distance from the point to them: cot 1° = 57.3, doubled for half of the room
/// between the walls to be left.
const COTANGENT: f32 = 128.0;

/// A point is moved by at most 2 to this power times the distance to the origins of its rays.
const STEPS: i32 = 12;

/// A point with at least this share of each corner is inside of its triangle, whatever was rounded.
const MIN_SHARE: f64 = 1e-9;

/// How much farther off a triangle rays begin next to its edges, by its size: the vertices that
/// the triangle test sees err by 17ε of their distance, and what passes the edge at less than that
/// may pass between the triangle, from which it comes, and the other one.
#[inline(always)]
pub(crate) fn margin(size: f32) -> f32 {
    size * (64.0 * EPSILON)
}

/// Returns true if another wall may be in the way of rays' origins, which are within `reach` of the
/// point.
#[inline(always)]
pub(crate) fn may_be_crossed(to_edge: f32, reach: f32) -> bool {
    to_edge < reach * COTANGENT
}

/// The point of a triangle, of those on the way from where it was hit to its middle, that is
/// nearest to the hit among those from which no other triangle is met on the way to the `origins`
/// of rays that leave it, nor as far beyond these; if there is one. Origins are within `reach`.
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
    // By rounding, some may be below 0.
    let shares = [1.0 - b1 - b2, b1, b2].map(|b| b.max(0.0));
    let p = mean(shares.map(|b| b / shares.iter().sum::<f64>()));
    let is_inside = shares.iter().all(|&b| b > MIN_SHARE);
    let to_middle = mean([1.0 / 3.0; 3]) - p;
    let step = f64::from(reach) / to_middle.length();
    let shares = (0..=STEPS).map(|i| (step * f64::from(1 << i)).min(1.0));
    let moved = shares.map(|share| p + to_middle * share);
    is_inside.then_some(p).into_iter().chain(moved).find(is_clear)
}
