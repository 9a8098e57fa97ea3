//! Optional counting of primitive tests, without cost when disabled.

/// Counter of primitive tests.
pub(crate) trait Counter {
    /// Adds `n()`, which is not evaluated if counting is disabled.
    fn add(&mut self, n: impl FnOnce() -> u64);
}

/// Disabled counter.
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
