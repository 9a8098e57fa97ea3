//! Wavefront object files (OBJ): polygons with normals and texture coordinates of their own
//! indices. [Wavefront Technologies, "Object Files (.obj)", Advanced Visualizer manual, app. B1] Vertices
//! may have colours of sRGB, `v x y z r g b`, as several modelling tools write them.
//!
//! A file becomes one mesh, whatever its groups and objects are, with a slot for each material that its faces
//! have. Lines, points and free-form surfaces are passed over.

mod chunk;
mod dress;
mod faces;
mod library;
mod map;
mod material;
mod mtl;
mod notes;
mod slots;
mod smooth;

use std::path::Path;
use std::sync::Arc;

use super::context::{Context, Folder};
use super::faults::{self, Faults};
use super::mesh_file::{self, ColorLevels, MeshFile};
use super::text;
use super::xml::quote;
use crate::shapes::single_part;
use crate::{Attribute, Attributes, LoadError, Mesh, Scene, Warning};
use chunk::{Chunk, Points, side_by_side};
use dress::Wardrobe;
use faces::{Faces, Indices};

/// Pieces of the file that are read before what they hold is put together.
const CHUNKS: usize = 64;

/// A scene of one object.
pub(super) fn parse(bytes: &[u8], path: &Path, context: &Arc<Context>) -> Result<Scene, LoadError> {
    let read = |faults: &mut Faults| {
        let mut content = Content::read(bytes, path, faults)?;
        let slots = std::mem::take(&mut content.faces.slots);
        let libraries = std::mem::take(&mut content.faces.libraries);
        let groups = std::mem::take(&mut content.faces.groups);
        let named = slots.finish(content.faces.triangles.len());
        let mut file = content.finish(path, faults)?;
        if file.mesh.normals.is_none() {
            file.mesh.normals = groups.normals(&file.mesh);
        }
        Ok((file, named, libraries))
    };
    let (mut file, (parts, slots), libraries) = faults::of_scene(context, read)?;
    file.mesh.parts = parts;
    let mut scene = file.into_scene(path);
    let folder = &Folder { path: mesh_file::folder_of(path), context: Arc::clone(context) };
    Wardrobe { path, slots, libraries, folder }.dress(&mut scene)?;
    Ok(scene)
}

/// The mesh of a file.
///
/// # Errors
/// If a vertex or a face cannot be understood, or there is no face.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
    faults::of_part(|faults| Content::read(bytes, path, faults)?.finish(path, faults))
}

/// What a file holds.
#[derive(Default)]
struct Content {
    points: Points,
    faces: Faces,
}

impl Content {
    /// Reads all vertices, with zeros for those that are wrong, and all faces that are not.
    fn read(bytes: &[u8], path: &Path, faults: &mut Faults) -> Result<Self, LoadError> {
        let text = text::joined_lines(bytes, path)?;
        let chunks = chunk::cut(&text, path);
        let all =
            chunks.last().map_or([0; 3], |last| [0, 1, 2].map(|i| last.above[i] + last.own[i]));
        let mut content = Self {
            points: Points::with_capacity(all),
            faces: Faces::with_capacity(chunks.iter().map(|chunk| chunk.faces).sum()),
        };
        let until = each(&chunks, faults, Chunk::points, |points| content.points.append(points));
        let Points { positions, .. } = &content.points;
        let mut of_faces = Faults::default();
        each(
            &chunks[..until],
            &mut of_faces,
            |chunk, faults| Faces::read(chunk, positions, faults),
            |faces| content.faces.append(faces),
        );
        faults.merge(of_faces);
        if faults.is_full() {
            return Err(LoadError::Told);
        }
        if u32::try_from(content.faces.triangles.len()).is_err() {
            let message = "the file has more than 4294967295 triangles";
            return Err(mesh_file::error(path, 0, message));
        }
        Ok(content)
    }

    fn finish(self, path: &Path, faults: &Faults) -> Result<MeshFile, LoadError> {
        let Self { mut points, faces } = self;
        let triangles = faces.triangles;
        if triangles.is_empty() {
            let message = "the file has no faces (\"f 1 2 3\")";
            return Err(faults.because_of(mesh_file::error(path, 0, message)));
        }
        let mut warnings = Vec::new();
        warnings.extend(faces.unknown.into_iter().map(|(word, at)| Warning {
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
            attributes: Attributes::default(),
        };
        Ok(MeshFile { mesh, levels: ColorLevels::default(), warnings })
    }
}

/// Reads chunks, some at a time, and takes what they gave in the order of the file, until there are too many faults; tells
/// how many chunks were read.
fn each<'a, P: Send>(
    chunks: &[Chunk<'a>],
    faults: &mut Faults,
    read: impl Fn(&Chunk<'a>, &mut Faults) -> P + Sync + Send,
    mut take: impl FnMut(P),
) -> usize {
    let mut done = 0;
    for some in chunks.chunks(CHUNKS) {
        let noting = |chunk: &Chunk<'a>| {
            let mut faults = Faults::default();
            (read(chunk, &mut faults), faults)
        };
        for (part, more) in side_by_side(some, noting) {
            take(part);
            faults.append(more);
        }
        done += some.len();
        if faults.is_full() {
            break;
        }
    }
    done
}
