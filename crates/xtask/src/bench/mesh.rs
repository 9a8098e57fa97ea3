//! A mesh of two million triangles.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result};

/// Squares along a side, each of two triangles.
const SIDE: u32 = 1000;

/// Writes a rolling plain as a binary PLY file. The heights need not be the same on every machine:
/// only memory is measured.
///
/// # Errors
/// If the file cannot be written.
pub(crate) fn write_waves(path: &Path) -> Result<()> {
    let write = || -> std::io::Result<()> {
        let mut file = BufWriter::new(File::create(path)?);
        let (vertices, faces) = ((SIDE + 1) * (SIDE + 1), 2 * SIDE * SIDE);
        write!(
            file,
            "ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n\
             property float y\nproperty float z\nelement face {faces}\n\
             property list uchar int vertex_indices\nend_header\n"
        )?;
        for i in 0..=SIDE {
            for j in 0..=SIDE {
                let [x, y] = [i, j].map(|n| n as f32 / SIDE as f32 * 2.0 - 1.0);
                let z = 0.05 * ((40.0 * x).sin() + (40.0 * y).cos());
                for v in [x, y, z] {
                    file.write_all(&v.to_le_bytes())?;
                }
            }
        }
        for i in 0..SIDE {
            for j in 0..SIDE {
                let a = i * (SIDE + 1) + j;
                let [b, c, d] = [a + SIDE + 1, a + SIDE + 2, a + 1];
                for corners in [[a, b, c], [a, c, d]] {
                    file.write_all(&[3])?;
                    for corner in corners {
                        file.write_all(&corner.to_le_bytes())?;
                    }
                }
            }
        }
        file.flush()
    };
    write().with_context(|| format!("{} cannot be written", path.display()))
}
