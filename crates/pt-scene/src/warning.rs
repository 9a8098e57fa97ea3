//! Warnings about files.

use std::fmt;

use crate::Span;

/// A warning about content that was read, but whose interpretation may differ from the author's
/// intent.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Location in the file.
    pub at: Span,
    /// Action taken, and the reason.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.message)
    }
}
