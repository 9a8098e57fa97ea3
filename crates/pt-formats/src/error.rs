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
        /// Error of the system.
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
        /// Problem, expected value and remedy.
        message: String,
    },
    /// The content is wrong, or takes more than it may, so that nothing more can be read.
    #[error("{at}: {message}")]
    Broken {
        /// Where.
        at: Span,
        /// Problem, expected value and remedy.
        message: String,
    },
    /// Several things are wrong, in the order of the file.
    #[error("{}", list(.0))]
    Several(Vec<LoadError>),
    /// It follows from an error that was told already.
    #[error("this follows from another error")]
    AlreadyReported,
}

impl LoadError {
    /// Most errors of a list that are shown.
    pub const MAX_SHOWN: usize = 100;

    /// Where it is; `None` if that is no place in a file.
    pub fn place(&self) -> Option<&Span> {
        match self {
            Self::Content { at, .. } | Self::Broken { at, .. } => Some(at),
            _ => None,
        }
    }

    /// Each thing that is wrong.
    pub fn each(&self) -> &[Self] {
        match self {
            Self::Several(errors) => errors,
            _ => std::slice::from_ref(self),
        }
    }
}

/// One line for each error, as far as these are shown.
fn list(errors: &[LoadError]) -> String {
    let mut lines: Vec<_> =
        errors.iter().take(LoadError::MAX_SHOWN).map(ToString::to_string).collect();
    if let Some(more) = errors.len().checked_sub(LoadError::MAX_SHOWN).filter(|more| *more > 0) {
        lines.push(format!("… and {more} more"));
    }
    lines.join("\n")
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
