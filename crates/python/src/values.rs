//! Scenes as values of Python, with arrays in place of long lists.

use std::fmt::Write as _;

use numpy::{Element, PyReadonlyArrayDyn};
use pathtracer::{Attachment, Numbers, SceneValues};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{
    PyBool, PyBytes, PyDict, PyFloat, PyInt, PyList, PyMemoryView, PyString, PyTuple,
};

use crate::lent;
use crate::places::Places;

/// Maximum nesting, above that of scene files.
const MAX_DEPTH: usize = 128;
/// Maximum number of values of an array that becomes digits.
const MAX_INLINE: u64 = 64;

/// Converts the values of a scene; `places` has the names of its parts for error messages.
///
/// # Errors
/// TypeError or ValueError with the place of a value that has no counterpart in scene files.
pub(crate) fn of_python(scene: &Bound<'_, PyDict>, places: &Places) -> PyResult<SceneValues> {
    let mut writer = Writer { places, values: SceneValues::default(), place: String::new() };
    writer.value(scene.as_any(), 0)?;
    Ok(writer.values)
}

struct Writer<'p> {
    places: &'p Places,
    values: SceneValues,
    /// Place of the current value, such as `objects[2].mesh`.
    place: String,
}

impl Writer<'_> {
    fn error<E: pyo3::PyTypeInfo>(&self, message: &str) -> PyErr {
        PyErr::new::<E, _>(self.places.message(&self.place, message))
    }

    fn value(&mut self, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<()> {
        if depth > MAX_DEPTH {
            return Err(self.error::<PyValueError>("found values that are nested too deeply"));
        }
        let text = &mut self.values.text;
        if value.is_none() {
            text.push_str("null");
        } else if let Ok(truth) = value.cast::<PyBool>() {
            text.push_str(if truth.is_true() { "true" } else { "false" });
        } else if value.is_instance_of::<PyInt>() {
            self.integer(value)?;
        } else if value.is_instance_of::<PyFloat>() {
            self.real(value.extract()?)?;
        } else if let Ok(word) = value.cast::<PyString>() {
            let word = word.to_str().map_err(|error| {
                self.error::<PyValueError>(&format!("found a text that is not Unicode: {error}"))
            })?;
            quote(word, &mut self.values.text);
        } else if let Ok(dict) = value.cast::<PyDict>() {
            self.dictionary(dict, depth)?;
        } else if let Ok(list) = value.cast::<PyList>() {
            self.list(list.to_tuple(), depth)?;
        } else if let Ok(tuple) = value.cast::<PyTuple>() {
            self.list(tuple.clone(), depth)?;
        } else if let Ok(bytes) = value.cast::<PyBytes>() {
            self.values.attach(Attachment::Content(bytes.as_bytes().to_vec()));
        } else {
            self.other(value, depth)?;
        }
        Ok(())
    }

    fn integer(&mut self, value: &Bound<'_, PyAny>) -> PyResult<()> {
        // The digits of an integer are exact; an enum of integers has others.
        let number: i64 = value
            .extract()
            .map_err(|_| self.error::<PyValueError>("found an integer of more than 64 bits"))?;
        let _ = write!(self.values.text, "{number}");
        Ok(())
    }

    fn real(&mut self, number: f64) -> PyResult<()> {
        if !number.is_finite() {
            let message = format!("found {number}, expected a finite number");
            return Err(self.error::<PyValueError>(&message));
        }
        let _ = write!(self.values.text, "{number:?}");
        Ok(())
    }

    fn dictionary(&mut self, dict: &Bound<'_, PyDict>, depth: usize) -> PyResult<()> {
        self.values.text.push('{');
        // A copy: conversions of values may run any code.
        for (i, pair) in dict.items().iter().enumerate() {
            let (key, value): (Bound<'_, PyAny>, Bound<'_, PyAny>) = pair.extract()?;
            let Ok(key) = key.extract::<String>() else {
                let found = key.get_type().name()?;
                let message = format!("found a key of type {found}, expected str");
                return Err(self.error::<PyTypeError>(&message));
            };
            if i > 0 {
                self.values.text.push(',');
            }
            quote(&key, &mut self.values.text);
            self.values.text.push(':');
            let end = self.place.len();
            if !key.chars().all(|c| c.is_alphanumeric() || c == '_') {
                self.place.push('[');
                quote(&key, &mut self.place);
                self.place.push(']');
            } else if end > 0 {
                let _ = write!(self.place, ".{key}");
            } else {
                self.place.push_str(&key);
            }
            self.value(&value, depth + 1)?;
            self.place.truncate(end);
        }
        self.values.text.push('}');
        Ok(())
    }

    fn list(&mut self, items: Bound<'_, PyTuple>, depth: usize) -> PyResult<()> {
        self.values.text.push('[');
        for (i, item) in items.iter().enumerate() {
            if i > 0 {
                self.values.text.push(',');
            }
            let end = self.place.len();
            let _ = write!(self.place, "[{i}]");
            self.value(&item, depth + 1)?;
            self.place.truncate(end);
        }
        self.values.text.push(']');
        Ok(())
    }

    /// Writes an array of any library, or a path.
    fn other(&mut self, value: &Bound<'_, PyAny>, depth: usize) -> PyResult<()> {
        if let Ok(path) = value.call_method0("__fspath__") {
            return self.value(&path, depth + 1);
        }
        let numpy = value.py().import("numpy")?;
        let is_numpy = value.is_instance(&numpy.getattr("ndarray")?)?
            || value.is_instance(&numpy.getattr("generic")?)?;
        let array = if is_numpy || value.hasattr("__array_interface__")? {
            numpy.call_method1("asarray", (value,))
        } else if value.hasattr("__dlpack__")? {
            numpy.call_method1("from_dlpack", (value,))
        } else if let Ok(buffer) = PyMemoryView::from(value) {
            numpy.call_method1("asarray", (buffer,))
        } else if value.hasattr("__array__")? {
            numpy.call_method1("asarray", (value,))
        } else {
            let found = value.get_type().name()?;
            let message =
                format!("found a value of type {found}, expected values of JSON or arrays");
            return Err(self.error::<PyTypeError>(&message));
        };
        let array = array.map_err(|error| {
            let why = error.value(value.py());
            self.error::<PyTypeError>(&format!("the array cannot be read: {why}"))
        })?;
        self.array(&array, depth)
    }

    /// Writes an array of NumPy.
    fn array(&mut self, array: &Bound<'_, PyAny>, depth: usize) -> PyResult<()> {
        let shape: Vec<usize> = array.getattr("shape")?.extract()?;
        let dtype = array.getattr("dtype")?;
        let kind: char = dtype.getattr("kind")?.extract()?;
        if shape.len() > 4 {
            let found = shape.len();
            let message = format!("found an array of {found} dimensions, expected at most 4");
            return Err(self.error::<PyValueError>(&message));
        }
        let size: u64 = array.getattr("size")?.extract()?;
        // These are not the same in lists: levels of pixels, and dimensions of grids.
        let is_array = ["pixels", "values"].iter().any(|key| self.place.ends_with(key));
        let is_small = size <= MAX_INLINE && !is_array;
        match kind {
            'f' if shape.is_empty() => self.real(array.call_method0("__float__")?.extract()?),
            'b' | 'i' | 'u' if is_small => self.value(&array.call_method0("tolist")?, depth + 1),
            'f' if is_small => {
                let doubles = array.call_method1("astype", ("float64",))?;
                self.value(&doubles.call_method0("tolist")?, depth + 1)
            }
            'f' | 'i' | 'u' => {
                let refused = |why: String| self.error::<PyValueError>(&why);
                // Until the scene is compiled, there are the copy and what is made of it.
                let _grant = pathtracer::memory::ask(size.saturating_mul(8)).map_err(refused)?;
                let numbers = numbers(array, kind)?;
                self.values.attach(Attachment::Array { shape, numbers });
                Ok(())
            }
            _ => {
                let message =
                    format!("found an array of {dtype}, expected real numbers or integers");
                Err(self.error::<PyTypeError>(&message))
            }
        }
    }
}

/// The numbers of an array. They are copied if another thread may change them while the scene is in
/// use.
fn numbers(array: &Bound<'_, PyAny>, kind: char) -> PyResult<Numbers> {
    if let Some(numbers) = lent::numbers(array)? {
        return Ok(numbers);
    }
    let width: usize = array.getattr("dtype")?.getattr("itemsize")?.extract()?;
    Ok(match (kind, width) {
        ('f', 4) => Numbers::Reals(each(array, "float32", |x: f32| x)?.into()),
        ('f', _) => Numbers::Reals(each(array, "float64", |x: f64| x as f32)?.into()),
        ('u', 1) => Numbers::Levels(each(array, "uint8", |x: u8| x)?),
        ('u', 4) => Numbers::Wholes(each(array, "uint32", |x: u32| x)?.into()),
        // Larger ones are no valid indices, either.
        ('u', 8) => wholes_of(array, "uint64", |x: u64| i64::try_from(x).unwrap_or(i64::MAX))?,
        ('i', 4) => wholes_of(array, "int32", |x: i32| i64::from(x))?,
        _ => wholes_of(array, "int64", |x: i64| x)?,
    })
}

/// Whole numbers if all are of 32 bits and not negative.
fn wholes_of<T: Element + Copy>(
    array: &Bound<'_, PyAny>,
    dtype: &str,
    convert: impl Fn(T) -> i64,
) -> PyResult<Numbers> {
    let mut are_whole = true;
    let wholes = each(array, dtype, |x: T| {
        u32::try_from(convert(x)).unwrap_or_else(|_| {
            are_whole = false;
            0
        })
    })?;
    Ok(if are_whole {
        Numbers::Wholes(wholes.into())
    } else {
        Numbers::Integers(each(array, dtype, convert)?)
    })
}

/// Each number of an array in row order, converted. There is no further copy of an array of this
/// type that is contiguous.
fn each<T: Element + Copy, U>(
    array: &Bound<'_, PyAny>,
    dtype: &str,
    convert: impl FnMut(T) -> U,
) -> PyResult<Vec<U>> {
    let numpy = array.py().import("numpy")?;
    let array = numpy.call_method1("require", (array, dtype, ["C_CONTIGUOUS", "ALIGNED"]))?;
    let array: PyReadonlyArrayDyn<'_, T> = array.extract()?;
    Ok(array.as_slice()?.iter().copied().map(convert).collect())
}

/// Writes a string of JSON.
fn quote(word: &str, text: &mut String) {
    text.push('"');
    for c in word.chars() {
        match c {
            '"' | '\\' => text.extend(['\\', c]),
            '\0'..='\u{1f}' => drop(write!(text, "\\u{:04x}", c as u32)),
            _ => text.push(c),
        }
    }
    text.push('"');
}

/// Values of a scene: dictionaries, lists, and arrays, which are copies.
///
/// # Errors
/// ValueError if a number is not finite.
pub(crate) fn to_python<'py>(
    py: Python<'py>,
    scene: &pathtracer::Scene,
) -> PyResult<Bound<'py, PyDict>> {
    python_of(py, py.detach(|| pathtracer::values_of(scene)))
}

/// Values of some parts of a scene, without tables of shared items; `names` are those of the
/// materials among the parts, and of all media.
///
/// # Errors
/// As [`to_python`].
pub(crate) fn parts_to_python<'py>(
    py: Python<'py>,
    parts: &pathtracer::Scene,
    [materials, media]: [&[String]; 2],
) -> PyResult<Bound<'py, PyDict>> {
    python_of(py, py.detach(|| pathtracer::values_of_parts(parts, materials, media)))
}

fn python_of(py: Python<'_>, values: Result<SceneValues, String>) -> PyResult<Bound<'_, PyDict>> {
    let values = values.map_err(PyValueError::new_err)?;
    let SceneValues { text, attachments } = values;
    let attachments = attachments.into_iter().map(|attached| object(py, attached));
    let attachments = PyList::new(py, attachments.collect::<PyResult<Vec<_>>>()?)?;
    let scene = py.import("pathtracer._values")?.call_method1("parse", (text, attachments))?;
    Ok(scene.cast_into()?)
}

fn object(py: Python<'_>, attached: Attachment) -> PyResult<Bound<'_, PyAny>> {
    use crate::queries::array;
    Ok(match attached {
        Attachment::Content(bytes) => PyBytes::new(py, &bytes).into_any(),
        Attachment::Array { shape, numbers } => match numbers {
            Numbers::Reals(numbers) => array(py, numbers.into_vec(), &shape, None)?,
            Numbers::Wholes(numbers) => array(py, numbers.into_vec(), &shape, None)?,
            Numbers::Integers(numbers) => array(py, numbers, &shape, None)?,
            Numbers::Levels(numbers) => array(py, numbers, &shape, None)?,
        }
        .into_bound(py),
    })
}
