//! What can go wrong with image files.

use std::path::PathBuf;

/// Why an image could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file cannot be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The file cannot be created, written, or put into its place.
    #[error("{}: cannot be written: {source}", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// Nothing can be created in the folder of the file.
    #[error("{}: cannot write into the folder {}: {source}", path.display(), folder.display())]
    Folder {
        /// The file.
        path: PathBuf,
        /// Its folder.
        folder: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// The ending of the name belongs to no format that can do this.
    #[error("{}: unknown image format; the endings known are {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The endings known, separated by commas.
        known: String,
    },
    /// The content of the file is wrong.
    #[error("{}: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// Description of the problem.
        message: String,
    },
    /// The image or its metadata cannot be written in this format.
    #[error("{}: cannot be encoded: {message}", path.display())]
    Refused {
        /// The file.
        path: PathBuf,
        /// What does not fit.
        message: String,
    },
}
