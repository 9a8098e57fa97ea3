//! Lock on an output, so that two processes do not write the same image.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Seek, Write};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Lock on an output; other processes do not write it until the lock is dropped.
#[derive(Debug)]
pub(crate) struct Lock {
    file: File,
    path: PathBuf,
}

impl Lock {
    /// Locks an output by a file beside it with the suffix `.lock`. On file systems without locks,
    /// the output is not locked.
    ///
    /// # Errors
    /// If another process has locked it, or the lock file cannot be created.
    pub(crate) fn take(output: &Path) -> Result<Self> {
        let mut name = output.as_os_str().to_owned();
        name.push(".lock");
        let path = PathBuf::from(name);
        loop {
            let mut file = open(&path).with_context(|| {
                format!("{}: cannot create the lock of the image", path.display())
            })?;
            match file.try_lock() {
                Err(TryLockError::WouldBlock) => {
                    let mut owner = String::new();
                    // The process number is only for the message.
                    let _ = (&mut file).take(20).read_to_string(&mut owner);
                    let message = format!(
                        "{}: locked by another pathtracer (process {}); wait until it has ended, \
                         or choose another name with -f",
                        output.display(),
                        owner.trim()
                    );
                    return Err(io::Error::new(ErrorKind::WouldBlock, message).into());
                }
                Ok(()) | Err(TryLockError::Error(_)) => {}
            }
            // The previous owner may have removed the file just before this lock was taken.
            if is_same(&file, &path) {
                let _ = file.set_len(0).and_then(|()| file.rewind());
                let _ = writeln!(file, "{}", std::process::id());
                return Ok(Self { file, path });
            }
        }
    }
}

impl Drop for Lock {
    fn drop(&mut self) {
        // A waiting process notices that its file is no longer at this path.
        let _ = fs::remove_file(&self.path);
        let _ = self.file.unlock();
    }
}

/// Opens or creates the lock file; an existing one must be a regular file.
fn open(path: &Path) -> io::Result<File> {
    if fs::symlink_metadata(path).is_ok_and(|found| !found.is_file()) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file"));
    }
    OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)
}

#[cfg(unix)]
fn is_same(file: &File, path: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let place = |found: fs::Metadata| (found.dev(), found.ino());
    let there = fs::metadata(path).map(place).ok();
    there.is_some() && there == file.metadata().map(place).ok()
}

#[cfg(not(unix))]
fn is_same(_: &File, path: &Path) -> bool {
    path.exists()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_output_is_locked_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let image = folder.path().join("a.png");
        let lock = Lock::take(&image).expect("nobody has it");
        let error = Lock::take(&image).expect_err("it is taken").to_string();
        let owner = format!("a.png: locked by another pathtracer (process {})", std::process::id());
        assert!(error.contains(&owner), "{error}");
        drop(Lock::take(&folder.path().join("b.png")).expect("another image"));
        drop(lock);
        assert_eq!(fs::read_dir(folder.path()).expect("it is there").count(), 0);
        // Lock file of a process that was killed.
        fs::write(folder.path().join("a.png.lock"), "123456").expect("there is room");
        drop(Lock::take(&image).expect("nobody has it"));
    }
}
