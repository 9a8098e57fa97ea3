//! Serialized meshes of Mitsuba (`.serialized`). [Jakob et al. 2022, documentation of Mitsuba 3.9,
//! "Serialized mesh loader"; version 3 of the format is that of Mitsuba 0.x]
//!
//! ```text
//! identifier, version │ zlib: flags, name, counts, positions, normals, uvs, colours, triangles
//! identifier, version │ zlib: …
//! offset of each identifier, and their number
//! ```
//!
//! All numbers are little-endian. Version 3 has no names, and offsets of 32 bits instead of 64.

use std::io::{ErrorKind, Read};
use std::path::Path;

use flate2::read::ZlibDecoder;
use pt_scene::shapes::single_part;
use pt_scene::{Attribute, Attributes, Mesh};

use crate::LoadError;
use crate::shared::mesh_file;
use crate::shared::mesh_file::{ColorLevels, MeshFile};

const IDENTIFIER: u16 = 0x041C;
const HAS_NORMALS: u32 = 0x1;
const HAS_UVS: u32 = 0x2;
const HAS_COLORS: u32 = 0x8;
const IS_DOUBLE: u32 = 0x2000;
/// Maximum number of bytes of a mesh, as for images: a small file may claim more than fits into
/// memory.
const MAX_BYTES: u64 = 1 << 30;
/// Best compression of Deflate: 258 bytes in two bits.
const BEST_RATIO: u64 = 1032;
/// Maximum length of a name, in bytes.
const MAX_NAME: usize = 1000;

/// Reads the mesh with an index, from 0.
///
/// Colours and the flag for flat shading are ignored, as in Mitsuba.
///
/// # Errors
/// Returns an error if there is no such mesh, or it is truncated, damaged, claims more than its
/// bytes can hold, or refers to vertices that do not exist.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path, index: u32) -> Result<MeshFile, LoadError> {
    let error = |message: String| mesh_file::error(path, 0, message);
    let version = version_of(bytes).map_err(error)?;
    let start = start(bytes, version, index).map_err(error)?;
    let bytes = bytes.get(start..).unwrap_or_default();
    let version = version_of(bytes).map_err(error)?;
    let packed = bytes.get(4..).unwrap_or_default();
    let mut stream = Stream { rest: ZlibDecoder::new(packed), is_double: false };
    let mesh = stream.mesh(version, packed.len() as u64).map_err(error)?;
    let name = if mesh.name.is_empty() { mesh_file::name_of(path) } else { mesh.name };
    Ok(MeshFile {
        mesh: Mesh { name, ..mesh },
        levels: ColorLevels::default(),
        warnings: Vec::new(),
    })
}

/// Returns the version in a header.
fn version_of(bytes: &[u8]) -> Result<u16, String> {
    let Some(&[a, b, c, d]) = bytes.first_chunk() else {
        return Err("file too short for a serialized mesh".to_owned());
    };
    if u16::from_le_bytes([a, b]) != IDENTIFIER {
        return Err(
            "found no serialized mesh of Mitsuba, expected a file that begins with the bytes 1c 04"
                .to_owned(),
        );
    }
    match u16::from_le_bytes([c, d]) {
        version @ (3 | 4) => Ok(version),
        other => Err(format!("found mesh version {other}, expected 3 or 4")),
    }
}

/// Returns the offset of the header of a mesh. The first mesh does not need the list of offsets.
fn start(bytes: &[u8], version: u16, index: u32) -> Result<usize, String> {
    if index == 0 {
        return Ok(0);
    }
    let broken = || "damaged table of meshes at the end of the file".to_owned();
    let (places, count) = bytes.split_last_chunk().ok_or_else(broken)?;
    let count = u32::from_le_bytes(*count);
    if index >= count {
        return Err(format!("found no mesh {index}; the file has {count}, counted from 0"));
    }
    let from_end = (count - index) as usize;
    let place = match version {
        3 => places
            .rchunks_exact(4)
            .nth(from_end - 1)
            .and_then(|place| Some(u32::from_le_bytes(place.try_into().ok()?) as u64)),
        _ => places
            .rchunks_exact(8)
            .nth(from_end - 1)
            .and_then(|place| Some(u64::from_le_bytes(place.try_into().ok()?))),
    };
    let place = place.and_then(|place| usize::try_from(place).ok());
    place.filter(|place| *place < bytes.len()).ok_or_else(broken)
}

/// The compressed bytes of a mesh.
struct Stream<'a> {
    rest: ZlibDecoder<&'a [u8]>,
    is_double: bool,
}

impl Stream<'_> {
    fn mesh(&mut self, version: u16, packed: u64) -> Result<Mesh, String> {
        let flags = u32::from_le_bytes(self.take()?);
        let name = if version == 4 { self.name()? } else { String::new() };
        let vertices = u64::from_le_bytes(self.take()?);
        let triangles = u64::from_le_bytes(self.take()?);
        self.is_double = flags & IS_DOUBLE != 0;
        let has = |flag: u32| flags & flag != 0;
        let per_vertex = 3
            + 3 * u64::from(has(HAS_NORMALS))
            + 2 * u64::from(has(HAS_UVS))
            + 3 * u64::from(has(HAS_COLORS));
        check_counts([vertices, triangles], per_vertex * self.number_size() as u64, packed)?;
        let (vertices, triangles) = (vertices as usize, triangles as usize);
        let positions = self.numbers(vertices, "position")?;
        let normals = has(HAS_NORMALS).then(|| self.numbers(vertices, "normal")).transpose()?;
        let uvs = has(HAS_UVS).then(|| self.numbers(vertices, "texture coordinate")).transpose()?;
        if has(HAS_COLORS) {
            self.elements(vertices, 3 * self.number_size(), |_| {})?;
        }
        let triangles = self.triangles(triangles, vertices)?;
        let parts = single_part(triangles.len());
        let (normals, uvs) = (normals.map(at_vertices), uvs.map(at_vertices));
        Ok(Mesh {
            name,
            positions: positions.into(),
            triangles: triangles.into(),
            normals,
            uvs,
            colors: None,
            face_colors: None,
            attributes: Attributes::default(),
            submeshes: parts,
        })
    }

    /// Reads text up to a NUL.
    fn name(&mut self) -> Result<String, String> {
        let mut name = Vec::new();
        loop {
            match self.take()? {
                [0] => return Ok(String::from_utf8_lossy(&name).into_owned()),
                [_] if name.len() == MAX_NAME => {
                    return Err(format!("found a name longer than {MAX_NAME} bytes"));
                }
                [byte] => name.push(byte),
            }
        }
    }

    /// Returns the size in bytes of a floating-point number.
    fn number_size(&self) -> usize {
        if self.is_double { 8 } else { 4 }
    }

    /// Reads vectors of finite numbers.
    fn numbers<const N: usize>(
        &mut self,
        count: usize,
        what: &str,
    ) -> Result<Vec<[f32; N]>, String> {
        let (size, is_double) = (self.number_size(), self.is_double);
        let mut vectors: Vec<[f32; N]> = Vec::new();
        self.elements(count, N * size, |bytes| {
            vectors.push(std::array::from_fn(|i| match bytes[i * size..][..size] {
                [a, b, c, d, e, f, g, h] if is_double => {
                    f64::from_le_bytes([a, b, c, d, e, f, g, h]) as f32
                }
                [a, b, c, d, ..] => f32::from_le_bytes([a, b, c, d]),
                _ => f32::NAN,
            }));
        })?;
        match vectors.iter().position(|v| !v.iter().all(|x| x.is_finite())) {
            Some(bad) => Err(format!("found a {what} of vertex {bad} that is not finite")),
            None => Ok(vectors),
        }
    }

    fn triangles(&mut self, count: usize, vertices: usize) -> Result<Vec<[u32; 3]>, String> {
        let mut triangles = Vec::new();
        self.elements(count, 12, |bytes| {
            let (corners, _) = bytes.as_chunks::<4>();
            triangles.push([0, 1, 2].map(|i: usize| u32::from_le_bytes(corners[i])));
        })?;
        let is_bad = |corners: &[u32; 3]| corners.iter().any(|c| *c as usize >= vertices);
        match triangles.iter().position(is_bad) {
            Some(bad) => {
                let corners = triangles[bad];
                Err(format!(
                    "found the corners {corners:?} of triangle {bad}, expected indices of the \
                     {vertices} vertices"
                ))
            }
            None => Ok(triangles),
        }
    }

    /// Reads elements of equal size in pieces, so that memory grows only with the existing data.
    fn elements(
        &mut self,
        count: usize,
        size: usize,
        mut each: impl FnMut(&[u8]),
    ) -> Result<(), String> {
        const PIECE: usize = 4096;
        let mut piece = vec![0; size * PIECE];
        let mut left = count;
        while left > 0 {
            let bytes = &mut piece[..size * left.min(PIECE)];
            self.rest.read_exact(bytes).map_err(|e| explain(&e))?;
            bytes.chunks_exact(size).for_each(&mut each);
            left -= left.min(PIECE);
        }
        Ok(())
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        self.rest.read_exact(&mut bytes).map_err(|e| explain(&e))?;
        Ok(bytes)
    }
}

/// Creates an attribute with one value per vertex.
fn at_vertices<T>(values: Vec<T>) -> Attribute<T> {
    Attribute { values: values.into(), indices: None }
}

/// Rejects empty meshes, and counts that this number of compressed bytes cannot hold.
fn check_counts(
    [vertices, triangles]: [u64; 2],
    bytes_per_vertex: u64,
    packed: u64,
) -> Result<(), String> {
    let says = format!("the mesh header declares {vertices} vertices and {triangles} triangles");
    if vertices == 0 || triangles == 0 {
        return Err(format!("{says}, expected at least one of each"));
    }
    let bytes = vertices.checked_mul(bytes_per_vertex);
    let bytes = bytes.and_then(|b| b.checked_add(triangles.checked_mul(12)?)).unwrap_or(u64::MAX);
    if bytes > MAX_BYTES {
        return Err(format!("{says}, which exceed 1 GiB; split the mesh"));
    }
    if bytes / BEST_RATIO > packed {
        return Err(format!("{says}, but only {packed} bytes follow"));
    }
    pt_memory::ask(bytes).map(drop)
}

/// Describes an error of decompression.
fn explain(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::UnexpectedEof => {
            "unexpected end of the file within the mesh; it may be incomplete".to_owned()
        }
        _ => format!("damaged compressed data of the mesh: {error}"),
    }
}
