//! Rough metals with multiple scattering.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};

use super::conductor::RoughConductor;
#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING_BY_TABLES, LobeLaws, LobeProperties, SamplingMaps};
use super::multiscatter::{Reflected, mean_reflectance};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel};

/// A rough metal with multiple scattering between its facets; see `multiscatter.rs`.
#[derive(Clone, Copy, Debug)]
pub struct CompensatedConductor {
    once: RoughConductor,
    /// Mean reflectance of the metal for diffuse illumination, without its tint.
    mean: Spectrum,
}

impl CompensatedConductor {
    /// Adds multiple scattering to `once`.
    pub fn new(once: RoughConductor) -> Self {
        let metal = &once.metal;
        let mean = mean_reflectance(|cos| fresnel::conductor(cos, metal.eta, metal.k));
        Self { once, mean }
    }

    /// Probability of cosine sampling.
    #[inline]
    fn again_probability(&self, wo: Vec3) -> f32 {
        let again = Reflected::new(&self.once.distribution);
        // Includes the multiply scattered light from other directions.
        0.9 * again.lost(wo) + 0.02
    }
}

impl Lobe<'_> for CompensatedConductor {
    const DELTA: bool = false;

    fn pack(&self) -> [f32; PARAMETERS] {
        let mut p = self.once.pack();
        p[12..15].copy_from_slice(&self.mean.to_array());
        p
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], context: LobeContext<'_>) -> Self {
        Self { once: RoughConductor::unpack(p, context), mean: color(p, 12) }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Spectrum::ZERO;
        }
        let again = Reflected::new(&self.once.distribution);
        let mean = self.mean * self.once.metal.reflectance;
        self.once.eval(wo, wi) + again.colored(mean) * again.eval(wo, wi)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Pdf::ZERO;
        }
        let again = self.again_probability(wo);
        let by_cosine = again * warp::cosine_hemisphere_pdf(wi.z).get();
        Pdf::new((1.0 - again) * self.once.pdf(wo, wi).get() + by_cosine)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = if choice < self.again_probability(wo) {
            warp::cosine_hemisphere([u, v])
        } else {
            self.once.sample(wo, [u, v, 0.0])?.wi
        };
        let pdf = self.pdf(wo, wi);
        pdf.is_positive().then(|| BsdfSample::new(wi, self.eval(wo, wi) / pdf.get(), Some(pdf)))
    }

    #[inline]
    fn lobe_width(&self) -> f32 {
        self.once.lobe_width()
    }

    /// Not perfectly reflecting: errors of some thousandths in the tables could count as gain.
    fn examples() -> Vec<Self> {
        RoughConductor::examples().into_iter().skip(1).step_by(2).map(Self::new).collect()
    }
}

#[cfg(test)]
impl LobeLaws for CompensatedConductor {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Overlapping,
            max_albedo: CONSERVING_BY_TABLES,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, alpha: f32) -> Option<AnyLobe<'static>> {
        let mut lobe = *self;
        lobe.once.distribution.alpha = [alpha; 2];
        Some(lobe.into())
    }

    fn map_probability(&self, wo: Vec3, _: Vec3, choice: f32) -> f32 {
        let again = self.again_probability(wo);
        if choice < again { again } else { 1.0 - again }
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::TAU;

    use pt_math::trig;
    use pt_scene::material::{Distribution, Masking};

    use super::*;
    use crate::bsdf::SmoothConductor;
    use crate::bsdf::microfacet::MicrofacetDistribution;

    /// `steps`² points of the unit square, dense towards its edges, and their weights.
    fn square(steps: u16) -> impl Iterator<Item = ([f32; 2], f32)> {
        let dense = move |i: u16| {
            let t = (f32::from(i) + 0.5) / f32::from(steps);
            (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t) / f32::from(steps))
        };
        (0..steps)
            .flat_map(move |i| (0..steps).map(move |j| (dense(i), dense(j))))
            .map(|((u, du), (v, dv))| ([u, v], du * dv))
    }

    /// Albedos without and with multiple scattering, for a metal that reflects all light.
    fn albedos(distribution: MicrofacetDistribution, wo: Vec3) -> [f32; 2] {
        let (eta, k, reflectance) = (Spectrum::ZERO, Spectrum::ONE, Spectrum::ONE);
        let once = RoughConductor { metal: SmoothConductor { eta, k, reflectance }, distribution };
        let lobe = CompensatedConductor::new(once);
        let (mut sum, mut again) = (0.0f64, 0.0f64);
        for ([u, v], share) in square(256) {
            let sample = once.sample(wo, [u, v, 0.0]);
            sum += f64::from(sample.map_or(0.0, |s| s.weight.0.x) * share);
        }
        // Multiple scattering, which is smooth, by angles, dense at grazing angles.
        for ([u, v], share) in square(64) {
            let cos = u * u;
            let ((s, c), sin) = (trig::sin_cos_tau(v), ((1.0 - cos) * (1.0 + cos)).sqrt());
            let wi = Vec3::new(sin * c, sin * s, cos);
            let f = lobe.eval(wo, wi) - once.eval(wo, wi);
            again += f64::from(f.0.x * share * 2.0 * u * TAU);
        }
        [sum as f32, (sum + again) as f32]
    }

    /// Runs a law on facets of all kinds, from normal to grazing incidence along x and y.
    fn for_all_facets(alphas: &[[f32; 2]], law: impl Fn(MicrofacetDistribution, Vec3, [f32; 2])) {
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for masking in [Masking::Correlated, Masking::Separable] {
                for &alpha in alphas {
                    let distribution = MicrofacetDistribution { distribution, masking, alpha };
                    for cos in [1.0f32, 0.8, 0.5, 0.25, 0.1, 0.04, 0.01] {
                        let sin = ((1.0 - cos) * (1.0 + cos)).sqrt();
                        let along = [Vec3::new(sin, 0.0, cos), Vec3::new(0.0, sin, cos)];
                        // Isotropic facets are the same along x and y.
                        let count = if alpha[0] == alpha[1] { 1 } else { 2 };
                        for wo in &along[..count] {
                            law(distribution, *wo, albedos(distribution, *wo));
                        }
                    }
                }
            }
        }
    }

    /// White furnace: a rough metal that reflects all light loses less than 1 % of it, and gains
    /// less than ½ %, the error of the tables.
    #[test]
    fn rough_metals_lose_nothing() {
        let alphas = [0.001, 0.004, 0.02, 0.07, 0.15, 0.25, 0.4, 0.6, 0.85, 1.0].map(|a| [a, a]);
        for_all_facets(&alphas, |distribution, wo, [_, albedo]| {
            assert!((0.99..1.005).contains(&albedo), "{distribution:?} {wo}: {albedo}");
        });
    }

    /// Anisotropic metals lose less than 3 % at any angle, and gain less than 1.5 %; without
    /// multiple scattering, they lose up to half.
    #[test]
    fn brushed_metals_lose_little() {
        for_all_facets(
            &[[0.1, 0.3], [0.05, 0.5], [1.0, 0.3]],
            |distribution, wo, [once, albedo]| {
                assert!((0.97..1.015).contains(&albedo), "{distribution:?} {wo}: {once} {albedo}");
            },
        );
    }

    /// Each facet colours light again: multiple scattering is more saturated than single
    /// scattering.
    #[test]
    fn more_facets_colour_light_more() {
        let distribution = MicrofacetDistribution::isotropic(Distribution::Ggx, 0.8);
        let reflectance = Spectrum::rgb(0.9, 0.6, 0.3);
        let (eta, k) = (Spectrum::ZERO, Spectrum::ONE);
        let once = RoughConductor { metal: SmoothConductor { eta, k, reflectance }, distribution };
        let (wo, wi) = (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 0.8, 0.6));
        let once_only = once.eval(wo, wi);
        let again = CompensatedConductor::new(once).eval(wo, wi) - once_only;
        let saturation = |f: Spectrum| f.0.x / f.0.z;
        assert!(again.0.min_element() > 0.0 && saturation(again) > 2.0 * saturation(once_only));
    }
}
