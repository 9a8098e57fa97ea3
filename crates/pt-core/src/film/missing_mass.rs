//! What no sample of an image has found.
//!
//! A pixel may hold a small bright thing (the reflection of the sun in a ball) that none of its n
//! samples met. How much samples differ knows nothing of it. But if every sample of pixel i finds
//! one with probability pᵢ, none of all pixels finds any with probability q = exp(−Σnpᵢ), and then
//! the image lacks −b ln q/n of light in all, if they are as bright as b. Nothing that is rarer
//! than what was seen is taken to be brighter than it, so b is that of the brightest samples of the
//! image. The sum of squares of errors is greatest where one pixel lacks it alone or, as pixels are
//! at worst black in place of white, as few as can. (That what was seen rarely tells of what was
//! not seen: Good, "The Population Frequencies of Species and the Estimation of Population
//! Parameters", Biometrika 40, 1953.)
//!
//! In large images it is next to nothing of the whole; in small ones it says how many samples a
//! single pixel needs.

use super::Film;
use super::error_estimate::displayed;
use super::pixel::PixelSums;

/// Number of values of −ln q that are tried.
const STEPS: u32 = 40;

/// What the sum of squares of errors by things that no sample has found follows from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MissingMass {
    /// How bright things are, as a share of white.
    brightness: f64,
    /// How dark a pixel is at worst in place of white.
    max_darkening: f64,
    /// Number of pixels that share their samples.
    pixels_per_sample: f64,
}

impl MissingMass {
    /// The greatest sum if each pixel has so many samples, and all are missed with probability
    /// exp(−`rarity`).
    fn square(&self, rarity: f64, samples: u32) -> f64 {
        let share = rarity * self.brightness / f64::from(samples.max(1));
        self.pixels_per_sample * share * share.min(self.max_darkening)
    }

    /// With how many samples of each pixel that sum is `square`, which is above 0.
    pub(crate) fn samples(&self, rarity: f64, square: f64) -> f64 {
        let square = square / self.pixels_per_sample;
        let share = square.sqrt().max(square / self.max_darkening.max(f64::MIN_POSITIVE));
        rarity * self.brightness / share
    }

    /// By how much an error is more than what was found, whose standard deviation is `deviation`,
    /// if each pixel has so many samples: at most but with the probabilities of `budget`,
    /// whatever the things are that no sample found.
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
        // What lies beyond is less than exp(−½ · 40²).
        smallest_where(40.0 * deviation + greatest, |margin| {
            let is_off = |missed: f64| beyond((margin - missed) / deviation);
            let nothing = is_off(0.0);
            let is_off = |&(q, sum): &(f64, f64)| q * is_off(sum) + (1.0 - q) * nothing;
            missed.iter().map(is_off).fold(0.0, f64::max) <= budget.noise
        })
    }
}

/// With which probabilities an error may be more than is told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ErrorBudget {
    /// At one look at a film.
    pub(crate) noise: f64,
    /// At all looks together, by things that no sample found, beside: what was missed by many
    /// samples, was missed by fewer, so the probability that something is missed which matters
    /// is that at the first look that could be wrong by it.
    pub(crate) missing_mass: f64,
}

/// The probability with which a normal variable exceeds its mean by so many standard deviations.
fn beyond(deviations: f64) -> f64 {
    0.5 * libm::erfc(deviations * std::f64::consts::FRAC_1_SQRT_2)
}

/// Returns the number of standard deviations that a normal variable exceeds with this probability,
/// in (0, ½].
pub(crate) fn deviations(probability: f64) -> f64 {
    smallest_where(40.0, |deviations| beyond(deviations) <= probability)
}

/// The least value from 0 to `most` where this is true, if it stays so.
fn smallest_where(most: f64, is: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (0.0, most);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if is(middle) { &mut high } else { &mut low }) = middle;
    }
    high
}

/// How bright the samples are to which a pixel owes its light: Σy²/Σy of their luminances y, in the
/// colour of the pixel, as the length of a vector of red, green and blue.
fn brightness(pixel: PixelSums) -> f64 {
    let (luminance, of_squares) = pixel.luminances();
    let length = pixel.mean().iter().map(|v| v * v).sum::<f64>().sqrt();
    if luminance > 0.0 { length * of_squares / (luminance * luminance) } else { 0.0 }
}

/// How far a pixel is from white, as a length likewise.
fn darkness(pixel: PixelSums, white: f64) -> f64 {
    let off = pixel.mean().map(|v| 1.0 - displayed(v, white));
    off.iter().map(|v| v * v).sum::<f64>().sqrt()
}

impl Film {
    /// What no sample of it may have found, if squares of `reuse`² pixels have the same samples.
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
    use super::*;
    use pt_testing::Random;

    /// From tables of the normal distribution.
    #[test]
    fn deviations_are_those_of_the_normal_distribution() {
        for (probability, wanted) in [(0.5, 0.0), (0.025, 1.959_964), (0.001_25, 3.023_341)] {
            let found = deviations(probability);
            assert!((found - wanted).abs() < 1e-5, "{probability}: {found}");
        }
    }

    /// Of things that are a hundred times as bright as white, and of those that cannot be seen.
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

    /// Images with normal noise and one pixel that holds a thing, which all samples miss with
    /// different probabilities: the margin is exceeded as often as was said, and with the worst
    /// of them hardly less.
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
