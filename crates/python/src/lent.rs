//! Arrays of NumPy whose memory scenes use without a copy, because nobody changes it.

use numpy::{Element, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pathtracer::{Numbers, Shared};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyMemoryView};

/// Numbers in the memory of an array.
struct Lent<T> {
    /// Keeps the memory.
    _array: Py<PyAny>,
    first: *const T,
    count: usize,
}

#[expect(unsafe_code, reason = "the pointer is to memory that nobody changes")]
// SAFETY: as for a shared slice.
unsafe impl<T: Sync> Send for Lent<T> {}

#[expect(unsafe_code, reason = "the pointer is to memory that nobody changes")]
// SAFETY: as for a shared slice.
unsafe impl<T: Sync> Sync for Lent<T> {}

impl<T> AsRef<[T]> for Lent<T> {
    #[expect(unsafe_code, reason = "the memory belongs to Python")]
    fn as_ref(&self) -> &[T] {
        // SAFETY: these are the pointer and the length of a slice of the array, which lives as long
        // as this value, and which is frozen.
        unsafe { std::slice::from_raw_parts(self.first, self.count) }
    }
}

/// Numbers of an array in its own memory. `None` if they have to be copied: they are of a type that
/// scenes do not have, not in row order, or can be changed.
///
/// # Errors
/// Exceptions of NumPy.
pub(crate) fn numbers(array: &Bound<'_, PyAny>) -> PyResult<Option<Numbers>> {
    if !is_frozen(array)? {
        return Ok(None);
    }
    if let Some(reals) = lend::<f32>(array) {
        return Ok(Some(Numbers::Reals(reals)));
    }
    // Indices that are not negative are the same with and without a sign.
    let unsigned = match lend::<i32>(array) {
        Some(signed) if signed.iter().any(|index| *index < 0) => return Ok(None),
        Some(_) => &array.call_method1("view", ("uint32",))?,
        None => array,
    };
    Ok(lend(unsigned).map(Numbers::Wholes))
}

/// The numbers of a frozen array if they are of this type, and in row order.
fn lend<T: Element + Sync + 'static>(array: &Bound<'_, PyAny>) -> Option<Shared<T>> {
    let numbers: PyReadonlyArrayDyn<'_, T> = array.extract().ok()?;
    if !numbers.is_c_contiguous() {
        return None;
    }
    let slice = numbers.as_slice().ok()?;
    let (first, count) = (slice.as_ptr(), slice.len());
    Some(Shared::lent(Lent { _array: array.clone().unbind(), first, count }))
}

/// True if an array and all objects whose memory it uses are read-only, the last of which is
/// another array of NumPy, or of type `bytes`. Memory of other libraries, and of files, may change.
fn is_frozen(array: &Bound<'_, PyAny>) -> PyResult<bool> {
    let type_of_arrays = array.py().import("numpy")?.getattr("ndarray")?;
    let mut owner = array.clone();
    loop {
        if owner.is_instance(&type_of_arrays)? {
            let flags = owner.getattr("flags")?;
            if flags.getattr("writeable")?.is_truthy()? || !flags.getattr("aligned")?.is_truthy()? {
                return Ok(false);
            }
            let base = owner.getattr("base")?;
            if base.is_none() {
                return flags.getattr("owndata")?.is_truthy();
            }
            owner = base;
        } else if let Ok(view) = owner.cast::<PyMemoryView>() {
            owner = view.getattr("obj")?;
        } else {
            return Ok(owner.is_instance_of::<PyBytes>());
        }
    }
}
