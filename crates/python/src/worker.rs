//! Work on a thread of its own, so that Ctrl-C is handled while it runs.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use pyo3::prelude::*;

use crate::errors::internal;

/// Interval between checks for signals.
const INTERVAL: Duration = Duration::from_millis(20);

/// End of work.
pub(crate) enum End<T> {
    /// The work ended with this result.
    Done(T),
    /// The exception of `poll`, and the result if the work ended within the given time.
    Stopped(PyErr, Option<T>),
}

/// Runs `work` on a thread. Meanwhile, without the GIL in between, handles signals and calls
/// `poll`; if either raises an exception, calls `stop` and waits as long as that returns. Work that
/// goes on after that is abandoned.
///
/// # Errors
/// If the thread cannot be started, or panics.
pub(crate) fn run<T: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> T + Send + 'static,
    mut poll: impl FnMut(Python<'_>) -> PyResult<()>,
    stop: impl FnOnce() -> Duration,
) -> PyResult<End<T>> {
    let (sender, receiver) = channel();
    let run = move || {
        // The receiver is gone if the work was abandoned.
        let _ = sender.send(work());
    };
    std::thread::Builder::new().name("pathtracer".to_owned()).spawn(run)?;
    // The receiver is used by one thread at a time.
    let receiver = std::sync::Mutex::new(receiver);
    let wait = |time: Duration| {
        py.detach(|| {
            let receiver = receiver.lock().map_err(|_| RecvTimeoutError::Disconnected)?;
            receiver.recv_timeout(time)
        })
    };
    loop {
        match wait(INTERVAL) {
            Ok(result) => return Ok(End::Done(result)),
            Err(RecvTimeoutError::Disconnected) => return Err(internal()),
            Err(RecvTimeoutError::Timeout) => {}
        }
        if let Err(error) = py.check_signals().and_then(|()| poll(py)) {
            return Ok(End::Stopped(error, wait(stop()).ok()));
        }
    }
}
