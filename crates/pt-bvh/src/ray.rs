//! A ray made ready for many tests, and the error bounds that make the tests agree.
//!
//! **Units.** With kz the axis along which the direction is largest, boxes and triangles are
//! tested in units of depth, τ = t·|d_kz|: the slope of the ray per axis is then at most 1, and
//! results do not depend on the length of the direction.
//!
//! **Why no box test misses a triangle that the triangle test hits.** Let R be the largest
//! coordinate distance from the origin to a corner of the scene box. The triangle test is exact
//! for *sheared and rounded* vertices, each of which is within 17εR of the true one (translation
//! ε, slope ε, product ε, difference ε, on coordinates up to 3R; and ε in depth). The depth τ that
//! it computes errs by at most 14εR (see [`crate::triangle`]), and slopes are at most 1. So τ is a
//! depth at which the ray is within 31εR of the triangle, and of the box around the part of it that is there. (Where double precision
//! finds τ by the plane, the ray is within εR of the triangle there.) A box test that
//! computes in f32 relative to any point of the scene errs by at most 10εR, and the rounding of the
//! slopes moves the ray by 3εR; so a box test that widens its slabs by the *pad* of 48εR on every
//! side finds an interval that contains τ. Hence each traversal visits all that can win, and finds
//! the same nearest hit, bit for bit, as a loop over all primitives.
//! (Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection", §3.3, pad the origin for
//! the same reason; Ize 2013, "Robust BVH Ray Traversal", bounds the rounding of the slab test.)

use pt_math::interval::{EPSILON, gamma};
use pt_math::{Bounds3, Ray, Vec3, Vec3A, Vec4};

use crate::geometry::LARGEST_COORDINATE;

/// In units of R; see the module.
pub(crate) const PAD: f32 = 48.0 * EPSILON;
/// The part of the pad that the box test itself needs.
pub(crate) const BOX_TEST: f32 = 16.0 * EPSILON;
/// Never 0, so that depths of 0 stay inside.
pub(crate) const LEAST_PAD: f32 = 4.0 * f32::MIN_POSITIVE;
/// Slopes below this are rounded up to it: over the depth R that moves the ray by εR.
pub(crate) const LEAST_SLOPE: f32 = EPSILON;
/// More than the relative error of converting between t and τ, and back; and more than by what the
/// depth of a hit, a mean of those of the vertices, can lie outside of these.
pub(crate) const CONVERSION: f32 = gamma(16);

/// The axes in cyclic order, by the one that comes last.
pub(crate) const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// A ray with everything that does not depend on the box or primitive it is tested against.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prepared {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// The axes in cyclic order, the last the one along which the direction is largest.
    pub(crate) axes: [usize; 3],
    /// Shear: d_kx / d_kz and d_ky / d_kz.
    pub(crate) shear: [f32; 2],
    /// Sign of d_kz: 1 or −1.
    pub(crate) sign: f32,
    /// |d_kz|.
    pub(crate) scale: f32,
    /// 1/|d_kz|.
    pub(crate) inverse_scale: f32,
    /// |d_kz| / d per axis, at most 1/ε in magnitude, never infinite.
    pub(crate) inverse: Vec3A,
    /// By how much a box is widened on every side before it is tested.
    pub(crate) pad: f32,
    /// Hits at or before this t do not count; at least 0.
    pub(crate) t_min: f32,
    /// Hits at or after this t do not count.
    pub(crate) t_max: f32,
    /// Largest coordinate of the origin.
    pub(crate) origin_size: f32,
}

impl Prepared {
    /// Prepares a ray for queries in a scene with these bounds; `None` when it cannot hit
    /// anything: no direction, an origin or direction that is not finite, an empty scene.
    #[inline(always)]
    pub(crate) fn new(ray: &Ray, scene: &Bounds3) -> Option<Self> {
        let numbers: [f32; 8] = bytemuck::cast(*ray);
        let o = Vec3A::from_vec4(Vec4::from_slice(&numbers[..4]));
        let d = Vec3A::from_vec4(Vec4::from_slice(&numbers[3..7]));
        let (reach_of_o, size) = (o.abs(), d.abs());
        let scale = size.max_element();
        let in_range = reach_of_o.cmple(Vec3A::splat(LARGEST_COORDINATE));
        let finite = size.cmple(Vec3A::splat(f32::MAX));
        if !(in_range & finite).all() || scale == 0.0 || scene.is_empty() {
            return None;
        }
        let axes = AXES[largest_axis(size)];
        let slope = d / scale;
        let steep = slope.abs().max(Vec3A::splat(LEAST_SLOPE)).copysign(slope);
        let slope = slope.to_array();
        let sign = slope[axes[2]];
        let to_corners = [scene.min, scene.max].map(|corner| (Vec3A::from(corner) - o).abs());
        let reach = to_corners[0].max(to_corners[1]).max_element();
        Some(Self {
            origin: ray.origin,
            direction: ray.direction,
            axes,
            shear: [slope[axes[0]] * sign, slope[axes[1]] * sign],
            sign,
            scale,
            inverse_scale: 1.0 / scale,
            inverse: steep.recip(),
            pad: (PAD * reach).max(LEAST_PAD),
            t_min: ray.t_min.max(0.0),
            t_max: ray.t_max,
            origin_size: reach_of_o.max_element(),
        })
    }

    /// A depth that no hit with parameter up to `t` exceeds; above 0.
    #[inline]
    pub(crate) fn depth_limit(&self, t: f32) -> f32 {
        depth_limit(t, self.scale)
    }

    /// A depth that every hit after `t_min` exceeds, or is within the pad of; above 0.
    #[inline]
    pub(crate) fn depth_start(&self) -> f32 {
        (self.t_min * self.scale * (1.0 - CONVERSION)).max(f32::MIN_POSITIVE)
    }

    /// The depths between which the ray is inside of the box widened by `pad` on every side: with
    /// the pad of the ray, those of all hits on what is in the box are among them.
    #[inline]
    pub(crate) fn slab_interval(&self, bounds: &Bounds3, pad: f32) -> (f32, f32) {
        let [min, max, origin] = [bounds.min, bounds.max, self.origin].map(Vec3A::from);
        let a = (min - origin - pad) * self.inverse;
        let b = (max - origin + pad) * self.inverse;
        (a.min(b).max_element(), a.max(b).min_element())
    }
}

/// See [`Prepared::depth_limit`]. What is added to t matters only where its digits end early.
#[inline(always)]
pub(crate) fn depth_limit(t: f32, scale: f32) -> f32 {
    ((t + LEAST) * (scale * (1.0 + CONVERSION))).max(2.0 * f32::MIN_POSITIVE)
}

/// The least number above 0.
pub(crate) const LEAST: f32 = f32::from_bits(1);

/// The axis of the largest of three magnitudes, without branches that could go wrong.
#[inline(always)]
fn largest_axis(size: Vec3A) -> usize {
    let [x, y, z] = size.to_array();
    [usize::from(y >= x), 2][usize::from(z > x.max(y))]
}
