//! Samples that a film rejects, so that a few invalid values cannot spoil the rest.

use std::fmt;

use pt_math::Spectrum;

use super::ExactSum;

/// Reason for rejecting a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum InvalidReason {
    /// A channel of the radiance is NaN.
    NotANumber,
    /// A channel is infinite.
    Infinite,
    /// A channel is negative.
    Negative,
    /// A channel, or its product with the filter weight, exceeds 2⁴⁸.
    TooLarge,
    /// An AOV of its surface is NaN or infinite, or exceeds that limit; its radiance may be valid.
    Surface,
}

impl InvalidReason {
    /// All reasons, in the order of the variants.
    pub const ALL: [Self; 5] =
        [Self::NotANumber, Self::Infinite, Self::Negative, Self::TooLarge, Self::Surface];

    /// Returns the reason for rejecting the radiance of a sample with filter weight `weight`, or
    /// `None` if it is valid.
    pub fn of(light: Spectrum, weight: f32) -> Option<Self> {
        let any = |is: fn(f32) -> bool| light.to_array().into_iter().any(is);
        if any(f32::is_nan) {
            Some(Self::NotANumber)
        } else if any(f32::is_infinite) {
            Some(Self::Infinite)
        } else if any(|x| x < 0.0) {
            Some(Self::Negative)
        } else if any(|x| x > ExactSum::LIMIT)
            || light.0.max_element() * weight.abs() > ExactSum::LIMIT
        {
            Some(Self::TooLarge)
        } else {
            None
        }
    }

    /// Returns the reason with this number, as in `reason as u32`.
    pub(super) fn from_number(number: u32) -> Option<Self> {
        Self::ALL.get(number as usize).copied()
    }
}

/// As in "2 samples are …".
impl fmt::Display for InvalidReason {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotANumber => "not a number",
            Self::Infinite => "infinite",
            Self::Negative => "negative",
            Self::TooLarge => "too large",
            Self::Surface => "of a surface that is no number",
        })
    }
}

/// A rejected sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct InvalidSample {
    /// Row, from the top.
    pub y: u32,
    /// Column.
    pub x: u32,
    /// Index of the sample.
    pub sample: u32,
    /// Reason for its rejection.
    pub reason: InvalidReason,
}

/// Rejected samples: the number for each [`InvalidReason`], and the first ones. A sample with both
/// invalid radiance and invalid AOVs is listed twice.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InvalidSamples {
    /// Number of rejected samples for each reason, in the order of [`InvalidReason::ALL`].
    pub counts: [u64; InvalidReason::ALL.len()],
    /// The first rejected samples, ordered by row, column and sample index.
    pub first: Vec<InvalidSample>,
}

impl InvalidSamples {
    const KEPT: usize = 16;

    /// Returns the total number of rejections.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    pub(super) fn add(&mut self, rejected: InvalidSample) {
        self.counts[rejected.reason as usize] += 1;
        self.keep(&[rejected]);
    }

    fn keep(&mut self, more: &[InvalidSample]) {
        self.first.extend_from_slice(more);
        self.first.sort_unstable();
        self.first.truncate(Self::KEPT);
    }

    /// Adds the rejected samples of another film.
    pub fn merge(&mut self, other: &Self) {
        self.counts.iter_mut().zip(other.counts).for_each(|(n, more)| *n += more);
        self.keep(&other.first);
    }
}

/// As in "2 not a number, 1 negative"; empty if there are none.
impl fmt::Display for InvalidSamples {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = InvalidReason::ALL.into_iter().zip(self.counts).filter(|(_, n)| *n > 0);
        let words: Vec<_> = counts.map(|(reason, n)| format!("{n} {reason}")).collect();
        f.write_str(&words.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_distinguished() {
        let of = |x| InvalidReason::of(Spectrum::rgb(1.0, x, 0.5), 1.0);
        assert_eq!(of(f32::NAN), Some(InvalidReason::NotANumber));
        assert_eq!(of(f32::INFINITY), Some(InvalidReason::Infinite));
        assert_eq!(of(-f32::INFINITY), Some(InvalidReason::Infinite));
        assert_eq!(of(-1e-30), Some(InvalidReason::Negative));
        assert_eq!(of(2.0 * ExactSum::LIMIT), Some(InvalidReason::TooLarge));
        assert_eq!(
            InvalidReason::of(Spectrum::rgb(f32::INFINITY, f32::NAN, -1.0), 1.0),
            Some(InvalidReason::NotANumber)
        );
        let bright = Spectrum::splat(0.75 * ExactSum::LIMIT);
        assert_eq!(InvalidReason::of(bright, -1.5), Some(InvalidReason::TooLarge));
        assert_eq!(InvalidReason::of(bright, -0.5), None);
        for x in [0.0, -0.0, 1e-40, ExactSum::LIMIT] {
            assert_eq!(of(x), None, "{x}");
        }
        for (i, reason) in InvalidReason::ALL.into_iter().enumerate() {
            assert_eq!(reason as usize, i);
            assert_eq!(InvalidReason::from_number(i as u32), Some(reason));
        }
        assert_eq!(InvalidReason::from_number(5), None);
    }

    #[test]
    fn the_first_are_named_whatever_the_order_in_which_they_come() {
        let all: Vec<_> = (0..40u32)
            .map(|i| InvalidSample {
                y: i / 8,
                x: i % 8,
                sample: i,
                reason: InvalidReason::ALL[i as usize % 5],
            })
            .collect();
        let of = |list: &[InvalidSample]| {
            let mut invalid_samples = InvalidSamples::default();
            for &rejected in list {
                invalid_samples.add(rejected);
            }
            invalid_samples
        };
        let forward = of(&all);
        let backward = of(&all.iter().rev().copied().collect::<Vec<_>>());
        let mut merged = of(&all[25..]);
        merged.merge(&of(&all[..25]));
        assert_eq!((&backward, &merged), (&forward, &forward));
        assert_eq!((forward.count(), forward.first.as_slice()), (40, &all[..16]));
        assert_eq!(
            of(&all[..7]).to_string(),
            "2 not a number, 2 infinite, 1 negative, 1 too large, 1 of a surface that is no number"
        );
    }
}
