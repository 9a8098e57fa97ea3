//! Renders in parts, whose samples other processes take: the native side of `pathtracer.ray`.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError, RwLock, RwLockReadGuard, RwLockWriteGuard};
use std::time::Duration;

use pathtracer::{Film, Outcome, Part, Region, RenderError, RenderStatistics, Session, film_file};
use pt_cli::{FilmKeeper, PreparedRender};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::errors::of_command;
use crate::image::{Image, Rendered};
use crate::progress::{Progress, Watch};
use crate::render::{Failure, request};
use crate::scene::Scene;
use crate::worker::{self, End};

/// Column, row, width and height of a rectangle of pixels.
type Rectangle = (u32, u32, u32, u32);

/// Film of a part, its numbers of samples and rays, and the seconds that it took.
type Taken<'py> = (Bound<'py, PyBytes>, u64, u64, f64);

/// A render in parts: at the head, the film to which they are added; at workers, the compiled scene
/// with which they are rendered.
#[pyclass(frozen, module = "pathtracer._native")]
pub(crate) struct PartialRender {
    render: Arc<RwLock<PreparedRender>>,
    keeper: Mutex<Option<FilmKeeper>>,
    time_limit: Option<Duration>,
    tile_size: u32,
}

impl PartialRender {
    fn read(&self) -> RwLockReadGuard<'_, PreparedRender> {
        self.render.read().unwrap_or_else(PoisonError::into_inner)
    }

    fn write(&self) -> RwLockWriteGuard<'_, PreparedRender> {
        self.render.write().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes samples of a film that `begin` returns.
    fn taken<'py>(
        &self,
        py: Python<'py>,
        begin: impl FnOnce(&Session) -> Film + Send + 'static,
        end: u32,
        threads: usize,
    ) -> PyResult<Taken<'py>> {
        let (render, tile_size) = (Arc::clone(&self.render), self.tile_size);
        let watch = Arc::new(Watch::new(None, None));
        let of_worker = Arc::clone(&watch);
        let work = move || -> Result<(Vec<u8>, Outcome, RenderStatistics), RenderError> {
            of_worker.begin();
            let render = render.read().unwrap_or_else(PoisonError::into_inner);
            let mut film = begin(&render.session);
            let size = (threads, tile_size);
            let (outcome, costs) = render.session.advance(&mut film, end, size, &*of_worker)?;
            Ok((bytes_of(&film), outcome, costs))
        };
        match worker::run(py, work, |_| Ok(()), || watch.stop())? {
            End::Done(Ok((bytes, Outcome::Finished, costs))) => {
                let RenderStatistics { samples, rays, time, .. } = costs;
                Ok((PyBytes::new(py, &bytes), samples, rays, time.as_secs_f64()))
            }
            End::Done(Ok((_, Outcome::Cancelled, _))) => {
                Err(PyRuntimeError::new_err("the part was cancelled"))
            }
            End::Done(Err(error)) => Err(PyRuntimeError::new_err(error.to_string())),
            End::Stopped(error, _) => Err(error),
        }
    }

    /// A rectangle, which must be inside of the film.
    fn inside(&self, (x, y, width, height): Rectangle) -> PyResult<Region> {
        let region = Region { x, y, width, height };
        let whole = self.read().session.film().region();
        let is_inside = |start: u32, len: u32, from: u32, of: u32| {
            len > 0 && start >= from && start.checked_add(len).is_some_and(|end| end <= from + of)
        };
        if is_inside(x, width, whole.x, whole.width) && is_inside(y, height, whole.y, whole.height)
        {
            return Ok(region);
        }
        Err(PyValueError::new_err(format!("region: found {region:?}, expected one in {whole:?}")))
    }

    /// Reads the film of a part.
    fn film(&self, py: Python<'_>, bytes: &[u8]) -> PyResult<Film> {
        let film = py.detach(|| read(bytes))?;
        let Region { x, y, width, height } = film.region();
        self.inside((x, y, width, height))?;
        if film.has_same_layout(self.read().session.film()) {
            return Ok(film);
        }
        Err(PyValueError::new_err("film: found other channels than those of the render"))
    }
}

#[pymethods]
impl PartialRender {
    #[new]
    #[pyo3(signature = (scene, *, width = None, height = None, aovs = None, **settings))]
    fn new(
        scene: &Bound<'_, Scene>,
        width: Option<Bound<'_, PyAny>>,
        height: Option<Bound<'_, PyAny>>,
        aovs: Option<Bound<'_, PyAny>>,
        settings: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = scene.py();
        let request = request(py, [width, height], aovs, settings)?;
        let (time_limit, tile_size) = (request.time_limit(), request.tile_size());
        let scene = scene.get().source.clone();
        let prepare = move || scene.prepare(request).map_err(Failure::Compile);
        // A compilation cannot be stopped; it ends on its own.
        match worker::run(py, prepare, |_| Ok(()), || Duration::ZERO)? {
            End::Done(Ok(render)) => Ok(Self {
                render: Arc::new(RwLock::new(render)),
                keeper: Mutex::new(None),
                time_limit,
                tile_size,
            }),
            End::Done(Err(failure)) => Err(failure.into_error(py)),
            End::Stopped(error, _) => Err(error),
        }
    }

    /// str: Everything on which the samples depend besides the scene: version and settings.
    #[getter]
    fn identity(&self) -> String {
        let render = self.read();
        let region = render.session.film().region();
        format!("{} {:?} {region:?}", render.header.version, render.session.identity())
    }

    /// bool: True if parts of the film are continued, and False if films of different samples are
    /// added.
    #[getter]
    fn is_continued(&self) -> bool {
        self.read().session.is_continued()
    }

    /// bool: True if there is an error target.
    #[getter]
    fn has_target(&self) -> bool {
        self.read().session.settings().target.is_some()
    }

    /// tuple of int: Column, row, width and height of the film.
    #[getter]
    fn region(&self) -> Rectangle {
        let Region { x, y, width, height } = self.read().session.film().region();
        (x, y, width, height)
    }

    /// float or None: Seconds after which the render stops.
    #[getter]
    fn time_limit(&self) -> Option<f64> {
        self.time_limit.map(|limit| limit.as_secs_f64())
    }

    /// int: Number of samples of the film.
    #[getter]
    fn samples(&self) -> u64 {
        self.read().session.film().samples()
    }

    /// float: Seconds of rendering so far, of all runs.
    #[getter]
    fn seconds(&self) -> f64 {
        self.read().header.seconds
    }

    /// int: Number of rays so far, of all runs.
    #[getter]
    fn rays(&self) -> u64 {
        self.read().header.rays
    }

    /// str: Hash of the samples of the film.
    #[getter]
    fn film_hash(&self, py: Python<'_>) -> String {
        py.detach(|| film_file::hash_of_film(self.read().session.film()))
    }

    /// Divides the film into squares of `size` pixels a side; each with its smallest and largest
    /// number of samples, the number that it is to have, and that of all samples that it lacks.
    fn parts(&self, py: Python<'_>, size: u32) -> Vec<(Rectangle, u32, u32, u32, u64)> {
        let parts = py.detach(|| self.read().session.parts(size));
        let values = |Part { region, taken, most, wanted, missing }: Part| {
            ((region.x, region.y, region.width, region.height), taken, most, wanted, missing)
        };
        parts.into_iter().map(values).collect()
    }

    /// Renders the samples with numbers from `first` to `end`, exclusive, of a rectangle.
    fn render_part<'py>(
        &self,
        py: Python<'py>,
        region: Rectangle,
        first: u32,
        end: u32,
        threads: usize,
    ) -> PyResult<Taken<'py>> {
        let region = self.inside(region)?;
        if self.is_continued() {
            return Err(PyValueError::new_err("the samples of a pixel depend on earlier ones"));
        }
        self.taken(py, move |session| session.film_from(region, first), end, threads)
    }

    /// Continues the film of a part, to at most `end` samples per pixel and half buffer.
    fn continue_part<'py>(
        &self,
        py: Python<'py>,
        film: &[u8],
        end: u32,
        threads: usize,
    ) -> PyResult<Taken<'py>> {
        let film = self.film(py, film)?;
        self.taken(py, move |_| film, end, threads)
    }

    /// Adds a film whose samples follow those of this one in each of its pixels.
    fn add(&self, py: Python<'_>, film: &[u8]) -> PyResult<()> {
        let film = self.film(py, film)?;
        py.detach(|| {
            let whole = &mut self.write().session;
            if whole.is_continued() || !whole.film().is_continued_by(&film) {
                let region = film.region();
                return Err(PyValueError::new_err(format!(
                    "film: found samples from {} on of {region:?}, which do not follow those of \
                     the render",
                    film.first()
                )));
            }
            whole.film_mut().merge(&film);
            Ok(())
        })
    }

    /// Film of a rectangle, which [`Self::continue_part`] continues.
    fn part<'py>(&self, py: Python<'py>, region: Rectangle) -> PyResult<Bound<'py, PyBytes>> {
        let region = self.inside(region)?;
        let bytes = py.detach(|| bytes_of(&self.read().session.film().part(region)));
        Ok(PyBytes::new(py, &bytes))
    }

    /// Puts the film of a part back, which has got more samples.
    fn put_back(&self, py: Python<'_>, film: &[u8]) -> PyResult<()> {
        let film = self.film(py, film)?;
        py.detach(|| {
            let whole = &mut self.write().session;
            if !whole.film().is_extended_by(&film) {
                let region = film.region();
                return Err(PyValueError::new_err(format!(
                    "film: found no more samples of {region:?} than the render has"
                )));
            }
            whole.film_mut().put_back(&film);
            Ok(())
        })
    }

    /// Plans the samples of the next round of a render with an error target; False if no more are
    /// needed.
    fn plan_round(&self, py: Python<'_>) -> PyResult<bool> {
        let planned = py.detach(|| self.write().session.plan_round(0));
        planned.map_err(|error| PyRuntimeError::new_err(error.to_string()))
    }

    /// Reads the samples of a film file, if it exists, and keeps the film there.
    fn keep(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let kept = py.detach(|| self.write().keep(&path)).map_err(|error| of_command(py, error))?;
        *self.keeper.lock().unwrap_or_else(PoisonError::into_inner) = Some(kept);
        Ok(())
    }

    /// Records the costs of all runs, and if all samples were taken; then writes the film, if it is
    /// kept.
    fn save(&self, py: Python<'_>, seconds: f64, rays: u64, finished: bool) -> PyResult<()> {
        let saved = py.detach(|| {
            let mut render = self.write();
            let header = &mut render.header;
            (header.seconds, header.rays, header.finished) = (seconds, rays, finished);
            let mut keeper = self.keeper.lock().unwrap_or_else(PoisonError::into_inner);
            keeper.as_mut().map_or(Ok(()), |keeper| keeper.save(&render))
        });
        saved.map_err(|error| of_command(py, error))
    }

    /// State of the render for progress reports.
    fn progress(&self, samples: u64, total: u64, rays: u64, seconds: f64) -> Progress {
        let render = self.read();
        let plan = render.session.film().plan();
        let expected = plan.map_or(0, |plan| plan.expected[1]);
        let error = plan.and_then(|plan| plan.error);
        Progress::new(samples, total.max(expected), rays, seconds, error)
    }

    /// The image so far, which this number of threads has rendered.
    fn image(&self, py: Python<'_>, threads: usize) -> PyResult<Image> {
        let rendered = py.detach(|| {
            let PreparedRender { session, header } = &*self.read();
            let receipt = pt_cli::provenance(header, session, threads);
            Rendered::new(session.film(), session.names(), session.notes(), receipt)
        });
        Image::new(py, rendered)
    }
}

/// Adds films of consecutive samples of the same pixels, the first ones first.
#[pyfunction]
pub(crate) fn merge_parts<'py>(
    py: Python<'py>,
    films: Vec<Bound<'py, PyBytes>>,
) -> PyResult<Bound<'py, PyBytes>> {
    let mut sum: Option<Film> = None;
    for bytes in &films {
        let bytes = bytes.as_bytes();
        let film = py.detach(|| read(bytes))?;
        match &mut sum {
            None => sum = Some(film),
            Some(sum) if sum.region() == film.region() && sum.is_continued_by(&film) => {
                py.detach(|| sum.merge(&film));
            }
            Some(_) => {
                let message = "films: expected consecutive samples of the same pixels";
                return Err(PyValueError::new_err(message));
            }
        }
    }
    let sum = sum.ok_or_else(|| PyValueError::new_err("films: found none, expected films"))?;
    Ok(PyBytes::new(py, &py.detach(|| bytes_of(&sum))))
}

fn read(bytes: &[u8]) -> PyResult<Film> {
    Film::read(bytes).map_err(|error| PyValueError::new_err(format!("film: {error}")))
}

fn bytes_of(film: &Film) -> Vec<u8> {
    let mut bytes = Vec::new();
    film.write(&mut bytes).expect("writing to memory does not fail");
    bytes
}
