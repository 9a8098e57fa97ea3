//! Reading of regular files that fit into memory.

use std::fs::{self, File};
use std::io::{self, Error, ErrorKind, Read};
use std::path::{Component, Path, PathBuf};

/// Returns the length of a regular file in bytes. Pipes and devices are rejected, since reading
/// them may block or never end.
///
/// # Errors
/// Returns an error if the path is no regular file, or its metadata cannot be read.
pub fn length(path: &Path) -> io::Result<u64> {
    let found = fs::metadata(path)?;
    if found.is_file() {
        return Ok(found.len());
    }
    let kind = if found.is_dir() { "a folder" } else { "a pipe or a device" };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {kind}, and no regular file")))
}

/// Opens a regular file.
///
/// # Errors
/// Returns the errors of [`length`] and [`File::open`].
pub fn open(path: &Path) -> io::Result<File> {
    length(path)?;
    File::open(path)
}

/// Reads a regular file, after a request to the memory ledger.
///
/// # Errors
/// Returns the errors of [`open`], and an error if there is too little memory or the file cannot be
/// read.
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let (bytes, file) = (length(path)?, File::open(path)?);
    let _grant = pt_memory::ask(bytes).map_err(|why| Error::new(ErrorKind::OutOfMemory, why))?;
    let mut content = Vec::with_capacity(usize::try_from(bytes).unwrap_or(0));
    // Bytes appended during the read are ignored.
    file.take(bytes).read_to_end(&mut content)?;
    Ok(content)
}

/// Returns a path without `..` and symbolic links; components that do not exist are kept as
/// written.
pub fn resolved(path: &Path) -> PathBuf {
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let known = absolute.ancestors().find_map(|part| Some((part, part.canonicalize().ok()?)));
    let Some((part, mut real)) = known else { return absolute };
    for component in absolute.strip_prefix(part).unwrap_or(Path::new("")).components() {
        match component {
            Component::ParentDir => drop(real.pop()),
            other => real.push(other),
        }
    }
    real
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn pipes_devices_and_folders_are_not_opened() {
        let folder = tempfile::tempdir().expect("a folder");
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status();
        assert!(made.is_ok_and(|status| status.success()));
        for (path, kind) in [
            (pipe.as_path(), "a pipe or a device"),
            (Path::new("/dev/zero"), "a pipe or a device"),
            (folder.path(), "a folder"),
        ] {
            let error = read(path).expect_err("no regular file").to_string();
            assert_eq!(error, format!("it is {kind}, and no regular file"));
        }
        let plain = folder.path().join("plain");
        fs::write(&plain, b"plain").expect("there is room");
        assert_eq!(read(&plain).expect("a regular file"), b"plain");
    }
}
