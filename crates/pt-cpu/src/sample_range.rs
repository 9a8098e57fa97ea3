//! Ranges of samples of pixels, and their division into batches.

use std::ops::Range;

/// Consecutive samples of one pixel.
#[derive(Clone, Debug)]
pub(crate) struct SampleRange {
    /// Column and row.
    pub(crate) pixel: [u32; 2],
    pub(crate) samples: Range<u32>,
    /// Samples among them that the film lacks; the others are only used by other pixels.
    pub(crate) kept: Range<u32>,
    /// Number of pixels of its reuse group that follow.
    pub(crate) rest_of_group: u32,
}

impl SampleRange {
    /// Samples of a pixel outside of a reuse group.
    pub(crate) fn single(pixel: [u32; 2], samples: Range<u32>) -> Self {
        Self { pixel, kept: samples.clone(), samples, rest_of_group: 0 }
    }
}

/// Splits ranges into batches of at most `size` samples; a larger range is a batch of its own.
pub(crate) fn batches(
    mut ranges: &[SampleRange],
    size: usize,
) -> impl Iterator<Item = &[SampleRange]> {
    std::iter::from_fn(move || {
        let [mut samples, mut n] = [0; 2];
        while let Some(range) = ranges.get(n) {
            let group = range.rest_of_group as usize + 1;
            samples += group * range.samples.len();
            if n > 0 && samples > size {
                break;
            }
            n += group;
        }
        let (batch, rest) = ranges.split_at_checked(n.max(1))?;
        ranges = rest;
        Some(batch)
    })
}
