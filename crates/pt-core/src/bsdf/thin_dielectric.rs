//! A dielectric pane so thin that light leaves it where it entered.

use pt_math::{Spectrum, Vec3};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::mirror::reflect;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// Both interfaces of a pane with all interreflections. With reflectance F of each, they reflect
/// F + (1 − F)² F + (1 − F)² F³ + … = 2F/(1 + F), and transmit the rest undeflected.
#[derive(Clone, Copy, Debug)]
pub struct ThinDielectric {
    /// Tint of reflected light.
    pub reflectance: Spectrum,
    /// Tint of transmitted light.
    pub transmittance: Spectrum,
    /// Index of refraction of the pane over that around it.
    pub eta: f32,
}

impl ThinDielectric {
    /// Index of the tint of reflected light among the packed parameters.
    pub(crate) const REFLECTANCE: usize = 0;
    /// Index of the tint of transmitted light among the packed parameters.
    pub(crate) const TRANSMITTANCE: usize = 3;

    /// Reflectance of the pane.
    #[inline]
    fn reflected(&self, cos: f32) -> f32 {
        // A totally reflected ray does not enter.
        fresnel::dielectric(cos, self.eta).map_or(1.0, |(f, _)| 2.0 * f / (1.0 + f))
    }
}

impl Lobe<'_> for ThinDielectric {
    const DELTA: bool = true;
    const TRANSMITS: bool = true;
    const STRAIGHT: bool = true;

    fn straight(&self, wo: Vec3) -> Spectrum {
        self.transmittance * (1.0 - self.reflected(wo.z.abs()))
    }

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.reflectance.to_array(), self.transmittance.to_array());
        padded([a, b, c, d, e, f, self.eta])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { reflectance: color(p, 0), transmittance: color(p, 3), eta: p[6] }
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if u[0] < self.reflected(wo.z.abs()) {
            Some(BsdfSample::new(reflect(wo), self.reflectance, None))
        } else {
            Some(BsdfSample::new(-wo, self.transmittance, None))
        }
    }

    fn examples() -> Vec<Self> {
        let (reflectance, transmittance) = (Spectrum::ONE, Spectrum::ONE);
        vec![
            Self { reflectance, transmittance, eta: 1.5 },
            Self { reflectance: Spectrum::splat(0.5), transmittance, eta: 1.0 / 1.33 },
        ]
    }
}

#[cfg(test)]
impl LobeLaws for ThinDielectric {
    fn properties(&self) -> LobeProperties {
        LobeProperties {
            is_reciprocal: true,
            has_delta_part: false,
            maps: SamplingMaps::Disjoint,
            max_albedo: CONSERVING,
            can_be_lossless: true,
        }
    }

    fn with_alpha(&self, _: f32) -> Option<AnyLobe<'static>> {
        None
    }

    fn is_lossless(&self, _: Vec3) -> bool {
        [self.reflectance, self.transmittance] == [Spectrum::ONE; 2]
    }
}
