//! Writes the mesh of `scenes/mitsuba/mesh.xml`: a bumpy sphere of 50 000 triangles as a binary
//! PLY.
//!
//! ```text
//! cargo run -p pt-scene --example make_peer_mesh -- scenes/mitsuba/bumpy_sphere.ply
//! ```

use std::io::Write;

use pt_scene::Mesh;

/// 20 · 50² triangles.
const SUBDIVISION: u32 = 50;

fn main() -> std::io::Result<()> {
    let Some(path) = std::env::args_os().nth(1) else {
        return Err(std::io::Error::other("give the name of the file to write"));
    };
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    write_ply(&mut file, &pt_scene::shapes::bumpy_sphere(SUBDIVISION))?;
    file.flush()
}

/// Positions and triangles, little-endian.
fn write_ply(out: &mut impl Write, mesh: &Mesh) -> std::io::Result<()> {
    writeln!(out, "ply\nformat binary_little_endian 1.0")?;
    writeln!(out, "element vertex {}", mesh.positions.len())?;
    writeln!(out, "property float x\nproperty float y\nproperty float z")?;
    writeln!(out, "element face {}", mesh.triangles.len())?;
    writeln!(out, "property list uchar int vertex_indices\nend_header")?;
    for coordinate in mesh.positions.as_flattened() {
        out.write_all(&coordinate.to_le_bytes())?;
    }
    for corners in &mesh.triangles {
        out.write_all(&[3])?;
        for corner in corners {
            out.write_all(&corner.to_le_bytes())?;
        }
    }
    Ok(())
}
