//! Independent random numbers of one sample, without limit.

use super::independent::{pcg3d, pcg4d};
use super::unit;

/// Sequence of independent numbers, each a hash of its position; see [`super::Sampler::stream`].
#[derive(Clone, Copy, Debug)]
pub struct RngStream {
    key: [u32; 2],
    /// Position of the next number.
    next: u32,
}

impl RngStream {
    /// Stream `number` of a sample.
    #[inline]
    pub(super) fn new(key: [u32; 2], index: u32, number: [u32; 2]) -> Self {
        let [a, b, ..] = pcg4d([key[0], key[1], number[0], number[1]]);
        let [a, b, _] = pcg3d([a, b, index]);
        Self { key: [a, b], next: 0 }
    }

    /// Returns the next number in [0, 1).
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        self.next_2d()[0]
    }

    /// Returns the next point in [0, 1)².
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        let [x, y, _] = pcg3d([self.key[0], self.key[1], self.next]);
        self.next = self.next.wrapping_add(1);
        [unit(x), unit(y)]
    }
}
