//! Reading of scenes.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pathtracer::{FORMATS, Format, Limits, LoadError, LoadOptions, Placement, suggestions};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyString};

use crate::errors::{in_argument, of_load};
use crate::scene::Scene;
use crate::worker::{self, End};

/// Options of reading a scene, and the placement of its camera.
#[derive(Clone, Default)]
struct Reading {
    options: LoadOptions,
    placement: Option<Placement>,
}

/// Names of the options.
const OPTIONS: [&str; 8] = [
    "allow_folders",
    "allow_outside",
    "camera",
    "limits",
    "point_radius",
    "strict",
    "time",
    "variables",
];

impl Reading {
    fn new(given: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let mut reading = Self::default();
        for (name, value) in given.into_iter().flatten() {
            let name: String = name.extract()?;
            if value.is_none() && OPTIONS.contains(&name.as_str()) {
                continue;
            }
            reading.set(&name, &value).map_err(|error| in_argument(&value, &name, &error))?;
        }
        Ok(reading)
    }

    fn set(&mut self, name: &str, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let options = &mut self.options;
        match name {
            "variables" => options.definitions = definitions(value.cast()?)?,
            "time" => options.time = Some(finite(value)?),
            "allow_outside" => options.allow_outside = value.extract()?,
            "allow_folders" => options.allowed_folders = value.extract()?,
            "limits" => options.limits = limits(value.cast()?)?,
            "camera" => self.choose_camera(value)?,
            "point_radius" => {
                let radius = finite(value)?;
                if radius <= 0.0 {
                    let message = format!("found {radius}, expected a number above 0");
                    return Err(PyValueError::new_err(message));
                }
                options.point_radius = Some(radius);
            }
            "strict" => options.strict = value.extract()?,
            _ => return Err(unknown(name)),
        }
        Ok(())
    }

    /// The placement of the camera, or the camera by its name or number.
    fn choose_camera(&mut self, value: &Bound<'_, PyAny>) -> PyResult<()> {
        let camera = match value.cast::<PyString>() {
            Ok(text) => text.to_str()?.to_owned(),
            Err(_) => value.extract::<u32>()?.to_string(),
        };
        match camera.as_str() {
            "file" => self.placement = Some(Placement::Node),
            "course" => self.placement = Some(Placement::Course),
            "fit" => self.placement = Some(Placement::Fit),
            _ => self.options.camera = Some(camera),
        }
        Ok(())
    }
}

fn unknown(name: &str) -> PyErr {
    PyTypeError::new_err(match suggestions(name, OPTIONS.into_iter()).first() {
        Some(near) => format!("unknown option; did you mean {near:?}?"),
        None => format!("unknown option; known: {}", OPTIONS.join(", ")),
    })
}

fn finite(value: &Bound<'_, PyAny>) -> PyResult<f64> {
    let number: f64 = value.extract()?;
    if number.is_finite() {
        return Ok(number);
    }
    Err(PyValueError::new_err(format!("found {number}, expected a finite number")))
}

/// Definitions of a Mitsuba scene; truth values are written as there.
fn definitions(variables: &Bound<'_, PyDict>) -> PyResult<Vec<(String, String)>> {
    let definition = |(name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>)| {
        let text = match value.extract::<bool>() {
            Ok(truth) => truth.to_string(),
            Err(_) => value.str()?.to_str()?.to_owned(),
        };
        Ok((name.extract()?, text))
    };
    variables.iter().map(definition).collect()
}

fn limits(given: &Bound<'_, PyDict>) -> PyResult<Limits> {
    let mut limits = Limits::default();
    for (name, value) in given {
        let name: String = name.extract()?;
        let value = value.extract().map_err(|error| in_argument(&value, &name, &error))?;
        limits.set(&name.replace('_', "-"), value).map_err(PyValueError::new_err)?;
    }
    Ok(limits)
}

/// Reads a scene.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     Scene file: pathtracer's own (.json), COLLADA (.dae), glTF 2.0 (.gltf, .glb), Mitsuba 3
///     (.xml), pbrt-v4 (.pbrt), PLY, OBJ, STL, or an archive with one of these (.zip, .zae).
/// variables : dict of str to object, optional
///     Values of $NAME in a Mitsuba scene.
/// time : float, optional
///     Time in seconds at which animations of a glTF scene are shown; by default the rest pose.
/// allow_outside : bool, optional
///     True if the scene may refer to files outside of its folder.
/// allow_folders : sequence of str or os.PathLike, optional
///     Further folders to whose files the scene may refer.
/// limits : dict of str to int, optional
///     Limits for reading: memory (bytes), depth, shapes, triangles, elements, texture_side,
///     texture_pixels, include_depth, files, seconds.
/// camera : str or int, optional
///     Placement "file", "course" or "fit", or the camera by its name or its number from 0.
/// point_radius : float, optional
///     Radius of points and lines, in the unit of the scene.
/// strict : bool, optional
///     True if missing files are errors; by default, placeholders replace them.
///
/// Returns
/// -------
/// Scene
///
/// Raises
/// ------
/// SceneError
///     If the content is invalid; `errors` lists all errors with their locations.
/// OSError
///     If the file cannot be read.
/// TypeError, ValueError
///     If an option is unknown or has a wrong value.
#[pyfunction]
#[pyo3(signature = (path, **options))]
pub(crate) fn load(
    py: Python<'_>,
    path: PathBuf,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Scene> {
    let reading = Reading::new(options)?;
    let options = reading.options.clone();
    read(py, &reading, move || pathtracer::load_with(&path, &options))
}

/// Reads a scene from text or bytes.
///
/// Parameters
/// ----------
/// text : str or bytes
///     Content of a scene file.
/// format : str
///     Extension of such files or name of the format: "json" or "pathtracer", "dae" or "collada",
///     "gltf", "glb", "xml" or "mitsuba", "pbrt", "ply", "obj", "stl".
/// folder : str or os.PathLike, optional
///     Folder of the files to which the scene refers; by default the current one.
/// **options
///     As for :func:`load`.
///
/// Returns
/// -------
/// Scene
///
/// Raises
/// ------
/// SceneError, TypeError, ValueError
///     As :func:`load`.
#[pyfunction]
#[pyo3(signature = (text, format, folder = PathBuf::new(), **options))]
pub(crate) fn loads(
    py: Python<'_>,
    text: &Bound<'_, PyAny>,
    format: &str,
    folder: PathBuf,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Scene> {
    let bytes = match (text.cast::<PyString>(), text.cast::<PyBytes>()) {
        (Ok(text), _) => text.to_str()?.as_bytes().to_vec(),
        (_, Ok(bytes)) => bytes.as_bytes().to_vec(),
        _ => {
            let found = text.get_type().name()?;
            return Err(PyTypeError::new_err(format!(
                "text: found {found}, expected str or bytes"
            )));
        }
    };
    let path = folder.join(Path::new("scene").with_extension(extension(format)?));
    let reading = Reading::new(options)?;
    let options = reading.options.clone();
    read(py, &reading, move || pathtracer::parse_with(&bytes, &path, &options))
}

/// The scene that the program renders if it is given none: a Cornell box with a mirror and a glass
/// sphere.
///
/// Returns
/// -------
/// Scene
#[pyfunction]
pub(crate) fn default_scene() -> Scene {
    pathtracer::default_scene().into()
}

/// Reads a scene on another thread, so that Ctrl-C ends the wait.
fn read(
    py: Python<'_>,
    reading: &Reading,
    read: impl FnOnce() -> Result<pathtracer::Scene, LoadError> + Send + 'static,
) -> PyResult<Scene> {
    // A reader cannot be stopped; it ends on its own.
    let mut scene = match worker::run(py, read, |_| Ok(()), || Duration::ZERO)? {
        End::Done(scene) => scene.map_err(|error| of_load(py, &error))?,
        End::Stopped(error, _) => return Err(error),
    };
    if let Some(placement) = reading.placement {
        scene.place_camera(placement);
    }
    Ok(scene.into())
}

/// Extension of the files of a format, from an extension or a name.
fn extension(format: &str) -> PyResult<&'static str> {
    let wanted = format.trim_start_matches('.').to_lowercase();
    let first_word =
        |known: &Format| known.name.split(' ').next().unwrap_or_default().to_lowercase();
    let by_extension = FORMATS.iter().flat_map(|known| known.extensions).find(|e| **e == wanted);
    let by_name = || FORMATS.iter().find(|known| first_word(known) == wanted)?.extensions.first();
    by_extension.or_else(by_name).copied().ok_or_else(|| {
        let all: Vec<_> = FORMATS.iter().flat_map(|known| known.extensions).copied().collect();
        let all = all.join(", ");
        PyValueError::new_err(format!("format: found {format:?}, expected one of {all}"))
    })
}
