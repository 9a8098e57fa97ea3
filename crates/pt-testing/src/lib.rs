//! Statistical tests for the tests of pathtracer.
//!
//! * [`chi2`]: agreement of a sampling routine with its density.
//! * [`ztest`]: agreement of two images, or of a mean with its expected value, up to noise.
//! * [`blocks`]: differences of two images by blocks of pixels.
//! * [`irradiance`]: closed forms of the irradiance due to lights.
//! * [`random`]: deterministic random input.
//! * [`without_panics`]: absence of panics, which readers would convert into errors.
//!
//! All of them are deterministic, so a test that passes keeps passing; the significance is the
//! fraction of seeds with which a correct routine fails.

pub mod blocks;
pub mod chi2;
pub mod course;
mod integrate;
pub mod irradiance;
pub mod output;
mod panics;
pub mod random;
pub mod ztest;

pub use blocks::{Block, BlockReport, compare_blocks};
pub use chi2::{Chi2, Chi2Failure, chi2_cone, chi2_sphere, chi2_square};
pub use panics::without_panics;
pub use random::Random;
pub use ztest::{Estimates, ZFailure, mean_z_test, z_test};

/// Level α' of each of n independent tests that together have the level α: 1 − (1 − α')ⁿ = α.
/// [Šidák 1967]
pub fn sidak(significance: f64, tests: usize) -> f64 {
    -((-significance).ln_1p() / tests.max(1) as f64).exp_m1()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corrected_tests_together_have_the_level_asked_for() {
        for tests in [1, 7, 100_000u32] {
            let together = 1.0 - (1.0 - sidak(0.01, tests as usize)).powf(f64::from(tests));
            assert!((together - 0.01).abs() < 1e-9, "{tests}: {together}");
        }
    }
}
