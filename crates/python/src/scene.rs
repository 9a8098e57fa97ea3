//! Scenes.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use pathtracer::queries::{SceneQueries, SurfaceHit};
use pathtracer::scene_stats;
use pt_cli::SceneOrigin;
use pt_math::Ray;
use pyo3::exceptions::{PyFileExistsError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyCFunction, PyDict, PyTuple};

use crate::errors::of_render;
use crate::finding::Finding;
use crate::queries::{self, Found, Hits, RayArrays, Target};
use crate::reading::Reading;
use crate::worker::{self, End};

/// A scene: shapes, materials, lights and cameras, as :func:`load` returns it.
#[pyclass(frozen, module = "pathtracer")]
#[expect(clippy::struct_field_names, reason = "a scene of Python has one of the library")]
pub(crate) struct Scene {
    pub(crate) scene: Arc<pathtracer::Scene>,
    origin: Arc<SceneOrigin>,
    /// Surfaces, once a ray was asked for.
    surfaces: OnceLock<Arc<Surfaces>>,
}

/// Surfaces of a scene.
struct Surfaces(SceneQueries);

impl Target for Surfaces {
    fn nearest(&self, rays: &[Ray]) -> Vec<Option<Found>> {
        let (rays, lengths) = with_unit_directions(rays);
        let mut hits = Vec::new();
        self.0.intersect(&rays, &mut hits);
        let found = |(hit, length): (Option<SurfaceHit>, f64)| {
            let SurfaceHit { t, object, primitive, uv, position, normal } = hit?;
            let t = (f64::from(t) / length) as f32;
            Some(Found { t, shape: object, primitive, uv, position, normal })
        };
        hits.into_iter().zip(lengths).map(found).collect()
    }

    fn occluded(&self, rays: &[Ray], occluded: &mut Vec<bool>) {
        self.0.occluded(&with_unit_directions(rays).0, occluded);
    }
}

/// The rays with directions of length 1, and the lengths before.
fn with_unit_directions(rays: &[Ray]) -> (Vec<Ray>, Vec<f64>) {
    let unit = |ray: &Ray| {
        // In double precision, no length overflows or vanishes.
        let direction = ray.direction.as_dvec3();
        let length = direction.length();
        let [t_min, t_max] = [ray.t_min, ray.t_max].map(|t| (f64::from(t) * length) as f32);
        (Ray { direction: (direction / length).as_vec3(), t_min, t_max, ..*ray }, length)
    };
    rays.iter().map(unit).unzip()
}

/// Text of JSON; arrays of NumPy become lists, and paths text.
fn json_of<'py>(scene: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyAny>> {
    let py = scene.py();
    let default = |arguments: &Bound<'_, PyTuple>, _: Option<&Bound<'_, PyDict>>| {
        let value = arguments.get_item(0)?;
        let converted = ["tolist", "__fspath__"].map(|method| value.call_method0(method));
        let [list, path] = converted;
        list.or(path).map(Bound::unbind).map_err(|_| {
            let found = value.get_type().to_string();
            PyTypeError::new_err(format!("scene: found {found}, expected values of JSON or arrays"))
        })
    };
    let options = PyDict::new(py);
    options.set_item("default", PyCFunction::new_closure(py, None, None, default)?)?;
    options.set_item("allow_nan", false)?;
    py.import("json")?.call_method("dumps", (scene,), Some(&options))
}

#[pymethods]
impl Scene {
    /// Creates a scene from values of the project's own format.
    ///
    /// Parameters
    /// ----------
    /// scene : dict
    ///     Content of a scene file (.json): dictionaries, lists, numbers, text and truth values;
    ///     also arrays of NumPy in place of lists, and paths.
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
    /// SceneError
    ///     If the content is invalid; `errors` names the fields.
    /// TypeError, ValueError
    ///     If a value has no counterpart in JSON, or as :func:`load`.
    #[staticmethod]
    #[pyo3(signature = (scene, folder = PathBuf::new(), **options))]
    fn from_dict(
        scene: &Bound<'_, PyDict>,
        folder: PathBuf,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let text: String = json_of(scene)?.extract()?;
        let reading = Reading::new(options)?;
        reading.content(scene.py(), text.into_bytes(), "json", &folder).map(Self::new)
    }

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
        let errors = errors.map(|message| Finding::new("error", None, message));
        let notes = notes.into_iter().map(|message| Finding::new("note", None, message));
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

    /// Finds the nearest surface on each ray, on all processors. The first call compiles the scene.
    ///
    /// Surfaces are those at the beginning of the shutter interval, of any opacity; shapes that
    /// belong to lights come after all objects.
    ///
    /// Parameters
    /// ----------
    /// origins, directions, tmin, tmax
    ///     As for :meth:`Bvh.intersect`.
    ///
    /// Returns
    /// -------
    /// Hits
    ///     Normals are on the side of the shading normal.
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     If the scene is invalid.
    /// TypeError, ValueError
    ///     If an argument has a wrong type, shape or value; the message says which.
    #[pyo3(signature = (origins, directions, tmax = None, *, tmin = None))]
    fn intersect(
        &self,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmax: Option<&Bound<'_, PyAny>>,
        tmin: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Hits> {
        let py = origins.py();
        let rays = RayArrays::new(origins, directions, [tmin, tmax])?;
        queries::intersect(py, &self.surfaces(py)?, rays)
    }

    /// Returns for each ray whether it hits anything, on all processors.
    ///
    /// Parameters
    /// ----------
    /// origins, directions, tmin, tmax
    ///     As for :meth:`intersect`.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of bool
    ///     True for rays that hit a surface; of the shape of the rays.
    ///
    /// Raises
    /// ------
    /// SceneError, TypeError, ValueError
    ///     As :meth:`intersect`.
    #[pyo3(signature = (origins, directions, tmax = None, *, tmin = None))]
    fn occluded(
        &self,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmax: Option<&Bound<'_, PyAny>>,
        tmin: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let py = origins.py();
        let rays = RayArrays::new(origins, directions, [tmin, tmax])?;
        queries::occluded(py, &self.surfaces(py)?, rays)
    }

    fn __repr__(&self) -> String {
        let pathtracer::Scene { name, objects, lights, cameras, .. } = &*self.scene;
        let [objects, lights, cameras] = [objects.len(), lights.len(), cameras.len()];
        format!("<Scene {name:?}: {objects} objects, {lights} lights, {cameras} cameras>")
    }
}

impl Scene {
    pub(crate) fn new((scene, origin): (pathtracer::Scene, SceneOrigin)) -> Self {
        let (scene, origin) = (Arc::new(scene), Arc::new(origin));
        Self { scene, origin, surfaces: OnceLock::new() }
    }

    /// The scene and its origin, for other threads.
    pub(crate) fn shared(&self) -> (Arc<pathtracer::Scene>, Arc<SceneOrigin>) {
        (Arc::clone(&self.scene), Arc::clone(&self.origin))
    }

    /// Surfaces, compiled by the first call.
    fn surfaces(&self, py: Python<'_>) -> PyResult<Arc<Surfaces>> {
        if let Some(surfaces) = self.surfaces.get() {
            return Ok(Arc::clone(surfaces));
        }
        let scene = Arc::clone(&self.scene);
        let compile = move || SceneQueries::new(&scene);
        // A compilation cannot be stopped; it ends on its own.
        match worker::run(py, compile, |_| Ok(()), || Duration::ZERO)? {
            End::Done(Ok(queries)) => {
                // Of two threads that compile at the same time, the first one is kept.
                Ok(Arc::clone(self.surfaces.get_or_init(|| Arc::new(Surfaces(queries)))))
            }
            End::Done(Err(error)) => Err(Self::error(py, error.to_string())),
            End::Stopped(error, _) => Err(error),
        }
    }

    /// Error of a scene that cannot be rendered.
    pub(crate) fn error(py: Python<'_>, message: String) -> PyErr {
        of_render(py, message)
    }
}
