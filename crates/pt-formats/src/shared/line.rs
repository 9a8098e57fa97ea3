//! Lines of text formats of meshes.

use std::path::Path;

use pt_scene::Span;

use super::decimal::leading_f32;
use super::mesh_file;
use super::names::quote;
use super::source_map;
use crate::LoadError;

/// A line of a file.
#[derive(Clone, Copy)]
pub(crate) struct Line<'a> {
    pub(crate) path: &'a Path,
    /// Line number, from 1.
    pub(crate) number: u32,
    /// Text without the comment.
    pub(crate) text: &'a str,
}

impl<'a> Line<'a> {
    /// Returns the first word.
    pub(crate) fn keyword(&self) -> &'a str {
        self.text.split_ascii_whitespace().next().unwrap_or_default()
    }

    /// Parses the first `N` words as numbers; further words are not consumed.
    pub(crate) fn numbers<const N: usize>(
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
            let quick = leading_f32(word.as_bytes()).map(|(number, _)| number);
            let parsed: Option<f32> = quick.or_else(|| word.parse().ok());
            *number = parsed.filter(|x| x.is_finite()).ok_or_else(|| {
                let message =
                    format!("found {}, expected a finite number such as 0.5", quote(word));
                self.error(word, message)
            })?;
        }
        Ok(numbers)
    }

    /// Returns the location of a piece of the line.
    pub(crate) fn at(&self, piece: &str) -> Span {
        let bytes = piece.as_ptr().addr().saturating_sub(self.text.as_ptr().addr());
        let column = source_map::column(self.text, bytes);
        Span { column, ..mesh_file::place(self.path, self.number) }
    }

    pub(crate) fn error(&self, piece: &str, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.at(piece), message: message.into() }
    }
}
