//! Binary files.

use std::path::Path;

use rayon::prelude::*;

use super::weld::{WeldedTriangles, Welder, join};
use super::{HEADER, PIECE, TRIANGLE};
use crate::LoadError;
use crate::shared::mesh_diagnostics::MeshDiagnostics;
use crate::shared::mesh_file;

/// Bits of the absolute value from which a number is not finite.
const INFINITE: u32 = f32::INFINITY.to_bits();

/// Number of triangles of a piece.
pub(super) const ROWS: usize = PIECE / TRIANGLE;

/// Reads `count` triangles; those with a value that is not finite are recorded as errors.
///
/// # Errors
/// Returns an error if the file has fewer triangles, or there are too many vertices.
pub(super) fn read(
    bytes: &[u8],
    count: usize,
    path: &Path,
    faults: &mut MeshDiagnostics,
) -> Result<WeldedTriangles, LoadError> {
    let rows = bytes[HEADER..].as_chunks::<TRIANGLE>().0;
    let rows = &rows[..count.min(rows.len())];
    let mut triangles = pt_memory::zeros(rows.len());
    let work = |welder: &mut Welder, (triangles, rows): (&mut [[u32; 3]], &[[u8; TRIANGLE]])| {
        let is_finite = piece(rows, triangles, welder);
        (is_finite, (welder.finish(), triangles.len()))
    };
    let pieces = triangles.par_chunks_mut(ROWS).zip(rows.par_chunks(ROWS));
    let (are_finite, pieces): (Vec<_>, Vec<_>) = pieces.map_init(Welder::new, work).unzip();
    if are_finite.contains(&false) {
        note_infinite(rows, path, faults);
    }
    if rows.len() < count {
        let message = format!(
            "unexpected end of the file in triangle {} of {count}; it may be incomplete",
            rows.len()
        );
        return Err(mesh_file::error(path, 0, message));
    }
    join(&pieces, triangles, path)
}

/// Records errors about triangles with a value that is not finite.
fn note_infinite(rows: &[[u8; TRIANGLE]], path: &Path, faults: &mut MeshDiagnostics) {
    let is_bad = |row: &[u8; TRIANGLE]| !corners(row).as_flattened().iter().all(|x| x.is_finite());
    let bad = rows.iter().enumerate().filter(|(_, row)| is_bad(row));
    for (i, _) in bad.take(MeshDiagnostics::MAX) {
        let message = format!("found a value of triangle {i} that is not finite");
        faults.add(mesh_file::error(path, 0, message));
    }
}

/// Reads the triangles of a piece. Returns true if all values are finite.
pub(super) fn piece(
    rows: &[[u8; TRIANGLE]],
    triangles: &mut [[u32; 3]],
    welder: &mut Welder,
) -> bool {
    let mut greatest = 0;
    for (triangle, row) in triangles.iter_mut().zip(rows) {
        for (vertex, corner) in triangle.iter_mut().zip(corners(row)) {
            greatest = corner.iter().fold(greatest, |most, x| most.max(x.abs().to_bits()));
            *vertex = welder.vertex(corner);
        }
    }
    greatest < INFINITE
}

/// Returns the corners of a triangle, which follow its normal.
fn corners(row: &[u8; TRIANGLE]) -> [[f32; 3]; 3] {
    let numbers = row[12..48].as_chunks().0;
    let number = |k: usize| f32::from_le_bytes(numbers[k]);
    [0, 3, 6].map(|k| [number(k), number(k + 1), number(k + 2)])
}
