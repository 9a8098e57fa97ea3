//! The files from which scenes are read: which they were, and what they held.

use std::cell::RefCell;
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

thread_local! {
    static NOTED: RefCell<Option<Vec<Source>>> = const { RefCell::new(None) };
}

/// Does something, and tells which files were read for it by this thread: each once for each time, in this
/// order.
pub fn noting<T>(work: impl FnOnce() -> T) -> (T, Vec<Source>) {
    let before = NOTED.replace(Some(Vec::new()));
    let done = work();
    let noted = NOTED.replace(before).unwrap_or_default();
    (done, noted)
}

/// Bytes from which on threads share the work on a file.
const LARGE: usize = 1 << 22;

/// Bytes up to which memory for a whole file is taken at once.
#[cfg(target_pointer_width = "64")]
const MOST: usize = 1 << 32;

/// Reads a file; threads read their parts of a large one, since to copy it into fresh memory takes longer than
/// what is done with most of it.
#[cfg(all(unix, target_pointer_width = "64"))]
fn read_whole(path: &Path) -> io::Result<Vec<u8>> {
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
#[cfg(not(all(unix, target_pointer_width = "64")))]
fn read_whole(path: &Path) -> io::Result<Vec<u8>> {
    std::fs::read(path)
}

/// Reads a file, and notes it if somebody wants to know.
///
/// # Errors
/// Those of [`std::fs::read`].
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = read_whole(path)?;
    NOTED.with_borrow_mut(|noted| {
        if let Some(noted) = noted {
            let mut hasher = blake3::Hasher::new();
            if bytes.len() < LARGE {
                hasher.update(&bytes)
            } else {
                hasher.update_rayon(&bytes)
            };
            let hash = hasher.finalize().to_hex().to_string();
            noted.push(Source { path: path.to_owned(), hash });
        }
    });
    Ok(bytes)
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
        let (bytes, noted) = noting(|| read(&path).expect("it is there"));
        assert!(bytes == written);
        assert_eq!(noted[0].hash, blake3::hash(&written).to_hex().as_str());
    }

    #[test]
    fn files_are_noted_where_that_is_asked_for() {
        let folder = tempfile::tempdir().expect("a folder");
        let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
        std::fs::write(&a, "one").expect("there is room");
        std::fs::write(&b, "two").expect("there is room");
        read(&a).expect("it is there");
        let ((), outer) = noting(|| {
            read(&b).expect("it is there");
            let (bytes, inner) = noting(|| read(&a).expect("it is there"));
            assert_eq!((bytes.as_slice(), inner.len()), (b"one".as_slice(), 1));
            assert!(read(&folder.path().join("c")).is_err());
            read(&a).expect("it is there");
        });
        let paths: Vec<_> = outer.iter().map(|source| &source.path).collect();
        assert_eq!(paths, [&b, &a]);
        assert_eq!(outer[1].hash, blake3::hash(b"one").to_hex().as_str());
        assert_eq!(noting(|| ()).1, []);
    }
}
