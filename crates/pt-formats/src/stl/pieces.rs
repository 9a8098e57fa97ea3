//! Large binary files, which are never held in memory as a whole.
//!
//! Filling fresh memory with a file takes longer than processing its bytes. So each thread reads,
//! hashes and welds one part after the other in the same buffer, which stays in its cache. The
//! pieces whose corners are welded are those of `binary.rs`, so the mesh is the same. Pieces end
//! with a triangle, but the hashed parts end at powers of two, so a piece reads the bytes between
//! two ends of parts and those of its own triangles around them.

use std::path::Path;
use std::sync::{Mutex, PoisonError};

use pt_scene::{Mesh, Scene, SourceFile};
use rayon::prelude::*;

use super::binary::{ROWS, piece};
use super::weld::{Welder, join};
use super::{HEADER, PIECE, TRIANGLE, count, mesh_of, scene_of};
use crate::shared::context::LoadContext;
use crate::shared::source::{Large, PART, PartHash};

// Pieces are aligned to parts.
const _: () = assert!(PIECE.is_multiple_of(PART));

/// Working memory of a thread for a piece, which the next one reuses.
struct PieceScratch {
    welder: Welder,
    buffer: Vec<u8>,
}

/// Result of a piece: its vertices, its number of triangles, and the hashes of its parts.
type PieceResult = ((Vec<[f32; 3]>, usize), Vec<PartHash>);

/// Reads the scene of a large binary file; `None` if there is any error in it.
pub(super) fn parse(path: &Path, context: &LoadContext) -> Option<Scene> {
    let file = Large::open(path).ok()??;
    let mut head = [0; HEADER];
    file.read(0, &mut head).ok()?;
    let count = count(&head)?;
    if file.length - HEADER != count.saturating_mul(TRIANGLE) {
        return None;
    }
    let mesh = context.scene_in_pieces(file.length, || read(&file, count, path))?;
    Some(scene_of(mesh, path))
}

/// Reads `count` triangles; `None` if a value is not finite, or for any other error.
fn read(file: &Large, count: usize, path: &Path) -> Option<(Mesh, SourceFile)> {
    let mut triangles = pt_memory::zeros(count);
    let last = count.div_ceil(ROWS) - 1;
    let spare = Mutex::new(Vec::new());
    let spare = || spare.lock().unwrap_or_else(PoisonError::into_inner);
    let work = |(i, triangles): (usize, &mut [[u32; 3]])| {
        let new = || PieceScratch { welder: Welder::new(), buffer: Vec::new() };
        let mut bench = { spare().pop() }.unwrap_or_else(new);
        let done = bench.work(file, i, i == last, triangles);
        spare().push(bench);
        done
    };
    let done = triangles.par_chunks_mut(ROWS).enumerate().map(work);
    let (vertices, hashes): (Vec<_>, Vec<_>) =
        done.collect::<Option<Vec<PieceResult>>>()?.into_iter().unzip();
    let welded = join(&vertices, triangles, path).ok()?;
    Some((mesh_of(welded, path), file.source(&hashes.concat())))
}

impl PieceScratch {
    /// Reads the triangles of piece `i`, and hashes the parts that begin in it; the last piece
    /// hashes all remaining parts.
    fn work(
        &mut self,
        file: &Large,
        i: usize,
        is_last: bool,
        mut triangles: &mut [[u32; 3]],
    ) -> Option<PieceResult> {
        let Self { welder, buffer } = self;
        let (count, mut hashes) = (triangles.len(), Vec::new());
        let mut row = HEADER + i * ROWS * TRIANGLE;
        let rows_end = row + count * TRIANGLE;
        let mut part = (i * PIECE).min(file.length);
        let parts_end = if is_last { file.length } else { (part + PIECE).min(file.length) };
        loop {
            let part_end = (part + PART).min(parts_end);
            let is_end = part_end == parts_end;
            let start = part.min(row);
            let end = if is_end { part_end.max(rows_end) } else { part_end };
            let bytes = window(file, start, end, buffer)?;
            if part < part_end {
                hashes.push(Large::hash(part / PART, &bytes[part - start..part_end - start]));
            }
            let rows = bytes.get(row - start..end.min(rows_end).saturating_sub(start));
            let rows = rows.unwrap_or_default().as_chunks().0;
            let its_triangles = triangles.split_off_mut(..rows.len())?;
            if !piece(rows, its_triangles, welder) {
                return None;
            }
            row += rows.len() * TRIANGLE;
            part = part_end;
            if is_end {
                return Some(((welder.finish(), count), hashes));
            }
        }
    }
}

/// Reads the bytes between two offsets of the file into a buffer.
fn window<'b>(file: &Large, start: usize, end: usize, buffer: &'b mut Vec<u8>) -> Option<&'b [u8]> {
    if buffer.len() < end - start {
        buffer.resize(end - start, 0);
    }
    let bytes = &mut buffer[..end - start];
    file.read(start, bytes).ok()?;
    Some(bytes)
}
