//! Lambertian reflection.

use std::f32::consts::FRAC_1_PI;

use pt_math::{Pdf, SolidAngle, Spectrum, Vec3, warp};

#[cfg(test)]
use super::laws::{AnyLobe, CONSERVING, LobeLaws, LobeProperties, SamplingMaps};
use super::{BsdfSample, Lobe, LobeContext, PARAMETERS, color, padded};

/// Lambertian reflection, f = ρ/π.
#[derive(Clone, Copy, Debug)]
pub struct Diffuse {
    /// Albedo ρ ∈ [0, 1].
    pub rho: Spectrum,
}

impl Diffuse {
    /// Index of the albedo among the packed parameters.
    pub(crate) const RHO: usize = 0;
}

impl Lobe<'_> for Diffuse {
    const DELTA: bool = false;
    const DIFFUSE: bool = true;
    const INLINE: bool = true;

    fn pack(&self) -> [f32; PARAMETERS] {
        padded(self.rho.to_array())
    }

    #[inline(always)]
    fn unpack(p: &[f32; PARAMETERS], _: LobeContext<'_>) -> Self {
        Self { rho: color(p, 0) }
    }

    #[inline(always)]
    fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        if wo.z <= 0.0 || wi.z <= 0.0 {
            return Spectrum::ZERO;
        }
        self.rho * (FRAC_1_PI * wi.z)
    }

    #[inline(always)]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        if wo.z <= 0.0 || wi.z <= 0.0 { Pdf::ZERO } else { warp::cosine_hemisphere_pdf(wi.z) }
    }

    /// p(ω) = cos θ / π. The cosine and π cancel: the weight is ρ.
    #[inline(always)]
    fn sample(&self, wo: Vec3, u: [f32; 3]) -> Option<BsdfSample> {
        if wo.z <= 0.0 {
            return None;
        }
        let wi = warp::cosine_hemisphere([u[0], u[1]]);
        let pdf = Some(warp::cosine_hemisphere_pdf(wi.z));
        Some(BsdfSample::new(wi, self.rho, pdf))
    }

    #[inline(always)]
    fn lobe_width(&self) -> f32 {
        f32::INFINITY
    }

    fn examples() -> Vec<Self> {
        vec![Self { rho: Spectrum::ONE }, Self { rho: Spectrum::rgb(0.3, 0.0, 0.8) }]
    }
}

#[cfg(test)]
impl LobeLaws for Diffuse {
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

    fn is_lossless(&self, wo: Vec3) -> bool {
        self.rho == Spectrum::ONE && wo.z > 0.0
    }
}
