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

/// Reads a file, and notes it if somebody wants to know.
///
/// # Errors
/// Those of [`std::fs::read`].
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let bytes = std::fs::read(path)?;
    NOTED.with_borrow_mut(|noted| {
        if let Some(noted) = noted {
            let hash = blake3::hash(&bytes).to_hex().to_string();
            noted.push(Source { path: path.to_owned(), hash });
        }
    });
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

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
