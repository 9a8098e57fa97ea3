//! Sums of a single pixel.

use pt_math::color::luminance;

use super::RadianceSums;

/// Sums of samples and their number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Moments {
    pub(super) sums: RadianceSums,
    pub(super) count: u32,
}

impl Moments {
    /// Mean radiance; black without samples.
    pub(super) fn mean(&self) -> [f64; 3] {
        let n = f64::from(self.count.max(1));
        self.sums.light.map(|s| s.value() / n)
    }

    /// Returns the mean luminance and the variance of a sample, with Bessel's correction:
    /// (Σy² − (Σy)²/n)/(n − 1). The variance is infinite for fewer than two samples.
    pub(super) fn luminance(&self) -> (f64, f64) {
        let mean = luminance(self.mean());
        if self.count < 2 {
            return (mean, f64::INFINITY);
        }
        let n = f64::from(self.count);
        let squares = self.sums.squares;
        (mean, (squares.value() - n * mean * mean).max(0.0) / (n - 1.0))
    }
}

/// Sums of one pixel, in one or two half buffers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelSums {
    first: Moments,
    second: Option<Moments>,
}

impl PixelSums {
    pub(super) fn new(first: Moments, second: Option<Moments>) -> Self {
        Self { first, second }
    }

    /// Number of samples in both halves together.
    #[inline]
    pub fn count(&self) -> u32 {
        self.first.count + self.second.map_or(0, |second| second.count)
    }

    /// Returns the halves that have samples: the first, the second, or both.
    fn halves(&self) -> (Moments, Option<Moments>) {
        match self.second {
            Some(second) if self.first.count == 0 => (second, None),
            second => (self.first, second.filter(|second| second.count > 0)),
        }
    }

    /// Mean radiance; black without samples. With two halves, the mean of their means, whatever
    /// their numbers of samples: the weight of a half must not depend on its values.
    pub fn mean(&self) -> [f64; 3] {
        match self.halves() {
            (half, None) => half.mean(),
            (first, Some(second)) => {
                let (a, b) = (first.mean(), second.mean());
                [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]))
            }
        }
    }

    /// Mean radiance of each half, or `None` unless both have samples.
    pub fn half_means(&self) -> Option<[[f64; 3]; 2]> {
        let (first, second) = self.halves();
        second.map(|second| [first.mean(), second.mean()])
    }

    /// Returns the means of the luminance of a sample and of its square, over both halves; 0
    /// without samples.
    pub(super) fn luminances(&self) -> (f64, f64) {
        let of_half = |half: Moments| {
            let squares = half.sums.squares;
            (half.luminance().0, squares.value() / f64::from(half.count.max(1)))
        };
        match self.halves() {
            (half, None) => of_half(half),
            (first, Some(second)) => {
                let (a, b) = (of_half(first), of_half(second));
                (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1))
            }
        }
    }

    /// Returns the mean luminance and its standard error: σ/√n with the sample variance
    /// σ² = (Σy² − (Σy)²/n)/(n − 1). The error is infinite for fewer than two samples (in each
    /// half).
    pub fn luminance(&self) -> (f64, f64) {
        let of_half = |half: Moments| {
            let (mean, variance) = half.luminance();
            (mean, variance / f64::from(half.count.max(1)))
        };
        let (mean, square) = match self.halves() {
            (half, None) => of_half(half),
            (first, Some(second)) => {
                let ((a, of_a), (b, of_b)) = (of_half(first), of_half(second));
                (0.5 * (a + b), 0.25 * (of_a + of_b))
            }
        };
        (mean, square.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use pt_math::Spectrum;

    use super::*;

    fn moments(samples: &[f32]) -> Moments {
        let mut sums = RadianceSums::default();
        for &v in samples {
            sums.add(Spectrum::splat(v));
        }
        Moments { sums, count: samples.len() as u32 }
    }

    /// With means 2 and 5 and sample variances 2 and 3, the mean of both has the variance
    /// (2/2 + 3/3)/4.
    #[test]
    fn halves_count_the_same_whatever_they_have() {
        let (two, three) = (moments(&[1.0, 3.0]), moments(&[3.0, 6.0, 6.0]));
        let both = PixelSums::new(two, Some(three));
        assert_eq!((both.count(), both.mean()), (5, [3.5; 3]));
        assert_eq!(both.half_means(), Some([[2.0; 3], [5.0; 3]]));
        let (mean, error) = both.luminance();
        assert!((mean - 3.5).abs() < 1e-12 && (error - 0.5f64.sqrt()).abs() < 1e-12, "{error}");
    }

    #[test]
    fn a_half_without_samples_counts_nothing() {
        let (half, none) = (moments(&[1.0, 3.0]), moments(&[]));
        let alone = PixelSums::new(half, None);
        for pixel in [PixelSums::new(half, Some(none)), PixelSums::new(none, Some(half))] {
            assert_eq!(pixel.mean(), alone.mean());
            assert_eq!(pixel.luminance(), alone.luminance());
            assert_eq!(pixel.half_means(), None);
        }
        assert_eq!(PixelSums::default().luminance(), (0.0, f64::INFINITY));
        assert_eq!(moments(&[2.0]).sums.squares.value(), 4.0);
    }
}
