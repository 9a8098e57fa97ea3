//! The Beckmann distribution of microfacets. [Walter et al. 2007, "Microfacet Models for
//! Refraction through Rough Surfaces", eq. 25 to 29; Heitz 2014, "Understanding the
//! Masking-Shadowing Function", §5]

use std::f32::consts::PI;

use pt_math::{Vec3, trig};

/// Isotropic Beckmann distribution of roughness α (root mean square slope times √2).
#[derive(Clone, Copy, Debug)]
pub struct Beckmann {
    /// Roughness, > 0.
    pub alpha: f32,
}

impl Beckmann {
    /// D(h) = exp(−tan²θ/α²) / (π α² cos⁴θ): area of facets per area of surface and steradian.
    #[inline]
    pub fn d(self, h: Vec3) -> f32 {
        let cos2 = h.z * h.z;
        let a2 = self.alpha * self.alpha;
        let area = PI * a2 * cos2 * cos2;
        if h.z <= 0.0 || area == 0.0 {
            return 0.0;
        }
        // Not 1 − cos²: near the normal that has lost the digits that a small α needs.
        let tan2 = (h.x * h.x + h.y * h.y) / cos2;
        trig::exp(-tan2 / a2) / area
    }

    /// Λ(w) = ½(erf(a) − 1 + exp(−a²)/(a√π)), a = 1/(α tan θ).
    #[inline]
    pub fn lambda(self, w: Vec3) -> f32 {
        let cos2 = w.z * w.z;
        let tan = ((1.0 - cos2).max(0.0) / cos2.max(f32::MIN_POSITIVE)).sqrt();
        if tan == 0.0 {
            return 0.0;
        }
        let a = 1.0 / (self.alpha * tan);
        0.5 * (trig::erf(a) - 1.0 + trig::exp(-a * a) / (a * PI.sqrt()))
    }

    /// Height-correlated masking and shadowing G = 1/(1 + Λ(wo) + Λ(wi)).
    #[inline]
    pub fn g(self, wo: Vec3, wi: Vec3) -> f32 {
        1.0 / (1.0 + self.lambda(wo) + self.lambda(wi))
    }

    /// A facet normal with density D(h) cos θ: tan²θ = −α² ln(1 − u), φ = 2πv.
    #[inline]
    pub fn sample(self, [u, v]: [f32; 2]) -> Vec3 {
        let tan2 = -self.alpha * self.alpha * trig::ln(1.0 - u);
        let cos = 1.0 / (1.0 + tan2).sqrt();
        let sin = (tan2 * cos * cos).sqrt();
        let (s, c) = trig::sin_cos_tau(v);
        Vec3::new(sin * c, sin * s, cos)
    }

    /// Density of [`Self::sample`].
    #[inline]
    pub fn pdf(self, h: Vec3) -> f32 {
        self.d(h) * h.z
    }
}
