//! Errors of reading files: location, problem, expected value and remedy.

use std::path::PathBuf;

use pt_scene::Span;

/// Error of reading a file.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Io {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// No format has this file name extension.
    #[error("{}: unknown scene format; known extensions: {known}", path.display())]
    UnknownFormat {
        /// Path of the file.
        path: PathBuf,
        /// Supported extensions, separated by commas.
        known: String,
    },
    /// The content is invalid.
    #[error("{at}: {message}")]
    Content {
        /// Location in the file.
        at: Span,
        /// Problem, expected value and remedy.
        message: String,
    },
    /// The content is invalid or exceeds a limit, and nothing more can be read.
    #[error("{at}: {message}")]
    Broken {
        /// Location in the file.
        at: Span,
        /// Problem, expected value and remedy.
        message: String,
    },
    /// Several errors, in file order.
    #[error("{}", list(.0))]
    Several(Vec<LoadError>),
    /// Consequence of an error that was reported before.
    #[error("consequence of another error")]
    AlreadyReported,
}

impl LoadError {
    /// Maximum number of errors of a list that are displayed.
    pub const MAX_SHOWN: usize = 100;

    /// Returns the location in the file; `None` if there is none.
    pub fn place(&self) -> Option<&Span> {
        match self {
            Self::Content { at, .. } | Self::Broken { at, .. } => Some(at),
            _ => None,
        }
    }

    /// Returns the message without the location.
    pub fn message(&self) -> String {
        match self {
            Self::Content { message, .. } | Self::Broken { message, .. } => message.clone(),
            other => other.to_string(),
        }
    }

    /// Returns the individual errors.
    pub fn each(&self) -> &[Self] {
        match self {
            Self::Several(errors) => errors,
            _ => std::slice::from_ref(self),
        }
    }
}

/// Formats one line per error, up to the maximum.
fn list(errors: &[LoadError]) -> String {
    let mut lines: Vec<_> =
        errors.iter().take(LoadError::MAX_SHOWN).map(ToString::to_string).collect();
    if let Some(more) = errors.len().checked_sub(LoadError::MAX_SHOWN).filter(|more| *more > 0) {
        lines.push(format!("… and {more} more"));
    }
    lines.join("\n")
}
