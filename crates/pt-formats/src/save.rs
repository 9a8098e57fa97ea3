//! Writing scenes.

use std::path::{Path, PathBuf};

use super::{gltf, json};
use crate::Scene;
use crate::image::{ImageError, write_atomically};

/// Why a scene could not be written.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// The ending of the name belongs to no format that can be written.
    #[error("{}: scenes can be written as {known}", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
        /// The endings known, separated by commas.
        known: String,
    },
    /// The scene does not fit into the format.
    #[error("{}: cannot be written: {message}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What does not fit, and why.
        message: String,
    },
    /// What would be written is there already.
    #[error("{} exists already; remove it, choose another name, or overwrite it by --force", path.display())]
    Exists {
        /// The file or folder.
        path: PathBuf,
    },
    /// A folder for other files cannot be made.
    #[error("{}: the folder cannot be made: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] ImageError),
}

/// A scene in some format.
#[derive(Debug, Default)]
pub struct Encoded {
    /// Content of the file.
    pub bytes: Vec<u8>,
    /// Files beside it that it refers to: their paths from its folder, and what they hold.
    pub files: Vec<(PathBuf, Vec<u8>)>,
    /// What the format cannot say, each thing once.
    pub notes: Vec<String>,
}

/// A format that scenes can be written in.
struct Writer {
    ending: &'static str,
    /// A scene for a file of this name, or why it does not fit.
    encode: fn(&Scene, &Path) -> Result<Encoded, String>,
}

/// All of them.
static WRITERS: &[Writer] = &[
    Writer { ending: "json", encode: json::encode },
    Writer { ending: "glb", encode: gltf::encode },
];

/// Writes a scene in the format that the ending of the name says, and tells what that cannot say.
///
/// What a scene of the format `.json` holds of meshes, images and grids goes to a folder beside it,
/// `NAME_files`; the scene itself is written last and in one step, so that whoever reads it finds
/// all of it.
///
/// # Errors
/// If the ending is unknown, the scene does not fit into the format, the file or its folder exists
/// and is not to be overwritten, or something cannot be written.
pub fn save(scene: &Scene, path: &Path, overwrite: bool) -> Result<Vec<String>, SaveError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let writer = WRITERS.iter().find(|writer| writer.ending == ending).ok_or_else(|| {
        let known: Vec<_> = WRITERS.iter().map(|writer| format!(".{}", writer.ending)).collect();
        SaveError::UnknownFormat { path: path.to_owned(), known: known.join(", ") }
    })?;
    let refused = |message| SaveError::Content { path: path.to_owned(), message };
    let encoded = (writer.encode)(scene, path).map_err(refused)?;
    let parent = path.parent().unwrap_or(Path::new(""));
    let files: Vec<_> =
        encoded.files.iter().map(|(name, bytes)| (parent.join(name), bytes)).collect();
    let folder = files.first().and_then(|(path, _)| path.parent());
    let mut all = std::iter::once(path).chain(folder);
    if let Some(path) = all.find(|path| !overwrite && path.exists()) {
        return Err(SaveError::Exists { path: path.to_owned() });
    }
    if let Some(folder) = folder {
        let failed = |source| SaveError::Folder { path: folder.to_owned(), source };
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    for (path, bytes) in files {
        write_atomically(&path, bytes)?;
    }
    write_atomically(path, &encoded.bytes)?;
    Ok(encoded.notes)
}
