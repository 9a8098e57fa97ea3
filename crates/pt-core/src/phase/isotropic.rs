//! Isotropic scattering.

use pt_math::{Pdf, SolidAngle, Vec3, warp};

use super::PhaseFunction;

/// Isotropic scattering, p = 1 / 4π.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Isotropic;

impl PhaseFunction for Isotropic {
    #[inline]
    fn pdf(&self, _wo: Vec3, _wi: Vec3) -> Pdf<SolidAngle> {
        warp::uniform_sphere_pdf()
    }

    #[inline]
    fn sample(&self, _wo: Vec3, u: [f32; 2]) -> Vec3 {
        warp::uniform_sphere(u)
    }

    fn examples() -> Vec<Self> {
        vec![Self]
    }
}
