//! How far a film of two halves is from the image of infinitely many samples, as it is displayed.
//!
//! A screen shows light between 0 and a white W: f(x) = min(max(x/W, 0), 1). With the means A and B
//! of the halves of a pixel and the image M = (A + B)/2, the square of (A − B)/2 has the variance
//! of M as its mean, whatever points the samples of a half are, since the halves know nothing of
//! each other. Where light is beyond the screen's range, the larger one of (f(A) − f(M))² and (f(B)
//! − f(M))² takes its place, which is the same within the range: a pixel of which one half
//! is far too bright, and so the image, is not told to be half as far away as it is.
//!
//! Where a film keeps coverage, its error counts as well: with ((αA − αB)/2)² of each pixel times
//! S/Sα, where S and Sα are the sums of squares of what is displayed and of the coverage, the
//! square of the relative error is the sum of those of light and of coverage, so that both are at
//! least as good as they were to be. Where all is black, it is that of coverage.

use super::Film;
use super::missing_mass::{ErrorBudget, MissingMass, deviations};

/// The root mean square error of a displayed image, as a share of the root of its mean square:
/// √(Σ(f(M) − f(μ))² / Σf(μ)²) over all pixels and channels, with the image M and that of
/// infinitely many samples, μ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorEstimate {
    /// The best guess.
    pub error: f64,
    /// The error of this image is hardly less,
    pub lower: f64,
    /// and hardly more.
    pub upper: f64,
}

impl ErrorEstimate {
    /// The best guess, hardly less, hardly more.
    pub fn to_array(self) -> [f64; 3] {
        [self.error, self.lower, self.upper]
    }
}

/// What the screen shows of light, if this is its white.
pub(super) fn displayed(light: f64, white: f64) -> f64 {
    (light / white).clamp(0.0, 1.0)
}

/// The squares of the differences of pixels between halves and image, and the squares of what is
/// displayed: each summed up over the channels.
fn squares([a, b]: [[f64; 3]; 2], white: f64) -> (f64, f64) {
    let of_channel = |c: usize| {
        let mean = displayed(0.5 * (a[c] + b[c]), white);
        let [off_a, off_b] = [a[c], b[c]].map(|half| (displayed(half, white) - mean).powi(2));
        (off_a.max(off_b), mean * mean)
    };
    (0..3).map(of_channel).fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
}

/// What the error of an image is made of: sums over pixels and channels of squares of what is
/// displayed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SquaredErrors {
    /// Of the error: the best guess.
    noise: f64,
    /// Its standard deviation.
    deviation: f64,
    /// What is displayed.
    signal: f64,
    /// Bound on the error due to features that no sample has hit.
    missing_mass: MissingMass,
    /// The fewest samples of a pixel that may hide something, in both halves.
    pub(crate) fewest: u32,
    /// With which probabilities the error may be more than is told.
    budget: ErrorBudget,
}

impl SquaredErrors {
    /// The greatest sum of squares for which the relative error is this: the mean square of a mean
    /// with an error is greater by the error's.
    pub(crate) fn allowed(&self, error: f64) -> f64 {
        let square = error * error;
        self.signal * square / (1.0 + square)
    }

    /// What the sum of squares of errors hardly exceeds, if the noise is `share` of what it is, and
    /// each pixel has at least so many samples.
    pub(crate) fn upper_bound(&self, share: f64, fewest: u32) -> f64 {
        share * self.noise + self.missing_mass.margin(share * self.deviation, fewest, self.budget)
    }

    /// The same if the error may be more with other probabilities.
    pub(crate) fn with_budget(self, budget: ErrorBudget) -> Self {
        Self { budget, ..self }
    }

    /// With how many samples of each pixel no more than this is hardly ever missed.
    pub(crate) fn samples_for_missing_mass(&self, square: f64) -> f64 {
        self.missing_mass.samples(-libm::log(self.budget.missing_mass), square)
    }

    /// As an error.
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

/// The variance of the sum of terms of pixels, row by row, or more: the squares of terms have the
/// squares of their means in them, and the products of terms that know nothing of each other,
/// `apart` columns apart, have no more of these (2ab ≤ a² + b²). Of halves that differ as normal
/// variables do it is a third, and never taken for more.
fn variance_of_sum(terms: &[f64], width: usize, apart: usize) -> f64 {
    let squares: f64 = terms.iter().map(|term| term * term).sum();
    let products =
        |row: &[f64]| -> f64 { row.iter().zip(row.iter().skip(apart)).map(|(a, b)| a * b).sum() };
    let products: f64 = terms.chunks(width.max(1)).map(products).sum();
    squares - products.min(squares / 3.0)
}

impl Film {
    /// What the error of the image of a film in halves is made of, if light of `white` is the
    /// brightest that the screen shows, errors of squares of `reuse`² pixels are the same, and
    /// it may be more than is told with the probabilities of `budget`. The interval is that in
    /// which the error of this image lies, and not only that of images like it: both are sums
    /// over pixels whose halves differ by chance, the one of (M − μ)², the other of (A − B)²/4,
    /// so that their difference has twice the variance of the latter (`variance_of_sum`).
    ///
    /// `None` if a pixel lacks samples.
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

    /// The square error of each displayed pixel, as [`Self::squared_errors`] sums it up: summed up
    /// over the channels, as a share of the square of white, and with that of coverage as a
    /// share of that of 1. `None` if a pixel lacks samples.
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
