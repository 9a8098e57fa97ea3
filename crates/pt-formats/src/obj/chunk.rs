//! Pieces of a file that are read in parallel.
//!
//! A corner may refer to anything above it in the file. So a file is traversed three times, each
//! time in parallel: first, the items of each kind are counted, then the vertices are read, and
//! then the faces, for which all vertices are known, and the counts give the numbers of items
//! above.

use std::path::Path;

use pt_math::color::linear_from_srgb;
use rayon::prelude::*;

use super::slots::LocatedName;
use crate::LoadError;
use crate::shared::decimal::{leading_f32, next};
use crate::shared::line::Line;
use crate::shared::mesh_diagnostics::MeshDiagnostics;

/// Approximate number of bytes of a piece.
const BYTES: usize = 1 << 19;

/// Numbers of vertices, texture coordinates and normals, in this order.
pub(super) type VertexCounts = [usize; 3];

/// Some lines of a file.
#[derive(Clone, Copy)]
pub(super) struct LineChunk<'a> {
    pub(super) path: &'a Path,
    bytes: &'a [u8],
    /// Number of the first line.
    line: u32,
    /// Counts above the chunk.
    pub(super) above: VertexCounts,
    /// Counts of the chunk.
    pub(super) own: VertexCounts,
    /// Number of faces.
    pub(super) faces: usize,
    /// True if the chunk has statements that `own` does not count.
    pub(super) has_others: bool,
}

/// Vertex data.
#[derive(Default)]
pub(super) struct ObjVertices {
    pub(super) positions: Vec<[f32; 3]>,
    /// Linear colours; possibly not of all positions.
    pub(super) colors: Vec<[f32; 3]>,
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) normals: Vec<[f32; 3]>,
}

/// Splits a file at line breaks.
pub(super) fn cut<'a>(bytes: &'a [u8], path: &'a Path) -> Vec<LineChunk<'a>> {
    let (mut chunks, mut rest) = (Vec::new(), bytes);
    while !rest.is_empty() {
        let least = rest.len().min(BYTES);
        let end = memchr::memchr(b'\n', &rest[least..]).map_or(rest.len(), |at| least + at + 1);
        let (head, tail) = rest.split_at(end);
        let (above, own) = ([0; 3], [0; 3]);
        chunks.push(LineChunk {
            path,
            bytes: head,
            line: 1,
            above,
            own,
            faces: 0,
            has_others: false,
        });
        rest = tail;
    }
    let counts = side_by_side(&chunks, LineChunk::count);
    let (mut line, mut above) = (1_u32, [0; 3]);
    for (chunk, (lines, counted)) in chunks.iter_mut().zip(counts) {
        *chunk = LineChunk { line, above, ..counted };
        line = line.saturating_add(lines);
        above = [0, 1, 2].map(|i| above[i] + chunk.own[i]);
    }
    chunks
}

/// Applies `work` to all chunks, in parallel if there are several.
pub(super) fn side_by_side<'a, P: Send>(
    chunks: &[LineChunk<'a>],
    work: impl Fn(&LineChunk<'a>) -> P + Sync + Send,
) -> Vec<P> {
    match chunks {
        [one] => vec![work(one)],
        all => all.par_iter().map(work).collect(),
    }
}

impl<'a> LineChunk<'a> {
    /// Returns the number of lines, and the chunk with its statements counted.
    fn count(&self) -> (u32, Self) {
        let (mut lines, mut counted) = (0, *self);
        for (_, line) in self.lines() {
            lines += 1;
            match keyword(line) {
                b"v" => counted.own[0] += 1,
                b"vt" => counted.own[1] += 1,
                b"vn" => counted.own[2] += 1,
                b"" => {}
                word => {
                    counted.faces += usize::from(word == b"f");
                    counted.has_others = true;
                }
            }
        }
        (lines, counted)
    }

    fn lines(&self) -> impl Iterator<Item = (u32, &'a [u8])> + use<'a> {
        let (bytes, mut start, mut number) = (self.bytes, 0, self.line);
        let is_whole = bytes.last() == Some(&b'\n');
        let end = (!is_whole).then_some(bytes.len());
        memchr::memchr_iter(b'\n', bytes).chain(end).map(move |end| {
            let line = &bytes[std::mem::replace(&mut start, end + 1)..end];
            number += 1;
            (number - 1, line)
        })
    }

    /// Passes the lines that are not blank to `each`, and records its errors.
    pub(super) fn statements(
        &self,
        faults: &mut MeshDiagnostics,
        mut each: impl FnMut(Statement<'a>, &mut MeshDiagnostics) -> Result<(), LoadError>,
    ) {
        for (number, line) in self.lines() {
            let keyword = keyword(line);
            if !keyword.is_empty()
                && let Err(fault) =
                    each(Statement { path: self.path, number, line, keyword }, faults)
            {
                faults.add(fault);
            }
        }
    }

    /// Reads the vertices, with 0 in place of invalid numbers.
    pub(super) fn vertices(&self, faults: &mut MeshDiagnostics) -> ObjVertices {
        let mut vertices = ObjVertices::with_capacity(self.own);
        if self.own == [0; 3] {
            return vertices;
        }
        self.statements(faults, |statement, faults| match statement.keyword {
            b"v" | b"vt" | b"vn" => vertices.read(&statement, faults),
            _ => Ok(()),
        });
        vertices
    }
}

/// A line that is not blank.
pub(super) struct Statement<'a> {
    path: &'a Path,
    number: u32,
    line: &'a [u8],
    /// First word.
    pub(super) keyword: &'a [u8],
}

impl<'a> Statement<'a> {
    /// Returns the text after the first word.
    pub(super) fn rest(&self) -> &'a [u8] {
        let before = self.keyword.as_ptr().addr() - self.line.as_ptr().addr();
        &self.line[before + self.keyword.len()..]
    }

    /// Returns the rest as a name, with its line number.
    pub(super) fn named(&self) -> LocatedName {
        let rest = String::from_utf8_lossy(self.rest());
        LocatedName { name: uncommented(&rest).trim().to_owned(), line: self.number }
    }

    /// Reads the line as text. Names and comments may be in any encoding; numbers are ASCII in all
    /// of them.
    pub(super) fn as_text<T>(
        &self,
        read: impl FnOnce(Line) -> Result<T, LoadError>,
    ) -> Result<T, LoadError> {
        let text = String::from_utf8_lossy(self.line);
        let text = text.split('#').next().unwrap_or_default();
        read(Line { path: self.path, number: self.number, text })
    }
}

/// Removes the comment of a line, which follows a space: names may contain a `#`.
pub(super) fn uncommented(line: &str) -> &str {
    let is_comment = |at: &usize| !line[..*at].ends_with(|c: char| !c.is_ascii_whitespace());
    let start = line.match_indices('#').map(|(at, _)| at).find(is_comment);
    &line[..start.unwrap_or(line.len())]
}

/// Parses a line of exactly `N` finite numbers, as most lines are; `None` for other lines.
fn plain_numbers<const N: usize>(bytes: &[u8]) -> Option<[f32; N]> {
    let (mut numbers, mut rest) = ([0.0; N], bytes);
    for number in &mut numbers {
        (*number, rest) = next(rest, leading_f32)?;
    }
    let is_plain =
        rest.trim_ascii_start().is_empty() && numbers.iter().all(|x: &f32| x.is_finite());
    is_plain.then_some(numbers)
}

/// Returns the first word of a line.
fn keyword(line: &[u8]) -> &[u8] {
    let start = line.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(line.len());
    let word = &line[start..];
    let end = word.iter().position(|b| b.is_ascii_whitespace() || *b == b'#');
    &word[..end.unwrap_or(word.len())]
}

impl ObjVertices {
    /// Creates empty vertex data with this capacity.
    pub(super) fn with_capacity([positions, uvs, normals]: VertexCounts) -> Self {
        Self {
            positions: pt_memory::with_capacity(positions),
            colors: Vec::new(),
            uvs: pt_memory::with_capacity(uvs),
            normals: pt_memory::with_capacity(normals),
        }
    }

    fn read(
        &mut self,
        statement: &Statement,
        faults: &mut MeshDiagnostics,
    ) -> Result<(), LoadError> {
        let rest = statement.rest();
        match statement.keyword {
            b"v" => match plain_numbers(rest) {
                Some(position) => self.positions.push(position),
                None => return statement.as_text(|line| self.vertex(line, faults)),
            },
            b"vn" => match plain_numbers(rest) {
                Some(normal) => self.normals.push(normal),
                None => return put(&mut self.normals, statement.as_text(normal)),
            },
            _ => match plain_numbers(rest) {
                Some(uv) => self.uvs.push(uv),
                None => return put(&mut self.uvs, statement.as_text(uv)),
            },
        }
        Ok(())
    }

    /// Reads a position and, if there are at least three more numbers, a colour; fewer numbers are
    /// a weight.
    fn vertex(&mut self, line: Line, faults: &mut MeshDiagnostics) -> Result<(), LoadError> {
        let mut words = words_after_first(line);
        let position = put(&mut self.positions, line.numbers(words.by_ref().take(3)));
        let words: Vec<&str> = words.collect();
        if words.len() < 3 {
            return position;
        }
        let color = line.numbers(words.into_iter()).map(|color| color.map(linear_from_srgb));
        if let Err(fault) = put(&mut self.colors, color) {
            faults.pardon(fault, "the vertex is black");
        }
        position
    }

    /// Returns the positions, and their colours if all have one.
    pub(super) fn into_cloud(self) -> (Vec<[f32; 3]>, Option<Vec<[f32; 3]>>) {
        let has_colors = !self.colors.is_empty() && self.colors.len() == self.positions.len();
        (self.positions, has_colors.then_some(self.colors))
    }

    pub(super) fn append(&mut self, mut more: Self) {
        self.positions.append(&mut more.positions);
        self.colors.append(&mut more.colors);
        self.uvs.append(&mut more.uvs);
        self.normals.append(&mut more.normals);
    }
}

/// Adds a value, or zeros in place of an invalid one.
fn put<const N: usize>(
    values: &mut Vec<[f32; N]>,
    value: Result<[f32; N], LoadError>,
) -> Result<(), LoadError> {
    values.push(*value.as_ref().unwrap_or(&[0.0; N]));
    value.map(drop)
}

fn words_after_first(line: Line<'_>) -> impl Iterator<Item = &str> {
    line.text.split_ascii_whitespace().skip(1)
}

fn normal(line: Line) -> Result<[f32; 3], LoadError> {
    line.numbers(words_after_first(line))
}

/// Reads a texture coordinate, which may have one, two or three numbers.
fn uv(line: Line) -> Result<[f32; 2], LoadError> {
    let mut words = words_after_first(line).peekable();
    let [u] = line.numbers(words.by_ref().take(1))?;
    let [v] = match words.peek() {
        Some(_) => line.numbers(words)?,
        None => [0.0],
    };
    Ok([u, v])
}
