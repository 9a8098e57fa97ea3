//! How a render tells what it is doing, and learns that it should stop.

/// How far a render is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgressUpdate {
    /// Samples that are in the film, or not needed.
    pub done: u64,
    /// Samples that there will be: hardly less, likely, and hardly more. The same but where an
    /// error target decides.
    pub estimated_totals: [u64; 3],
    /// Rays of this render so far.
    pub rays: u64,
    /// The [`Film::relative_error`](crate::Film::relative_error) at the end of the last pass over
    /// all pixels; with an error target what was measured last.
    pub error: Option<f64>,
}

impl ProgressUpdate {
    /// Samples that there will likely be.
    pub fn total(&self) -> u64 {
        self.estimated_totals[1]
    }
}

/// Listens to a render. Called from its threads.
pub trait Observer: Sync {
    /// More is done.
    fn progress(&self, _advance: &ProgressUpdate) {}
    /// Returns true if to stop at the next opportunity, keeping what is done.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Listens to nothing.
pub struct Silent;

impl Observer for Silent {}
