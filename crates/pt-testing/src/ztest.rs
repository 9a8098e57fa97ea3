//! z-tests of the agreement of means up to noise.
//!
//! The means must be of enough samples that their tails are normally distributed: hundreds for
//! bounded values, more if rare bright samples occur.

use std::fmt;

use statrs::function::erf::erfc;

use crate::sidak;

/// Estimated means, each with its variance (the variance of the samples divided by their number).
#[derive(Clone, Copy, Debug)]
pub struct Estimates<'a> {
    /// Estimated means.
    pub mean: &'a [f32],
    /// Variances of the means; all zero for exact values.
    pub variance: &'a [f32],
}

/// Disagreement of means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ZFailure {
    /// Index of the value that differs most.
    pub index: usize,
    /// First mean.
    pub left: f64,
    /// Second mean.
    pub right: f64,
    /// Difference in standard errors.
    pub z: f64,
    /// Probability of a difference at least this large.
    pub p: f64,
    /// Probability below which a single value fails.
    pub level: f64,
    /// Number of values that fail.
    pub failing: usize,
}

impl fmt::Display for ZFailure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { index, left, right, z, p, level, failing } = self;
        write!(
            f,
            "value {index}: {left} and {right} are {z:.1} standard errors apart, \
             p = {p:.2e} < {level:.2e}; {failing} values fail"
        )
    }
}

impl std::error::Error for ZFailure {}

/// Relative error that sums in `f32` may have.
const ROUNDING: f64 = 1e-5;

/// Tests the agreement of two sets of estimates value by value. If they agree, the whole test fails
/// for a fraction `significance` of the seeds.
///
/// # Errors
/// If a value differs too much or is NaN, or if the lengths of the slices differ (then `index` is
/// the first one that is not in all of them).
pub fn z_test(a: Estimates<'_>, b: Estimates<'_>, significance: f64) -> Result<(), ZFailure> {
    let lengths = [a.mean.len(), a.variance.len(), b.mean.len(), b.variance.len()];
    let count = lengths.into_iter().min().unwrap_or(0);
    let level = sidak(significance, count);
    let compared = (0..count).map(|i| {
        let at = |values: &[f32]| f64::from(values[i]);
        compare(at(a.mean), at(b.mean), at(a.variance) + at(b.variance), i, level)
    });
    let failures: Vec<_> = compared.filter(|c| !passes(c)).collect();
    let failing = failures.len();
    if lengths.into_iter().any(|n| n != count) {
        let nan = f64::NAN;
        let index = count;
        return Err(ZFailure { index, left: nan, right: nan, z: nan, p: nan, level, failing });
    }
    match failures.into_iter().max_by(|x, y| x.z.total_cmp(&y.z)) {
        None => Ok(()),
        Some(worst) => Err(ZFailure { failing, ..worst }),
    }
}

/// Tests if samples have the mean `expected`; a correct estimator fails for a fraction
/// `significance` of the seeds.
///
/// # Errors
/// If the mean differs too much or is NaN, or there are fewer than two samples.
pub fn mean_z_test(samples: &[f64], expected: f64, significance: f64) -> Result<(), ZFailure> {
    let n = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / n;
    let squares: f64 = samples.iter().map(|x| (x - mean) * (x - mean)).sum();
    let result = compare(mean, expected, squares / (n - 1.0) / n, 0, significance);
    if passes(&result) { Ok(()) } else { Err(ZFailure { failing: 1, ..result }) }
}

/// Compares two means whose difference has this variance.
fn compare(left: f64, right: f64, variance: f64, index: usize, level: f64) -> ZFailure {
    let rounding = ROUNDING * left.abs().max(right.abs());
    let error = (variance + rounding * rounding).sqrt();
    let difference = (left - right).abs();
    let z = if difference == 0.0 && error == 0.0 { 0.0 } else { difference / error };
    let p = erfc(z * std::f64::consts::FRAC_1_SQRT_2);
    ZFailure { index, left, right, z, p, level, failing: 0 }
}

/// Returns true if the statistic is a number and its probability is not below the level.
fn passes(result: &ZFailure) -> bool {
    !result.z.is_nan() && result.p >= result.level
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Random;

    /// Means of `n` uniform numbers scaled to have the mean ½·`scale`, and their variances.
    fn image(scale: f64, n: u32, pixels: usize, seed: u64) -> (Vec<f32>, Vec<f32>) {
        let mut random = Random::new(seed);
        let mut pixel = || {
            let xs: Vec<f64> = (0..n).map(|_| scale * f64::from(random.unit())).collect();
            let mean = xs.iter().sum::<f64>() / f64::from(n);
            let square: f64 = xs.iter().map(|x| (x - mean).powi(2)).sum();
            (mean as f32, (square / f64::from(n - 1) / f64::from(n)) as f32)
        };
        (0..pixels).map(|_| pixel()).unzip()
    }

    fn test(a: &(Vec<f32>, Vec<f32>), b: &(Vec<f32>, Vec<f32>)) -> Result<(), ZFailure> {
        let a = Estimates { mean: &a.0, variance: &a.1 };
        z_test(a, Estimates { mean: &b.0, variance: &b.1 }, 1e-3)
    }

    #[test]
    fn equal_images_pass_and_others_fail() {
        let a = image(1.0, 256, 4000, 1);
        test(&a, &image(1.0, 300, 4000, 2)).unwrap();
        assert!(test(&a, &image(1.1, 256, 4000, 3)).unwrap_err().failing > 1);
        let mut spot = image(1.0, 256, 4000, 4);
        spot.0[1234] += 0.25;
        let failure = test(&a, &spot).unwrap_err();
        assert_eq!((failure.index, failure.failing), (1234, 1), "{failure}");
    }

    #[test]
    fn exact_values_need_to_be_equal_and_numbers() {
        let exact = |v: f32| (vec![v; 3], vec![0.0; 3]);
        test(&exact(0.0), &exact(0.0)).unwrap();
        test(&exact(2.0), &exact(2.000_01)).unwrap();
        assert!(test(&exact(2.0), &exact(2.001)).is_err());
        assert!(test(&exact(f32::NAN), &exact(1.0)).is_err());
        assert!(test(&exact(1.0), &(vec![1.0; 2], vec![0.0; 2])).is_err());
    }

    #[test]
    fn right_means_fail_as_often_as_the_level_says() {
        let mut random = Random::new(9);
        let mut fails = |expected: f64| {
            let samples: Vec<_> = (0..200).map(|_| f64::from(random.unit())).collect();
            mean_z_test(&samples, expected, 0.1).is_err()
        };
        let failures = (0..1000).filter(|_| fails(0.5)).count() as f64;
        assert!((failures - 100.0).abs() < 5.0 * 90f64.sqrt(), "{failures}");
        // 0.1 is five standard errors: (1/√12)/√200 = 0.0204.
        assert!((0..100).all(|_| fails(0.6)));
        assert!(mean_z_test(&[1.0], 1.0, 0.1).is_err());
    }
}
