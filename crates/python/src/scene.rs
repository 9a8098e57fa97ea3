//! Scenes.

use std::path::PathBuf;
use std::sync::Arc;

use pathtracer::scene_stats;
use pyo3::exceptions::{PyFileExistsError, PyValueError};
use pyo3::prelude::*;

use crate::errors::of_scene;
use crate::finding::Finding;

/// A scene: shapes, materials, lights and cameras, as :func:`load` returns it.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Scene {
    pub(crate) scene: Arc<pathtracer::Scene>,
}

impl From<pathtracer::Scene> for Scene {
    fn from(scene: pathtracer::Scene) -> Self {
        Self { scene: Arc::new(scene) }
    }
}

#[pymethods]
impl Scene {
    /// str: Name of the scene: the one of the file, or the name of the file.
    #[getter]
    fn name(&self) -> &str {
        &self.scene.name
    }

    /// list of Finding: Missing files, which placeholders replace.
    #[getter]
    fn missing(&self) -> Vec<Finding> {
        self.scene.missing.iter().map(|file| Finding::of_warning("missing", file)).collect()
    }

    /// list of Finding: Notes of the reader, as about approximated features.
    #[getter]
    fn notes(&self) -> Vec<Finding> {
        self.scene.warnings.iter().map(|note| Finding::of_warning("note", note)).collect()
    }

    /// Checks the scene as a render would, without rendering it.
    ///
    /// Returns
    /// -------
    /// list of Finding
    ///     Errors, missing files and notes, in this order.
    fn check(&self, py: Python<'_>) -> Vec<Finding> {
        let scene = &self.scene;
        let (errors, notes) = py.detach(|| match scene_stats::compiled(scene) {
            Ok(session) => (None, session.notes().to_vec()),
            Err(error) => (Some(error.to_string()), Vec::new()),
        });
        let of_compiler = |severity, message| Finding::new(severity, None, message);
        let errors = errors.map(|message| of_compiler("error", message));
        let notes = notes.into_iter().map(|message| of_compiler("note", message));
        errors.into_iter().chain(self.missing()).chain(self.notes()).chain(notes).collect()
    }

    /// Writes the scene to a file.
    ///
    /// Parameters
    /// ----------
    /// path : str or os.PathLike
    ///     File, .json or .glb. Images and large meshes of a .json scene go to a folder beside it.
    /// overwrite : bool
    ///     True if existing files are replaced.
    ///
    /// Returns
    /// -------
    /// list of str
    ///     Notes about what the format cannot represent.
    ///
    /// Raises
    /// ------
    /// FileExistsError
    ///     If the file or its folder exists and `overwrite` is False.
    /// ValueError
    ///     If the extension is unknown or the format cannot represent the scene.
    /// OSError
    ///     If a file cannot be written.
    #[pyo3(signature = (path, *, overwrite = false))]
    fn save(&self, py: Python<'_>, path: PathBuf, overwrite: bool) -> PyResult<Vec<String>> {
        use pathtracer::SaveError;
        let scene = &self.scene;
        py.detach(|| pathtracer::save(scene, &path, overwrite)).map_err(|error| {
            let message = error.to_string();
            match error {
                SaveError::Exists { .. } => PyFileExistsError::new_err(message),
                SaveError::Folder { .. } | SaveError::File(_) => {
                    pyo3::exceptions::PyOSError::new_err(message)
                }
                SaveError::UnknownFormat { .. } | SaveError::Content { .. } => {
                    PyValueError::new_err(message)
                }
            }
        })
    }

    fn __repr__(&self) -> String {
        let pathtracer::Scene { name, objects, lights, cameras, .. } = &*self.scene;
        let [objects, lights, cameras] = [objects.len(), lights.len(), cameras.len()];
        format!("<Scene {name:?}: {objects} objects, {lights} lights, {cameras} cameras>")
    }
}

impl Scene {
    /// Error of a scene that cannot be rendered.
    pub(crate) fn error(py: Python<'_>, message: String) -> PyErr {
        let finding = Finding::new("error", None, message.clone());
        of_scene(py, message, vec![finding])
    }
}
