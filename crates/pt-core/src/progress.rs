//! Progress reports and cancellation of renders.

/// Progress of a render.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProgressUpdate {
    /// Number of samples that are in the film or not needed.
    pub done: u64,
    /// Estimated total number of samples: lower bound, expected value, upper bound. All are equal
    /// without an error target.
    pub estimated_totals: [u64; 3],
    /// Number of rays traced by this render.
    pub rays: u64,
    /// The [`Film::relative_error`](crate::Film::relative_error) at the end of the last pass over
    /// all pixels; with an error target, the last measured error.
    pub error: Option<f64>,
}

impl ProgressUpdate {
    /// Expected total number of samples.
    pub fn total(&self) -> u64 {
        self.estimated_totals[1]
    }
}

/// Observer of a render. Its methods are called from the threads of the render.
pub trait Observer: Sync {
    /// Called when progress is made.
    fn progress(&self, _advance: &ProgressUpdate) {}
    /// Returns true if the render is to stop at the next opportunity, keeping its samples.
    fn cancelled(&self) -> bool {
        false
    }
}

/// Observer that ignores progress and never cancels.
pub struct Silent;

impl Observer for Silent {}
