//! Which things the samples of a pixel see, and how many see each: of what mattes are made.

use smallvec::SmallVec;

/// A thing that samples of a pixel see.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdCount {
    /// Its number.
    pub number: u32,
    /// Number of samples that see it.
    pub samples: u32,
}

/// All things that the samples of a pixel see, in the order of their numbers. Counts are exact and
/// none is left out, so that neither the order of samples nor how they are shared out changes them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct IdCoverage(SmallVec<[IdCount; IN_PLACE]>);

/// Most pixels see one thing, those on an edge two; more have memory of their own.
const IN_PLACE: usize = 2;

/// Bytes per pixel that are reckoned for them: the pixel, on average as much again for those that
/// see more, and 12 numbers of the image that is made of them, once as a channel and once in the
/// file.
pub(super) const THINGS_BYTES: usize = 2 * size_of::<IdCoverage>() + 2 * 12 * size_of::<f32>();

impl IdCoverage {
    /// Counts more samples of a thing.
    #[inline]
    pub(super) fn add(&mut self, IdCount { number, samples }: IdCount) {
        let place = self.0.partition_point(|seen| seen.number < number);
        match self.0.get_mut(place) {
            Some(seen) if seen.number == number => seen.samples += samples,
            _ => self.0.insert(place, IdCount { number, samples }),
        }
    }

    /// Adds those of another pixel.
    pub(super) fn merge(&mut self, other: &Self) {
        other.iter().for_each(|seen| self.add(seen));
    }

    /// All of them.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = IdCount> {
        self.0.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use pt_testing::Random;

    fn of(numbers: &[u32]) -> IdCoverage {
        let mut ids = IdCoverage::default();
        for &number in numbers {
            ids.add(IdCount { number, samples: 1 });
        }
        ids
    }

    #[test]
    fn neither_order_nor_parts_change_what_is_seen() {
        let mut random = Random::new(5);
        for kinds in [1, 2, 3, 9, 200] {
            let mut numbers: Vec<_> = (0..300).map(|_| random.below(kinds) as u32).collect();
            let whole = of(&numbers);
            assert!(whole.iter().map(|seen| seen.number).is_sorted_by(|a, b| a < b));
            for seen in whole.iter() {
                let count = numbers.iter().filter(|number| **number == seen.number).count();
                assert_eq!(seen.samples as usize, count);
            }
            assert_eq!(whole.iter().map(|seen| seen.samples).sum::<u32>(), 300);
            for _ in 0..10 {
                let (at, other) = (random.below(300), random.below(300));
                numbers.swap(at, other);
                let (first, second) = numbers.split_at(at);
                let mut sum = of(second);
                sum.merge(&of(first));
                assert_eq!(sum, whole);
            }
        }
    }

    #[test]
    fn a_pixel_that_sees_two_things_takes_24_bytes() {
        assert_eq!(size_of::<IdCoverage>(), 24);
        assert!(!of(&[7, 3, 7]).0.spilled());
        assert!(of(&[1, 2, 3]).0.spilled());
    }
}
