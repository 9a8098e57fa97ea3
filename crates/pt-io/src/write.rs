//! Atomic writing of files.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// Error of writing a file.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    /// The file cannot be created, written or renamed.
    #[error("{}: cannot be written: {source}", path.display())]
    File {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// Nothing can be created in the folder of the file.
    #[error("{}: cannot write into the folder {}: {source}", path.display(), folder.display())]
    Folder {
        /// Path of the file.
        path: PathBuf,
        /// Folder of the file.
        folder: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
}

/// Writes a file atomically: into a temporary file in the same folder, which is then renamed to the
/// target. Readers see either the old or the new content; after an error, the old. On return, both
/// the content and the name are on disk, so that files which this one replaces may be removed.
///
/// Symbolic links are followed. Targets that are no regular files (`/dev/stdout`) are written to
/// directly, except for named pipes, which may have no reader.
///
/// # Errors
/// Returns an error if the folder does not exist, nothing can be created in it, or the file cannot
/// be written.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), WriteError> {
    let failed = |source| WriteError::File { path: path.to_owned(), source };
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    match fs::metadata(&target) {
        Ok(found) if found.is_dir() => {
            return Err(failed(io::Error::new(io::ErrorKind::IsADirectory, "it is a folder")));
        }
        Ok(found) if is_named_pipe(&target, &found) => return Err(failed(named_pipe())),
        Ok(found) if !found.is_file() => return fs::write(&target, bytes).map_err(failed),
        _ => {}
    }
    let folder = folder_of(&target);
    let file = match temporary_in(&folder) {
        Ok(file) => file,
        Err(source) => {
            return Err(WriteError::Folder { path: path.to_owned(), folder, source });
        }
    };
    place(&mut System, file, bytes, &target).map_err(failed)
}

/// Returns true if a path is that of a named pipe in a folder; pipes that the process inherited are
/// open already.
#[cfg(unix)]
fn is_named_pipe(path: &Path, found: &fs::Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    found.file_type().is_fifo() && fs::canonicalize(path).is_ok()
}

#[cfg(not(unix))]
fn is_named_pipe(_: &Path, _: &fs::Metadata) -> bool {
    false
}

fn named_pipe() -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, "it is a pipe; expected the name of a file")
}

/// Checks that a path is no named pipe, since [`write_atomically`] does not write to these.
///
/// # Errors
/// Returns an error if it is one.
pub fn check_target(path: &Path) -> Result<(), WriteError> {
    let failed = |source| WriteError::File { path: path.to_owned(), source };
    match fs::metadata(path) {
        Ok(found) if is_named_pipe(path, &found) => Err(failed(named_pipe())),
        _ => Ok(()),
    }
}

/// File operations, as a trait so that tests can record their order.
trait Disk {
    /// Writes the content of a file.
    fn write(&mut self, file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()>;
    /// Flushes the content of a file to disk.
    fn sync(&mut self, file: &NamedTempFile) -> io::Result<()>;
    /// Renames a file to its target.
    fn rename(&mut self, file: NamedTempFile, target: &Path) -> io::Result<()>;
    /// Flushes the directory entries of a folder to disk.
    fn sync_folder(&mut self, folder: &Path) -> io::Result<()>;
}

struct System;

impl Disk for System {
    fn write(&mut self, file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()> {
        file.write_all(bytes)
    }

    fn sync(&mut self, file: &NamedTempFile) -> io::Result<()> {
        file.as_file().sync_all()
    }

    fn rename(&mut self, file: NamedTempFile, target: &Path) -> io::Result<()> {
        file.persist(target).map(drop).map_err(|e| e.error)
    }

    fn sync_folder(&mut self, folder: &Path) -> io::Result<()> {
        sync_folder(folder)
    }
}

/// Writes the content of a file and renames it; each step is on disk before the next one.
fn place(
    disk: &mut impl Disk,
    mut file: NamedTempFile,
    bytes: &[u8],
    target: &Path,
) -> io::Result<()> {
    disk.write(&mut file, bytes)?;
    disk.sync(&file)?;
    disk.rename(file, target)?;
    disk.sync_folder(&folder_of(target))
}

/// Flushes the directory entries of a folder to disk. Does nothing if the system has no such call,
/// or the folder is writable but not readable.
///
/// # Errors
/// Returns an error if the folder does not exist, or the disk fails.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    use io::ErrorKind::{InvalidInput, PermissionDenied, Unsupported};
    if cfg!(not(unix)) {
        return Ok(());
    }
    match File::open(folder).and_then(|folder| folder.sync_all()) {
        Err(e) if [InvalidInput, PermissionDenied, Unsupported].contains(&e.kind()) => Ok(()),
        result => result,
    }
}

/// Returns the folder that contains a path; `.` for a bare name.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Creates a temporary file with the permissions of any other new file.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".pathtracer-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The system removes the permissions that the user's mask forbids.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Records the operations, and executes them up to a step that fails.
    #[derive(Default)]
    struct Log {
        steps: Vec<&'static str>,
        fails: Option<&'static str>,
    }

    impl Log {
        fn step(&mut self, name: &'static str) -> io::Result<()> {
            self.steps.push(name);
            if self.fails == Some(name) { Err(io::Error::other("no disk")) } else { Ok(()) }
        }
    }

    impl Disk for Log {
        fn write(&mut self, file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()> {
            self.step("write").and_then(|()| System.write(file, bytes))
        }

        fn sync(&mut self, file: &NamedTempFile) -> io::Result<()> {
            self.step("sync").and_then(|()| System.sync(file))
        }

        fn rename(&mut self, file: NamedTempFile, target: &Path) -> io::Result<()> {
            self.step("rename").and_then(|()| System.rename(file, target))
        }

        fn sync_folder(&mut self, folder: &Path) -> io::Result<()> {
            self.step("sync folder").and_then(|()| System.sync_folder(folder))
        }
    }

    const STEPS: [&str; 4] = ["write", "sync", "rename", "sync folder"];

    /// The content is on disk before the name is, and the name before the call returns. If any step
    /// fails, an error is returned and no later step is executed; until the rename, the old content
    /// remains.
    #[test]
    fn a_file_is_on_the_disk_before_its_name_and_both_before_the_end() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.png");
        let with = |fails: Option<&'static str>| {
            fs::write(&path, b"old").expect("there is room");
            let mut log = Log { fails, ..Log::default() };
            let file = temporary_in(folder.path()).expect("there is room");
            let result = place(&mut log, file, b"new", &path);
            (log.steps, result.is_ok(), fs::read(&path).expect("it is there"))
        };
        assert_eq!(with(None), (STEPS.to_vec(), true, b"new".to_vec()));
        for (i, step) in STEPS.into_iter().enumerate() {
            let content = if i < 3 { b"old" } else { b"new" };
            assert_eq!(with(Some(step)), (STEPS[..=i].to_vec(), false, content.to_vec()), "{step}");
        }
        let left = fs::read_dir(folder.path()).expect("it is there").count();
        assert_eq!(left, 1, "no temporary file is left");
    }
}
