//! Queries of many rays at once.
//!
//! A ray visits few nodes, and each step depends on the one before: the next node is known only
//! after the box tests. Steps of different rays are independent. So the rays of a group advance
//! together: in each round, first all rays that are at a node test its boxes, then all that are at
//! a block of triangles filter it, and then all triangles that passed are tested, eight at a time
//! regardless of their rays. The loops have hardly any unpredictable branches: rays are put into
//! the queue of the kind of their next child, the children of a node are sorted by a network, and
//! those not hit end up above the top of the stack.
//!
//! Coherent rays, such as those of neighbouring pixels, are traced as packets instead.
//!
//! The tests are those of single queries, so the hits have the same bits.

#[cfg_attr(any(not(target_arch = "x86_64"), portable), path = "no_avx512.rs")]
pub(super) mod avx512;
mod candidates;
mod frustum_cull;
mod group;
pub(super) mod lane_permute;
mod occlusion_order_stats;
mod packet;
mod ray_slots;
#[cfg(all(target_arch = "x86_64", not(portable)))]
mod root;

use std::cell::RefCell;
use std::ops::Range;

use bytemuck::Zeroable;
use pt_math::{Ray, Rays};
use wide::{f32x8, u32x8};

use self::candidates::{BLOCKS, Candidates};
use self::group::{GROUP, GroupColumn, RayGroup, bits};
use self::lane_permute::{LANES, members, sort_descending};
use self::occlusion_order_stats::OcclusionOrders;
use self::packet::{LONE, MAX, PACKET, PAUSE, PacketBounds};
use self::ray_slots::{RaySlotChunks, SECTION, SECTIONS};
use super::{ChildRef, SizeClass, WIDTH, WideBvh, WideNode};
use crate::counter::Counter;
use crate::geometry::Hit;
use crate::sphere;

/// Number of entries above the top of a stack that a push may overwrite.
pub(super) const STACK_MARGIN: usize = WIDTH;

/// Bits of the depth that contain the lane of a child during sorting.
const LANE_BITS: u32 = WIDTH as u32 - 1;

/// Rays by the kind of their next child: the two bits of kind of [`ChildRef`].
#[derive(Clone, Copy, bytemuck::Zeroable)]
struct Queues {
    rays: [GroupColumn<u32>; 4],
    /// Counts of each kind, in sixteen bits each of one register.
    len: u64,
}

impl Queues {
    const NODES: usize = 0;
    const SPHERES: usize = ChildRef::kind(ChildRef::SPHERES);
    const TRIANGLES: usize = ChildRef::kind(ChildRef::TRIANGLES);
    const DONE: usize = ChildRef::kind(ChildRef::DONE);

    #[inline(always)]
    fn add(&mut self, ray: usize, child: u32) {
        let kind = ChildRef::kind(child);
        self.rays[kind][self.len(kind) % GROUP] = ray as u32;
        self.grow(kind, 1);
    }

    #[inline(always)]
    fn len(&self, kind: usize) -> usize {
        (self.len >> (16 * kind)) as usize & 0xffff
    }

    #[inline(always)]
    fn grow(&mut self, kind: usize, more: u32) {
        self.len += u64::from(more) << (16 * kind);
    }

    #[inline(always)]
    fn of(&self, kind: usize) -> &[u32] {
        &self.rays[kind][..self.len(kind)]
    }

    fn is_empty(&self) -> bool {
        [Self::NODES, Self::SPHERES, Self::TRIANGLES].iter().all(|&kind| self.len(kind) == 0)
    }
}

/// Stacks of deferred children, a stretch for each ray of a group. Depths are stored as bits, whose
/// order is the same for positive numbers.
#[derive(Default)]
struct Stacks {
    /// Entries per ray.
    size: usize,
    depths: Vec<u32>,
    children: Vec<u32>,
}

impl Stacks {
    /// Sets the size of the stacks. Below its stack each ray has a sentinel entry that ends the
    /// traversal, passes every depth limit, and is never overwritten.
    fn set_size(&mut self, stack_size: usize) {
        if self.size != stack_size {
            self.size = stack_size;
            self.depths = vec![0; GROUP * stack_size];
            self.children = vec![ChildRef::DONE; GROUP * stack_size];
        }
    }

    /// Pushes the children of a node that are hit on a stack, the farthest first. Entries of the
    /// others end up above its top. The lanes are stored with the depths.
    #[inline(always)]
    fn push_sorted(&mut self, top: &mut usize, near: f32x8, hit: f32x8, node: &WideNode) {
        let keys = (bits(near) & u32x8::splat(!LANE_BITS)) | LANES;
        self.put_sorted(*top, sort_descending(keys & bits(hit)), node);
        *top += hit.to_bitmask().count_ones() as usize;
    }

    /// Writes children of a node from `top` on, by their depths with the lanes that contain them.
    #[inline(always)]
    fn put_sorted(&mut self, top: usize, keys: u32x8, node: &WideNode) {
        self.depths[top..top + STACK_MARGIN].copy_from_slice(keys.as_array());
        self.put(top, keys & u32x8::splat(LANE_BITS), node);
    }

    /// Writes the children in some lanes of a node from `top` on.
    #[inline(always)]
    fn put(&mut self, top: usize, lanes: u32x8, node: &WideNode) {
        let children = u32x8::new(bytemuck::cast(node.children));
        self.children[top..top + STACK_MARGIN].copy_from_slice(children.shuffle(lanes).as_array());
    }

    /// Pushes the children that are hit in any order, and without depths.
    #[inline(always)]
    fn push(&mut self, top: &mut usize, hit: f32x8, node: &WideNode) {
        let hit = hit.to_bitmask();
        self.put(*top, members(hit), node);
        *top += hit.count_ones() as usize;
    }

    /// Pops the topmost child with a depth up to `limit`; `top` is the entry above the stack.
    #[inline(always)]
    fn pop<const ANY: bool>(&self, top: &mut usize, limit: f32) -> u32 {
        *top -= 1;
        while !ANY && self.depths[*top] > limit.to_bits() | LANE_BITS {
            *top -= 1;
        }
        self.children[*top]
    }
}

/// Buffers of a thread for batches, reused between them.
struct Scratch {
    group: Box<RayGroup>,
    candidates: Box<Candidates>,
    queues: Box<[Queues; 2]>,
    stacks: Stacks,
    /// Number of small packets until rays of a whole section are traced as a packet again.
    pause: u32,
    /// Number of small packets until one is traced as such again.
    lone: u32,
    orders: OcclusionOrders,
}

/// Buffers used to start rays.
struct StartBuffers<'a> {
    group: &'a mut RayGroup,
    stacks: &'a mut Stacks,
    pause: &'a mut u32,
    lone: &'a mut u32,
    orders: &'a mut OcclusionOrders,
    queues: &'a mut Queues,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::new(Scratch {
        group: Box::new(RayGroup::zeroed()),
        candidates: Box::new(Candidates::zeroed()),
        queues: Box::new([Queues::zeroed(); 2]),
        stacks: Stacks::default(),
        pause: 0,
        lone: 0,
        orders: OcclusionOrders::default(),
    });
}

impl WideBvh {
    /// Replaces the contents of `hits` by the nearest hit of each ray.
    pub(crate) fn intersect_batch(
        &self,
        rays: Rays<'_>,
        hits: &mut Vec<Option<Hit>>,
        counter: &mut impl Counter,
    ) {
        hits.resize(rays.len(), None);
        self.batch::<false>(rays, counter, |group, place, section| {
            let eights = hits[section].chunks_mut(WIDTH);
            for (first, hits) in (place..).step_by(WIDTH).zip(eights) {
                if group.have_hits(first) {
                    (first..).zip(hits).for_each(|(i, hit)| *hit = group.hit(i));
                } else {
                    hits.fill(None);
                }
            }
        });
    }

    /// Writes to `occluded`, for each ray in order, true if it hits anything.
    pub(crate) fn occluded_batch(
        &self,
        rays: Rays<'_>,
        occluded: &mut Vec<bool>,
        counter: &mut impl Counter,
    ) {
        occluded.resize(rays.len(), false);
        self.batch::<true>(rays, counter, |group, place, section| {
            (place..).zip(&mut occluded[section]).for_each(|(i, any)| *any = group.has_hit(i));
        });
    }

    /// Traces all rays. Calls `done` for finished ones with the position of the first in the group
    /// and their range among all rays.
    fn batch<const ANY: bool>(
        &self,
        rays: Rays<'_>,
        counter: &mut impl Counter,
        mut done: impl FnMut(&RayGroup, usize, Range<usize>),
    ) {
        SCRATCH.with_borrow_mut(|scratch| {
            let Scratch { group, candidates, queues, stacks, pause, lone, orders } = scratch;
            stacks.set_size(self.stack_size);
            let [now, next] = &mut **queues;
            let (mut now, mut next) = (now, next);
            now.len = 0;
            let mut sections = RaySlotChunks::new(rays);
            loop {
                for section in 0..SECTIONS {
                    while let Some(finished) = sections.finished(section) {
                        done(group, section * SECTION, finished);
                        sections.refill(section);
                        let parts =
                            StartBuffers { group, stacks, pause, lone, orders, queues: now };
                        let active = self.start::<ANY>(parts, &sections, section, counter);
                        sections.set_active(section, active);
                    }
                }
                if now.is_empty() {
                    return;
                }
                next.len = 0;
                if self.size == SizeClass::Large {
                    self.visit_nodes::<ANY, true>(group, stacks, now, next);
                } else {
                    self.visit_nodes::<ANY, false>(group, stacks, now, next);
                }
                self.visit_triangles::<ANY>(group, &sections, candidates, now, counter);
                self.visit_spheres(group, &sections, now, counter);
                for kind in [Queues::TRIANGLES, Queues::SPHERES] {
                    leave_leaves::<ANY>(group, stacks, now.of(kind), next);
                }
                sections.finish(next.of(Queues::DONE));
                std::mem::swap(&mut now, &mut next);
            }
        });
    }

    /// Traces coherent rays of a section as packets, and sends the others to the root; returns the
    /// number of the latter.
    #[inline(never)]
    fn start<const ANY: bool>(
        &self,
        parts: StartBuffers<'_>,
        sections: &RaySlotChunks<'_>,
        section: usize,
        counter: &mut impl Counter,
    ) -> usize {
        let StartBuffers { group, stacks, pause, lone, orders, queues } = parts;
        let rays = sections.rays(section);
        let place = section * SECTION;
        let mut usable = 0u64;
        let mut has_slabs = [false; SECTION / WIDTH];
        for first in (0..rays.len()).step_by(WIDTH) {
            let taken = group.take(place + first, rays, first, &self.scene);
            usable |= u64::from(taken.usable) << first;
            has_slabs[first / WIDTH] = taken.has_slabs;
            group.reset_stacks(place + first, self.stack_size);
        }
        if self.nodes.is_empty() {
            return 0;
        }
        let mut is_given_up = false;
        if *pause == 0
            && usable == u64::MAX
            && let Some(beam) = PacketBounds::new::<SECTION>(group, place, &self.scene)
        {
            let work = self.trace::<ANY, SECTION>(group, stacks, &beam, place, sections, counter);
            *pause = if work.tests > MAX { PAUSE } else { 0 };
            if !work.exceeds_single_rays(SECTION) {
                return 0;
            }
            is_given_up = true;
        }
        let mut active = 0;
        for first in (0..rays.len()).step_by(PACKET) {
            let mut usable = (usable >> first) as u32 & ((1 << PACKET) - 1);
            let at = place + first;
            *lone = lone.saturating_sub(1);
            if *lone == 0
                && usable.count_ones() as usize == PACKET
                && let Some(mut beam) = PacketBounds::new::<PACKET>(group, at, &self.scene)
            {
                beam.near_first = ANY && orders.near_first();
                let work = self.trace::<ANY, PACKET>(group, stacks, &beam, at, sections, counter);
                if ANY {
                    orders.learn(beam.near_first, work);
                }
                *pause = pause.saturating_sub(1);
                if !work.exceeds_single_rays(PACKET) {
                    continue;
                }
                *lone = LONE;
                is_given_up = true;
            }
            if ANY && is_given_up {
                let is_open = |i: &usize| !group.has_hit(at + i);
                usable &= (0..PACKET).filter(is_open).fold(0, |open, i| open | 1 << i);
            }
            for eight in (first..first + PACKET).step_by(WIDTH) {
                if !has_slabs[eight / WIDTH] {
                    group.take_slabs(place + eight, &self.scene);
                }
            }
            if let Some(avx512) = self.avx512 {
                let nodes = &self.nodes;
                active += avx512.enter::<ANY>(group, stacks, queues, nodes, at, usable) as usize;
                continue;
            }
            let sent = (0..PACKET).filter(|i| usable >> i & 1 == 1);
            sent.for_each(|i| queues.add(at + i, group.child[at + i]));
            active += usable.count_ones() as usize;
        }
        active
    }

    /// Advances rays at nodes to the nearest child that they hit, and defers the others.
    #[inline(never)]
    fn visit_nodes<const ANY: bool, const LARGE: bool>(
        &self,
        group: &mut RayGroup,
        stacks: &mut Stacks,
        now: &Queues,
        next: &mut Queues,
    ) {
        for &i in now.of(Queues::NODES) {
            let i = i as usize % GROUP;
            let node = &self.nodes[group.child[i] as usize];
            let limit = group.limit[i];
            let (near, hit) = group.slabs(i).test(node, f32x8::splat(limit));
            let mut top = group.top[i] as usize;
            if ANY {
                stacks.push(&mut top, hit, node);
            } else {
                stacks.push_sorted(&mut top, near, hit, node);
            }
            let child = stacks.pop::<ANY>(&mut top, limit);
            if LARGE {
                self.prefetch(ChildRef(child));
            }
            group.child[i] = child;
            group.top[i] = top as u32;
            next.add(i, child);
        }
    }

    /// Tests rays at blocks of triangles.
    #[inline(never)]
    fn visit_triangles<const ANY: bool>(
        &self,
        group: &mut RayGroup,
        sections: &RaySlotChunks<'_>,
        candidates: &mut Candidates,
        now: &Queues,
        counter: &mut impl Counter,
    ) {
        for places in now.of(Queues::TRIANGLES).chunks(BLOCKS) {
            candidates.clear();
            for &i in places {
                let i = i as usize % GROUP;
                let block = &self.triangles[ChildRef::index(group.child[i])];
                counter.add(|| block.len());
                let (set, sheared) =
                    group.shear(i).filter_block(block, f32x8::splat(group.limit[i]));
                candidates.add(i as u32, u32x8::new(block.ids), set, &sheared);
            }
            candidates.test::<ANY>(group, sections, &self.triangles);
        }
    }

    /// Tests rays at blocks of spheres.
    #[inline(never)]
    fn visit_spheres(
        &self,
        group: &mut RayGroup,
        sections: &RaySlotChunks<'_>,
        now: &Queues,
        counter: &mut impl Counter,
    ) {
        for &i in now.of(Queues::SPHERES) {
            let i = i as usize % GROUP;
            self.visit_sphere(group, sections, i, group.child[i], counter);
        }
    }

    /// Tests a ray against a block of spheres.
    fn visit_sphere(
        &self,
        group: &mut RayGroup,
        sections: &RaySlotChunks<'_>,
        i: usize,
        child: u32,
        counter: &mut impl Counter,
    ) {
        let block = &self.spheres[ChildRef::index(child)];
        counter.add(|| block.len());
        let Ray { origin, direction, .. } = sections.ray(i);
        for (s, &primitive) in block.iter() {
            if let Some(t) = sphere::intersect(origin, direction, group.t_min[i], s) {
                group.offer_sphere(i, t, primitive);
            }
        }
    }
}

/// Advances rays that have tested a leaf to their deferred children.
#[inline(always)]
fn leave_leaves<const ANY: bool>(
    group: &mut RayGroup,
    stacks: &Stacks,
    rays: &[u32],
    next: &mut Queues,
) {
    for &i in rays {
        let i = i as usize % GROUP;
        let mut top = group.top[i] as usize;
        let child = stacks.pop::<ANY>(&mut top, group.limit[i]);
        let child = if ANY && group.has_hit(i) { ChildRef::DONE } else { child };
        group.child[i] = child;
        group.top[i] = top as u32;
        next.add(i, child);
    }
}
