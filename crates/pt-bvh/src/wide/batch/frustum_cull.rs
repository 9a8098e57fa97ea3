//! Frustum culling for rays of one origin: edge functions find triangles that no ray can hit.
//!
//! With vertices sheared along the middle of the fan, and a ray whose slopes differ from it by δ
//! and η, the edge function of two of them, p and q, is linear in these:
//!
//! (q_x − δq_z)(p_y − ηp_z) − (q_y − ηq_z)(p_x − δp_z)
//!   = q_x p_y − q_y p_x + δ(p_z q_y − q_z p_y) + η(q_z p_x − p_z q_x)
//!
//! So its extremes over the fan are known. If one edge function is below 0 for all rays and another
//! above 0, all rays miss the triangle. [Dmitriev, Havran & Seidel 2004, "Faster Ray Tracing with
//! SIMD Shaft Culling", cull by shafts as well]
//!
//! The triangle test decides by sheared vertices that are rounded. Let Z be the largest depth of a
//! vertex, and P a bound of the distance of a vertex from any of the rays. The vertices of the test
//! err by at most 2ε(P + Z), with and without fused multiply-add, its edge functions by 12εP(P +
//! Z), and so do those here. So triangles whose edge functions are within a margin of 64εP(P + Z)
//! are kept, and those whose products may have lost digits to underflow.

use pt_math::float_error::EPSILON;

use super::group::RayGroup;
use crate::ray::AXES;
use crate::triangle;
use crate::wide::triangles::ShearedTriangles;
use crate::wide::{BLOCK, BlockLanes, TriangleBlock};

/// Rays of one origin and axis, with slopes in an interval.
pub(super) struct FrustumCull {
    axes: [usize; 3],
    origin: [BlockLanes; 3],
    /// Slopes of the middle ray.
    slopes: [BlockLanes; 2],
    /// Maximum difference of slopes from the middle.
    spread: [BlockLanes; 2],
    /// −1 if the rays rise along the last axis, else 1.
    back: BlockLanes,
    start: BlockLanes,
}

impl FrustumCull {
    /// Creates the frustum of a group's rays from position `first` on. The extremes are those of
    /// their origins, slopes and starts.
    #[inline(always)]
    pub(super) fn new(
        group: &RayGroup,
        first: usize,
        least: &[f32; 8],
        greatest: &[f32; 8],
    ) -> Self {
        let splat = BlockLanes::splat;
        let middle = |k: usize| 0.5 * (least[k] + greatest[k]);
        let spread = |k: usize| {
            let off = (greatest[k] - middle(k)).max(middle(k) - least[k]);
            off * (1.0 + 4.0 * EPSILON)
        };
        Self {
            axes: AXES[group.axis[first] as usize % AXES.len()],
            origin: [splat(least[0]), splat(least[1]), splat(least[2])],
            slopes: [splat(middle(3)), splat(middle(4))],
            spread: [splat(spread(3)), splat(spread(4))],
            back: splat(group.back[first]),
            start: splat(least[5]),
        }
    }

    /// Returns the triangles of a block that some of the rays may hit before the depth `limit`.
    #[inline(always)]
    pub(super) fn test(&self, block: &TriangleBlock, limit: f32) -> Met {
        let [kx, ky, kz] = self.axes;
        let [xs, ys, zs] = [&block.coordinates[kx], &block.coordinates[ky], &block.coordinates[kz]];
        let to_origin =
            |v: usize| [self.origin[0] - xs[v], self.origin[1] - ys[v], self.origin[2] - zs[v]];
        let corners = [to_origin(0), to_origin(1), to_origin(2)];
        let vertex = |[x, y, z]: [BlockLanes; 3]| {
            [self.slopes[0].mul_neg_add(z, x), self.slopes[1].mul_neg_add(z, y), z]
        };
        let vertices @ [a, b, c] = [vertex(corners[0]), vertex(corners[1]), vertex(corners[2])];
        let splat = BlockLanes::splat;
        let greatest = |k: usize| {
            let [a, b, c] = vertices;
            a[k].abs().fast_max(b[k].abs()).fast_max(c[k].abs())
        };
        let (depth, [sx, sy]) = (greatest(2), self.spread);
        let off = greatest(0).fast_max(greatest(1)) + sx.fast_max(sy) * depth;
        let margin = (off * (off + depth)).mul_add(splat(64.0 * EPSILON), splat(triangle::MIN_DET));
        let edge = |p: [BlockLanes; 3], q: [BlockLanes; 3]| {
            let middle = q[0] * p[1] - q[1] * p[0];
            let by_x = (p[2] * q[1] - q[2] * p[1]).abs();
            let by_y = (q[2] * p[0] - p[2] * q[0]).abs();
            let range = sx.mul_add(by_x, sy.mul_add(by_y, margin));
            (middle - range, middle + range)
        };
        let [u, v, w] = [edge(b, c), edge(c, a), edge(a, b)];
        let passed = u.1.fast_min(v.1).fast_min(w.1).simd_lt(BlockLanes::ZERO)
            & u.0.fast_max(v.0).fast_max(w.0).simd_gt(BlockLanes::ZERO);
        let [za, zb, zc] = [a[2] * self.back, b[2] * self.back, c[2] * self.back];
        let within = za.fast_min(zb).fast_min(zc).simd_le(splat(limit))
            & za.fast_max(zb).fast_max(zc).simd_ge(self.start);
        Met { triangles: (within & !passed).to_bitmask(), corners, back: self.back }
    }
}

/// Triangles of a block that a fan of rays may hit.
pub(super) struct Met {
    /// Bit mask of the triangles.
    pub(super) triangles: u32,
    /// Vectors from the vertices to the origin, along the axes of the rays: vertex, axis.
    corners: [[BlockLanes; 3]; 3],
    back: BlockLanes,
}

/// A triangle, replicated eight times, in coordinates common to all rays of a fan.
pub(super) struct TriangleCorners {
    corners: [[BlockLanes; 3]; 3],
    depths: [BlockLanes; 3],
}

impl Met {
    /// Vectors from the vertices of the triangle in a lane to the origin: vertex, axis.
    #[inline(always)]
    pub(super) fn to_origin(&self, lane: usize) -> [[f32; 3]; 3] {
        self.corners.each_ref().map(|corner| corner.each_ref().map(|x| x.as_array()[lane % BLOCK]))
    }

    /// Triangle in a lane.
    #[inline(always)]
    pub(super) fn corners(&self, lane: usize) -> TriangleCorners {
        let corners @ [a, b, c] = self.to_origin(lane).map(|corner| corner.map(BlockLanes::splat));
        TriangleCorners { corners, depths: [a[2] * self.back, b[2] * self.back, c[2] * self.back] }
    }
}

impl TriangleCorners {
    /// Shears the triangle for eight rays with these slopes: the operations of
    /// [`Shear::filter`](crate::wide::triangles::Shear::filter).
    #[inline(always)]
    pub(super) fn shear(&self, slopes: [BlockLanes; 2]) -> ShearedTriangles {
        let vertex = |v: usize| {
            let [x, y, z] = self.corners[v];
            [slopes[0].mul_neg_add(z, x), slopes[1].mul_neg_add(z, y), self.depths[v]]
        };
        ShearedTriangles([vertex(0), vertex(1), vertex(2)])
    }
}

#[cfg(test)]
mod tests {
    use bytemuck::Zeroable;
    use pt_math::{Ray, Rays, Vec3};
    use pt_testing::Random;

    use super::super::packet::{PACKET, PacketBounds};
    use super::*;
    use crate::Geometry;
    use crate::ray::SceneExtent;
    use crate::wide::WIDTH;
    use crate::wide::collapse::triangle_block;

    /// Eight triangles that share vertices, and a packet from one origin towards one of these, or
    /// to points of an edge, or closely past them.
    fn scene(random: &mut Random, i: i32) -> (Vec<Vec3>, Vec<Ray>) {
        let size = 10f32.powi(-(i % 6));
        // Some are so small that products underflow.
        let unit = if i % 7 == 3 { 1e-21 } else { 1.0 };
        let off = unit * size * 10f32.powi(-(i % 9));
        let at = |offset: Vec3| (Vec3::ONE + offset * size) * unit;
        let origin = at(random.direction() * 10f32.powi(1 + i % 5));
        let positions: Vec<_> = (0..10).map(|_| at(random.in_cube())).collect();
        let [a, b] = [(); 2].map(|()| positions[random.below(positions.len())]);
        let rays = (0..PACKET).map(|_| {
            let target = if i % 2 == 0 { a } else { a + (b - a) * random.unit() };
            Ray::new(origin, target - origin + random.in_cube() * off)
        });
        let rays = rays.collect();
        (positions, rays)
    }

    #[test]
    fn no_triangle_is_left_out_that_a_ray_may_hit() {
        let mut random = Random::new(12);
        let mut group = Box::new(RayGroup::zeroed());
        let (mut fans, mut kept, mut left_out) = (0, 0, 0);
        for i in 0..400_000 {
            let (positions, rays) = scene(&mut random, i);
            let triangles: Vec<_> = (0..8).map(|k| [k, k + 1, k + 2]).collect();
            let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
            let scene = SceneExtent::new(&positions.iter().copied().collect());
            for first in (0..PACKET).step_by(WIDTH) {
                group.take(first, Rays::Rows(&rays), first, &scene);
            }
            let Some(beam) = PacketBounds::new::<PACKET>(&group, 0, &scene) else {
                continue;
            };
            fans += 1;
            let fan = beam.fan.as_ref().expect("the rays have one origin");
            let block = triangle_block(&geometry, std::array::from_fn(|k| k as u32));
            let met = fan.test(&block, f32::INFINITY).triangles;
            for (place, ray) in rays.iter().enumerate() {
                let (set, _) =
                    group.shear(place).filter_block(&block, BlockLanes::splat(f32::INFINITY));
                assert_eq!(set & !met, 0, "{i}: {ray:?} {positions:?}");
            }
            kept += met.count_ones();
            left_out += 8 - met.count_ones();
        }
        assert!(fans > 5_000 && kept > fans && left_out > fans, "{fans} {kept} {left_out}");
    }
}
