//! The watertight triangle test. [Woop, Benthin & Wald 2013, "Watertight Ray/Triangle
//! Intersection", JCGT 2(1)]
//!
//! Vertices are translated so that the ray starts at 0, and sheared so that it runs along kz; the
//! ray then hits if 0 is on the same side of all three edges in the plane.
//!
//! A filter takes fl(fl(c_x b_y) − fl(c_y b_x)) for an edge function: rounding is monotone, so its
//! sign is right whenever it is not 0. For triangles that pass, edge functions are computed with
//! compensation for the rounding of one product, fl(fl(c_x b_y − p) + fl(p − c_y b_x)) with p =
//! fl(c_y b_x), by Kahan's method. Its relative error is at most 2ε, ε = 2⁻²⁴ [Jeannerod, Louvet &
//! Muller 2013, "Further analysis of Kahan's algorithm for the accurate computation of 2×2
//! determinants", Math. Comp. 82]; and if products underflow its sign is still right or it is 0,
//! since c_x b_y − p is at least c_y b_x − p where c_x b_y is at least c_y b_x, and rounding is
//! monotone.
//!
//! So for needles and for triangles seen edge-on as well, the weights have a relative error of 4ε
//! and single precision gives the hit: its depth is a mean of the vertices' that errs by at most
//! 14ε of their largest, and its barycentric coordinates err by less than 10ε. If an edge function
//! is 0 (equal products, underflow), double precision decides, in which the products are exact. It
//! also decides if the depth is within its error of 0, since hits next to the origin must be as
//! reliable as others. The result is a function of ray and triangle alone, so every kernel gets the
//! same bits.

use pt_math::float_error::gamma;
use pt_math::{DVec3, Vec3};

use crate::ray::PreparedRay;

/// Hit of a ray on a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TriangleHit {
    pub(crate) t: f32,
    pub(crate) b1: f32,
    pub(crate) b2: f32,
}

/// Below this, products may have lost digits to underflow.
pub(crate) const MIN_DET: f32 = 1.0 / (1u128 << 100) as f32;

/// Result of the test in single precision.
pub(crate) enum FilterVerdict {
    Miss,
    Hit(TriangleHit),
    Unclear,
}

/// Intersection with one triangle, without regard to `t_min` and `t_max`.
#[inline]
pub(crate) fn intersect(ray: &PreparedRay, p: [Vec3; 3]) -> Option<TriangleHit> {
    let sheared = p.map(|v| shear(ray, v));
    match judge(ray, sheared) {
        FilterVerdict::Miss => None,
        FilterVerdict::Hit(hit) => Some(hit),
        FilterVerdict::Unclear => {
            let (origin, direction) = (ray.origin, ray.direction);
            confirm([origin, direction], ray.scale, sheared, p)
        }
    }
}

/// Intersection in single precision; the wide kernels do the same for many triangles.
///
/// A depth beyond δ is certainly ahead of the origin, as in [`depth_error`], but with rounded
/// weights: δ = (3·δe + γ₁₄|det|)·Z / |det| + δz with δe = 2(δx·Y + δy·X), and as |det| is at most
/// 4XY, δ is at most γ₃₂·Z·(4XY + Z(X + Y)) / |det|.
#[inline]
pub(crate) fn judge(ray: &PreparedRay, [a, b, c]: [[f32; 3]; 3]) -> FilterVerdict {
    let edge = |p: [f32; 3], q: [f32; 3]| difference_of_products(q[0], p[1], q[1], p[0]);
    let [u, v, w] = [edge(b, c), edge(c, a), edge(a, b)];
    let same_signs = u.min(v).min(w) * u.max(v).max(w);
    if same_signs < 0.0 {
        return FilterVerdict::Miss;
    }
    let x = a[0].abs().max(b[0].abs()).max(c[0].abs());
    let y = a[1].abs().max(b[1].abs()).max(c[1].abs());
    let (nearest, farthest) = (a[2].min(b[2]).min(c[2]), a[2].max(b[2]).max(c[2]));
    let z = farthest.max(-nearest);
    let det = u + v + w;
    let inverse = 1.0 / det;
    let total = mul_add(w, c[2], mul_add(v, b[2], u * a[2]));
    let depth = total * inverse;
    let t = depth * (1.0 / ray.scale);
    let is_plain = same_signs > 0.0 && det.abs() >= MIN_DET && t.abs() < f32::INFINITY;
    if !is_plain {
        return FilterVerdict::Unclear;
    }
    let across = x + y;
    let origin_size = ray.origin.abs().max_element();
    let is_distant = nearest > (origin_size + across + (z + z)) * gamma(32);
    let error = mul_add(z, across, x * y * 4.0) * z * inverse.abs() * gamma(32);
    if (is_distant || depth > error) && total.abs() >= MIN_DET {
        return FilterVerdict::Hit(TriangleHit { t, b1: v * inverse, b2: w * inverse });
    }
    if depth < -error { FilterVerdict::Miss } else { FilterVerdict::Unclear }
}

/// True if the vectors of the platform have fused multiply-add.
pub(crate) const IS_FUSED: bool = cfg!(any(
    all(target_feature = "avx", target_feature = "fma"),
    all(target_arch = "aarch64", target_feature = "neon")
));

/// x·y + z, with the rounding of the vectors of the platform.
#[inline]
fn mul_add(x: f32, y: f32, z: f32) -> f32 {
    if IS_FUSED { x.mul_add(y, z) } else { x * y + z }
}

/// a·b − c·d with a relative error of at most 2ε; see the module.
#[inline]
pub(crate) fn difference_of_products(a: f32, b: f32, c: f32, d: f32) -> f32 {
    if IS_FUSED {
        let product = c * d;
        a.mul_add(b, -product) + (-c).mul_add(d, product)
    } else {
        let [a, b, c, d] = [a, b, c, d].map(f64::from);
        (a * b - c * d) as f32
    }
}

/// Intersection in double precision, by origin, direction and scale of the ray. The side of the
/// edges is decided by the sheared f32 vertices, as everywhere; the depth in the plane by the
/// original `vertices`, since hits next to the origin must be as reliable as others.
///
/// If the ray passes inside only by the rounding of the sheared vertices, the depth in the plane is
/// arbitrary. Then the depth is the mean of the vertices' depths, and counts if it exceeds its
/// error; or if all vertices are ahead and so is the plane: a ray that leaves the triangle has the
/// plane behind it, but a ray that hits a closed mesh next to its origin must not pass through it.
#[inline(never)]
pub(crate) fn confirm(
    [origin, direction]: [Vec3; 2],
    scale: f32,
    sheared: [[f32; 3]; 3],
    vertices: [Vec3; 3],
) -> Option<TriangleHit> {
    let plane = Plane::met(origin, direction, vertices);
    if plane.t.is_some_and(|t| t <= 0.0) {
        return None; // mostly the triangle that the ray leaves
    }
    let [a, b, c] = sheared;
    let [u, v, w] = [edge(b, c), edge(c, a), edge(a, b)];
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let det = u + v + w;
    if det == 0.0 {
        return None;
    }
    let inverse = 1.0 / det;
    let depths @ [za, zb, zc] = [a[2], b[2], c[2]].map(f64::from);
    let is_between = |t: &f64| {
        let depth = t * f64::from(scale);
        depths.iter().any(|&z| z <= depth) && depths.iter().any(|&z| depth <= z)
    };
    let t = plane.t.filter(is_between).or_else(|| {
        let depth = (u * za + v * zb + w * zc) * inverse;
        let origin_size = origin.abs().max_element();
        let is_all_ahead = !plane.is_behind && depths.iter().all(|&z| z > 0.0);
        let counts = is_all_ahead || depth > depth_error(origin_size, sheared, det);
        counts.then(|| depth / f64::from(scale))
    })?;
    let (b1, b2) = ((v * inverse) as f32, (w * inverse) as f32);
    // Queries begin at the least normal depth.
    let is_ahead = t * f64::from(scale) > 2.0 * f64::from(f32::MIN_POSITIVE);
    is_ahead.then_some(TriangleHit { t: t as f32, b1, b2 })
}

/// Plane of a triangle in double precision, as seen by a ray.
struct Plane {
    /// Parameter of the intersection, if the ray hits the triangle in double precision as well. The
    /// point is then within εR of the triangle, R being the distance to its farthest vertex: with
    /// u = 2⁻⁵³ and c the least slope, the point errs by some uR/c, and beyond the tip of a needle
    /// the edge tests accept it for 1/c as far.
    t: Option<f64>,
    /// True if the ray moves away from the plane.
    is_behind: bool,
}

impl Plane {
    fn met(origin: Vec3, direction: Vec3, vertices: [Vec3; 3]) -> Self {
        let (o, d) = (origin.as_dvec3(), direction.as_dvec3());
        let corners @ [a, b, c] = vertices.map(|p| p.as_dvec3() - o);
        let edges = [b - a, c - b, a - c];
        // The normal is computed from the two shortest edges, for the least error.
        let lengths = edges.map(DVec3::length_squared);
        let longest = if lengths[0] >= lengths[1].max(lengths[2]) {
            0
        } else if lengths[1] >= lengths[2] {
            1
        } else {
            2
        };
        let [e, f] = [(longest + 1) % 3, (longest + 2) % 3];
        let normal = edges[e].cross(edges[f]);
        let (slope, height) = (normal.dot(d), normal.dot(a));
        let least = MIN_SLOPE * MIN_SLOPE * lengths[e] * lengths[f] * d.length_squared();
        let is_clear = slope * slope > least;
        let t = height / slope;
        let is_left =
            |(edge, corner): (DVec3, DVec3)| edge.cross(d * t - corner).dot(normal) >= 0.0;
        let is_met = is_clear && edges.into_iter().zip(corners).all(is_left);
        Self { t: is_met.then_some(t), is_behind: t < 0.0 }
    }
}

/// Below this slope, or ratio of area to the lengths of the two shortest edges, the rounding of
/// double precision moves the intersection too far.
const MIN_SLOPE: f64 = 1e-4;

/// Vector from the vertex to the ray, across it along two axes; and the vertex's depth.
#[inline]
pub(crate) fn shear(ray: &PreparedRay, p: Vec3) -> [f32; 3] {
    let q = (ray.origin - p).to_array();
    let [kx, ky, kz] = ray.axes;
    let slopes = ray.slopes.to_array();
    let across = |k: usize| mul_add(-(slopes[k] * slopes[kz]), q[kz], q[k]);
    [across(kx), across(ky), q[kz] * -slopes[kz]]
}

/// Edge function q × p in the plane, with the exact sign.
#[inline]
fn edge(p: [f32; 3], q: [f32; 3]) -> f64 {
    f64::from(q[0]) * f64::from(p[1]) - f64::from(q[1]) * f64::from(p[0])
}

/// Bound δ of the error of the mean depth: only a hit beyond it is certainly ahead of the origin.
/// [Pharr, Jakob & Humphreys, Physically Based Rendering, 3rd ed., §3.9.6, without the rounding of
/// the edge functions, which are in double precision here]
///
/// With X, Y, Z the largest magnitudes of the sheared coordinates: the error of x is δx = γ₅(X +
/// Z), of y δy = γ₅(Y + Z), of z δz = γ₂Z, of an edge function δe = 2(δx·Y + δy·X + δx·δy), and of
/// the depth δ = 3·δe·(Z + δz) / |det| + δz.
///
/// For small distant triangles this exceeds the distance itself, and they would vanish. But the
/// depth is a mean of those of the vertices: if all three are ahead by more than the offset of a
/// spawned origin and its rounding, the error does not matter, and δ is 0.
fn depth_error(origin_size: f32, [a, b, c]: [[f32; 3]; 3], det: f64) -> f64 {
    let largest = |i: usize| a[i].abs().max(b[i].abs()).max(c[i].abs());
    let [x, y, z] = [largest(0), largest(1), largest(2)];
    let nearest = a[2].min(b[2]).min(c[2]);
    if nearest > gamma(32) * (origin_size + x + y + 2.0 * z) {
        return 0.0;
    }
    let [x, y, z] = [x, y, z].map(f64::from);
    let (dx, dy) = (f64::from(gamma(5)) * (x + z), f64::from(gamma(5)) * (y + z));
    let dz = f64::from(gamma(2)) * z;
    let de = 2.0 * (dx * y + dy * x + dx * dy);
    3.0 * de * (z + dz) / det.abs() + dz
}

/// Position of a ray relative to the edges of a triangle, independent of the depth.
#[cfg(test)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum EdgeSide {
    Outside,
    /// An edge function is 0, and the others do not rule out a hit.
    Edge,
    /// All edge functions are above 0.
    Positive,
    /// All edge functions are below 0: the opposite orientation.
    Negative,
}

/// Side by the signs of the edge functions.
#[cfg(test)]
pub(crate) fn side(ray: &PreparedRay, p: [Vec3; 3]) -> EdgeSide {
    let [a, b, c] = p.map(|v| shear(ray, v));
    let edges = [edge(b, c), edge(c, a), edge(a, b)];
    let (negative, positive) = (edges.iter().any(|&e| e < 0.0), edges.iter().any(|&e| e > 0.0));
    match (negative, positive) {
        (true, true) => EdgeSide::Outside,
        _ if edges.contains(&0.0) => EdgeSide::Edge,
        (true, false) => EdgeSide::Negative,
        _ => EdgeSide::Positive,
    }
}

#[cfg(test)]
mod tests {
    use pt_math::{Bounds3, Ray};

    use super::*;

    fn prepared(o: Vec3, d: Vec3, p: &[Vec3]) -> PreparedRay {
        let scene: Bounds3 = p.iter().copied().collect();
        PreparedRay::new(&Ray::new(o, d), &scene).expect("a usable ray")
    }

    #[test]
    fn a_distant_small_triangle_is_hit() {
        let z = 1e6;
        let p = [Vec3::new(-0.5, -0.5, z), Vec3::new(0.5, -0.5, z), Vec3::new(0.0, 0.5, z)];
        let hit = intersect(&prepared(Vec3::ZERO, Vec3::Z, &p), p).expect("it is straight ahead");
        assert_eq!(hit.t, z);
        assert_eq!((hit.b1, hit.b2), (0.25, 0.5));
    }

    #[test]
    fn depth_does_not_depend_on_the_length_of_the_direction() {
        let p = [Vec3::new(-1.0, -1.0, 3.0), Vec3::new(2.0, -1.0, 4.0), Vec3::new(0.0, 2.0, 5.0)];
        let d = Vec3::new(0.1, -0.05, 1.0);
        let hit = |k: f32| intersect(&prepared(Vec3::ZERO, d * k, &p), p).expect("ahead");
        for k in [2f32.powi(-100), 2f32.powi(-70), 2f32.powi(70), 2f32.powi(100)] {
            assert_eq!(hit(k).t * k, hit(1.0).t, "{k}");
        }
    }
}
