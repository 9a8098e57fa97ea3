//! Rays prepared for many tests, and the error bounds that make the tests consistent.
//!
//! **Units.** With kz the axis along which the direction is largest, triangles and most boxes are
//! tested in units of depth, τ = t·|d_kz|: the slope of the ray per axis is then at most 1, and
//! results do not depend on the length of the direction. Single rays are tested against the boxes
//! of the wide tree in units of t, which is available earlier, if its values are neither too small
//! nor too large.
//!
//! **Why no box test misses a triangle that the triangle test hits.** Let R be the largest
//! coordinate distance from the origin to a corner of the scene box. The triangle test is exact for
//! *sheared and rounded* vertices, each of which is within 17εR of the true one (translation ε,
//! slope ε, product ε, difference ε, on coordinates up to 3R; and ε in depth). The depth τ that it
//! computes errs by at most 14εR (see [`crate::triangle`]), and slopes are at most 1. So τ is a
//! depth at which the ray is within 31εR of the triangle, and of the box around the part of it in a
//! leaf. (If double precision computes τ from the plane, the ray is within εR of the triangle
//! there.) A box test that computes in f32 relative to any point of the scene errs by at most 10εR,
//! and the rounding of the slopes moves the ray by 3εR; so a box test that widens its slabs by the
//! *pad* of 48εR on every side finds an interval that contains τ. Hence each traversal visits every
//! possible nearest hit, and returns the same hit, bit for bit, as a loop over all primitives. The
//! wide tree's boxes are stored with the pad of rays that begin near (R up to twice half of the
//! largest extent), which need no further pad; for other rays the remainder is added. (Woop,
//! Benthin & Wald 2013, "Watertight Ray/Triangle Intersection", §3.3, pad the origin for the same
//! reason; Ize 2013, "Robust BVH Ray Traversal", bounds the rounding of the slab test.)

use pt_math::float_error::{EPSILON, gamma};
use pt_math::{BVec3A, Bounds3, Ray, Vec3, Vec3A, Vec4};
use wide::u32x4;

use crate::geometry::LARGEST_COORDINATE;

/// Pad in units of R; see the module.
pub(crate) const PAD: f32 = 48.0 * EPSILON;
/// Part of the pad that covers the error of the box test itself.
pub(crate) const BOX_TEST: f32 = 16.0 * EPSILON;
/// Minimum pad; positive, so that depths of 0 stay inside.
pub(crate) const MIN_PAD: f32 = 4.0 * f32::MIN_POSITIVE;
/// Lower bound of the pad of boxes over a component of an ordinary ray's direction.
const MIN_SCALE: f32 = 1.0 / (1u128 << 100) as f32;
/// Minimum magnitude of a component of an ordinary ray's direction.
const MIN_COMPONENT: f32 = 1.0 / (1u64 << 60) as f32;
/// Boxes of trees are widened for rays with R up to this times half of the scene's largest extent.
const NEAR: f32 = 2.0;
/// Minimum magnitude of slopes; over the depth R, rounding up to it moves the ray by εR.
pub(crate) const MIN_SLOPE: f32 = EPSILON;
/// Greater than the relative error of converting between t and τ, and back; and greater than the
/// distance by which the depth of a hit, a mean of those of the vertices, can lie outside of these.
pub(crate) const CONVERSION: f32 = gamma(16);

/// Axes in cyclic order, indexed by the last one.
pub(crate) const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// Extent of the scene, from which the error bounds of rays follow.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct SceneExtent {
    pub(crate) center: Vec3A,
    /// Maximum distance of geometry from the center, per axis.
    pub(crate) half: Vec3A,
    /// Pad by which boxes of the tree are widened on every side when they are stored.
    pub(crate) padded: f32,
    /// Maximum distance of the origins of ordinary rays from the center, per axis; see
    /// [`PreparedRay::ordinary`].
    room: Vec3A,
    /// Maximum magnitude of a component of an ordinary ray's direction.
    longest: f32,
}

impl SceneExtent {
    /// Extent of the scene in a box that is not empty.
    pub(crate) fn new(bounds: &Bounds3) -> Self {
        Self::around(bounds.center(), bounds)
    }

    /// [`Self::new`] with any point in place of the center of the box.
    pub(crate) fn around(center: Vec3, bounds: &Bounds3) -> Self {
        let half = (bounds.max - center).max(center - bounds.min) * (1.0 + 4.0 * EPSILON);
        let reach = NEAR * half.max_element();
        let in_range = (Vec3::splat(LARGEST_COORDINATE) - center.abs()).max(Vec3::ZERO);
        let room = (Vec3::splat(reach) - half).min(in_range) * (1.0 - 4.0 * EPSILON);
        let padded = (PAD * reach).max(MIN_PAD);
        Self {
            center: center.into(),
            half: half.into(),
            padded,
            room: room.into(),
            longest: (padded / MIN_SCALE).min(1.0 / MIN_COMPONENT),
        }
    }

    /// Makes [`PreparedRay::ordinary`] reject all rays.
    pub(crate) fn make_no_ray_ordinary(&mut self) {
        self.room = Vec3A::NEG_INFINITY;
    }

    /// Mask of the axes along which a direction of this magnitude allows depths in boxes to be t.
    #[inline(always)]
    fn is_ordinary(&self, size: Vec3A) -> BVec3A {
        size.cmpge(Vec3A::splat(MIN_COMPONENT)) & size.cmple(Vec3A::splat(self.longest))
    }
}

/// A ray with all precomputed values that do not depend on the box or primitive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PreparedRay {
    pub(crate) origin: Vec3,
    pub(crate) direction: Vec3,
    /// Axes in cyclic order; the last is the one along which the direction is largest.
    pub(crate) axes: [usize; 3],
    /// |d_kz|, with kz the last of the axes.
    pub(crate) scale: f32,
    /// d / scale.
    pub(crate) slopes: Vec3A,
    /// Bit mask of the axes along which the direction is negative.
    pub(crate) falls: u32,
    /// Depths in boxes are t·unit.
    pub(crate) unit: f32,
    /// unit / d per axis; never infinite.
    pub(crate) inverse: Vec3A,
    /// Pad by which a box must be widened on every side before the test.
    pub(crate) pad: f32,
    /// Hits at or before this t are ignored; at least 0.
    pub(crate) t_min: f32,
    /// Hits at or after this t are ignored.
    pub(crate) t_max: f32,
}

impl PreparedRay {
    /// Prepares a ray for queries in a scene with these bounds; `None` if it cannot hit anything: a
    /// zero direction, an origin or direction that is not finite, or an empty scene.
    pub(crate) fn new(ray: &Ray, bounds: &Bounds3) -> Option<Self> {
        if bounds.is_empty() { None } else { Self::in_scene(ray, &SceneExtent::new(bounds)) }
    }

    /// Prepares an ordinary ray for a tree whose boxes are widened by [`SceneExtent::padded`]: one
    /// that begins so near, in a direction so ordinary, that its depth in boxes can be t, and boxes
    /// need no further pad. `None` for other rays. The test is short, since all queries wait for
    /// it.
    ///
    /// Distances to planes are below 2⁶⁶ and inverses at most 2⁶⁰, so depths are finite. Boxes that
    /// contain the origin are left at t ≥ padded / longest ≥ 2⁻¹⁰⁰, which is positive in single
    /// precision.
    #[inline(always)]
    pub(crate) fn ordinary(ray: &Ray, scene: &SceneExtent) -> Option<Self> {
        let [o, d] = origin_and_direction(ray);
        let size = d.abs();
        let is_near = (scene.center - o).abs().cmple(scene.room);
        (is_near & scene.is_ordinary(size)).all().then(|| {
            let scale = greatest(size.extend(0.0));
            Self::of(ray, d, scale, d / scale, 1.0, d.recip(), 0.0)
        })
    }

    /// Prepares any ray for a scene that is not empty; `None` if it cannot hit anything.
    #[inline(always)]
    pub(crate) fn in_scene(ray: &Ray, scene: &SceneExtent) -> Option<Self> {
        let [o, d] = origin_and_direction(ray);
        let size = d.abs();
        let scale = greatest(size.extend(0.0));
        let slopes = d / scale;
        // A direction that is zero or not finite has a slope that is NaN.
        let usable =
            slopes.abs().cmple(Vec3A::ONE) & o.abs().cmple(Vec3A::splat(LARGEST_COORDINATE));
        if !usable.all() {
            return None;
        }
        let reach = (scene.center - o).abs() + scene.half;
        let pad = PAD * greatest(reach.extend(MIN_PAD / PAD));
        let is_ordinary = scene.is_ordinary(size).all();
        let (unit, inverse) =
            if is_ordinary { (1.0, d.recip()) } else { (scale, inverse_of_slopes(slopes)) };
        Some(Self::of(ray, d, scale, slopes, unit, inverse, pad))
    }

    /// Fills in the fields common to all rays.
    #[inline(always)]
    fn of(
        ray: &Ray,
        d: Vec3A,
        scale: f32,
        slopes: Vec3A,
        unit: f32,
        inverse: Vec3A,
        pad: f32,
    ) -> Self {
        Self {
            origin: ray.origin,
            direction: ray.direction,
            axes: axes_of(d.abs().cmpeq(Vec3A::splat(scale))),
            scale,
            slopes,
            falls: d.is_negative_bitmask(),
            unit,
            inverse,
            pad,
            t_min: ray.t_min.max(0.0),
            t_max: ray.t_max,
        }
    }

    /// Upper bound of the depth in boxes of all hits with parameter up to `t`; positive.
    #[inline]
    pub(crate) fn depth_limit(&self, t: f32) -> f32 {
        depth_limit(t, self.unit)
    }

    /// Lower bound, within the pad, of the depth in boxes of all hits after `t_min`; positive.
    #[inline]
    pub(crate) fn depth_start(&self) -> f32 {
        depth_start(self.t_min, self.unit)
    }

    /// Interval of depths in which the ray is inside of the box widened by `pad` on every side.
    /// With the pad of the ray, it contains those of all hits in the box.
    #[inline]
    pub(crate) fn slab_interval(&self, bounds: &Bounds3, pad: f32) -> (f32, f32) {
        let [min, max, origin] = [bounds.min, bounds.max, self.origin].map(Vec3A::from);
        let a = (min - origin - pad) * self.inverse;
        let b = (max - origin + pad) * self.inverse;
        (a.min(b).max_element(), a.max(b).min_element())
    }
}

/// Origin and direction of a ray as vectors.
#[inline(always)]
fn origin_and_direction(ray: &Ray) -> [Vec3A; 2] {
    let numbers: [f32; 8] = bytemuck::cast(*ray);
    [&numbers[..4], &numbers[3..7]].map(|four| Vec3A::from_vec4(Vec4::from_slice(four)))
}

/// [`PreparedRay::depth_limit`] in units of `scale`. The added terms matter only for subnormal
/// numbers.
#[inline(always)]
pub(crate) fn depth_limit(t: f32, scale: f32) -> f32 {
    ((t + MIN) * ((scale + MIN) * (1.0 + CONVERSION))).max(2.0 * f32::MIN_POSITIVE)
}

/// [`PreparedRay::depth_start`] in units of `scale`.
#[inline(always)]
pub(crate) fn depth_start(t_min: f32, scale: f32) -> f32 {
    (t_min * scale * (1.0 - CONVERSION)).max(f32::MIN_POSITIVE)
}

/// Least positive number.
pub(crate) const MIN: f32 = f32::from_bits(1);

/// Maximum of four nonnegative numbers, compared as integers for lower latency.
#[inline(always)]
fn greatest(x: Vec4) -> f32 {
    let x: u32x4 = bytemuck::cast(x);
    let x = x.max(x.shuffle(u32x4::new([2, 3, 0, 1])));
    let x = x.max(x.shuffle(u32x4::new([1, 0, 3, 2])));
    f32::from_bits(x.as_array()[0])
}

/// Reciprocals of slopes, some of which may be 0.
#[cold]
#[inline(never)]
fn inverse_of_slopes(slopes: Vec3A) -> Vec3A {
    slopes.abs().max(Vec3A::splat(MIN_SLOPE)).copysign(slopes).recip()
}

/// Axes in cyclic order, the last of them along the largest of three magnitudes. `largest` marks
/// the magnitudes equal to the maximum; ties are resolved as y before x before z.
#[inline(always)]
fn axes_of(largest: BVec3A) -> [usize; 3] {
    const X: [usize; 3] = AXES[0];
    const Y: [usize; 3] = AXES[1];
    const Z: [usize; 3] = AXES[2];
    static AMONG: [[usize; 3]; 8] = [X, X, Y, Y, Z, X, Y, Y];
    AMONG[largest.bitmask() as usize % 8]
}
