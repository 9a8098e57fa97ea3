//! Positions in the text of a scene.

use std::path::Path;
use std::sync::Arc;

use pt_scene::Span;

use crate::LoadError;

/// A position in a file.
#[derive(Clone, Debug)]
pub(super) struct TokenPosition {
    pub(super) file: Arc<Path>,
    pub(super) line: u32,
    pub(super) column: u32,
}

impl TokenPosition {
    /// Converts the position to a span; `element` may be empty.
    pub(super) fn span(&self, element: &str) -> Span {
        let Self { file, line, column } = self;
        Span { file: file.to_path_buf(), line: *line, column: *column, element: element.to_owned() }
    }

    /// Returns an error at this position.
    pub(super) fn error(&self, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.span(""), message: message.into() }
    }
}
