//! Rough dielectric interfaces with multiple scattering.

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING_BY_TABLES, LobeLaws, LobeProperties, SamplingMaps};
use super::multiscatter::DielectricLosses;
use super::rough_dielectric::{RoughDielectric, eta_from, upright};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS};

/// A rough interface with multiple scattering between its facets to either side; see
/// `multiscatter.rs`. Its roughness is equal in all directions.
#[derive(Clone, Copy, Debug)]
pub struct CompensatedDielectric {
    /// Single scattering.
    pub once: RoughDielectric,
}

impl CompensatedDielectric {
    #[inline]
    fn again(&self, wo: Vec3) -> DielectricLosses {
        DielectricLosses::new(&self.once.distribution, eta_from(wo, self.once.eta))
    }
}

/// Probability of cosine sampling.
#[inline]
fn probability(again: &DielectricLosses, wo: Vec3) -> f32 {
    // Includes the multiply scattered light from other directions.
    0.9 * again.lost(wo.z.abs()) + 0.02
}

impl Lobe<'_> for CompensatedDielectric {
    const DELTA: bool = false;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        self.once.pack()
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], context: LobeContext<'_>) -> Self {
        Self { once: RoughDielectric::unpack(p, context) }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if wo.z == 0.0 || wi.z == 0.0 {
            return Spectrum::ZERO;
        }
        let z = upright(wi, wo).z;
        let eta = eta_from(wo, self.once.eta);
        let tint =
            if z > 0.0 { self.once.reflectance } else { self.once.transmittance / (eta * eta) };
        self.once.eval(wo, wi) + tint * self.again(wo).eval(wo.z.abs(), z)
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        if wo.z == 0.0 || wi.z == 0.0 {
            return Pdf::ZERO;
        }
        let again = self.again(wo);
        let probability = probability(&again, wo);
        let side = if wo.z * wi.z > 0.0 { again.reflected } else { 1.0 - again.reflected };
        let by_cosine = probability * side * warp::cosine_hemisphere_pdf(wi.z.abs()).get();
        Pdf::new((1.0 - probability) * self.once.pdf(wo, wi).get() + by_cosine)
    }

    #[inline]
    fn sample(&self, wo: Vec3, [u, v, choice]: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let again = self.again(wo);
        let probability = probability(&again, wo);
        let wi = if choice < probability {
            let w = warp::cosine_hemisphere([u, v]);
            let up = if choice < probability * again.reflected { w.z } else { -w.z };
            upright(Vec3::new(w.x, w.y, up), wo)
        } else {
            let rest = ((choice - probability) / (1.0 - probability)).min(1.0f32.next_down());
            self.once.sample(wo, [u, v, rest])?.wi
        };
        let pdf = self.pdf(wo, wi);
        let eta = eta_from(wo, self.once.eta);
        let eta_scale = if wo.z * wi.z < 0.0 { eta * eta } else { 1.0 };
        let weight = || self.eval(wo, wi) / pdf.get();
        pdf.is_positive()
            .then(|| BsdfSample::new(wi, weight(), Some(pdf)).with_eta_scale(eta_scale))
    }

    /// Not perfect: errors of some thousandths in the tables could count as gain.
    fn examples() -> Vec<Self> {
        let with = |mut once: RoughDielectric, alpha: f32| {
            once.distribution.alpha = [alpha; 2];
            Self { once }
        };
        let all = RoughDielectric::examples();
        vec![with(all[0], 0.5), with(all[1], 0.3)]
    }
}

#[cfg(test)]
impl LobeLaws for CompensatedDielectric {
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
        let once = self.once;
        let distribution = once.distribution.with_alpha(alpha);
        Some(Self { once: RoughDielectric { distribution, ..once } }.into())
    }

    fn map_probability(&self, wo: Vec3, wi: Vec3, choice: f32) -> f32 {
        let again = self.again(wo);
        let probability = probability(&again, wo);
        if choice >= probability {
            return (1.0 - probability) * self.once.map_probability(wo, wi, choice);
        }
        let reflects = wi.z * wo.z > 0.0;
        probability * if reflects { again.reflected } else { 1.0 - again.reflected }
    }

    fn reciprocity(&self, wo: Vec3, wi: Vec3) -> Option<f32> {
        self.once.reciprocity(wo, wi)
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use pt_math::trig;
    use pt_scene::material::{Distribution, Masking};

    use super::*;
    use crate::bsdf::microfacet::MicrofacetDistribution;

    /// Albedos of power without and with multiple scattering.
    fn albedos(lobe: &CompensatedDielectric, wo: Vec3) -> [f32; 2] {
        const STEPS: u16 = 128;
        const CHOICES: u16 = 5;
        let middle = |i: u16, n: u16| (f32::from(i) + 0.5) / f32::from(n);
        let (eta, once) = (eta_from(wo, lobe.once.eta), lobe.once);
        let (mut sum, mut again) = (0.0f64, 0.0f64);
        for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
            let (u, v) = (middle(i, STEPS), middle(j, STEPS));
            // Shifted differently at each point.
            let shift = (u * 31.7 + v * 17.3).fract();
            for k in 0..CHOICES {
                let choice = (middle(k, CHOICES) + shift).fract();
                let sample = once.sample(wo, [u, v, choice]);
                let power = sample.map_or(0.0, |s| f64::from(s.weight.0.x * s.eta_scale));
                sum += power / f64::from(CHOICES);
            }
            let ((sin, cos), (s, c)) = (trig::sin_cos(u * PI), trig::sin_cos_tau(v));
            let wi = Vec3::new(sin * c, sin * s, cos);
            let f = lobe.eval(wo, wi) - once.eval(wo, wi);
            let eta_scale = if wi.z * wo.z < 0.0 { eta * eta } else { 1.0 };
            again += f64::from(f.0.x * eta_scale * sin * 2.0 * PI * PI);
        }
        let n = f64::from(STEPS) * f64::from(STEPS);
        [sum / n, (sum + again) / n].map(|x| x as f32)
    }

    /// White furnace: rough glass without absorption loses less than 1 % of the power from either
    /// side, and gains less than 1 %, the error of the tables. Without multiple scattering, it
    /// loses up to nine tenths.
    #[test]
    fn rough_glass_loses_nothing() {
        let settings = [0.05, 0.2, 0.5, 1.0].into_iter();
        let settings = settings.flat_map(|alpha| [1.1, 1.33, 1.5, 2.2].map(|eta| (alpha, eta)));
        for (alpha, eta) in settings {
            for distribution in [Distribution::Beckmann, Distribution::Ggx] {
                let masking = Masking::Separable;
                let distribution =
                    MicrofacetDistribution { distribution, masking, alpha: [alpha; 2] };
                let (reflectance, transmittance) = (Spectrum::ONE, Spectrum::ONE);
                let once = RoughDielectric { reflectance, transmittance, eta, distribution };
                let lobe = CompensatedDielectric { once };
                for cos in [1.0f32, 0.7, 0.4, 0.15, 0.04, -0.04, -0.2, -0.6, -0.9] {
                    let wo = Vec3::new(((1.0 - cos) * (1.0 + cos)).sqrt(), 0.0, cos);
                    let [without, with] = albedos(&lobe, wo);
                    assert!((0.99..1.01).contains(&with), "{once:?} {wo}: {without} {with}");
                }
            }
        }
    }
}
