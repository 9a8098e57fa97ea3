//! Statistical tests for the tests of pathtracer.
//!
//! * [`chi2`]: does a sampling routine follow the density it states?
//! * [`ztest`]: do two images, or a mean and its expected value, agree up to noise?
//! * [`blocks`]: how far do two images differ, block of pixels by block of pixels?
//! * [`irradiance`]: what should lights bring?
//! * [`random`]: deterministic random input.
//!
//! All of them are deterministic, so a test that passes keeps passing; the significance is the
//! share of seeds with which a correct routine fails.

pub mod blocks;
pub mod chi2;
pub mod course;
mod integrate;
pub mod irradiance;
pub mod output;
pub mod random;
pub mod ztest;

pub use blocks::{Block, BlockReport, compare_blocks};
pub use chi2::{Chi2, Chi2Failure, chi2_cone, chi2_sphere, chi2_square};
pub use random::Random;
pub use ztest::{Estimates, ZFailure, mean_z_test, z_test};

/// The level α' of each of n independent tests with which all of them together are at level α:
/// 1 − (1 − α')ⁿ = α. [Šidák 1967]
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
