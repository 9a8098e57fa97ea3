//! Microfacet distributions and the sampling of visible facets. [Walter et al. 2007, "Microfacet
//! Models for Refraction through Rough Surfaces"; Heitz 2014, "Understanding the Masking-Shadowing
//! Function in Microfacet-Based BRDFs"]

use std::f32::consts::PI;

use pt_math::{Vec3, trig};
use pt_scene::material::{Distribution, Masking};

/// Microfacets of a surface, in the frame of its normal, +z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MicrofacetDistribution {
    /// Distribution of the normals.
    pub distribution: Distribution,
    /// Masking-shadowing function.
    pub masking: Masking,
    /// Roughness α > 0 along x and y (of Beckmann slopes: root mean square slope times √2).
    pub alpha: [f32; 2],
}

impl MicrofacetDistribution {
    /// Creates facets of equal roughness in all directions.
    pub fn isotropic(distribution: Distribution, alpha: f32) -> Self {
        Self { distribution, masking: Masking::Correlated, alpha: [alpha; 2] }
    }

    /// Facets of another roughness, equal in all directions.
    #[cfg(test)]
    pub(super) fn with_alpha(self, alpha: f32) -> Self {
        Self { alpha: [alpha; 2], ..self }
    }

    /// Number of the combination of distribution and masking, from 0 to 3.
    #[inline]
    pub(super) fn kind(&self) -> usize {
        (self.distribution == Distribution::Ggx) as usize
            + 2 * (self.masking == Masking::Separable) as usize
    }

    /// Calls `f` with these facets; with distribution and masking as constants for GGX, whose
    /// formulas have no branches.
    #[inline(always)]
    pub(super) fn specialized(self, mut f: impl FnMut(Self)) {
        match self {
            Self { distribution: Distribution::Ggx, masking: Masking::Correlated, alpha } => {
                f(Self { distribution: Distribution::Ggx, masking: Masking::Correlated, alpha });
            }
            Self { distribution: Distribution::Ggx, masking: Masking::Separable, alpha } => {
                f(Self { distribution: Distribution::Ggx, masking: Masking::Separable, alpha });
            }
            Self { distribution: Distribution::Beckmann, .. } => f(self),
        }
    }

    /// Lobe width, the angle by which facet normals vary; see
    /// [`Lobe::lobe_width`](super::Lobe::lobe_width).
    #[inline]
    pub(super) fn spread(&self) -> f32 {
        self.alpha[0].min(self.alpha[1])
    }

    /// Packs the parameters into three numbers.
    #[inline]
    pub(super) fn pack(&self) -> [f32; 3] {
        [self.alpha[0], self.alpha[1], self.kind() as f32]
    }

    /// Inverse of [`Self::pack`].
    #[inline]
    pub(super) fn unpack(p: [f32; 3]) -> Self {
        let kind = p[2] as u32;
        Self {
            distribution: if kind & 1 == 0 { Distribution::Beckmann } else { Distribution::Ggx },
            masking: if kind & 2 == 0 { Masking::Correlated } else { Masking::Separable },
            alpha: [p[0], p[1]],
        }
    }

    /// D(h): area of facets with normal h, per area of surface and steradian. [Walter et al. 2007,
    /// eq. 25 and 33; with two roughnesses Heitz 2014, §5]
    #[inline(always)]
    pub fn d(&self, h: Vec3) -> f32 {
        let [ax, ay] = self.alpha;
        let across = (h.x / ax).powi(2) + (h.y / ay).powi(2);
        let cos2 = h.z * h.z;
        let d = match self.distribution {
            // Not by 1 − cos²: near the normal it has lost the digits that a small α needs.
            Distribution::Beckmann => trig::exp(-across / cos2) / (PI * ax * ay * cos2 * cos2),
            Distribution::Ggx => 1.0 / (PI * ax * ay * (across + cos2).powi(2)),
        };
        if h.z > 0.0 && d.is_finite() { d } else { 0.0 }
    }

    /// Λ(w): area of the facets masked from w over that of the visible ones. [Heitz 2014, §5]
    #[inline(always)]
    pub fn lambda(&self, w: Vec3) -> f32 {
        let [x, y] = [w.x * self.alpha[0], w.y * self.alpha[1]];
        // 1/a², where a is the slope of w over the roughness in its direction.
        let inverse2 = (x * x + y * y) / (w.z * w.z).max(f32::MIN_POSITIVE);
        match self.distribution {
            Distribution::Beckmann if inverse2 == 0.0 => 0.0,
            Distribution::Beckmann => {
                let a = 1.0 / inverse2.sqrt();
                (0.5 * (trig::erf(a) - 1.0 + trig::exp(-a * a) / (a * PI.sqrt()))).max(0.0)
            }
            // ½(√(1 + 1/a²) − 1), without cancellation.
            Distribution::Ggx => 0.5 * inverse2 / (1.0 + (1.0 + inverse2).sqrt()),
        }
    }

    /// G₁(w) = 1/(1 + Λ(w)): the fraction of facets visible from w.
    #[inline(always)]
    pub fn g1(&self, w: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(w))
    }

    /// G(wo, wi): the fraction of facets visible from both directions.
    #[inline(always)]
    pub fn g(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self.masking {
            Masking::Correlated => 1.0 / (1.0 + self.lambda(wo) + self.lambda(wi)),
            Masking::Separable => self.g1(wo) * self.g1(wi),
        }
    }

    /// G(wo, wi) / G₁(wo): the weight of facets sampled by their visibility from `wo`.
    #[inline(always)]
    pub fn shadowing(&self, wo: Vec3, wi: Vec3) -> f32 {
        match self.masking {
            Masking::Correlated => {
                let seen = 1.0 + self.lambda(wo);
                seen / (seen + self.lambda(wi))
            }
            Masking::Separable => self.g1(wi),
        }
    }

    /// Samples a facet visible from `wo` (above the surface), with the density
    /// [`Self::visible_pdf`].
    #[inline(always)]
    pub fn sample_visible(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        let [ax, ay] = self.alpha;
        // Transforms the surface to one of roughness 1.
        let w = Vec3::new(wo.x * ax, wo.y * ay, wo.z).normalize();
        let h = match self.distribution {
            Distribution::Beckmann => visible_of_beckmann(w, u),
            Distribution::Ggx => visible_of_ggx(w, u),
        };
        Vec3::new(h.x * ax, h.y * ay, h.z).normalize()
    }

    /// D(h) G₁(wo) (wo·h)⁺ / cos θo. [Heitz & d'Eon 2014, "Importance Sampling Microfacet-Based
    /// BSDFs using the Distribution of Visible Normals"]
    #[inline]
    pub fn visible_pdf(&self, wo: Vec3, h: Vec3) -> f32 {
        self.d(h) * self.g1(wo) * wo.dot(h).max(0.0) / wo.z
    }

    /// Mean of a function of direction and facet over the visible facets, for a direction in the
    /// plane of x and z with this cosine, by n × n facets.
    pub(super) fn mean_of_visible(&self, cos: f32, n: u16, of: impl Fn(Vec3, Vec3) -> f32) -> f32 {
        let wo = Vec3::new(((1.0 - cos) * (1.0 + cos)).max(0.0).sqrt(), 0.0, cos.max(1e-6));
        // Midpoints, dense towards the ends, where the map to facets is steep.
        let middle = |i: u16| {
            let t = (f32::from(i) + 0.5) / f32::from(n);
            (t * t * (3.0 - 2.0 * t), t * (1.0 - t))
        };
        let (mut sum, mut whole) = (0.0, 0.0);
        for (u, du) in (0..n).map(middle) {
            // The other half is the mirror image.
            for (v, dv) in (0..n / 2).map(middle) {
                let h = self.sample_visible(wo, [u, v]);
                sum += of(wo, h) * du * dv;
                whole += du * dv;
            }
        }
        sum / whole
    }
}

/// Maps a cosine from 1 at the normal to 0, and from 0 at grazing angles to 1, with half of the
/// range at angles of strong masking; its own inverse.
#[inline]
pub(super) fn stretched(cos: f32, alpha: f32) -> f32 {
    let k = 1.5 * alpha * (1.0 + alpha);
    k * (1.0 - cos) / (k + cos)
}

/// Samples a visible facet, not of unit length, of a GGX surface of roughness 1: these are the
/// normals at which a sphere reflects `w` into the cap of directions above −w.z. [Dupuy & Benyoub
/// 2023, "Sampling Visible GGX Normals with Spherical Caps"]
#[inline(always)]
fn visible_of_ggx(w: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    let above = (1.0 - u) * (1.0 + w.z);
    let z = above - w.z;
    let sin = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
    let (s, c) = trig::sin_cos_tau(v);
    Vec3::new(sin * c + w.x, sin * s + w.y, above.max(f32::MIN_POSITIVE))
}

/// Samples a visible facet, not of unit length, of a Beckmann surface of roughness 1.
///
/// Slopes across the plane of `w` are normally distributed; along it, the density of slope q
/// towards `w` is (cos θ + q sin θ)⁺ exp(−q²). [Heitz & d'Eon 2014; solved as by Jakob 2014, "An
/// Improved Visible Normal Sampling Routine for the Beckmann Distribution", in x = erf q]
#[inline(never)]
fn visible_of_beckmann(w: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    let sin = (w.x * w.x + w.y * w.y).sqrt();
    let along = slope_towards(w.z, sin, u);
    let across = trig::erf_inv(2.0 * v - 1.0);
    let (c, s) = if sin > 0.0 { (w.x / sin, w.y / sin) } else { (1.0, 0.0) };
    Vec3::new(c * along - s * across, s * along + c * across, 1.0)
}

/// Finds the q for which the integral of (cos θ + q sin θ) exp(−q²)/√π from −cot θ to q is the
/// fraction `u` of the whole.
///
/// In x = erf q it is ½ cos θ (x − x₀) + sin θ (exp(−cot²θ) − exp(−q²)) / 2√π: convex, with slope
/// ½(cos θ + q sin θ). Newton's method therefore overshoots the solution at most once, and then
/// converges from there.
#[inline]
fn slope_towards(cos: f32, sin: f32, u: f32) -> f32 {
    const STEPS: usize = 12;
    let cot = if sin > 0.0 { (cos / sin).min(6.0) } else { 6.0 };
    let (least, sin) = (-trig::erf(cot), sin / PI.sqrt());
    let first = sin * trig::exp(-cot * cot);
    let whole = cos * (1.0 - least) + first;
    let mut x = least + (1.0 - least) * u;
    let mut q = trig::erf_inv(x);
    for _ in 0..STEPS {
        // Twice the difference of the integral and its target, and twice its slope.
        let excess = cos * (x - least) + (first - sin * trig::exp(-q * q)) - u * whole;
        let slope = cos + q * sin * PI.sqrt();
        let next = x - excess / slope;
        // Beyond the end: bisects.
        let next = if next < 1.0 { next.max(least) } else { 0.5 * (x + 1.0) };
        let step = (next - x).abs();
        x = next;
        q = trig::erf_inv(x);
        if step <= 1e-6 {
            break;
        }
    }
    q
}
