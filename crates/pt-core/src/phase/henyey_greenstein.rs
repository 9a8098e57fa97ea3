//! The Henyey–Greenstein phase function.

use std::f32::consts::PI;

use pt_math::{Pdf, SolidAngle, Vec3};

use super::{PhaseFunction, turned};

/// p = (1 − g²) / (4π (1 + g² − 2g cos θ)^{3/2}), with θ the scattering angle. [Henyey & Greenstein
/// 1941, "Diffuse radiation in the Galaxy"]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HenyeyGreenstein {
    /// Asymmetry parameter g, the mean of cos θ, in (−1, 1): positive for forward scattering,
    /// negative for backward scattering.
    pub g: f32,
}

impl HenyeyGreenstein {
    /// Inverse of the cumulative distribution of cos θ at u; in [−1, 1].
    ///
    /// With s = 2u − 1, cos θ = (1 + g² − ((1 − g²) / (1 + gs))²) / 2g [Witt 1977, "Multiple
    /// scattering in reflection nebulae I"], multiplied out so that g may be 0.
    #[inline]
    fn cosine(self, u: f32) -> f64 {
        let (g, s) = (f64::from(self.g), 2.0 * f64::from(u) - 1.0);
        let above = s + g * (0.5 * (s * s + 3.0) + g * (s + 0.5 * g * (s * s - 1.0)));
        let below = 1.0 + g * s;
        (above / (below * below)).clamp(-1.0, 1.0)
    }
}

impl PhaseFunction for HenyeyGreenstein {
    /// 1 + g² − 2g cos θ = (1 − |g|)² + |g| · |wi ± wo|², which avoids cancellation for large p.
    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let g = self.g.abs();
        let apart = if self.g < 0.0 { wi - wo } else { wi + wo };
        let base = (1.0 - g) * (1.0 - g) + g * apart.length_squared();
        Pdf::new((1.0 - g) * (1.0 + g) / (4.0 * PI * base * base.sqrt()))
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        turned(wo, self.cosine(u[0]), u[1])
    }

    fn examples() -> Vec<Self> {
        [-0.6, -1e-4, 0.0, 0.3, 0.85].map(|g| Self { g }).to_vec()
    }
}
