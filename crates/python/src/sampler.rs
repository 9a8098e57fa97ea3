//! Points of the samplers of renders.

use pathtracer::SamplerKind;
use pt_math::sampler::{Sampler as Numbers, SamplerConfig};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::queries::{array, stoppable};

/// Points for Monte Carlo integration, as renders use them for the samples of a pixel.
///
/// Parameters
/// ----------
/// kind : {"sobol", "zsobol", "stratified", "independent"}
///     Kind of points.
/// seed : int
///     Seed that distinguishes sets of the same kind.
///
/// Raises
/// ------
/// ValueError
///     If the kind is unknown.
#[pyclass(frozen, module = "pathtracer")]
pub(crate) struct Sampler {
    kind: SamplerKind,
    seed: u32,
}

#[pymethods]
impl Sampler {
    #[new]
    #[pyo3(signature = (kind = "sobol", *, seed = 0))]
    fn new(kind: &str, seed: u32) -> PyResult<Self> {
        let known = SamplerKind::NAMES.map(|(name, _)| name).join(", ");
        let kind = SamplerKind::from_name(kind).ok_or_else(|| {
            PyValueError::new_err(format!("kind: found {kind:?}, expected one of {known}"))
        })?;
        Ok(Self { kind, seed })
    }

    /// The first points of a pixel.
    ///
    /// Parameters
    /// ----------
    /// n : int
    ///     Number of points.
    /// dims : int
    ///     Number of dimensions. Each two are a point of the plane.
    /// pixel : tuple of two ints
    ///     Column and row of the pixel.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray of float32, shape (n, dims)
    ///     Numbers from 0 up to but not including 1. Points of the kinds "zsobol" and "stratified"
    ///     are arranged for n samples.
    ///
    /// Raises
    /// ------
    /// ValueError
    ///     If there is too little memory.
    #[pyo3(signature = (n, dims, *, pixel = (0, 0)))]
    fn points(&self, py: Python<'_>, n: u32, dims: u32, pixel: (u32, u32)) -> PyResult<Py<PyAny>> {
        let bytes = u64::from(n).saturating_mul(u64::from(dims)).saturating_mul(4);
        let _grant = pathtracer::memory::ask(bytes).map_err(PyValueError::new_err)?;
        let set = SamplerConfig { kind: self.kind, seed: self.seed, spp: n };
        let numbers = move |_: &_| {
            let mut all = Vec::with_capacity(n as usize * dims as usize);
            for sample in 0..n {
                let mut numbers = Numbers::new(set, [pixel.0, pixel.1], sample);
                for _ in 0..dims / 2 {
                    all.extend(numbers.next_2d());
                }
                if dims % 2 == 1 {
                    all.push(numbers.next_1d());
                }
            }
            all
        };
        array(py, stoppable(py, numbers)?, &[n as usize, dims as usize], None)
    }
}
