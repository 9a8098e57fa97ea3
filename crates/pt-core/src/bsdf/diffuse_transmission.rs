//! Lambertian reflection and transmission: a thin sheet that scatters the light it transmits.

use std::f32::consts::FRAC_1_PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, padded};

/// f = ρ/π on the side of `wo`, and τ/π on the other; equal for both sides of the surface. [Pharr,
/// Jakob & Humphreys 2023, §9.2 and the material "diffusetransmission"]
#[derive(Clone, Copy, Debug)]
pub struct DiffuseTransmission {
    /// Reflectance ρ, in [0, 1].
    pub rho: Spectrum,
    /// Transmittance τ, in [0, 1].
    pub tau: Spectrum,
}

impl DiffuseTransmission {
    /// Index of the reflectance among the packed parameters.
    pub(crate) const RHO: usize = 0;
    /// Index of the transmittance among the packed parameters.
    pub(crate) const TAU: usize = 3;

    /// Probability of sampling a direction on the side of `wo`.
    #[inline]
    pub(crate) fn reflected(&self) -> f32 {
        let (rho, tau) = (self.rho.max_channel(), self.tau.max_channel());
        if rho + tau > 0.0 { rho / (rho + tau) } else { 1.0 }
    }
}

impl Lobe<'_> for DiffuseTransmission {
    const DELTA: bool = false;
    const DIFFUSE: bool = true;
    const TRANSMITS: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        let ([a, b, c], [d, e, f]) = (self.rho.to_array(), self.tau.to_array());
        padded([a, b, c, d, e, f])
    }

    #[inline]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { rho: color(p, 0), tau: color(p, 3) }
    }

    #[inline]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let share = if wo.z * wi.z > 0.0 { self.rho } else { self.tau };
        if wo.z == 0.0 { Spectrum::ZERO } else { share * (FRAC_1_PI * wi.z.abs()) }
    }

    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        if wo.z == 0.0 || wi.z == 0.0 {
            return Pdf::ZERO;
        }
        let reflected = self.reflected();
        let chance = if wo.z * wi.z > 0.0 { reflected } else { 1.0 - reflected };
        warp::cosine_hemisphere_pdf(wi.z.abs()).scaled_by(chance)
    }

    /// p(ω) = cos θ / π times the probability of the side. The cosine and π cancel: the weight is
    /// the reflectance or transmittance over its probability.
    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z == 0.0 {
            return None;
        }
        let reflected = self.reflected();
        let above = warp::cosine_hemisphere([u[0], u[1]]);
        let (share, chance, side) = if u[2] < reflected {
            (self.rho, reflected, wo.z)
        } else {
            (self.tau, 1.0 - reflected, -wo.z)
        };
        let wi = Vec3::new(above.x, above.y, above.z.copysign(side));
        let pdf = warp::cosine_hemisphere_pdf(above.z).scaled_by(chance);
        pdf.is_positive().then(|| BsdfSample::new(wi, share * (1.0 / chance), Some(pdf)))
    }

    fn examples() -> Vec<Self> {
        vec![
            Self { rho: Spectrum::splat(0.5), tau: Spectrum::splat(0.5) },
            Self { rho: Spectrum::rgb(0.1, 0.3, 0.05), tau: Spectrum::rgb(0.5, 0.6, 0.1) },
            Self { rho: Spectrum::ZERO, tau: Spectrum::ONE },
        ]
    }
}

#[cfg(test)]
impl LobeLaws for DiffuseTransmission {
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

    fn map_probability(&self, _: Vec3, _: Vec3, choice: f32) -> f32 {
        if choice < self.reflected() { self.reflected() } else { 1.0 - self.reflected() }
    }
}
