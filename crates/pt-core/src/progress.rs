//! How a render tells what it is doing, and learns that it should stop.

/// Listens to a render. Called from its threads.
pub trait Observer: Sync {
    /// `done` of `total` samples are in the film, or not needed.
    fn progress(&self, _done: u64, _total: u64) {}
    /// Whether to stop at the next opportunity, keeping what is done.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Listens to nothing.
pub struct Silent;

impl Observer for Silent {}
