//! Entry of rays into the tree sixteen at a time, by AVX-512.
//!
//! All rays begin at the root, and neighbours visit the same nodes for a while whatever their
//! directions. There a box is tested against sixteen rays by the operations that elsewhere test
//! eight boxes against one ray. The next and the deferred children are those of
//! [`WideBvh::visit_nodes`](crate::wide::WideBvh).

use std::arch::x86_64::{
    __m512, __m512i, __mmask16, _CMP_LE_OQ, _CMP_LT_OQ, _mm512_add_epi32, _mm512_castps_si512,
    _mm512_cmp_ps_mask, _mm512_cmpgt_epi32_mask, _mm512_fmadd_ps, _mm512_mask_add_epi32,
    _mm512_mask_blend_ps, _mm512_mask_cmp_ps_mask, _mm512_mask_cmpeq_epi32_mask,
    _mm512_mask_cmpneq_epi32_mask, _mm512_mask_min_epu32, _mm512_mask_mov_epi32,
    _mm512_mask_or_epi32, _mm512_maskz_compress_epi32, _mm512_maskz_ternarylogic_epi32,
    _mm512_max_epu32, _mm512_max_ps, _mm512_min_epu32, _mm512_min_ps, _mm512_permutexvar_epi32,
    _mm512_set1_epi32, _mm512_set1_ps, _mm512_setzero_ps, _mm512_srli_epi32, _mm512_sub_epi32,
};

use wide::{f32x8, u32x8};

use super::avx512::{SIXTEEN, load, load_bits, store_bits};
use super::group::RayGroup;
use super::lane_permute::members;
use super::{LANE_BITS, Queues, Stacks};
use crate::wide::{ChildRef, WIDTH, WideNode, lanes};

/// Truth table of `a & b | c`, for bits 0, 0, 0 to 1, 1, 1 from the lowest on.
const A_AND_B_OR_C: i32 = 0b1110_1010;

/// Minimum number of rays that visit a node together; fewer are faster one by one.
const FEWEST: u32 = 9;

/// Integers for sixteen rays.
type Integers = [u32; SIXTEEN];

/// Slabs of some of sixteen rays at a node.
struct PacketSlabs<'a> {
    node: &'a WideNode,
    /// Position of the first ray.
    first: usize,
    /// Mask of the rays at the node.
    rays: __mmask16,
    inverse: [__m512; 3],
    near: [__m512; 3],
    far: [__m512; 3],
    start: __m512,
    limit: __m512,
    /// Masks per axis of the rays whose direction is negative.
    falls: [__mmask16; 3],
}

impl<'a> PacketSlabs<'a> {
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn new(group: &RayGroup, node: &'a WideNode, first: usize, rays: __mmask16) -> Self {
        let [inverse, near, far] = [&group.inverse, &group.near, &group.far]
            .map(|columns| columns.each_ref().map(|column| load(column, first)));
        let zero = _mm512_setzero_ps();
        Self {
            node,
            first,
            rays,
            inverse,
            near,
            far,
            start: load(&group.start, first),
            limit: load(&group.limit, first),
            falls: inverse.map(|x| _mm512_cmp_ps_mask::<_CMP_LT_OQ>(x, zero)),
        }
    }

    /// Returns the depths at which rays enter a child's box, and a mask of those that enter it
    /// before their limit.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn test(&self, child: usize) -> (__m512, __mmask16) {
        let meet = |axis: usize| {
            let [low, high] = self.node.planes[axis].map(|x| _mm512_set1_ps(x.as_array()[child]));
            let first = _mm512_mask_blend_ps(self.falls[axis], low, high);
            let last = _mm512_mask_blend_ps(self.falls[axis], high, low);
            let inverse = self.inverse[axis];
            let near = _mm512_fmadd_ps(first, inverse, self.near[axis]);
            (near, _mm512_fmadd_ps(last, inverse, self.far[axis]))
        };
        let [(nx, fx), (ny, fy), (nz, fz)] = [meet(0), meet(1), meet(2)];
        let near = _mm512_max_ps(_mm512_max_ps(nx, ny), _mm512_max_ps(nz, self.start));
        let far = _mm512_min_ps(_mm512_min_ps(fx, fy), _mm512_min_ps(fz, self.limit));
        (near, _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(self.rays, near, far))
    }
}

/// Compare-and-exchange network for eight numbers. [Knuth, The Art of Computer Programming, vol. 3,
/// §5.3.4: Batcher's, by merging]
const NETWORK: [[usize; 2]; 19] = [
    [0, 1],
    [2, 3],
    [4, 5],
    [6, 7],
    [0, 2],
    [1, 3],
    [4, 6],
    [5, 7],
    [1, 2],
    [5, 6],
    [0, 4],
    [3, 7],
    [1, 5],
    [2, 6],
    [1, 4],
    [3, 6],
    [2, 4],
    [3, 5],
    [3, 4],
];

/// Sorts the eight keys of each of sixteen rays in descending order.
#[inline]
#[target_feature(enable = "avx512f")]
fn sort_descending(mut keys: [__m512i; WIDTH]) -> [__m512i; WIDTH] {
    for [i, j] in NETWORK {
        let (a, b) = (keys[i], keys[j]);
        (keys[i], keys[j]) = (_mm512_max_epu32(a, b), _mm512_min_epu32(a, b));
    }
    keys
}

#[inline]
#[target_feature(enable = "avx512f")]
fn splat(x: u32) -> __m512i {
    _mm512_set1_epi32(x.cast_signed())
}

#[inline]
#[target_feature(enable = "avx512f")]
fn numbers() -> __m512i {
    load_bits(&std::array::from_fn::<u32, SIXTEEN, _>(|i| i as u32), 0)
}

#[inline]
#[target_feature(enable = "avx512f")]
fn to_array(x: __m512i) -> Integers {
    let mut numbers = [0; SIXTEEN];
    store_bits(&mut numbers, 0, !0, x);
    numbers
}

/// Transposes keys to one row per ray.
#[inline]
#[target_feature(enable = "avx512f")]
fn rows(keys: &[__m512i; WIDTH]) -> [u32x8; SIXTEEN] {
    let mut columns = [[f32x8::ZERO; SIXTEEN / WIDTH]; WIDTH];
    for (column, keys) in columns.iter_mut().zip(keys) {
        *column = bytemuck::cast(to_array(*keys));
    }
    let [a, b] = [0, 1].map(|half| f32x8::transpose(columns.map(|column| column[half])));
    bytemuck::cast([a, b])
}

/// Result of sixteen rays at a node.
struct RootHits {
    /// Number of children that each ray hits.
    count: __m512i,
    /// Child that each ray visits next.
    next: __m512i,
}

impl RootHits {
    /// Mask of the rays that hit more than `count` children.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn more_than(&self, count: u32) -> __mmask16 {
        _mm512_cmpgt_epi32_mask(self.count, splat(count))
    }
}

/// Puts sixteen rays into the queues of their next children; returns the number of rays with one.
#[inline]
#[target_feature(enable = "avx512f")]
fn queue(queues: &mut Queues, first: usize, rays: __mmask16, children: __m512i) -> u32 {
    let kinds = _mm512_srli_epi32::<{ ChildRef::KIND_SHIFT }>(children);
    let places = _mm512_add_epi32(splat(first as u32), numbers());
    let mut active = 0;
    for kind in [Queues::NODES, Queues::SPHERES, Queues::TRIANGLES] {
        let set = _mm512_mask_cmpeq_epi32_mask(rays, kinds, splat(kind as u32));
        let places = _mm512_maskz_compress_epi32(set, places);
        let len = queues.len(kind);
        store_bits(&mut queues.rays[kind], len, !0, places);
        queues.grow(kind, set.count_ones());
        active += set.count_ones();
    }
    active
}

impl RayGroup {
    /// See [`Avx512::enter`](super::avx512::Avx512::enter).
    #[target_feature(enable = "avx512f")]
    pub(super) fn enter_by_sixteen<const ANY: bool>(
        &mut self,
        stacks: &mut Stacks,
        queues: &mut Queues,
        nodes: &[WideNode],
        first: usize,
        usable: u32,
    ) -> u32 {
        let usable = usable as __mmask16;
        // Rays that hit nothing at the root are done.
        let mut children = splat(ChildRef::DONE);
        let mut at_nodes =
            self.visit_together::<ANY>(stacks, &nodes[0], first, usable, &mut children);
        while at_nodes.count_ones() >= FEWEST {
            let ray = at_nodes.trailing_zeros() as usize;
            let node = to_array(children)[ray % SIXTEEN];
            let together = _mm512_mask_cmpeq_epi32_mask(at_nodes, children, splat(node));
            if together.count_ones() < FEWEST {
                break;
            }
            let node = &nodes[node as usize];
            at_nodes &= !together;
            at_nodes |= self.visit_together::<ANY>(stacks, node, first, together, &mut children);
        }
        store_bits(&mut self.child, first, !0, children);
        queue(queues, first, usable, children)
    }

    /// Advances those of sixteen rays that are at `node` to their next child, in `children`;
    /// returns a mask of the rays that are then at an inner node.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn visit_together<const ANY: bool>(
        &mut self,
        stacks: &mut Stacks,
        node: &WideNode,
        first: usize,
        rays: __mmask16,
        children: &mut __m512i,
    ) -> __mmask16 {
        let slabs = PacketSlabs::new(self, node, first, rays);
        let found =
            if ANY { self.find_any(stacks, &slabs) } else { self.find_nearest(stacks, &slabs) };
        let is_hit = found.more_than(0);
        // The next child is the last one pushed. All lanes are stored, since loads after masked
        // stores are slow.
        let top = load_bits(&self.top, first);
        let last = _mm512_sub_epi32(_mm512_add_epi32(top, found.count), splat(1));
        store_bits(&mut self.top, first, !0, _mm512_mask_mov_epi32(top, is_hit, last));
        let before = *children;
        *children = _mm512_mask_mov_epi32(*children, is_hit, found.next);
        let missed =
            rays & !is_hit & _mm512_mask_cmpneq_epi32_mask(rays, before, splat(ChildRef::DONE));
        if missed != 0 {
            let mut popped = to_array(*children);
            for i in lanes(u32::from(missed)) {
                let mut top = self.top[first + i % SIXTEEN] as usize;
                popped[i % SIXTEEN] = stacks.pop::<ANY>(&mut top, self.limit[first + i % SIXTEEN]);
                self.top[first + i % SIXTEEN] = top as u32;
            }
            *children = load_bits(&popped, 0);
        }
        let kinds = _mm512_srli_epi32::<{ ChildRef::KIND_SHIFT }>(*children);
        _mm512_mask_cmpeq_epi32_mask(rays, kinds, splat(Queues::NODES as u32))
    }

    /// Finds the next child for occlusion rays, and defers the others.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn find_any(&self, stacks: &mut Stacks, slabs: &PacketSlabs<'_>) -> RootHits {
        let mut found = RootHits { count: splat(0), next: splat(ChildRef::DONE) };
        let mut sets = splat(0);
        for child in 0..WIDTH {
            let (_, hit) = slabs.test(child);
            found.count = _mm512_mask_add_epi32(found.count, hit, found.count, splat(1));
            found.next =
                _mm512_mask_mov_epi32(found.next, hit, splat(slabs.node.children[child].0));
            sets = _mm512_mask_or_epi32(sets, hit, sets, splat(1 << child));
        }
        let sets = to_array(sets);
        for i in lanes(u32::from(found.more_than(1))) {
            let top = self.top[slabs.first + i] as usize;
            stacks.put(top, members(sets[i % SIXTEEN]), slabs.node);
        }
        found
    }

    /// Finds the next child for nearest hits, and defers the others.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn find_nearest(&self, stacks: &mut Stacks, slabs: &PacketSlabs<'_>) -> RootHits {
        let mut count = splat(0);
        let mut least = splat(u32::MAX);
        let mut keys = [splat(0); WIDTH];
        for (child, key) in keys.iter_mut().enumerate() {
            let (near, hit) = slabs.test(child);
            count = _mm512_mask_add_epi32(count, hit, count, splat(1));
            let (near, lane) = (_mm512_castps_si512(near), splat(child as u32));
            // near & !LANE_BITS | child
            let mask = splat(!LANE_BITS);
            *key = _mm512_maskz_ternarylogic_epi32::<A_AND_B_OR_C>(hit, near, mask, lane);
            least = _mm512_mask_min_epu32(least, hit, least, *key);
        }
        // Replicated, since the permutation uses four bits of the key.
        let children: Integers = bytemuck::cast([slabs.node.children; SIXTEEN / WIDTH]);
        let next = _mm512_permutexvar_epi32(least, load_bits(&children, 0));
        let found = RootHits { count, next };
        let several = found.more_than(1);
        if several != 0 {
            let rows = rows(&sort_descending(keys));
            for i in lanes(u32::from(several)) {
                let top = self.top[slabs.first + i] as usize;
                stacks.put_sorted(top, rows[i % SIXTEEN], slabs.node);
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::NETWORK;

    #[test]
    fn every_sequence_of_zeros_and_ones_is_sorted() {
        // See the test of the same name in `lane_permute.rs`.
        for bits in 0..256u32 {
            let mut x: [u32; 8] = std::array::from_fn(|lane| bits >> lane & 1);
            for [i, j] in NETWORK {
                (x[i], x[j]) = (x[i].max(x[j]), x[i].min(x[j]));
            }
            assert!(x.is_sorted_by(|a, b| a >= b), "{bits:08b}");
        }
    }
}
