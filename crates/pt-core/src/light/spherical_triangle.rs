//! Spherical triangles: sampling of triangles by solid angle.

use pt_math::{Vec3, trig};

/// A triangle on the sphere of directions around a point p, with uniform sampling of its
/// directions. [Arvo 1995, "Stratified Sampling of Spherical Triangles"; without his angles, as in
/// Peters 2021, "BRDF Importance Sampling for Polygonal Lights"]
///
/// With unit vectors v₀, v₁, v₂ to the corners, the solid angle Ω satisfies
/// tan(Ω/2) = |v₀·(v₁×v₂)| / (1 + v₀·v₁ + v₁·v₂ + v₂·v₀). [Van Oosterom & Strackee 1983]
#[derive(Clone, Copy)]
pub(super) struct SphericalTriangle {
    v: [Vec3; 3],
    /// Distances to the corners.
    lengths: [f32; 3],
    /// |v₀·(v₁×v₂)|
    volume: f32,
    /// (v₀ + v₁)·v₂
    to_third: f32,
    /// 1 + v₀·v₁
    to_second: f32,
    /// v₀·v₂
    cos02: f32,
    /// Ω, or 0 if the triangle is seen edge-on.
    pub(super) solid_angle: f32,
}

/// Smallest squared height of the receiving point above the plane, relative to |e₁|² + |e₂|². At
/// this height, directions have errors of a hundredth of the triangle at worst, and solid angles of
/// 10⁻³, and far less for all but one in a thousand. Small or distant triangles need no such bound.
const MIN_HEIGHT: f32 = 1e-6;

impl SphericalTriangle {
    /// Creates the triangle with corners d₀, d₀ + e₁ and d₀ + e₂, relative to the receiving point.
    /// Without branches, as [`Self::sample`] is.
    #[inline(always)]
    pub(super) fn new(d0: Vec3, e1: Vec3, e2: Vec3) -> Self {
        let across = e1.cross(e2);
        let size_squared = e1.length_squared() + e2.length_squared();
        // From the height above the plane: the triple product of unit vectors cancels for small
        // triangles.
        let volume = d0.dot(across);
        let is_seen = volume * volume > MIN_HEIGHT * size_squared * across.length_squared();
        let d = [d0, d0 + e1, d0 + e2];
        let lengths = d.map(Vec3::length);
        let v = [d[0] / lengths[0], d[1] / lengths[1], d[2] / lengths[2]];
        let volume = (volume / (lengths[0] * lengths[1] * lengths[2])).abs();
        let between = v[0] + v[1];
        let to_third = between.dot(v[2]);
        let to_second = 0.5 * between.length_squared();
        let whole = 2.0 * trig::atan2(volume, to_second + to_third);
        let solid_angle = if is_seen { whole } else { 0.0 };
        let cos02 = v[0].dot(v[2]);
        Self { v, lengths, volume, to_third, to_second, cos02, solid_angle }
    }

    /// Returns the barycentric coordinates [b₁, b₂] of the point of the triangle in a direction
    /// that is uniform in solid angle, unless the triangle is seen edge-on.
    ///
    /// First samples x on the arc from v₀ to v₂, so that the triangle v₀, v₁, x has the fraction u₀
    /// of the solid angle. With h half way to it, x = 2 (v₀·h) h / |h|² − v₀, and the condition
    /// Ω' = u₀ Ω is linear in h: tan(Ω'/2) = |v₀·(v₁×h)| / ((v₀ + v₁)·h). Then samples a direction
    /// on the arc from v₁ to x, whose height above the plane with normal v₁ is uniform.
    #[inline(always)]
    pub(super) fn sample(&self, [u0, u1]: [f32; 2]) -> [f32; 2] {
        const TURNS_OF_HALF_RADIANS: f32 = 0.25 * std::f32::consts::FRAC_1_PI;
        let (sin, cos) = trig::sin_cos_tau(u0 * self.solid_angle * TURNS_OF_HALF_RADIANS);
        // h = α v₀ + β v₂
        let alpha = cos * self.volume - sin * self.to_third;
        let beta = sin * self.to_second;
        let along = alpha + beta * self.cos02;
        let scale = 1.0 / (alpha * along + beta * (beta + alpha * self.cos02));
        let x0 = ((alpha - beta) * (alpha + beta) * scale).max(0.0);
        let x2 = (2.0 * beta * along * scale).max(0.0);
        let [v0, v1, v2] = self.v;
        let x = v0 * x0 + v2 * x2;
        // 1 − v₁·x and 1 + v₁·x without cancellation.
        let (less, more) = (0.5 * (v1 - x).length_squared(), 0.5 * (v1 + x).length_squared());
        let down = u1 * less.min(2.0);
        let root = (u1 * (2.0 - down) / more).sqrt();
        let t = if more > 0.0 { root } else { u1 };
        let w1 = (1.0 - down - t * (1.0 - less)).max(0.0);
        // From unit vectors to corners.
        let [w0, w1, w2] =
            [t * x0 / self.lengths[0], w1 / self.lengths[1], t * x2 / self.lengths[2]];
        let sum = w0 + w1 + w2;
        [w1 / sum, w2 / sum]
    }
}

#[cfg(test)]
mod tests {
    use pt_math::DVec3;
    use pt_testing::Random;

    use super::*;

    /// Tall, flat and regular triangles, at z = 0.
    const TRIANGLES: [[Vec3; 2]; 3] = [
        [Vec3::X, Vec3::Y],
        [Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.02, 0.01, 0.0)],
        [Vec3::new(0.5, 0.1, 0.0), Vec3::new(-0.4, 1.3, 0.0)],
    ];

    fn seen(p: Vec3, e1: Vec3, e2: Vec3) -> Option<SphericalTriangle> {
        let seen = SphericalTriangle::new(-p, e1, e2);
        (seen.solid_angle > 0.0).then_some(seen)
    }

    fn solid_angle([a, b, c]: [DVec3; 3]) -> f64 {
        let [a, b, c] = [a, b, c].map(DVec3::normalize);
        2.0 * a.dot(b.cross(c)).abs().atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a))
    }

    /// Points above, beside and far from a triangle, displaced by a small part of their height.
    fn places(random: &mut Random) -> impl Iterator<Item = Vec3> + '_ {
        let heights = [5e-3f32, 0.02, 0.1, 1.0, 10.0, 300.0];
        let at = |&h: &f32| {
            [[0.3, 0.3], [0.5, 0.0], [-1.0, 0.4], [4.0, -3.0]].map(|[x, y]| Vec3::new(x, y, h))
        };
        let places: Vec<_> = heights.iter().flat_map(at).collect();
        places.into_iter().map(|p| p + 1e-3 * random.direction() * p.z)
    }

    #[test]
    fn nobody_sees_a_triangle_on_edge() {
        for p in [Vec3::new(0.3, 0.3, 1e-4), Vec3::X * 0.5, Vec3::ZERO, Vec3::new(5.0, 2.0, 0.0)] {
            assert!(seen(p, Vec3::X, Vec3::Y).is_none(), "{p}");
        }
        assert!(seen(-Vec3::Z, Vec3::X, Vec3::X).is_none());
    }

    #[test]
    fn solid_angles_have_their_digits() {
        for [e1, e2] in TRIANGLES {
            for p in places(&mut Random::new(2)) {
                let seen = seen(p, e1, e2).unwrap();
                let d = [Vec3::ZERO, e1, e2].map(|c| c.as_dvec3() - p.as_dvec3());
                let want = solid_angle(d);
                let error = f64::from(seen.solid_angle) / want - 1.0;
                assert!(error.abs() < 1e-4, "{e1} {e2} from {p}: {want} {error:e}");
            }
        }
    }

    /// The first random number is the fraction of the solid angle that is cut off by the arc from
    /// the second corner through the point.
    #[test]
    fn samples_cut_off_their_share() {
        for [e1, e2] in TRIANGLES {
            for p in places(&mut Random::new(3)) {
                let seen = seen(p, e1, e2).unwrap();
                let mut random = Random::new(4);
                for _ in 0..100 {
                    let u = random.unit_2d();
                    let [b1, b2] = seen.sample(u);
                    assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0 + 1e-6, "{b1} {b2}");
                    let [p, e1, e2] = [p, e1, e2].map(Vec3::as_dvec3);
                    let rest = 1.0 - f64::from(b1);
                    if rest < 1e-3 {
                        continue;
                    }
                    let x = e2 * (f64::from(b2) / rest);
                    let share =
                        solid_angle([-p, e1 - p, x - p]) / solid_angle([-p, e1 - p, e2 - p]);
                    let error = (share - f64::from(u[0])).abs();
                    assert!(error < 1e-3, "{e1} {e2} from {p}, {u:?}: {share}");
                }
            }
        }
    }
}
