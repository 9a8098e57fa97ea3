//! Scene formats: each turns bytes into a [`Scene`].
//!
//! To add one: write its file, add its line to [`FORMATS`].

pub mod collada;
mod mesh_file;
mod mitsuba;
mod obj;
mod ply;
mod serialized;
mod triangulate;
mod xml;

use std::path::Path;

use crate::{LoadError, Scene};

/// Reads other files that a scene refers to (meshes, includes), relative to the scene.
pub type Parser = fn(&[u8], &Path) -> Result<Scene, LoadError>;

/// A scene format.
pub struct Format {
    /// Name for messages.
    pub name: &'static str,
    /// File name endings, lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// Content and path (for relative references and messages) to scene.
    pub parse: Parser,
}

/// All formats.
pub static FORMATS: &[Format] = &[
    Format { name: "COLLADA", extensions: &["dae"], parse: collada::parse },
    Format { name: "Mitsuba 3", extensions: &["xml"], parse: mitsuba::parse },
    Format { name: "Stanford PLY", extensions: &["ply"], parse: ply::parse },
    Format { name: "Wavefront OBJ", extensions: &["obj"], parse: obj::parse },
];

/// Reads a scene, in the format that the ending of its name says.
///
/// # Errors
/// If the ending is unknown, the file unreadable, or its content wrong.
pub fn load(path: &Path) -> Result<Scene, LoadError> {
    format_of(path)?;
    let bytes =
        std::fs::read(path).map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
    parse(&bytes, path)
}

/// Like [`load`], with the content at hand; the path serves for the format, for files that the
/// scene refers to, and for messages.
///
/// # Errors
/// If the ending is unknown, or the content wrong.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    let mut scene = (format_of(path)?.parse)(bytes, path)?;
    if scene.name.is_empty() {
        scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    }
    Ok(scene)
}

/// The format that the ending of a name says.
fn format_of(path: &Path) -> Result<&'static Format, LoadError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let known = FORMATS.iter().find(|f| f.extensions.contains(&ending.as_str()));
    known.ok_or_else(|| LoadError::UnknownFormat { path: path.to_owned(), known: known_endings() })
}

/// All endings, for messages.
fn known_endings() -> String {
    let all: Vec<_> = FORMATS.iter().flat_map(|f| f.extensions).map(|e| format!(".{e}")).collect();
    all.join(", ")
}
