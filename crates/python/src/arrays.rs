//! Arrays as arguments: their types, shapes and values are checked, and they are copied, so that no
//! other thread changes them during a computation.

use numpy::{Element, PyReadonlyArrayDyn};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use rayon::prelude::*;

use crate::errors::in_argument;

/// Array of numbers, of any type, shape and strides.
pub(crate) struct Numbers<'py> {
    name: &'static str,
    array: Bound<'py, PyAny>,
}

/// Real numbers in row order.
pub(crate) enum Floats<'py> {
    Single(PyReadonlyArrayDyn<'py, f32>),
    Double(PyReadonlyArrayDyn<'py, f64>),
}

impl<'py> Numbers<'py> {
    /// Converts a sequence, or an array of any library. `kinds` are the kinds of types of NumPy
    /// that are accepted, and `expected` describes them.
    fn new(
        name: &'static str,
        value: &Bound<'py, PyAny>,
        kinds: &str,
        expected: &str,
    ) -> PyResult<Self> {
        let numpy = value.py().import("numpy")?;
        let array = numpy.call_method1("asarray", (value,));
        let array = array.map_err(|error| in_argument(value, name, &error))?;
        let dtype = array.getattr("dtype")?;
        let kind: String = dtype.getattr("kind")?.extract()?;
        if !kinds.contains(&kind) {
            let message = format!("{name}: found an array of {dtype}, expected {expected}");
            return Err(PyTypeError::new_err(message));
        }
        Ok(Self { name, array })
    }

    /// Real numbers, of which integers are some.
    pub(crate) fn real(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        Self::new(name, value, "fiu", "real numbers")
    }

    /// Integers.
    pub(crate) fn whole(name: &'static str, value: &Bound<'py, PyAny>) -> PyResult<Self> {
        Self::new(name, value, "iu", "integers")
    }

    pub(crate) fn shape(&self) -> PyResult<Vec<usize>> {
        self.array.getattr("shape")?.extract()
    }

    /// Error if the shape is not as `expected`.
    pub(crate) fn expect(
        &self,
        is_right: impl Fn(&[usize]) -> bool,
        expected: &str,
    ) -> PyResult<()> {
        if is_right(&self.shape()?) {
            return Ok(());
        }
        let (name, shape) = (self.name, self.array.getattr("shape")?);
        Err(PyValueError::new_err(format!("{name}: found shape {shape}, expected {expected}")))
    }

    /// Shape of the arrays when they are broadcast together, by the rules of NumPy.
    pub(crate) fn common_shape(&self, other: &Self) -> PyResult<Vec<usize>> {
        let shapes = [&self.array, &other.array].map(|array| array.getattr("shape"));
        let [ours, theirs] = shapes;
        let (ours, theirs) = (ours?, theirs?);
        let numpy = self.array.py().import("numpy")?;
        let common = numpy.call_method1("broadcast_shapes", (&ours, &theirs));
        let common = common.map_err(|_| {
            let names = format!("{} and {}", self.name, other.name);
            let message = format!("{names}: shapes {ours} and {theirs} cannot be broadcast");
            PyValueError::new_err(message)
        })?;
        common.extract()
    }

    /// Repeats the array along new or single dimensions.
    pub(crate) fn broadcast(self, shape: &[usize]) -> PyResult<Self> {
        let py = self.array.py();
        let to = PyTuple::new(py, shape)?;
        let found = self.array.getattr("shape")?;
        let array = py.import("numpy")?.call_method1("broadcast_to", (&self.array, &to));
        let array = array.map_err(|_| {
            let name = self.name;
            PyValueError::new_err(format!("{name}: shape {found} cannot be broadcast to {to}"))
        })?;
        Ok(Self { array, ..self })
    }

    /// Copy of the values in row order.
    fn values<T: Element + Copy>(&self, dtype: &str) -> PyResult<Vec<T>> {
        let array: PyReadonlyArrayDyn<'_, T> = self.required(dtype)?.extract()?;
        Ok(array.as_slice()?.to_vec())
    }

    /// Array of this type in row order, which is the array itself if it has that form.
    fn required(&self, dtype: &str) -> PyResult<Bound<'py, PyAny>> {
        let numpy = self.array.py().import("numpy")?;
        numpy.call_method1("require", (&self.array, dtype, ["C_CONTIGUOUS", "ALIGNED"]))
    }

    /// The values in row order, without a copy for usual arrays.
    pub(crate) fn floats(&self) -> PyResult<Floats<'py>> {
        let flags = self.array.getattr("flags")?;
        let is_set = |name| flags.getattr(name)?.is_truthy();
        if is_set("c_contiguous")? && is_set("aligned")? {
            if let Ok(array) = self.array.extract() {
                return Ok(Floats::Double(array));
            }
            if let Ok(array) = self.array.extract() {
                return Ok(Floats::Single(array));
            }
        }
        Ok(Floats::Single(self.required("float32")?.extract()?))
    }

    /// Copy of the values in row order, rounded to single precision, by all processors.
    fn rounded(&self) -> PyResult<Vec<f32>> {
        Ok(match self.floats()? {
            Floats::Single(array) => array.as_slice()?.par_iter().copied().collect(),
            Floats::Double(array) => array.as_slice()?.par_iter().map(|&x| x as f32).collect(),
        })
    }

    /// Copy in single precision; the error names the first value that `is_right` rejects.
    pub(crate) fn singles(
        &self,
        is_right: impl Fn(f32) -> bool + Sync,
        expected: &str,
    ) -> PyResult<Vec<f32>> {
        let values = self.rounded()?;
        match first_of(&values, |value| !is_right(*value)) {
            None => Ok(values),
            Some(at) => {
                let (name, value) = (self.name, values[at]);
                Err(PyValueError::new_err(format!(
                    "{name}: found {value} in place {at} of the values, expected {expected}"
                )))
            }
        }
    }

    /// Copy as integers of 64 bits; larger ones become negative.
    pub(crate) fn integers(&self) -> PyResult<Vec<i64>> {
        self.values("int64")
    }
}

/// Position of the first value for which `is_wanted` is true; all processors search.
pub(crate) fn first_of<T: Sync>(
    values: &[T],
    is_wanted: impl Fn(&T) -> bool + Sync,
) -> Option<usize> {
    const CHUNK: usize = 1 << 14;
    let found = values.par_chunks(CHUNK).any(|chunk| chunk.iter().any(&is_wanted));
    found.then(|| values.iter().position(&is_wanted)).flatten()
}
