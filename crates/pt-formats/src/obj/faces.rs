//! Faces, points and lines, and the statements between them.

use pt_scene::Span;

use super::chunk::{LineChunk, VertexCounts};
use super::slots::{LocatedName, Slots};
use super::smooth::{Groups, group};
use super::strokes::Strokes;
use crate::LoadError;
use crate::shared::line::Line;
use crate::shared::mesh_diagnostics::MeshDiagnostics;
use crate::shared::mesh_file::Polygons;
use crate::shared::names::quote;

/// Index that marks a missing texture coordinate or normal of a corner.
pub(super) const MISSING: u32 = u32::MAX;
/// Statements without an effect: names and display.
const PASSED_OVER: [&str; 11] = [
    "o",
    "g",
    "mg",
    "bevel",
    "c_interp",
    "d_interp",
    "lod",
    "maplib",
    "usemap",
    "shadow_obj",
    "trace_obj",
];

/// Maximum number of unknown statements in warnings, each by its first word.
const MAX_UNKNOWN: usize = 20;

/// Faces of some lines.
#[derive(Default)]
pub(super) struct ObjFaces {
    /// Indices of positions.
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) uvs: Indices,
    pub(super) normals: Indices,
    /// Materials of the triangles.
    pub(super) slots: Slots,
    /// Points and lines.
    pub(super) strokes: Strokes,
    /// Smoothing groups.
    pub(super) groups: Groups,
    /// Names of material libraries, as written.
    pub(super) libraries: Vec<LocatedName>,
    /// First words of unknown statements, with the first location of each.
    pub(super) unknown: Vec<(String, Span)>,
}

/// Indices of an attribute that some corners lack.
#[derive(Default)]
pub(super) struct Indices {
    /// Indices of each triangle; empty until a triangle has any.
    pub(super) of: Vec<[u32; 3]>,
    /// Number of corners without an index, of the triangles in `of`.
    pub(super) missing: usize,
}

impl Indices {
    /// Adds the indices of a triangle after `before` triangles.
    fn push(&mut self, indices: [u32; 3], before: usize) {
        let missing = indices.iter().filter(|i| **i == MISSING).count();
        if missing == 3 && self.of.is_empty() {
            return;
        }
        self.fill(before);
        self.of.push(indices);
        self.missing += missing;
    }

    /// Adds missing indices up to this number of triangles.
    fn fill(&mut self, triangles: usize) {
        self.missing += 3 * (triangles - self.of.len());
        self.of.resize(triangles, [MISSING; 3]);
    }

    /// Sets the index of corners that have none.
    pub(super) fn replace_missing(&mut self, index: u32) {
        for corner in self.of.as_flattened_mut().iter_mut().filter(|i| **i == MISSING) {
            *corner = index;
        }
        self.missing = 0;
    }

    /// Appends the indices of `more_triangles` triangles after those of `triangles`.
    fn append(&mut self, triangles: usize, mut more: Self, more_triangles: usize) {
        if more.of.is_empty() && self.of.is_empty() {
            return;
        }
        self.fill(triangles);
        more.fill(more_triangles);
        self.missing += more.missing;
        self.of.append(&mut more.of);
    }
}

impl ObjFaces {
    /// Creates an empty list with this capacity.
    pub(super) fn with_capacity(triangles: usize) -> Self {
        Self { triangles: pt_memory::with_capacity(triangles), ..Self::default() }
    }

    /// Reads the valid faces of a chunk; `positions` are those of the file.
    pub(super) fn read(
        chunk: &LineChunk,
        positions: &[[f32; 3]],
        faults: &mut MeshDiagnostics,
    ) -> Self {
        let mut faces = Self::with_capacity(chunk.faces);
        if !chunk.has_others {
            return faces;
        }
        let mut counts = chunk.above;
        let (mut corners, mut polygons) = (Vec::new(), Polygons::default());
        chunk.statements(faults, |statement, faults| {
            match statement.keyword {
                b"v" => counts[0] += 1,
                b"vt" => counts[1] += 1,
                b"vn" => counts[2] += 1,
                b"f" => match plain_triangle(statement.rest(), counts) {
                    Some(triangle) => faces.push(triangle),
                    None => statement.as_text(|line| {
                        if read_corners(line, counts, &mut corners, faults) {
                            faces.add(line, &corners, positions, &mut polygons, faults);
                        }
                        Ok(())
                    })?,
                },
                b"usemtl" => {
                    faces.slots.switch(faces.triangles.len(), statement.named());
                    faces.strokes.switch(statement.named());
                }
                kind @ (b"p" | b"l") => statement.as_text(|line| {
                    if read_corners(line, counts, &mut corners, faults) {
                        let is_line = kind == b"l";
                        if is_line && corners.len() < 2 {
                            let fault = line.error(
                                line.text,
                                "found fewer than two points of a line, expected at least two",
                            );
                            faults.pardon(fault, "the line is omitted");
                        } else {
                            faces.strokes.add(corners.iter().map(|corner| corner[0]), is_line);
                        }
                    }
                    Ok(())
                })?,
                b"s" => statement.as_text(|line| {
                    faces.groups.switch(faces.triangles.len(), group(line));
                    Ok(())
                })?,
                b"mtllib" => faces.libraries.push(statement.named()),
                _ => statement.as_text(|line| {
                    faces.other(line);
                    Ok(())
                })?,
            }
            Ok(())
        });
        faces
    }

    /// Triangulates a polygon and adds its triangles.
    fn add(
        &mut self,
        line: Line,
        corners: &[[u32; 3]],
        positions: &[[f32; 3]],
        polygons: &mut Polygons,
        faults: &mut MeshDiagnostics,
    ) {
        match corners {
            [] | [_] | [_, _] => {
                let fault = line.error(
                    line.text,
                    "found fewer than three corners of a face, expected at least three",
                );
                faults.pardon(fault, "the face is omitted");
            }
            [a, b, c] => self.push([*a, *b, *c]),
            all => polygons.cut(all.iter().map(|c| c[0]), positions, |triangle| {
                self.push(triangle.map(|i| all[i]));
            }),
        }
    }

    fn push(&mut self, corners: [[u32; 3]; 3]) {
        let before = self.triangles.len();
        self.triangles.push(corners.map(|c| c[0]));
        self.uvs.push(corners.map(|c| c[1]), before);
        self.normals.push(corners.map(|c| c[2]), before);
    }

    /// Handles a statement about neither vertices nor faces.
    fn other(&mut self, line: Line) {
        let word = line.keyword();
        if !PASSED_OVER.contains(&word) {
            self.note_unknown(word, || line.at(word));
        }
    }

    fn note_unknown(&mut self, word: &str, at: impl FnOnce() -> Span) {
        if self.unknown.len() < MAX_UNKNOWN && self.unknown.iter().all(|(known, _)| known != word) {
            self.unknown.push((word.to_owned(), at()));
        }
    }

    /// Appends the faces of the lines that follow.
    pub(super) fn append(&mut self, mut more: Self) {
        let (before, count) = (self.triangles.len(), more.triangles.len());
        self.triangles.append(&mut more.triangles);
        self.uvs.append(before, more.uvs, count);
        self.normals.append(before, more.normals, count);
        self.slots.append(before, more.slots);
        self.groups.append(before, more.groups);
        self.strokes.append(more.strokes);
        self.libraries.append(&mut more.libraries);
        for (word, at) in more.unknown {
            self.note_unknown(&word, || at);
        }
    }
}

/// Reads the corners of a face, and records the errors. Returns true if there are none.
fn read_corners(
    line: Line,
    counts: VertexCounts,
    corners: &mut Vec<[u32; 3]>,
    faults: &mut MeshDiagnostics,
) -> bool {
    let mut all_good = true;
    corners.clear();
    for word in line.text.split_ascii_whitespace().skip(1) {
        match corner(line, word, counts, faults) {
            Ok(corner) => corners.push(corner),
            Err(fault) => {
                all_good = false;
                faults.add(fault);
            }
        }
    }
    all_good
}

/// Parses a line of exactly three corners with positive indices, as most faces are; `None` for
/// other lines.
fn plain_triangle(mut bytes: &[u8], counts: VertexCounts) -> Option<[[u32; 3]; 3]> {
    let mut triangle = [[MISSING; 3]; 3];
    for corner in &mut triangle {
        bytes = bytes.trim_ascii_start();
        for (place, (index, count)) in corner.iter_mut().zip(counts).enumerate() {
            let end = bytes.iter().position(|b| !b.is_ascii_digit()).unwrap_or(bytes.len());
            let (digits, rest) = bytes.split_at(end);
            if !digits.is_empty() {
                *index = plain_index(digits, count)?;
            } else if place != 1 {
                return None;
            }
            bytes = rest;
            let Some(rest) = bytes.strip_prefix(b"/") else { break };
            bytes = rest;
        }
        if bytes.first().is_some_and(|b| !b.is_ascii_whitespace()) {
            return None;
        }
    }
    bytes.trim_ascii_start().is_empty().then_some(triangle)
}

/// Parses a positive index of up to nine digits, and returns it from 0.
fn plain_index(digits: &[u8], count: usize) -> Option<u32> {
    let is_short = digits.len() <= 9;
    let number = is_short
        .then(|| digits.iter().fold(0_u32, |x, digit| 10 * x + u32::from(digit - b'0')))
        .filter(|number| (1..=count).contains(&(*number as usize)))?;
    Some(number - 1)
}

/// Parses `position`, `position/uv`, `position//normal` or `position/uv/normal`; `counts` are the
/// numbers of items above.
fn corner(
    line: Line,
    word: &str,
    counts: VertexCounts,
    faults: &mut MeshDiagnostics,
) -> Result<[u32; 3], LoadError> {
    let mut corner = [MISSING; 3];
    for (i, text) in word.split('/').enumerate() {
        let Some(count) = counts.get(i) else {
            let message =
                format!("found more than three indices in {}, expected up to three", quote(word));
            return Err(line.error(word, message));
        };
        if text.is_empty() && i > 0 {
            continue;
        }
        if i > 0 && *count == 0 {
            let (written, what) = (quote(text), ["vertices", "texture coordinates", "normals"][i]);
            let message = format!("found index {written} of {what}, but none are above");
            faults.pardon(line.error(text, message), "the index is ignored");
            continue;
        }
        corner[i] = resolve(text, *count).ok_or_else(|| {
            let (written, what) = (quote(text), ["vertices", "texture coordinates", "normals"][i]);
            let message = match count {
                _ if text.is_empty() => format!("missing vertex in {}", quote(word)),
                0 => format!("found index {written} of {what}, but none are above"),
                _ => format!(
                    "found {written}, expected an index of the {what} above: 1 to {count}, or \
                     -{count} to -1"
                ),
            };
            line.error(text, message)
        })?;
    }
    Ok(corner)
}

/// Resolves a written index (from 1, or backwards from −1) into a list of `count` items.
fn resolve(text: &str, count: usize) -> Option<u32> {
    let index: i64 = text.parse().ok()?;
    let count = i64::try_from(count).ok()?;
    let from_zero = if index < 0 { index.checked_add(count)? } else { index - 1 };
    let exists = (0..count).contains(&from_zero);
    u32::try_from(from_zero).ok().filter(|i| exists && *i != MISSING)
}
