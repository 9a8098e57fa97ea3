//! Ray queries on triangle meshes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods};
use pathtracer::{BuildOptions, Quality};
use pt_bvh::Geometry;
use pt_math::{Ray, Vec3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::Numbers;
use crate::worker::{self, End};

/// Number of rays that a thread takes at a time: full batches, and Ctrl-C in milliseconds.
const CHUNK: usize = 4096;

/// A triangle mesh that is prepared for ray queries.
///
/// Parameters
/// ----------
/// vertices : array_like of float, shape (n, 3)
///     Positions; they are rounded to float32.
/// faces : array_like of int, shape (m, 3)
///     Indices of the vertices of each triangle.
/// quality : str, optional
///     Effort of the build: "fast", "balanced" or "high".
///
/// Raises
/// ------
/// TypeError, ValueError
///     If an argument has a wrong type, shape or value; the message says which.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Bvh {
    mesh: Arc<Mesh>,
}

struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    bvh: pt_bvh::Bvh,
}

/// Nearest hits of rays. The arrays have the shape of the rays, and one more dimension for vectors.
#[pyclass(frozen, get_all, module = "pathtracer")]
pub(crate) struct Hits {
    /// numpy.ndarray of float32: Distances in units of the lengths of the directions; inf for rays
    /// that hit nothing.
    t: Py<PyAny>,
    /// numpy.ndarray of int32: Indices of the triangles; -1 for rays that hit nothing.
    primitive: Py<PyAny>,
    /// numpy.ndarray of float32, shape (..., 2): Weights of the second and the third vertex.
    uv: Py<PyAny>,
    /// numpy.ndarray of float32, shape (..., 3): Points on the triangles; nan for rays that hit
    /// nothing.
    position: Py<PyAny>,
    /// numpy.ndarray of float32, shape (..., 3): Unit normals by the order of the vertices; nan for
    /// rays that hit nothing.
    normal: Py<PyAny>,
}

/// Nearest hits of rays, column by column.
struct Columns {
    t: Vec<f32>,
    primitive: Vec<i32>,
    uv: Vec<[f32; 2]>,
    position: Vec<[f32; 3]>,
    normal: Vec<[f32; 3]>,
}

impl Columns {
    /// Columns of rays that hit nothing.
    fn of_misses(rays: usize) -> Self {
        Self {
            t: vec![f32::INFINITY; rays],
            primitive: vec![-1; rays],
            uv: vec![[0.0; 2]; rays],
            position: vec![[f32::NAN; 3]; rays],
            normal: vec![[f32::NAN; 3]; rays],
        }
    }

    /// Intersects all rays, unless it is stopped before.
    fn of(mesh: &Mesh, rays: &RayArrays, stopped: &AtomicBool) -> Self {
        let mut columns = Self::of_misses(rays.len());
        let Self { t, primitive, uv, position, normal } = &mut columns;
        let chunks = t.par_chunks_mut(CHUNK).zip(primitive.par_chunks_mut(CHUNK));
        let chunks = chunks.zip(uv.par_chunks_mut(CHUNK)).zip(position.par_chunks_mut(CHUNK));
        let chunks = chunks.zip(normal.par_chunks_mut(CHUNK)).enumerate();
        chunks.for_each_init(
            Vec::new,
            |hits, (chunk, ((((t, primitive), uv), position), normal))| {
                if stopped.load(Ordering::Relaxed) {
                    return;
                }
                mesh.bvh.intersect_batch(&rays.chunk(chunk * CHUNK), hits);
                for (i, hit) in hits.iter().enumerate() {
                    if let Some(hit) = hit {
                        (t[i], primitive[i], uv[i]) =
                            (hit.t, hit.primitive as i32, [hit.b1, hit.b2]);
                        [position[i], normal[i]] = mesh.point(hit);
                    }
                }
            },
        );
        columns
    }
}

impl Mesh {
    /// Position and unit normal of a hit.
    fn point(&self, hit: &pt_bvh::Hit) -> [[f32; 3]; 2] {
        let corners = self.triangles[hit.primitive as usize];
        let [p0, p1, p2] = corners.map(|vertex| self.positions[vertex as usize]);
        let position = p0 * (1.0 - hit.b1 - hit.b2) + p1 * hit.b1 + p2 * hit.b2;
        // In double precision: thin triangles have a normal, too.
        let [e1, e2] = [p1, p2].map(|p| p.as_dvec3() - p0.as_dvec3());
        [position, e1.cross(e2).normalize().as_vec3()].map(|v| v.to_array())
    }
}

/// Rays as Python gives them.
struct RayArrays {
    /// Shape without the dimension of vectors.
    shape: Vec<usize>,
    origins: Vec<f32>,
    directions: Vec<f32>,
    /// Ends of the rays, or one for all.
    ends: Vec<f32>,
}

impl RayArrays {
    fn new(
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmax: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let is_vectors = |shape: &[usize]| shape.last() == Some(&3);
        let origins = Numbers::real("origins", origins)?;
        let directions = Numbers::real("directions", directions)?;
        for vectors in [&origins, &directions] {
            vectors.expect(is_vectors, "(..., 3)")?;
        }
        let (of_origins, of_directions) = (origins.shape()?, directions.shape()?);
        // One origin with many directions, or the other way round.
        let shape = if of_origins.len() > of_directions.len() { of_origins } else { of_directions };
        let origins = origins.broadcast(&shape)?.singles(f32::is_finite, "a finite number")?;
        let directions = directions.broadcast(&shape)?;
        let directions = directions.singles(f32::is_finite, "a finite number")?;
        let zero = directions.as_chunks::<3>().0.iter().position(|d| *d == [0.0; 3]);
        if let Some(ray) = zero {
            let message = format!("directions: that of ray {ray} is zero, expected any other");
            return Err(PyValueError::new_err(message));
        }
        let shape = shape[..shape.len() - 1].to_vec();
        let ends = match tmax {
            None => vec![f32::INFINITY],
            Some(tmax) => {
                let tmax = Numbers::real("tmax", tmax)?.broadcast(&shape)?;
                tmax.singles(|end| !end.is_nan(), "a number")?
            }
        };
        Ok(Self { shape, origins, directions, ends })
    }

    fn len(&self) -> usize {
        self.origins.len() / 3
    }

    /// Rays from one number on.
    fn chunk(&self, first: usize) -> Vec<Ray> {
        let vectors = |values: &[f32]| -> Vec<Vec3> {
            let all = values.as_chunks::<3>().0;
            let end = all.len().min(first + CHUNK);
            all[first..end].iter().map(|&v| Vec3::from_array(v)).collect()
        };
        let end = |ray: usize| self.ends.get(ray).or(self.ends.first()).copied();
        let rays = vectors(&self.origins).into_iter().zip(vectors(&self.directions));
        rays.zip(first..)
            .map(|((origin, direction), ray)| Ray {
                t_max: end(ray).unwrap_or(f32::INFINITY),
                ..Ray::new(origin, direction)
            })
            .collect()
    }
}

#[pymethods]
impl Bvh {
    #[new]
    #[pyo3(signature = (vertices, faces, *, quality = "balanced"))]
    fn new(
        py: Python<'_>,
        vertices: &Bound<'_, PyAny>,
        faces: &Bound<'_, PyAny>,
        quality: &str,
    ) -> PyResult<Self> {
        let rows_of_three = |shape: &[usize]| matches!(shape, [_, 3]);
        let vertices = Numbers::real("vertices", vertices)?;
        vertices.expect(rows_of_three, "(n, 3)")?;
        let vertices = vertices.singles(f32::is_finite, "a finite number")?;
        let faces = Numbers::whole("faces", faces)?;
        faces.expect(rows_of_three, "(m, 3)")?;
        let faces = faces.integers()?;
        let count = vertices.len() / 3;
        if let Some(at) =
            faces.iter().position(|&v| usize::try_from(v).is_ok_and(|v| v >= count) || v < 0)
        {
            return Err(PyValueError::new_err(format!(
                "faces: row {} refers to vertex {}, but there are {count}",
                at / 3,
                faces[at]
            )));
        }
        let quality = match quality {
            "fast" => Quality::Fast,
            "balanced" => Quality::Balanced,
            "high" => Quality::High,
            _ => {
                return Err(PyValueError::new_err(format!(
                    "quality: found {quality:?}, expected fast, balanced or high"
                )));
            }
        };
        let options = BuildOptions { quality, ..BuildOptions::default() };
        let work = move || {
            let positions: Vec<_> =
                vertices.as_chunks().0.iter().map(|&p| Vec3::from_array(p)).collect();
            let triangle = |face: &[i64; 3]| face.map(|vertex| vertex as u32);
            let triangles: Vec<_> = faces.as_chunks().0.iter().map(triangle).collect();
            let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
            let bvh = pt_bvh::Bvh::build(geometry, &options)?;
            Ok(Mesh { positions, triangles, bvh })
        };
        // A build cannot be stopped; it ends on its own.
        match worker::run(py, work, |_| Ok(()), || (), || Duration::ZERO)? {
            End::Done(Ok(mesh)) => Ok(Self { mesh: Arc::new(mesh) }),
            End::Done(Err(error)) => {
                let error: pt_bvh::BuildError = error;
                Err(PyValueError::new_err(format!("faces: {error}")))
            }
            End::Stopped(error, _) => Err(error),
        }
    }

    /// Finds the nearest hit of each ray, on all processors.
    ///
    /// Parameters
    /// ----------
    /// origins, directions : array_like of float, shape (..., 3)
    ///     Rays, in any number of dimensions; one origin serves many directions, and the other way
    ///     round. Directions may have any length but zero.
    /// tmax : array_like of float, optional
    ///     Ends of the rays, in units of the lengths of their directions: one for all, or one for
    ///     each.
    ///
    /// Returns
    /// -------
    /// Hits
    ///     Of several hits at the same distance, the one of the first triangle.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     If an argument has a wrong type, shape or value; the message says which.
    #[pyo3(signature = (origins, directions, tmax = None))]
    fn intersect(
        &self,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmax: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Hits> {
        let py = origins.py();
        let rays = RayArrays::new(origins, directions, tmax)?;
        let shape = rays.shape.clone();
        let mesh = Arc::clone(&self.mesh);
        let columns = stoppable(py, move |stopped| Columns::of(&mesh, &rays, stopped))?;
        let Columns { t, primitive, uv, position, normal } = columns;
        Ok(Hits {
            t: array(py, t, &shape, None)?,
            primitive: array(py, primitive, &shape, None)?,
            uv: array(py, uv.into_flattened(), &shape, Some(2))?,
            position: array(py, position.into_flattened(), &shape, Some(3))?,
            normal: array(py, normal.into_flattened(), &shape, Some(3))?,
        })
    }

    /// Tests whether each ray hits anything, on all processors.
    ///
    /// Parameters
    /// ----------
    /// origins, directions, tmax
    ///     As for :meth:`intersect`.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of bool
    ///     True for rays that hit a triangle; of the shape of the rays.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
    ///     As :meth:`intersect`.
    #[pyo3(signature = (origins, directions, tmax = None))]
    fn occluded(
        &self,
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        tmax: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Py<PyAny>> {
        let py = origins.py();
        let rays = RayArrays::new(origins, directions, tmax)?;
        let shape = rays.shape.clone();
        let mesh = Arc::clone(&self.mesh);
        let occluded = stoppable(py, move |stopped| {
            let mut occluded = vec![false; rays.len()];
            let chunks = occluded.par_chunks_mut(CHUNK).enumerate();
            chunks.for_each_init(Vec::new, |results, (chunk, occluded)| {
                if !stopped.load(Ordering::Relaxed) {
                    mesh.bvh.occluded_batch(&rays.chunk(chunk * CHUNK), results);
                    occluded.copy_from_slice(results);
                }
            });
            occluded
        })?;
        array(py, occluded, &shape, None)
    }

    /// tuple of two lists of float: Corners of the box around all triangles; None without any.
    #[getter]
    fn bounds(&self) -> Option<([f32; 3], [f32; 3])> {
        let bounds = self.mesh.bvh.bounds();
        (!bounds.is_empty()).then(|| (bounds.min.to_array(), bounds.max.to_array()))
    }

    /// int: Number of triangles that no ray can hit, as those without area.
    #[getter]
    fn skipped(&self) -> u32 {
        self.mesh.bvh.skipped()
    }

    /// int: Bytes of memory, with the mesh.
    #[getter]
    fn nbytes(&self) -> usize {
        let Mesh { positions, triangles, bvh } = &*self.mesh;
        bvh.statistics().bytes + size_of_val(&positions[..]) + size_of_val(&triangles[..])
    }

    fn __len__(&self) -> usize {
        self.mesh.triangles.len()
    }

    fn __repr__(&self) -> String {
        let Mesh { positions, triangles, .. } = &*self.mesh;
        format!("<Bvh: {} triangles, {} vertices>", triangles.len(), positions.len())
    }
}

/// Runs queries that end soon after the flag is set.
fn stoppable<T: Send + 'static>(
    py: Python<'_>,
    queries: impl FnOnce(&AtomicBool) -> T + Send + 'static,
) -> PyResult<T> {
    let stopped = Arc::new(AtomicBool::new(false));
    let of_worker = Arc::clone(&stopped);
    let stop = || stopped.store(true, Ordering::Relaxed);
    match worker::run(py, move || queries(&of_worker), |_| Ok(()), stop, || Duration::ZERO)? {
        End::Done(results) => Ok(results),
        End::Stopped(error, _) => Err(error),
    }
}

/// Array of this shape, with one more dimension for vectors; the values are not copied.
fn array<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: &[usize],
    lanes: Option<usize>,
) -> PyResult<Py<PyAny>> {
    let shape: Vec<usize> = shape.iter().copied().chain(lanes).collect();
    let array: Bound<'_, PyArray1<T>> = values.into_pyarray(py);
    Ok(array.reshape(shape)?.into_any().unbind())
}
