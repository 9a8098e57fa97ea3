//! Input files: the same mesh of two million triangles in all formats.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::json;

use crate::bench::mesh::{waves, write_waves};

/// Number of triangles of the mesh.
pub(super) const TRIANGLES: usize = 2_000_000;

/// File to be read.
pub(super) struct FileKind {
    pub(super) name: &'static str,
    pub(super) write: fn(&Path) -> Result<()>,
    /// Required speed of its reader in MB/s (10⁶ bytes per second).
    pub(super) wanted: f64,
}

/// All files.
pub(super) const KINDS: &[FileKind] = &[
    FileKind { name: "little_endian.ply", write: write_waves, wanted: 1000.0 },
    FileKind { name: "big_endian.ply", write: |path| written(path, big_endian), wanted: 1000.0 },
    FileKind { name: "ascii.ply", write: |path| written(path, ascii), wanted: 200.0 },
    FileKind { name: "mesh.obj", write: |path| written(path, obj), wanted: 200.0 },
    FileKind { name: "mesh.glb", write: |path| written(path, glb), wanted: 1000.0 },
    FileKind { name: "mesh.stl", write: |path| written(path, stl), wanted: 1000.0 },
];

/// Writes a file.
fn written(path: &Path, write: fn(&mut dyn Write) -> std::io::Result<()>) -> Result<()> {
    let file = File::create(path).map(BufWriter::new);
    let written = file.and_then(|mut file| {
        write(&mut file)?;
        file.flush()
    });
    written.with_context(|| format!("{} cannot be written", path.display()))
}

fn ply_header(file: &mut dyn Write, encoding: &str) -> std::io::Result<()> {
    let (positions, triangles) = waves();
    write!(
        file,
        "ply\nformat {encoding} 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        positions.len(),
        triangles.len()
    )
}

fn big_endian(file: &mut dyn Write) -> std::io::Result<()> {
    ply_header(file, "binary_big_endian")?;
    let (positions, triangles) = waves();
    for x in positions.flatten() {
        file.write_all(&x.to_be_bytes())?;
    }
    for corners in triangles {
        file.write_all(&[3])?;
        for corner in corners {
            file.write_all(&corner.to_be_bytes())?;
        }
    }
    Ok(())
}

fn ascii(file: &mut dyn Write) -> std::io::Result<()> {
    ply_header(file, "ascii")?;
    let (positions, triangles) = waves();
    for [x, y, z] in positions {
        writeln!(file, "{x} {y} {z}")?;
    }
    for [a, b, c] in triangles {
        writeln!(file, "3 {a} {b} {c}")?;
    }
    Ok(())
}

fn obj(file: &mut dyn Write) -> std::io::Result<()> {
    let (positions, triangles) = waves();
    for [x, y, z] in positions {
        writeln!(file, "v {x} {y} {z}")?;
    }
    for corners in triangles {
        let [a, b, c] = corners.map(|c| c + 1);
        writeln!(file, "f {a} {b} {c}")?;
    }
    Ok(())
}

/// Writes each triangle with its vertices.
fn stl(file: &mut dyn Write) -> std::io::Result<()> {
    let (positions, triangles) = waves();
    let positions: Vec<_> = positions.collect();
    file.write_all(&[0; 80])?;
    file.write_all(&(triangles.len() as u32).to_le_bytes())?;
    for triangle in triangles {
        file.write_all(&[0; 12])?;
        for x in triangle.iter().flat_map(|corner| positions[*corner as usize]) {
            file.write_all(&x.to_le_bytes())?;
        }
        file.write_all(&[0; 2])?;
    }
    Ok(())
}

/// Binary glTF: 12 bytes of header, a chunk of JSON and a chunk of binary data. [glTF 2.0
/// specification, section 4.4 "Binary glTF Layout"]
fn glb(file: &mut dyn Write) -> std::io::Result<()> {
    let (positions, triangles) = waves();
    let (points, indices) = (positions.len(), 3 * triangles.len());
    let (first, second) = (12 * points, 4 * indices);
    let json = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 }, "indices": 1 }] }],
        "buffers": [{ "byteLength": first + second }],
        "bufferViews": [
            { "buffer": 0, "byteLength": first },
            { "buffer": 0, "byteOffset": first, "byteLength": second },
        ],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": points, "type": "VEC3",
              "min": [-1, -1, -0.1], "max": [1, 1, 0.1] },
            { "bufferView": 1, "componentType": 5125, "count": indices, "type": "SCALAR" },
        ],
    });
    let mut json = json.to_string().into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let all = 12 + 8 + json.len() + 8 + first + second;
    let words =
        |words: &[usize]| words.iter().flat_map(|w| (*w as u32).to_le_bytes()).collect::<Vec<_>>();
    file.write_all(b"glTF")?;
    file.write_all(&words(&[2, all, json.len()]))?;
    file.write_all(b"JSON")?;
    file.write_all(&json)?;
    file.write_all(&words(&[first + second]))?;
    file.write_all(b"BIN\0")?;
    for x in positions.flatten() {
        file.write_all(&x.to_le_bytes())?;
    }
    for corner in triangles.flatten() {
        file.write_all(&corner.to_le_bytes())?;
    }
    Ok(())
}
