//! Texts.

use std::path::Path;

use rayon::prelude::*;

use super::super::line::Line;
use super::super::mesh_file;
use super::super::xml::quote;
use super::PIECE;
use super::weld::{Welded, Welder, join};
use crate::LoadError;

/// Words with which lines may begin, besides `vertex` and `endloop`.
const WORDS: [&str; 5] = ["solid", "facet", "outer", "endfacet", "endsolid"];

/// Some lines, of which the last one ends a loop if others follow.
struct Piece<'a> {
    bytes: &'a [u8],
    /// Number of its first line.
    line: u32,
}

/// Reads the loops of a text; case does not matter.
///
/// # Errors
/// If a line is not understood, a loop has other than three corners, or the file ends in one.
pub(super) fn read(bytes: &[u8], path: &Path) -> Result<Welded, LoadError> {
    let pieces = cut(bytes, PIECE);
    let work = |welder: &mut Welder, piece: &Piece| {
        let triangles = piece.triangles(path, welder);
        let vertices = welder.finish();
        triangles.map(|triangles| (vertices, triangles))
    };
    let parts: Vec<_> = pieces.par_iter().map_init(Welder::new, work).collect();
    let (mut triangles, mut vertices) = (Vec::new(), Vec::with_capacity(parts.len()));
    for part in parts {
        let (its_vertices, mut its_triangles) = part?;
        vertices.push((its_vertices, its_triangles.len()));
        triangles.append(&mut its_triangles);
    }
    join(&vertices, triangles, path)
}

/// Cuts a text behind ends of loops, into pieces of at least so many bytes but for the last one.
fn cut(bytes: &[u8], least: usize) -> Vec<Piece<'_>> {
    let (mut pieces, mut rest, mut line) = (Vec::new(), bytes, 1_u32);
    while !rest.is_empty() {
        let (piece, others) = rest.split_at(piece_end(rest, least));
        pieces.push(Piece { bytes: piece, line });
        line = line.saturating_add(memchr::memchr_iter(b'\n', piece).count() as u32);
        rest = others;
    }
    pieces
}

/// Where the first line ends that ends a loop and ends behind so many bytes; otherwise where the text does.
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

impl Piece<'_> {
    fn triangles(&self, path: &Path, welder: &mut Welder) -> Result<Vec<[u32; 3]>, LoadError> {
        let (mut triangles, mut corners) = (Vec::new(), Vec::new());
        for (number, line) in (self.line..).zip(self.bytes.split(|b| *b == b'\n')) {
            let text = String::from_utf8_lossy(line);
            let line = Line { path, number, text: &text };
            let word = line.keyword();
            if word.eq_ignore_ascii_case("vertex") {
                let position: [f32; 3] = line.numbers(text.split_ascii_whitespace().skip(1))?;
                corners.push(position);
            } else if word.eq_ignore_ascii_case("endloop") {
                let [a, b, c] = corners[..] else {
                    let message = format!("the loop has {} corners; expected 3", corners.len());
                    return Err(line.error(word, message));
                };
                triangles.push([a, b, c].map(|corner| welder.vertex(corner)));
                corners.clear();
            } else if !word.is_empty() && !WORDS.iter().any(|w| w.eq_ignore_ascii_case(word)) {
                let message = format!("{} is no word of STL; expected \"vertex\"", quote(word));
                return Err(line.error(word, message));
            }
            if corners.len() > 3 {
                return Err(line.error(word, "the loop has more than 3 corners"));
            }
        }
        if corners.is_empty() {
            return Ok(triangles);
        }
        Err(mesh_file::error(path, 0, "the file ends in a loop; is it complete?"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// In each case all bytes are in one piece, in their order, and pieces know their lines.
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
