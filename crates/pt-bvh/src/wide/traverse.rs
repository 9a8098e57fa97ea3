//! Queries in the wide tree, with portable vectors of the `wide` crate.

use std::cell::Cell;
use std::hint::black_box;

use pt_math::{Ray, Vec3A};
use wide::{f32x8, u32x8};

use super::batch::lane_permute::members;
use super::depths::{after, earlier, later};
use super::triangles::{BlockTest, Shear};
use super::{
    BLOCK, BlockLanes, ChildRef, SizeClass, SphereBlock, TriangleBlock, WIDTH, WideBvh, WideNode,
};
use crate::counter::Counter;
use crate::geometry::Hit;
use crate::node::MAX_DEPTH;
use crate::ray::{PreparedRay, SceneExtent};
use crate::traverse::NearestHit;
use crate::wide::lanes;
use crate::{ray, sphere, triangle};

/// Entries of the stack: each level leaves at most seven deferred children. A large leaf of the
/// binary tree adds a few levels below its own.
const STACK_SIZE: usize = 512;
const _: () =
    assert!((WIDTH - 1) * (MAX_DEPTH + 6) + WIDTH < STACK_SIZE && STACK_SIZE.is_power_of_two());

thread_local! {
    /// Stack of the current query. Thread-local, because it need not be cleared for each ray, which
    /// would cost as much as several nodes.
    static STACK: [Cell<u64>; STACK_SIZE] = const { [const { Cell::new(0) }; STACK_SIZE] };
    /// Stack of any-hit queries, without depths.
    static CHILDREN: [Cell<u32>; STACK_SIZE] = const { [const { Cell::new(0) }; STACK_SIZE] };
}

/// Children to visit, with the depths at which the ray enters their boxes. Entries compare as
/// integers in the order of depth, which is positive.
struct WideStack<'a> {
    entries: &'a [Cell<u64>; STACK_SIZE],
    len: usize,
}

#[inline]
fn entry(depth: f32, child: ChildRef) -> u64 {
    u64::from(depth.to_bits()) << 32 | u64::from(child.0)
}

impl WideStack<'_> {
    /// Entry `i`, with an index in range by construction.
    #[inline]
    fn slot(&self, i: usize) -> &Cell<u64> {
        &self.entries[i % STACK_SIZE]
    }

    #[inline]
    fn push(&mut self, entry: u64) {
        self.slot(self.len).set(entry);
        self.len += 1;
    }

    /// Inserts the entry below the nearer ones among those from `base` on, which are sorted so that
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

    /// Pops the next child that is entered no later than `limit`.
    #[inline]
    fn pop(&mut self, limit: f32) -> Option<ChildRef> {
        let last = entry(limit, ChildRef(u32::MAX));
        while self.len > 0 {
            self.len -= 1;
            let top = self.slot(self.len).get();
            if top <= last {
                return Some(ChildRef(top as u32));
            }
        }
        None
    }
}

/// Slabs of a ray for eight boxes: depth = plane · inverse + offset.
pub(super) struct RaySlabs {
    pub(super) inverse: [f32x8; 3],
    pub(super) near: [f32x8; 3],
    pub(super) far: [f32x8; 3],
    /// Per axis [`WIDTH`] if the ray meets the greater planes first, else 0.
    pub(super) first: [usize; 3],
    pub(super) start: f32x8,
}

impl RaySlabs {
    /// Computes the slabs of a ray; `PADS` is true if it has a pad of its own.
    #[inline(always)]
    fn new<const PADS: bool>(ray: &PreparedRay, scene: &SceneExtent) -> Self {
        let pad = if PADS {
            Vec3A::splat((ray.pad - scene.padded).max(0.0)).copysign(ray.inverse)
        } else {
            Vec3A::ZERO
        };
        let to_center = scene.center - Vec3A::from(ray.origin);
        let splat = |v: Vec3A| [f32x8::splat(v.x), f32x8::splat(v.y), f32x8::splat(v.z)];
        let falls = ray.falls as usize;
        Self {
            inverse: splat(ray.inverse),
            near: splat((to_center - pad) * ray.inverse),
            far: splat(if PADS { to_center + pad } else { to_center } * ray.inverse),
            first: [falls << 3 & WIDTH, falls << 2 & WIDTH, falls << 1 & WIDTH],
            start: f32x8::splat(ray.depth_start()),
        }
    }

    /// Returns the depths at which the ray enters each child's box, and a mask of the children that
    /// it enters before `limit`.
    #[inline(always)]
    pub(super) fn test(&self, node: &WideNode, limit: f32x8) -> (f32x8, f32x8) {
        let planes: &[f32; 6 * WIDTH] = bytemuck::cast_ref(&node.planes);
        let meet = |axis: usize, side: usize, offset: [f32x8; 3]| {
            let mut row = [0.0; WIDTH];
            row.copy_from_slice(&planes[2 * WIDTH * axis + (side & WIDTH)..][..WIDTH]);
            f32x8::new(row).mul_add(self.inverse[axis], offset[axis])
        };
        let [x, y, z] = self.first;
        let (near_x, far_x) = (meet(0, x, self.near), meet(0, WIDTH ^ x, self.far));
        let (near_y, far_y) = (meet(1, y, self.near), meet(1, WIDTH ^ y, self.far));
        let (near_z, far_z) = (meet(2, z, self.near), meet(2, WIDTH ^ z, self.far));
        let near = later(later(near_x, near_y), later(near_z, self.start));
        let far = earlier(earlier(far_x, far_y), earlier(far_z, limit));
        (near, !after(near, far))
    }
}

/// Values that only the triangle test needs.
struct OfRay {
    slopes: Vec3A,
    scale: f32,
    /// See [`ray::depth_start`].
    start: f32,
}

impl OfRay {
    #[inline(always)]
    fn new(ray: &PreparedRay) -> Self {
        let start = ray::depth_start(ray.t_min, ray.scale);
        Self { slopes: ray.slopes, scale: ray.scale, start }
    }
}

/// State of a query: its input, and the nearest hit so far.
struct QueryState<'a, C> {
    asked: &'a Ray,
    scene: &'a SceneExtent,
    axes: [usize; 3],
    of_ray: &'a OfRay,
    nearest: NearestHit,
    counter: &'a mut C,
}

impl<'a, C: Counter> QueryState<'a, C> {
    #[inline(always)]
    fn new(
        asked: &'a Ray,
        scene: &'a SceneExtent,
        ray: &PreparedRay,
        of_ray: &'a OfRay,
        counter: &'a mut C,
    ) -> Self {
        let (axes, nearest) = (ray.axes, NearestHit::new(ray));
        Self { asked, scene, axes, of_ray, nearest, counter }
    }

    /// Returns true if a primitive of a leaf is hit nearer than the nearest hit so far.
    #[inline(always)]
    fn test(&mut self, bvh: &WideBvh, leaf: ChildRef) -> bool {
        if leaf.0 & ChildRef::TRIANGLES != 0 {
            self.test_triangles(&bvh.triangles[ChildRef::index(leaf.0)])
        } else {
            self.test_spheres(&bvh.spheres[ChildRef::index(leaf.0)])
        }
    }

    /// [`Self::test`] for a block of triangles.
    #[inline(always)]
    fn test_triangles(&mut self, block: &TriangleBlock) -> bool {
        let Some((set, tested)) = self.filter(block) else { return false };
        let mut better = false;
        if let Some(lane) = tested.nearest(set, self.asked.t_min.max(0.0), self.nearest.t()) {
            better = self.nearest.offer(tested.in_lane(lane, &block.ids));
        }
        better | self.confirm(block, set, &tested)
    }

    /// Returns true if any primitive of a leaf is hit, for a query that has no hit yet.
    #[inline(always)]
    fn test_any(&mut self, bvh: &WideBvh, leaf: ChildRef) -> bool {
        if leaf.0 & ChildRef::TRIANGLES == 0 {
            return self.test_spheres(&bvh.spheres[ChildRef::index(leaf.0)]);
        }
        let block = &bvh.triangles[ChildRef::index(leaf.0)];
        let Some((set, tested)) = self.filter(block) else { return false };
        let Ray { t_min, t_max, .. } = *self.asked;
        tested.any(set, t_min.max(0.0), t_max) || self.confirm(block, set, &tested)
    }

    /// Tests the triangles of a block that pass the filter in single precision; `None` if none do.
    #[inline(always)]
    fn filter(&mut self, block: &TriangleBlock) -> Option<(u32, BlockTest)> {
        self.counter.add(|| block.len());
        // Without this, the compiler would build vectors of eight before the first node, which is
        // slower.
        let (origin, of_ray) = black_box((&self.asked.origin, self.of_ray));
        let start = BlockLanes::splat(of_ray.start);
        let limit = BlockLanes::splat(ray::depth_limit(self.nearest.t(), of_ray.scale));
        let shear = Shear::new(*origin, of_ray.slopes, self.axes, start);
        let (set, sheared) = shear.filter_block(block, limit);
        if set == 0 {
            return None;
        }
        let origin_size = BlockLanes::splat(origin.abs().max_element());
        let inverse_scale = BlockLanes::splat(1.0 / of_ray.scale);
        Some((set, sheared.test(inverse_scale, origin_size)))
    }

    /// Decides about the unclear triangles of a set in double precision; returns true if one of
    /// them is hit nearer than the nearest hit so far.
    #[inline(always)]
    fn confirm(&mut self, block: &TriangleBlock, set: u32, tested: &BlockTest) -> bool {
        let unclear = tested.unclear.to_bitmask() & set;
        if unclear == 0 {
            return false;
        }
        let (nearest, better) = confirm(self.asked, self.scene, block, unclear, self.nearest);
        self.nearest = nearest;
        better
    }

    /// [`Self::test`] for a block of spheres.
    #[inline(always)]
    fn test_spheres(&mut self, block: &SphereBlock) -> bool {
        self.counter.add(|| block.len());
        let (nearest, better) = nearest_sphere(self.asked, block, self.nearest);
        self.nearest = nearest;
        better
    }
}

/// Decides about some triangles of a block in double precision; the flag is true if one of them is
/// hit nearer. The ray is prepared again: to keep it for the few times that it is needed costs
/// more.
#[cold]
#[inline(never)]
fn confirm(
    ray: &Ray,
    scene: &SceneExtent,
    block: &TriangleBlock,
    set: u32,
    mut nearest: NearestHit,
) -> (NearestHit, bool) {
    let mut better = false;
    let Some(ray) = PreparedRay::in_scene(ray, scene) else { return (nearest, false) };
    for lane in lanes(set) {
        let corners = block.triangle(lane);
        let sheared = corners.map(|corner| triangle::shear(&ray, corner));
        let of_ray = [ray.origin, ray.direction];
        if let Some(h) = triangle::confirm(of_ray, ray.scale, sheared, corners) {
            let id = block.ids[lane % BLOCK];
            better |= nearest.offer(Hit { t: h.t, b1: h.b1, b2: h.b2, primitive: id });
        }
    }
    (nearest, better)
}

/// Nearest hit among a block's spheres and `nearest`; the flag is true if a sphere is nearer.
#[inline(never)]
fn nearest_sphere(ray: &Ray, block: &SphereBlock, mut nearest: NearestHit) -> (NearestHit, bool) {
    let mut better = false;
    for (s, &primitive) in block.iter() {
        if let Some(t) = sphere::intersect(ray.origin, ray.direction, ray.t_min.max(0.0), s) {
            better |= nearest.offer(Hit { t, b1: 0.0, b2: 0.0, primitive });
        }
    }
    (nearest, better)
}

impl WideBvh {
    /// Returns the nearest hit.
    pub(crate) fn intersect<C: Counter>(&self, asked: &Ray, counter: &mut C) -> Option<Hit> {
        match PreparedRay::ordinary(asked, &self.scene) {
            Some(ray) => self.nearest::<false, false, C>(asked, &ray, counter),
            None => self.intersect_padded(asked, counter),
        }
    }

    /// [`Self::intersect`] for any ray. Inlined: as a call, it is 2 to 10 % slower for cameras
    /// outside of the scene.
    #[inline(always)]
    fn intersect_padded<C: Counter>(&self, asked: &Ray, counter: &mut C) -> Option<Hit> {
        if self.size != SizeClass::Usual {
            return self.intersect_unusual(asked, counter);
        }
        let ray = PreparedRay::in_scene(asked, &self.scene)?;
        self.nearest::<true, false, C>(asked, &ray, counter)
    }

    /// [`Self::intersect`] for any ray in a tree of any size.
    #[inline(never)]
    fn intersect_unusual<C: Counter>(&self, asked: &Ray, counter: &mut C) -> Option<Hit> {
        if self.size == SizeClass::Empty {
            return None;
        }
        let ray = PreparedRay::in_scene(asked, &self.scene)?;
        self.nearest::<true, true, C>(asked, &ray, counter)
    }

    #[inline(always)]
    fn nearest<const PADS: bool, const LARGE: bool, C: Counter>(
        &self,
        asked: &Ray,
        ray: &PreparedRay,
        counter: &mut C,
    ) -> Option<Hit> {
        let slabs = RaySlabs::new::<PADS>(ray, &self.scene);
        let of_ray = OfRay::new(ray);
        let mut query = QueryState::new(asked, &self.scene, ray, &of_ray, counter);
        let mut limit = ray.depth_limit(ray.t_max);
        STACK.with(|entries| {
            let mut stack = WideStack { entries, len: 0 };
            let mut child = ChildRef::node(0);
            loop {
                if child.0 < ChildRef::SPHERES {
                    let node = &self.nodes[child.0 as usize];
                    let (near, hit) = slabs.test(node, f32x8::splat(limit));
                    let below = stack.len;
                    if let Some(next) = descend(&mut stack, node, near, hit.to_bitmask()) {
                        if LARGE {
                            (below..stack.len)
                                .for_each(|i| self.prefetch(ChildRef(stack.slot(i).get() as u32)));
                        }
                        child = next;
                        continue;
                    }
                } else if query.test(self, child) {
                    limit = ray.depth_limit(query.nearest.t());
                }
                let Some(next) = stack.pop(limit) else { break };
                child = next;
            }
        });
        query.nearest.get()
    }

    /// Returns true if there is a hit.
    pub(crate) fn occluded<C: Counter>(&self, asked: &Ray, counter: &mut C) -> bool {
        match PreparedRay::ordinary(asked, &self.scene) {
            Some(ray) => self.any::<false, false, C>(asked, &ray, counter),
            None => self.occluded_padded(asked, counter),
        }
    }

    /// [`Self::occluded`] for any ray.
    #[inline(always)]
    fn occluded_padded<C: Counter>(&self, asked: &Ray, counter: &mut C) -> bool {
        if self.size != SizeClass::Usual {
            return self.occluded_unusual(asked, counter);
        }
        let ray = PreparedRay::in_scene(asked, &self.scene);
        ray.is_some_and(|ray| self.any::<true, false, C>(asked, &ray, counter))
    }

    /// [`Self::occluded`] for any ray in a tree of any size.
    #[inline(never)]
    fn occluded_unusual<C: Counter>(&self, asked: &Ray, counter: &mut C) -> bool {
        if self.size == SizeClass::Empty {
            return false;
        }
        let ray = PreparedRay::in_scene(asked, &self.scene);
        ray.is_some_and(|ray| self.any::<true, true, C>(asked, &ray, counter))
    }

    #[inline(always)]
    fn any<const PADS: bool, const LARGE: bool, C: Counter>(
        &self,
        asked: &Ray,
        ray: &PreparedRay,
        counter: &mut C,
    ) -> bool {
        let slabs = RaySlabs::new::<PADS>(ray, &self.scene);
        let of_ray = OfRay::new(ray);
        let mut query = QueryState::new(asked, &self.scene, ray, &of_ray, counter);
        let limit = ray.depth_limit(ray.t_max);
        CHILDREN.with(|stack| {
            let mut len = 0;
            let mut child = ChildRef::node(0);
            loop {
                if child.0 < ChildRef::SPHERES {
                    let node = &self.nodes[child.0 as usize];
                    let hits = slabs.test(node, f32x8::splat(limit)).1.to_bitmask();
                    if hits != 0 {
                        let last = hits.ilog2();
                        let others = hits ^ 1 << last;
                        if LARGE {
                            self.prefetch_those(node, others);
                        }
                        len += put_off(stack, len, node, others);
                        child = node.children[last as usize % WIDTH];
                        continue;
                    }
                } else if query.test_any(self, child) {
                    return true;
                }
                if len == 0 {
                    return false;
                }
                len -= 1;
                child = ChildRef(stack[len % STACK_SIZE].get());
            }
        })
    }
}

/// Pushes the children in a set on a stack of length `len`, the last on top; returns their number.
#[inline(always)]
fn put_off(stack: &[Cell<u32>; STACK_SIZE], len: usize, node: &WideNode, set: u32) -> usize {
    if set != 0 {
        let children = u32x8::new(bytemuck::cast(node.children)).shuffle(members(set)).to_array();
        for (slot, child) in stack[len..len + WIDTH].iter().zip(children) {
            slot.set(child);
        }
    }
    set.count_ones() as usize
}

/// Pushes all children that are hit except the nearest, which it returns. Up to three are sorted
/// without branches.
#[inline(always)]
fn descend(
    stack: &mut WideStack<'_>,
    node: &WideNode,
    near: f32x8,
    mut hits: u32,
) -> Option<ChildRef> {
    if hits == 0 {
        return None;
    }
    if hits.is_power_of_two() {
        return Some(node.children[hits.trailing_zeros() as usize % WIDTH]);
    }
    let depths = near.as_array();
    let mut next = || {
        let lane = hits.trailing_zeros() as usize % WIDTH;
        hits &= hits - 1;
        (entry(depths[lane], node.children[lane]), hits != 0)
    };
    let (a, _) = next();
    let (b, more) = next();
    let (a, b) = ordered(a, b);
    if !more {
        stack.push(a);
        return Some(ChildRef(b as u32));
    }
    let (c, more) = next();
    let (b, c) = ordered(b, c);
    let (a, b) = ordered(a, b);
    if !more {
        stack.push(a);
        stack.push(b);
        return Some(ChildRef(c as u32));
    }
    let base = stack.len;
    stack.push(a);
    stack.push(b);
    stack.push(c);
    loop {
        let (e, more) = next();
        stack.insert(e, base);
        if !more {
            break;
        }
    }
    stack.len -= 1;
    Some(ChildRef(stack.slot(stack.len).get() as u32))
}

/// Orders two entries, the greater first.
#[inline(always)]
fn ordered(a: u64, b: u64) -> (u64, u64) {
    (a.max(b), a.min(b))
}
