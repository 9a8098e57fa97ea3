//! What the mesh formats share: reading a file that a scene names, and a scene of one mesh.

use std::path::Path;
use std::sync::Arc;

use pt_math::{DAffine3, DVec3};

use super::triangulate::Triangulator;
use crate::{Attribute, Geometry, LoadError, Mesh, Object, Scene, Span, Warning};

/// A mesh, and what the user should know about how it was read.
#[derive(Debug)]
pub(super) struct MeshFile {
    pub(super) mesh: Mesh,
    pub(super) warnings: Vec<Warning>,
}

impl MeshFile {
    /// A scene with the mesh as its only object, of the default material.
    pub(super) fn into_scene(self, path: &Path) -> Scene {
        let object = Object {
            name: self.mesh.name.clone(),
            to_world: DAffine3::IDENTITY,
            materials: vec![None; self.mesh.parts.len()],
            geometry: Geometry::Mesh(Arc::new(self.mesh)),
            media: None,
            at: place(path, 0),
        };
        Scene { objects: vec![object], warnings: self.warnings, ..Scene::default() }
    }
}

/// Reads a file that a scene names.
///
/// # Errors
/// If it cannot be read, or is no regular file: devices and pipes may never end. The message is
/// meant for the place where the scene names it.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, String> {
    let message = |why: &str| format!("{} cannot be read: {why}", path.display());
    let io_message = |error: std::io::Error| message(&error.to_string());
    if std::fs::metadata(path).map_err(io_message)?.is_file() {
        std::fs::read(path).map_err(io_message)
    } else {
        Err(message("it is no regular file"))
    }
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
