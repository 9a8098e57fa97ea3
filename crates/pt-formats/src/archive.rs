//! Scenes in archives: ZIP files with a scene and the files to which it refers, and `.zae` of
//! COLLADA. [COLLADA 1.5.0, §"Zipped archives"]
//!
//! An archive is unpacked into a temporary folder, which paths of the scene cannot leave.

use std::fs;
use std::io::{Cursor, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_scene::{Scene, Warning};
use zip::ZipArchive;

use super::{LoadOptions, LoadResult, format_of};
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::mesh_file;
use crate::shared::names::quote;

/// Maximum number of files of an archive.
const MAX_FILES: usize = 10_000;
/// Maximum number of bytes of all files.
const MAX_BYTES: u64 = 1 << 31;

/// Reads the scene of an archive.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    let error = |message: String| mesh_file::error(path, 0, message);
    let folder = tempfile::Builder::new().prefix("pathtracer-").tempdir();
    let folder =
        folder.map_err(|why| error(format!("cannot create a folder to unpack it: {why}")))?;
    // Paths in messages have no symbolic links.
    let root = folder.path().canonicalize().unwrap_or_else(|_| folder.path().to_owned());
    let names = unpack(bytes, &root, context).map_err(error)?;
    let name = scene_of(&root, &names).map_err(error)?;
    let inner = root.join(&name);
    let format = format_of(&inner)?;
    let mut options: LoadOptions = context.options().clone();
    options.limits.memory = options.limits.memory.map(|_| context.room());
    let LoadResult { scene, missing, notes: _, .. } =
        format.read_file(&inner, &LoadContext::new(&inner, &options));
    let shown = ShownPaths { root: &root, archive: path };
    for Warning { at, message } in missing {
        let Warning { at, message } = shown.warning(Warning { at, message });
        context.missing(at, message);
    }
    let mut scene = scene.map_err(|error| shown.error(error))?;
    scene.warnings = scene.warnings.into_iter().map(|warning| shown.warning(warning)).collect();
    scene.missing.clear();
    Ok(scene)
}

/// Unpacks all files and returns their names. The error is a message.
fn unpack(bytes: &[u8], root: &Path, context: &LoadContext) -> Result<Vec<PathBuf>, String> {
    let invalid = |why: zip::result::ZipError| format!("found no readable archive: {why}");
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(invalid)?;
    if archive.len() > MAX_FILES {
        return Err(format!(
            "found {} files in the archive, expected at most {MAX_FILES}",
            archive.len()
        ));
    }
    let (mut names, mut left) = (Vec::new(), MAX_BYTES);
    for i in 0..archive.len() {
        let file = archive.by_index(i).map_err(invalid)?;
        let name = file.name().map_err(invalid)?.into_owned();
        if file.is_dir() {
            continue;
        }
        let inside = file.enclosed_name().filter(|_| !file.is_symlink());
        let Some(place) = inside else {
            return Err(format!(
                "found {} in the archive, expected paths inside of the archive",
                quote(&name)
            ));
        };
        let most = file.size().min(left);
        let _grant = context.reserve(most)?;
        let mut content = Vec::new();
        // One more byte is read to detect files that are longer than declared.
        let read = file.take(most + 1).read_to_end(&mut content);
        read.map_err(|why| format!("damaged file {} in the archive: {why}", quote(&name)))?;
        left = left
            .checked_sub(content.len() as u64)
            .filter(|_| content.len() as u64 <= most)
            .ok_or_else(|| {
                format!(
                    "found more than {MAX_BYTES} bytes in the archive, or more than its headers \
                     declare"
                )
            })?;
        let target = root.join(&place);
        let made = target.parent().map_or(Ok(()), fs::create_dir_all);
        made.and_then(|()| fs::write(&target, content))
            .map_err(|why| format!("cannot unpack {}: {why}", quote(&name)))?;
        names.push(place);
    }
    Ok(names)
}

/// Returns the name of the scene: that in the manifest, or the only scene in the outermost folder
/// that contains any. The error is a message.
fn scene_of(root: &Path, names: &[PathBuf]) -> Result<PathBuf, String> {
    if let Some(named) = of_manifest(root) {
        return Ok(named);
    }
    let is_read = |name: &&PathBuf| format_of(name).is_ok_and(|format| !format.is_archive());
    let mut scenes: Vec<&PathBuf> = names.iter().filter(is_read).collect();
    let depth = |name: &PathBuf| name.components().count();
    let least = scenes.iter().map(|name| depth(name)).min();
    scenes.retain(|name| Some(depth(name)) == least);
    match scenes.as_slice() {
        [] => Err("found no scene of a supported format in the archive".to_owned()),
        [one] => Ok((*one).clone()),
        several => {
            let names: Vec<_> =
                several.iter().take(10).map(|name| name.display().to_string()).collect();
            Err(format!(
                "found {} scenes in the archive ({}), expected one; unpack it and select one of \
                 them",
                several.len(),
                names.join(", ")
            ))
        }
    }
}

/// Returns the scene in the manifest of a `.zae` file.
fn of_manifest(root: &Path) -> Option<PathBuf> {
    let text = fs::read_to_string(root.join("manifest.xml")).ok()?;
    let document = roxmltree::Document::parse(&text).ok()?;
    let node = document.descendants().find(|node| node.has_tag_name("dae_root"))?;
    let name = node.text()?.trim().split('#').next()?.trim_start_matches("./").replace("%20", " ");
    let place = PathBuf::from(name);
    let is_inside = place.components().all(|part| matches!(part, std::path::Component::Normal(_)));
    (is_inside && format_of(&place).is_ok() && root.join(&place).is_file()).then_some(place)
}

/// Converts the paths of unpacked files to those that the user sees.
struct ShownPaths<'a> {
    root: &'a Path,
    archive: &'a Path,
}

impl ShownPaths<'_> {
    fn text(&self, text: &str) -> String {
        text.replace(&self.root.display().to_string(), &self.archive.display().to_string())
    }

    fn path(&self, path: &Path) -> PathBuf {
        path.strip_prefix(self.root)
            .map_or_else(|_| path.to_owned(), |rest| self.archive.join(rest))
    }

    fn warning(&self, mut warning: Warning) -> Warning {
        warning.at.file = self.path(&warning.at.file);
        warning.message = self.text(&warning.message);
        warning
    }

    fn error(&self, error: LoadError) -> LoadError {
        match error {
            LoadError::Content { at, message } => {
                let Warning { at, message } = self.warning(Warning { at, message });
                LoadError::Content { at, message }
            }
            LoadError::Broken { at, message } => {
                let Warning { at, message } = self.warning(Warning { at, message });
                LoadError::Broken { at, message }
            }
            LoadError::Io { path, source } => LoadError::Io { path: self.path(&path), source },
            LoadError::UnknownFormat { path, known } => {
                LoadError::UnknownFormat { path: self.path(&path), known }
            }
            LoadError::Several(all) => {
                LoadError::Several(all.into_iter().map(|error| self.error(error)).collect())
            }
            LoadError::AlreadyReported => LoadError::AlreadyReported,
        }
    }
}
