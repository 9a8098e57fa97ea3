//! A group of rays in columns, prepared eight at a time.

use pt_math::{Ray, Ray8, Rays, Vec3};
use wide::{f32x8, u32x8};

use super::lane_permute::LANES;
use crate::geometry::{Hit, LARGEST_COORDINATE};
use crate::ray::{AXES, CONVERSION, MIN_SLOPE, PAD, SceneExtent};
use crate::wide::traverse::RaySlabs;
use crate::wide::triangles::{Shear, ShearedTriangles};
use crate::wide::{NO_PRIMITIVE, WIDTH};
use crate::{ray, triangle};

/// Number of rays that advance together: enough for their steps to overlap, few enough for the
/// columns and the tops of the stacks to stay in the first-level cache.
pub(super) const GROUP: usize = 256;

/// One value for each ray of a group.
pub(super) type GroupColumn<T = f32> = [T; GROUP];

/// Structure of arrays for the rays of a group: the fields of
/// [`PreparedRay`](crate::ray::PreparedRay), the traversal state, and the nearest hit.
#[derive(Clone, Copy, bytemuck::Zeroable)]
#[repr(align(64))]
pub(super) struct RayGroup {
    pub(super) inverse: [GroupColumn; 3],
    /// Offsets of the slabs, for the near planes and the far ones.
    pub(super) near: [GroupColumn; 3],
    pub(super) far: [GroupColumn; 3],
    /// Depths between which hits count.
    pub(super) start: GroupColumn,
    pub(super) limit: GroupColumn,
    /// Bit mask of the axes along which the direction is negative.
    pub(super) octant: GroupColumn<u32>,
    /// Axis along which the direction is largest.
    pub(super) axis: GroupColumn<u32>,
    /// Origin in the cyclic order of axes that ends with that axis.
    pub(super) origin: [GroupColumn; 3],
    pub(super) slopes: [GroupColumn; 2],
    /// −1 if the ray rises along the last axis, else 1.
    pub(super) back: GroupColumn,
    pub(super) scale: GroupColumn,
    pub(super) inverse_scale: GroupColumn,
    pub(super) origin_size: GroupColumn,
    pub(super) t_min: GroupColumn,
    /// Nearest hit: initially t is `t_max`, and the primitive [`NO_PRIMITIVE`].
    pub(super) t: GroupColumn,
    pub(super) barycentric: [GroupColumn; 2],
    pub(super) primitive: GroupColumn<u32>,
    /// Node that the ray visits next.
    pub(super) child: GroupColumn<u32>,
    /// First free entry above the stack of the ray.
    pub(super) top: GroupColumn<u32>,
}

/// Result of [`RayGroup::take`] for eight rays.
pub(super) struct GroupIntake {
    /// Bit mask of the rays that can hit anything.
    pub(super) usable: u32,
    /// True if the slabs of the rays are set. Rays that may be coherent get them later, in
    /// [`RayGroup::take_slabs`], since packets do not need them.
    pub(super) has_slabs: bool,
}

/// Axes along which eight directions are largest; z takes precedence over y.
#[derive(Clone, Copy)]
struct Axes {
    is_y: f32x8,
    is_z: f32x8,
}

impl Axes {
    /// If all rays have the same dominant axis, returns two flags: the axis is y, the axis is z.
    #[inline(always)]
    fn common(self) -> Option<[bool; 2]> {
        let [y, z] = [self.is_y, self.is_z].map(f32x8::to_bitmask);
        match [y & !z, z] {
            [0, 0] => Some([false, false]),
            [0xff, 0] => Some([true, false]),
            [0, 0xff] => Some([false, true]),
            _ => None,
        }
    }

    #[inline(always)]
    fn select(self, x: f32x8, y: f32x8, z: f32x8) -> f32x8 {
        self.is_z.select(z, self.is_y.select(y, x))
    }

    /// Reorders components x, y, z to the cyclic order that ends with the axis.
    #[inline(always)]
    fn in_order(self, [x, y, z]: [f32x8; 3]) -> [f32x8; 3] {
        match self.common() {
            Some([false, false]) => [y, z, x],
            Some([true, _]) => [z, x, y],
            Some([_, true]) => [x, y, z],
            None => [self.select(y, z, x), self.select(z, x, y), self.select(x, y, z)],
        }
    }

    /// Inverse of [`Self::in_order`].
    #[inline(always)]
    fn out_of_order(self, [a, b, c]: [f32x8; 3]) -> [f32x8; 3] {
        [self.select(c, b, a), self.select(a, c, b), self.select(b, a, c)]
    }
}

/// Transposes up to eight rays to columns.
#[inline(always)]
fn of_rows(rays: &[Ray]) -> [f32x8; 8] {
    let mut rows = [f32x8::ZERO; WIDTH];
    for (row, ray) in rows.iter_mut().zip(rays) {
        *row = f32x8::new(bytemuck::cast(*ray));
    }
    f32x8::transpose(rows)
}

/// Columns of eight rays.
#[inline(always)]
fn of_columns(rays: &Ray8) -> [f32x8; 8] {
    let ([ox, oy, oz], [dx, dy, dz]) = (rays.origin, rays.direction);
    [ox, oy, oz, dx, dy, dz, rays.t_min, rays.t_max].map(f32x8::new)
}

/// Loads eight numbers of a column.
#[inline(always)]
pub(super) fn eight(column: &GroupColumn, first: usize) -> f32x8 {
    let mut numbers = [0.0; WIDTH];
    numbers.copy_from_slice(&column[first..first + WIDTH]);
    f32x8::new(numbers)
}

/// Loads eight integers of a column.
#[inline(always)]
pub(super) fn of_eight(column: &GroupColumn<u32>, first: usize) -> u32x8 {
    let mut numbers = [0; WIDTH];
    numbers.copy_from_slice(&column[first..first + WIDTH]);
    u32x8::new(numbers)
}

#[inline(always)]
fn copysign(x: f32x8, sign: f32x8) -> f32x8 {
    f32x8::splat(-0.0).bitselect(sign, x)
}

/// Bits of eight numbers.
#[inline(always)]
pub(super) fn bits(x: f32x8) -> u32x8 {
    bytemuck::cast(x)
}

/// Eight numbers from their bits.
#[inline(always)]
pub(super) fn from_bits(x: u32x8) -> f32x8 {
    bytemuck::cast(x)
}

/// [`ray::depth_limit`] of eight numbers.
#[inline(always)]
pub(super) fn depth_limit(t: f32x8, scale: f32x8) -> f32x8 {
    let scale = (scale + ray::MIN) * (1.0 + CONVERSION);
    ((t + ray::MIN) * scale).max(f32x8::splat(2.0 * f32::MIN_POSITIVE))
}

impl RayGroup {
    /// Loads up to eight of `rays`, from number `from` on, into positions `first` and following,
    /// and sets the root as their next node. The operations are those of
    /// [`PreparedRay::new`](crate::ray::PreparedRay::new), and give the same bits.
    #[inline]
    pub(super) fn take(
        &mut self,
        first: usize,
        rays: Rays<'_>,
        from: usize,
        scene: &SceneExtent,
    ) -> GroupIntake {
        let splat = f32x8::splat;
        let [ox, oy, oz, dx, dy, dz, t_min, t_max] = match rays {
            Rays::Rows(rays) => of_rows(&rays[from..]),
            Rays::Columns(eights, _) => of_columns(&eights[from / WIDTH]),
        };
        let (o, d) = ([ox, oy, oz], [dx, dy, dz]);
        let [ax, ay, az] = d.map(f32x8::abs);
        let axes = Axes { is_y: ay.simd_ge(ax), is_z: az.simd_gt(ax.fast_max(ay)) };
        let [da, db, along] = axes.in_order(d);
        let scale = along.abs();
        let origin_size = o[0].abs().fast_max(o[1].abs()).fast_max(o[2].abs());
        let in_range = o.map(|x| x.abs().simd_le(splat(LARGEST_COORDINATE)));
        let finite = [ax, ay, az].map(|x| x.simd_lt(splat(f32::INFINITY)));
        let usable = in_range[0] & in_range[1] & in_range[2] & finite[0] & finite[1] & finite[2];

        let sign = copysign(splat(1.0), along);
        let slopes = [da, db].map(|x| x / scale);
        let falls = [0, 1, 2].map(|k: usize| (bits(d[k]) >> 31) << k as u32);
        let octant = falls[0] | falls[1] | falls[2];
        set_bits(&mut self.octant, first, octant);
        let axis = bits(axes.is_z).select(bit(1), bits(axes.is_y) & bit(0));
        set_bits(&mut self.axis, first, axis);
        let alike = [octant, axis].map(|x| x.simd_eq(u32x8::splat(x.as_array()[0])));
        let has_slabs = !(alike[0] & alike[1]).all();
        if has_slabs {
            let slope = axes.out_of_order([slopes[0], slopes[1], sign]);
            self.set_slabs(first, o, slope, scene);
        }

        let t_min = t_min.max(f32x8::ZERO);
        let start = t_min * scale * (1.0 - CONVERSION);
        set_column(&mut self.start, first, start.fast_max(splat(f32::MIN_POSITIVE)));
        set_column(&mut self.limit, first, depth_limit(t_max, scale));
        for (column, x) in self.origin.iter_mut().zip(axes.in_order(o)) {
            set_column(column, first, x);
        }
        for (column, x) in self.slopes.iter_mut().zip(slopes) {
            set_column(column, first, x * sign);
        }
        set_column(&mut self.back, first, -sign);
        set_column(&mut self.scale, first, scale);
        set_column(&mut self.inverse_scale, first, splat(1.0) / scale);
        set_column(&mut self.origin_size, first, origin_size);
        set_column(&mut self.t_min, first, t_min);
        set_column(&mut self.t, first, t_max);
        set_bits(&mut self.primitive, first, u32x8::splat(NO_PRIMITIVE));
        set_bits(&mut self.child, first, u32x8::ZERO);
        let there = (1 << WIDTH.min(rays.len() - from)) - 1;
        let usable = (usable & scale.simd_gt(f32x8::ZERO)).to_bitmask() & there;
        GroupIntake { usable, has_slabs }
    }

    /// Computes the slabs of the eight rays from `first` on, which [`Self::take`] has loaded.
    #[inline]
    pub(super) fn take_slabs(&mut self, first: usize, scene: &SceneExtent) {
        let axis = of_eight(&self.axis, first);
        let [is_y, is_z] = [0, 1].map(|k| from_bits(axis.simd_eq(bit(k))));
        let axes = Axes { is_y, is_z };
        let origin = axes.out_of_order(self.origin.each_ref().map(|column| eight(column, first)));
        let sign = -eight(&self.back, first);
        let [a, b] = self.slopes.each_ref().map(|column| eight(column, first) * sign);
        self.set_slabs(first, origin, axes.out_of_order([a, b, sign]), scene);
    }

    /// Computes the fields of `RaySlabs::new`, except for rounding.
    #[inline(always)]
    fn set_slabs(
        &mut self,
        first: usize,
        origin: [f32x8; 3],
        slope: [f32x8; 3],
        scene: &SceneExtent,
    ) {
        let splat = f32x8::splat;
        let steep = slope.map(|x| copysign(x.abs().fast_max(splat(MIN_SLOPE)), x));
        let inverse = steep.map(|x| splat(1.0) / x);
        let to_center = [0, 1, 2].map(|k: usize| splat(scene.center[k]) - origin[k]);
        let reach = [0, 1, 2].map(|k: usize| to_center[k].abs() + scene.half[k]);
        let reach = reach[0].fast_max(reach[1]).fast_max(reach[2]);
        let pad = (splat(PAD) * reach - scene.padded).fast_max(f32x8::ZERO);
        for k in 0..3 {
            let pad = inverse[k].abs() * pad;
            let offset = to_center[k] * inverse[k];
            set_column(&mut self.inverse[k], first, inverse[k]);
            set_column(&mut self.near[k], first, offset - pad);
            set_column(&mut self.far[k], first, offset + pad);
        }
    }

    /// Sets the tops of the stacks of the eight rays from `first` on to just above their sentinels.
    #[inline]
    pub(super) fn reset_stacks(&mut self, first: usize, stack_size: usize) {
        let numbers = LANES + u32x8::splat(first as u32);
        let top = numbers * u32x8::splat(stack_size as u32) + u32x8::splat(1);
        set_bits(&mut self.top, first, top);
    }

    /// Slabs of a ray, for the box test.
    #[inline(always)]
    pub(super) fn slabs(&self, i: usize) -> RaySlabs {
        let splat = |column: &GroupColumn| f32x8::splat(column[i]);
        let octant = self.octant[i] as usize;
        RaySlabs {
            inverse: self.inverse.each_ref().map(splat),
            near: self.near.each_ref().map(splat),
            far: self.far.each_ref().map(splat),
            first: [0, 1, 2].map(|k| octant << (3 - k) & WIDTH),
            start: splat(&self.start),
        }
    }

    /// Shear of a ray, for the triangle filter.
    #[inline(always)]
    pub(super) fn shear(&self, i: usize) -> Shear {
        self.shear_of(i, |column| f32x8::splat(column[i]))
    }

    /// Shears of eight rays that have the axis of the first, for the triangle filter.
    #[inline(always)]
    pub(super) fn shear_of_eight(&self, first: usize) -> Shear {
        self.shear_of(first, |column| eight(column, first))
    }

    #[inline(always)]
    fn shear_of(&self, first: usize, lanes: impl Fn(&GroupColumn) -> f32x8) -> Shear {
        Shear {
            axes: AXES[self.axis[first] as usize % AXES.len()],
            origin: self.origin.each_ref().map(&lanes),
            slopes: self.slopes.each_ref().map(&lanes),
            back: lanes(&self.back),
            start: lanes(&self.start),
        }
    }

    /// Tests the eight rays from `first` on against triangles that passed their filters, in a set
    /// of lanes; returns the lanes in which double precision must decide.
    #[inline(always)]
    pub(super) fn test<const ANY: bool>(
        &mut self,
        first: usize,
        set: u32,
        sheared: &ShearedTriangles,
        id: u32,
    ) -> u32 {
        let tested =
            sheared.test(eight(&self.inverse_scale, first), eight(&self.origin_size, first));
        let (old_t, old) = (eight(&self.t, first), of_eight(&self.primitive, first));
        let new = u32x8::splat(id);
        let lower = from_bits(new.simd_lt(old) & !old.simd_eq(u32x8::splat(NO_PRIMITIVE)));
        let nearer = tested.t.simd_lt(old_t) | (tested.t.simd_eq(old_t) & lower);
        let better = tested.hit
            & from_bits(lanes_of(set))
            & nearer
            & tested.t.simd_gt(eight(&self.t_min, first));
        set_bits(&mut self.primitive, first, bits(better).select(new, old));
        if ANY {
            return tested.unclear.to_bitmask() & set;
        }
        let limit = depth_limit(tested.t, eight(&self.scale, first));
        let [b1, b2] = tested.barycentric;
        let [old_b1, old_b2] = &mut self.barycentric;
        for (column, x) in
            [(&mut self.t, tested.t), (old_b1, b1), (old_b2, b2), (&mut self.limit, limit)]
        {
            set_column(column, first, better.select(x, eight(column, first)));
        }
        tested.unclear.to_bitmask() & set
    }

    /// Decides about a triangle in double precision.
    pub(super) fn confirm(
        &mut self,
        i: usize,
        ray: &Ray,
        sheared: [[f32; 3]; 3],
        vertices: [Vec3; 3],
        primitive: u32,
    ) {
        let scale = self.scale[i];
        let (origin, direction) = (ray.origin, ray.direction);
        if let Some(h) = triangle::confirm([origin, direction], scale, sheared, vertices) {
            let hit = Hit { t: h.t, b1: h.b1, b2: h.b2, primitive };
            self.offer(i, hit, ray::depth_limit(h.t, scale), true);
        }
    }

    /// Offers the hit of a sphere to a ray.
    pub(super) fn offer_sphere(&mut self, i: usize, t: f32, primitive: u32) {
        let limit = ray::depth_limit(t, self.scale[i]);
        self.offer(i, Hit { t, b1: 0.0, b2: 0.0, primitive }, limit, true);
    }

    /// [`NearestHit::offer`](crate::traverse::NearestHit::offer) together with the depth limit of
    /// the hit, if `counts`; without branches.
    #[expect(clippy::needless_bitwise_bool, reason = "lazy operators would branch")]
    #[inline(always)]
    pub(super) fn offer(&mut self, i: usize, hit: Hit, limit: f32, counts: bool) {
        let Hit { t, b1, b2, primitive } = hit;
        let (old_t, old) = (self.t[i], self.primitive[i]);
        let before = (old != NO_PRIMITIVE) & (t == old_t) & (primitive < old);
        let better = counts & (t > self.t_min[i]) & ((t < old_t) | before);
        let choose = |new: f32, old: &mut f32| *old = if better { new } else { *old };
        choose(t, &mut self.t[i]);
        choose(b1, &mut self.barycentric[0][i]);
        choose(b2, &mut self.barycentric[1][i]);
        choose(limit, &mut self.limit[i]);
        self.primitive[i] = if better { primitive } else { old };
    }

    /// Returns true if the ray has hit anything.
    #[inline(always)]
    pub(super) fn has_hit(&self, i: usize) -> bool {
        self.primitive[i] != NO_PRIMITIVE
    }

    /// Returns true if all of the eight rays from `first` on have hit something.
    #[inline(always)]
    pub(super) fn all_hit(&self, first: usize) -> bool {
        of_eight(&self.primitive, first).simd_eq(u32x8::splat(NO_PRIMITIVE)) == u32x8::ZERO
    }

    /// Returns true if any of the eight rays from `first` on has hit anything.
    #[inline(always)]
    pub(super) fn have_hits(&self, first: usize) -> bool {
        let none = of_eight(&self.primitive, first).simd_eq(u32x8::splat(NO_PRIMITIVE));
        !none.all()
    }

    /// Nearest hit of the ray.
    #[inline(always)]
    pub(super) fn hit(&self, i: usize) -> Option<Hit> {
        let [b1, b2] = self.barycentric.each_ref().map(|column| column[i]);
        let hit = Hit { t: self.t[i], b1, b2, primitive: self.primitive[i] };
        self.has_hit(i).then_some(hit)
    }
}

/// Lane mask of a set of lanes.
#[inline(always)]
fn lanes_of(set: u32) -> u32x8 {
    let own = u32x8::new([1, 2, 4, 8, 16, 32, 64, 128]);
    (u32x8::splat(set) & own).simd_eq(own)
}

#[inline(always)]
fn bit(k: usize) -> u32x8 {
    u32x8::splat(1 << k)
}

#[inline(always)]
fn set_column(column: &mut GroupColumn, first: usize, x: f32x8) {
    column[first..first + WIDTH].copy_from_slice(x.as_array());
}

#[inline(always)]
fn set_bits(column: &mut GroupColumn<u32>, first: usize, x: u32x8) {
    column[first..first + WIDTH].copy_from_slice(x.as_array());
}
