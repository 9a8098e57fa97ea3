//! Triangles that passed the filter, tested eight at a time.

use wide::{f32x8, u32x8};

use super::group::{GROUP, GroupColumn, RayGroup, bits, depth_limit, from_bits};
use super::lane_permute::members;
use super::ray_slots::RaySlotChunks;
use crate::geometry::Hit;
use crate::wide::triangles::ShearedTriangles;
use crate::wide::{BLOCK, ChildRef, TriangleBlock, WIDTH, lanes};

/// Number of blocks that are filtered before the remaining triangles are tested.
pub(super) const BLOCKS: usize = 32;

/// Capacity for all triangles of [`BLOCKS`] blocks, and for the rest of the last vector.
const ROOM: usize = BLOCKS * BLOCK + WIDTH;

/// Pairs of a ray and a triangle that it may hit.
#[derive(Clone, Copy, bytemuck::Zeroable)]
#[repr(align(64))]
pub(super) struct Candidates {
    /// Sheared vertices: vertex, axis.
    vertices: [[[f32; ROOM]; 3]; 3],
    /// Position of each ray in the group.
    rays: [u32; ROOM],
    primitives: [u32; ROOM],
    len: usize,
}

impl Candidates {
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    /// Adds those of eight pairs of a ray and a triangle that are in the set.
    #[inline(always)]
    pub(super) fn add(&mut self, ray: u32, primitives: u32x8, set: u32, at: &ShearedTriangles) {
        let lanes = members(set);
        let to = self.len..self.len + WIDTH;
        for (columns, vertex) in self.vertices.iter_mut().zip(&at.0) {
            for (column, x) in columns.iter_mut().zip(vertex) {
                let x = from_bits(bits(*x).shuffle(lanes));
                column[to.clone()].copy_from_slice(x.as_array());
            }
        }
        self.rays[to.clone()].fill(ray);
        self.primitives[to].copy_from_slice(primitives.shuffle(lanes).as_array());
        self.len += set.count_ones() as usize;
    }

    /// Tests all candidates and offers the hits to their rays, which are at the triangles'
    /// `blocks`.
    #[inline]
    pub(super) fn test<const ANY: bool>(
        &self,
        group: &mut RayGroup,
        sections: &RaySlotChunks<'_>,
        blocks: &[TriangleBlock],
    ) {
        for first in (0..self.len).step_by(WIDTH) {
            let rays = eight(&self.rays, first).map(|i| i as usize % GROUP);
            let primitives = eight(&self.primitives, first);
            let sheared = ShearedTriangles(
                self.vertices.each_ref().map(|v| v.each_ref().map(|x| f32x8::new(eight(x, first)))),
            );
            let gather = |column: &GroupColumn| f32x8::new(rays.map(|i| column[i]));
            let tested = sheared.test(gather(&group.inverse_scale), gather(&group.origin_size));
            let n = WIDTH.min(self.len - first);
            if ANY {
                let after = tested.t.simd_gt(gather(&group.t_min));
                let before = tested.t.simd_lt(gather(&group.t));
                let hits = (tested.hit & after & before).to_bitmask();
                for k in 0..n {
                    let old = &mut group.primitive[rays[k]];
                    *old = if hits >> k & 1 == 1 { primitives[k] } else { *old };
                }
            } else {
                let limits = depth_limit(tested.t, gather(&group.scale)).to_array();
                let hits = tested.hit.to_bitmask();
                let [t, b1, b2] = [tested.t, tested.barycentric[0], tested.barycentric[1]];
                let [t, b1, b2] = [t, b1, b2].map(f32x8::to_array);
                for k in 0..n {
                    let hit = Hit { t: t[k], b1: b1[k], b2: b2[k], primitive: primitives[k] };
                    group.offer(rays[k], hit, limits[k], hits >> k & 1 == 1);
                }
            }
            for k in lanes(tested.unclear.to_bitmask()).take_while(|&k| k < n) {
                let (i, id) = (rays[k], primitives[k]);
                let block = &blocks[ChildRef::index(group.child[i])];
                let lane = block.ids.iter().position(|&other| other == id).unwrap_or(0);
                let vertices = block.triangle(lane);
                group.confirm(i, &sections.ray(i), sheared.triangle(k), vertices, id);
            }
        }
    }
}

fn eight<T: Copy + Default>(column: &[T; ROOM], first: usize) -> [T; WIDTH] {
    let mut numbers = [T::default(); WIDTH];
    numbers.copy_from_slice(&column[first..first + WIDTH]);
    numbers
}
