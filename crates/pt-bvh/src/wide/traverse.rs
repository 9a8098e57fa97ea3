//! Queries in the wide tree, with portable vectors of the `wide` crate.

use std::cell::Cell;

use pt_math::Bounds3;
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

/// The vertices of a block as [`triangle::confirm`] wants them: vertex, axis.
pub(super) struct Sheared(pub(super) [[Lanes; 3]; 3]);

impl Sheared {
    #[inline]
    fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        let number = |v: usize, k: usize| self.0[v][k].as_array()[lane % BLOCK];
        [0, 1, 2].map(|v| [number(v, 0), number(v, 1), number(v, 2)])
    }
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

    /// A bit for each triangle of a block that the ray may hit; see [`Self::test`].
    #[inline(always)]
    pub(super) fn filter(&self, block: &TriangleBlock, limit: f32) -> (u32, Sheared) {
        self.test(|v, k| block.vertices[v][k], Lanes::splat(limit))
    }

    /// A bit for each lane in which the f32 edge functions do not rule out a hit of the triangle
    /// whose vertex `v` has coordinate `k` of `vertices(v, k)`, and its vertices are not all before
    /// the start of the ray or all beyond the depth `limit`: the depth of a hit is a mean of
    /// theirs. The operations are those of [`triangle::intersect`].
    #[inline(always)]
    pub(super) fn test(
        &self,
        vertices: impl Fn(usize, usize) -> Lanes,
        limit: Lanes,
    ) -> (u32, Sheared) {
        let [kx, ky, kz] = self.axes;
        let [a, b, c] = [0, 1, 2].map(|v: usize| {
            let z = vertices(v, kz) - self.origin[2];
            let x = vertices(v, kx) - self.origin[0] - self.slopes[0] * z;
            let y = vertices(v, ky) - self.origin[1] - self.slopes[1] * z;
            [x, y, z * self.sign]
        });
        let edge = |p: [Lanes; 3], q: [Lanes; 3]| q[0] * p[1] - q[1] * p[0];
        let [u, v, w] = [edge(b, c), edge(c, a), edge(a, b)];
        let least = u.fast_min(v).fast_min(w);
        let greatest = u.fast_max(v).fast_max(w);
        let nearest = a[2].fast_min(b[2]).fast_min(c[2]);
        let farthest = a[2].fast_max(b[2]).fast_max(c[2]);
        let crossed = least.simd_ge(Lanes::ZERO) | greatest.simd_le(Lanes::ZERO);
        let within = nearest.simd_le(limit) & farthest.simd_ge(self.start);
        ((crossed & within).to_bitmask(), Sheared([a, b, c]))
    }
}

/// The lanes of the bits, lowest first.
#[inline]
fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
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
        let mut better = false;
        let (candidates, sheared) = self.shear.filter(block, limit);
        for lane in lanes(candidates) {
            if let Some(h) = triangle::confirm(&self.ray, sheared.triangle(lane)) {
                let id = block.ids[lane % BLOCK];
                let hit = Hit { t: h.t, b1: h.b1, b2: h.b2, primitive: id };
                better |= self.nearest.offer(hit);
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
                        let index = child.0 & !Child::TRIANGLES;
                        query.test_triangles(&self.triangles[index as usize], limit)
                    } else {
                        let index = child.0 & !Child::SPHERES;
                        query.test_spheres(&self.spheres[index as usize])
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

/// Puts all children that are hit on the stack but the nearest, which it returns.
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
        if ANY { stack.push(e) } else { stack.insert(e, base) }
    }
    stack.len -= 1;
    Some(Child(stack.slot(stack.len).get() as u32))
}
