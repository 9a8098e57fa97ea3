//! A diffuse base under a rough dielectric coat.

use std::f32::consts::FRAC_1_PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};
use pt_scene::material::{Distribution, Masking};

use super::conductor::{half_vector, reflected};
#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::microfacet::{MicrofacetDistribution, stretched};
use super::over_base::OverBase;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// f = F D G / (4 cos θo cos θi) + T(θo) T(θi) ρ / (π η² (1 − ρ Fᵢ)).
///
/// T(θ) is the transmittance of the facets from outside, and Fᵢ their reflectance for diffuse light
/// from inside. Light that meets a second facet is lost, so that rough coats are darker than smooth
/// ones. Masking is separable: G = G₁(θo) G₁(θi). [Mitsuba 3's "roughplastic"; facets: Walter et
/// al. 2007]
#[derive(Clone, Copy, Debug)]
pub struct RoughCoatedDiffuse {
    /// Albedo ρ of the base.
    rho: Spectrum,
    /// Tint of the specular reflection.
    specular: Spectrum,
    /// Isotropic facets of the coat.
    distribution: MicrofacetDistribution,
    /// Fᵢ, the internal reflectance for diffuse light.
    inside: f32,
    /// True if the base colours internally reflected light again; otherwise ρ Fᵢ is Fᵢ.
    nonlinear: bool,
    through: Transmittance,
}

impl RoughCoatedDiffuse {
    /// Index of the albedo of the base among the packed parameters.
    pub(crate) const RHO: usize = 0;
    /// Index of the tint of the coat among the packed parameters.
    pub(crate) const SPECULAR: usize = 3;

    /// Creates a base of albedo `rho` under a coat with index `eta` ≥ 1, tint `specular` and
    /// roughness `alpha`. Without `nonlinear`, internally reflected light is not coloured again by
    /// the base.
    pub fn new(
        rho: Spectrum,
        specular: Spectrum,
        eta: f32,
        distribution: Distribution,
        alpha: f32,
        nonlinear: bool,
    ) -> Self {
        let distribution = isotropic_distribution(distribution, alpha);
        let inside = diffuse_reflectance(&distribution, 1.0 / eta);
        let through = Transmittance::new(&distribution, eta);
        Self { rho, specular, distribution, inside, nonlinear, through }
    }

    /// ρ / (η² (1 − ρ Fᵢ)).
    #[inline]
    fn base(&self) -> Spectrum {
        let again = if self.nonlinear { self.rho } else { Spectrum::ONE } * self.inside;
        let eta = self.through.eta;
        Spectrum(self.rho.0 / ((Spectrum::ONE - again).0 * (eta * eta)))
    }

    /// Probability of sampling the coat: its fraction of the scattered light, by luminance. Neither
    /// probability is 0, as the fraction is a total over all directions and not that of each.
    #[inline]
    fn coat_probability(&self, wo: Vec3) -> f32 {
        const MIN: f32 = 0.02;
        let through = self.through.at(wo.z);
        let coat = (1.0 - through) * self.specular.luminance();
        let base = through * self.base().luminance();
        if coat + base > 0.0 { (coat / (coat + base)).clamp(MIN, 1.0 - MIN) } else { 0.5 }
    }
}

fn isotropic_distribution(distribution: Distribution, alpha: f32) -> MicrofacetDistribution {
    MicrofacetDistribution { distribution, masking: Masking::Separable, alpha: [alpha; 2] }
}

/// T(θ), fitted: transmittance of a smooth coat at a cosine that is raised by the roughness, times
/// a polynomial of degree 4.
///
/// For roughnesses from 0.01 to 1 and indices from 1.1 to 2.4 the relative error of the fit is less
/// than 0.3 %.
#[derive(Clone, Copy, Debug)]
struct Transmittance {
    /// Index of refraction of the coat over that above it.
    eta: f32,
    alpha: f32,
    /// Coefficients of the polynomial, in the Chebyshev basis.
    series: [f32; Transmittance::TERMS],
}

impl Transmittance {
    const TERMS: usize = 5;

    fn new(distribution: &MicrofacetDistribution, eta: f32) -> Self {
        /// Number of points of the fit.
        const POINTS: usize = 12;
        let alpha = distribution.alpha[0];
        let mut series = [0.0f64; Self::TERMS];
        // Chebyshev polynomials are orthogonal over cosines of equidistant angles.
        for i in 0..POINTS {
            let x = libm::cos(std::f64::consts::PI * (i as f64 + 0.5) / POINTS as f64);
            let cos = stretched(0.5 + 0.5 * x as f32, alpha);
            let smooth = transmitted_by_smooth(cos, alpha, eta);
            let ratio = f64::from(transmitted(distribution, cos, eta)) / f64::from(smooth);
            let [mut before, mut polynomial] = [x, 1.0];
            for c in &mut series {
                *c += ratio * polynomial * 2.0 / POINTS as f64;
                [before, polynomial] = [polynomial, 2.0 * x * polynomial - before];
            }
        }
        series[0] *= 0.5;
        Self { eta, alpha, series: series.map(|c| c as f32) }
    }

    /// T at a cosine. [Sum of the series: Clenshaw 1955]
    #[inline]
    fn at(&self, cos: f32) -> f32 {
        let x = 2.0 * stretched(cos, self.alpha) - 1.0;
        let [first, rest @ ..] = self.series;
        let (mut b, mut after) = (0.0, 0.0);
        for &c in rest.iter().rev() {
            (b, after) = (c + 2.0 * x * b - after, b);
        }
        let ratio = first + x * b - after;
        (ratio * transmitted_by_smooth(cos, self.alpha, self.eta)).clamp(0.0, 1.0)
    }
}

/// 1 − F of a smooth coat at a cosine that is raised by the roughness.
#[inline]
fn transmitted_by_smooth(cos: f32, alpha: f32, eta: f32) -> f32 {
    let spread = 2.0 * alpha * alpha;
    let raised = ((cos * cos + spread) / (1.0 + spread)).sqrt();
    fresnel::dielectric(raised, eta).map_or(0.0, |(f, _)| 1.0 - f)
}

/// Transmittance of facets with index `eta` for light from a direction of this cosine.
fn transmitted(distribution: &MicrofacetDistribution, cos: f32, eta: f32) -> f32 {
    distribution.mean_of_visible(cos, 32, |wo, h| {
        let cos = wo.dot(h);
        let Some((f, cos_t)) = fresnel::dielectric(cos, eta) else { return 0.0 };
        let wi = h * (cos / eta - cos_t) - wo / eta;
        if wi.z < 0.0 { (1.0 - f) * distribution.shadowing(wo, -wi) } else { 0.0 }
    })
}

/// Single-scattering reflectance of the coat at a cosine.
fn reflectance(distribution: &MicrofacetDistribution, cos: f32, eta: f32) -> f32 {
    distribution.mean_of_visible(cos, 16, |wo, h| {
        let cos = wo.dot(h);
        let wi = h * (2.0 * cos) - wo;
        let f = fresnel::dielectric(cos, eta).map_or(1.0, |(f, _)| f);
        if wi.z > 0.0 { f * distribution.shadowing(wo, wi) } else { 0.0 }
    })
}

/// Reflectance of the facets for diffuse light: 2 ∫ R(cos θ) cos θ d cos θ.
///
/// As in Mitsuba, it is a mean over 64 cosines of which the first is 0 and the last is 1. This is
/// less than the integral by about 1/64 of it, and so loses energy rather than gaining it.
fn diffuse_reflectance(distribution: &MicrofacetDistribution, eta: f32) -> f32 {
    const COSINES: u16 = 64;
    let cos = |i: u16| f32::from(i) / f32::from(COSINES - 1);
    let sum: f32 =
        (1..COSINES).map(|i| 2.0 * cos(i) * reflectance(distribution, cos(i), eta)).sum();
    sum / f32::from(COSINES)
}

impl Lobe<'_> for RoughCoatedDiffuse {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.rho.to_array(), self.specular.to_array());
        let [alpha, _, kind] = self.distribution.pack();
        let kind = if self.nonlinear { -1.0 - kind } else { kind };
        let [g, h, i, j, k] = self.through.series;
        padded([a, b, c, d, e, f, self.through.eta, alpha, kind, self.inside, g, h, i, j, k])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        let [_, _, _, _, _, _, eta, alpha, kind, inside, g, h, i, j, k, ..] = *p;
        let nonlinear = kind < 0.0;
        let kind = if nonlinear { -1.0 - kind } else { kind };
        Self {
            rho: color(p, Self::RHO),
            specular: color(p, Self::SPECULAR),
            distribution: MicrofacetDistribution::unpack([alpha, alpha, kind]),
            inside,
            nonlinear,
            through: Transmittance { eta, alpha, series: [g, h, i, j, k] },
        }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let Some(h) = half_vector(wo, wi) else { return Spectrum::ZERO };
        let f = fresnel::dielectric(wo.dot(h), self.through.eta).map_or(1.0, |(f, _)| f);
        let coat = self.specular * (f * reflected(&self.distribution, wo, wi, h));
        let through = self.through.at(wo.z) * self.through.at(wi.z);
        coat + self.base() * (through * FRAC_1_PI * wi.z)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        OverBase { distribution: &self.distribution, q: self.coat_probability(wo) }.pdf(wo, wi)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let directions =
            OverBase { distribution: &self.distribution, q: self.coat_probability(wo) };
        let wi = directions.draw(wo, [u, v], choice < directions.q);
        let pdf = directions.pdf(wo, wi);
        pdf.is_positive().then(|| BsdfSample::new(wi, self.eval(wo, wi) / pdf.get(), Some(pdf)))
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        self.distribution.spread()
    }

    fn examples() -> Vec<Self> {
        let (beckmann, ggx) = (Distribution::Beckmann, Distribution::Ggx);
        let color = Spectrum::rgb(0.8, 0.4, 0.1);
        vec![
            Self::new(Spectrum::ONE, Spectrum::ONE, 1.5, beckmann, 0.2, true),
            Self::new(color, Spectrum::splat(0.5), 1.9, ggx, 0.4, true),
            Self::new(color, Spectrum::ONE, 1.3, ggx, 0.1, false),
        ]
    }
}

#[cfg(test)]
impl LobeLaws for RoughCoatedDiffuse {
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
        let Self { rho, specular, .. } = *self;
        let distribution = self.distribution.distribution;
        Some(Self::new(rho, specular, self.through.eta, distribution, alpha, self.nonlinear).into())
    }

    fn map_probability(&self, wo: Vec3, _: Vec3, choice: f32) -> f32 {
        let q = self.coat_probability(wo);
        if choice < q { q } else { 1.0 - q }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DISTRIBUTIONS: [Distribution; 2] = [Distribution::Beckmann, Distribution::Ggx];

    /// The error is measured at cosines between the points of the fit.
    #[test]
    fn fitted_transmittance_errs_by_less_than_3_in_1000() {
        let mut worst = (0.0, String::new());
        for alpha in [0.01, 0.03, 0.1, 0.3, 0.6, 1.0] {
            for (distribution, eta) in DISTRIBUTIONS
                .into_iter()
                .flat_map(|d| [1.1, 1.3, 1.5, 1.9, 2.4].map(|eta| (d, eta)))
            {
                let distribution = isotropic_distribution(distribution, alpha);
                let fit = Transmittance::new(&distribution, eta);
                for i in 0..=24u8 {
                    let cos = (f32::from(i) / 24.0).powi(2);
                    let (got, want) = (fit.at(cos), transmitted(&distribution, cos, eta));
                    let error = (got / want - 1.0).abs();
                    if error > worst.0 {
                        worst = (error, format!("{distribution:?} {eta} {cos}: {got} {want}"));
                    }
                }
            }
        }
        assert!(worst.0 < 3e-3, "{worst:?}");
    }

    /// Values of Mitsuba 3.9.1 for the base alone: ρ = 0.5, at these viewing cosines, illuminated
    /// from the normal.
    #[test]
    fn the_base_is_that_of_mitsuba() {
        let [beckmann, ggx] = DISTRIBUTIONS;
        let cases = [
            (beckmann, 0.1, false, [(0.3, 0.129_036), (0.6, 0.151_700), (1.0, 0.155_846)]),
            (beckmann, 0.5, true, [(0.3, 0.076_225_8), (0.6, 0.081_001_7), (1.0, 0.084_461_8)]),
            (ggx, 0.3, false, [(0.3, 0.094_843), (0.6, 0.105_508), (1.0, 0.110_539)]),
        ];
        for (distribution, alpha, nonlinear, seen) in cases {
            let (rho, black) = (Spectrum::splat(0.5), Spectrum::ZERO);
            let eta = 1.49 / 1.000_277;
            let lobe = RoughCoatedDiffuse::new(rho, black, eta, distribution, alpha, nonlinear);
            for (cos, want) in seen {
                let wo = Vec3::new(((1.0f32 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
                let got = lobe.eval(wo, Vec3::Z).0.x;
                assert!((got / want - 1.0).abs() < 4e-3, "{lobe:?} {cos}: {got} {want}");
            }
        }
    }
}
