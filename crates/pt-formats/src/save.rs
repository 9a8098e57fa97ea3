//! Writing scenes.

use std::path::{Path, PathBuf};

use pt_io::{WriteError, write_atomically};
use pt_scene::Scene;

use super::{gltf, json};
use crate::encoded::Encoded;

/// Error of writing a scene.
#[derive(Debug, thiserror::Error)]
pub enum SaveError {
    /// No format with this file name extension can be written.
    #[error("{}: unknown scene format for writing; known: {known}", path.display())]
    UnknownFormat {
        /// Path of the file.
        path: PathBuf,
        /// Supported extensions, separated by commas.
        known: String,
    },
    /// The scene cannot be represented in the format.
    #[error("{}: cannot be written: {message}", path.display())]
    Content {
        /// Path of the file.
        path: PathBuf,
        /// Description of the problem.
        message: String,
    },
    /// A file or folder to be written exists already.
    #[error("{} exists already", path.display())]
    Exists {
        /// Path of the file or folder.
        path: PathBuf,
    },
    /// A folder for further files cannot be created.
    #[error("{}: cannot create the folder: {source}", path.display())]
    Folder {
        /// Path of the folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A file cannot be written.
    #[error(transparent)]
    File(#[from] WriteError),
}

/// A format that scenes can be written in.
struct SceneWriter {
    ending: &'static str,
    /// Encodes a scene for a file of this name; the error is a message.
    encode: fn(&Scene, &Path) -> Result<Encoded, String>,
}

/// All formats that can be written.
static WRITERS: &[SceneWriter] = &[
    SceneWriter { ending: "json", encode: json::encode },
    SceneWriter { ending: "glb", encode: gltf::encode },
];

/// Writes a scene in the format of the file name extension, and returns warnings about what the
/// format cannot represent.
///
/// Images, and all but small meshes and grids, of a `.json` scene are written to a folder beside
/// it, `NAME_files`; the scene itself is written last and atomically, so that readers always find
/// complete files.
///
/// # Errors
/// Returns an error if the extension is unknown, the scene cannot be represented in the format, the
/// file or its folder exists and `overwrite` is false, or a file cannot be written.
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
