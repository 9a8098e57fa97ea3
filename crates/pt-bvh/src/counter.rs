//! Counting primitive tests, for nothing when nobody asks.

/// Receives numbers of primitive tests.
pub(crate) trait Counter {
    /// Adds `n()`, which is not called when nobody counts.
    fn add(&mut self, n: impl FnOnce() -> u64);
}

/// Does not count.
pub(crate) struct Off;

impl Counter for Off {
    #[inline]
    fn add(&mut self, _: impl FnOnce() -> u64) {}
}

impl Counter for u64 {
    #[inline]
    fn add(&mut self, n: impl FnOnce() -> u64) {
        *self += n();
    }
}
