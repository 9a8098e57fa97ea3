//! Writing files so that nobody ever sees half of one.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use super::ImageError;

/// Writes a file in one step: into a temporary file in the same folder, which then takes the name
/// of the file. Whoever reads it sees the old content or the new one; after an error, the old.
///
/// A link is followed, and what is no regular file (a pipe, `/dev/stdout`) is written to directly.
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
        Ok(found) if !found.is_file() => return fs::write(&target, bytes).map_err(failed),
        _ => {}
    }
    let folder = folder_of(&target);
    let mut file = temporary_in(&folder).map_err(|source| ImageError::Folder {
        path: path.to_owned(),
        folder,
        source,
    })?;
    file.write_all(bytes).map_err(failed)?;
    file.persist(&target).map_err(|e| failed(e.error))?;
    Ok(())
}

/// The folder that a path is in; `.` for a bare name.
fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// A temporary file that, in the end, has the permissions of any other new file.
fn temporary_in(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
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
