//! Rendering.

use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pathtracer::{Outcome, RenderStatistics};
use pt_cli::{CommandError, PreparedRender, Purpose, RenderRequest, Side};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::{Interrupted, of_command};
use crate::image::{Image, Rendered};
use crate::pose::Pose;
use crate::progress::{Callbacks, Watch};
use crate::scene::Scene;
use crate::settings::{word, words};
use crate::source::SceneSource;
use crate::worker::{self, End};

/// A render under way.
struct Job {
    prepared: PreparedRender,
    threads: usize,
    tile_size: u32,
    /// Sums of all runs.
    statistics: RenderStatistics,
    metres_per_unit: f64,
}

impl Job {
    fn new(scene: &SceneSource, request: RenderRequest) -> Result<Self, Failure> {
        let (threads, tile_size) = (request.threads(), request.tile_size());
        let metres_per_unit = scene.scene.metres_per_unit;
        let prepared = scene.prepare(request).map_err(Failure::Compile)?;
        let statistics = RenderStatistics::default();
        Ok(Self { prepared, threads, tile_size, statistics, metres_per_unit })
    }

    /// Takes the missing samples until it is stopped; returns the image so far.
    fn run(&mut self, watch: &Watch) -> Result<Rendered, Failure> {
        watch.begin();
        let PreparedRender { session, header } = &mut self.prepared;
        let rendered = session.render(self.threads, self.tile_size, watch);
        let (outcome, run) = rendered.map_err(|error| Failure::Render(error.to_string()))?;
        let RenderStatistics { samples, rays, time, .. } = &mut self.statistics;
        *samples += run.samples;
        *rays += run.rays;
        *time += run.time;
        (header.seconds, header.rays) = (time.as_secs_f64(), *rays);
        header.finished = outcome == Outcome::Finished;
        let receipt = pt_cli::provenance(header, session, self.threads);
        let pose = Pose::new(session.scene(), session.film().region(), self.metres_per_unit);
        Ok(Rendered::new(session.film(), session.names(), session.notes(), receipt).with_pose(pose))
    }
}

/// Failure of a render.
pub(crate) enum Failure {
    /// The settings, or files that they name, are wrong for the scene.
    Compile(String),
    Render(String),
    Command(CommandError),
}

impl Failure {
    pub(crate) fn into_error(self, py: Python<'_>) -> PyErr {
        match self {
            Self::Compile(message) => Scene::error(py, message),
            Self::Render(message) => PyRuntimeError::new_err(message),
            Self::Command(error) => of_command(py, error),
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
///     Size of the image in pixels; one of them alone keeps the aspect ratio of the scene. By
///     default the scene's size, or 600 rows.
/// aovs : sequence of str, optional
///     Further quantities of the first hits, such as "albedo", "normal" and "depth", which become
///     arrays of the image.
/// progress : callable or bool, optional
///     Called with a :class:`Progress` every few hundredths of a second while there is news. An
///     exception that it raises ends the render. True stands for a progress bar on standard error,
///     if that is a terminal or a notebook.
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
    let callbacks = Callbacks::new(scene.py(), progress, None)?;
    rendered(scene, [width, height], aovs, &callbacks, settings)
}

/// Renders a scene as :func:`render` does, until it is complete or cancelled.
///
/// Parameters
/// ----------
/// scene, width, height, aovs, progress, **settings
///     As for :func:`render`.
/// cancelled : callable
///     Called every few hundredths of a second; if it returns True, the render is stopped.
///
/// Returns
/// -------
/// Image
///
/// Raises
/// ------
/// RuntimeError
///     If the render is cancelled.
/// SceneError, TypeError, ValueError, Interrupted
///     As :func:`render`.
#[pyfunction]
#[pyo3(signature = (
    scene, cancelled, *, width = None, height = None, aovs = None, progress = None, **settings
))]
pub(crate) fn render_until(
    scene: &Bound<'_, Scene>,
    cancelled: Bound<'_, PyAny>,
    width: Option<Bound<'_, PyAny>>,
    height: Option<Bound<'_, PyAny>>,
    aovs: Option<Bound<'_, PyAny>>,
    progress: Option<&Bound<'_, PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Image> {
    let callbacks = Callbacks::new(scene.py(), progress, Some(cancelled))?;
    rendered(scene, [width, height], aovs, &callbacks, settings)
}

fn rendered(
    scene: &Bound<'_, Scene>,
    size: [Option<Bound<'_, PyAny>>; 2],
    aovs: Option<Bound<'_, PyAny>>,
    callbacks: &Callbacks<'_>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Image> {
    let py = scene.py();
    let request = request(py, size, aovs, settings)?;
    let watch = Watch::new(deadline(request.time_limit()), None);
    let scene = scene.get().source.clone();
    image_of(py, watch, callbacks, move |watch| Job::new(&scene, request)?.run(watch))
}

/// Renders an image on a thread of its own.
///
/// # Errors
/// If the render fails, or a callback does. If Ctrl-C ends it, the error contains the image so far.
pub(crate) fn image_of(
    py: Python<'_>,
    watch: Watch,
    callbacks: &Callbacks<'_>,
    render: impl FnOnce(&Watch) -> Result<Rendered, Failure> + Send + 'static,
) -> PyResult<Image> {
    let watch = Arc::new(watch);
    let of_worker = Arc::clone(&watch);
    let poll = |_: Python<'_>| callbacks.poll(&watch);
    let end = worker::run(py, move || render(&of_worker), poll, || watch.stop());
    let image = end.and_then(|end| match end {
        End::Done(Ok(rendered)) => callbacks.poll(&watch).and_then(|()| Image::new(py, rendered)),
        End::Done(Err(failure)) => Err(failure.into_error(py)),
        End::Stopped(error, rendered) => {
            Err(with_partial(py, error, rendered.and_then(Result::ok)))
        }
    });
    callbacks.close()?;
    image
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
    let scene = scene.get().source.clone();
    let begin = move || Job::new(&scene, request);
    match worker::run(py, begin, |_| Ok(()), || Duration::ZERO)? {
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
        let watch = Arc::new(Watch::new(self.deadline, pause));
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
pub(crate) fn request(
    py: Python<'_>,
    [width, height]: [Option<Bound<'_, PyAny>>; 2],
    aovs: Option<Bound<'_, PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<RenderRequest> {
    let named = PyDict::new(py);
    let side = match (width, height) {
        (None, None) => None,
        (Some(width), None) => Some((Side::Width, word("width", &width)?)),
        (None, Some(height)) => Some((Side::Height, word("height", &height)?)),
        (Some(width), Some(height)) => {
            named.set_item("resolution", (width, height))?;
            None
        }
    };
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
    let request = RenderRequest::new(&words).and_then(|request| match side {
        Some((side, pixels)) => request.with_side(side, &pixels),
        None => Ok(request),
    });
    request.map_err(PyValueError::new_err)
}

/// End of a render that begins now; `None` beyond the range of the clock.
pub(crate) fn deadline(limit: Option<Duration>) -> Option<Instant> {
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
