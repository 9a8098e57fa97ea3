//! The clear coat of principled materials: a thin specular layer with long tails.

use std::f32::consts::PI;

use pt_math::{FloatExt, Vec3, trig};
use pt_scene::material::{Distribution, Masking};

use crate::bsdf::fresnel::schlick_weight;
use crate::bsdf::microfacet::MicrofacetDistribution;

/// A coat of index 1.5, with facets distributed as D ∝ 1 / (sin²θ + α² cos²θ), and the masking of
/// GGX with α = ¼. [Burley 2012, "Physically Based Shading at Disney", §5.4 and appendix B.2]
#[derive(Clone, Copy, Debug)]
pub(super) struct Clearcoat {
    alpha2: f32,
}

/// Masking and shadowing of microfacets.
const HIDING: MicrofacetDistribution = MicrofacetDistribution {
    distribution: Distribution::Ggx,
    masking: Masking::Separable,
    alpha: [0.25; 2],
};

impl Clearcoat {
    /// Creates a coat of a gloss from 0, satin, to 1, glossy.
    #[inline]
    pub(super) fn new(gloss: f32) -> Self {
        let alpha = 0.1f32.lerp(0.001, gloss);
        Self { alpha2: alpha * alpha }
    }

    /// Roughness α of the facets.
    #[inline]
    pub(super) fn alpha(self) -> f32 {
        self.alpha2.sqrt()
    }

    /// D(h).
    #[inline]
    fn d(self, h: Vec3) -> f32 {
        // Not by 1 − cos²: near the normal it has lost the digits that a small α needs.
        let width = h.x * h.x + h.y * h.y + self.alpha2 * h.z * h.z;
        (self.alpha2 - 1.0) / (PI * trig::ln(self.alpha2) * width)
    }

    /// F D G / 4 · cos θi for two directions above the surface with half vector `h`, without the
    /// cosines in the denominator of microfacet models, as Mitsuba 3 interprets the paper. `weight`
    /// is Schlick's.
    #[inline]
    pub(super) fn eval(self, weight: f32, wo: Vec3, wi: Vec3, h: Vec3) -> f32 {
        0.25 * fresnel(weight) * self.d(h) * HIDING.g(wo, wi) * wi.z
    }

    /// Density of `wi` by [`Self::sample`]: D(h) cos θh / (4 wo·h).
    #[inline]
    pub(super) fn pdf(self, wo: Vec3, h: Vec3) -> f32 {
        self.d(h) * h.z / (4.0 * wo.dot(h))
    }

    /// Samples a facet by D(h) cos θh. [Burley 2012, appendix B.2]
    #[inline]
    pub(super) fn sample(self, [u, v]: [f32; 2]) -> Vec3 {
        let sin2 = (trig::powf(self.alpha2, u) - self.alpha2) / (1.0 - self.alpha2);
        let (sin, cos) = (sin2.max(0.0).sqrt(), (1.0 - sin2).max(0.0).sqrt());
        let (s, c) = trig::sin_cos_tau(v);
        Vec3::new(sin * c, sin * s, cos)
    }

    /// Approximate directional albedo.
    #[inline]
    pub(super) fn albedo(cos: f32) -> f32 {
        fresnel(schlick_weight(cos)) * cos * cos
    }
}

/// Fresnel reflectance for index 1.5.
#[inline]
fn fresnel(weight: f32) -> f32 {
    0.04.lerp(1.0, weight)
}
