//! Pieces of a file that are read side by side.
//!
//! A corner may refer to what stands above it in the file, wherever that is. So a file is gone through three
//! times, each time in parallel: what there is of each kind is counted, then the numbers of vertices are read, and
//! then the faces, for which all numbers are there, and for which the counts tell what stands above.

use std::path::Path;

use pt_math::color::linear_from_srgb;
use rayon::prelude::*;

use super::super::mesh_file;
use super::super::xml::quote;
use crate::{LoadError, Span};

/// Bytes of a piece, about.
const BYTES: usize = 1 << 19;

/// How many vertices, texture coordinates and normals there are, in this order.
pub(super) type Counts = [usize; 3];

/// Some lines of a file.
#[derive(Clone, Copy)]
pub(super) struct Chunk<'a> {
    pub(super) path: &'a Path,
    bytes: &'a [u8],
    /// Number of its first line.
    line: u32,
    /// What stands above it.
    pub(super) above: Counts,
}

/// A line of a file.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub(super) path: &'a Path,
    pub(super) number: u32,
    /// Without its comment.
    pub(super) text: &'a str,
}

/// The numbers of vertices.
#[derive(Default)]
pub(super) struct Points {
    pub(super) positions: Vec<[f32; 3]>,
    /// Linear; those of some positions, where not all have them.
    pub(super) colors: Vec<[f32; 3]>,
    pub(super) uvs: Vec<[f32; 2]>,
    pub(super) normals: Vec<[f32; 3]>,
}

/// Cuts a file at line breaks.
pub(super) fn cut<'a>(bytes: &'a [u8], path: &'a Path) -> Vec<Chunk<'a>> {
    let (mut chunks, mut rest) = (Vec::new(), bytes);
    while !rest.is_empty() {
        let least = rest.len().min(BYTES);
        let end = memchr::memchr(b'\n', &rest[least..]).map_or(rest.len(), |at| least + at + 1);
        let (head, tail) = rest.split_at(end);
        chunks.push(Chunk { path, bytes: head, line: 1, above: [0; 3] });
        rest = tail;
    }
    let counts = side_by_side(&chunks, Chunk::count);
    let (mut line, mut above) = (1_u32, [0; 3]);
    for (chunk, (lines, counts)) in chunks.iter_mut().zip(counts) {
        (chunk.line, chunk.above) = (line, above);
        line = line.saturating_add(lines);
        above = [0, 1, 2].map(|i| above[i] + counts[i]);
    }
    chunks
}

/// Does the same with all chunks, in parallel where they are several.
pub(super) fn side_by_side<'a, P: Send>(
    chunks: &[Chunk<'a>],
    work: impl Fn(&Chunk<'a>) -> P + Sync + Send,
) -> Vec<P> {
    match chunks {
        [one] => vec![work(one)],
        all => all.par_iter().map(work).collect(),
    }
}

impl<'a> Chunk<'a> {
    /// How many lines it has, and how many statements that count.
    fn count(&self) -> (u32, Counts) {
        let (mut lines, mut counts) = (0, [0; 3]);
        for (_, line) in self.lines() {
            lines += 1;
            match keyword(line) {
                b"v" => counts[0] += 1,
                b"vt" => counts[1] += 1,
                b"vn" => counts[2] += 1,
                _ => {}
            }
        }
        (lines, counts)
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

    /// Gives the lines whose first word is `wanted`, until one is wrong.
    pub(super) fn statements(
        &self,
        wanted: impl Fn(&[u8]) -> bool,
        mut each: impl FnMut(Line) -> Result<(), LoadError>,
    ) -> Result<(), LoadError> {
        for (number, line) in self.lines() {
            if !wanted(keyword(line)) {
                continue;
            }
            // Names and comments may be in any encoding; numbers are ASCII in all of them.
            let text = String::from_utf8_lossy(line);
            let text = text.split('#').next().unwrap_or_default();
            each(Line { path: self.path, number, text })?;
        }
        Ok(())
    }

    /// Reads the numbers of its vertices.
    pub(super) fn points(&self) -> Result<Points, LoadError> {
        let mut points = Points::default();
        let is_point = |word: &[u8]| matches!(word, b"v" | b"vt" | b"vn");
        self.statements(is_point, |line| points.read(line))?;
        Ok(points)
    }
}

/// The first word of a line.
fn keyword(line: &[u8]) -> &[u8] {
    let start = line.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(line.len());
    let word = &line[start..];
    let end = word.iter().position(|b| b.is_ascii_whitespace() || *b == b'#');
    &word[..end.unwrap_or(word.len())]
}

impl Points {
    fn read(&mut self, line: Line) -> Result<(), LoadError> {
        let mut words = line.text.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                self.positions.push(line.numbers(words.by_ref().take(3))?);
                // Less than a colour is a weight.
                let words: Vec<&str> = words.collect();
                if words.len() >= 3 {
                    let color: [f32; 3] = line.numbers(words.into_iter())?;
                    self.colors.push(color.map(linear_from_srgb));
                }
            }
            Some("vn") => self.normals.push(line.numbers(words)?),
            // A texture coordinate may have one, two or three numbers.
            _ => {
                let mut words = words.peekable();
                let [u] = line.numbers(words.by_ref().take(1))?;
                let [v] = match words.peek() {
                    Some(_) => line.numbers(words)?,
                    None => [0.0],
                };
                self.uvs.push([u, v]);
            }
        }
        Ok(())
    }

    pub(super) fn append(&mut self, mut more: Self) {
        self.positions.append(&mut more.positions);
        self.colors.append(&mut more.colors);
        self.uvs.append(&mut more.uvs);
        self.normals.append(&mut more.normals);
    }
}

impl<'a> Line<'a> {
    /// The first word.
    pub(super) fn keyword(&self) -> &'a str {
        self.text.split_ascii_whitespace().next().unwrap_or_default()
    }

    /// The first `N` words, as numbers; what follows them is left.
    fn numbers<const N: usize>(
        &self,
        mut words: impl Iterator<Item = &'a str>,
    ) -> Result<[f32; N], LoadError> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            let word = words.next().ok_or_else(|| {
                let numbers = if N == 1 { "a number".to_owned() } else { format!("{N} numbers") };
                let message = format!("expected {numbers} after {}", quote(self.keyword()));
                self.error(self.text, message)
            })?;
            let parsed: Option<f32> = word.parse().ok();
            *number = parsed.filter(|x| x.is_finite()).ok_or_else(|| {
                let message = format!("{} is no finite number such as 0.5", quote(word));
                self.error(word, message)
            })?;
        }
        Ok(numbers)
    }

    /// Where a piece of the line is.
    pub(super) fn at(&self, piece: &str) -> Span {
        let bytes = piece.as_ptr().addr().saturating_sub(self.text.as_ptr().addr());
        let column = self.text.get(..bytes).unwrap_or_default().chars().count() as u32 + 1;
        Span { column, ..mesh_file::place(self.path, self.number) }
    }

    pub(super) fn error(&self, piece: &str, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.at(piece), message: message.into() }
    }
}
