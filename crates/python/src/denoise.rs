//! Denoising of images in memory.

use std::path::PathBuf;
use std::thread::available_parallelism;
use std::time::Duration;

use pathtracer::denoise::{DenoiseError, Denoiser, DenoiserInput};
use pathtracer::image::Image;
use pathtracer::{Aov, Film, aov};
use pyo3::exceptions::{PyOSError, PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::errors::in_argument;
use crate::worker::{self, End};

/// Albedo and normals that guide the denoiser, as means over all samples of a pixel.
#[derive(Clone)]
pub(crate) struct Guides {
    albedo: Vec<[f32; 3]>,
    normal: Option<Vec<[f32; 3]>>,
}

impl Guides {
    /// Guides of a film; `None` without albedo, which the library requires for normals.
    pub(crate) fn of_film(film: &Film) -> Option<Self> {
        let albedo = aov::means_of_all_samples(film, Aov::Albedo)?;
        Some(Self { albedo, normal: aov::means_of_all_samples(film, Aov::Normal) })
    }
}

/// Denoises an image on a thread of its own; also returns the version of the library.
///
/// # Errors
/// OSError if the library cannot be opened, RuntimeError if it fails.
pub(crate) fn denoised(
    py: Python<'_>,
    noisy: Image,
    guides: Option<Guides>,
    threads: Option<usize>,
) -> PyResult<(Vec<[f32; 3]>, String)> {
    let folders = package_folder(py)?;
    let threads = threads.filter(|threads| *threads > 0);
    let threads = threads.unwrap_or_else(|| available_parallelism().map_or(1, usize::from));
    let work = move || {
        let denoiser = Denoiser::open_in(folders.as_slice(), threads)?;
        let guides = guides.as_ref();
        let pixels = denoiser.denoise(DenoiserInput {
            width: noisy.width,
            color: &noisy.pixels,
            albedo: guides.map(|guides| guides.albedo.as_slice()),
            normal: guides.and_then(|guides| guides.normal.as_deref()),
        })?;
        Ok((pixels, denoiser.version()))
    };
    // The library cannot be stopped; it ends on its own.
    match worker::run(py, work, |_| Ok(()), || Duration::ZERO)? {
        End::Done(result) => result.map_err(|error| of_library(&error)),
        End::Stopped(error, _) => Err(error),
    }
}

/// Number of threads by an argument; 0 is one per core.
pub(crate) fn threads(value: &Bound<'_, PyAny>) -> PyResult<usize> {
    const MAX: usize = 4096;
    let found = value.extract().or_else(|error: PyErr| {
        let is_type = error.is_instance_of::<PyTypeError>(value.py());
        if is_type { Err(in_argument(value, "threads", &error)) } else { Ok(usize::MAX) }
    })?;
    if found <= MAX {
        return Ok(found);
    }
    let message = format!("threads: found {value}, expected a number from 0 up to {MAX}");
    Err(PyValueError::new_err(message))
}

/// Folder of the package pyoidn, if this interpreter can import it.
pub(crate) fn package_folder(py: Python<'_>) -> PyResult<Option<PathBuf>> {
    let spec = py.import("importlib.util")?.call_method1("find_spec", ("pyoidn",))?;
    if spec.is_none() {
        return Ok(None);
    }
    let origin: Option<PathBuf> = spec.getattr("origin")?.extract()?;
    Ok(origin.and_then(|file| Some(file.parent()?.parent()?.to_owned())))
}

fn of_library(error: &DenoiseError) -> PyErr {
    if error.is_about_library() {
        PyOSError::new_err(error.to_string())
    } else {
        PyRuntimeError::new_err(error.to_string())
    }
}
