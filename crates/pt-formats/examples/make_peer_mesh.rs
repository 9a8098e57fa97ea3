//! Writes meshes for comparisons with other renderers: a bumpy sphere of 50 000 triangles as a
//! binary PLY, for `scenes/mitsuba/mesh.xml`, or two small ones as serialized meshes of Mitsuba,
//! for `scenes/mitsuba/shapes.xml`.
//!
//! ```text
//! cargo run -p pt-formats --example make_peer_mesh -- scenes/mitsuba/bumpy_sphere.ply
//! cargo run -p pt-formats --example make_peer_mesh -- scenes/mitsuba/bumpy_spheres.serialized
//! ```

use std::io::Write;
use std::path::PathBuf;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use pt_math::DVec3;
use pt_scene::Mesh;
use pt_scene::shapes::bumpy_sphere;

/// Subdivision that makes 20 · 50² triangles.
const SUBDIVISION: u32 = 50;
/// Subdivisions of the serialized meshes: the first is in single precision without normals, the
/// second in double precision with normals and texture coordinates.
const SMALL: [u32; 2] = [8, 12];

fn main() -> std::io::Result<()> {
    let Some(path) = std::env::args_os().nth(1).map(PathBuf::from) else {
        return Err(std::io::Error::other("give the name of the file to write"));
    };
    let mut file = std::io::BufWriter::new(std::fs::File::create(&path)?);
    if path.extension().is_some_and(|ending| ending == "serialized") {
        file.write_all(&serialized()?)?;
    } else {
        write_ply(&mut file, &bumpy_sphere(SUBDIVISION))?;
    }
    file.flush()
}

/// Writes positions and triangles, little-endian.
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

/// Returns a file of two meshes and the list of their offsets.
fn serialized() -> std::io::Result<Vec<u8>> {
    let (mut bytes, mut places) = (Vec::new(), Vec::new());
    for (i, subdivision) in SMALL.into_iter().enumerate() {
        places.extend((bytes.len() as u64).to_le_bytes());
        bytes.extend([0x1c, 4, 4, 0]);
        let mut packed = ZlibEncoder::new(&mut bytes, Compression::best());
        packed.write_all(&content(&bumpy_sphere(subdivision), i == 1))?;
        packed.finish()?;
    }
    bytes.extend(places);
    bytes.extend((SMALL.len() as u32).to_le_bytes());
    Ok(bytes)
}

/// Encodes a mesh in version 4, with all vertex attributes and in double precision, or without
/// attributes. The texture coordinates are x and y.
fn content(mesh: &Mesh, full: bool) -> Vec<u8> {
    let flags: u32 = if full { 0x2003 } else { 0x1000 };
    let mut bytes = flags.to_le_bytes().to_vec();
    bytes.extend(b"bumpy sphere\0");
    bytes.extend((mesh.positions.len() as u64).to_le_bytes());
    bytes.extend((mesh.triangles.len() as u64).to_le_bytes());
    let positions = mesh.positions.as_flattened();
    if full {
        let uvs = mesh.positions.iter().flat_map(|p| &p[..2]);
        let normals = smooth_normals(mesh);
        let all = positions.iter().chain(normals.as_flattened()).chain(uvs);
        bytes.extend(all.flat_map(|x| f64::from(*x).to_le_bytes()));
    } else {
        bytes.extend(positions.iter().flat_map(|x| x.to_le_bytes()));
    }
    bytes.extend(mesh.triangles.as_flattened().iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

/// Returns the mean of the normals of the triangles around each vertex, weighted by area.
fn smooth_normals(mesh: &Mesh) -> Vec<[f32; 3]> {
    let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
    for corners in &mesh.triangles {
        let [a, b, c] =
            corners.map(|i| DVec3::from_array(mesh.positions[i as usize].map(f64::from)));
        for corner in corners {
            sums[*corner as usize] += (b - a).cross(c - a);
        }
    }
    sums.iter().map(|sum| sum.normalize().as_vec3().to_array()).collect()
}
