//! Bound on the error due to features that no sample has hit (missing mass).
//!
//! A pixel may contain a small bright feature (the reflection of the sun in a ball) that none of
//! its n samples has hit; the variance of the samples does not reveal it. If every sample of pixel
//! i hits one with probability pᵢ, then no sample of any pixel hits one with probability
//! q = exp(−Σnpᵢ), and the image lacks a total radiance of −b ln q/n, where b is the radiance of
//! the features. Features that are rarer than the observed ones are assumed not to be brighter, so
//! b is that of the brightest samples of the image. The sum of squared errors is largest if one
//! pixel lacks all of it or, since a pixel is at worst black instead of white, as few pixels as
//! possible. (Rare observations estimate the probability of unobserved ones: Good, "The Population
//! Frequencies of Species and the Estimation of Population Parameters", Biometrika 40, 1953.)
//!
//! In large images this is a negligible part of the error; in small ones it determines the number
//! of samples that every pixel needs.

use super::Film;
use super::display::displayed;
use super::pixel::PixelSums;

/// Number of values of −ln q that are tried.
const STEPS: u32 = 40;

/// Parameters of the bound on the sum of squared errors due to features that no sample has hit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MissingMass {
    /// Radiance of the features, relative to white.
    brightness: f64,
    /// Largest distance of a displayed pixel to white, which bounds its error due to missing
    /// radiance.
    max_darkening: f64,
    /// Number of pixels that share their samples.
    pixels_per_sample: f64,
}

impl MissingMass {
    /// Returns the largest sum of squared errors if each pixel has `samples` samples and all
    /// features are missed with probability exp(−`rarity`).
    fn square(&self, rarity: f64, samples: u32) -> f64 {
        let share = rarity * self.brightness / f64::from(samples.max(1));
        self.pixels_per_sample * share * share.min(self.max_darkening)
    }

    /// Returns the number of samples per pixel at which that sum is `square`, which must be
    /// positive.
    pub(crate) fn samples(&self, rarity: f64, square: f64) -> f64 {
        let square = square / self.pixels_per_sample;
        let share = square.sqrt().max(square / self.max_darkening.max(f64::MIN_POSITIVE));
        rarity * self.brightness / share
    }

    /// Returns the margin between the estimated sum of squared errors, whose standard deviation is
    /// `deviation`, and its upper bound, if each pixel has `samples` samples. The bound is exceeded
    /// with at most the probabilities of `budget`, whatever features no sample has hit.
    pub(crate) fn margin(&self, deviation: f64, samples: u32, budget: ErrorBudget) -> f64 {
        let rarest = -libm::log(budget.missing_mass);
        let missed: Vec<(f64, f64)> = (0..=STEPS)
            .map(|step| f64::from(step) / f64::from(STEPS) * rarest)
            .map(|rarity| (libm::exp(-rarity), self.square(rarity, samples)))
            .collect();
        let greatest = missed.last().map_or(0.0, |missed| missed.1);
        if deviation <= 1e-9 * greatest {
            return greatest;
        }
        // The probability beyond is less than exp(−½ · 40²).
        smallest_where(40.0 * deviation + greatest, |margin| {
            let is_off = |missed: f64| beyond((margin - missed) / deviation);
            let nothing = is_off(0.0);
            let is_off = |&(q, sum): &(f64, f64)| q * is_off(sum) + (1.0 - q) * nothing;
            missed.iter().map(is_off).fold(0.0, f64::max) <= budget.noise
        })
    }
}

/// Probabilities with which an error may exceed its upper bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ErrorBudget {
    /// For a single evaluation of a film, due to noise.
    pub(crate) noise: f64,
    /// For all evaluations together, due to missing mass, in addition. Features that many samples
    /// miss were missed by fewer samples before, so the probability that a relevant feature is
    /// missed is that at the first evaluation which it could invalidate.
    pub(crate) missing_mass: f64,
}

/// Returns the probability that a normal variable exceeds its mean by this number of standard
/// deviations.
fn beyond(deviations: f64) -> f64 {
    0.5 * libm::erfc(deviations * std::f64::consts::FRAC_1_SQRT_2)
}

/// Returns the number of standard deviations that a normal variable exceeds with this probability,
/// which must be in (0, ½].
pub(crate) fn deviations(probability: f64) -> f64 {
    smallest_where(40.0, |deviations| beyond(deviations) <= probability)
}

/// Returns the smallest value from 0 to `most` for which `is` is true, by bisection. `is` must stay
/// true above it.
fn smallest_where(most: f64, is: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if is(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

/// Returns the brightness of the samples that make up a pixel: Σy²/Σy of their luminances y, in the
/// colour of the pixel, as the length of an RGB vector.
fn brightness(pixel: PixelSums) -> f64 {
    let (luminance, of_squares) = pixel.luminances();
    let length = pixel.mean().iter().map(|v| v * v).sum::<f64>().sqrt();
    if luminance > 0.0 { length * of_squares / (luminance * luminance) } else { 0.0 }
}

/// Returns the distance of a displayed pixel to white, as the length of an RGB vector.
fn darkness(pixel: PixelSums, white: f64) -> f64 {
    let off = pixel.mean().map(|v| 1.0 - displayed(v, white));
    off.iter().map(|v| v * v).sum::<f64>().sqrt()
}

impl Film {
    /// Returns the parameters of the missing-mass bound, if pixels in squares of `reuse`² share
    /// their samples.
    pub(super) fn missing_mass(&self, white: f64, reuse: u32) -> MissingMass {
        let most = |of: &dyn Fn(PixelSums) -> f64| self.pixels().map(of).fold(0.0, f64::max);
        MissingMass {
            brightness: most(&brightness) / white,
            max_darkening: most(&|pixel| darkness(pixel, white)),
            pixels_per_sample: f64::from(reuse * reuse),
        }
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;

    /// From tables of the normal distribution.
    #[test]
    fn deviations_are_those_of_the_normal_distribution() {
        for (probability, wanted) in [(0.5, 0.0), (0.025, 1.959_964), (0.001_25, 3.023_341)] {
            let found = deviations(probability);
            assert!((found - wanted).abs() < 1e-5, "{probability}: {found}");
        }
    }

    /// For features that are a hundred times as bright as white, and for invisible ones.
    #[test]
    fn margins_are_those_of_noise_or_of_what_is_unseen_where_the_other_is_small() {
        let sun = MissingMass { brightness: 100.0, max_darkening: 1.7, pixels_per_sample: 1.0 };
        let budget = ErrorBudget { noise: 0.025, missing_mass: 0.01 };
        let noise = sun.margin(3.0, u32::MAX, budget);
        assert!((noise / (1.959_964 * 3.0) - 1.0).abs() < 1e-5, "{noise}");
        for samples in [16, 1000, 30_000] {
            let missing_mass = sun.margin(0.0, samples, budget);
            let rarity = -libm::log(budget.missing_mass);
            let missed = rarity * 100.0 / f64::from(samples);
            assert!(
                (missing_mass - missed * missed.min(1.7)).abs() < 1e-9 * missing_mass,
                "{missing_mass}"
            );
            assert!((sun.samples(rarity, missing_mass) / f64::from(samples) - 1.0).abs() < 1e-9);
            let both = sun.margin(missing_mass, samples, budget);
            assert!(
                both > missing_mass.max(1.96 * missing_mass) && both < 2.96 * missing_mass,
                "{missing_mass} {both}"
            );
        }
        assert_eq!(MissingMass { max_darkening: 0.0, ..sun }.margin(0.0, 16, budget), 0.0);
    }

    /// For images with normal noise and one pixel with a feature that all samples miss with
    /// different probabilities: the margin is exceeded with the stated probability at most, and for
    /// the worst of them with hardly less.
    #[test]
    fn a_margin_is_exceeded_as_often_as_is_said() {
        let mut random = Random::new(11);
        let thing = MissingMass { brightness: 40.0, max_darkening: 1.7, pixels_per_sample: 1.0 };
        let (samples, deviation) = (200, 0.05);
        let budget = ErrorBudget { noise: 0.04, missing_mass: 0.01 };
        let margin = thing.margin(deviation, samples, budget);
        let mut normal = || {
            let radius = (-2.0 * libm::log(1.0 - f64::from(random.unit()))).sqrt();
            radius * libm::cos(std::f64::consts::TAU * f64::from(random.unit()))
        };
        let normals: Vec<f64> = (0..40_000).map(|_| normal()).collect();
        let exceeded =
            [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 6.0].map(|rarity: f64| {
                let missed = thing.square(rarity, samples);
                let share = |missed: f64| {
                    let off = normals.iter().filter(|&n| n * deviation + missed > margin).count();
                    off as f64 / normals.len() as f64
                };
                let q = libm::exp(-rarity);
                q * share(missed) + (1.0 - q) * share(0.0)
            });
        let most = exceeded.into_iter().fold(0.0, f64::max);
        assert!(most < 1.05 * budget.noise && most > 0.8 * budget.noise, "{exceeded:?}");
    }
}
