//! Queries in the wide tree, with portable vectors of the `wide` crate.

use std::cell::Cell;

use pt_math::Bounds3;
use pt_math::interval::gamma;
use wide::f32x8;

use super::{BLOCK, Child, Lanes, SphereBlock, TriangleBlock, WIDTH, WideBvh, WideNode};
use crate::counter::Counter;
use crate::geometry::Hit;
use crate::node::MAX_DEPTH;
use crate::ray::Prepared;
use crate::traverse::Nearest;
use crate::{sphere, triangle};

/// Entries of the stack: each level leaves at most seven children behind. A large leaf of the
/// binary tree adds a few levels below its own.
const STACK_SIZE: usize = 512;
const _: () = assert!((WIDTH - 1) * (MAX_DEPTH + 6) < STACK_SIZE && STACK_SIZE.is_power_of_two());

thread_local! {
    /// The stack of the query that runs. Here because it need not be cleared for each ray, which
    /// would cost as much as several nodes.
    static STACK: [Cell<u64>; STACK_SIZE] = const { [const { Cell::new(0) }; STACK_SIZE] };
}

/// Children to visit, with the depths at which the ray enters their boxes. Entries compare as
/// integers in the order of depth, which is above 0.
struct Stack<'a> {
    entries: &'a [Cell<u64>; STACK_SIZE],
    len: usize,
}

#[inline]
fn entry(depth: f32, child: Child) -> u64 {
    u64::from(depth.to_bits()) << 32 | u64::from(child.0)
}

impl Stack<'_> {
    /// An index that is in range by the type of it.
    #[inline]
    fn slot(&self, i: usize) -> &Cell<u64> {
        &self.entries[i % STACK_SIZE]
    }

    #[inline]
    fn push(&mut self, entry: u64) {
        self.slot(self.len).set(entry);
        self.len += 1;
    }

    /// Puts the entry below the nearer ones among those from `base` on, which are sorted so that
    /// the nearest is on top.
    #[inline]
    fn insert(&mut self, entry: u64, base: usize) {
        let mut i = self.len;
        while i > base && self.slot(i - 1).get() < entry {
            self.slot(i).set(self.slot(i - 1).get());
            i -= 1;
        }
        self.slot(i).set(entry);
        self.len += 1;
    }

    /// The next child that is entered no later than `limit`.
    #[inline]
    fn pop(&mut self, limit: f32) -> Option<Child> {
        let last = entry(limit, Child(u32::MAX));
        while self.len > 0 {
            self.len -= 1;
            let top = self.slot(self.len).get();
            if top <= last {
                return Some(Child(top as u32));
            }
        }
        None
    }
}

/// The slabs of a ray for eight boxes:  τ = plane · inverse + offset.
pub(super) struct Slabs {
    pub(super) inverse: [f32x8; 3],
    pub(super) near: [f32x8; 3],
    pub(super) far: [f32x8; 3],
    /// Which of the two planes per axis the ray meets first.
    pub(super) first: [usize; 3],
    pub(super) start: f32x8,
}

impl Slabs {
    #[inline]
    fn new(ray: &Prepared, bvh: &WideBvh) -> Self {
        let origin = ray.origin - bvh.center;
        let pad = ray.inverse.abs() * ray.pad;
        let offset = -origin * ray.inverse;
        let splat = |v: pt_math::Vec3| v.to_array().map(f32x8::splat);
        Self {
            inverse: splat(ray.inverse),
            near: splat(offset - pad),
            far: splat(offset + pad),
            first: ray.inverse.to_array().map(|i| usize::from(i < 0.0)),
            start: f32x8::splat(ray.depth_start()),
        }
    }

    /// Where the ray enters each child's box, and a mask of the children that it enters before
    /// `limit`.
    #[inline(always)]
    pub(super) fn test(&self, node: &WideNode, limit: f32x8) -> (f32x8, f32x8) {
        let plane = |axis: usize, side: usize| node.planes[axis][side & 1];
        let [near_x, near_y, near_z] =
            [0, 1, 2].map(|k| plane(k, self.first[k]).mul_add(self.inverse[k], self.near[k]));
        let [far_x, far_y, far_z] =
            [0, 1, 2].map(|k| plane(k, 1 ^ self.first[k]).mul_add(self.inverse[k], self.far[k]));
        let near = near_x.fast_max(near_y).fast_max(near_z.fast_max(self.start));
        let far = far_x.fast_min(far_y).fast_min(far_z.fast_min(limit));
        (near, near.simd_le(far))
    }
}

/// The ray as the triangle filter wants it; or a ray for each lane, if their axes are the same.
pub(super) struct Shear {
    pub(super) axes: [usize; 3],
    pub(super) origin: [Lanes; 3],
    pub(super) slopes: [Lanes; 2],
    pub(super) sign: Lanes,
    pub(super) start: Lanes,
}

impl Shear {
    #[inline]
    fn new(ray: &Prepared) -> Self {
        let o = ray.origin.to_array();
        Self {
            axes: ray.axes,
            origin: ray.axes.map(|k| Lanes::splat(o[k])),
            slopes: ray.shear.map(Lanes::splat),
            sign: Lanes::splat(ray.sign),
            start: Lanes::splat(ray.depth_start()),
        }
    }

    /// A bit for each triangle of a block that the ray may hit; see [`Self::filter`].
    #[inline(always)]
    pub(super) fn filter_block(&self, block: &TriangleBlock, limit: f32) -> (u32, Sheared) {
        self.filter(|v, k| block.vertices[v][k], Lanes::splat(limit))
    }

    /// A bit for each lane in which the f32 edge functions do not rule out a hit of the triangle
    /// whose vertex `v` has coordinate `k` of `vertices(v, k)`, and its vertices are not all before
    /// the start of the ray or all beyond the depth `limit`: the depth of a hit is a mean of
    /// theirs. The operations are those of [`triangle::intersect`].
    #[inline(always)]
    pub(super) fn filter(
        &self,
        vertices: impl Fn(usize, usize) -> Lanes,
        limit: Lanes,
    ) -> (u32, Sheared) {
        let [kx, ky, kz] = self.axes;
        let sheared = Sheared([0, 1, 2].map(|v: usize| {
            let z = vertices(v, kz) - self.origin[2];
            let x = vertices(v, kx) - self.origin[0] - self.slopes[0] * z;
            let y = vertices(v, ky) - self.origin[1] - self.slopes[1] * z;
            [x, y, z * self.sign]
        }));
        let [u, v, w] = sheared.edges();
        let crossed = u.fast_min(v).fast_min(w).simd_ge(Lanes::ZERO)
            | u.fast_max(v).fast_max(w).simd_le(Lanes::ZERO);
        let (nearest, farthest) = sheared.depths();
        let within = nearest.simd_le(limit) & farthest.simd_ge(self.start);
        ((crossed & within).to_bitmask(), sheared)
    }
}

/// Sheared vertices of eight triangles: vertex, axis.
pub(super) struct Sheared(pub(super) [[Lanes; 3]; 3]);

/// What single precision says of eight pairs of a ray and a triangle that passed the filter.
pub(super) struct Tested {
    /// Where there is a hit.
    pub(super) hit: Lanes,
    /// Where double precision must decide.
    pub(super) unclear: Lanes,
    pub(super) t: Lanes,
    pub(super) barycentric: [Lanes; 2],
}

impl Sheared {
    /// The vertices in a lane, as [`triangle::confirm`] wants them.
    pub(super) fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        self.0.map(|vertex| vertex.map(|x| x.as_array()[lane % BLOCK]))
    }

    #[inline(always)]
    fn edges(&self) -> [Lanes; 3] {
        let [a, b, c] = self.0;
        let edge = |p: [Lanes; 3], q: [Lanes; 3]| q[0] * p[1] - q[1] * p[0];
        [edge(b, c), edge(c, a), edge(a, b)]
    }

    /// The least and the greatest depth of a vertex.
    #[inline(always)]
    fn depths(&self) -> (Lanes, Lanes) {
        let [a, b, c] = self.0.map(|vertex| vertex[2]);
        (a.fast_min(b).fast_min(c), a.fast_max(b).fast_max(c))
    }

    /// The hits in a set of lanes. The operations are those of [`triangle::intersect`].
    #[inline(always)]
    pub(super) fn test(&self, inverse_scale: Lanes, origin_size: Lanes, set: u32) -> Tested {
        let splat = Lanes::splat;
        let [a, b, c] = self.0;
        let [u, v, w] = self.edges();
        let largest = |k: usize| a[k].abs().fast_max(b[k].abs()).fast_max(c[k].abs());
        let [x, y, z] = [largest(0), largest(1), largest(2)];
        let det = u + v + w;
        let inverse = splat(1.0) / det;
        let total = u * a[2] + v * b[2] + w * c[2];
        let depth = total * inverse;
        let t = depth * inverse_scale;
        let on_edge = u.simd_eq(Lanes::ZERO) | v.simd_eq(Lanes::ZERO) | w.simd_eq(Lanes::ZERO);
        let least = x * y * splat(1.0 / triangle::FLATTEST) + splat(triangle::LEAST_DET);
        let plain = !on_edge & least.simd_le(det.abs()) & t.abs().simd_lt(splat(f32::INFINITY));

        let (nearest, _) = self.depths();
        let mut ahead = nearest.simd_gt((origin_size + x + y + z * 2.0) * gamma(32));
        let mut behind = Lanes::ZERO;
        if !ahead.to_bitmask() & set != 0 {
            let e = u.abs().fast_max(v.abs()).fast_max(w.abs());
            let error = plain_depth_error([x, y, z], e, inverse);
            ahead |= depth.simd_gt(error);
            behind = depth.simd_lt(-error);
        }
        let large = total.abs().simd_ge(splat(triangle::LEAST_DET));
        let hit = plain & ahead & large;
        let unclear = !(hit | (plain & behind));
        Tested { hit, unclear, t, barycentric: [v * inverse, w * inverse] }
    }
}

impl Tested {
    /// The hit of one lane.
    #[inline(always)]
    fn in_lane(&self, lane: usize, ids: &[u32; BLOCK]) -> Hit {
        let number = |x: &Lanes| x.as_array()[lane % BLOCK];
        let [b1, b2] = self.barycentric.each_ref().map(number);
        Hit { t: number(&self.t), b1, b2, primitive: ids[lane % BLOCK] }
    }

    /// A bit for the nearest hit with t in (`t_min`, `t_max`] in a set of lanes, and of several for
    /// the first.
    #[inline(always)]
    fn nearest(&self, set: u32, t_min: f32, t_max: f32) -> u32 {
        let counts = self.t.simd_gt(Lanes::splat(t_min)) & self.t.simd_le(Lanes::splat(t_max));
        let hit = (self.hit & counts).to_bitmask() & set;
        if hit & hit.wrapping_sub(1) == 0 {
            return hit;
        }
        let t = self.t.as_array();
        let before = |a: &usize, b: &usize| t[*a].total_cmp(&t[*b]);
        lanes(hit).min_by(before).map_or(0, |lane| 1 << lane)
    }
}

/// The operations of the function of this name in [`triangle`].
#[inline(always)]
fn plain_depth_error([x, y, z]: [Lanes; 3], e: Lanes, inverse: Lanes) -> Lanes {
    let (dx, dy) = ((x + z) * gamma(5), (y + z) * gamma(5));
    let de = (dx * y + dy * x + x * y * gamma(2)) * 2.0;
    (e * z * gamma(3) + de * z + z * gamma(5) * e) * 3.0 * inverse.abs()
}

/// The lanes of the bits, lowest first.
#[inline]
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        (bits != 0).then(|| {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            lane
        })
    })
}

/// A query on its way.
struct Query<'a, C> {
    ray: Prepared,
    shear: Shear,
    nearest: Nearest,
    counter: &'a mut C,
}

impl<C: Counter> Query<'_, C> {
    /// Whether a triangle of the block is hit, and better than what there was.
    #[inline]
    fn test_triangles(&mut self, block: &TriangleBlock, limit: f32) -> bool {
        self.counter.add(|| block.len());
        let (set, sheared) = self.shear.filter_block(block, limit);
        if set == 0 {
            return false;
        }
        let Prepared { inverse_scale, origin_size, t_min, .. } = self.ray;
        let tested = sheared.test(Lanes::splat(inverse_scale), Lanes::splat(origin_size), set);
        let mut better = false;
        for lane in lanes(tested.nearest(set, t_min, self.nearest.t())) {
            better |= self.nearest.offer(tested.in_lane(lane, &block.ids));
        }
        let unclear = tested.unclear.to_bitmask() & set;
        if unclear != 0 {
            better |= self.confirm(block, unclear);
        }
        better
    }

    /// Double precision decides about some triangles of a block. They are sheared again: to keep
    /// them for the few times that they are asked for costs more.
    #[cold]
    #[inline(never)]
    fn confirm(&mut self, block: &TriangleBlock, set: u32) -> bool {
        let mut better = false;
        for lane in lanes(set) {
            if let Some(h) = triangle::intersect(&self.ray, block.triangle(lane)) {
                let id = block.ids[lane % BLOCK];
                better |= self.nearest.offer(Hit { t: h.t, b1: h.b1, b2: h.b2, primitive: id });
            }
        }
        better
    }

    /// The same for spheres.
    #[inline(never)]
    fn test_spheres(&mut self, block: &SphereBlock) -> bool {
        self.counter.add(|| block.len());
        let mut better = false;
        for (s, &primitive) in block.iter() {
            if let Some(t) =
                sphere::intersect(self.ray.origin, self.ray.direction, self.ray.t_min, s)
            {
                better |= self.nearest.offer(Hit { t, b1: 0.0, b2: 0.0, primitive });
            }
        }
        better
    }
}

impl WideBvh {
    /// The nearest hit. `bounds` is the box of the scene.
    #[inline]
    pub(crate) fn intersect<C: Counter>(
        &self,
        ray: &pt_math::Ray,
        bounds: &Bounds3,
        counter: &mut C,
    ) -> Option<Hit> {
        self.walk::<false, C>(ray, bounds, counter)
    }

    /// Whether there is a hit.
    #[inline]
    pub(crate) fn occluded<C: Counter>(
        &self,
        ray: &pt_math::Ray,
        bounds: &Bounds3,
        counter: &mut C,
    ) -> bool {
        self.walk::<true, C>(ray, bounds, counter).is_some()
    }

    /// Visits nodes from near to far; with `ANY`, until the first hit.
    fn walk<const ANY: bool, C: Counter>(
        &self,
        ray: &pt_math::Ray,
        bounds: &Bounds3,
        counter: &mut C,
    ) -> Option<Hit> {
        let ray = Prepared::new(ray, bounds)?;
        let slabs = Slabs::new(&ray, self);
        let mut query =
            Query { ray, shear: Shear::new(&ray), nearest: Nearest::new(&ray), counter };
        let mut limit = ray.depth_limit(ray.t_max);
        STACK.with(|entries| {
            let mut stack = Stack { entries, len: 0 };
            let mut child = Child::node(0);
            loop {
                if child.0 < Child::SPHERES {
                    let node = &self.nodes[child.0 as usize];
                    let (near, hit) = slabs.test(node, f32x8::splat(limit));
                    let hits = hit.to_bitmask();
                    if let Some(next) = descend::<ANY>(&mut stack, node, near, hits) {
                        child = next;
                        continue;
                    }
                } else {
                    let better = if child.0 & Child::TRIANGLES != 0 {
                        query.test_triangles(&self.triangles[Child::index(child.0)], limit)
                    } else {
                        query.test_spheres(&self.spheres[Child::index(child.0)])
                    };
                    if better {
                        if ANY {
                            break;
                        }
                        limit = ray.depth_limit(query.nearest.t());
                    }
                }
                let Some(next) = stack.pop(limit) else { break };
                child = next;
            }
        });
        query.nearest.get()
    }
}

/// Puts all children that are hit on the stack but the nearest, which it returns; with `ANY`, but the
/// last, which is the largest.
#[inline]
fn descend<const ANY: bool>(
    stack: &mut Stack<'_>,
    node: &WideNode,
    near: f32x8,
    mut hits: u32,
) -> Option<Child> {
    if hits == 0 {
        return None;
    }
    let depths = near.as_array();
    if ANY {
        let last = hits.ilog2() as usize % WIDTH;
        lanes(hits ^ 1 << last)
            .for_each(|lane| stack.push(entry(depths[lane], node.children[lane])));
        return Some(node.children[last]);
    }
    let mut next = || {
        let lane = hits.trailing_zeros() as usize % WIDTH;
        hits &= hits - 1;
        (entry(depths[lane], node.children[lane]), hits != 0)
    };
    let (first, more) = next();
    if !more {
        return Some(Child(first as u32));
    }
    let (second, mut more) = next();
    let (nearer, farther) = if first < second { (first, second) } else { (second, first) };
    if !more {
        stack.push(farther);
        return Some(Child(nearer as u32));
    }
    let base = stack.len;
    stack.push(farther);
    stack.push(nearer);
    while more {
        let (e, m) = next();
        more = m;
        stack.insert(e, base);
    }
    stack.len -= 1;
    Some(Child(stack.slot(stack.len).get() as u32))
}
