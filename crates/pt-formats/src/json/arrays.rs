//! Files of named, typed arrays. [Hugging Face 2022, "Safetensors", format 0.4]

use safetensors::tensor::{Dtype, SafeTensors, TensorView, serialize};

/// Extension of files that contain all arrays of a mesh.
pub(super) const ENDING: &str = "safetensors";

/// An array: its name, type, numbers per row, and bytes.
pub(super) type Array = (String, Dtype, usize, Vec<u8>);

pub(super) fn reals<const N: usize>(name: &str, values: &[[f32; N]]) -> Array {
    let bytes = values.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    (name.to_owned(), Dtype::F32, N, bytes)
}

pub(super) fn wholes<const N: usize>(name: &str, values: &[[u32; N]]) -> Array {
    let bytes = values.as_flattened().iter().flat_map(|x| x.to_le_bytes()).collect();
    (name.to_owned(), Dtype::U32, N, bytes)
}

/// Encodes arrays as a file.
pub(super) fn encode(arrays: &[Array]) -> Result<Vec<u8>, String> {
    let views = arrays.iter().map(|(name, kind, width, bytes)| {
        let shape = vec![bytes.len() / (4 * width), *width];
        TensorView::new(*kind, shape, bytes).map(|view| (name.as_str(), view))
    });
    let views = views.collect::<Result<Vec<_>, _>>().map_err(|e| e.to_string())?;
    serialize(views, None).map_err(|e| e.to_string())
}

/// Decodes the arrays of a file.
pub(super) fn decode(bytes: &[u8]) -> Result<SafeTensors<'_>, String> {
    SafeTensors::deserialize(bytes).map_err(|e| format!("invalid file of arrays: {e}"))
}

/// Returns an error if an array has an unknown name.
pub(super) fn check_names(
    all: &SafeTensors<'_>,
    known: &[&str],
    is_known: impl Fn(&str) -> bool,
) -> Result<(), String> {
    match all.names().into_iter().find(|name| !known.contains(name) && !is_known(name)) {
        Some(name) => Err(format!("unknown array \"{name}\"; known: {}", known.join(", "))),
        None => Ok(()),
    }
}

/// Returns the message about a missing array.
pub(super) fn missing(name: &str) -> String {
    format!("missing array \"{name}\"")
}

/// Returns the rows of an array of this type, or `None` if it does not exist.
fn rows<const N: usize>(
    all: &SafeTensors<'_>,
    name: &str,
    kind: Dtype,
) -> Result<Option<Vec<[[u8; 4]; N]>>, String> {
    let Ok(array) = all.tensor(name) else { return Ok(None) };
    match array.shape() {
        [_, width] if *width == N && array.dtype() == kind => {
            Ok(Some(array.data().as_chunks::<4>().0.as_chunks::<N>().0.to_vec()))
        }
        shape => Err(format!(
            "array \"{name}\": found {:?} of {shape:?}, expected {kind:?} in rows of {N}",
            array.dtype()
        )),
    }
}

pub(super) fn points<const N: usize>(
    all: &SafeTensors<'_>,
    name: &str,
) -> Result<Option<Vec<[f32; N]>>, String> {
    let Some(rows) = rows::<N>(all, name, Dtype::F32)? else { return Ok(None) };
    let points: Vec<_> = rows.into_iter().map(|row| row.map(f32::from_le_bytes)).collect();
    match points.as_flattened().iter().position(|x| !x.is_finite()) {
        Some(bad) => Err(format!(
            "found row {} of \"{name}\" that is not finite, expected finite numbers",
            bad / N
        )),
        None => Ok(Some(points)),
    }
}

pub(super) fn corners<const N: usize>(
    all: &SafeTensors<'_>,
    name: &str,
) -> Result<Option<Vec<[u32; N]>>, String> {
    let rows = rows::<N>(all, name, Dtype::U32)?;
    Ok(rows.map(|rows| rows.into_iter().map(|row| row.map(u32::from_le_bytes)).collect()))
}
