//! Rendering.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pathtracer::{Observer, Outcome, ProgressUpdate, RenderStatistics, Session};
use pt_cli::{Purpose, RenderRequest};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::Interrupted;
use crate::image::{Image, Rendered};
use crate::scene::Scene;
use crate::settings::words;
use crate::worker::{self, End};

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
struct Watch {
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
    fn new(deadline: Option<Instant>) -> Self {
        Self {
            start: Instant::now(),
            deadline,
            pause: None,
            stopped: AtomicBool::new(false),
            is_rendering: AtomicBool::new(false),
            has_progress: AtomicBool::new(false),
            latest: Mutex::new(None),
        }
    }

    /// Stops the render; returns how long its end is waited for.
    fn stop(&self) -> Duration {
        self.stopped.store(true, Ordering::Relaxed);
        // A compilation cannot be stopped; it ends on its own.
        let renders = self.is_rendering.load(Ordering::Relaxed);
        if renders { Duration::MAX } else { Duration::ZERO }
    }

    /// Calls `progress` if there is news.
    fn report(&self, py: Python<'_>, progress: &Bound<'_, PyAny>) -> PyResult<()> {
        let latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner).take();
        let Some(latest) = latest else { return Ok(()) };
        let state = Progress {
            samples: latest.done,
            total: latest.total(),
            rays: latest.rays,
            seconds: self.start.elapsed().as_secs_f64(),
            error: latest.error,
        };
        progress.call1((Py::new(py, state)?,)).map(drop)
    }
}

/// A render under way.
struct Job {
    session: Session,
    threads: usize,
    tile_size: u32,
    /// Sums of all runs.
    statistics: RenderStatistics,
}

impl Job {
    fn new(scene: &pathtracer::Scene, request: RenderRequest) -> Result<Self, Failure> {
        let (threads, tile_size) = (request.threads(), request.tile_size());
        let session = request.session(scene).map_err(Failure::Compile)?;
        Ok(Self { session, threads, tile_size, statistics: RenderStatistics::default() })
    }

    /// Takes the missing samples until it is stopped; returns the image so far.
    fn run(&mut self, watch: &Watch) -> Result<Rendered, Failure> {
        watch.is_rendering.store(true, Ordering::Relaxed);
        let rendered = self.session.render(self.threads, self.tile_size, watch);
        let (outcome, run) = rendered.map_err(|error| Failure::Render(error.to_string()))?;
        let RenderStatistics { samples, rays, time, .. } = &mut self.statistics;
        *samples += run.samples;
        *rays += run.rays;
        *time += run.time;
        Ok(Rendered::new(&self.session, outcome == Outcome::Finished, self.statistics))
    }
}

/// Failure of a render.
enum Failure {
    /// The settings, or files that they name, are wrong for the scene.
    Compile(String),
    Render(String),
}

impl Failure {
    fn into_error(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Compile(message) => Scene::error(py, message),
            Self::Render(message) => PyRuntimeError::new_err(message),
        }
    }
}

/// Renders a scene.
///
/// Parameters
/// ----------
/// scene : Scene
///     Scene to be rendered.
/// width, height : int, optional
///     Size of the image in pixels, both or neither; by default the scene's, or 600 rows.
/// aovs : sequence of str, optional
///     Further quantities of the first hits, such as "albedo", "normal" and "depth", which become
///     arrays of the image.
/// progress : callable, optional
///     Called with a :class:`Progress` every few hundredths of a second while there is news. An
///     exception that it raises ends the render.
/// **settings
///     Options of the program, with underscores: `spp`, `max_depth`, `integrator`, `seed`,
///     `threads`, `target_error`, …; :func:`settings` describes all. None stands for the default.
///
/// Returns
/// -------
/// Image
///     Equal to the one of the program with these options, bit for bit.
///
/// Raises
/// ------
/// SceneError
///     If the scene cannot be rendered with these settings.
/// TypeError, ValueError
///     If a setting is unknown or has a wrong value.
/// Interrupted
///     After Ctrl-C, with the image so far as `partial`. It is a KeyboardInterrupt.
#[pyfunction]
#[pyo3(signature = (scene, *, width = None, height = None, aovs = None, progress = None, **settings))]
pub(crate) fn render(
    scene: &Bound<'_, Scene>,
    width: Option<Bound<'_, PyAny>>,
    height: Option<Bound<'_, PyAny>>,
    aovs: Option<Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Image> {
    let py = scene.py();
    if let Some(progress) = progress.filter(|progress| !progress.is_callable()) {
        let found = progress.get_type().name()?;
        return Err(PyTypeError::new_err(format!("progress: found {found}, expected a callable")));
    }
    let request = request(py, [width, height], aovs, settings)?;
    let watch = Arc::new(Watch::new(deadline(request.time_limit())));
    let (scene, of_worker) = (Arc::clone(&scene.get().scene), Arc::clone(&watch));
    let work = move || Job::new(&scene, request)?.run(&of_worker);
    let poll = |py: Python<'_>| match progress {
        Some(progress) => watch.report(py, progress),
        None => Ok(()),
    };
    match worker::run(py, work, poll, || watch.stop())? {
        End::Done(Ok(rendered)) => {
            poll(py)?;
            Image::new(py, rendered)
        }
        End::Done(Err(failure)) => Err(failure.into_error(py)),
        End::Stopped(error, rendered) => {
            Err(with_partial(py, error, rendered.and_then(Result::ok)))
        }
    }
}

/// Renders a scene, and returns the image so far again and again.
///
/// Parameters
/// ----------
/// scene, width, height, aovs, **settings
///     As for :func:`render`.
/// interval : float, optional
///     Seconds between two images; with 0, there is one whenever there are new samples.
///
/// Returns
/// -------
/// iterator of Image
///     The last image is that of :func:`render`; before, `complete` is False. A render that is not
///     iterated any further takes no more samples.
///
/// Raises
/// ------
/// SceneError, TypeError, ValueError, Interrupted
///     As :func:`render`. After Interrupted, the iteration can be continued.
#[pyfunction]
#[pyo3(signature = (
    scene, *, width = None, height = None, aovs = None, interval = 1.0, **settings
))]
pub(crate) fn render_iter(
    scene: &Bound<'_, Scene>,
    width: Option<Bound<'_, PyAny>>,
    height: Option<Bound<'_, PyAny>>,
    aovs: Option<Bound<'_, PyAny>>,
    interval: f64,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Images> {
    let py = scene.py();
    let interval = Duration::try_from_secs_f64(interval).map_err(|_| {
        PyValueError::new_err(format!("interval: found {interval}, expected seconds from 0 on"))
    })?;
    let request = request(py, [width, height], aovs, settings)?;
    let deadline = deadline(request.time_limit());
    let scene = Arc::clone(&scene.get().scene);
    match worker::run(py, move || Job::new(&scene, request), |_| Ok(()), || Duration::ZERO)? {
        End::Done(Ok(job)) => Ok(Images { job: Mutex::new(Some(job)), interval, deadline }),
        End::Done(Err(failure)) => Err(failure.into_error(py)),
        End::Stopped(error, _) => Err(with_partial(py, error, None)),
    }
}

/// Images of a render under way.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Images {
    /// The render, until it has ended.
    job: Mutex<Option<Job>>,
    interval: Duration,
    deadline: Option<Instant>,
}

#[pymethods]
impl Images {
    fn __iter__(images: PyRef<'_, Self>) -> PyRef<'_, Self> {
        images
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<Image>> {
        let place = || self.job.lock().unwrap_or_else(PoisonError::into_inner);
        let Some(mut job) = place().take() else { return Ok(None) };
        let pause = Instant::now().checked_add(self.interval);
        let watch = Arc::new(Watch { pause, ..Watch::new(self.deadline) });
        let of_worker = Arc::clone(&watch);
        let work = move || {
            let rendered = job.run(&of_worker);
            (job, rendered)
        };
        match worker::run(py, work, |_| Ok(()), || watch.stop())? {
            End::Done((job, rendered)) => {
                let rendered = rendered.map_err(|failure| failure.into_error(py))?;
                let is_late = self.deadline.is_some_and(|deadline| Instant::now() >= deadline);
                if !rendered.is_complete() && !is_late {
                    *place() = Some(job);
                }
                Image::new(py, rendered).map(Some)
            }
            End::Stopped(error, None) => Err(error),
            End::Stopped(error, Some((job, rendered))) => {
                *place() = Some(job);
                Err(with_partial(py, error, rendered.ok()))
            }
        }
    }
}

/// Resolves the settings, of which some are arguments of their own.
fn request(
    py: Python<'_>,
    [width, height]: [Option<Bound<'_, PyAny>>; 2],
    aovs: Option<Bound<'_, PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<RenderRequest> {
    let named = PyDict::new(py);
    match (width, height) {
        (None, None) => {}
        (Some(width), Some(height)) => named.set_item("resolution", (width, height))?,
        _ => return Err(PyValueError::new_err("width and height require each other")),
    }
    if let Some(aovs) = aovs {
        named.set_item("aov", aovs)?;
    }
    for (name, value) in settings.into_iter().flatten() {
        if named.contains(&name)? {
            let message = format!("{name} is given twice: also as width and height or as aovs");
            return Err(PyTypeError::new_err(message));
        }
        named.set_item(name, value)?;
    }
    let words = words(Purpose::Render, Some(&named))?;
    RenderRequest::new(&words).map_err(PyValueError::new_err)
}

/// End of a render that begins now; `None` beyond the range of the clock.
fn deadline(limit: Option<Duration>) -> Option<Instant> {
    Instant::now().checked_add(limit?)
}

/// The error, or [`Interrupted`] with the image so far in place of KeyboardInterrupt.
fn with_partial(py: Python<'_>, error: PyErr, rendered: Option<Rendered>) -> PyErr {
    if !error.is_instance_of::<PyKeyboardInterrupt>(py) {
        return error;
    }
    let interrupted = Interrupted::new_err("the render was interrupted");
    let partial = rendered.map(|rendered| Image::new(py, rendered)).transpose();
    match partial.and_then(|partial| interrupted.value(py).setattr("partial", partial)) {
        Ok(()) => interrupted,
        Err(other) => other,
    }
}
