//! Stereolithography files (STL), text and binary: triangles without neighbours.
//! [3D Systems, "Stereolithography Interface Specification", 1989]
//!
//! A binary file has a header of 80 bytes, the number of triangles, and 50 bytes for each: its normal, its corners
//! and two bytes of attributes. Headers may begin with `solid`, as texts do, so a file is binary
//! if it has the size that its number of triangles asks for.
//!
//! Corners with the same coordinates become one vertex. Normals are not read, as they follow from the corners,
//! nor are the attributes, which some programs use for colours, each in another way. z is up, as it is in
//! programs for the workshop.

use std::collections::HashMap;
use std::path::Path;

use pt_math::{DAffine3, DMat3, DVec3};

use super::line::Line;
use super::mesh_file::{self, ColorLevels, MeshFile};
use super::xml::quote;
use crate::shapes::single_part;
use crate::{LoadError, Mesh, Scene};

/// Bytes before the first triangle of a binary file, of which the last four are the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle.
const TRIANGLE: usize = 50;
/// Words with which lines of a text may begin, besides `vertex` and `endloop`.
const WORDS: [&str; 5] = ["solid", "facet", "outer", "endfacet", "endsolid"];

/// A scene of one object, with z up.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    let mut welder = Welder::default();
    match count(bytes) {
        Some(count) if bytes.len() - HEADER == count.saturating_mul(TRIANGLE) => {
            binary(bytes, count, path, &mut welder)?;
        }
        _ if is_text(bytes) => text(bytes, path, &mut welder)?,
        Some(count) => binary(bytes, count, path, &mut welder)?,
        None => {
            let message = "the file is no STL: expected the word \"solid\", or 84 bytes and 50 for \
                           each triangle";
            return Err(mesh_file::error(path, 0, message));
        }
    }
    if welder.triangles.is_empty() {
        return Err(mesh_file::error(path, 0, "the file has no triangles"));
    }
    let Welder { positions, triangles, .. } = welder;
    let mesh = Mesh {
        name: mesh_file::name_of(path),
        parts: single_part(triangles.len()),
        positions,
        triangles,
        normals: None,
        uvs: None,
        colors: None,
        face_colors: None,
    };
    let file = MeshFile { mesh, levels: ColorLevels::default(), warnings: Vec::new() };
    let mut scene = file.into_scene(path);
    let z_up = DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
    scene.objects.iter_mut().for_each(|object| object.to_world = DAffine3::from_mat3(z_up));
    Ok(scene)
}

/// The number of triangles that a binary file says it has.
fn count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count) as usize)
}

/// Whether a file begins as a text does, and has no byte 0, which texts do not have and headers are filled
/// with.
fn is_text(bytes: &[u8]) -> bool {
    let first = bytes.trim_ascii_start().first_chunk::<5>();
    let head = &bytes[..bytes.len().min(HEADER)];
    first.is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !head.contains(&0)
}

/// Reads `count` triangles.
fn binary(bytes: &[u8], count: usize, path: &Path, welder: &mut Welder) -> Result<(), LoadError> {
    for (i, triangle) in bytes[HEADER..].chunks_exact(TRIANGLE).take(count).enumerate() {
        let numbers = triangle[12..48].as_chunks().0;
        let number = |k: usize| f32::from_le_bytes(numbers[k]);
        let corners = [0, 3, 6].map(|k| [number(k), number(k + 1), number(k + 2)]);
        if !corners.as_flattened().iter().all(|x| x.is_finite()) {
            let message = format!("triangle {i} has a value that is not finite");
            return Err(mesh_file::error(path, 0, message));
        }
        welder.add(corners);
    }
    let found = (bytes.len() - HEADER) / TRIANGLE;
    if found < count {
        let message = format!("the file ends in triangle {found} of {count}; is it complete?");
        return Err(mesh_file::error(path, 0, message));
    }
    Ok(())
}

/// Reads the loops of a text; case does not matter.
fn text(bytes: &[u8], path: &Path, welder: &mut Welder) -> Result<(), LoadError> {
    let mut corners = Vec::new();
    for (number, line) in (1..).zip(bytes.split(|b| *b == b'\n')) {
        let text = String::from_utf8_lossy(line);
        let line = Line { path, number, text: &text };
        let word = line.keyword();
        if word.eq_ignore_ascii_case("vertex") {
            let position: [f32; 3] = line.numbers(text.split_ascii_whitespace().skip(1))?;
            corners.push(position);
        } else if word.eq_ignore_ascii_case("endloop") {
            let [a, b, c] = corners[..] else {
                let message = format!("the loop has {} corners; expected 3", corners.len());
                return Err(line.error(word, message));
            };
            welder.add([a, b, c]);
            corners.clear();
        } else if !word.is_empty() && !WORDS.iter().any(|w| w.eq_ignore_ascii_case(word)) {
            let message = format!("{} is no word of STL; expected \"vertex\"", quote(word));
            return Err(line.error(word, message));
        }
        if corners.len() > 3 {
            return Err(line.error(word, "the loop has more than 3 corners"));
        }
    }
    if corners.is_empty() {
        return Ok(());
    }
    Err(mesh_file::error(path, 0, "the file ends in a loop; is it complete?"))
}

/// Triangles, of which equal corners are one vertex.
#[derive(Default)]
struct Welder {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Vertices by the bits of their coordinates.
    known: HashMap<[u32; 3], u32>,
}

impl Welder {
    fn add(&mut self, corners: [[f32; 3]; 3]) {
        let triangle = corners.map(|corner| {
            // −0 is 0.
            let position = corner.map(|x| x + 0.0);
            *self.known.entry(position.map(f32::to_bits)).or_insert_with(|| {
                self.positions.push(position);
                self.positions.len() as u32 - 1
            })
        });
        self.triangles.push(triangle);
    }
}
