//! Light paths of a pixel.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use pt_cli::{PixelRequest, PreparedRender};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::in_argument;
use crate::reading::Reading;
use crate::render::request;
use crate::scene::Scene;
use crate::worker::{self, End};

/// Default of the maximum number of paths.
const TOP: u32 = 10_000;

/// Explains a pixel: its light paths and what they contribute.
///
/// The samples of the pixel are taken again; they equal, to the bit, those of a render with the
/// same settings. ``pandas.DataFrame(pathtracer.explain(scene, 9, 5))`` is a table of them.
///
/// Parameters
/// ----------
/// scene : Scene, str or os.PathLike
///     Scene, or a file that :func:`load` reads.
/// x, y : int
///     Column from the left and row from the top, from 0.
/// sample : int, optional
///     Number of a sample, from 0, all contributions of which are listed; by default those of all
///     samples that are not black.
/// top : int, optional
///     Maximum number of paths, the brightest of all samples; 10,000 by default.
/// width, height, **settings
///     As for :func:`render`.
///
/// Returns
/// -------
/// list of dict
///     One for each path from a light, in descending order of luminance (those of a sample in the
///     order of the path): `sample`, its number; `type`, the light path expression, such as "LDE";
///     `luminance`, and its `share` of the pixel or of the sample; `r`, `g`, `b`, the contribution
///     in linear Rec. 709; `clamped`, the luminance to which it is clamped, or None; `vertices`,
///     their number; `source`, the kind of light; `light`, in words; its `object` and `material`;
///     `is_light_sample`; `radiance_r`, `radiance_g`, `radiance_b`; `mis_weight`; `pdf` in 1/sr;
///     `distance` in metres; `selection_probability`; `light_samples`; `path`, a list of the
///     vertices from the eye; `cause` and `remedies` of a firefly; `refused`, the reason for which
///     the sample counts as black. What does not apply is None.
///
/// Raises
/// ------
/// SceneError
///     If the scene cannot be read or rendered with these settings.
/// OSError
///     If the file cannot be read.
/// TypeError, ValueError
///     If the pixel or the sample does not exist, or an argument has a wrong value.
#[pyfunction]
#[pyo3(signature = (
    scene, x, y, *, sample = None, top = None, width = None, height = None, **settings
))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub(crate) fn explain<'py>(
    scene: &Bound<'py, PyAny>,
    x: &Bound<'py, PyAny>,
    y: &Bound<'py, PyAny>,
    sample: Option<Bound<'py, PyAny>>,
    top: Option<Bound<'py, PyAny>>,
    width: Option<Bound<'py, PyAny>>,
    height: Option<Bound<'py, PyAny>>,
    settings: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = scene.py();
    let of = PixelRequest {
        pixel: [number("x", x)?, number("y", y)?],
        sample: sample.map(|sample| number("sample", &sample)).transpose()?,
        top: top.as_ref().map(|top| number("top", top)).transpose()?.unwrap_or(TOP) as usize,
    };
    if of.sample.is_some() && top.is_some() {
        return Err(PyValueError::new_err("sample and top are mutually exclusive"));
    }
    let source = match scene.cast::<Scene>() {
        Ok(scene) => scene.get().source.clone(),
        Err(_) => Scene::new(Reading::default().file(py, path(scene)?)?).source,
    };
    let request = request(py, [width, height], None, settings)?;
    let stopped = Arc::new(AtomicBool::new(false));
    let of_worker = Arc::clone(&stopped);
    let work = move || {
        let PreparedRender { session, .. } = source.prepare(request)?;
        let proceed = || !of_worker.load(Ordering::Relaxed);
        Ok(pt_cli::explain(&source.scene, &session, of, proceed).map(|rows| rows.to_string()))
    };
    let stop = || {
        stopped.store(true, Ordering::Relaxed);
        Duration::ZERO
    };
    match worker::run(py, work, |_| Ok(()), stop)? {
        End::Done(Ok(Ok(rows))) => py.import("json")?.call_method1("loads", (rows,)),
        End::Done(Ok(Err(message))) => Err(PyValueError::new_err(message)),
        End::Done(Err(message)) => Err(Scene::error(py, message)),
        End::Stopped(error, _) => Err(error),
    }
}

/// Argument that is a number from 0 on.
fn number(name: &str, value: &Bound<'_, PyAny>) -> PyResult<u32> {
    value.extract().map_err(|error: PyErr| {
        if error.is_instance_of::<PyTypeError>(value.py()) {
            return in_argument(value, name, &error);
        }
        PyValueError::new_err(format!("{name}: found {value}, expected a whole number from 0 on"))
    })
}

/// Path of a scene.
fn path(scene: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    scene.extract().map_err(|_| {
        let found = scene.get_type().to_string();
        PyTypeError::new_err(format!("scene: found {found}, expected a Scene or a path"))
    })
}
