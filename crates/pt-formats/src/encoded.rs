//! Encoded scenes.

use std::path::PathBuf;

/// An encoded scene.
#[derive(Debug, Default)]
pub struct Encoded {
    /// Content of the file.
    pub bytes: Vec<u8>,
    /// Further files to which it refers: their paths relative to its folder, and their contents.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// Warnings about what the format cannot represent, without duplicates.
    pub notes: Vec<String>,
}
