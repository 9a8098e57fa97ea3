//! Segments between vertices: `vertex1` and `vertex2` of the element `edge`.

use ply_rs_bw::ply::ElementDef;

use super::layout::ElementLayout;
use super::rows::{Body, RowChunk};
use crate::LoadError;
use crate::shared::mesh_diagnostics::MeshDiagnostics;

/// Properties of the end points of a segment.
const NAMES: [&str; 2] = ["vertex1", "vertex2"];
/// Maximum number of vertices; rows are read in single precision, which does not represent larger
/// indices exactly.
const MAX_VERTICES: u32 = 1 << 24;

/// Reads the end points of all edges, each below `vertices`; those that refer to others are errors.
pub(super) fn read(
    body: &mut Body,
    element: &ElementDef,
    vertices: u32,
) -> Result<Vec<[u32; 2]>, LoadError> {
    let layout = ElementLayout::of_columns(element, &NAMES);
    if !layout.has(&NAMES) || vertices > MAX_VERTICES {
        body.skip(element)?;
        return Ok(Vec::new());
    }
    let mut segments = Vec::new();
    let rows = |chunk: &RowChunk, faults: &mut MeshDiagnostics| {
        let mut part = Vec::new();
        chunk.rows(faults, |i, row| {
            let row = row?;
            let ends = [row.numbers[0], row.numbers[1]];
            let is_vertex = |end: &f32| (0.0..vertices as f32).contains(end);
            match ends.iter().find(|end| !is_vertex(end)) {
                None => part.push(ends.map(|end| end as u32)),
                Some(bad) => {
                    return Err(format!(
                        "found vertex {bad} in edge {i}, expected 0 to {}",
                        vertices - 1
                    ));
                }
            }
            Ok(())
        });
        part
    };
    body.read(&layout, rows, |mut part| segments.append(&mut part))?;
    Ok(segments)
}
