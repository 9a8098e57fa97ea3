//! Per-pixel counts of object or material ids, from which Cryptomatte coverage is computed.

use smallvec::SmallVec;

/// Id of an object or material, with its number of samples in a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IdCount {
    /// Id of the object or material.
    pub number: u32,
    /// Number of samples with this id.
    pub samples: u32,
}

/// All ids that the samples of a pixel hit, in ascending order. Counts are exact and none is
/// omitted, so neither the order of samples nor their division into tiles or partial films changes
/// them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct IdCoverage(SmallVec<[IdCount; IN_PLACE]>);

/// Number of ids stored inline. Most pixels have one id, those on an edge two; more are allocated
/// on the heap.
const IN_PLACE: usize = 2;

/// Bytes per pixel that are estimated for ids: the pixel, on average as much again for pixels with
/// many ids, and 12 channels of the image that is made of them, once in memory and once in the
/// file.
pub(super) const THINGS_BYTES: usize = 2 * size_of::<IdCoverage>() + 2 * 12 * size_of::<f32>();

impl IdCoverage {
    /// Adds samples of an id.
    #[inline]
    pub(super) fn add(&mut self, IdCount { number, samples }: IdCount) {
        let place = self.0.partition_point(|seen| seen.number < number);
        match self.0.get_mut(place) {
            Some(seen) if seen.number == number => seen.samples += samples,
            _ => self.0.insert(place, IdCount { number, samples }),
        }
    }

    /// Adds the ids of another pixel.
    pub(super) fn merge(&mut self, other: &Self) {
        other.iter().for_each(|seen| self.add(seen));
    }

    /// Returns all ids in ascending order.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = IdCount> {
        self.0.iter().copied()
    }
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;

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
