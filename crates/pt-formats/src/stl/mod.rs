//! Stereolithography files (STL), text and binary: triangles without connectivity. [3D Systems,
//! "Stereolithography Interface Specification", 1989]
//!
//! A binary file has a header of 80 bytes, the number of triangles, and 50 bytes for each: its
//! normal, its corners and two bytes of attributes. Headers may begin with `solid`, as texts do, so
//! a file is binary if its size matches its number of triangles. Otherwise it is a text if it
//! begins like one.
//!
//! Corners with the same coordinates become one vertex, if they are near each other in the file.
//! Normals are ignored, since they follow from the corners, and so are the attributes, which some
//! programs use for colours, in different ways. z is up, as in programs for manufacturing.
//!
//! Files are read in pieces, in parallel: `binary.rs` and `text.rs` split them, and `weld.rs` welds
//! equal corners and joins the pieces. Large binary files are never held in memory as a whole:
//! `pieces.rs`.

mod binary;
#[cfg(all(unix, target_pointer_width = "64"))]
mod pieces;
mod text;
mod weld;

use std::path::Path;
use std::sync::Arc;

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::shapes::single_part;
use pt_scene::{Attributes, Mesh, Scene};
use weld::WeldedTriangles;

use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::mesh_diagnostics::MeshDiagnostics;
use crate::shared::mesh_file::{ColorLevels, MeshFile};
use crate::shared::{mesh_diagnostics, mesh_file};

/// Number of bytes before the first triangle of a binary file, the last four of which are the
/// number of triangles.
const HEADER: usize = 84;
/// Number of bytes of a triangle.
const TRIANGLE: usize = 50;
/// Approximate number of bytes of a piece of a file: the data of a piece fits into the cache of a
/// core.
const PIECE: usize = 1 << 20;

/// Reader of large binary files, on systems with positioned reads.
#[cfg(all(unix, target_pointer_width = "64"))]
pub(super) const IN_PIECES: Option<super::PieceReader> = Some(pieces::parse);
/// `None` on other systems.
#[cfg(not(all(unix, target_pointer_width = "64")))]
pub(super) const IN_PIECES: Option<super::PieceReader> = None;

/// Reads a scene of one object, with z up.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    Ok(scene_of(mesh_diagnostics::of_scene(context, |faults| read(bytes, path, faults))?, path))
}

/// Reads the mesh of a file, in its own coordinates.
///
/// # Errors
/// Returns an error if the file is no STL, is truncated, has values that are not finite, or no
/// triangles.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path) -> Result<Mesh, LoadError> {
    mesh_diagnostics::of_part(|faults| read(bytes, path, faults))
}

fn scene_of(mesh: Mesh, path: &Path) -> Scene {
    let file = MeshFile { mesh, levels: ColorLevels::default(), warnings: Vec::new() };
    let mut scene = file.into_scene(path);
    let z_up = DMat3::from_cols(DVec3::X, DVec3::NEG_Z, DVec3::Y);
    scene.objects.iter_mut().for_each(|object| object.to_world = DAffine3::from_mat3(z_up));
    scene
}

/// Reads the mesh of a file, without invalid triangles.
///
/// # Errors
/// Returns an error if nothing more can be read.
fn read(bytes: &[u8], path: &Path, faults: &mut MeshDiagnostics) -> Result<Mesh, LoadError> {
    let welded = match count(bytes) {
        Some(count) if bytes.len() - HEADER == count.saturating_mul(TRIANGLE) => {
            binary::read(bytes, count, path, faults)?
        }
        count => {
            let text = crate::shared::text::lines(bytes, path)?;
            match count {
                _ if is_text(&text) => text::read(&text, path, faults)?,
                Some(count) => binary::read(bytes, count, path, faults)?,
                None => {
                    let message = "found no STL, expected the word \"solid\", or 84 bytes and 50 \
                                   for each triangle";
                    return Err(mesh_file::error(path, 0, message));
                }
            }
        }
    };
    if welded.triangles.is_empty() {
        return Err(faults.because_of(mesh_file::error(path, 0, "file without triangles")));
    }
    Ok(mesh_of(welded, path))
}

fn mesh_of(WeldedTriangles { positions, triangles }: WeldedTriangles, path: &Path) -> Mesh {
    Mesh {
        name: mesh_file::name_of(path),
        submeshes: single_part(triangles.len()),
        positions: positions.into(),
        triangles: triangles.into(),
        normals: None,
        uvs: None,
        colors: None,
        face_colors: None,
        attributes: Attributes::default(),
    }
}

/// Returns the number of triangles in the header of a binary file.
fn count(bytes: &[u8]) -> Option<usize> {
    let count = bytes.get(HEADER - 4..)?.first_chunk()?;
    Some(u32::from_le_bytes(*count) as usize)
}

/// Returns true if a file is a text: one of its first lines begins a facet or ends a solid, or it
/// begins with "solid" and has no byte 0, with which headers are padded. Names of solids may have
/// any bytes.
fn is_text(bytes: &[u8]) -> bool {
    /// Number of bytes in which a facet is searched.
    const START: usize = 4096;
    let first = bytes.trim_ascii_start().first_chunk::<5>();
    let head = &bytes[..bytes.len().min(HEADER)];
    if first.is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) && !head.contains(&0) {
        return true;
    }
    bytes[..bytes.len().min(START)].split(|byte| *byte == b'\n').any(|line| {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        let mut next_is =
            |word: &[u8]| words.next().is_some_and(|next| next.eq_ignore_ascii_case(word));
        let is_facet = next_is(b"facet");
        is_facet && next_is(b"normal") || line.trim_ascii_start().starts_with(b"endsolid")
    })
}
