//! Scenes.

use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use pathtracer::queries::{SceneQueries, SurfaceHit};
use pathtracer::scene_stats;
use pt_cli::SceneOrigin;
use pt_math::{Bounds3, Ray};
use pyo3::exceptions::{PyFileExistsError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};

use crate::editing;
use crate::errors::{of_render, unknown_keyword};
use crate::finding::Finding;
use crate::places::Places;
use crate::queries::{self, Found, Hits, RayArrays, Target};
use crate::reading::{OPTIONS, Reading};
use crate::source::SceneSource;
use crate::values;
use crate::worker::{self, End};

/// A scene: shapes, materials, lights and cameras, as :func:`load` returns it, or made of parts.
///
/// Parts are those of :mod:`pathtracer.build`, or dictionaries of a scene file; the keywords are
/// the keys of a scene file. A part that several others use is stored once.
///
/// Parameters
/// ----------
/// camera : Camera, optional
///     Camera; the whole scene is visible by default.
/// cameras : sequence of Camera, optional
///     Cameras, in place of `camera`.
/// used_camera : int, optional
///     Index of the active camera; by default the last one.
/// objects : sequence of Object, optional
///     Objects.
/// lights : sequence of Light, optional
///     Lights.
/// settings : Settings, optional
///     Settings of renders, which the keywords of :func:`render` replace.
/// materials, media, textures, images, meshes, points : dict of str to parts, optional
///     Parts to which others may refer by name.
/// grids, profiles, measurements, motions : dict of str to parts, optional
///     Further parts to which others may refer by name.
/// name : str, optional
///     Name of the scene.
/// metres_per_unit : float, optional
///     Metres per unit of length, 1 by default.
/// folder : str or os.PathLike, optional
///     Folder of the files to which the scene refers; by default the current one.
/// allow_outside, allow_folders, limits, point_radius, strict : optional
///     As for :func:`load`.
///
/// Raises
/// ------
/// SceneError
///     If the scene is invalid; `errors` names the arguments.
/// TypeError, ValueError
///     If a value has no counterpart in a scene file, or a keyword is unknown; the message names
///     it.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Scene {
    pub(crate) source: SceneSource,
    /// Surfaces, once a ray was asked for.
    surfaces: OnceLock<Arc<Surfaces>>,
}

/// Keys of a scene.
const KEYS: [&str; 18] = [
    "camera",
    "cameras",
    "grids",
    "images",
    "lights",
    "materials",
    "measurements",
    "media",
    "meshes",
    "metres_per_unit",
    "motions",
    "name",
    "objects",
    "points",
    "profiles",
    "settings",
    "textures",
    "used_camera",
];

/// Surfaces of a scene.
struct Surfaces(SceneQueries);

impl Target for Surfaces {
    fn bounds(&self) -> Bounds3 {
        self.0.bounds()
    }

    fn nearest(&self, rays: &[Ray], found: &mut Vec<Found>) {
        let (rays, lengths) = with_unit_directions(rays);
        let mut hits = Vec::new();
        self.0.intersect(&rays, &mut hits);
        found.extend(hits.into_iter().zip(lengths).map(|(hit, length)| {
            let Some(hit) = hit else { return Found::NOTHING };
            let SurfaceHit { t, object, primitive, uv, position, normal } = hit;
            let t = (f64::from(t) / length) as f32;
            let [shape, primitive] = [object, primitive].map(|index| index as i32);
            Found { t, shape, primitive, uv, position, normal }
        }));
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

#[pymethods]
impl Scene {
    #[new]
    #[pyo3(signature = (*, folder = PathBuf::new(), **keys))]
    fn of_parts(
        py: Python<'_>,
        folder: PathBuf,
        keys: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let (parts, options) = (PyDict::new(py), PyDict::new(py));
        for (name, value) in keys.into_iter().flatten() {
            let name: String = name.extract()?;
            let of_scene = KEYS.contains(&name.as_str());
            if !of_scene && !OPTIONS.contains(&name.as_str()) {
                return Err(unknown_keyword(&name, &KEYS, &OPTIONS));
            }
            (if of_scene { &parts } else { &options }).set_item(name, value)?;
        }
        let values = py.import("pathtracer._values")?.call_method1("of_parts", (parts,))?;
        let (values, places): (Bound<'_, PyDict>, Vec<(String, String)>) = values.extract()?;
        Self::of_values(&values, &Places::new(places), &folder, Some(&options))
    }

    /// Creates a scene from values of the project's own format.
    ///
    /// Parameters
    /// ----------
    /// scene : dict
    ///     Content of a scene file (.json): dictionaries, lists, numbers, text and truth values;
    ///     paths as text or os.PathLike. In place of lists, arrays of NumPy, or of any library with
    ///     DLPack or the buffer protocol, in the memory of the processor; each is copied once. In
    ///     place of the path of a profile or of a measured material, the content of the file, as
    ///     bytes.
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
    ///     If a value has no counterpart in JSON, which the message names, or as :func:`load`.
    #[staticmethod]
    #[pyo3(signature = (scene, folder = PathBuf::new(), **options))]
    fn from_dict(
        scene: &Bound<'_, PyDict>,
        folder: PathBuf,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        Self::of_values(scene, &Places::default(), &folder, options)
    }

    /// Returns the scene as values of the project's own format, the inverse of :meth:`from_dict`.
    ///
    /// Returns
    /// -------
    /// dict
    ///     Content of a scene file (.json). Meshes, points and grids have arrays of float32 and
    ///     uint32 in place of lists. Images have `pixels`, of float32 and shape (height, width, 3),
    ///     in linear light. The `file` of a profile or of a measured material is its content, as
    ///     bytes. The arrays are copies: changes of them do not change this scene.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If a number of the scene is not finite.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        values::to_python(py, &self.source.scene)
    }

    /// Returns a scene with other parts. All else is shared with this scene, which does not change:
    /// meshes, images, and what a render has compiled.
    ///
    /// Renders of the new scene are equal, bit for bit, to those of a scene that is made of all its
    /// parts anew.
    ///
    /// Parameters
    /// ----------
    /// camera : Camera, optional
    ///     Camera in place of the active one.
    /// used_camera : str or int, optional
    ///     Name or number of the active camera.
    /// materials : dict of str to Material, optional
    ///     Materials in place of those of these names; see :attr:`materials`.
    /// transforms : dict of str or int to array_like, optional
    ///     Transforms from objects to the world, by the name of the object or its number: matrices
    ///     of shape (4, 4) or (3, 4), computed with in double precision, or steps as elsewhere.
    /// lights : sequence of Light, or dict of str or int to Light, optional
    ///     All lights, or lights in place of those of these names or numbers.
    /// settings : Settings, optional
    ///     Settings of renders.
    /// textures, images, meshes, points, grids, profiles, measurements, motions : dict, optional
    ///     Further parts to which the new parts refer by name.
    /// folder : str or os.PathLike, optional
    ///     Folder of the files to which the new parts refer; by default the current one.
    /// allow_outside, allow_folders, limits, strict : optional
    ///     As for :func:`load`.
    ///
    /// Returns
    /// -------
    /// Scene
    ///
    /// Raises
    /// ------
    /// SceneError
    ///     If a part is invalid; `errors` names the arguments.
    /// TypeError, ValueError
    ///     If a name or number is unknown or that of several items, a keyword is unknown, a matrix
    ///     has a wrong shape, or a value has no counterpart in a scene file; the message names it.
    #[pyo3(signature = (*, folder = PathBuf::new(), **changes))]
    fn replace(
        &self,
        py: Python<'_>,
        folder: PathBuf,
        changes: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let none = PyDict::new(py);
        editing::replaced(&self.source, &folder, changes.unwrap_or(&none)).map(Self::of)
    }

    /// Camera or None: Copy of the active camera; its transform is an array of shape (4, 4).
    #[getter]
    fn camera<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyAny>>> {
        let camera = self.source.scene.camera().cloned();
        let cameras = editing::cameras(py, &self.source.scene, camera.into_iter().collect())?;
        Ok(cameras.into_iter().next())
    }

    /// list of Camera: Copies of all cameras.
    #[getter]
    fn cameras<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyAny>>> {
        editing::cameras(py, &self.source.scene, self.source.scene.cameras.clone())
    }

    /// list of str: Names of the materials, as in a scene file.
    #[getter]
    fn materials(&self) -> Vec<String> {
        pathtracer::names_of(&self.source.scene).0
    }

    /// Returns a copy of a material.
    ///
    /// Parameters
    /// ----------
    /// name : str
    ///     One of :attr:`materials`.
    ///
    /// Returns
    /// -------
    /// Material
    ///     Textures are dictionaries, with images as arrays.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If there is no material of this name.
    fn material<'py>(
        &self,
        py: Python<'py>,
        name: &Bound<'py, PyString>,
    ) -> PyResult<Bound<'py, PyAny>> {
        editing::material(py, &self.source.scene, name)
    }

    /// list of str: Names of the lights, which may be empty or the same ones.
    #[getter]
    fn lights(&self) -> Vec<String> {
        editing::names(&self.source.scene.lights, |light| &light.name)
    }

    /// Returns a copy of a light.
    ///
    /// Parameters
    /// ----------
    /// light : str or int
    ///     Name or number of the light.
    ///
    /// Returns
    /// -------
    /// Light
    ///     Its transform is an array of shape (4, 4); images are arrays.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If there is no such light, or several have the name.
    fn light<'py>(
        &self,
        py: Python<'py>,
        light: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        editing::light(py, &self.source.scene, light)
    }

    /// list of str: Names of the objects, which may be empty or the same ones.
    #[getter]
    fn objects(&self) -> Vec<String> {
        editing::names(&self.source.scene.objects, |object| &object.name)
    }

    /// dict of str or int to numpy.ndarray: Transforms from objects to the world, of shape (4, 4)
    /// and type float64, by the name of the object, or by its number if it has no name of its own.
    #[getter]
    fn transforms<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        editing::transforms(py, &self.source.scene)
    }

    /// bool: True if a render compiles only what differs from an earlier one: of this scene, of
    /// the one from which it was edited, or of another one that was edited from it and has its
    /// objects.
    #[getter]
    fn compiled(&self) -> bool {
        self.source.is_compiled()
    }

    /// str: Name of the scene: the one of the file, or the name of the file.
    #[getter]
    fn name(&self) -> &str {
        &self.source.scene.name
    }

    /// list of Finding: Missing files, which placeholders replace.
    #[getter]
    fn missing(&self) -> Vec<Finding> {
        self.source.scene.missing.iter().map(|file| Finding::of_warning("missing", file)).collect()
    }

    /// list of Finding: Notes of the reader, as about approximated features.
    #[getter]
    fn notes(&self) -> Vec<Finding> {
        self.source.scene.warnings.iter().map(|note| Finding::of_warning("note", note)).collect()
    }

    /// Checks the scene as a render would, without rendering it.
    ///
    /// Returns
    /// -------
    /// list of Finding
    ///     Errors, missing files and notes, in this order.
    fn check(&self, py: Python<'_>) -> Vec<Finding> {
        let scene = &self.source.scene;
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
        let scene = &self.source.scene;
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
        let pathtracer::Scene { name, objects, lights, cameras, .. } = &*self.source.scene;
        let [objects, lights, cameras] = [objects.len(), lights.len(), cameras.len()];
        format!("<Scene {name:?}: {objects} objects, {lights} lights, {cameras} cameras>")
    }
}

impl Scene {
    pub(crate) fn new((scene, origin): (pathtracer::Scene, SceneOrigin)) -> Self {
        Self::of(SceneSource::new(scene, origin))
    }

    pub(crate) fn of(source: SceneSource) -> Self {
        Self { source, surfaces: OnceLock::new() }
    }

    /// A scene made of values; `places` has the names of its parts for messages.
    pub(crate) fn of_values(
        values: &Bound<'_, PyDict>,
        places: &Places,
        folder: &Path,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let reading = Reading::new(options)?;
        let of_scene = values::of_python(values, places)?;
        reading.values(values.py(), of_scene, folder, places).map(Self::new)
    }

    /// Surfaces, compiled by the first call.
    fn surfaces(&self, py: Python<'_>) -> PyResult<Arc<Surfaces>> {
        if let Some(surfaces) = self.surfaces.get() {
            return Ok(Arc::clone(surfaces));
        }
        let source = self.source.clone();
        let compile = move || source.queries();
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
