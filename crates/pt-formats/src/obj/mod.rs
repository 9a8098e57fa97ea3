//! Wavefront object files (OBJ): polygons with normals and texture coordinates of their own
//! indices. [Wavefront Technologies, "Object Files (.obj)", Advanced Visualizer manual, app. B1]
//! Vertices may have colours of sRGB, `v x y z r g b`, as several modelling tools write them.
//!
//! A file becomes one mesh, whatever its groups and objects are, with a slot for each material that
//! its faces have; and points and lines, of each material that they have. Without faces, points and
//! lines, all vertices are points. Free-form surfaces are passed over.

mod assign_materials;
mod chunk;
mod faces;
mod library;
mod map;
mod material;
mod mtl;
mod notes;
mod slots;
mod smooth;
mod strokes;

use std::path::Path;
use std::sync::Arc;

use super::context::{Context, Folder};
use super::mesh_diagnostics::{self, MeshDiagnostics};
use super::mesh_file::{self, ColorLevels, MeshFile};
use super::text;
use super::xml::quote;
use crate::shapes::single_part;
use crate::{Attribute, Attributes, LoadError, Mesh, Points, Scene, Warning};
use assign_materials::MaterialAssigner;
use chunk::{Chunk, Vertices, side_by_side};
use faces::{Faces, Indices};
use slots::Named;

/// Pieces of the file that are read before what they hold is put together.
const CHUNKS: usize = 64;

/// The content of a file that is a scene.
struct Parsed {
    /// Its faces, if there are some.
    file: Option<MeshFile>,
    /// The materials of the slots of the faces.
    slots: Vec<Option<Named>>,
    /// Points and lines, and the material of each; without faces and any of these, all vertices.
    clouds: Vec<(Points, Option<Named>)>,
    libraries: Vec<Named>,
    warnings: Vec<Warning>,
}

/// A scene of one object for all faces, and one for the points and lines of each material.
pub(super) fn parse(bytes: &[u8], path: &Path, context: &Arc<Context>) -> Result<Scene, LoadError> {
    let read =
        |faults: &mut MeshDiagnostics| Content::read(bytes, path, faults)?.parsed(path, faults);
    let Parsed { file, mut slots, clouds, libraries, warnings } =
        mesh_diagnostics::of_scene(context, read)?;
    let mut scene = file.map_or_else(Scene::default, |file| file.into_scene(path));
    scene.warnings.extend(warnings);
    let of_mesh = slots.len();
    for (mut points, named) in clouds {
        points.name = mesh_file::name_of(path);
        mesh_file::add_points(&mut scene, points, path);
        slots.push(named);
    }
    let folder = &Folder { path: mesh_file::folder_of(path), context: Arc::clone(context) };
    MaterialAssigner { path, slots, of_mesh, libraries, folder }.assign(&mut scene)?;
    Ok(scene)
}

/// The points and lines of a file; without any, all its vertices.
///
/// # Errors
/// If a vertex or a line cannot be understood, or there is no vertex.
pub(super) fn parse_points(bytes: &[u8], path: &Path) -> Result<Points, LoadError> {
    let read = |faults: &mut MeshDiagnostics| {
        let mut content = Content::read(bytes, path, faults)?;
        let mut all = Points { name: mesh_file::name_of(path), ..Points::default() };
        all.segments = std::mem::take(&mut content.faces.strokes).into_segments();
        (all.positions, all.colors) = content.vertices.into_cloud();
        if all.positions.is_empty() {
            let message = "the file has no vertices (\"v 1 2 3\")";
            return Err(faults.because_of(mesh_file::error(path, 0, message)));
        }
        Ok(all)
    };
    mesh_diagnostics::of_part(read)
}

/// The mesh of a file.
///
/// # Errors
/// If a vertex or a face cannot be understood, or there is no face.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
    mesh_diagnostics::of_part(|faults| Content::read(bytes, path, faults)?.finish(path, faults))
}

/// What a file holds.
#[derive(Default)]
struct Content {
    vertices: Vertices,
    faces: Faces,
}

impl Content {
    /// Reads all vertices, with zeros for those that are wrong, and all faces that are not.
    fn read(bytes: &[u8], path: &Path, faults: &mut MeshDiagnostics) -> Result<Self, LoadError> {
        let text = text::joined_lines(bytes, path)?;
        let chunks = chunk::cut(&text, path);
        let all =
            chunks.last().map_or([0; 3], |last| [0, 1, 2].map(|i| last.above[i] + last.own[i]));
        let mut content = Self {
            vertices: Vertices::with_capacity(all),
            faces: Faces::with_capacity(chunks.iter().map(|chunk| chunk.faces).sum()),
        };
        let until =
            each(&chunks, faults, Chunk::vertices, |vertices| content.vertices.append(vertices));
        let Vertices { positions, .. } = &content.vertices;
        let mut of_faces = MeshDiagnostics::default();
        each(
            &chunks[..until],
            &mut of_faces,
            |chunk, faults| Faces::read(chunk, positions, faults),
            |faces| content.faces.append(faces),
        );
        faults.merge(of_faces);
        if faults.is_full() {
            return Err(LoadError::AlreadyReported);
        }
        if u32::try_from(content.faces.triangles.len()).is_err() {
            let message = "the file has more than 4294967295 triangles";
            return Err(mesh_file::error(path, 0, message));
        }
        Ok(content)
    }

    /// All that there is.
    fn parsed(mut self, path: &Path, faults: &MeshDiagnostics) -> Result<Parsed, LoadError> {
        let faces = &mut self.faces;
        let (slots, groups) = (std::mem::take(&mut faces.slots), std::mem::take(&mut faces.groups));
        let libraries = std::mem::take(&mut faces.libraries);
        let strokes = std::mem::take(&mut faces.strokes);
        let (parts, slots) = slots.finish(faces.triangles.len());
        let Vertices { positions, colors, .. } = &self.vertices;
        let has_colors = !colors.is_empty() && colors.len() == positions.len();
        let mut clouds = strokes.finish(positions, has_colors.then_some(colors.as_slice()));
        if !faces.triangles.is_empty() {
            let mut file = self.finish(path, faults)?;
            if file.mesh.normals.is_none() {
                file.mesh.normals = groups.normals(&file.mesh);
            }
            file.mesh.submeshes = parts;
            return Ok(Parsed { file: Some(file), slots, clouds, libraries, warnings: Vec::new() });
        }
        if !faults.is_empty() || self.vertices.positions.is_empty() {
            return Err(without_faces(path, faults));
        }
        let warnings = self.warnings(path);
        if clouds.is_empty() {
            let (positions, colors) = self.vertices.into_cloud();
            clouds.push((Points { positions, colors, ..Points::default() }, None));
        }
        Ok(Parsed { file: None, slots, clouds, libraries, warnings })
    }

    /// Notes about statements and colours that are not read.
    fn warnings(&self, path: &Path) -> Vec<Warning> {
        let unknown = self.faces.unknown.iter().map(|(word, at)| Warning {
            at: at.clone(),
            message: format!("statements like {} are passed over", quote(word)),
        });
        let mut warnings: Vec<_> = unknown.collect();
        let Vertices { positions, colors, .. } = &self.vertices;
        if !colors.is_empty() && colors.len() != positions.len() {
            let message = "some vertices have no colours; those of others are left out".to_owned();
            warnings.push(Warning { at: mesh_file::place(path, 0), message });
        }
        warnings
    }

    fn finish(self, path: &Path, faults: &MeshDiagnostics) -> Result<MeshFile, LoadError> {
        if self.faces.triangles.is_empty() {
            return Err(without_faces(path, faults));
        }
        let mut warnings = self.warnings(path);
        let Self { mut vertices, faces } = self;
        let triangles = faces.triangles;
        let positions = vertices.positions;
        let has_colors = vertices.colors.len() == positions.len();
        let (mut normals, mut uvs) = (faces.normals, faces.uvs);
        if !normals.of.is_empty() && normals.missing > 0 {
            let message = "some corners have no normals; those of others are left out".to_owned();
            warnings.push(Warning { at: mesh_file::place(path, 0), message });
            normals = Indices::default();
        }
        if !uvs.of.is_empty() && uvs.missing > 0 {
            let message = "some corners have no texture coordinates; they lie at 0 0".to_owned();
            warnings.push(Warning { at: mesh_file::place(path, 0), message });
            uvs.replace_missing(vertices.uvs.len() as u32);
            vertices.uvs.push([0.0; 2]);
        }
        let given = |indices: Indices| Some(indices.of).filter(|of| !of.is_empty());
        let count = positions.len();
        let normals =
            given(normals).map(|of| mesh_file::attribute(vertices.normals, of, count, &triangles));
        let uvs = given(uvs).map(|of| mesh_file::attribute(vertices.uvs, of, count, &triangles));
        let mesh = Mesh {
            name: mesh_file::name_of(path),
            submeshes: single_part(triangles.len()),
            positions,
            triangles,
            normals,
            uvs,
            colors: has_colors.then_some(Attribute { values: vertices.colors, indices: None }),
            face_colors: None,
            attributes: Attributes::default(),
        };
        Ok(MeshFile { mesh, levels: ColorLevels::default(), warnings })
    }
}

/// The error about a file without faces, unless earlier ones may be the reason.
fn without_faces(path: &Path, faults: &MeshDiagnostics) -> LoadError {
    faults.because_of(mesh_file::error(path, 0, "the file has no faces (\"f 1 2 3\")"))
}

/// Reads chunks, some at a time, and takes what they gave in the order of the file, until there are
/// too many faults; tells how many chunks were read.
fn each<'a, P: Send>(
    chunks: &[Chunk<'a>],
    faults: &mut MeshDiagnostics,
    read: impl Fn(&Chunk<'a>, &mut MeshDiagnostics) -> P + Sync + Send,
    mut take: impl FnMut(P),
) -> usize {
    let mut done = 0;
    for some in chunks.chunks(CHUNKS) {
        let noting = |chunk: &Chunk<'a>| {
            let mut faults = MeshDiagnostics::default();
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
