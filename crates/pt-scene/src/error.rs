//! Errors and warnings about files: where, what, what was expected, what to do.

use std::fmt;
use std::path::PathBuf;

use crate::Span;

/// Why a file could not be read.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// The ending of the name belongs to no format.
    #[error("{}: unknown scene format; the endings known are {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The endings known, separated by commas.
        known: String,
    },
    /// The content is wrong.
    #[error("{at}: {message}")]
    Content {
        /// Where.
        at: Span,
        /// What is wrong, what was expected, and what to do.
        message: String,
    },
}

/// Something in a file that was understood, but not as its author may have meant it.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// Where.
    pub at: Span,
    /// What was done, and why.
    pub message: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.at, self.message)
    }
}
