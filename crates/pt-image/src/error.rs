//! Errors of image files.

use std::path::PathBuf;

use pt_io::WriteError;

/// Error of reading or writing an image.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file cannot be written.
    #[error(transparent)]
    Write(#[from] WriteError),
    /// No format with this file name extension supports the operation.
    #[error("{}: unknown image format; known extensions: {known}", path.display())]
    UnknownFormat {
        /// Path of the file.
        path: PathBuf,
        /// Supported extensions, separated by commas.
        known: String,
    },
    /// The content of the file is invalid or unsupported.
    #[error("{}: {message}", path.display())]
    Content {
        /// Path of the file.
        path: PathBuf,
        /// Description of the problem.
        message: String,
    },
    /// The image or its metadata cannot be represented in this format.
    #[error("{}: cannot be encoded: {message}", path.display())]
    Refused {
        /// Path of the file.
        path: PathBuf,
        /// Description of the problem.
        message: String,
    },
}
