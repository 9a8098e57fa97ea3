//! Functions on image files: develop, denoise, join.

use std::ffi::CString;
use std::path::PathBuf;
use std::sync::Arc;

use pt_cli::{CommandError, ImageFiles, Purpose};
use pyo3::exceptions::{PyTypeError, PyUserWarning};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::denoise::package_folder;
use crate::errors::of_command;
use crate::progress::Watch;
use crate::settings::words;
use crate::worker::{self, End};

/// Develops rendered images: exposure, tone curve, alpha, crop and size.
///
/// Reads OpenEXR images, also those of other programs, and all other formats of textures. A PNG
/// image has the pixels that a render with the same options writes, bit for bit.
///
/// Parameters
/// ----------
/// images : str, os.PathLike, or an iterable of them
///     The images.
/// output : str or os.PathLike, optional
///     File, .png or .exr, of a single image, or folder, in which each image becomes NAME.png; by
///     default IMAGE.png, beside each.
/// **options
///     Options of ``pathtracer develop``: `layer`, a name such as "albedo"; `crop`, four numbers of
///     pixels: column and row of the lower left corner, counted from the lower left, width and
///     height; `resize`, width and height in pixels; `exposure` in stops, or "auto"; `tonemap`, a
///     tone curve; `alpha`, True if it is written; `png_bits`, 8 or 16; `exr_type`;
///     `exr_compression`.
///
/// Returns
/// -------
/// list of pathlib.Path
///     The files that were written.
///
/// Raises
/// ------
/// OSError
///     If a file cannot be read or written; the other images are written.
/// ValueError, TypeError
///     If an option is unknown or has a wrong value, or a file is no image.
///
/// Warns
/// -----
/// UserWarning
///     If an image has values that are not finite.
#[pyfunction]
#[pyo3(signature = (images, output = None, **options))]
pub(crate) fn develop(
    images: &Bound<'_, PyAny>,
    output: Option<PathBuf>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<PathBuf>> {
    let (py, images) = (images.py(), paths("images", images)?);
    let words = words(Purpose::Develop, options)?;
    written(py, move |watch| pt_cli::develop(&images, output.as_deref(), &words, watch))
}

/// Denoises rendered images with Intel Open Image Denoise.
///
/// The layers albedo and normal of an image preserve detail. An OpenEXR image keeps all layers, and
/// the noisy image as the layer "noisy"; an image with that layer is denoised again from it.
///
/// Parameters
/// ----------
/// images : str, os.PathLike, or an iterable of them
///     The images.
/// output : str or os.PathLike, optional
///     File, .exr or .png, of a single image, or folder, in which each image becomes
///     NAME_denoised.exr; by default IMAGE_denoised.exr, beside each.
/// **options
///     Options of ``pathtracer denoise``: `threads`, 0 being one per core; `exposure`, `tonemap`
///     and `png_bits` of PNG images.
///
/// Returns
/// -------
/// list of pathlib.Path
///     The files that were written.
///
/// Raises
/// ------
/// OSError
///     If the library is missing, or a file cannot be read or written; the other images are
///     written.
/// ValueError, TypeError
///     If an option is unknown or has a wrong value, or a file is no image.
///
/// Warns
/// -----
/// UserWarning
///     If an image has values that are not finite.
#[pyfunction]
#[pyo3(signature = (images, output = None, **options))]
pub(crate) fn denoise(
    images: &Bound<'_, PyAny>,
    output: Option<PathBuf>,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<PathBuf>> {
    let (py, images) = (images.py(), paths("images", images)?);
    let words = words(Purpose::Denoise, options)?;
    let folders = package_folder(py)?;
    written(py, move |watch| {
        pt_cli::denoise(&images, output.as_deref(), &words, folders.as_slice(), watch)
    })
}

/// Joins images of parts, rendered with `crop`, into the whole image.
///
/// All channels equal those of a single render, bit for bit.
///
/// Parameters
/// ----------
/// parts : iterable of str or os.PathLike
///     The images of the parts, .exr, in any order.
/// output : str or os.PathLike
///     File, .exr or .png.
/// **options
///     Options of ``pathtracer join``: `allow_gaps`, True if missing pixels are left black and
///     transparent; `exposure`, `tonemap` and `png_bits` of PNG images.
///
/// Returns
/// -------
/// list of pathlib.Path
///     The file that was written.
///
/// Raises
/// ------
/// OSError
///     If a file cannot be read or written.
/// ValueError, TypeError
///     If parts are of different images, pixels are missing or have different values, or an option
///     is unknown or has a wrong value.
#[pyfunction]
#[pyo3(signature = (parts, output, **options))]
pub(crate) fn join(
    parts: &Bound<'_, PyAny>,
    output: PathBuf,
    options: Option<&Bound<'_, PyDict>>,
) -> PyResult<Vec<PathBuf>> {
    let (py, parts) = (parts.py(), paths("parts", parts)?);
    let words = words(Purpose::Join, options)?;
    written(py, move |_| pt_cli::join(&parts, &output, &words))
}

/// Paths of a path or of an iterable of paths.
fn paths(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<PathBuf>> {
    if let Ok(path) = value.extract() {
        return Ok(vec![path]);
    }
    let items: Vec<_> = match value.try_iter() {
        Ok(items) => items.collect::<PyResult<_>>()?,
        Err(_) => vec![value.clone()],
    };
    let wrong = |item: &Bound<'_, PyAny>| {
        let found = item.get_type().name().map(|name| name.to_string()).unwrap_or_default();
        PyTypeError::new_err(format!("{name}: found {found}, expected a path or several paths"))
    };
    items.iter().map(|item| item.extract().map_err(|_: PyErr| wrong(item))).collect()
}

/// Runs a command on a thread of its own. After Ctrl-C, it ends with the image under way.
fn written(
    py: Python<'_>,
    command: impl FnOnce(&Watch) -> Result<ImageFiles, CommandError> + Send + 'static,
) -> PyResult<Vec<PathBuf>> {
    let watch = Arc::new(Watch::new(None, None));
    let observed = watch.clone();
    match worker::run(py, move || command(&observed), |_| Ok(()), || watch.stop())? {
        End::Done(Ok(ImageFiles { paths, warnings })) => {
            for warning in warnings {
                let text = CString::new(warning)?;
                PyErr::warn(py, &py.get_type::<PyUserWarning>(), &text, 1)?;
            }
            Ok(paths)
        }
        End::Done(Err(error)) => Err(of_command(py, error)),
        End::Stopped(error, _) => Err(error),
    }
}
