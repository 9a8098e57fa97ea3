//! The files from which scenes are read: which they were, and what they held.

use std::path::{Path, PathBuf};

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Source {
    /// Its name, as it was asked for.
    pub path: PathBuf,
    /// The BLAKE3 hash of what it held, in hexadecimal digits.
    pub hash: String,
}

impl Source {
    /// A file that held these bytes.
    pub fn of(path: &Path, bytes: &[u8]) -> Self {
        Self { path: path.to_owned(), hash: blake3::hash(bytes).to_hex().to_string() }
    }
}
