//! Progress of renders: what is reported, and when they stop.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use pathtracer::{Observer, ProgressUpdate};
use pyo3::exceptions::{PyRuntimeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::PyBool;

/// State of a render.
#[pyclass(frozen, get_all, module = "pathtracer")]
pub(crate) struct Progress {
    /// int: Number of samples that were taken or are not needed.
    samples: u64,
    /// int: Expected number of all samples.
    total: u64,
    /// int: Number of rays traced.
    rays: u64,
    /// float: Seconds since the start of the render.
    seconds: f64,
    /// float or None: Relative root mean square error of the image, if it is known.
    error: Option<f64>,
}

impl Progress {
    pub(crate) fn new(
        samples: u64,
        total: u64,
        rays: u64,
        seconds: f64,
        error: Option<f64>,
    ) -> Self {
        Self { samples, total, rays, seconds, error }
    }
}

#[pymethods]
impl Progress {
    /// float: Fraction of the samples, from 0 to 1.
    #[getter]
    fn fraction(&self) -> f64 {
        self.samples as f64 / self.total.max(1) as f64
    }

    fn __repr__(&self) -> String {
        format!("<Progress: {} of {} samples>", self.samples, self.total)
    }
}

/// Shared state of the thread that renders and the one that waits.
pub(crate) struct Watch {
    start: Instant,
    /// Time at which the render stops, whatever its state.
    deadline: Option<Instant>,
    /// Time from which on the render stops after any progress.
    pause: Option<Instant>,
    /// True if the render is to stop.
    stopped: AtomicBool,
    /// True once the scene is compiled.
    is_rendering: AtomicBool,
    /// True once this run took samples.
    has_progress: AtomicBool,
    /// Latest update, until it is reported.
    latest: Mutex<Option<ProgressUpdate>>,
}

impl Observer for Watch {
    fn progress(&self, update: &ProgressUpdate) {
        self.begin();
        // Tiles without missing samples are reported, too.
        if update.rays > 0 {
            self.has_progress.store(true, Ordering::Relaxed);
        }
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        if latest.as_ref().is_none_or(|latest| latest.done <= update.done) {
            *latest = Some(*update);
        }
    }

    fn cancelled(&self) -> bool {
        let is_over = |time: Option<Instant>| time.is_some_and(|time| Instant::now() >= time);
        self.stopped.load(Ordering::Relaxed)
            || is_over(self.deadline)
            || self.has_progress.load(Ordering::Relaxed) && is_over(self.pause)
    }
}

impl Watch {
    pub(crate) fn new(deadline: Option<Instant>, pause: Option<Instant>) -> Self {
        Self {
            start: Instant::now(),
            deadline,
            pause,
            stopped: AtomicBool::new(false),
            is_rendering: AtomicBool::new(false),
            has_progress: AtomicBool::new(false),
            latest: Mutex::new(None),
        }
    }

    /// Marks the end of compilation.
    pub(crate) fn begin(&self) {
        self.is_rendering.store(true, Ordering::Relaxed);
    }

    /// Stops the render; returns how long its end is waited for.
    pub(crate) fn stop(&self) -> Duration {
        self.stopped.store(true, Ordering::Relaxed);
        // A compilation cannot be stopped; it ends on its own.
        let renders = self.is_rendering.load(Ordering::Relaxed);
        if renders { Duration::MAX } else { Duration::ZERO }
    }

    /// News since the last call, if there are any.
    fn news(&self) -> Option<Progress> {
        let latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner).take()?;
        Some(Progress {
            samples: latest.done,
            total: latest.total(),
            rays: latest.rays,
            seconds: self.start.elapsed().as_secs_f64(),
            error: latest.error,
        })
    }
}

/// Functions of Python that are called during a render.
pub(crate) struct Callbacks<'py> {
    /// Receives the progress.
    progress: Option<Bound<'py, PyAny>>,
    /// True if that is a progress bar, which is closed at the end.
    is_bar: bool,
    /// Returns true if the render is to stop.
    cancelled: Option<Bound<'py, PyAny>>,
}

impl<'py> Callbacks<'py> {
    /// Callbacks by the arguments `progress` and `cancelled` of a render.
    pub(crate) fn new(
        py: Python<'py>,
        progress: Option<&Bound<'py, PyAny>>,
        cancelled: Option<Bound<'py, PyAny>>,
    ) -> PyResult<Self> {
        let none = Self { progress: None, is_bar: false, cancelled };
        let Some(progress) = progress else { return Ok(none) };
        if progress.is_instance_of::<PyBool>() {
            if !progress.is_truthy()? {
                return Ok(none);
            }
            let bar = py.import("pathtracer._progress")?.call_method0("bar")?;
            let is_bar = !bar.is_none();
            return Ok(Self { progress: is_bar.then_some(bar), is_bar, ..none });
        }
        if !progress.is_callable() {
            let found = progress.get_type().name()?;
            let message = format!("progress: found {found}, expected a callable, True or None");
            return Err(PyTypeError::new_err(message));
        }
        Ok(Self { progress: Some(progress.clone()), ..none })
    }

    /// Reports news, and raises an exception if the render is cancelled.
    pub(crate) fn poll(&self, watch: &Watch) -> PyResult<()> {
        if let Some(cancelled) = &self.cancelled
            && cancelled.call0()?.is_truthy()?
        {
            return Err(PyRuntimeError::new_err("the render was cancelled"));
        }
        let Some(progress) = &self.progress else { return Ok(()) };
        let Some(news) = watch.news() else { return Ok(()) };
        progress.call1((Py::new(progress.py(), news)?,)).map(drop)
    }

    /// Closes the progress bar.
    pub(crate) fn close(&self) -> PyResult<()> {
        match self.progress.as_ref().filter(|_| self.is_bar) {
            Some(bar) => bar.call_method0("close").map(drop),
            None => Ok(()),
        }
    }
}
