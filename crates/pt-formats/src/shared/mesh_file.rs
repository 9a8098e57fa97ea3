//! What the mesh formats share: reading a file that a scene names, and a scene of one mesh.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_math::color::linear_from_srgb;
use pt_math::{DAffine3, DVec3};

use super::triangulate::Triangulator;
pub(super) use crate::image::folder_of;
use crate::material::Diffuse;
use crate::texture::{Input, Pattern, Texture};
use crate::{Attribute, Geometry, LoadError, Material, Mesh, Object, Points, Scene, Span, Warning};

/// A mesh, and what the user should know about how it was read.
#[derive(Debug)]
pub(super) struct MeshFile {
    /// Whole numbers of its colours are shares of the greatest one.
    pub(super) mesh: Mesh,
    pub(super) levels: ColorLevels,
    pub(super) warnings: Vec<Warning>,
}

/// The greatest number that a channel of a colour can have in the file: 1 for real numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct ColorLevels {
    pub(super) vertices: f32,
    pub(super) faces: f32,
}

impl Default for ColorLevels {
    fn default() -> Self {
        Self { vertices: 1.0, faces: 1.0 }
    }
}

impl MeshFile {
    /// A scene with the mesh as its only object, in its own colours or of the default material.
    /// Whole numbers of colours are levels of sRGB, as programs that show such files by
    /// themselves have them.
    pub(super) fn into_scene(self, path: &Path) -> Scene {
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
        Scene { objects: vec![object], materials, warnings, ..Scene::default() }
    }
}

impl ColorLevels {
    /// Makes the colours of a mesh linear whose whole numbers are levels of sRGB.
    fn linearize(self, mesh: &mut Mesh) {
        map_colors(mesh, |channel, of_faces| {
            let levels = if of_faces { self.faces } else { self.vertices };
            if levels > 1.0 { linear_from_srgb(channel) } else { channel }
        });
    }
}

/// Points in a file without faces, and what the user should know about how it was read.
#[derive(Debug)]
pub(super) struct PointsFile {
    pub(super) points: Points,
    pub(super) warnings: Vec<Warning>,
}

impl PointsFile {
    /// The vertices of a mesh that has no triangles, without those that are nowhere, and segments
    /// between them.
    pub(super) fn new(file: MeshFile, segments: Vec<[u32; 2]>, path: &Path) -> Self {
        let MeshFile { mut mesh, levels, mut warnings } = file;
        levels.linearize(&mut mesh);
        let Mesh { name, positions, colors, .. } = mesh;
        let colors = colors.map(|colors| colors.values);
        let mut points = Points { name, positions, colors, segments };
        let lost = points.drop_infinite();
        if lost > 0 {
            let message = format!("points left out whose coordinates are not finite: {lost}");
            warnings.push(Warning { at: place(path, 0), message });
        }
        Self { points, warnings }
    }

    /// A scene with the points as its only object, in their own colours or of the default material.
    pub(super) fn into_scene(self, path: &Path) -> Scene {
        let mut scene = Scene { warnings: self.warnings, ..Scene::default() };
        add_points(&mut scene, self.points, path);
        scene
    }
}

/// Adds points to a scene, in their own colours or of the default material.
pub(super) fn add_points(scene: &mut Scene, points: Points, path: &Path) {
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

/// Changes each channel of the colours of a mesh, and is told whether it is one of a face.
pub(super) fn map_colors(mesh: &mut Mesh, change: impl Fn(f32, bool) -> f32) {
    for color in mesh.colors.iter_mut().flat_map(|colors| &mut colors.values) {
        *color = color.map(|channel| change(channel, false));
    }
    for color in mesh.face_colors.iter_mut().flatten() {
        *color = color.map(|channel| change(channel, true));
    }
}

/// The matte material that shows the colours of a mesh: those of its vertices, or else of its
/// faces.
fn colored(mesh: &Mesh) -> Option<Material> {
    let pattern = match (&mesh.colors, &mesh.face_colors) {
        (Some(_), _) => Pattern::VertexColors,
        (None, Some(_)) => Pattern::FaceColors,
        (None, None) => return None,
    };
    Some(showing(&mesh.name, pattern))
}

/// A matte material that shows colours.
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

/// The path of a file that a scene names: as it is written, or with slashes in place of the
/// backslashes of Windows. An absolute path that leads nowhere is one of another machine: the file
/// is the longest end of it that is in the folder, if there is one.
pub(super) fn locate(folder: &Path, name: &str) -> PathBuf {
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

/// What follows the root of an absolute path with slashes, which may have the letter of a drive.
fn below_root(path: &str) -> Option<&str> {
    let rest = path.strip_prefix('/').unwrap_or(path);
    match rest.as_bytes() {
        [letter, b':', b'/', ..] if letter.is_ascii_alphabetic() => Some(&rest[3..]),
        _ => path.strip_prefix('/'),
    }
}

/// The text that a URL means: `%20` is a space.
pub(super) fn percent_decoded(url: &str) -> String {
    String::from_utf8_lossy(&percent_decoded_bytes(url)).into_owned()
}

/// The bytes that a URL means, which need not be a text.
pub(super) fn percent_decoded_bytes(url: &str) -> Vec<u8> {
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

/// The name of a mesh: that of its file without the ending.
pub(super) fn name_of(path: &Path) -> String {
    path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// A line of a mesh file; 0 means the whole file.
pub(super) fn place(path: &Path, line: u32) -> Span {
    Span { file: path.to_owned(), line, ..Span::default() }
}

/// An error about a line of a mesh file; 0 means the whole file.
pub(super) fn error(path: &Path, line: u32, message: impl Into<String>) -> LoadError {
    LoadError::Content { at: place(path, line), message: message.into() }
}

/// Cuts polygons into triangles.
#[derive(Default)]
pub(super) struct Polygons {
    triangulator: Triangulator,
    points: Vec<DVec3>,
}

impl Polygons {
    /// Gives the triangles of a polygon as numbers of its corners, which are indices into
    /// `positions`; those that are not known yet count as the origin. Fewer than three corners
    /// give none.
    pub(super) fn cut(
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

/// Values at corners, without indices where they are those of the positions.
pub(super) fn attribute<T>(
    values: Vec<T>,
    indices: Vec<[u32; 3]>,
    positions: usize,
    triangles: &[[u32; 3]],
) -> Attribute<T> {
    let same = values.len() == positions && indices == triangles;
    Attribute { values, indices: (!same).then_some(indices) }
}
