//! Records of the source files of a scene: paths and hashes.

use std::io;
use std::path::Path;

#[cfg(all(unix, target_pointer_width = "64"))]
use blake3::hazmat::{ChainingValue, Mode, merge_subtrees_non_root, merge_subtrees_root};
use pt_scene::SourceFile;

/// Returns the record of a file with this content.
pub fn source_file(path: &Path, bytes: &[u8]) -> SourceFile {
    SourceFile { path: path.to_owned(), hash: hash_of(bytes) }
}

/// Returns the hash of a content.
pub(crate) fn hash_of(bytes: &[u8]) -> String {
    let mut hasher = blake3::Hasher::new();
    if bytes.len() < LARGE {
        hasher.update(bytes);
    } else {
        hasher.update_rayon(bytes);
    }
    hasher.finalize().to_hex().to_string()
}

/// Number of bytes from which a file is processed by several threads.
const LARGE: usize = 1 << 22;

/// Maximum number of bytes of a file for which memory is allocated at once.
#[cfg(all(unix, target_pointer_width = "64"))]
const MAX: usize = 1 << 32;

/// Number of bytes that a thread reads and hashes at a time, so that they stay in its cache in
/// between. A power of two, since the trees of BLAKE3 are split at those.
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) const PART: usize = 1 << 18;

/// Hash of a part of a file, which begins at a multiple of [`PART`] and has that length, unless it
/// is the last one.
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) type PartHash = ChainingValue;

/// A large file, whose parts are read and hashed by several threads.
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) struct Large<'p> {
    path: &'p Path,
    file: std::fs::File,
    /// Length in bytes; more than one part.
    pub(crate) length: usize,
}

#[cfg(all(unix, target_pointer_width = "64"))]
impl<'p> Large<'p> {
    /// Opens a file; `None` if it is small, too large for memory, or no regular file.
    ///
    /// # Errors
    /// Returns the errors of [`std::fs::File::open`].
    pub(crate) fn open(path: &'p Path) -> io::Result<Option<Self>> {
        let file = pt_io::file::open(path)?;
        let data = file.metadata()?;
        let length = usize::try_from(data.len()).unwrap_or(usize::MAX);
        let is_large = data.is_file() && (LARGE..MAX).contains(&length);
        Ok(is_large.then_some(Self { path, file, length }))
    }

    /// Reads the bytes from an offset until the buffer is full.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, or has been truncated.
    pub(crate) fn read(&self, start: usize, buffer: &mut [u8]) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(&self.file, buffer, start as u64)
    }

    /// Returns the hash of part number `i`.
    pub(crate) fn hash(i: usize, part: &[u8]) -> PartHash {
        use blake3::hazmat::HasherExt;

        let mut hasher = blake3::Hasher::new();
        hasher.set_input_offset((i * PART) as u64).update(part).finalize_non_root()
    }

    /// Returns the record of the file, from the hashes of all its parts.
    pub(crate) fn source(&self, parts: &[PartHash]) -> SourceFile {
        SourceFile { path: self.path.to_owned(), hash: root(parts).to_hex().to_string() }
    }
}

/// Reads a file. Several threads read and hash the parts of a large file, since copying it into
/// fresh memory takes longer than most of its processing.
///
/// # Errors
/// Returns the errors of [`pt_io::file::read`].
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) fn read(path: &Path) -> io::Result<(Vec<u8>, SourceFile)> {
    use rayon::prelude::*;

    let Some(file) = Large::open(path)? else { return read_whole(path) };
    let _grant = pt_memory::ask(file.length as u64)
        .map_err(|why| io::Error::new(io::ErrorKind::OutOfMemory, why))?;
    let mut bytes = pt_memory::zeros(file.length);
    let parts = bytes.par_chunks_mut(PART).enumerate();
    let hashes = parts.map(|(i, part)| {
        file.read(i * PART, part)?;
        Ok(Large::hash(i, part))
    });
    let source = file.source(&hashes.collect::<io::Result<Vec<_>>>()?);
    Ok((bytes, source))
}

/// Returns the hash of a file from those of its parts, of which there are at least two.
#[cfg(all(unix, target_pointer_width = "64"))]
fn root(parts: &[PartHash]) -> blake3::Hash {
    let [left, right] = halves(parts).map(subtree);
    merge_subtrees_root(&left, &right, Mode::Hash)
}

#[cfg(all(unix, target_pointer_width = "64"))]
fn subtree(parts: &[PartHash]) -> PartHash {
    if let [part] = parts {
        return *part;
    }
    let [left, right] = halves(parts).map(subtree);
    merge_subtrees_non_root(&left, &right, Mode::Hash)
}

/// Returns the two subtrees of a tree of at least two parts: the left one has the largest number of
/// parts that is a power of two and less than all. [O'Connor, Aumasson, Neves & Wilcox-O'Hearn
/// 2020, "BLAKE3: one function, fast everywhere", §2.1]
#[cfg(all(unix, target_pointer_width = "64"))]
fn halves(parts: &[PartHash]) -> [&[PartHash]; 2] {
    let (left, right) = parts.split_at(parts.len().next_power_of_two() / 2);
    [left, right]
}

/// Reads a file.
///
/// # Errors
/// Returns the errors of [`pt_io::file::read`].
#[cfg(not(all(unix, target_pointer_width = "64")))]
pub(crate) fn read(path: &Path) -> io::Result<(Vec<u8>, SourceFile)> {
    read_whole(path)
}

fn read_whole(path: &Path) -> io::Result<(Vec<u8>, SourceFile)> {
    let bytes = pt_io::file::read(path)?;
    let source = source_file(path, &bytes);
    Ok((bytes, source))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn large_files_are_read_as_they_are() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("large");
        let written: Vec<u8> = (0..2 * LARGE + 12_345).map(|i| (i * i / 7) as u8).collect();
        for length in [12, LARGE, LARGE + 1, LARGE + PART + 1024, 2 * LARGE, written.len()] {
            let written = &written[..length];
            std::fs::write(&path, written).expect("there is room");
            let (bytes, source) = read(&path).expect("it is there");
            assert!(bytes == written);
            assert_eq!(source.hash, blake3::hash(written).to_hex().as_str());
            assert_eq!(source, source_file(&path, &bytes));
        }
    }
}
