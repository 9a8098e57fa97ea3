//! Triangles that passed the filter, confirmed eight at a time.

use pt_math::interval::gamma;
use wide::{f32x8, f64x8, u32x8};

use super::group::{Column, GROUP, Group, bits, depth_limit, from_bits};
use super::order::members;
use crate::geometry::Hit;
use crate::wide::traverse::Sheared;
use crate::wide::{BLOCK, WIDTH};

/// Blocks that are filtered before what they leave is confirmed.
pub(super) const BLOCKS: usize = 32;

/// Room for all triangles of so many blocks, and for the rest of the last vector.
const ROOM: usize = BLOCKS * BLOCK + WIDTH;

/// Rays, and triangles that they may hit.
#[derive(Clone, Copy, bytemuck::Zeroable)]
#[repr(align(64))]
pub(super) struct Candidates {
    /// Sheared vertices: vertex, axis.
    vertices: [[[f32; ROOM]; 3]; 3],
    /// Which ray of the group.
    rays: [u32; ROOM],
    primitives: [u32; ROOM],
    len: usize,
}

impl Candidates {
    pub(super) fn clear(&mut self) {
        self.len = 0;
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds those of eight pairs of a ray and a triangle that are in the set.
    #[inline(always)]
    pub(super) fn add(&mut self, rays: u32x8, primitives: u32x8, set: u32, at: &Sheared) {
        let lanes = members(set);
        let to = self.len..self.len + WIDTH;
        for (columns, vertex) in self.vertices.iter_mut().zip(&at.0) {
            for (column, x) in columns.iter_mut().zip(vertex) {
                let x = from_bits(bits(*x).shuffle(lanes));
                column[to.clone()].copy_from_slice(x.as_array());
            }
        }
        self.rays[to.clone()].copy_from_slice(rays.shuffle(lanes).as_array());
        self.primitives[to].copy_from_slice(primitives.shuffle(lanes).as_array());
        self.len += set.count_ones() as usize;
    }

    /// Offers all hits to their rays.
    #[inline]
    pub(super) fn confirm(&self, group: &mut Group) {
        for first in (0..self.len).step_by(WIDTH) {
            let rays = eight(&self.rays, first).map(|i| i as usize % GROUP);
            let primitives = eight(&self.primitives, first);
            let eight = Eight {
                vertices: self.vertices.each_ref().map(|v| v.each_ref().map(|x| eight(x, first))),
                scale: gather(&group.scale, rays),
                origin_size: gather(&group.origin_size, rays),
            };
            let hits = eight.confirm();
            let limits = depth_limit(f32x8::new(hits.t), f32x8::new(eight.scale)).to_array();
            for k in 0..WIDTH.min(self.len - first) {
                let [b1, b2] = hits.barycentric.map(|b| b[k]);
                let hit = Hit { t: hits.t[k], b1, b2, primitive: primitives[k] };
                group.offer(rays[k], hit, limits[k], hits.confirmed >> k & 1 == 1);
            }
        }
    }
}

fn eight<T: Copy + Default>(column: &[T; ROOM], first: usize) -> [T; WIDTH] {
    let mut numbers = [T::default(); WIDTH];
    numbers.copy_from_slice(&column[first..first + WIDTH]);
    numbers
}

fn gather(column: &Column, rays: [usize; WIDTH]) -> [f32; WIDTH] {
    rays.map(|i| column[i])
}

/// Eight candidates.
struct Eight {
    vertices: [[[f32; WIDTH]; 3]; 3],
    scale: [f32; WIDTH],
    origin_size: [f32; WIDTH],
}

/// Where they are hit.
struct Hits {
    /// A bit for each that is.
    confirmed: u32,
    t: [f32; WIDTH],
    barycentric: [[f32; WIDTH]; 2],
}

fn wide(x: [f32; WIDTH]) -> f64x8 {
    f64x8::new(x.map(f64::from))
}

fn narrow(x: f64x8) -> [f32; WIDTH] {
    x.to_array().map(|x| x as f32)
}

impl Eight {
    /// The operations of [`crate::triangle::confirm`], which give the same bits.
    #[inline(always)]
    fn confirm(&self) -> Hits {
        let v = self.vertices.map(|vertex| vertex.map(wide));
        let edge = |p: usize, q: usize| v[q][0] * v[p][1] - v[q][1] * v[p][0];
        let edges = [edge(1, 2), edge(2, 0), edge(0, 1)];
        let [negative, positive] =
            [edges.map(|e| e.simd_lt(f64x8::ZERO)), edges.map(|e| e.simd_gt(f64x8::ZERO))]
                .map(|[a, b, c]| a | b | c);
        let [e0, e1, e2] = edges;
        let det = e0 + e1 + e2;
        let inverse = f64x8::splat(1.0) / det;
        let depth = (e0 * v[0][2] + e1 * v[1][2] + e2 * v[2][2]) * inverse;
        let outside = (negative & positive) | det.simd_eq(f64x8::ZERO);
        Hits {
            confirmed: !outside.to_bitmask() & self.ahead(depth, det),
            t: narrow(depth / wide(self.scale)),
            barycentric: [e1, e2].map(|e| narrow(e * inverse)),
        }
    }

    /// A bit for each depth that certainly is ahead of the origin: above its error, by the
    /// formula of [`crate::triangle`].
    #[inline(always)]
    fn ahead(&self, depth: f64x8, det: f64x8) -> u32 {
        let v = self.vertices.map(|vertex| vertex.map(f32x8::new));
        let largest = |k: usize| v[0][k].abs().fast_max(v[1][k].abs()).fast_max(v[2][k].abs());
        let [x, y, z] = [largest(0), largest(1), largest(2)];
        let nearest = v[0][2].fast_min(v[1][2]).fast_min(v[2][2]);
        let size = f32x8::new(self.origin_size);
        let distant = nearest.simd_gt((size + x + y + z * 2.0) * gamma(32)).to_bitmask();
        let [x, y, z] = [x, y, z].map(|x| wide(x.to_array()));
        let (dx, dy) = ((x + z) * f64::from(gamma(5)), (y + z) * f64::from(gamma(5)));
        let dz = z * f64::from(gamma(2));
        let de = (dx * y + dy * x + dx * dy) * 2.0;
        let error = de * 3.0 * (z + dz) / det.abs() + dz;
        let positive = depth.simd_gt(f64x8::ZERO).to_bitmask();
        (distant & positive) | (!distant & depth.simd_gt(error).to_bitmask())
    }
}
