//! Wavefront object files (OBJ): polygons with normals and texture coordinates of their own
//! indices. [Wavefront Technologies, "Object Files (.obj)", Advanced Visualizer manual, app. B1] Vertices
//! may have colours of sRGB, `v x y z r g b`, as several modelling tools write them.
//!
//! A file becomes one mesh, whatever its groups are. Lines, points and free-form surfaces are
//! passed over, and so are materials.

mod chunk;
mod faces;

use std::path::Path;

use super::mesh_file::{self, ColorLevels, MeshFile};
use super::xml::quote;
use crate::shapes::single_part;
use crate::{Attribute, LoadError, Mesh, Scene, Warning};
use chunk::{Chunk, Points, side_by_side};
use faces::{Faces, Indices};

/// Pieces of the file that are read before what they hold is put together.
const CHUNKS: usize = 64;

/// A scene of one object.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    let mut content = Content::read(bytes, path)?;
    let first = content.faces.materials_at.take();
    let mut scene = content.finish(path)?.into_scene(path);
    scene.warnings.extend(first.map(|at| Warning {
        at,
        message: "materials of OBJ files are not read yet; the default material is used".to_owned(),
    }));
    Ok(scene)
}

/// The mesh of a file.
///
/// # Errors
/// If a vertex or a face cannot be understood, or there is no face.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
    Content::read(bytes, path)?.finish(path)
}

/// What a file holds.
#[derive(Default)]
struct Content {
    points: Points,
    faces: Faces,
}

impl Content {
    fn read(bytes: &[u8], path: &Path) -> Result<Self, LoadError> {
        let chunks = chunk::cut(bytes, path);
        let mut content = Self::default();
        let points = each(&chunks, Chunk::points, |points| content.points.append(points));
        let Points { positions, .. } = &content.points;
        // Faces may be wrong above the first vertex that is.
        let until = points.as_ref().map_or_else(|(chunk, _)| *chunk + 1, |()| chunks.len());
        let faces = each(
            &chunks[..until],
            |chunk| Faces::read(chunk, positions),
            |faces| content.faces.append(faces),
        );
        match (points, faces) {
            (Ok(()), Ok(())) => {}
            (Err((_, error)), Ok(())) | (Ok(()), Err((_, error))) => return Err(error),
            (Err((_, a)), Err((_, b))) => return Err(if line(&b) < line(&a) { b } else { a }),
        }
        if u32::try_from(content.faces.triangles.len()).is_err() {
            let message = "the file has more than 4294967295 triangles";
            return Err(mesh_file::error(path, 0, message));
        }
        Ok(content)
    }

    fn finish(self, path: &Path) -> Result<MeshFile, LoadError> {
        let Self { points, faces } = self;
        let triangles = faces.triangles;
        if triangles.is_empty() {
            return Err(mesh_file::error(path, 0, "the file has no faces (\"f 1 2 3\")"));
        }
        let mut warnings = Vec::new();
        warnings.extend(faces.unknown.map(|(word, at)| Warning {
            at,
            message: format!("statements like {} are passed over", quote(&word)),
        }));
        let positions = points.positions;
        let has_colors = points.colors.len() == positions.len();
        if !has_colors && !points.colors.is_empty() {
            let message = "some vertices have no colours; those of others are left out".to_owned();
            warnings.push(Warning { at: mesh_file::place(path, 0), message });
        }
        let mut of_all = |what: &str, indices: Indices| {
            if !indices.of.is_empty() && indices.missing > 0 {
                let message = format!("some corners have no {what}; those of others are left out");
                warnings.push(Warning { at: mesh_file::place(path, 0), message });
            }
            Some(indices.of).filter(|of| !of.is_empty() && indices.missing == 0)
        };
        let (normals, uvs) =
            (of_all("normals", faces.normals), of_all("texture coordinates", faces.uvs));
        let count = positions.len();
        let normals = normals.map(|of| mesh_file::attribute(points.normals, of, count, &triangles));
        let uvs = uvs.map(|of| mesh_file::attribute(points.uvs, of, count, &triangles));
        let mesh = Mesh {
            name: mesh_file::name_of(path),
            parts: single_part(triangles.len()),
            positions,
            triangles,
            normals,
            uvs,
            colors: has_colors.then_some(Attribute { values: points.colors, indices: None }),
            face_colors: None,
        };
        Ok(MeshFile { mesh, levels: ColorLevels::default(), warnings })
    }
}

/// Reads all chunks, some at a time, and takes what they gave in the order of the file; the error comes
/// with the number of its chunk.
fn each<'a, P: Send>(
    chunks: &[Chunk<'a>],
    read: impl Fn(&Chunk<'a>) -> Result<P, LoadError> + Sync + Send,
    mut take: impl FnMut(P),
) -> Result<(), (usize, LoadError)> {
    for (batch, some) in chunks.chunks(CHUNKS).enumerate() {
        for (i, part) in side_by_side(some, &read).into_iter().enumerate() {
            take(part.map_err(|error| (CHUNKS * batch + i, error))?);
        }
    }
    Ok(())
}

/// The line of an error about the content of a file.
fn line(error: &LoadError) -> u32 {
    match error {
        LoadError::Content { at, .. } => at.line,
        _ => 0,
    }
}
