//! Triangle test for eight pairs of a ray and a triangle. The operations are those of [`triangle`],
//! so the hits have the same bits.

use pt_math::float_error::gamma;
use pt_math::{Vec3, Vec3A};

use super::{BLOCK, BlockLanes, TriangleBlock, lanes};
use crate::geometry::Hit;
use crate::triangle;

/// Ray in the form of the triangle filter; or a ray for each lane, if their axes are the same.
pub(super) struct Shear {
    pub(super) axes: [usize; 3],
    pub(super) origin: [BlockLanes; 3],
    pub(super) slopes: [BlockLanes; 2],
    /// −1 if the ray rises along the last axis, else 1.
    pub(super) back: BlockLanes,
    pub(super) start: BlockLanes,
}

impl Shear {
    #[inline(always)]
    pub(super) fn new(origin: Vec3, slopes: Vec3A, axes: [usize; 3], start: BlockLanes) -> Self {
        let [kx, ky, kz] = axes;
        let splat = BlockLanes::splat;
        let [o, s] = [origin.to_array(), slopes.to_array()];
        let sign = splat(s[kz]);
        Self {
            axes,
            origin: [splat(o[kx]), splat(o[ky]), splat(o[kz])],
            slopes: [splat(s[kx]) * sign, splat(s[ky]) * sign],
            back: -sign,
            start,
        }
    }

    /// Filters a block: bit mask of the triangles that the ray may hit; see [`Self::filter`].
    #[inline(always)]
    pub(super) fn filter_block(
        &self,
        block: &TriangleBlock,
        limit: BlockLanes,
    ) -> (u32, ShearedTriangles) {
        self.filter(|axis| block.coordinates[axis], limit)
    }

    /// Filters eight triangles, whose vertices have the coordinates `along(k)` on axis k. Returns a
    /// bit mask of the lanes in which the f32 edge functions do not rule out a hit, and the
    /// vertices are not all before the start of the ray or all beyond the depth `limit`: the depth
    /// of a hit is a mean of theirs.
    #[inline(always)]
    pub(super) fn filter(
        &self,
        along: impl Fn(usize) -> [BlockLanes; 3],
        limit: BlockLanes,
    ) -> (u32, ShearedTriangles) {
        let [kx, ky, kz] = self.axes;
        let ([ax, bx, cx], [ay, by, cy], [az, bz, cz]) = (along(kx), along(ky), along(kz));
        let shear = |x: BlockLanes, y: BlockLanes, z: BlockLanes| {
            let z = self.origin[2] - z;
            let x = self.slopes[0].mul_neg_add(z, self.origin[0] - x);
            let y = self.slopes[1].mul_neg_add(z, self.origin[1] - y);
            [x, y, z * self.back]
        };
        let sheared = ShearedTriangles([shear(ax, ay, az), shear(bx, by, bz), shear(cx, cy, cz)]);
        (sheared.may_be_hit(self.start, limit), sheared)
    }
}

/// Sheared vertices of eight triangles, as in [`triangle::shear`]: vertex, axis.
pub(super) struct ShearedTriangles(pub(super) [[BlockLanes; 3]; 3]);

/// Results for eight pairs of a ray and a triangle in single precision, after the filter.
pub(super) struct BlockTest {
    /// Lanes with a hit.
    pub(super) hit: BlockLanes,
    /// Lanes in which double precision must decide.
    pub(super) unclear: BlockLanes,
    pub(super) t: BlockLanes,
    pub(super) barycentric: [BlockLanes; 2],
}

impl ShearedTriangles {
    /// Vertices in a lane, for [`triangle::confirm`].
    pub(super) fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        self.0.map(|vertex| vertex.map(|x| x.as_array()[lane % BLOCK]))
    }

    /// Bit mask of the lanes in which neither the edge functions nor the depths of the vertices
    /// rule out a hit.
    #[inline(always)]
    pub(super) fn may_be_hit(&self, start: BlockLanes, limit: BlockLanes) -> u32 {
        let may_be_inside =
            same_signs(self.edges(|a, b, c, d| a * b - c * d)).simd_ge(BlockLanes::ZERO);
        let (nearest, farthest) = self.depths();
        let within = nearest.simd_le(limit) & farthest.simd_ge(start);
        (may_be_inside & within).to_bitmask()
    }

    /// Edge functions; `difference` computes a·b − c·d.
    #[inline(always)]
    fn edges(
        &self,
        difference: impl Fn(BlockLanes, BlockLanes, BlockLanes, BlockLanes) -> BlockLanes,
    ) -> [BlockLanes; 3] {
        let [a, b, c] = self.0;
        let edge = |p: [BlockLanes; 3], q: [BlockLanes; 3]| difference(q[0], p[1], q[1], p[0]);
        [edge(b, c), edge(c, a), edge(a, b)]
    }

    /// Least and greatest depth of the vertices.
    #[inline(always)]
    fn depths(&self) -> (BlockLanes, BlockLanes) {
        let [a, b, c] = self.0;
        (least([a[2], b[2], c[2]]), greatest([a[2], b[2], c[2]]))
    }

    /// Computes the hits. The operations are those of [`triangle::judge`].
    #[inline(always)]
    pub(super) fn test(&self, inverse_scale: BlockLanes, origin_size: BlockLanes) -> BlockTest {
        let splat = BlockLanes::splat;
        let [a, b, c] = self.0;
        let edges @ [u, v, w] = self.edges(difference_of_products);
        let x = greatest([a[0].abs(), b[0].abs(), c[0].abs()]);
        let y = greatest([a[1].abs(), b[1].abs(), c[1].abs()]);
        let (nearest, farthest) = self.depths();
        let z = farthest.fast_max(-nearest);
        let det = u + v + w;
        let inverse = splat(1.0) / det;
        let total = w.mul_add(c[2], v.mul_add(b[2], u * a[2]));
        let depth = total * inverse;
        let t = depth * inverse_scale;
        let (least, sides) = (splat(triangle::MIN_DET), same_signs(edges));
        let plain = sides.simd_gt(BlockLanes::ZERO)
            & det.abs().simd_ge(least)
            & t.abs().simd_lt(splat(f32::INFINITY));

        let across = x + y;
        let margin = (origin_size + across + (z + z)) * gamma(32);
        let spread = z.mul_add(across, x * y * 4.0);
        let error = spread * z * inverse.abs() * gamma(32);
        let ahead = nearest.simd_gt(margin) | depth.simd_gt(error);
        let hit = plain & ahead & total.abs().simd_ge(least);
        let miss = sides.simd_lt(BlockLanes::ZERO) | (plain & depth.simd_lt(-error));
        let unclear = !(hit | miss);
        BlockTest { hit, unclear, t, barycentric: [v * inverse, w * inverse] }
    }
}

impl BlockTest {
    /// Hit of one lane.
    #[inline(always)]
    pub(super) fn in_lane(&self, lane: usize, ids: &[u32; BLOCK]) -> Hit {
        let number = |x: &BlockLanes| x.as_array()[lane % BLOCK];
        let [b1, b2] = &self.barycentric;
        Hit { t: number(&self.t), b1: number(b1), b2: number(b2), primitive: ids[lane % BLOCK] }
    }

    /// Returns true if there is a hit with t in (`t_min`, `t_max`) in a set of lanes.
    #[inline(always)]
    pub(super) fn any(&self, set: u32, t_min: f32, t_max: f32) -> bool {
        let counts =
            self.t.simd_gt(BlockLanes::splat(t_min)) & self.t.simd_lt(BlockLanes::splat(t_max));
        (self.hit & counts).to_bitmask() & set != 0
    }

    /// Lane of the nearest hit with t in (`t_min`, `t_max`] in a set of lanes, and of several the
    /// first.
    #[inline(always)]
    pub(super) fn nearest(&self, set: u32, t_min: f32, t_max: f32) -> Option<usize> {
        let counts =
            self.t.simd_gt(BlockLanes::splat(t_min)) & self.t.simd_le(BlockLanes::splat(t_max));
        let hits = (self.hit & counts).to_bitmask() & set;
        if hits & hits.wrapping_sub(1) == 0 {
            return (hits != 0).then(|| hits.trailing_zeros() as usize);
        }
        let t = self.t.as_array();
        lanes(hits).min_by(|a, b| t[a % BLOCK].total_cmp(&t[b % BLOCK]))
    }
}

/// [`triangle::difference_of_products`] of eight numbers.
#[inline(always)]
fn difference_of_products(
    a: BlockLanes,
    b: BlockLanes,
    c: BlockLanes,
    d: BlockLanes,
) -> BlockLanes {
    if triangle::IS_FUSED {
        let product = c * d;
        a.mul_sub(b, product) + c.mul_neg_add(d, product)
    } else {
        let [a, b, c, d] = [a, b, c, d].map(BlockLanes::to_array);
        let of_lane = |i| triangle::difference_of_products(a[i], b[i], c[i], d[i]);
        BlockLanes::new(std::array::from_fn(of_lane))
    }
}

/// Positive if three numbers have the same sign, negative if not; 0 if one is 0, or their products
/// underflow.
#[inline(always)]
fn same_signs(x: [BlockLanes; 3]) -> BlockLanes {
    least(x) * greatest(x)
}

#[inline(always)]
fn least([a, b, c]: [BlockLanes; 3]) -> BlockLanes {
    a.fast_min(b).fast_min(c)
}

#[inline(always)]
fn greatest([a, b, c]: [BlockLanes; 3]) -> BlockLanes {
    a.fast_max(b).fast_max(c)
}
