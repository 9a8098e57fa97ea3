//! Diffuse base below a rough dielectric interface that light crosses once in each direction.

use std::f32::consts::FRAC_1_PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
use pt_scene::material::{Distribution, Masking};

use super::conductor::{half_vector, reflected};
#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::MicrofacetDistribution;
use super::over_base::OverBase;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// A diffuse base below a rough dielectric interface: f = F D G / (4 cos θo cos θi) + (1 − F(θo))
/// (1 − F(θi)) ρ / π.
///
/// Light that the base scatters and the interface reflects internally is lost. [Baek et al. 2018,
/// "Simultaneous Acquisition of Polarimetric SVBRDF and Normals", without polarization, as in
/// Mitsuba 3's "pplastic"]
#[derive(Clone, Copy, Debug)]
pub struct FresnelPlastic {
    /// Albedo ρ of the base.
    pub rho: Spectrum,
    /// Tint of the specular reflection.
    pub specular: Spectrum,
    /// Index of refraction below the surface over that above it, at least 1.
    pub eta: f32,
    /// Distribution of the facet normals.
    pub distribution: MicrofacetDistribution,
}

impl FresnelPlastic {
    /// Index of the albedo of the base among the packed parameters.
    pub(crate) const RHO: usize = 0;
    /// Index of the tint of the specular reflection among the packed parameters.
    pub(crate) const SPECULAR: usize = 3;
    /// Index of the two roughnesses among the packed parameters.
    pub(crate) const ALPHA: usize = 7;

    #[inline]
    fn fresnel(&self, cos: f32) -> f32 {
        fresnel::dielectric(cos, self.eta).map_or(1.0, |(f, _)| f)
    }

    /// Probability of sampling the facets: about their fraction of the scattered light, by
    /// luminance.
    #[inline]
    fn gloss_probability(&self, wo: Vec3) -> f32 {
        const MIN: f32 = 0.02;
        let f = self.fresnel(wo.z);
        let (gloss, base) = (f * self.specular.luminance(), (1.0 - f) * self.rho.luminance());
        if gloss + base > 0.0 { (gloss / (gloss + base)).clamp(MIN, 1.0 - MIN) } else { 0.5 }
    }
}

impl Lobe<'_> for FresnelPlastic {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.rho.to_array(), self.specular.to_array());
        let [g, h, i] = self.distribution.pack();
        padded([a, b, c, d, e, f, self.eta, g, h, i])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self {
            rho: color(p, Self::RHO),
            specular: color(p, Self::SPECULAR),
            eta: p[6],
            distribution: MicrofacetDistribution::unpack([p[7], p[8], p[9]]),
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let Some(h) = half_vector(wo, wi) else { return Spectrum::ZERO };
        let gloss = self.fresnel(wo.dot(h)) * reflected(&self.distribution, wo, wi, h);
        let through = (1.0 - self.fresnel(wo.z)) * (1.0 - self.fresnel(wi.z));
        self.specular * gloss + self.rho * (through * FRAC_1_PI * wi.z)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        OverBase { distribution: &self.distribution, q: self.gloss_probability(wo) }.pdf(wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let directions =
            OverBase { distribution: &self.distribution, q: self.gloss_probability(wo) };
        let wi = directions.draw(wo, [u, v], choice < directions.q);
        let pdf = directions.pdf(wo, wi);
        pdf.is_positive().then(|| BsdfSample::new(wi, self.eval(wo, wi) / pdf.get(), Some(pdf)))
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        self.distribution.spread()
    }

    fn examples() -> Vec<Self> {
        let distribution = |distribution, alpha| MicrofacetDistribution {
            distribution,
            masking: Masking::Separable,
            alpha,
        };
        let white = |eta, distribution| Self {
            rho: Spectrum::ONE,
            specular: Spectrum::ONE,
            eta,
            distribution,
        };
        vec![
            white(1.5, distribution(Distribution::Beckmann, [0.2; 2])),
            Self {
                rho: Spectrum::rgb(0.8, 0.4, 0.1),
                specular: Spectrum::splat(0.5),
                ..white(1.9, distribution(Distribution::Ggx, [0.5, 0.2]))
            },
        ]
    }
}

#[cfg(test)]
impl LobeLaws for FresnelPlastic {
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

    fn map_probability(&self, wo: Vec3, _: Vec3, choice: f32) -> f32 {
        let q = self.gloss_probability(wo);
        if choice < q { q } else { 1.0 - q }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of Mitsuba 3.9.1 for "pplastic" with an index of 1.5, an albedo of 0.6 and no
    /// specular reflection, times cos θi.
    #[test]
    fn the_base_is_that_of_mitsuba() {
        let distribution = MicrofacetDistribution::isotropic(Distribution::Beckmann, 0.2);
        let (rho, specular) = (Spectrum::splat(0.6), Spectrum::ZERO);
        let lobe = FresnelPlastic { rho, specular, eta: 1.5, distribution };
        for (cos_o, cos_i, want) in [
            (1.0f32, 1.0f32, 0.176_012_6),
            (1.0, 0.5, 0.083_497_2),
            (0.5, 0.5, 0.079_219_1),
            (0.3, 0.8, 0.115_732_6),
            (0.1, 0.1, 0.003_505_22),
        ] {
            let wo = Vec3::new((1.0 - cos_o * cos_o).sqrt(), 0.0, cos_o);
            let wi = Vec3::new(0.0, (1.0 - cos_i * cos_i).sqrt(), cos_i);
            let got = lobe.eval(wo, wi).0.x;
            assert!((got / want - 1.0).abs() < 1e-5, "{cos_o} {cos_i}: {got} {want}");
        }
    }
}
