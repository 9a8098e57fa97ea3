//! Writing files so that nobody ever sees half of one.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use super::ImageError;

/// Writes a file in one step: into a temporary file in the same folder, which then takes the name
/// of the file. Whoever reads it sees the old content or the new one; after an error, the old. When
/// it returns, the disk has the content and then the name, so that what the file takes the place of
/// may be removed.
///
/// A link is followed, and what is no regular file (`/dev/stdout`) is written to directly, but for
/// named pipes, of which nobody may ever read.
///
/// # Errors
/// If the folder does not exist or nothing can be created in it, or the file cannot be written.
pub fn write_atomically(path: &Path, bytes: &[u8]) -> Result<(), ImageError> {
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
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
            return Err(ImageError::Folder { path: path.to_owned(), folder, source });
        }
    };
    place(&mut System, file, bytes, &target).map_err(failed)
}

/// Returns true if a path is that of a pipe in a folder; those that the program was given when it
/// started are open already.
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

/// Refuses named pipes, to which [`write_atomically`] does not write.
///
/// # Errors
/// If it is one.
pub fn check_target(path: &Path) -> Result<(), ImageError> {
    let failed = |source| ImageError::Write { path: path.to_owned(), source };
    match fs::metadata(path) {
        Ok(found) if is_named_pipe(path, &found) => Err(failed(named_pipe())),
        _ => Ok(()),
    }
}

/// What is asked of the system, so that tests see in which order.
trait Disk {
    /// Writes the content of a file.
    fn write(&mut self, file: &mut NamedTempFile, bytes: &[u8]) -> io::Result<()>;
    /// Waits until the disk has the content of a file.
    fn sync(&mut self, file: &NamedTempFile) -> io::Result<()>;
    /// Gives a file its name.
    fn rename(&mut self, file: NamedTempFile, target: &Path) -> io::Result<()>;
    /// Waits until the disk has the names of a folder.
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

/// Gives a file its content and then its name; the disk has each before what follows.
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

/// Waits until the disk has the names of a folder, where that can be asked for: not where the
/// system has no such call, or the folder may be written and not read.
///
/// # Errors
/// If the folder is not there, or the disk fails.
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

/// The folder that a path is in; `.` for a bare name.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// A temporary file that, in the end, has the permissions of any other new file.
fn temporary_in(folder: &Path) -> io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".pathtracer-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // The system takes away what the user's mask forbids.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes down what it is asked for, and does it up to a step that fails.
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

    /// The content is on the disk before the name is, and the name before the call returns;
    /// whichever step fails is an error, no later one is taken, and before the file has its
    /// name the old content stays.
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
