//! Options of reading scenes, and reading on a thread of its own.

use std::path::{Path, PathBuf};
use std::time::Duration;

use pathtracer::{
    FORMATS, Format, Limits, LoadError, LoadOptions, LoadResult, Placement, SceneValues,
    suggestions,
};
use pt_cli::SceneOrigin;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping, PyString};

use crate::errors::{in_argument, of_load, of_values};
use crate::places::Places;
use crate::worker::{self, End};

/// Options of reading a scene, and the placement of its camera.
#[derive(Clone, Default)]
pub(crate) struct Reading {
    options: LoadOptions,
    placement: Option<Placement>,
}

/// A scene that was read, and its origin.
type Read = (pathtracer::Scene, SceneOrigin);

/// Names of the options.
pub(crate) const OPTIONS: [&str; 8] = [
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
    pub(crate) fn new(given: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
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

    /// Reads a file.
    pub(crate) fn file(self, py: Python<'_>, path: PathBuf) -> PyResult<Read> {
        let origin = self.origin(Some(path.clone()))?;
        let options = self.options;
        run(py, origin, move || pathtracer::read_with(&path, &options))
    }

    /// Reads the content of a file of a format, which refers to files of a folder.
    pub(crate) fn content(
        self,
        py: Python<'_>,
        bytes: Vec<u8>,
        format: &str,
        folder: &Path,
    ) -> PyResult<Read> {
        let extension = extension(format)?;
        let path = folder.join(Path::new("scene").with_extension(extension));
        let origin = self.origin(None)?;
        let options = self.options;
        run(py, origin, move || {
            let mut reading = pathtracer::read_content_with(&bytes, &path, &options);
            let name = PathBuf::from(format!("scene in memory (.{extension})"));
            reading.sources.insert(0, pathtracer::source_file(&name, &bytes));
            reading
        })
    }

    /// Reads a scene made of values, which refers to files of a folder.
    pub(crate) fn values(
        self,
        py: Python<'_>,
        values: SceneValues,
        folder: &Path,
        places: &Places,
    ) -> PyResult<Read> {
        let origin = self.origin(None)?;
        let (options, folder) = (self.options, folder.to_owned());
        let read = move || {
            let name = PathBuf::from("scene in memory (.json)");
            let source = pathtracer::source_file(&name, values.text.as_bytes());
            let mut reading = pathtracer::read_values_with(values, &folder, &options);
            reading.sources.insert(0, source);
            reading
        };
        run_with(py, origin, read, |error| of_values(py, error, places))
    }

    /// Origin of the scene, without its sources.
    fn origin(&self, file: Option<PathBuf>) -> PyResult<SceneOrigin> {
        Ok(SceneOrigin {
            file,
            folder: std::env::current_dir()?,
            options: self.options.clone(),
            placement: self.placement,
            sources: Vec::new(),
        })
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
fn definitions(variables: &Bound<'_, PyMapping>) -> PyResult<Vec<(String, String)>> {
    let definition = |pair: Bound<'_, PyAny>| {
        let (name, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair.extract()?;
        let text = match value.extract::<bool>() {
            Ok(truth) => truth.to_string(),
            Err(_) => value.str()?.to_str()?.to_owned(),
        };
        Ok((name.extract()?, text))
    };
    variables.items()?.iter().map(definition).collect()
}

fn limits(given: &Bound<'_, PyMapping>) -> PyResult<Limits> {
    let mut limits = Limits::default();
    for pair in given.items()? {
        let (name, value): (String, Bound<'_, PyAny>) = pair.extract()?;
        let value = value.extract().map_err(|error| in_argument(&value, &name, &error))?;
        limits.set(&name.replace('_', "-"), value).map_err(PyValueError::new_err)?;
    }
    Ok(limits)
}

/// Reads a scene on another thread, so that Ctrl-C ends the wait.
fn run(
    py: Python<'_>,
    origin: SceneOrigin,
    read: impl FnOnce() -> LoadResult + Send + 'static,
) -> PyResult<Read> {
    run_with(py, origin, read, |error| of_load(py, error))
}

/// [`run`] with the conversion of its error.
fn run_with(
    py: Python<'_>,
    origin: SceneOrigin,
    read: impl FnOnce() -> LoadResult + Send + 'static,
    convert: impl FnOnce(&LoadError) -> PyErr,
) -> PyResult<Read> {
    // A reader cannot be stopped; it ends on its own.
    let LoadResult { scene, sources, .. } =
        match worker::run(py, read, |_| Ok(()), || Duration::ZERO)? {
            End::Done(reading) => reading,
            End::Stopped(error, _) => return Err(error),
        };
    let mut scene = scene.map_err(|error| convert(&error))?;
    if let Some(placement) = origin.placement {
        scene.place_camera(placement);
    }
    Ok((scene, SceneOrigin { sources, ..origin }))
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
