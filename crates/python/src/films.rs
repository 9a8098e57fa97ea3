//! Functions on films and images that were written: resume, merge, rerender.

use std::path::PathBuf;
use std::time::Duration;

use pt_cli::{FilmImage, Purpose};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::image::{Image, Rendered};
use crate::progress::{Callbacks, Watch};
use crate::render::{Failure, image_of};
use crate::settings::{Settings, words};
use crate::worker::{self, End};

/// Continues a render that was stopped, or adds samples to one.
///
/// The film and the image are written as by the program, whose `resume` this is. The image equals
/// that of an uninterrupted render, bit for bit; a scene that has changed since is refused.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     The image, or its film (.film).
/// spp : int, optional
///     Samples per pixel that the image will have; by default the number requested before.
/// threads : int, optional
///     Number of threads; by default as before.
/// time_limit : float or str, optional
///     Time after which the render stops, in seconds or as "90s", "10m", "1h30m".
/// checkpoint_every : float or str, optional
///     Time between two writes of the film; 0 is never. By default as before.
/// allow_outside : bool, optional
///     True if the scene may refer to files outside of its folder.
/// allow_folders : sequence of str or os.PathLike, optional
///     Further folders to whose files the scene may refer.
/// progress : callable or bool, optional
///     As for :func:`render`.
///
/// Returns
/// -------
/// Image
///     With warnings among its notes.
///
/// Raises
/// ------
/// OSError
///     If a file cannot be read or written, or another process writes the image.
/// SceneError
///     If the scene cannot be read or rendered.
/// ValueError, TypeError
///     If the file is no film, the scene has changed, or an argument has a wrong value.
/// Interrupted
///     After Ctrl-C, with the image so far as `partial`; the film is written, too.
#[pyfunction]
#[pyo3(signature = (
    path, *, spp = None, threads = None, time_limit = None, checkpoint_every = None,
    allow_outside = None, allow_folders = None, progress = None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub(crate) fn resume(
    py: Python<'_>,
    path: PathBuf,
    spp: Option<Bound<'_, PyAny>>,
    threads: Option<Bound<'_, PyAny>>,
    time_limit: Option<Bound<'_, PyAny>>,
    checkpoint_every: Option<Bound<'_, PyAny>>,
    allow_outside: Option<Bound<'_, PyAny>>,
    allow_folders: Option<Vec<PathBuf>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Image> {
    let given = [
        ("spp", spp),
        ("threads", threads),
        ("time_limit", time_limit),
        ("checkpoint_every", checkpoint_every),
        ("allow_outside", allow_outside),
    ];
    let keywords = keywords(py, Purpose::Resume, given, allow_folders)?;
    let callbacks = Callbacks::new(py, progress, None)?;
    image_of(py, Watch::new(None, None), &callbacks, move |watch| {
        pt_cli::resume(&path, &keywords, watch).map(rendered).map_err(Failure::Command)
    })
}

/// Renders an image again by its receipt, and compares the two.
///
/// The second image is written as by the program, whose `rerender` this is.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     The image, .png or .exr.
/// output : str or os.PathLike, optional
///     The second image; by default NAME_again, beside the first one.
/// force : bool, optional
///     True if an existing second image is overwritten.
/// threads, allow_outside, allow_folders, progress
///     As for :func:`resume`.
///
/// Returns
/// -------
/// Image
///     The second image, whose file is equal to the first one, bit for bit.
///
/// Raises
/// ------
/// RuntimeError
///     If the two images differ.
/// OSError, SceneError, ValueError, TypeError, Interrupted
///     As :func:`resume`; also if the image has no receipt with a command.
#[pyfunction]
#[pyo3(signature = (
    path, *, output = None, force = None, threads = None, allow_outside = None,
    allow_folders = None, progress = None
))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub(crate) fn rerender(
    py: Python<'_>,
    path: PathBuf,
    output: Option<Bound<'_, PyAny>>,
    force: Option<Bound<'_, PyAny>>,
    threads: Option<Bound<'_, PyAny>>,
    allow_outside: Option<Bound<'_, PyAny>>,
    allow_folders: Option<Vec<PathBuf>>,
    progress: Option<&Bound<'_, PyAny>>,
) -> PyResult<Image> {
    let given = [
        ("output", output),
        ("force", force),
        ("threads", threads),
        ("allow_outside", allow_outside),
    ];
    let keywords = keywords(py, Purpose::Rerender, given, allow_folders)?;
    let callbacks = Callbacks::new(py, progress, None)?;
    image_of(py, Watch::new(None, None), &callbacks, move |watch| {
        pt_cli::rerender(&path, &keywords, watch).map(rendered).map_err(Failure::Command)
    })
}

/// Merges films of disjoint ranges of samples, and writes the image or the film of their sum.
///
/// Parameters
/// ----------
/// paths : sequence of str or os.PathLike
///     The films, in any order.
/// output : str or os.PathLike
///     File, .png, .exr or .film.
///
/// Returns
/// -------
/// Image
///     Equal to that of a single render of all samples, bit for bit.
///
/// Raises
/// ------
/// OSError
///     If a file cannot be read or written.
/// ValueError, TypeError
///     If the films are of different images, or samples are missing or repeated.
#[pyfunction]
pub(crate) fn merge(py: Python<'_>, paths: Vec<PathBuf>, output: PathBuf) -> PyResult<Image> {
    let work = move || pt_cli::merge(&paths, &output).map(rendered).map_err(Failure::Command);
    // A merge cannot be stopped; it ends on its own.
    match worker::run(py, work, |_| Ok(()), || Duration::ZERO)? {
        End::Done(Ok(rendered)) => Image::new(py, rendered),
        End::Done(Err(failure)) => Err(failure.into_error(py)),
        End::Stopped(error, _) => Err(error),
    }
}

/// Keywords of a command, of which the folders are seen from the current one.
fn keywords<const N: usize>(
    py: Python<'_>,
    purpose: Purpose,
    given: [(&str, Option<Bound<'_, PyAny>>); N],
    folders: Option<Vec<PathBuf>>,
) -> PyResult<Settings> {
    let named = PyDict::new(py);
    for (name, value) in given {
        named.set_item(name, value)?;
    }
    let mut all = words(purpose, Some(&named))?;
    for folder in folders.into_iter().flatten() {
        let folder = std::path::absolute(folder)?;
        all.push(("allow_folder".to_owned(), vec![folder.to_string_lossy().into_owned()]));
    }
    Ok(all)
}

fn rendered(FilmImage { film, names, notes, provenance }: FilmImage) -> Rendered {
    Rendered::new(&film, &names, &notes, provenance)
}
