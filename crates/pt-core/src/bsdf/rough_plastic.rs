//! A diffuse base under a rough specular layer.

use std::f32::consts::FRAC_1_PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
use pt_scene::material::Distribution;

use super::conductor::{half_vector, reflected};
#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::MicrofacetDistribution;
use super::over_base::OverBase;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// f = (1 − F(θo)) (1 − F(θi)) ρ/π + F(h) D G / (4 cos θo cos θi), F by Schlick.
///
/// Light reflected by the specular layer does not reach the base, on entering and on leaving, so
/// that no energy is gained.
#[derive(Clone, Copy, Debug)]
pub struct RoughPlastic {
    /// Albedo ρ of the base.
    pub rho: Spectrum,
    /// Reflectance F₀ of the specular layer at normal incidence.
    pub f0: Spectrum,
    /// Distribution of the facet normals.
    pub distribution: MicrofacetDistribution,
}

impl RoughPlastic {
    /// Index of the albedo of the base among the packed parameters.
    pub(crate) const RHO: usize = 0;
    /// Index of the reflectance F₀ among the packed parameters.
    pub(crate) const F0: usize = 3;

    /// Probability of sampling the specular layer: its fraction of the albedos at normal incidence,
    /// kept away from 0 and 1 because specular reflection increases towards grazing angles.
    #[inline]
    fn gloss_probability(&self) -> f32 {
        let (base, gloss) = (self.rho.luminance(), self.f0.luminance());
        if base + gloss <= 0.0 { 0.5 } else { (gloss / (base + gloss)).clamp(0.1, 0.9) }
    }
}

impl Lobe<'_> for RoughPlastic {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.rho.to_array(), self.f0.to_array());
        let [g, h, i] = self.distribution.pack();
        padded([a, b, c, d, e, f, g, h, i])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            rho: color(p, 0),
            f0: color(p, 3),
            distribution: MicrofacetDistribution::unpack([p[6], p[7], p[8]]),
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let Some(h) = half_vector(wo, wi) else { return Spectrum::ZERO };
        let through = (Spectrum::ONE - fresnel::schlick(wo.z, self.f0))
            * (Spectrum::ONE - fresnel::schlick(wi.z, self.f0));
        let base = self.rho * through * (FRAC_1_PI * wi.z);
        base + fresnel::schlick(wo.dot(h), self.f0) * reflected(&self.distribution, wo, wi, h)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        OverBase { distribution: &self.distribution, q: self.gloss_probability() }.pdf(wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, _]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let directions = OverBase { distribution: &self.distribution, q: self.gloss_probability() };
        let q = directions.q;
        let again = if u < q { u / q } else { (u - q) / (1.0 - q) };
        let wi = directions.draw(wo, [again.min(1.0f32.next_down()), v], u < q);
        let pdf = directions.pdf(wo, wi);
        pdf.is_positive().then(|| BsdfSample::new(wi, self.eval(wo, wi) / pdf.get(), Some(pdf)))
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        self.distribution.spread()
    }

    fn examples() -> Vec<Self> {
        let with = |rho, f0, alpha| Self {
            rho: Spectrum::splat(rho),
            f0: Spectrum::splat(f0),
            distribution: MicrofacetDistribution::isotropic(Distribution::Beckmann, alpha),
        };
        vec![with(0.8, 0.04, 0.2), with(0.5, 0.5, 0.5), with(1.0, 0.1, 0.1)]
    }
}

#[cfg(test)]
impl LobeLaws for RoughPlastic {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Overlapping,
            max_albedo: CONSERVING,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        Some(Self { distribution: self.distribution.with_alpha(alpha), ..*self }.into())
    }
}
