//! Paths that have split behind the first surface where they scattered.

use pt_math::sampler::Sampler;

use super::Starts;
use super::front::State;

/// The number of ways that each start has, a power of two. The ways of all starts are numbered start by start.
#[derive(Clone, Copy)]
pub(super) struct Ways {
    log2: u32,
}

impl Ways {
    pub(super) const ONE: Self = Self { log2: 0 };

    /// So many.
    pub(super) fn new(count: u32) -> Self {
        debug_assert!(count.is_power_of_two());
        Self { log2: count.trailing_zeros() }
    }

    pub(super) fn count(self) -> u32 {
        1 << self.log2
    }

    /// The number of a way of a start.
    pub(super) fn number(self, start: u32, way: u32) -> u32 {
        start << self.log2 | way
    }

    /// The start of the way with this number.
    #[inline(always)]
    pub(super) fn start(self, number: u32) -> usize {
        (number >> self.log2) as usize
    }

    /// Its numbers.
    #[inline(always)]
    pub(super) fn sampler(self, starts: &Starts, number: u32) -> Sampler {
        let whole = starts.samplers.get(self.start(number));
        whole.split(self.log2, number & (self.count() - 1))
    }

    /// The time of path number `i`. Where nothing moves, the path is not looked at.
    #[inline(always)]
    pub(super) fn time(self, starts: &Starts, paths: &[State], i: usize) -> f32 {
        if starts.times.is_empty() { 0.0 } else { starts.time(self.start(paths[i].start)) }
    }
}
