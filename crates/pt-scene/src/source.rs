//! The files from which scenes are read: which they were, and what they held.

use std::io;
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
        let mut hasher = blake3::Hasher::new();
        if bytes.len() < LARGE {
            hasher.update(bytes);
        } else {
            hasher.update_rayon(bytes);
        }
        Self { path: path.to_owned(), hash: hasher.finalize().to_hex().to_string() }
    }
}

/// Bytes from which on threads share the work on a file.
const LARGE: usize = 1 << 22;

/// Bytes up to which memory for a whole file is taken at once.
#[cfg(target_pointer_width = "64")]
const MOST: usize = 1 << 32;

/// Reads a file; threads read their parts of a large one, since to copy it into fresh memory takes longer than
/// what is done with most of it.
///
/// # Errors
/// Those of [`std::fs::read`].
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    use std::os::unix::fs::FileExt;

    use rayon::prelude::*;

    let file = std::fs::File::open(path)?;
    let data = file.metadata()?;
    let length = usize::try_from(data.len()).unwrap_or(usize::MAX);
    if !data.is_file() || !(LARGE..MOST).contains(&length) {
        return std::fs::read(path);
    }
    let mut bytes = vec![0; length];
    let parts = bytes.par_chunks_mut(LARGE / 2).enumerate();
    parts.try_for_each(|(i, part)| file.read_exact_at(part, (i * (LARGE / 2)) as u64))?;
    Ok(bytes)
}

/// Reads a file.
///
/// # Errors
/// Those of [`std::fs::read`].
#[cfg(not(all(unix, target_pointer_width = "64")))]
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    std::fs::read(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_files_are_read_as_they_are() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("large");
        let written: Vec<u8> = (0..2 * LARGE + 12_345).map(|i| (i * i / 7) as u8).collect();
        std::fs::write(&path, &written).expect("there is room");
        let bytes = read(&path).expect("it is there");
        assert!(bytes == written);
        assert_eq!(Source::of(&path, &bytes).hash, blake3::hash(&written).to_hex().as_str());
    }
}
