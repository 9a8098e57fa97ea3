//! Ray queries on triangle meshes.

use std::sync::Arc;
use std::time::Duration;

use pathtracer::{BuildOptions, Quality};
use pt_bvh::Geometry;
use pt_math::{Bounds3, Ray, Vec3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::Numbers;
use crate::queries::{self, Found, Hits, RayArrays, Target};
use crate::worker::{self, End};

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

impl Target for Mesh {
    fn bounds(&self) -> Bounds3 {
        self.bvh.bounds()
    }

    fn nearest(&self, rays: &[Ray], found: &mut Vec<Found>) {
        let mut hits = Vec::new();
        self.bvh.intersect_batch(rays, &mut hits);
        found.extend(hits.iter().map(|hit| hit.as_ref().map_or(Found::NOTHING, |h| self.found(h))));
    }

    fn occluded(&self, rays: &[Ray], occluded: &mut Vec<bool>) {
        self.bvh.occluded_batch(rays, occluded);
    }
}

impl Mesh {
    fn found(&self, hit: &pt_bvh::Hit) -> Found {
        let corners = self.triangles[hit.primitive as usize];
        let [p0, p1, p2] = corners.map(|vertex| self.positions[vertex as usize]);
        // In double precision: thin triangles have a normal, too.
        let [e1, e2] = [p1, p2].map(|p| p.as_dvec3() - p0.as_dvec3());
        Found {
            t: hit.t,
            shape: 0,
            primitive: hit.primitive as i32,
            uv: [hit.b1, hit.b2],
            position: p0 * (1.0 - hit.b1 - hit.b2) + p1 * hit.b1 + p2 * hit.b2,
            normal: e1.cross(e2).normalize().as_vec3(),
        }
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
        let is_vertex = |v: i64| u32::try_from(v).is_ok_and(|v| (v as usize) < count);
        if let Some(at) = faces.iter().position(|&v| !is_vertex(v)) {
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
            let triangles = faces.as_chunks().0.iter().map(|face| face.map(|v| v as u32));
            let triangles: Vec<_> = triangles.collect();
            let geometry = Geometry { positions: &positions, triangles: &triangles, spheres: &[] };
            let bvh = pt_bvh::Bvh::build(geometry, &options)?;
            Ok(Mesh { positions, triangles, bvh })
        };
        // A build cannot be stopped; it ends on its own.
        match worker::run(py, work, |_| Ok(()), || Duration::ZERO)? {
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
    ///     Rays, in any number of dimensions; the two are broadcast together, so that one origin
    ///     serves many directions. Directions may have any length but zero.
    /// tmin, tmax : array_like of float, optional
    ///     Starts and ends of the rays, in units of the lengths of their directions: one for all,
    ///     or one for each. Hits are between them; by default, anywhere beyond the origin.
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
        queries::intersect(py, &self.mesh, rays)
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
    ///     True for rays that hit a triangle; of the shape of the rays.
    ///
    /// Raises
    /// ------
    /// TypeError, ValueError
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
        queries::occluded(py, &self.mesh, rays)
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
