//! Selection of views of a file: `FILE#17`, or `FILE#0..99/10` for several.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, ensure};
use pathtracer::SourceFile;
use pathtracer::views::{self, View};

use crate::parse;

/// File and selection of a path in a folder, or in the current one; the selection is `None` if the
/// path is that of a file.
pub(crate) fn split<'a>(path: &'a Path, folder: Option<&Path>) -> (PathBuf, Option<&'a str>) {
    let is_file = in_folder(path, folder).is_file();
    match path.to_str().filter(|_| !is_file).and_then(|text| text.rsplit_once('#')) {
        Some((file, selection)) => (file.into(), Some(selection)),
        None => (path.to_owned(), None),
    }
}

fn in_folder(path: &Path, folder: Option<&Path>) -> PathBuf {
    folder.map_or_else(|| path.to_owned(), |folder| folder.join(path))
}

/// Reads a single view, `FILE#17`; `None` if the path has no selection.
///
/// # Errors
/// If the file cannot be read, or has no such view.
pub(crate) fn single(
    path: &Path,
    folder: Option<&Path>,
) -> Result<Option<(View, Vec<SourceFile>)>> {
    let (file, Some(selection)) = split(path, folder) else { return Ok(None) };
    let file = in_folder(&file, folder);
    let (mut views, sources) = views::load(&file)?;
    let count = views.len();
    let number = selection.parse().ok().filter(|number| *number < count).with_context(|| {
        format!(
            "{}: found no view number {selection}, expected one of 0..{}",
            file.display(),
            count - 1
        )
    })?;
    Ok(Some((views.swap_remove(number), sources)))
}

/// Numbers of the selected views of a file, all without a selection.
///
/// # Errors
/// If the file cannot be read, or lacks one of the views.
pub(crate) fn numbers(path: &Path) -> Result<(PathBuf, Vec<u32>)> {
    let (file, selection) = split(path, None);
    let count = views::load(&file)?.0.len() as u32;
    let Some(selection) = selection else { return Ok((file, (0..count).collect())) };
    let steps = parse::steps(selection)
        .map_err(|expected| anyhow!("{}: found #{selection}, {expected}", file.display()))?;
    ensure!(
        steps.last < count,
        "{}: found no view number {}, expected one of 0..{}",
        file.display(),
        steps.last,
        count - 1
    );
    Ok((file, steps.numbers().collect()))
}
