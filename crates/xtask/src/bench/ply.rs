//! Writer of meshes as binary PLY files.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result};

/// Writes positions and triangles as little-endian 32-bit numbers.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write(
    path: &Path,
    positions: impl ExactSizeIterator<Item = [f32; 3]>,
    triangles: impl ExactSizeIterator<Item = [u32; 3]>,
) -> Result<()> {
    let write = || -> std::io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        let (vertices, faces) = (positions.len(), triangles.len());
        write!(
            file,
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n\
             property float y\nproperty float z\nelement face {faces}\n\
             property list uchar int vertex_indices\nend_header\n"
        )?;
        for v in positions.flatten() {
            file.write_all(&v.to_le_bytes())?;
        }
        for triangle in triangles {
            file.write_all(&[3])?;
            for corner in triangle {
                file.write_all(&corner.to_le_bytes())?;
            }
        }
        file.flush()
    };
    write().with_context(|| format!("{} cannot be written", path.display()))
}
