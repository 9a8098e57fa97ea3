//! Material libraries (MTL files), split into the statements of each material.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::chunk::uncommented;
use super::notes::MaterialNotes;
use super::slots::LocatedName;
use crate::LoadError;
use crate::shared::context::{Folder, LoadContext};
use crate::shared::mesh_file::{locate, place};
use crate::shared::names::quote;
use crate::shared::text;

/// Maximum number of material libraries.
const MAX_FILES: usize = 1000;

/// Statements of a material.
pub(super) struct Described {
    /// Path of the library.
    pub(super) path: Arc<PathBuf>,
    /// Lines with their numbers, without comments.
    pub(super) lines: Vec<(u32, String)>,
}

/// Content of the material libraries.
#[derive(Default)]
pub(super) struct MaterialLibrary {
    /// Statements of the requested materials.
    pub(super) described: HashMap<String, Described>,
    /// Names of all materials.
    pub(super) names: Vec<String>,
    /// True if a library is missing, which may contain any material.
    pub(super) is_incomplete: bool,
    known: HashSet<String>,
    read: HashSet<PathBuf>,
}

impl MaterialLibrary {
    /// Reads the files of a `mtllib` statement; of materials of the same name, the first one is
    /// used.
    ///
    /// # Errors
    /// Returns an error if there are too many files.
    pub(super) fn read(
        &mut self,
        named: &LocatedName,
        wanted: &HashSet<&str>,
        folder: &Folder,
        obj: &Path,
        notes: &mut MaterialNotes,
    ) -> Result<(), LoadError> {
        let at = place(obj, named.line);
        if named.name.is_empty() {
            notes.add(
                at,
                "missing name of a file after \"mtllib\"; the statement is ignored".to_owned(),
            );
            return Ok(());
        }
        for path in files(folder, &named.name) {
            if !self.read.insert(path.clone()) {
                continue;
            }
            if self.read.len() > MAX_FILES {
                let message = format!("more than {MAX_FILES} material libraries");
                return Err(LoadContext::exceeded(at, message));
            }
            let read = folder.context.read(&path).and_then(|bytes| {
                let text = text::joined_lines(&bytes, &path).map_err(|error| error.to_string())?;
                Ok(String::from_utf8_lossy(&text).into_owned())
            });
            match read {
                Ok(text) => self.add(&text, path, wanted, notes),
                Err(why) => {
                    self.is_incomplete = true;
                    let message = format!(
                        "the material library is ignored: {why}; materials that no other library \
                         defines become the default material"
                    );
                    folder.context.missing(at.clone(), message);
                }
            }
        }
        Ok(())
    }

    fn add(
        &mut self,
        text: &str,
        path: PathBuf,
        wanted: &HashSet<&str>,
        notes: &mut MaterialNotes,
    ) {
        let path = Arc::new(path);
        let (mut current, mut has_any): (Option<&str>, bool) = (None, false);
        for (line, number) in text.lines().zip(1..) {
            let line = uncommented(line).trim_end();
            let word = line.split_ascii_whitespace().next().unwrap_or_default();
            if word.eq_ignore_ascii_case("newmtl") {
                has_any = true;
                let name = line.trim_start()[word.len()..].trim();
                let is_new = self.known.insert(name.to_owned());
                if is_new {
                    self.names.push(name.to_owned());
                } else {
                    let message =
                        format!("duplicate material {}; the first one is used", quote(name));
                    notes.add(place(&path, number), message);
                }
                current = Some(name).filter(|name| is_new && wanted.contains(name));
                if let Some(name) = current {
                    let described = Described { path: Arc::clone(&path), lines: Vec::new() };
                    self.described.insert(name.to_owned(), described);
                }
            } else if let Some(name) = current.filter(|_| !word.is_empty())
                && let Some(described) = self.described.get_mut(name)
            {
                described.lines.push((number, line.to_owned()));
            } else if !has_any && !word.is_empty() {
                let message = "statements above the first \"newmtl\" are ignored".to_owned();
                notes.add(place(&path, number), message);
            }
        }
        if !has_any {
            let message = "file without materials (\"newmtl red\")".to_owned();
            notes.add(place(&path, 0), message);
        }
    }
}

/// Returns the named files: the words are separate names, unless all words together are the name of
/// a file.
fn files(folder: &Folder, names: &str) -> Vec<PathBuf> {
    let whole = file(folder, names);
    if whole.is_file() {
        return vec![whole];
    }
    names.split_ascii_whitespace().map(|name| file(folder, name)).collect()
}

/// Returns the path of a file.
pub(super) fn file(folder: &Folder, name: &str) -> PathBuf {
    locate(&folder.path, name)
}
