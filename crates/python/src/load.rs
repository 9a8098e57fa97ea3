//! Functions that read scenes.

use std::path::PathBuf;

use pt_cli::SceneOrigin;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyString};

use crate::reading::Reading;
use crate::scene::Scene;

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
///     Time in seconds at which animations are shown: a glTF scene as at this time, one of Mitsuba
///     or pathtracer as if its shutter opened then. By default the rest pose, and the shutter of
///     the file.
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
    Reading::new(options)?.file(py, path).map(Scene::new)
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
    Reading::new(options)?.content(py, bytes, format, &folder).map(Scene::new)
}

/// The scene that the program renders if it is given none: a Cornell box with a mirror and a glass
/// sphere.
///
/// Returns
/// -------
/// Scene
#[pyfunction]
pub(crate) fn default_scene() -> Scene {
    Scene::new((pathtracer::default_scene(), SceneOrigin::default()))
}
