//! Error of the displayed image, estimated from the difference of two half buffers.
//!
//! The display clamps radiance at a white level W: f(x) = min(max(x/W, 0), 1). With the means A and
//! B of the halves of a pixel and the image M = (A + B)/2, the expected value of ((A − B)/2)² is
//! the variance of M for any sampler, since the halves are independent. Outside of the displayed
//! range, the larger of (f(A) − f(M))² and (f(B) − f(M))² replaces it, which is the same value
//! within the range: otherwise a pixel of which one half, and so the image, is far too bright would
//! be reported with half of its error.
//!
//! If the film keeps coverage, the error of the coverage is included: ((αA − αB)/2)² of each pixel
//! is added, times S/Sα, where S and Sα are the sums of squares of the displayed values and of the
//! coverage. The square of the relative error is then the sum of those of radiance and coverage, so
//! both meet the target. If the whole image is black, it is that of the coverage.

use super::Film;
use super::missing_mass::{ErrorBudget, MissingMass, deviations};
use crate::film::display::displayed;

/// Relative root mean square error of a displayed image: √(Σ(f(M) − f(μ))² / Σf(μ)²) over all
/// pixels and channels, where M is the image and μ the image of infinitely many samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// Best estimate.
    pub error: f64,
    /// Lower bound of the confidence interval.
    pub lower: f64,
    /// Upper bound of the confidence interval.
    pub upper: f64,
}

impl ErrorEstimate {
    /// Returns the best estimate, the lower bound and the upper bound.
    pub fn to_array(self) -> [f64; 3] {
        [self.error, self.lower, self.upper]
    }
}

/// Returns the square of the difference between the halves and the image of a pixel, and the square
/// of the displayed value, each summed over the channels.
fn squares([a, b]: [[f64; 3]; 2], white: f64) -> (f64, f64) {
    let of_channel = |c: usize| {
        let mean = displayed(0.5 * (a[c] + b[c]), white);
        let [off_a, off_b] = [a[c], b[c]].map(|half| (displayed(half, white) - mean).powi(2));
        (off_a.max(off_b), mean * mean)
    };
    (0..3).map(of_channel).fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

/// Components of the error of an image: sums of squares of displayed values over pixels and
/// channels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SquaredErrors {
    /// Best estimate of the squared error.
    noise: f64,
    /// Standard deviation of `noise`.
    deviation: f64,
    /// Sum of the squared displayed values.
    signal: f64,
    /// Bound on the error due to features that no sample has hit.
    missing_mass: MissingMass,
    /// Smallest number of samples, in both halves together, of the pixels that show more than
    /// background.
    pub(crate) fewest: u32,
    /// Probabilities with which the error may exceed its upper bound.
    budget: ErrorBudget,
}

impl SquaredErrors {
    /// Returns the largest sum of squared errors at which the relative error is at most `error`.
    /// The measured signal includes the squared error itself, hence the divisor 1 + `error`².
    pub(crate) fn allowed(&self, error: f64) -> f64 {
        let square = error * error;
        self.signal * square / (1.0 + square)
    }

    /// Returns an upper bound on the sum of squared errors if the noise is multiplied by `share`
    /// and each pixel has at least `fewest` samples.
    pub(crate) fn upper_bound(&self, share: f64, fewest: u32) -> f64 {
        share * self.noise + self.missing_mass.margin(share * self.deviation, fewest, self.budget)
    }

    /// Replaces the probabilities with which the error may exceed its upper bound.
    pub(crate) fn with_budget(self, budget: ErrorBudget) -> Self {
        Self { budget, ..self }
    }

    /// Returns the number of samples per pixel at which the squared error due to missing mass
    /// exceeds `square` with no more than the probability of the budget.
    pub(crate) fn samples_for_missing_mass(&self, square: f64) -> f64 {
        self.missing_mass.samples(-libm::log(self.budget.missing_mass), square)
    }

    /// Returns the relative error with its confidence interval.
    pub(crate) fn estimate(&self) -> ErrorEstimate {
        let relative = |sum: f64| match sum.max(0.0) {
            0.0 => 0.0,
            sum => (sum / (self.signal - sum).max(0.0)).sqrt(),
        };
        let least = self.noise - deviations(self.budget.noise) * self.deviation;
        let [error, least, most] =
            [self.noise, least, self.upper_bound(1.0, self.fewest)].map(relative);
        ErrorEstimate { error, lower: least, upper: most }
    }
}

/// Returns an upper bound on the variance of a sum over pixels, whose terms are given row by row.
///
/// The sum of the squared terms overestimates the variance by the squared means of the terms. The
/// products of terms that are `apart` columns apart, and so independent, are subtracted; their
/// expected value does not exceed that of the squared means (2ab ≤ a² + b²). If the halves differ
/// by normal variables, the squared means are a third of the squares; no more than this is
/// subtracted.
fn variance_of_sum(terms: &[f64], width: usize, apart: usize) -> f64 {
    let squares: f64 = terms.iter().map(|term| term * term).sum();
    let products =
        |row: &[f64]| -> f64 { row.iter().zip(row.iter().skip(apart)).map(|(a, b)| a * b).sum() };
    let products: f64 = terms.chunks(width.max(1)).map(products).sum();
    squares - products.min(squares / 3.0)
}

impl Film {
    /// Returns the components of the error of a film with half buffers, or `None` if a pixel lacks
    /// samples.
    ///
    /// Radiance is displayed up to `white`, pixels in squares of `reuse`² have the same error, and
    /// the upper bound may be exceeded with the probabilities of `budget`. The interval is that of
    /// the error of this image, and not of the expected error of such images: both (M − μ)² and
    /// (A − B)²/4 are random, so the difference of their sums has twice the variance of the latter
    /// (`variance_of_sum`).
    pub(crate) fn squared_errors(
        &self,
        white: f64,
        budget: ErrorBudget,
        reuse: u32,
    ) -> Option<SquaredErrors> {
        let (mut noise, mut signal, mut fewest) = (Vec::new(), 0.0, u32::MAX);
        let is_vacant = |i| self.plan.as_ref().is_some_and(|plan| plan.is_background_only(i));
        for (i, pixel) in self.pixels().enumerate() {
            let (difference, square) = squares(pixel.half_means()?, white);
            noise.push(difference);
            signal += square;
            if !is_vacant(i) {
                fewest = fewest.min(pixel.count());
            }
        }
        if let Some(coverage) = self.coverage() {
            let coverage: Vec<_> = coverage.collect();
            let square: f64 = coverage.iter().map(|pixel| pixel.mean().powi(2)).sum();
            let scale = if signal > 0.0 && square > 0.0 { signal / square } else { 1.0 };
            for (noise, pixel) in noise.iter_mut().zip(&coverage) {
                *noise += scale * pixel.square_error();
            }
            signal = if signal > 0.0 { signal } else { square };
        }
        let [width, apart] = [self.region.width, reuse].map(|n| n as usize);
        let alike = f64::from(reuse * reuse);
        let deviation = (2.0 * alike * variance_of_sum(&noise, width, apart)).sqrt();
        let (noise, missing_mass) = (noise.iter().sum(), self.missing_mass(white, reuse));
        Some(SquaredErrors { noise, deviation, signal, missing_mass, fewest, budget })
    }

    /// Returns the squared error of each displayed pixel, relative to the square of white and
    /// summed over the channels, plus that of its coverage. `None` if a pixel lacks samples.
    ///
    /// These are the terms of [`Self::squared_errors`], without the scale of the coverage.
    pub(crate) fn square_errors(&self, white: f64) -> Option<Vec<f64>> {
        let errors = self.pixels().map(|pixel| Some(squares(pixel.half_means()?, white).0));
        let mut errors: Vec<f64> = errors.collect::<Option<_>>()?;
        if let Some(coverage) = self.coverage() {
            errors
                .iter_mut()
                .zip(coverage)
                .for_each(|(error, pixel)| *error += pixel.square_error());
        }
        Some(errors)
    }
}
