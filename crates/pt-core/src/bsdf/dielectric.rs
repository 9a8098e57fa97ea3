//! The smooth interface between two dielectrics.

use pt_math::{Spectrum, Vec3};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::mirror::reflect;
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, fresnel, padded};

/// Smooth dielectric: Fresnel reflection and refraction, where reflection is chosen with
/// probability F.
#[derive(Clone, Copy, Debug)]
pub struct Dielectric {
    /// Tint of reflected light.
    pub reflectance: Spectrum,
    /// Tint of transmitted light.
    pub transmittance: Spectrum,
    /// Index of refraction below the surface (−z) over that above it.
    pub eta: f32,
}

/// Refracts `w` to the other side, given the cosine there and the index of refraction of the other
/// side over that of the side of `w`. [Snell's law]
#[inline]
pub(super) fn refract(w: Vec3, cos_t: f32, eta: f32) -> Vec3 {
    Vec3::new(-w.x / eta, -w.y / eta, -cos_t.copysign(w.z))
}

impl Dielectric {
    /// Index of the tint of reflected light among the packed parameters.
    pub(crate) const REFLECTANCE: usize = 0;
    /// Index of the tint of transmitted light among the packed parameters.
    pub(crate) const TRANSMITTANCE: usize = 3;
}

impl Lobe<'_> for Dielectric {
    const DELTA: bool = true;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.reflectance.to_array(), self.transmittance.to_array());
        padded([a, b, c, d, e, f, self.eta])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { reflectance: color(p, 0), transmittance: color(p, 3), eta: p[6] }
    }

    /// Refraction scales radiance: L/η² is invariant along a ray, so radiance from the other side
    /// is divided by η². [Veach 1997, §5.2]
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        let eta = if wo.z > 0.0 { self.eta } else { 1.0 / self.eta };
        let reflected = BsdfSample::new(reflect(wo), self.reflectance, None);
        match fresnel::dielectric(wo.z.abs(), eta) {
            None => Some(reflected),
            Some((f, _)) if u[0] < f => Some(reflected),
            Some((_, cos_t)) => {
                let weight = self.transmittance / (eta * eta);
                let wi = refract(wo, cos_t, eta);
                Some(BsdfSample::new(wi, weight, None).with_eta_scale(eta * eta))
            }
        }
    }

    fn examples() -> Vec<Self> {
        let (reflectance, transmittance) = (Spectrum::ONE, Spectrum::ONE);
        vec![
            Self { reflectance, transmittance, eta: 1.5 },
            Self { reflectance, transmittance: Spectrum::splat(0.5), eta: 1.0 / 1.33 },
        ]
    }
}

#[cfg(test)]
impl LobeLaws for Dielectric {
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
