//! An interface that only refracts.

use pt_math::{Spectrum, Vec3};

use super::dielectric::refract;
#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// Refracts all light and reflects none; total internal reflection is black.
#[derive(Clone, Copy, Debug)]
pub struct Refraction {
    /// Tint of transmitted light.
    pub transmittance: Spectrum,
    /// Index of refraction below the surface (−z) over that above it.
    pub eta: f32,
}

impl Refraction {
    /// Index of the tint among the packed parameters.
    pub(crate) const TRANSMITTANCE: usize = 0;
}

impl Lobe<'_> for Refraction {
    const DELTA: bool = true;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let [a, b, c] = self.transmittance.to_array();
        padded([a, b, c, self.eta])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { transmittance: color(p, 0), eta: p[3] }
    }

    /// See [`super::Dielectric`] for the division by η².
    #[inline]
    fn sample(&self, wo: Vec3, _u: [f32; 3]) -> Option<BsdfSample> {
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let (_, cos_t) = fresnel::dielectric(wo.z.abs(), eta)?;
        let weight = self.transmittance / (eta * eta);
        Some(BsdfSample::new(refract(wo, cos_t, eta), weight, None).with_eta_scale(eta * eta))
    }

    fn examples() -> Vec<Self> {
        vec![Self { transmittance: Spectrum::ONE, eta: 1.45 }]
    }
}

#[cfg(test)]
impl LobeLaws for Refraction {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: CONSERVING,
            can_be_lossless: false,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }
}
