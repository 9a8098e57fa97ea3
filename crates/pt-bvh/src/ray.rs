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
//! depth at which the ray is within 31εR of the triangle, and of the box around the part of it that
//! is there. (Where double precision finds τ by the plane, the ray is within εR of the triangle
//! there.) A box test that computes in f32 relative to any point of the scene errs by at most 10εR,
//! and the rounding of the slopes moves the ray by 3εR; so a box test that widens its slabs by the
//! *pad* of 48εR on every side finds an interval that contains τ. Hence each traversal visits all that
//! can win, and finds the same nearest hit, bit for bit, as a loop over all primitives.
//! (Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection", §3.3, pad the origin for
//! the same reason; Ize 2013, "Robust BVH Ray Traversal", bounds the rounding of the slab test.)

use pt_math::interval::{EPSILON, gamma};
use pt_math::{BVec3A, Bounds3, Ray, Vec3, Vec3A, Vec4};
use wide::u32x4;

use crate::geometry::LARGEST_COORDINATE;

/// In units of R; see the module.
pub(crate) const PAD: f32 = 48.0 * EPSILON;
/// The part of the pad that the box test itself needs.
pub(crate) const BOX_TEST: f32 = 16.0 * EPSILON;
/// Never 0, so that depths of 0 stay inside.
pub(crate) const LEAST_PAD: f32 = 4.0 * f32::MIN_POSITIVE;
/// Directions shorter than this, or longer than its inverse, are not inverted, but their slopes.
const LEAST_SCALE: f32 = 1.0 / (1u128 << 100) as f32;
/// Slopes below this are rounded up to it: over the depth R that moves the ray by εR.
pub(crate) const LEAST_SLOPE: f32 = EPSILON;
/// More than the relative error of converting between t and τ, and back; and more than by what the
/// depth of a hit, a mean of those of the vertices, can lie outside of these.
pub(crate) const CONVERSION: f32 = gamma(16);

/// The axes in cyclic order, by the one that comes last.
pub(crate) const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// Where everything is that rays can hit, by which their error bounds go.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Scene {
    pub(crate) center: Vec3A,
    /// How far from there things are at most, per axis.
    pub(crate) half: Vec3A,
}

impl Scene {
    /// What is in a box that is not empty.
    pub(crate) fn new(bounds: &Bounds3) -> Self {
        Self::around(bounds.center(), bounds)
    }

    /// The same, with any point in place of the middle.
    pub(crate) fn around(center: Vec3, bounds: &Bounds3) -> Self {
        let half = (bounds.max - center).max(center - bounds.min) * (1.0 + 4.0 * EPSILON);
        Self { center: center.into(), half: half.into() }
    }
}

/// A ray with everything that does not depend on the box or primitive it is tested against.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Prepared {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// The axes in cyclic order, the last the one along which the direction is largest.
    pub(crate) axes: [usize; 3],
    /// |d_kz|, kz the last of the axes.
    pub(crate) scale: f32,
    /// d / scale.
    pub(crate) slopes: Vec3A,
    /// A bit for each axis along which the ray falls.
    pub(crate) falls: u32,
    /// |d_kz| / d per axis, at most 1/ε in magnitude, never infinite.
    pub(crate) inverse: Vec3A,
    /// By how much a box is widened on every side before it is tested.
    pub(crate) pad: f32,
    /// Hits at or before this t do not count; at least 0.
    pub(crate) t_min: f32,
    /// Hits at or after this t do not count.
    pub(crate) t_max: f32,
}

impl Prepared {
    /// Prepares a ray for queries in a scene with these bounds; `None` when it cannot hit
    /// anything: no direction, an origin or direction that is not finite, an empty scene.
    pub(crate) fn new(ray: &Ray, bounds: &Bounds3) -> Option<Self> {
        if bounds.is_empty() { None } else { Self::in_scene(ray, &Scene::new(bounds)) }
    }

    /// The same where there is something.
    #[inline(always)]
    pub(crate) fn in_scene(ray: &Ray, scene: &Scene) -> Option<Self> {
        let numbers: [f32; 8] = bytemuck::cast(*ray);
        let o = Vec3A::from_vec4(Vec4::from_slice(&numbers[..4]));
        let d = Vec3A::from_vec4(Vec4::from_slice(&numbers[3..7]));
        let size = d.abs();
        let scale = greatest(size.extend(0.0));
        let slopes = d / scale;
        // Without direction, or with one that is not finite, some slope is not a number.
        let usable =
            slopes.abs().cmple(Vec3A::ONE) & o.abs().cmple(Vec3A::splat(LARGEST_COORDINATE));
        if !usable.all() {
            return None;
        }
        // Not the inverse of the slopes: this is known sooner, and all queries wait for it.
        let is_usual = (LEAST_SCALE..=1.0 / LEAST_SCALE).contains(&scale);
        let inverse = if is_usual { d.recip() * scale } else { unusual_inverse(slopes) };
        let inverse = at_most(inverse, 1.0 / LEAST_SLOPE);
        let reach = (scene.center - o).abs() + scene.half;
        Some(Self {
            origin: ray.origin,
            direction: ray.direction,
            axes: axes_of(size.cmpeq(Vec3A::splat(scale))),
            scale,
            slopes,
            falls: d.is_negative_bitmask(),
            inverse,
            pad: PAD * greatest(reach.extend(LEAST_PAD / PAD)),
            t_min: ray.t_min.max(0.0),
            t_max: ray.t_max,
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

/// The greatest of four numbers that are not below 0, which compare as integers: that is known sooner.
#[inline(always)]
fn greatest(x: Vec4) -> f32 {
    let x: u32x4 = bytemuck::cast(x);
    let x = x.max(x.shuffle(u32x4::new([2, 3, 0, 1])));
    let x = x.max(x.shuffle(u32x4::new([1, 0, 3, 2])));
    f32::from_bits(x.as_array()[0])
}

/// Three numbers, in magnitude at most `most`; none is NaN. See [`greatest`].
#[inline(always)]
fn at_most(x: Vec3A, most: f32) -> Vec3A {
    let sign = u32x4::splat(1 << 31);
    let x: u32x4 = bytemuck::cast(x.extend(0.0));
    let magnitude = (x & !sign).min(u32x4::splat(most.to_bits()));
    Vec3A::from_vec4(bytemuck::cast(magnitude | (x & sign)))
}

/// What [`Prepared::inverse`] is made of for very short and very long directions.
#[cold]
#[inline(never)]
fn unusual_inverse(slopes: Vec3A) -> Vec3A {
    slopes.recip()
}

/// The axes in cyclic order, the last of them along the largest of three magnitudes, by which of these
/// are as large as that: y before x before z.
#[inline(always)]
fn axes_of(largest: BVec3A) -> [usize; 3] {
    const X: [usize; 3] = AXES[0];
    const Y: [usize; 3] = AXES[1];
    const Z: [usize; 3] = AXES[2];
    static AMONG: [[usize; 3]; 8] = [X, X, Y, Y, Z, X, Y, Y];
    AMONG[largest.bitmask() as usize % 8]
}
