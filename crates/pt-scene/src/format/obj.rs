//! Wavefront object files (OBJ): polygons with normals and texture coordinates of their own
//! indices. [Wavefront Technologies, "Object Files (.obj)", Advanced Visualizer manual, app. B1] Vertices
//! may have colours of sRGB, `v x y z r g b`, as several modelling tools write them.
//!
//! A file becomes one mesh, whatever its groups are. Lines, points and free-form surfaces are
//! passed over, and so are materials.

use std::path::Path;

use pt_math::color::linear_from_srgb;

use super::mesh_file::{self, ColorLevels, MeshFile, Polygons};
use super::xml::quote;
use crate::shapes::single_part;
use crate::{Attribute, LoadError, Mesh, Scene, Span, Warning};

/// Index of what a corner does not have.
const MISSING: u32 = u32::MAX;
/// Statements that mean nothing here: names, smoothing, points and lines, display.
const PASSED_OVER: [&str; 14] = [
    "o",
    "g",
    "s",
    "mg",
    "p",
    "l",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "shadow_obj",
    "trace_obj",
];

/// A scene of one object.
pub(super) fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    let mut reader = Reader::new(path);
    reader.read(bytes)?;
    let materials = reader.materials_at.take();
    let mut scene = reader.finish()?.into_scene(path);
    scene.warnings.extend(materials.map(|at| Warning {
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
    let mut reader = Reader::new(path);
    reader.read(bytes)?;
    reader.finish()
}

/// What was read so far.
struct Reader<'a> {
    path: &'a Path,
    /// Number of the line being read.
    line: u32,
    positions: Vec<[f32; 3]>,
    /// Colours of the first of these.
    colors: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    normals: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    uv_indices: Vec<[u32; 3]>,
    normal_indices: Vec<[u32; 3]>,
    /// The corners of the polygon being read: indices of position, uv and normal.
    corners: Vec<[u32; 3]>,
    polygons: Polygons,
    /// Where a material is first mentioned.
    materials_at: Option<Span>,
    warnings: Vec<Warning>,
}

impl<'a> Reader<'a> {
    fn new(path: &'a Path) -> Self {
        Self {
            path,
            line: 0,
            positions: Vec::new(),
            colors: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            triangles: Vec::new(),
            uv_indices: Vec::new(),
            normal_indices: Vec::new(),
            corners: Vec::new(),
            polygons: Polygons::default(),
            materials_at: None,
            warnings: Vec::new(),
        }
    }

    fn read(&mut self, bytes: &[u8]) -> Result<(), LoadError> {
        for line in bytes.split(|b| *b == b'\n') {
            self.line += 1;
            // Names and comments may be in any encoding; numbers are ASCII in all of them.
            self.statement(&String::from_utf8_lossy(line))?;
        }
        Ok(())
    }

    fn statement(&mut self, line: &str) -> Result<(), LoadError> {
        let line = line.split('#').next().unwrap_or_default();
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let position = self.numbers(line, words.by_ref().take(3))?;
                let words: Vec<&str> = words.collect();
                // Less than a colour is a weight.
                if words.len() >= 3 && self.colors.len() == self.positions.len() {
                    let color = self.numbers(line, words.into_iter())?;
                    self.colors.push(color.map(linear_from_srgb));
                }
                self.positions.push(position);
            }
            Some("vn") => {
                let normal = self.numbers(line, words)?;
                self.normals.push(normal);
            }
            Some("vt") => {
                // A texture coordinate may have one, two or three numbers.
                let mut words = words.peekable();
                let [u] = self.numbers(line, words.by_ref().take(1))?;
                let [v] = match words.peek() {
                    Some(_) => self.numbers(line, words)?,
                    None => [0.0],
                };
                self.uvs.push([u, v]);
            }
            Some("f") => self.face(line, words)?,
            Some("usemtl" | "mtllib") => {
                self.materials_at.get_or_insert_with(|| mesh_file::place(self.path, self.line));
            }
            Some(word) if !PASSED_OVER.contains(&word) && self.warnings.is_empty() => {
                let message = format!("statements like {} are passed over", quote(word));
                self.warnings.push(Warning { at: self.at(line, word), message });
            }
            Some(_) | None => {}
        }
        Ok(())
    }

    /// The first `N` words, as numbers; what follows them is left.
    fn numbers<'w, const N: usize>(
        &self,
        line: &'w str,
        mut words: impl Iterator<Item = &'w str>,
    ) -> Result<[f32; N], LoadError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let word = words.next().ok_or_else(|| {
                let numbers = if N == 1 { "a number".to_owned() } else { format!("{N} numbers") };
                let message = format!("expected {numbers} after {}", quote(first_word(line)));
                self.error(line, line, message)
            })?;
            let parsed: Option<f32> = word.parse().ok();
            *number = parsed.filter(|x| x.is_finite()).ok_or_else(|| {
                let message = format!("{} is no finite number such as 0.5", quote(word));
                self.error(line, word, message)
            })?;
        }
        Ok(numbers)
    }

    /// Cuts a polygon into triangles.
    fn face<'w>(
        &mut self,
        line: &'w str,
        words: impl Iterator<Item = &'w str>,
    ) -> Result<(), LoadError> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in words {
            corners.push(self.corner(line, word)?);
        }
        if corners.len() < 3 {
            return Err(self.error(line, line, "a face needs at least three corners"));
        }
        self.polygons.cut(corners.iter().map(|c| c[0]), &self.positions, |triangle| {
            self.triangles.push(triangle.map(|i| corners[i][0]));
            self.uv_indices.push(triangle.map(|i| corners[i][1]));
            self.normal_indices.push(triangle.map(|i| corners[i][2]));
        });
        if u32::try_from(self.triangles.len()).is_err() {
            return Err(self.error(line, line, "the file has more than 4294967295 triangles"));
        }
        self.corners = corners;
        Ok(())
    }

    /// `position`, `position/uv`, `position//normal` or `position/uv/normal`.
    fn corner(&self, line: &str, word: &str) -> Result<[u32; 3], LoadError> {
        let lists = [
            ("vertices", self.positions.len()),
            ("texture coordinates", self.uvs.len()),
            ("normals", self.normals.len()),
        ];
        let mut corner = [MISSING; 3];
        for (i, text) in word.split('/').enumerate() {
            let Some((what, count)) = lists.get(i) else {
                let message = format!("{} has more than three indices", quote(word));
                return Err(self.error(line, word, message));
            };
            if text.is_empty() && i > 0 {
                continue;
            }
            corner[i] = resolve(text, *count).ok_or_else(|| {
                let written = quote(text);
                let message = match count {
                    _ if text.is_empty() => format!("{} has no vertex", quote(word)),
                    0 => format!("{written} is an index into {what}, but there are none above"),
                    _ => format!(
                        "{written} is no index into the {what} above; expected 1 to {count}, or \
                         -{count} to -1"
                    ),
                };
                self.error(line, text, message)
            })?;
        }
        Ok(corner)
    }

    fn finish(mut self) -> Result<MeshFile, LoadError> {
        let Self { path, .. } = self;
        if self.triangles.is_empty() {
            return Err(mesh_file::error(path, 0, "the file has no faces (\"f 1 2 3\")"));
        }
        let positions = self.positions.len();
        let has_colors = self.colors.len() == positions;
        if !has_colors && !self.colors.is_empty() {
            let message = "some vertices have no colours; those of others are left out".to_owned();
            self.warnings.push(Warning { at: mesh_file::place(path, 0), message });
        }
        let mut partly = |what: &str, indices: &[[u32; 3]]| {
            let missing = indices.as_flattened().iter().filter(|i| **i == MISSING).count();
            if missing > 0 && missing < 3 * indices.len() {
                let message = format!("some corners have no {what}; those of others are left out");
                self.warnings.push(Warning { at: mesh_file::place(path, 0), message });
            }
            missing == 0
        };
        let has_normals = partly("normals", &self.normal_indices);
        let has_uvs = partly("texture coordinates", &self.uv_indices);
        let triangles = self.triangles;
        let normals = has_normals.then(|| {
            mesh_file::attribute(self.normals, self.normal_indices, positions, &triangles)
        });
        let uvs =
            has_uvs.then(|| mesh_file::attribute(self.uvs, self.uv_indices, positions, &triangles));
        let parts = single_part(triangles.len());
        let name = mesh_file::name_of(path);
        let positions = self.positions;
        let colors = has_colors.then_some(Attribute { values: self.colors, indices: None });
        let mesh =
            Mesh { name, positions, triangles, normals, uvs, colors, parts, face_colors: None };
        Ok(MeshFile { mesh, levels: ColorLevels::default(), warnings: self.warnings })
    }

    fn at(&self, line: &str, piece: &str) -> Span {
        let bytes = piece.as_ptr().addr().saturating_sub(line.as_ptr().addr());
        let column = line.get(..bytes).unwrap_or_default().chars().count() as u32 + 1;
        Span { column, ..mesh_file::place(self.path, self.line) }
    }

    fn error(&self, line: &str, piece: &str, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.at(line, piece), message: message.into() }
    }
}

/// An index as it is written (from 1, or backwards from −1) into a list of `count`.
fn resolve(text: &str, count: usize) -> Option<u32> {
    let index: i64 = text.parse().ok()?;
    let count = i64::try_from(count).ok()?;
    let from_zero = if index < 0 { index.checked_add(count)? } else { index - 1 };
    let exists = (0..count).contains(&from_zero);
    u32::try_from(from_zero).ok().filter(|i| exists && *i != MISSING)
}

fn first_word(line: &str) -> &str {
    line.split_ascii_whitespace().next().unwrap_or_default()
}
