//! Source files of a scene.

use std::path::PathBuf;

/// A file from which a scene was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Path as it was requested.
    pub path: PathBuf,
    /// BLAKE3 hash of the content, in hexadecimal digits.
    pub hash: String,
}
