//! Named values of all rows of an element, for files that are no meshes.

use std::path::Path;

use ply_rs_bw::ply::{ElementDef, PropertyType};

use super::layout::{ElementLayout, SLOTS};
use super::rows::{Body, RowChunk};
use super::{header_of, text_lines};
use crate::LoadError;
use crate::shared::names::quote;
use crate::shared::{mesh_diagnostics, mesh_file, text};

/// Reads some properties of the vertices, one row each, in the order of `names`, of which there are
/// at most [`SLOTS`].
///
/// # Errors
/// Returns an error if the content is no PLY, is truncated, has no vertices, a property is missing
/// or a list, or a value is not finite.
pub(in super::super) fn parse<const N: usize>(
    bytes: &[u8],
    path: &Path,
    names: [&str; N],
) -> Result<Vec<[f32; N]>, LoadError> {
    const { assert!(N <= SLOTS) };
    let bytes = text::unmarked(bytes, path)?;
    let bytes = text_lines(&bytes);
    let (header, line, rest) = header_of(&bytes, path)?;
    mesh_diagnostics::of_part(|faults| {
        let mut body = Body { path, encoding: header.encoding, line, rest, faults };
        for element in header.elements.values() {
            if element.name == "vertex" {
                return read(&mut body, element, names);
            }
            body.skip(element)?;
        }
        Err(mesh_file::error(path, 0, "missing element \"vertex\""))
    })
}

fn read<const N: usize>(
    body: &mut Body,
    element: &ElementDef,
    names: [&str; N],
) -> Result<Vec<[f32; N]>, LoadError> {
    for name in names {
        let property = element.properties.get(name).map(|property| &property.data_type);
        if !matches!(property, Some(PropertyType::Scalar(_))) {
            let message = format!("missing number {} of the element \"vertex\"", quote(name));
            return Err(mesh_file::error(body.path, 0, message));
        }
    }
    let layout = ElementLayout::of_columns(element, &names);
    let mut all = pt_memory::with_capacity(body.least_count(&layout));
    let read = |chunk: &RowChunk, faults: &mut mesh_diagnostics::MeshDiagnostics| {
        let mut rows = Vec::with_capacity(chunk.count);
        chunk.rows(faults, |i, row| {
            let row = row?;
            let numbers: [f32; N] = std::array::from_fn(|slot| row.numbers[slot]);
            if numbers.iter().all(|x| x.is_finite()) {
                rows.push(numbers);
                return Ok(());
            }
            Err(format!("found a value of vertex {i} that is not finite"))
        });
        rows
    };
    body.read(&layout, read, |mut rows| all.append(&mut rows))?;
    if all.is_empty() {
        return Err(body.faults.because_of(mesh_file::error(
            body.path,
            0,
            "found no vertex with finite values",
        )));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    const NAMES: [&str; 2] = ["b", "a"];

    fn text(rows: &str) -> String {
        let count = rows.lines().count();
        format!(
            "ply\nformat ascii 1.0\nelement vertex {count}\nproperty float a\nproperty uchar red\nproperty double b\n\
             end_header\n{rows}"
        )
    }

    #[test]
    fn columns_come_in_the_order_of_their_names() {
        let read = parse(text("1 255 2\n3 0 4\n").as_bytes(), Path::new("x.ply"), NAMES).unwrap();
        assert_eq!(read, [[2.0, 1.0], [4.0, 3.0]]);
        let missing = parse(text("1 2 3\n").as_bytes(), Path::new("x.ply"), ["a", "c"]);
        let message = missing.unwrap_err().to_string();
        assert!(message.contains("missing number \"c\""), "{message}");
        let wrong = parse(text("1 2 nan\n").as_bytes(), Path::new("x.ply"), NAMES);
        assert!(wrong.unwrap_err().to_string().contains("not finite"));
    }
}
