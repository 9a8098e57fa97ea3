//! Wavefront object files (OBJ): polygons with separate indices for normals and texture
//! coordinates. [Wavefront Technologies, "Object Files (.obj)", Advanced Visualizer manual, app.
//! B1] Vertices may have sRGB colours, `v x y z r g b`, as several modelling tools write them.
//!
//! A file becomes one mesh, whatever its groups and objects are, with a slot for each material of
//! its faces; and one object of points and lines for each material of these. Without faces, points
//! and lines, all vertices are points. Free-form surfaces are ignored.

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

use assign_materials::MaterialAssigner;
use chunk::{LineChunk, ObjVertices, side_by_side};
use faces::{Indices, ObjFaces};
use pt_scene::shapes::single_part;
use pt_scene::{Attribute, Attributes, Mesh, Points, Scene, Warning};
use slots::LocatedName;

use crate::LoadError;
use crate::shared::context::{Folder, LoadContext};
use crate::shared::mesh_diagnostics::MeshDiagnostics;
use crate::shared::mesh_file::{ColorLevels, MeshFile};
use crate::shared::names::quote;
use crate::shared::{mesh_diagnostics, mesh_file, text};

/// Number of pieces of the file that are read before their contents are merged.
const CHUNKS: usize = 64;

/// Content of a file that is a scene.
struct Parsed {
    /// Mesh of the faces; `None` without faces.
    file: Option<MeshFile>,
    /// Materials of the slots of the faces.
    slots: Vec<Option<LocatedName>>,
    /// Points and lines, with the material of each; without faces and any of these, all vertices.
    clouds: Vec<(Points, Option<LocatedName>)>,
    libraries: Vec<LocatedName>,
    warnings: Vec<Warning>,
}

/// Reads a scene: one object for all faces, and one for the points and lines of each material.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    let read =
        |faults: &mut MeshDiagnostics| ObjContent::read(bytes, path, faults)?.parsed(path, faults);
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

/// Reads the points and lines of a file; without any, all its vertices.
///
/// # Errors
/// Returns an error if a vertex or a line is invalid, or there is no vertex.
pub(super) fn parse_points(bytes: &[u8], path: &Path) -> Result<Points, LoadError> {
    let read = |faults: &mut MeshDiagnostics| {
        let mut content = ObjContent::read(bytes, path, faults)?;
        let mut all = Points { name: mesh_file::name_of(path), ..Points::default() };
        all.segments = std::mem::take(&mut content.faces.strokes).into_segments();
        (all.positions, all.colors) = content.vertices.into_cloud();
        if all.positions.is_empty() {
            let message = "file without vertices (\"v 1 2 3\")";
            return Err(faults.because_of(mesh_file::error(path, 0, message)));
        }
        Ok(all)
    };
    mesh_diagnostics::of_part(read)
}

/// Reads the mesh of a file.
///
/// # Errors
/// Returns an error if a vertex or a face is invalid, or there is no face.
pub(super) fn parse_mesh(bytes: &[u8], path: &Path) -> Result<MeshFile, LoadError> {
    mesh_diagnostics::of_part(|faults| ObjContent::read(bytes, path, faults)?.finish(path, faults))
}

/// Vertices and faces of a file.
#[derive(Default)]
struct ObjContent {
    vertices: ObjVertices,
    faces: ObjFaces,
}

impl ObjContent {
    /// Reads all vertices, with zeros in place of invalid ones, and all valid faces.
    fn read(bytes: &[u8], path: &Path, faults: &mut MeshDiagnostics) -> Result<Self, LoadError> {
        let text = text::joined_lines(bytes, path)?;
        let chunks = chunk::cut(&text, path);
        let all =
            chunks.last().map_or([0; 3], |last| [0, 1, 2].map(|i| last.above[i] + last.own[i]));
        let mut content = Self {
            vertices: ObjVertices::with_capacity(all),
            faces: ObjFaces::with_capacity(chunks.iter().map(|chunk| chunk.faces).sum()),
        };
        let until = each(&chunks, faults, LineChunk::vertices, |vertices| {
            content.vertices.append(vertices);
        });
        let ObjVertices { positions, .. } = &content.vertices;
        let mut of_faces = MeshDiagnostics::default();
        each(
            &chunks[..until],
            &mut of_faces,
            |chunk, faults| ObjFaces::read(chunk, positions, faults),
            |faces| content.faces.append(faces),
        );
        faults.merge(of_faces);
        if faults.is_full() {
            return Err(LoadError::AlreadyReported);
        }
        if u32::try_from(content.faces.triangles.len()).is_err() {
            let message = "more than 4294967295 triangles";
            return Err(mesh_file::error(path, 0, message));
        }
        Ok(content)
    }

    /// Converts the content to meshes, points and materials.
    fn parsed(mut self, path: &Path, faults: &MeshDiagnostics) -> Result<Parsed, LoadError> {
        let faces = &mut self.faces;
        let (slots, groups) = (std::mem::take(&mut faces.slots), std::mem::take(&mut faces.groups));
        let libraries = std::mem::take(&mut faces.libraries);
        let strokes = std::mem::take(&mut faces.strokes);
        let (parts, slots) = slots.finish(faces.triangles.len());
        let ObjVertices { positions, colors, .. } = &self.vertices;
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

    /// Returns warnings about statements and colours that are ignored.
    fn warnings(&self, path: &Path) -> Vec<Warning> {
        let unknown = self.faces.unknown.iter().map(|(word, at)| Warning {
            at: at.clone(),
            message: format!("unsupported statement {}; such statements are ignored", quote(word)),
        });
        let mut warnings: Vec<_> = unknown.collect();
        let ObjVertices { positions, colors, .. } = &self.vertices;
        if !colors.is_empty() && colors.len() != positions.len() {
            let message =
                "some vertices have no colours; the colours of the others are ignored".to_owned();
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
            let message =
                "some corners have no normals; the normals of the others are ignored".to_owned();
            warnings.push(Warning { at: mesh_file::place(path, 0), message });
            normals = Indices::default();
        }
        if !uvs.of.is_empty() && uvs.missing > 0 {
            let message = "some corners have no texture coordinates; 0 0 is used".to_owned();
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
            positions: positions.into(),
            triangles: triangles.into(),
            normals,
            uvs,
            colors: has_colors
                .then_some(Attribute { values: vertices.colors.into(), indices: None }),
            face_colors: None,
            attributes: Attributes::default(),
        };
        Ok(MeshFile { mesh, levels: ColorLevels::default(), warnings })
    }
}

/// Returns the error about a file without faces, unless earlier errors may be the cause.
fn without_faces(path: &Path, faults: &MeshDiagnostics) -> LoadError {
    faults.because_of(mesh_file::error(
        path,
        0,
        "found no faces, expected at least one, such as \"f 1 2 3\"",
    ))
}

/// Reads chunks, several at a time, and passes the results to `take` in file order, until there are
/// too many errors. Returns the number of chunks read.
fn each<'a, P: Send>(
    chunks: &[LineChunk<'a>],
    faults: &mut MeshDiagnostics,
    read: impl Fn(&LineChunk<'a>, &mut MeshDiagnostics) -> P + Sync + Send,
    mut take: impl FnMut(P),
) -> usize {
    let mut done = 0;
    for some in chunks.chunks(CHUNKS) {
        let noting = |chunk: &LineChunk<'a>| {
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
