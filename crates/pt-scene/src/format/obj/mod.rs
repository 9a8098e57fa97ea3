//! Wavefront object files (OBJ): polygons with normals and texture coordinates of their own
//! indices. [Wavefront Technologies, "Object Files (.obj)", Advanced Visualizer manual, app. B1] Vertices
//! may have colours of sRGB, `v x y z r g b`, as several modelling tools write them.
//!
//! A file becomes one mesh, whatever its groups and objects are, with a slot for each material that its faces
//! have. Lines, points and free-form surfaces are passed over.

mod chunk;
mod faces;
mod library;
mod map;
mod material;
mod mtl;
mod notes;
mod slots;

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use super::context::{Context, Folder};
use super::mesh_file::{self, ColorLevels, MeshFile};
use super::xml::quote;
use crate::shapes::single_part;
use crate::spelling::alike;
use crate::{Attribute, LoadError, Mesh, Scene, Warning};
use chunk::{Chunk, Points, side_by_side};
use faces::{Faces, Indices};
use library::Library;
use material::Maker;
use notes::Notes;
use slots::Named;

/// Pieces of the file that are read before what they hold is put together.
const CHUNKS: usize = 64;

/// Most materials that are not found, of which each has a note.
const MOST_NOT_FOUND: usize = 20;

/// A scene of one object.
pub(super) fn parse(bytes: &[u8], path: &Path, context: &Arc<Context>) -> Result<Scene, LoadError> {
    let mut content = Content::read(bytes, path)?;
    let slots = std::mem::take(&mut content.faces.slots);
    let libraries = std::mem::take(&mut content.faces.libraries);
    let (parts, slots) = slots.finish(content.faces.triangles.len());
    let mut file = content.finish(path)?;
    file.mesh.parts = parts;
    let has_colors = file.mesh.colors.is_some();
    let has_coordinates = file.mesh.uvs.is_some();
    let mut scene = file.into_scene(path);
    let folder = Folder { path: mesh_file::folder_of(path), context: Arc::clone(context) };
    let mut notes = Notes::default();
    let shows_images = dress(&mut scene, &slots, &libraries, &folder, path, &mut notes)?;
    let whole = mesh_file::place(path, 0);
    if shows_images && !has_coordinates {
        let message = "materials show images, but the faces have no texture coordinates (\"f 1/1 2/2 3/3\"); each triangle shows half of the image";
        notes.add(whole.clone(), message.to_owned());
    }
    if has_colors
        && scene.objects[0].materials.iter().any(|material| material.is_some_and(|m| m > 0))
    {
        let message = "the colours of vertices are seen only where faces have no material";
        notes.add(whole.clone(), message.to_owned());
    }
    scene.warnings.extend(notes.finish(whole));
    Ok(scene)
}

/// Gives the materials of the libraries to the slots of the one object, which has the default one: those without a name,
/// or with one that is not found, keep it. Says whether a material shows an image.
fn dress(
    scene: &mut Scene,
    slots: &[Option<Named>],
    libraries: &[Named],
    folder: &Folder,
    path: &Path,
    notes: &mut Notes,
) -> Result<bool, LoadError> {
    let wanted: HashSet<&str> = slots.iter().flatten().map(|named| named.name.as_str()).collect();
    let mut library = Library::default();
    for named in libraries {
        library.read(named, &wanted, folder, path, notes)?;
    }
    let default = scene.objects[0].materials.first().copied().flatten();
    let mut materials = vec![default; slots.len()];
    let mut not_found = Vec::new();
    let mut maker = Maker::new(folder, notes);
    for (named, slot) in slots.iter().zip(&mut materials) {
        let Some(named) = named.as_ref().filter(|named| !named.name.is_empty()) else { continue };
        let material = match library.described.get(&named.name) {
            Some(described) => maker.material(&named.name, described)?,
            None if library.is_incomplete => material::missing(&named.name),
            None => {
                not_found.push(named);
                continue;
            }
        };
        *slot = Some(scene.materials.len() as u32);
        scene.materials.push(material);
    }
    let shows_images = maker.shows_images;
    scene.objects[0].materials = materials;
    if libraries.is_empty() && !not_found.is_empty() {
        let message =
            "no \"mtllib\" names a file of materials; the default material is taken for all";
        notes.add(mesh_file::place(path, not_found[0].line), message.to_owned());
        return Ok(shows_images);
    }
    for named in not_found.iter().take(MOST_NOT_FOUND) {
        notes.add(
            mesh_file::place(path, named.line),
            not_found_message(&named.name, &library.names),
        );
    }
    if let Some(next) = not_found.get(MOST_NOT_FOUND) {
        let message = format!("{} more materials are in no file", not_found.len() - MOST_NOT_FOUND);
        notes.add(mesh_file::place(path, next.line), message);
    }
    Ok(shows_images)
}

fn not_found_message(name: &str, names: &[String]) -> String {
    let near = alike(name, names.iter().map(String::as_str));
    let hint =
        near.first().map_or(String::new(), |near| format!(" (did you mean {}?)", quote(near)));
    format!("the material {} is in no file{hint}; the default material is taken", quote(name))
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
        let Self { mut points, faces } = self;
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
        let (mut normals, mut uvs) = (faces.normals, faces.uvs);
        if !normals.of.is_empty() && normals.missing > 0 {
            let message = "some corners have no normals; those of others are left out".to_owned();
            warnings.push(Warning { at: mesh_file::place(path, 0), message });
            normals = Indices::default();
        }
        if !uvs.of.is_empty() && uvs.missing > 0 {
            let message = "some corners have no texture coordinates; they lie at 0 0".to_owned();
            warnings.push(Warning { at: mesh_file::place(path, 0), message });
            uvs.replace_missing(points.uvs.len() as u32);
            points.uvs.push([0.0; 2]);
        }
        let given = |indices: Indices| Some(indices.of).filter(|of| !of.is_empty());
        let count = positions.len();
        let normals =
            given(normals).map(|of| mesh_file::attribute(points.normals, of, count, &triangles));
        let uvs = given(uvs).map(|of| mesh_file::attribute(points.uvs, of, count, &triangles));
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
