//! Ray queries over arrays, on all processors.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods};
use pt_bvh::coherent_order;
use pt_math::{Bounds3, Ray, Vec3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::arrays::{Floats, Numbers, first_of};
use crate::worker::{self, End};

/// Number of rays of a query: full batches, and Ctrl-C in milliseconds.
const BATCH: usize = 4096;

/// Shapes that rays hit.
pub(crate) trait Target: Send + Sync + 'static {
    /// Box around all shapes.
    fn bounds(&self) -> Bounds3;

    /// Appends the nearest hit of each ray, in order; [`Found::NOTHING`] for rays without any.
    fn nearest(&self, rays: &[Ray], found: &mut Vec<Found>);

    /// Replaces the contents of `occluded` by true for each ray that hits anything, in order.
    fn occluded(&self, rays: &[Ray], occluded: &mut Vec<bool>);
}

/// Nearest hit of a ray, as [`Hits`] has it; one line of the caches.
#[repr(align(64))]
pub(crate) struct Found {
    pub(crate) t: f32,
    pub(crate) shape: i32,
    pub(crate) primitive: i32,
    pub(crate) uv: [f32; 2],
    pub(crate) position: Vec3,
    pub(crate) normal: Vec3,
}

impl Found {
    /// Of a ray that hits nothing.
    pub(crate) const NOTHING: Self = Self {
        t: f32::INFINITY,
        shape: -1,
        primitive: -1,
        uv: [0.0; 2],
        position: Vec3::NAN,
        normal: Vec3::NAN,
    };
}

/// Nearest hits of rays. The arrays have the shape of the rays, and one more dimension for vectors.
#[pyclass(frozen, get_all, module = "pathtracer")]
pub(crate) struct Hits {
    /// numpy.ndarray of float32: Distances in units of the lengths of the directions; inf for rays
    /// that hit nothing.
    t: Py<PyAny>,
    /// numpy.ndarray of int32: Indices of the objects of the scene, 0 in a :class:`Bvh`; -1 for
    /// rays that hit nothing.
    shape: Py<PyAny>,
    /// numpy.ndarray of int32: Indices among the triangles or spheres of the object; -1 for rays
    /// that hit nothing.
    primitive: Py<PyAny>,
    /// numpy.ndarray of float32, shape (..., 2): Texture coordinates; in a :class:`Bvh`, the
    /// weights of the second and the third vertex. 0 for rays that hit nothing.
    uv: Py<PyAny>,
    /// numpy.ndarray of float32, shape (..., 3): Points on the surfaces; nan for rays that hit
    /// nothing.
    position: Py<PyAny>,
    /// numpy.ndarray of float32, shape (..., 3): Unit geometric normals, by the order of the
    /// vertices; nan for rays that hit nothing.
    normal: Py<PyAny>,
}

/// Nearest hits of rays, column by column.
struct Columns {
    t: Vec<f32>,
    shape: Vec<i32>,
    primitive: Vec<i32>,
    uv: Vec<[f32; 2]>,
    position: Vec<[f32; 3]>,
    normal: Vec<[f32; 3]>,
}

impl Columns {
    fn zeros(rays: usize) -> Self {
        Self {
            t: vec![0.0; rays],
            shape: vec![0; rays],
            primitive: vec![0; rays],
            uv: vec![[0.0; 2]; rays],
            position: vec![[0.0; 3]; rays],
            normal: vec![[0.0; 3]; rays],
        }
    }

    /// Intersects all rays, unless it is stopped before.
    fn of(target: &impl Target, rays: &RayArrays, stopped: &AtomicBool) -> Self {
        let mut columns = Self::zeros(rays.rays.len());
        let Self { t, shape, primitive, uv, position, normal } = &mut columns;
        let size = rays.window();
        let windows = t.par_chunks_mut(size).zip(shape.par_chunks_mut(size));
        let windows = windows.zip(primitive.par_chunks_mut(size)).zip(uv.par_chunks_mut(size));
        let windows = windows.zip(position.par_chunks_mut(size)).zip(normal.par_chunks_mut(size));
        windows.enumerate().for_each(
            |(window, (((((t, shape), primitive), uv), position), normal))| {
                let mut found = Vec::with_capacity(t.len());
                let rays = &rays.rays[window * size..][..t.len()];
                let places = in_batches(target, rays, stopped, |rays| {
                    target.nearest(rays, &mut found);
                });
                if found.len() < rays.len() {
                    return;
                }
                for (ray, place) in places.into_iter().enumerate() {
                    let hit = &found[place as usize];
                    (t[ray], shape[ray], primitive[ray]) = (hit.t, hit.shape, hit.primitive);
                    uv[ray] = hit.uv;
                    position[ray] = hit.position.to_array();
                    normal[ray] = hit.normal.to_array();
                }
            },
        );
        columns
    }
}

/// Calls `trace` with batches of the rays in a coherent order, until it is stopped. Returns the
/// place of each ray in that order.
fn in_batches(
    target: &impl Target,
    rays: &[Ray],
    stopped: &AtomicBool,
    mut trace: impl FnMut(&[Ray]),
) -> Vec<u32> {
    let order = coherent_order(rays, &target.bounds());
    let mut batch = Vec::with_capacity(BATCH);
    for rays_of_batch in order.chunks(BATCH) {
        if stopped.load(Ordering::Relaxed) {
            break;
        }
        batch.clear();
        batch.extend(rays_of_batch.iter().map(|&ray| rays[ray as usize]));
        trace(&batch);
    }
    let mut places = vec![0; order.len()];
    for (place, ray) in (0..).zip(order) {
        places[ray as usize] = place;
    }
    places
}

/// Nearest hits of rays.
pub(crate) fn intersect<T: Target>(
    py: Python<'_>,
    target: &Arc<T>,
    rays: RayArrays,
) -> PyResult<Hits> {
    let shape_of_rays = rays.shape.clone();
    let target = Arc::clone(target);
    let columns = stoppable(py, move |stopped| Columns::of(&*target, &rays, stopped))?;
    let Columns { t, shape, primitive, uv, position, normal } = columns;
    let of_rays = &shape_of_rays;
    Ok(Hits {
        t: array(py, t, of_rays, None)?,
        shape: array(py, shape, of_rays, None)?,
        primitive: array(py, primitive, of_rays, None)?,
        uv: array(py, uv.into_flattened(), of_rays, Some(2))?,
        position: array(py, position.into_flattened(), of_rays, Some(3))?,
        normal: array(py, normal.into_flattened(), of_rays, Some(3))?,
    })
}

/// Array with true for each ray that hits anything.
pub(crate) fn occluded<T: Target>(
    py: Python<'_>,
    target: &Arc<T>,
    rays: RayArrays,
) -> PyResult<Py<PyAny>> {
    let shape = rays.shape.clone();
    let target = Arc::clone(target);
    let occluded = stoppable(py, move |stopped| {
        let mut occluded = vec![false; rays.rays.len()];
        let size = rays.window();
        occluded.par_chunks_mut(size).enumerate().for_each(|(window, occluded)| {
            let (mut found, mut of_batch) = (Vec::with_capacity(occluded.len()), Vec::new());
            let rays = &rays.rays[window * size..][..occluded.len()];
            let places = in_batches(&*target, rays, stopped, |rays| {
                target.occluded(rays, &mut of_batch);
                found.extend_from_slice(&of_batch);
            });
            if found.len() == rays.len() {
                for (is_occluded, place) in occluded.iter_mut().zip(places) {
                    *is_occluded = found[place as usize];
                }
            }
        });
        occluded
    })?;
    array(py, occluded, &shape, None)
}

/// Rays as Python gives them.
pub(crate) struct RayArrays {
    /// Shape without the dimension of vectors.
    shape: Vec<usize>,
    rays: Vec<Ray>,
}

impl RayArrays {
    pub(crate) fn new(
        origins: &Bound<'_, PyAny>,
        directions: &Bound<'_, PyAny>,
        [tmin, tmax]: [Option<&Bound<'_, PyAny>>; 2],
    ) -> PyResult<Self> {
        let is_vectors = |shape: &[usize]| shape.last() == Some(&3);
        let origins = Numbers::real("origins", origins)?;
        let directions = Numbers::real("directions", directions)?;
        for vectors in [&origins, &directions] {
            vectors.expect(is_vectors, "(..., 3)")?;
        }
        let shape = origins.common_shape(&directions)?;
        let vectors = [origins.broadcast(&shape)?, directions.broadcast(&shape)?];
        let shape = shape[..shape.len() - 1].to_vec();
        let starts = bound("tmin", tmin, 0.0, &shape)?;
        let ends = bound("tmax", tmax, f32::INFINITY, &shape)?;
        let bounds = [&starts[..], &ends];
        let [origins, directions] = vectors.each_ref().map(Numbers::floats);
        let rays = match (origins?, directions?) {
            (Floats::Single(o), Floats::Single(d)) => rays(o.as_slice()?, d.as_slice()?, bounds),
            (Floats::Single(o), Floats::Double(d)) => rays(o.as_slice()?, d.as_slice()?, bounds),
            (Floats::Double(o), Floats::Single(d)) => rays(o.as_slice()?, d.as_slice()?, bounds),
            (Floats::Double(o), Floats::Double(d)) => rays(o.as_slice()?, d.as_slice()?, bounds),
        };
        let is_zero = |ray: &Ray| ray.direction == Vec3::ZERO;
        let is_wrong =
            |ray: &Ray| !ray.origin.is_finite() || !ray.direction.is_finite() || is_zero(ray);
        if let Some(first) = first_of(&rays, is_wrong) {
            for numbers in vectors {
                numbers.singles(f32::is_finite, "a finite number")?;
            }
            let ray = rays[first..].iter().position(is_zero).map_or(first, |more| first + more);
            let message = format!("directions: that of ray {ray} is zero, expected any other");
            return Err(PyValueError::new_err(message));
        }
        Ok(Self { shape, rays })
    }

    /// Number of rays that a thread takes at a time. Many are more coherent in order, and two for
    /// each thread keep all of them busy.
    fn window(&self) -> usize {
        let parts = 2 * rayon::current_num_threads();
        self.rays.len().div_ceil(parts).clamp(4 * BATCH, 64 * BATCH)
    }
}

/// Rays with these origins and directions, and with these starts and ends, one for all or one for
/// each.
fn rays<A, B>(origins: &[A], directions: &[B], bounds: [&[f32]; 2]) -> Vec<Ray>
where
    A: Copy + Into<f64> + Sync,
    B: Copy + Into<f64> + Sync,
{
    let of = |values: &[f32], ray: usize| *values.get(ray).unwrap_or(&values[0]);
    let origins = origins.as_chunks::<3>().0.par_iter();
    let rays = origins.zip(directions.as_chunks::<3>().0).enumerate();
    rays.map(|(ray, (origin, direction))| Ray {
        origin: Vec3::from_array(origin.map(|x| x.into() as f32)),
        direction: Vec3::from_array(direction.map(|x| x.into() as f32)),
        t_min: of(bounds[0], ray),
        t_max: of(bounds[1], ray),
    })
    .collect()
}

/// Bounds of rays by an argument, one for all or one for each.
fn bound(
    name: &'static str,
    given: Option<&Bound<'_, PyAny>>,
    default: f32,
    shape: &[usize],
) -> PyResult<Vec<f32>> {
    let Some(given) = given else { return Ok(vec![default]) };
    let bounds = Numbers::real(name, given)?.broadcast(shape)?;
    bounds.singles(|bound| !bound.is_nan(), "a number")
}

/// Runs queries that end soon after the flag is set.
pub(crate) fn stoppable<T: Send + 'static>(
    py: Python<'_>,
    queries: impl FnOnce(&AtomicBool) -> T + Send + 'static,
) -> PyResult<T> {
    let stopped = Arc::new(AtomicBool::new(false));
    let of_worker = Arc::clone(&stopped);
    let stop = || {
        stopped.store(true, Ordering::Relaxed);
        Duration::ZERO
    };
    match worker::run(py, move || queries(&of_worker), |_| Ok(()), stop)? {
        End::Done(results) => Ok(results),
        End::Stopped(error, _) => Err(error),
    }
}

/// Array of this shape, with one more dimension for vectors; the values are not copied.
pub(crate) fn array<T: Element>(
    py: Python<'_>,
    values: Vec<T>,
    shape: &[usize],
    lanes: Option<usize>,
) -> PyResult<Py<PyAny>> {
    let shape: Vec<usize> = shape.iter().copied().chain(lanes).collect();
    let array: Bound<'_, PyArray1<T>> = values.into_pyarray(py);
    Ok(array.reshape(shape)?.into_any().unbind())
}
