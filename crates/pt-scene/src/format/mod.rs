//! Scene formats: each turns bytes into a [`Scene`].
//!
//! To add one: write its file, add its line to [`FORMATS`].

pub mod collada;
mod gltf;
mod json;
mod mesh_file;
mod mitsuba;
mod obj;
mod pbrt;
mod ply;
mod save;
mod serialized;
mod spectra;
mod transform;
mod triangulate;
mod vol;
mod xml;

use std::path::Path;

use crate::{LoadError, Scene, source};
pub use json::schema as json_schema;
pub use save::{Encoded, SaveError, save};
use xml::quote;

/// How to read a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadOptions {
    /// Names, without the dollar, and what they stand for: `$name` in the file, where the format
    /// has that. They win over what the file says. Each is given once, and used in the file.
    pub definitions: Vec<(String, String)>,
}

/// Turns content and path (for files that the scene refers to, relative to it, and for messages)
/// into a scene.
#[derive(Clone, Copy)]
enum Parser {
    /// Without options.
    Plain(fn(&[u8], &Path) -> Result<Scene, LoadError>),
    /// With names that stand for something.
    Defined(fn(&[u8], &Path, &LoadOptions) -> Result<Scene, LoadError>),
}

/// A scene format.
pub struct Format {
    /// Name for messages.
    pub name: &'static str,
    /// File name endings, lower case, without the dot.
    pub extensions: &'static [&'static str],
    parser: Parser,
}

impl Format {
    /// Reads a scene of this format; see [`parse_with`].
    ///
    /// # Errors
    /// If the content is wrong, or names are defined twice or not used.
    pub fn parse(
        &self,
        bytes: &[u8],
        path: &Path,
        options: &LoadOptions,
    ) -> Result<Scene, LoadError> {
        match (self.parser, options.definitions.first()) {
            (Parser::Defined(parse), _) => parse(bytes, path, options),
            (Parser::Plain(parse), None) => parse(bytes, path),
            (Parser::Plain(_), Some((name, _))) => {
                let all = FORMATS.iter().filter(|f| matches!(f.parser, Parser::Defined(_)));
                let names: Vec<_> = all.map(|f| f.name).collect();
                let message = format!(
                    "{} is defined, but {} has no such names; they are for {}",
                    quote(name),
                    self.name,
                    names.join(", ")
                );
                Err(mesh_file::error(path, 0, message))
            }
        }
    }
}

/// All formats.
pub static FORMATS: &[Format] = &[
    Format { name: "COLLADA", extensions: &["dae"], parser: Parser::Plain(collada::parse) },
    Format { name: "glTF 2.0", extensions: &["gltf", "glb"], parser: Parser::Plain(gltf::parse) },
    Format { name: "Mitsuba 3", extensions: &["xml"], parser: Parser::Defined(mitsuba::parse) },
    Format { name: "pbrt-v4", extensions: &["pbrt"], parser: Parser::Plain(pbrt::parse) },
    Format { name: "pathtracer JSON", extensions: &["json"], parser: Parser::Plain(json::parse) },
    Format { name: "Stanford PLY", extensions: &["ply"], parser: Parser::Plain(ply::parse) },
    Format { name: "Wavefront OBJ", extensions: &["obj"], parser: Parser::Plain(obj::parse) },
];

/// Reads a scene, in the format that the ending of its name says.
///
/// # Errors
/// If the ending is unknown, the file unreadable, or its content wrong.
pub fn load(path: &Path) -> Result<Scene, LoadError> {
    load_with(path, &LoadOptions::default())
}

/// Like [`load`], with options.
///
/// # Errors
/// As [`load`]; also if names are defined twice or not used.
pub fn load_with(path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    format_of(path)?;
    let bytes =
        source::read(path).map_err(|source| LoadError::Io { path: path.to_owned(), source })?;
    parse_with(&bytes, path, options)
}

/// Like [`load`], with the content at hand; the path serves for the format, for files that the
/// scene refers to, and for messages.
///
/// # Errors
/// If the ending is unknown, or the content wrong.
pub fn parse(bytes: &[u8], path: &Path) -> Result<Scene, LoadError> {
    parse_with(bytes, path, &LoadOptions::default())
}

/// Like [`parse`], with options.
///
/// # Errors
/// As [`parse`]; also if names are defined twice or not used.
pub fn parse_with(bytes: &[u8], path: &Path, options: &LoadOptions) -> Result<Scene, LoadError> {
    let mut scene = format_of(path)?.parse(bytes, path, options)?;
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
