//! The files from which scenes are read: which they were, and what they held.

use std::io;
use std::path::{Path, PathBuf};

#[cfg(all(unix, target_pointer_width = "64"))]
use blake3::hazmat::{ChainingValue, Mode, merge_subtrees_non_root, merge_subtrees_root};

/// A file that was read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceFile {
    /// Its name, as it was asked for.
    pub path: PathBuf,
    /// The BLAKE3 hash of what it held, in hexadecimal digits.
    pub hash: String,
}

impl SourceFile {
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
const MAX: usize = 1 << 32;

/// Bytes that a thread reads and hashes at a time: they stay in the memory close to its core in
/// between. A power of two, as trees of BLAKE3 are cut at those.
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) const PART: usize = 1 << 18;

/// The hash of a part of a file, which begins at a multiple of [`PART`] and is as long as that,
/// unless it is the last one.
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) type PartHash = ChainingValue;

/// A large file, of which threads read and hash the parts.
#[cfg(all(unix, target_pointer_width = "64"))]
pub(crate) struct Large<'p> {
    path: &'p Path,
    file: std::fs::File,
    /// Bytes; several parts.
    pub(crate) length: usize,
}

#[cfg(all(unix, target_pointer_width = "64"))]
impl<'p> Large<'p> {
    /// Opens a file; `None` if it is small, too large to be held, or no regular one.
    ///
    /// # Errors
    /// Those of [`std::fs::File::open`].
    pub(crate) fn open(path: &'p Path) -> io::Result<Option<Self>> {
        let file = crate::file::open(path)?;
        let data = file.metadata()?;
        let length = usize::try_from(data.len()).unwrap_or(usize::MAX);
        let is_large = data.is_file() && (LARGE..MAX).contains(&length);
        Ok(is_large.then_some(Self { path, file, length }))
    }

    /// Reads the bytes from a place on, until the buffer is full.
    ///
    /// # Errors
    /// If the file cannot be read, or is not as long any more.
    pub(crate) fn read(&self, start: usize, buffer: &mut [u8]) -> io::Result<()> {
        std::os::unix::fs::FileExt::read_exact_at(&self.file, buffer, start as u64)
    }

    /// The hash of the part with the number `i`.
    pub(crate) fn hash(i: usize, part: &[u8]) -> PartHash {
        use blake3::hazmat::HasherExt;

        let mut hasher = blake3::Hasher::new();
        hasher.set_input_offset((i * PART) as u64).update(part).finalize_non_root()
    }

    /// What the file held, from the hashes of all its parts.
    pub(crate) fn source(&self, parts: &[PartHash]) -> SourceFile {
        SourceFile { path: self.path.to_owned(), hash: root(parts).to_hex().to_string() }
    }
}

/// Reads a file; threads read and hash their parts of a large one, since to copy it into fresh
/// memory takes longer than what is done with most of it.
///
/// # Errors
/// Those of [`crate::file::read`].
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

/// The hash of a file from those of its parts, of which there are at least two.
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

/// The two subtrees of a tree of at least two parts: the left one has the most parts that are a
/// power of two and not all. [O'Connor, Aumasson, Neves & Wilcox-O'Hearn 2020, "BLAKE3: one
/// function, fast everywhere", §2.1]
#[cfg(all(unix, target_pointer_width = "64"))]
fn halves(parts: &[PartHash]) -> [&[PartHash]; 2] {
    let (left, right) = parts.split_at(parts.len().next_power_of_two() / 2);
    [left, right]
}

/// Reads a file.
///
/// # Errors
/// Those of [`crate::file::read`].
#[cfg(not(all(unix, target_pointer_width = "64")))]
pub(crate) fn read(path: &Path) -> io::Result<(Vec<u8>, SourceFile)> {
    read_whole(path)
}

fn read_whole(path: &Path) -> io::Result<(Vec<u8>, SourceFile)> {
    let bytes = crate::file::read(path)?;
    let source = SourceFile::of(path, &bytes);
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
            assert_eq!(source, SourceFile::of(&path, &bytes));
        }
    }
}
