//! A ray made ready for many tests, and the error bounds that make the tests agree.
//!
//! **Units.** With kz the axis along which the direction is largest, triangles and most boxes are
//! tested in units of depth, τ = t·|d_kz|: the slope of the ray per axis is then at most 1, and
//! results do not depend on the length of the direction. Single rays meet the boxes of the wide
//! tree in units of t, which is known sooner, where numbers are neither too small nor too large for
//! it.
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
//! *pad* of 48εR on every side finds an interval that contains τ. Hence each traversal visits all
//! that can win, and finds the same nearest hit, bit for bit, as a loop over all primitives. The
//! wide tree's boxes are stored with the pad of rays that begin near (R up to twice half of the
//! largest extent), so that these have no more to do; others add what is missing.
//! (Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection", §3.3, pad the origin for
//! the same reason; Ize 2013, "Robust BVH Ray Traversal", bounds the rounding of the slab test.)

use pt_math::float_error::{EPSILON, gamma};
use pt_math::{BVec3A, Bounds3, Ray, Vec3, Vec3A, Vec4};
use wide::u32x4;

use crate::geometry::LARGEST_COORDINATE;

/// In units of R; see the module.
pub(crate) const PAD: f32 = 48.0 * EPSILON;
/// The part of the pad that the box test itself needs.
pub(crate) const BOX_TEST: f32 = 16.0 * EPSILON;
/// Never 0, so that depths of 0 stay inside.
pub(crate) const MIN_PAD: f32 = 4.0 * f32::MIN_POSITIVE;
/// What boxes are widened by, over a component of an ordinary ray's direction, is at least this.
const MIN_SCALE: f32 = 1.0 / (1u128 << 100) as f32;
/// The least magnitude of a component of an ordinary ray's direction.
const MIN_COMPONENT: f32 = 1.0 / (1u64 << 60) as f32;
/// Boxes of trees are widened for rays with R up to this times half of the scene's largest extent.
const NEAR: f32 = 2.0;
/// Slopes below this are rounded up to it: over the depth R that moves the ray by εR.
pub(crate) const MIN_SLOPE: f32 = EPSILON;
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
    /// By how much boxes of the tree are widened on every side before there are rays.
    pub(crate) padded: f32,
    /// How far from the center ordinary rays begin at most, per axis; see [`Prepared::ordinary`].
    room: Vec3A,
    /// The greatest magnitude of a component of their directions.
    longest: f32,
}

impl Scene {
    /// What is in a box that is not empty.
    pub(crate) fn new(bounds: &Bounds3) -> Self {
        Self::around(bounds.center(), bounds)
    }

    /// The same, with any point in place of the middle.
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

    /// Has all rays made ready by [`Prepared::in_scene`].
    pub(crate) fn make_no_ray_ordinary(&mut self) {
        self.room = Vec3A::NEG_INFINITY;
    }

    /// Per axis, whether that magnitude of a ray's direction lets its depth in boxes be t.
    #[inline(always)]
    fn is_ordinary(&self, size: Vec3A) -> BVec3A {
        size.cmpge(Vec3A::splat(MIN_COMPONENT)) & size.cmple(Vec3A::splat(self.longest))
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
    /// Boxes are met at depths t·unit.
    pub(crate) unit: f32,
    /// unit / d per axis, never infinite.
    pub(crate) inverse: Vec3A,
    /// By how much a box is to be widened on every side before it is tested.
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

    /// The same for most rays that come to a tree whose boxes are widened by [`Scene::padded`]:
    /// those that begin so near, in a direction so ordinary, that their depth in boxes can be
    /// t, and these need not be widened for them; `None` for others. It is soon known: all
    /// queries wait for it.
    ///
    /// Distances to planes are below 2⁶⁶ and inverses at most 2⁶⁰, so depths are finite. Boxes that
    /// the ray begins in are left at t ≥ padded / longest ≥ 2⁻¹⁰⁰, which is above 0 in single
    /// precision.
    #[inline(always)]
    pub(crate) fn ordinary(ray: &Ray, scene: &Scene) -> Option<Self> {
        let [o, d] = origin_and_direction(ray);
        let size = d.abs();
        let is_near = (scene.center - o).abs().cmple(scene.room);
        (is_near & scene.is_ordinary(size)).all().then(|| {
            let scale = greatest(size.extend(0.0));
            Self::of(ray, d, scale, d / scale, 1.0, d.recip(), 0.0)
        })
    }

    /// The same for any ray, where there is something.
    #[inline(always)]
    pub(crate) fn in_scene(ray: &Ray, scene: &Scene) -> Option<Self> {
        let [o, d] = origin_and_direction(ray);
        let size = d.abs();
        let scale = greatest(size.extend(0.0));
        let slopes = d / scale;
        // Without direction, or with one that is not finite, some slope is not a number.
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

    /// With what is common to all rays.
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

    /// A depth in boxes that no hit with parameter up to `t` exceeds; above 0.
    #[inline]
    pub(crate) fn depth_limit(&self, t: f32) -> f32 {
        depth_limit(t, self.unit)
    }

    /// A depth in boxes that every hit after `t_min` exceeds, or is within the pad of; above 0.
    #[inline]
    pub(crate) fn depth_start(&self) -> f32 {
        depth_start(self.t_min, self.unit)
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

/// The numbers of a ray as vectors.
#[inline(always)]
fn origin_and_direction(ray: &Ray) -> [Vec3A; 2] {
    let numbers: [f32; 8] = bytemuck::cast(*ray);
    [&numbers[..4], &numbers[3..7]].map(|four| Vec3A::from_vec4(Vec4::from_slice(four)))
}

/// See [`Prepared::depth_limit`]; in units of `scale`. What is added to both matters only where
/// their digits end early.
#[inline(always)]
pub(crate) fn depth_limit(t: f32, scale: f32) -> f32 {
    ((t + MIN) * ((scale + MIN) * (1.0 + CONVERSION))).max(2.0 * f32::MIN_POSITIVE)
}

/// See [`Prepared::depth_start`]; in units of `scale`.
#[inline(always)]
pub(crate) fn depth_start(t_min: f32, scale: f32) -> f32 {
    (t_min * scale * (1.0 - CONVERSION)).max(f32::MIN_POSITIVE)
}

/// The least number above 0.
pub(crate) const MIN: f32 = f32::from_bits(1);

/// The greatest of four numbers that are not below 0, which compare as integers: that is known
/// sooner.
#[inline(always)]
fn greatest(x: Vec4) -> f32 {
    let x: u32x4 = bytemuck::cast(x);
    let x = x.max(x.shuffle(u32x4::new([2, 3, 0, 1])));
    let x = x.max(x.shuffle(u32x4::new([1, 0, 3, 2])));
    f32::from_bits(x.as_array()[0])
}

/// Of slopes that may be 0.
#[cold]
#[inline(never)]
fn inverse_of_slopes(slopes: Vec3A) -> Vec3A {
    slopes.abs().max(Vec3A::splat(MIN_SLOPE)).copysign(slopes).recip()
}

/// The axes in cyclic order, the last of them along the largest of three magnitudes, by which of
/// these are as large as that: y before x before z.
#[inline(always)]
fn axes_of(largest: BVec3A) -> [usize; 3] {
    const X: [usize; 3] = AXES[0];
    const Y: [usize; 3] = AXES[1];
    const Z: [usize; 3] = AXES[2];
    static AMONG: [[usize; 3]; 8] = [X, X, Y, Y, Z, X, Y, Y];
    AMONG[largest.bitmask() as usize % 8]
}
