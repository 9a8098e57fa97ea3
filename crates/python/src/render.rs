//! Rendering.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use pathtracer::{Observer, Outcome, ProgressUpdate};
use pt_cli::{Purpose, RenderRequest, Words};
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
    deadline: Option<Instant>,
    /// True if the render is to stop.
    stopped: AtomicBool,
    /// True once samples are taken.
    is_rendering: AtomicBool,
    /// Latest update, until it is reported.
    latest: Mutex<Option<ProgressUpdate>>,
}

impl Observer for Watch {
    fn progress(&self, update: &ProgressUpdate) {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        if latest.as_ref().is_none_or(|latest| latest.done <= update.done) {
            *latest = Some(*update);
        }
    }

    fn cancelled(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
            || self.deadline.is_some_and(|deadline| Instant::now() >= deadline)
    }
}

impl Watch {
    fn new(limit: Option<Duration>) -> Self {
        let start = Instant::now();
        Self {
            start,
            // A deadline beyond the range of the clock is none.
            deadline: limit.and_then(|limit| start.checked_add(limit)),
            stopped: AtomicBool::new(false),
            is_rendering: AtomicBool::new(false),
            latest: Mutex::new(None),
        }
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

/// Failure of a render.
enum Failure {
    /// The settings, or files that they name, are wrong for the scene.
    Compile(String),
    Render(String),
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
    start(py, &scene.get().scene, &words(Purpose::Render, Some(&named))?, progress)
}

fn start(
    py: Python<'_>,
    scene: &Arc<pathtracer::Scene>,
    settings: &Words,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Image> {
    let request = RenderRequest::new(settings).map_err(PyValueError::new_err)?;
    let watch = Arc::new(Watch::new(request.time_limit()));
    let work = {
        let (scene, watch) = (Arc::clone(scene), Arc::clone(&watch));
        move || run(&scene, request, &watch)
    };
    let poll = |py: Python<'_>| match progress {
        Some(progress) => watch.report(py, progress),
        None => Ok(()),
    };
    let stop = || watch.stopped.store(true, Ordering::Relaxed);
    let patience = || {
        // A compilation cannot be stopped; it ends on its own.
        let renders = watch.is_rendering.load(Ordering::Relaxed);
        if renders { Duration::MAX } else { Duration::ZERO }
    };
    match worker::run(py, work, poll, stop, patience)? {
        End::Done(Ok(rendered)) => {
            poll(py)?;
            Image::new(py, rendered)
        }
        End::Done(Err(Failure::Compile(message))) => Err(Scene::error(py, message)),
        End::Done(Err(Failure::Render(message))) => Err(PyRuntimeError::new_err(message)),
        End::Stopped(error, rendered) if error.is_instance_of::<PyKeyboardInterrupt>(py) => {
            let partial = rendered.and_then(Result::ok).map(|rendered| Image::new(py, rendered));
            let interrupted = Interrupted::new_err("the render was interrupted");
            interrupted.value(py).setattr("partial", partial.transpose()?)?;
            Err(interrupted)
        }
        End::Stopped(error, _) => Err(error),
    }
}

fn run(
    scene: &pathtracer::Scene,
    request: RenderRequest,
    watch: &Watch,
) -> Result<Rendered, Failure> {
    let (threads, tile_size) = (request.threads(), request.tile_size());
    let mut session = request.session(scene).map_err(Failure::Compile)?;
    watch.is_rendering.store(true, Ordering::Relaxed);
    let rendered = session.render(threads, tile_size, watch);
    let (outcome, statistics) = rendered.map_err(|error| Failure::Render(error.to_string()))?;
    Ok(Rendered::new(&session, outcome == Outcome::Finished, statistics))
}
