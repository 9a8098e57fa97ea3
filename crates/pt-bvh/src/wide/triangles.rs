//! Triangle test for eight pairs of a ray and a triangle. The operations are those of [`triangle`],
//! so the hits have the same bits.

use pt_math::float_error::gamma;
use pt_math::{Vec3, Vec3A};

use super::{BLOCK, Lanes, TriangleBlock, lanes};
use crate::geometry::Hit;
use crate::triangle;

/// Ray in the form of the triangle filter; or a ray for each lane, if their axes are the same.
pub(super) struct Shear {
    pub(super) axes: [usize; 3],
    pub(super) origin: [Lanes; 3],
    pub(super) slopes: [Lanes; 2],
    /// −1 if the ray rises along the last axis, else 1.
    pub(super) back: Lanes,
    pub(super) start: Lanes,
}

impl Shear {
    #[inline(always)]
    pub(super) fn new(origin: Vec3, slopes: Vec3A, axes: [usize; 3], start: Lanes) -> Self {
        let [kx, ky, kz] = axes;
        let splat = Lanes::splat;
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
    pub(super) fn filter_block(&self, block: &TriangleBlock, limit: Lanes) -> (u32, Sheared) {
        self.filter(|axis| block.coordinates[axis], limit)
    }

    /// Filters eight triangles, whose vertices have the coordinates `along(k)` on axis k. Returns a
    /// bit mask of the lanes in which the f32 edge functions do not rule out a hit, and the
    /// vertices are not all before the start of the ray or all beyond the depth `limit`: the depth
    /// of a hit is a mean of theirs.
    #[inline(always)]
    pub(super) fn filter(
        &self,
        along: impl Fn(usize) -> [Lanes; 3],
        limit: Lanes,
    ) -> (u32, Sheared) {
        let [kx, ky, kz] = self.axes;
        let ([ax, bx, cx], [ay, by, cy], [az, bz, cz]) = (along(kx), along(ky), along(kz));
        let shear = |x: Lanes, y: Lanes, z: Lanes| {
            let z = self.origin[2] - z;
            let x = self.slopes[0].mul_neg_add(z, self.origin[0] - x);
            let y = self.slopes[1].mul_neg_add(z, self.origin[1] - y);
            [x, y, z * self.back]
        };
        let sheared = Sheared([shear(ax, ay, az), shear(bx, by, bz), shear(cx, cy, cz)]);
        (sheared.may_be_hit(self.start, limit), sheared)
    }
}

/// Sheared vertices of eight triangles, as in [`triangle::shear`]: vertex, axis.
pub(super) struct Sheared(pub(super) [[Lanes; 3]; 3]);

/// Results for eight pairs of a ray and a triangle in single precision, after the filter.
pub(super) struct Tested {
    /// Lanes with a hit.
    pub(super) hit: Lanes,
    /// Lanes in which double precision must decide.
    pub(super) unclear: Lanes,
    pub(super) t: Lanes,
    pub(super) barycentric: [Lanes; 2],
}

impl Sheared {
    /// Vertices in a lane, for [`triangle::confirm`].
    pub(super) fn triangle(&self, lane: usize) -> [[f32; 3]; 3] {
        self.0.map(|vertex| vertex.map(|x| x.as_array()[lane % BLOCK]))
    }

    /// Bit mask of the lanes in which neither the edge functions nor the depths of the vertices
    /// rule out a hit.
    #[inline(always)]
    pub(super) fn may_be_hit(&self, start: Lanes, limit: Lanes) -> u32 {
        let may_be_inside = same_signs(self.edges(|a, b, c, d| a * b - c * d)).simd_ge(Lanes::ZERO);
        let (nearest, farthest) = self.depths();
        let within = nearest.simd_le(limit) & farthest.simd_ge(start);
        (may_be_inside & within).to_bitmask()
    }

    /// Edge functions; `difference` computes a·b − c·d.
    #[inline(always)]
    fn edges(&self, difference: impl Fn(Lanes, Lanes, Lanes, Lanes) -> Lanes) -> [Lanes; 3] {
        let [a, b, c] = self.0;
        let edge = |p: [Lanes; 3], q: [Lanes; 3]| difference(q[0], p[1], q[1], p[0]);
        [edge(b, c), edge(c, a), edge(a, b)]
    }

    /// Least and greatest depth of the vertices.
    #[inline(always)]
    fn depths(&self) -> (Lanes, Lanes) {
        let [a, b, c] = self.0;
        (least([a[2], b[2], c[2]]), greatest([a[2], b[2], c[2]]))
    }

    /// Computes the hits. The operations are those of [`triangle::judge`].
    #[inline(always)]
    pub(super) fn test(&self, inverse_scale: Lanes, origin_size: Lanes) -> Tested {
        let splat = Lanes::splat;
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
        let plain = sides.simd_gt(Lanes::ZERO)
            & det.abs().simd_ge(least)
            & t.abs().simd_lt(splat(f32::INFINITY));

        let across = x + y;
        let margin = (origin_size + across + (z + z)) * gamma(32);
        let spread = z.mul_add(across, x * y * 4.0);
        let error = spread * z * inverse.abs() * gamma(32);
        let ahead = nearest.simd_gt(margin) | depth.simd_gt(error);
        let hit = plain & ahead & total.abs().simd_ge(least);
        let miss = sides.simd_lt(Lanes::ZERO) | (plain & depth.simd_lt(-error));
        let unclear = !(hit | miss);
        Tested { hit, unclear, t, barycentric: [v * inverse, w * inverse] }
    }
}

impl Tested {
    /// Hit of one lane.
    #[inline(always)]
    pub(super) fn in_lane(&self, lane: usize, ids: &[u32; BLOCK]) -> Hit {
        let number = |x: &Lanes| x.as_array()[lane % BLOCK];
        let [b1, b2] = &self.barycentric;
        Hit { t: number(&self.t), b1: number(b1), b2: number(b2), primitive: ids[lane % BLOCK] }
    }

    /// Returns true if there is a hit with t in (`t_min`, `t_max`) in a set of lanes.
    #[inline(always)]
    pub(super) fn any(&self, set: u32, t_min: f32, t_max: f32) -> bool {
        let counts = self.t.simd_gt(Lanes::splat(t_min)) & self.t.simd_lt(Lanes::splat(t_max));
        (self.hit & counts).to_bitmask() & set != 0
    }

    /// Lane of the nearest hit with t in (`t_min`, `t_max`] in a set of lanes, and of several the
    /// first.
    #[inline(always)]
    pub(super) fn nearest(&self, set: u32, t_min: f32, t_max: f32) -> Option<usize> {
        let counts = self.t.simd_gt(Lanes::splat(t_min)) & self.t.simd_le(Lanes::splat(t_max));
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
fn difference_of_products(a: Lanes, b: Lanes, c: Lanes, d: Lanes) -> Lanes {
    if triangle::IS_FUSED {
        let product = c * d;
        a.mul_sub(b, product) + c.mul_neg_add(d, product)
    } else {
        let [a, b, c, d] = [a, b, c, d].map(Lanes::to_array);
        let of_lane = |i| triangle::difference_of_products(a[i], b[i], c[i], d[i]);
        Lanes::new(std::array::from_fn(of_lane))
    }
}

/// Positive if three numbers have the same sign, negative if not; 0 if one is 0, or their products
/// underflow.
#[inline(always)]
fn same_signs(x: [Lanes; 3]) -> Lanes {
    least(x) * greatest(x)
}

#[inline(always)]
fn least([a, b, c]: [Lanes; 3]) -> Lanes {
    a.fast_min(b).fast_min(c)
}

#[inline(always)]
fn greatest([a, b, c]: [Lanes; 3]) -> Lanes {
    a.fast_max(b).fast_max(c)
}
