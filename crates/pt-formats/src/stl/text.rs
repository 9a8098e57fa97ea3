//! Text files.

use std::path::Path;

use rayon::prelude::*;

use super::PIECE;
use super::weld::{WeldedTriangles, Welder, join};
use crate::LoadError;
use crate::shared::line::Line;
use crate::shared::mesh_diagnostics::MeshDiagnostics;
use crate::shared::mesh_file;
use crate::shared::names::{meant, quote};

/// Words with which lines may begin.
const WORDS: [&str; 7] = ["vertex", "endloop", "solid", "facet", "outer", "endfacet", "endsolid"];

/// Consecutive lines, the last of which ends a loop if others follow.
struct LinePiece<'a> {
    bytes: &'a [u8],
    /// Number of the first line.
    line: u32,
}

/// Reads the loops of a text, ignoring case. Unknown lines, and loops without exactly three
/// corners, are recorded as errors.
///
/// # Errors
/// Returns an error if the file ends within a loop, or there are too many vertices.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    faults: &mut MeshDiagnostics,
) -> Result<WeldedTriangles, LoadError> {
    let pieces = cut(bytes, PIECE);
    let work = |welder: &mut Welder, piece: &LinePiece| {
        let (mut loops, mut faults) = (Loops::new(welder), MeshDiagnostics::default());
        let mut last = piece.line;
        for (number, line) in (piece.line..).zip(piece.bytes.split(|b| *b == b'\n')) {
            let text = String::from_utf8_lossy(line);
            for text in statements(&text) {
                if let Err(fault) = loops.line(Line { path, number, text }) {
                    faults.add(fault);
                }
            }
            last = if line.is_empty() { last } else { number };
        }
        let end = loops.is_open().then_some(last);
        let triangles = std::mem::take(&mut loops.triangles);
        (welder.finish(), triangles, faults, end)
    };
    let parts: Vec<_> = pieces.par_iter().map_init(Welder::new, work).collect();
    let (mut triangles, mut vertices) = (Vec::new(), Vec::with_capacity(parts.len()));
    for (its_vertices, mut its_triangles, its_faults, end) in parts {
        faults.append(its_faults);
        if let Some(line) = end {
            return Err(mesh_file::error(
                path,
                line,
                "unexpected end of the file in a loop; it may be incomplete",
            ));
        }
        vertices.push((its_vertices, its_triangles.len()));
        triangles.append(&mut its_triangles);
    }
    join(&vertices, triangles, path)
}

/// Iterates over the statements of a line; most lines have one. If a line has several vertices,
/// each statement begins with a keyword of STL.
fn statements(line: &str) -> impl Iterator<Item = &str> {
    /// Lines of one statement are shorter.
    const SHORT: usize = 80;
    /// Words with which statements begin within lines.
    const WORDS: [&str; 6] = ["facet", "outer", "vertex", "endloop", "endfacet", "endsolid"];
    let has_several = line.len() > SHORT && {
        let vertices = line.split_ascii_whitespace().filter(|w| w.eq_ignore_ascii_case("vertex"));
        vertices.count() > 1
    };
    let mut rest = Some(line);
    std::iter::from_fn(move || {
        let text = rest.take()?;
        let begins = |at: &usize| {
            let word = text[*at..].split_ascii_whitespace().next().unwrap_or_default();
            WORDS.iter().any(|other| other.eq_ignore_ascii_case(word))
        };
        let spaces = text.char_indices().filter(|(_, c)| has_several && c.is_ascii_whitespace());
        let starts = spaces
            .map(|(at, _)| at + 1)
            .filter(|at| text[*at..].starts_with(|c: char| c.is_ascii_alphabetic()));
        // The first word of the text belongs to the statement.
        let first = text.len() - text.trim_ascii_start().len();
        let end = starts.filter(|at| *at > first).find(begins);
        rest = end.map(|at| &text[at..]);
        Some(end.map_or(text, |at| &text[..at]))
    })
}

/// Splits a text after ends of loops, into pieces of at least `least` bytes except the last one.
fn cut(bytes: &[u8], least: usize) -> Vec<LinePiece<'_>> {
    let (mut pieces, mut rest, mut line) = (Vec::new(), bytes, 1_u32);
    while !rest.is_empty() {
        let (piece, others) = rest.split_at(piece_end(rest, least));
        pieces.push(LinePiece { bytes: piece, line });
        line = line.saturating_add(memchr::memchr_iter(b'\n', piece).count() as u32);
        rest = others;
    }
    pieces
}

/// Returns the end of the first line that ends a loop and lies at least `least` bytes into the
/// text; otherwise the end of the text.
fn piece_end(text: &[u8], least: usize) -> usize {
    // The first of these lines may be the rest of one.
    let mut end = least.saturating_sub(1).min(text.len());
    let mut is_loop_end = false;
    while !is_loop_end {
        let Some(length) = memchr::memchr(b'\n', &text[end..]) else { return text.len() };
        let start = memchr::memrchr(b'\n', &text[..end]).map_or(0, |at| at + 1);
        is_loop_end = is_end_of_loop(&text[start..end + length]);
        end += length + 1;
    }
    end
}

fn is_end_of_loop(line: &[u8]) -> bool {
    let word = line.trim_ascii_start().split(u8::is_ascii_whitespace).next();
    word.is_some_and(|word| word.eq_ignore_ascii_case(b"endloop"))
}

/// Reader of the loops of a piece.
struct Loops<'w> {
    welder: &'w mut Welder,
    triangles: Vec<[u32; 3]>,
    /// Corners of the current loop.
    corners: Vec<[f32; 3]>,
    trouble: Trouble,
}

/// State of errors of the current loop.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Trouble {
    Nothing,
    /// A vertex has invalid numbers, so there is no triangle.
    Vertex,
    /// There were unknown lines: the state is unknown until the loop ends or a facet begins.
    Lost,
}

impl<'w> Loops<'w> {
    fn new(welder: &'w mut Welder) -> Self {
        let (triangles, corners) = (Vec::new(), Vec::new());
        Self { welder, triangles, corners, trouble: Trouble::Nothing }
    }

    /// Reads a line.
    fn line(&mut self, line: Line) -> Result<(), LoadError> {
        let word = line.keyword();
        let is = |other: &str| other.eq_ignore_ascii_case(word);
        if is("vertex") {
            return self.vertex(line);
        }
        if is("endloop") {
            return self.end(line);
        }
        if self.trouble == Trouble::Lost {
            if ["facet", "solid", "endsolid"].into_iter().any(is) {
                self.restart();
            }
        } else if !word.is_empty() && !WORDS.into_iter().any(is) {
            self.trouble = Trouble::Lost;
            let near = meant(word, WORDS.into_iter());
            let hint = if near.is_empty() { "; expected \"vertex\"" } else { &near };
            return Err(line.error(word, format!("unknown word {}{hint}", quote(word))));
        }
        Ok(())
    }

    fn vertex(&mut self, line: Line) -> Result<(), LoadError> {
        if self.trouble == Trouble::Lost {
            return Ok(());
        }
        if self.corners.len() == 3 {
            self.trouble = Trouble::Lost;
            return Err(
                line.error(line.keyword(), "found a loop of more than 3 corners, expected 3")
            );
        }
        let position = line.numbers(line.text.split_ascii_whitespace().skip(1));
        self.corners.push(*position.as_ref().unwrap_or(&[0.0; 3]));
        if position.is_err() {
            self.trouble = Trouble::Vertex;
        }
        position.map(drop)
    }

    /// Ends a loop.
    fn end(&mut self, line: Line) -> Result<(), LoadError> {
        let count = self.corners.len();
        let wrong = (self.trouble != Trouble::Lost && count != 3).then(|| {
            let message = format!("found a loop of {count} corners, expected 3");
            line.error(line.keyword(), message)
        });
        if let ([a, b, c], Trouble::Nothing) = (&self.corners[..], self.trouble) {
            self.triangles.push([*a, *b, *c].map(|corner| self.welder.vertex(corner)));
        }
        self.restart();
        wrong.map_or(Ok(()), Err)
    }

    fn restart(&mut self) {
        self.corners.clear();
        self.trouble = Trouble::Nothing;
    }

    /// Returns true if the loop is incomplete after the last line.
    fn is_open(&self) -> bool {
        !self.corners.is_empty() && self.trouble != Trouble::Lost
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of solids may contain such words; lines of one statement are unchanged.
    #[test]
    fn lines_of_several_statements_are_taken_apart() {
        let line = "solid part facet normal 0 0 1 outer loop vertex 0 0 0 vertex 1 0 0  VERTEX 0 1 0 endloop endfacet endsolid";
        let wanted = [
            "solid part ",
            "facet normal 0 0 1 ",
            "outer loop ",
            "vertex 0 0 0 ",
            "vertex 1 0 0  ",
            "VERTEX 0 1 0 ",
            "endloop ",
            "endfacet ",
            "endsolid",
        ];
        assert_eq!(statements(line).collect::<Vec<_>>(), wanted);
        for line in ["", "  vertex 0 0 0", "solid vertex cover of a facet", "facet normal 0 0 1 "] {
            assert_eq!(statements(line).collect::<Vec<_>>(), [line]);
        }
        let mut faults = MeshDiagnostics::default();
        let read = read(line.as_bytes(), Path::new("a.stl"), &mut faults).expect("a good file");
        assert_eq!(read.triangles.len(), 1);
    }

    /// In each case, the pieces contain all bytes in order, and have the right line numbers.
    #[test]
    fn texts_are_cut_behind_ends_of_loops() {
        let facet = "facet\n outer loop\n  vertex 0 0 0\n ENDLOOP\nendfacet\n";
        let text = format!("solid endloops\n{}endsolid", facet.repeat(5));
        for least in 1..text.len() + 2 {
            let pieces = cut(text.as_bytes(), least);
            assert_eq!(
                pieces.iter().map(|piece| piece.bytes).collect::<Vec<_>>().concat(),
                text.as_bytes()
            );
            let mut line = 1;
            for (i, piece) in pieces.iter().enumerate() {
                let is_last = i + 1 == pieces.len();
                assert!(
                    is_last || piece.bytes.ends_with(b"\n ENDLOOP\n") && piece.bytes.len() >= least
                );
                assert_eq!(piece.line, line);
                line += memchr::memchr_iter(b'\n', piece.bytes).count() as u32;
            }
            assert!(least > 20 || pieces.len() == 6, "{least}: {} pieces", pieces.len());
        }
    }
}
