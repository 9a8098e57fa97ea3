//! The phase function of particles much smaller than the wavelength.

use std::f32::consts::PI;

use pt_math::{Pdf, SolidAngle, Vec3};

use super::{PhaseFunction, turned};

/// p = 3 (1 + cos² θ) / 16π, with θ the scattering angle; without polarization. [Chandrasekhar
/// 1960, "Radiative Transfer", §4]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rayleigh;

/// Inverse of the cumulative distribution of cos θ at u, in [−1, 1]: the root of μ³ + 3μ = 8u − 4,
/// which is a − 1/a with a³ = z + √(z² + 1) and z = 4u − 2. [Cardano; Frisvad 2011, "Importance
/// sampling the Rayleigh phase function"]
#[inline]
fn cosine(u: f32) -> f32 {
    let z = 4.0 * u - 2.0;
    // The root for −z is the negative one.
    let a = libm::cbrtf(z.abs() + (z * z + 1.0).sqrt());
    (a - 1.0 / a).min(1.0).copysign(z)
}

impl PhaseFunction for Rayleigh {
    #[inline]
    fn pdf(&self, wo: Vec3, wi: Vec3) -> Pdf<SolidAngle> {
        let cos = wo.dot(wi);
        Pdf::new(3.0 / (16.0 * PI) * (1.0 + cos * cos))
    }

    #[inline]
    fn sample(&self, wo: Vec3, u: [f32; 2]) -> Vec3 {
        turned(wo, f64::from(cosine(u[0])), u[1])
    }

    fn examples() -> Vec<Self> {
        vec![Self]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// μ³ + 3μ = 8u − 4 holds at the ends and in between.
    #[test]
    fn cosines_solve_their_equation() {
        for i in 0..=1000u16 {
            let u = f32::from(i) / 1000.0;
            let mu = cosine(u);
            let error = mu * mu * mu + 3.0 * mu - (8.0 * u - 4.0);
            assert!(error.abs() < 2e-6, "{u}: {mu}, {error}");
        }
    }
}
