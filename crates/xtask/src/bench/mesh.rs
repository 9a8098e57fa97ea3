//! A mesh of two million triangles.

use std::path::Path;

use anyhow::Result;

use super::ply;

/// Squares along a side, each of two triangles.
const SIDE: u32 = 1000;

/// Vertices and triangles of a wavy plane. The heights may differ between machines: only time and
/// memory are measured.
pub(crate) fn waves()
-> (impl ExactSizeIterator<Item = [f32; 3]>, impl ExactSizeIterator<Item = [u32; 3]>) {
    let row = SIDE + 1;
    let position = move |i: u32| {
        let [x, y] = [i / row, i % row].map(|n| n as f32 / SIDE as f32 * 2.0 - 1.0);
        [x, y, 0.05 * ((40.0 * x).sin() + (40.0 * y).cos())]
    };
    let triangle = move |n: u32| {
        let square = n / 2;
        let a = square / SIDE * row + square % SIDE;
        let [b, c, d] = [a + row, a + row + 1, a + 1];
        if n.is_multiple_of(2) { [a, b, c] } else { [a, c, d] }
    };
    ((0..row * row).map(position), (0..2 * SIDE * SIDE).map(triangle))
}

/// Writes the plane as a binary PLY file.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write_waves(path: &Path) -> Result<()> {
    let (positions, triangles) = waves();
    ply::write(path, positions, triangles)
}
