//! Components shared by the mesh formats: resolution of file names, and scenes of one mesh.

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub(crate) use pt_io::folder_of;
use pt_math::color::linear_from_srgb;
use pt_math::{DAffine3, DVec3};
use pt_scene::material::Diffuse;
use pt_scene::texture::{Input, Pattern, Texture};
use pt_scene::{Attribute, Geometry, Material, Mesh, Object, Points, Scene, Span, Warning};

use super::triangulate::Triangulator;
use crate::LoadError;

/// A mesh, with warnings about its file.
#[derive(Debug)]
pub(crate) struct MeshFile {
    /// The mesh; integer colours are divided by their maximum.
    pub(crate) mesh: Mesh,
    pub(crate) levels: ColorLevels,
    pub(crate) warnings: Vec<Warning>,
}

/// Maximum value of a colour channel in the file: 1 for real numbers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ColorLevels {
    pub(crate) vertices: f32,
    pub(crate) faces: f32,
}

impl Default for ColorLevels {
    fn default() -> Self {
        Self { vertices: 1.0, faces: 1.0 }
    }
}

impl MeshFile {
    /// Creates a scene with the mesh as its only object, with its own colours or the default
    /// material. Integer colours are decoded as sRGB, as viewers of such files do.
    pub(crate) fn into_scene(self, path: &Path) -> Scene {
        let Self { mut mesh, levels, warnings } = self;
        levels.linearize(&mut mesh);
        let materials = Vec::from_iter(colored(&mesh));
        let object = Object {
            name: mesh.name.clone(),
            to_world: DAffine3::IDENTITY,
            motion: None,
            materials: vec![(!materials.is_empty()).then_some(0); mesh.submeshes.len()],
            geometry: Geometry::Mesh(Arc::new(mesh)),
            media: None,
            at: place(path, 0),
        };
        Scene {
            objects: vec![object].into(),
            materials: materials.into(),
            warnings,
            ..Scene::default()
        }
    }
}

impl ColorLevels {
    /// Converts integer colours of a mesh from sRGB to linear values.
    fn linearize(self, mesh: &mut Mesh) {
        map_colors(mesh, |channel, of_faces| {
            let levels = if of_faces { self.faces } else { self.vertices };
            if levels > 1.0 { linear_from_srgb(channel) } else { channel }
        });
    }
}

/// Points of a file without faces, with warnings about the file.
#[derive(Debug)]
pub(crate) struct PointsFile {
    pub(crate) points: Points,
    pub(crate) warnings: Vec<Warning>,
}

impl PointsFile {
    /// Creates points from the vertices of a mesh without triangles, and segments between them.
    /// Vertices that are not finite are removed.
    pub(crate) fn new(file: MeshFile, segments: Vec<[u32; 2]>, path: &Path) -> Self {
        let MeshFile { mut mesh, levels, mut warnings } = file;
        levels.linearize(&mut mesh);
        let Mesh { name, positions, colors, .. } = mesh;
        let colors = colors.map(|colors| colors.values.into_vec());
        let mut points = Points { name, positions: positions.into_vec(), colors, segments };
        let lost = points.drop_infinite();
        if lost > 0 {
            let message = format!("points with non-finite coordinates are omitted: {lost}");
            warnings.push(Warning { at: place(path, 0), message });
        }
        Self { points, warnings }
    }

    /// Creates a scene with the points as its only object, with their own colours or the default
    /// material.
    pub(crate) fn into_scene(self, path: &Path) -> Scene {
        let mut scene = Scene { warnings: self.warnings, ..Scene::default() };
        add_points(&mut scene, self.points, path);
        scene
    }
}

/// Adds points to a scene, with their own colours or the default material.
pub(crate) fn add_points(scene: &mut Scene, points: Points, path: &Path) {
    let has_colors = points.colors.is_some();
    let material = has_colors.then(|| {
        scene.materials.push(showing(&points.name, Pattern::VertexColors));
        scene.materials.len() as u32 - 1
    });
    scene.objects.push(Object {
        name: points.name.clone(),
        to_world: DAffine3::IDENTITY,
        motion: None,
        materials: vec![material],
        geometry: Geometry::Points { points: Arc::new(points), radius: None },
        media: None,
        at: place(path, 0),
    });
}

/// Maps each channel of the colours of a mesh; the second argument of `change` is true for face
/// colours.
pub(crate) fn map_colors(mesh: &mut Mesh, change: impl Fn(f32, bool) -> f32) {
    for color in mesh.colors.iter_mut().flat_map(|colors| &mut colors.values) {
        *color = color.map(|channel| change(channel, false));
    }
    for color in mesh.face_colors.iter_mut().flatten() {
        *color = color.map(|channel| change(channel, true));
    }
}

/// Returns the diffuse material with the colours of a mesh: those of its vertices, otherwise those
/// of its faces; `None` if there are none.
fn colored(mesh: &Mesh) -> Option<Material> {
    let pattern = match (&mesh.colors, &mesh.face_colors) {
        (Some(_), _) => Pattern::VertexColors,
        (None, Some(_)) => Pattern::FaceColors,
        (None, None) => return None,
    };
    Some(showing(&mesh.name, pattern))
}

/// Returns a diffuse material with a pattern of colours.
fn showing(name: &str, pattern: Pattern) -> Material {
    let reflectance = Input::Texture(Arc::new(Texture::from(pattern)));
    Material {
        name: name.to_owned(),
        surface: Diffuse { reflectance, two_sided: true }.into(),
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    }
}

/// Resolves a file name of a scene: as written, or with slashes in place of the backslashes of
/// Windows. An absolute path that does not exist is from another machine: its longest suffix that
/// exists in the folder is used, if there is one.
pub(crate) fn locate(folder: &Path, name: &str) -> PathBuf {
    let as_written = folder.join(name);
    if as_written.is_file() {
        return as_written;
    }
    let with_slashes = name.replace('\\', "/");
    let Some(below_root) = below_root(&with_slashes) else { return folder.join(with_slashes) };
    let deeper = below_root.match_indices('/').map(|(at, _)| &below_root[at + 1..]);
    let mut ends = std::iter::once(below_root).chain(deeper).map(|end| folder.join(end));
    ends.find(|path| path.is_file()).unwrap_or(as_written)
}

/// Returns the part of an absolute path after the root, which may have a drive letter.
fn below_root(path: &str) -> Option<&str> {
    let rest = path.strip_prefix('/').unwrap_or(path);
    match rest.as_bytes() {
        [letter, b':', b'/', ..] if letter.is_ascii_alphabetic() => Some(&rest[3..]),
        _ => path.strip_prefix('/'),
    }
}

/// Decodes percent-encoded text: `%20` is a space.
pub(crate) fn percent_decoded(url: &str) -> String {
    String::from_utf8_lossy(&percent_decoded_bytes(url)).into_owned()
}

/// Decodes percent-encoded bytes, which need not be text.
pub(crate) fn percent_decoded_bytes(url: &str) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(url.len());
    let mut rest = url.as_bytes();
    while let [first, tail @ ..] = rest {
        let code = tail.get(..2).and_then(|hex| std::str::from_utf8(hex).ok());
        match code.and_then(|hex| u8::from_str_radix(hex, 16).ok()) {
            Some(byte) if *first == b'%' => {
                bytes.push(byte);
                rest = &tail[2..];
            }
            _ => {
                bytes.push(*first);
                rest = tail;
            }
        }
    }
    bytes
}

/// Returns the name of a mesh: that of its file without the extension.
pub(crate) fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Returns the location of a line of a mesh file; 0 is the whole file.
pub(crate) fn place(path: &Path, line: u32) -> Span {
    Span { file: path.to_owned(), line, ..Span::default() }
}

/// Returns an error about a line of a mesh file; 0 is the whole file.
pub(crate) fn error(path: &Path, line: u32, message: impl Into<String>) -> LoadError {
    LoadError::Content { at: place(path, line), message: message.into() }
}

/// Triangulates polygons of a mesh.
#[derive(Default)]
pub(crate) struct Polygons {
    triangulator: Triangulator,
    points: Vec<DVec3>,
}

impl Polygons {
    /// Emits the triangles of a polygon as positions in its list of corners, which are indices into
    /// `positions`; corners without a position count as the origin. Fewer than three corners have
    /// no triangles.
    pub(crate) fn cut(
        &mut self,
        corners: impl ExactSizeIterator<Item = u32>,
        positions: &[[f32; 3]],
        emit: impl FnMut([usize; 3]),
    ) {
        self.points.clear();
        self.points.extend(corners.map(|c| {
            let position = positions.get(c as usize).copied().unwrap_or_default();
            DVec3::from_array(position.map(f64::from))
        }));
        if self.points.len() >= 3 {
            self.triangulator.cut(&self.points, emit);
        }
    }
}

/// Creates an attribute, without indices if they equal those of the positions.
pub(crate) fn attribute<T>(
    values: Vec<T>,
    indices: Vec<[u32; 3]>,
    positions: usize,
    triangles: &[[u32; 3]],
) -> Attribute<T> {
    let same = values.len() == positions && indices == triangles;
    Attribute { values: values.into(), indices: (!same).then_some(indices.into()) }
}
