//! Materials, lights and phase functions over arrays, for plots and experiments.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use pathtracer::probes::{LightProbe, MaterialProbe, phase_function};
use pt_core::CompileError;
use pt_core::light::LightSampleContext;
use pt_core::phase::AnyPhase;
use pt_math::{DVec3, Ray, Vec3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use rayon::prelude::*;

use crate::arrays::Numbers;
use crate::errors::of_render;
use crate::places::Places;
use crate::queries::{array, stoppable};
use crate::scene::Scene;

/// Number of values that a thread computes at a time.
const CHUNK: usize = 1024;

/// Arrays of vectors and numbers of one common shape.
struct Inputs {
    /// Shape without the dimension of vectors.
    shape: Vec<usize>,
    /// Vectors, one after the other.
    vectors: Vec<Vec<Vec3>>,
    /// Random numbers, with as many for each as the function needs.
    random: Vec<f32>,
}

/// Vectors of arguments: name, value, and true for directions, whose length becomes 1.
type Vectors<'a, 'py> = (&'static str, &'a Bound<'py, PyAny>, bool);

impl Inputs {
    fn new<'py, const N: usize>(
        vectors: [Vectors<'_, 'py>; N],
        random: Option<(&'static str, &Bound<'py, PyAny>, usize)>,
    ) -> PyResult<Self> {
        let mut arrays = Vec::new();
        for (name, value, _) in vectors {
            let numbers = Numbers::real(name, value)?;
            numbers.expect(|shape| shape.last() == Some(&3), "(..., 3)")?;
            arrays.push(numbers);
        }
        let random = random.map(|(name, value, width)| {
            let numbers = Numbers::real(name, value)?;
            let expected = format!("(..., {width})");
            numbers.expect(|shape| shape.last() == Some(&width), &expected)?;
            PyResult::Ok((numbers, width))
        });
        let random = random.transpose()?;
        let without_last = |numbers: &Numbers<'_>| {
            let mut shape = numbers.shape()?;
            shape.pop();
            PyResult::Ok(shape)
        };
        let py = vectors[0].1.py();
        let mut shapes = arrays.iter().map(without_last).collect::<PyResult<Vec<_>>>()?;
        shapes.extend(
            random
                .iter()
                .map(|(numbers, _)| without_last(numbers))
                .collect::<PyResult<Vec<_>>>()?,
        );
        let shapes = shapes.into_iter().map(|shape| PyTuple::new(py, shape));
        let shapes = PyTuple::new(py, shapes.collect::<PyResult<Vec<_>>>()?)?;
        let common = py.import("numpy")?.getattr("broadcast_shapes")?.call1(shapes.clone());
        let common = common.map_err(|_| {
            let names: Vec<_> = vectors.iter().map(|(name, ..)| *name).collect();
            let names = names.join(", ");
            PyValueError::new_err(format!("{names}: shapes {shapes} cannot be broadcast"))
        })?;
        let shape: Vec<usize> = common.extract()?;
        let with = |width: usize| shape.iter().copied().chain([width]).collect::<Vec<_>>();
        let mut all = Vec::new();
        for (numbers, (name, _, is_direction)) in arrays.into_iter().zip(vectors) {
            let numbers = numbers.broadcast(&with(3))?;
            let values = numbers.singles(f32::is_finite, "a finite number")?;
            let vectors = values.as_chunks().0.iter().map(|v| Vec3::from_array(*v));
            all.push(if is_direction {
                vectors.enumerate().map(|(i, v)| unit(name, i, v)).collect::<PyResult<_>>()?
            } else {
                vectors.collect()
            });
        }
        let random = match random {
            None => Vec::new(),
            Some((numbers, width)) => numbers.broadcast(&with(width))?.singles(
                |u| (0.0..1.0).contains(&u),
                "a number from 0 up to but not including 1",
            )?,
        };
        Ok(Self { shape, vectors: all, random })
    }

    fn len(&self) -> usize {
        self.vectors[0].len()
    }

    fn random<const N: usize>(&self, i: usize) -> [f32; N] {
        self.random.as_chunks().0[i]
    }
}

/// Direction of length 1.
fn unit(name: &str, i: usize, v: Vec3) -> PyResult<Vec3> {
    // In double precision, no length overflows or vanishes.
    v.as_dvec3().try_normalize().map(DVec3::as_vec3).ok_or_else(|| {
        PyValueError::new_err(format!("{name}: vector {i} is zero, expected a direction"))
    })
}

/// Computes `f` of each index, on all processors.
fn each<T: Send + Default + Clone + 'static>(
    py: Python<'_>,
    count: usize,
    f: impl Fn(usize) -> T + Send + Sync + 'static,
) -> PyResult<Vec<T>> {
    let work = move |stopped: &AtomicBool| {
        let mut results = vec![T::default(); count];
        results.par_chunks_mut(CHUNK).enumerate().for_each(|(chunk, results)| {
            if !stopped.load(Ordering::Relaxed) {
                for (i, result) in results.iter_mut().enumerate() {
                    *result = f(chunk * CHUNK + i);
                }
            }
        });
        results
    };
    stoppable(py, work)
}

/// Array of results with rows of N.
fn rows<const N: usize>(
    py: Python<'_>,
    rows: Vec<[f32; N]>,
    shape: &[usize],
) -> PyResult<Py<PyAny>> {
    array(py, rows.into_flattened(), shape, Some(N))
}

/// Scene of a material or a phase function; `of` makes its values.
fn of_part(
    py: Python<'_>,
    of: &str,
    part: &Bound<'_, PyAny>,
    parts: Option<&Bound<'_, PyDict>>,
) -> PyResult<Scene> {
    let parts = parts.map_or_else(|| PyDict::new(py), Clone::clone);
    let values = py.import("pathtracer._values")?.call_method1(of, (part, parts))?;
    let (values, places): (Bound<'_, PyDict>, Vec<(String, String)>) = values.extract()?;
    Scene::of_values(&values, &Places::new(places), Path::new(""), None)
}

fn invalid(py: Python<'_>, error: &CompileError) -> PyErr {
    of_render(py, error.to_string())
}

/// Scattering of a material at a point of a surface: +z is the normal of its front, +x the
/// direction of increasing u. Directions point away from the surface, to its viewer (`wo`) and to
/// the light (`wi`); their lengths have no effect.
///
/// Parameters
/// ----------
/// material : Material
///     A material of :mod:`pathtracer.build`, or a dictionary of a scene file.
/// uv : tuple of two floats
///     Texture coordinates, from 0 to 1.
/// choice : float
///     Number from 0 to 1 that selects a part of a mixture: the second one if it is below the
///     amount of that. Renders draw it for each sample.
/// **parts
///     Other parts of a scene to which the material refers by name, as for :class:`Scene`.
///
/// Raises
/// ------
/// SceneError
///     If the material is invalid.
/// TypeError, ValueError
///     If an argument has a wrong type or value; the message says which.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Bsdf {
    probe: Arc<MaterialProbe>,
    choice: f32,
}

#[pymethods]
impl Bsdf {
    #[new]
    #[pyo3(signature = (material, *, uv = (0.5, 0.5), choice = 0.5, **parts))]
    fn new(
        material: &Bound<'_, PyAny>,
        uv: (f32, f32),
        choice: f32,
        parts: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let py = material.py();
        let is_share = |x: &f32| (0.0..=1.0).contains(x);
        if !is_share(&uv.0) || !is_share(&uv.1) {
            let (u, v) = uv;
            return Err(PyValueError::new_err(format!("uv: found ({u}, {v}), expected 0 to 1")));
        }
        if !is_share(&choice) {
            return Err(PyValueError::new_err(format!("choice: found {choice}, expected 0 to 1")));
        }
        let scene = of_part(py, "of_material", material, parts)?;
        // Slightly inside of the edges, which rays may miss.
        let [x, y] = [uv.0, uv.1].map(|c| (2.0 * c - 1.0) * (1.0 - 1e-6));
        let ray = Ray::new(Vec3::new(x, y, 1.0), Vec3::NEG_Z);
        let probe = py.detach(|| MaterialProbe::new(&scene.source.scene, &ray));
        let probe = probe.map_err(|error| invalid(py, &error))?;
        let probe = probe.ok_or_else(|| PyValueError::new_err("material: found no surface"))?;
        Ok(Self { probe: Arc::new(probe), choice: choice.min(1.0_f32.next_down()) })
    }

    /// Evaluates f(wo, wi) |cos θi|, without Dirac deltas (mirrors, smooth glass).
    ///
    /// Parameters
    /// ----------
    /// wo, wi : array_like of float, shape (..., 3)
    ///     Directions to the viewer and to the light; they are broadcast together.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of float32, shape (..., 3)
    ///     Red, green and blue, in sr⁻¹.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If an argument has a wrong type, shape or value; the message says which.
    fn eval(&self, wo: &Bound<'_, PyAny>, wi: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let py = wo.py();
        let inputs = Inputs::new([("wo", wo, true), ("wi", wi, true)], None)?;
        let (probe, choice, shape) = (Arc::clone(&self.probe), self.choice, inputs.shape.clone());
        let results = each(py, inputs.len(), move |i| {
            probe.eval(inputs.vectors[0][i], inputs.vectors[1][i], choice).to_array()
        })?;
        rows(py, results, &shape)
    }

    /// Density with which :meth:`sample` returns `wi`, without Dirac deltas.
    ///
    /// Parameters
    /// ----------
    /// wo, wi : array_like of float, shape (..., 3)
    ///     As for :meth:`eval`.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of float32, shape (...)
    ///     Density over solid angle, in sr⁻¹.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As :meth:`eval`.
    fn pdf(&self, wo: &Bound<'_, PyAny>, wi: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let py = wo.py();
        let inputs = Inputs::new([("wo", wo, true), ("wi", wi, true)], None)?;
        let (probe, choice, shape) = (Arc::clone(&self.probe), self.choice, inputs.shape.clone());
        let results = each(py, inputs.len(), move |i| {
            probe.pdf(inputs.vectors[0][i], inputs.vectors[1][i], choice)
        })?;
        array(py, results, &shape, None)
    }

    /// Samples directions to the light.
    ///
    /// Parameters
    /// ----------
    /// wo : array_like of float, shape (..., 3)
    ///     Directions to the viewer.
    /// u : array_like of float, shape (..., 3)
    ///     Random numbers from 0 up to but not including 1.
    ///
    /// Returns
    /// -------
    /// wi : numpy.ndarray of float32, shape (..., 3)
    ///     Directions to the light; nan where light is absorbed.
    /// weight : numpy.ndarray of float32, shape (..., 3)
    ///     f(wo, wi) |cos θi| / pdf; 0 where light is absorbed.
    /// pdf : numpy.ndarray of float32, shape (...)
    ///     Densities; inf for Dirac deltas, 0 where light is absorbed.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As :meth:`eval`.
    fn sample(
        &self,
        wo: &Bound<'_, PyAny>,
        u: &Bound<'_, PyAny>,
    ) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
        let py = wo.py();
        let inputs = Inputs::new([("wo", wo, true)], Some(("u", u, 3)))?;
        let (probe, choice, shape) = (Arc::clone(&self.probe), self.choice, inputs.shape.clone());
        let results = each(py, inputs.len(), move |i| {
            match probe.sample(inputs.vectors[0][i], inputs.random(i), choice) {
                None => ([f32::NAN; 3], [0.0; 3], 0.0),
                Some(s) => {
                    let pdf = s.pdf.map_or(f32::INFINITY, pt_math::Pdf::get);
                    (s.wi.to_array(), s.weight.to_array(), pdf)
                }
            }
        })?;
        let (wi, (weight, pdf)): (Vec<_>, (Vec<_>, Vec<_>)) =
            results.into_iter().map(|(wi, weight, pdf)| (wi, (weight, pdf))).unzip();
        Ok((rows(py, wi, &shape)?, rows(py, weight, &shape)?, array(py, pdf, &shape, None)?))
    }
}

/// A light of a scene, as :func:`lights` returns it. Emissive meshes and spheres are lights. Where
/// there are many lights without extent, or many emissive surfaces, a tree of them is one light.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Light {
    probe: Arc<LightProbe>,
    index: usize,
    /// str: Kind of the light, such as "Point", "Mesh" or "Environment".
    #[pyo3(get)]
    kind: &'static str,
}

/// Receiver of light at a point, on a surface if there is a normal.
fn receiver(p: Vec3, normal: Option<Vec3>) -> LightSampleContext {
    match normal {
        None => LightSampleContext::in_space(p),
        Some(normal) => LightSampleContext::on_surface(p, normal, false),
    }
}

#[pymethods]
impl Light {
    /// Samples the light that arrives at points. Occlusion is not tested.
    ///
    /// Parameters
    /// ----------
    /// position : array_like of float, shape (..., 3)
    ///     Points in metres.
    /// u : array_like of float, shape (..., 2)
    ///     Random numbers from 0 up to but not including 1.
    /// normal : array_like of float, shape (..., 3), optional
    ///     Normals of opaque surfaces on which the points are; without them, light from all sides
    ///     counts.
    ///
    /// Returns
    /// -------
    /// wi : numpy.ndarray of float32, shape (..., 3)
    ///     Directions to the light; nan where no light arrives.
    /// distance : numpy.ndarray of float32, shape (...)
    ///     Distances to the light in metres; inf for lights at infinity.
    /// radiance : numpy.ndarray of float32, shape (..., 3)
    ///     Radiance; for lights without extent the irradiance on a surface that faces the light.
    /// pdf : numpy.ndarray of float32, shape (...)
    ///     Densities over solid angle; inf for lights without extent, 0 where no light arrives.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If an argument has a wrong type, shape or value; the message says which.
    #[pyo3(signature = (position, u, normal = None))]
    #[expect(clippy::type_complexity, reason = "a tuple of arrays")]
    fn sample(
        &self,
        position: &Bound<'_, PyAny>,
        u: &Bound<'_, PyAny>,
        normal: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<(Py<PyAny>, Py<PyAny>, Py<PyAny>, Py<PyAny>)> {
        let py = position.py();
        let random = Some(("u", u, 2));
        let inputs = match normal {
            None => Inputs::new([("position", position, false)], random)?,
            Some(normal) => {
                Inputs::new([("position", position, false), ("normal", normal, true)], random)?
            }
        };
        let (probe, index, shape) = (Arc::clone(&self.probe), self.index, inputs.shape.clone());
        let results = each(py, inputs.len(), move |i| {
            let at = receiver(inputs.vectors[0][i], inputs.vectors.get(1).map(|n| n[i]));
            match probe.sample(index, &at, inputs.random(i)) {
                None => ([f32::NAN; 3], f32::NAN, [0.0; 3], 0.0),
                Some(s) => {
                    let pdf = s.pdf.map_or(f32::INFINITY, pt_math::Pdf::get);
                    (s.wi.to_array(), s.distance, s.radiance.to_array(), pdf)
                }
            }
        })?;
        let mut columns = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (wi, distance, radiance, pdf) in results {
            columns.0.push(wi);
            columns.1.push(distance);
            columns.2.push(radiance);
            columns.3.push(pdf);
        }
        Ok((
            rows(py, columns.0, &shape)?,
            array(py, columns.1, &shape, None)?,
            rows(py, columns.2, &shape)?,
            array(py, columns.3, &shape, None)?,
        ))
    }

    /// Density with which :meth:`sample` returns `wi`; 0 where another surface is nearer.
    ///
    /// Parameters
    /// ----------
    /// position, wi : array_like of float, shape (..., 3)
    ///     Points in metres, and directions to the light.
    /// normal : array_like of float, shape (..., 3), optional
    ///     As for :meth:`sample`.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of float32, shape (...)
    ///     Density over solid angle, in sr⁻¹; 0 for lights without extent.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As :meth:`sample`.
    #[pyo3(signature = (position, wi, normal = None))]
    fn pdf(
        &self,
        position: &Bound<'_, PyAny>,
        wi: &Bound<'_, PyAny>,
        normal: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let py = position.py();
        let both = [("position", position, false), ("wi", wi, true)];
        let inputs = match normal {
            None => Inputs::new(both, None)?,
            Some(normal) => Inputs::new([both[0], both[1], ("normal", normal, true)], None)?,
        };
        let (probe, index, shape) = (Arc::clone(&self.probe), self.index, inputs.shape.clone());
        let results = each(py, inputs.len(), move |i| {
            let at = receiver(inputs.vectors[0][i], inputs.vectors.get(2).map(|n| n[i]));
            probe.pdf(index, &at, inputs.vectors[1][i])
        })?;
        array(py, results, &shape, None)
    }

    fn __repr__(&self) -> String {
        format!("<Light {}: {}>", self.index, self.kind)
    }
}

/// Lights of a scene, in the order in which renders sample them.
///
/// Parameters
/// ----------
/// scene : Scene
///     The scene.
///
/// Returns
/// -------
/// list of Light
///
/// Raises
/// ------
/// SceneError
///     If the scene is invalid.
#[pyfunction]
pub(crate) fn lights(py: Python<'_>, scene: &Scene) -> PyResult<Vec<Light>> {
    let scene = Arc::clone(&scene.source.scene);
    let probe = py.detach(|| LightProbe::new(&scene)).map_err(|error| invalid(py, &error))?;
    let probe = Arc::new(probe);
    let kinds = probe.kinds().into_iter().enumerate();
    Ok(kinds.map(|(index, kind)| Light { probe: Arc::clone(&probe), index, kind }).collect())
}

/// Scattering of a medium. Directions point away from the point of scattering, to the viewer (`wo`)
/// and to the light (`wi`): light goes straight on if `wi` is −`wo`.
///
/// Parameters
/// ----------
/// phase : Phase
///     A phase function of :mod:`pathtracer.build`, its name, or a dictionary of a scene file.
///     Microflakes are those at the centre of the unit cube.
/// **parts
///     Other parts of a scene to which it refers by name, as for :class:`Scene`.
///
/// Raises
/// ------
/// SceneError
///     If the phase function is invalid.
/// TypeError, ValueError
///     If an argument has a wrong type or value; the message says which.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct PhaseFunction {
    phase: Arc<AnyPhase>,
}

#[pymethods]
impl PhaseFunction {
    #[new]
    #[pyo3(signature = (phase, **parts))]
    fn new(phase: &Bound<'_, PyAny>, parts: Option<&Bound<'_, PyDict>>) -> PyResult<Self> {
        let py = phase.py();
        let scene = of_part(py, "of_phase", phase, parts)?;
        let phase = py.detach(|| phase_function(&scene.source.scene, Vec3::splat(0.5)));
        let phase = phase.map_err(|error| invalid(py, &error))?;
        let phase = phase.ok_or_else(|| PyValueError::new_err("phase: found no medium"))?;
        Ok(Self { phase: Arc::new(phase) })
    }

    /// Phase function, which is the density with which :meth:`sample` returns `wi`.
    ///
    /// Parameters
    /// ----------
    /// wo, wi : array_like of float, shape (..., 3)
    ///     Directions to the viewer and to the light; they are broadcast together.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of float32, shape (...)
    ///     Values in sr⁻¹, which integrate to 1.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If an argument has a wrong type, shape or value; the message says which.
    fn eval(&self, wo: &Bound<'_, PyAny>, wi: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let py = wo.py();
        let inputs = Inputs::new([("wo", wo, true), ("wi", wi, true)], None)?;
        let (phase, shape) = (Arc::clone(&self.phase), inputs.shape.clone());
        let results = each(py, inputs.len(), move |i| {
            phase.pdf(inputs.vectors[0][i], inputs.vectors[1][i]).get()
        })?;
        array(py, results, &shape, None)
    }

    /// The same as :meth:`eval`.
    ///
    /// Parameters
    /// ----------
    /// wo, wi : array_like of float, shape (..., 3)
    ///     As for :meth:`eval`.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of float32, shape (...)
    ///     Density over solid angle, in sr⁻¹.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As :meth:`eval`.
    fn pdf(&self, wo: &Bound<'_, PyAny>, wi: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        self.eval(wo, wi)
    }

    /// Samples directions to the light.
    ///
    /// Parameters
    /// ----------
    /// wo : array_like of float, shape (..., 3)
    ///     Directions to the viewer.
    /// u : array_like of float, shape (..., 2)
    ///     Random numbers from 0 up to but not including 1.
    ///
    /// Returns
    /// -------
    /// wi : numpy.ndarray of float32, shape (..., 3)
    ///     Directions to the light.
    /// pdf : numpy.ndarray of float32, shape (...)
    ///     Densities over solid angle.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As :meth:`eval`.
    fn sample(
        &self,
        wo: &Bound<'_, PyAny>,
        u: &Bound<'_, PyAny>,
    ) -> PyResult<(Py<PyAny>, Py<PyAny>)> {
        let py = wo.py();
        let inputs = Inputs::new([("wo", wo, true)], Some(("u", u, 2)))?;
        let (phase, shape) = (Arc::clone(&self.phase), inputs.shape.clone());
        let results = each(py, inputs.len(), move |i| {
            let wo = inputs.vectors[0][i];
            let wi = phase.sample(wo, inputs.random(i));
            (wi.to_array(), phase.pdf(wo, wi).get())
        })?;
        let (wi, pdf): (Vec<_>, Vec<_>) = results.into_iter().unzip();
        Ok((rows(py, wi, &shape)?, array(py, pdf, &shape, None)?))
    }
}
