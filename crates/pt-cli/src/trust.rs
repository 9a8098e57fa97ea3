//! Restrictions of commands stored in films and images: they are untrusted data.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use pathtracer::file::resolved;
use pathtracer::film_file::FilmHeader;
use pathtracer::folder_of;

use crate::args::Cli;
use crate::loading::Folders;
use crate::{seal, views};

/// Removes options that a stored command may not contain: outputs other than the image, addresses,
/// and folders from which files are read. These folders are taken from the command line.
pub(crate) fn distrust(file: &Path, cli: &mut Cli, folders: &Folders) {
    let stored = std::mem::replace(&mut cli.loading.folders, folders.clone());
    let is_new = |folder| !folders.allow_folder.contains(folder);
    let left_out: Vec<_> = [
        ("--summary-json", cli.summary_json.take().is_some()),
        ("--tev", cli.tev.take().is_some()),
        ("--allow-outside", stored.allow_outside && !folders.allow_outside),
        ("--allow-folder", !folders.allow_outside && stored.allow_folder.iter().any(is_new)),
    ]
    .into_iter()
    .filter_map(|(option, is_left_out)| is_left_out.then_some(option))
    .collect();
    if !left_out.is_empty() && !cli.quiet {
        report!(
            "note: {}: the options {} of its command are ignored in files; --allow-outside and \
             --allow-folder can be given again",
            file.display(),
            left_out.join(", ")
        );
    }
}

/// Changes to the folder of a stored command, as [`folder`] returns it.
///
/// # Errors
/// As [`folder`], or if the folder cannot be entered.
pub(crate) fn enter(output: &Path, about: &FilmHeader, cli: &Cli) -> Result<()> {
    enter_folder(&folder(output, about, cli)?)
}

/// Returns the folder in which the command of an output ran, if the program made the output for
/// this user in this place, or if all files that the command reads are in allowed folders. If they
/// are all in the folder of the output, returns that one instead.
///
/// # Errors
/// If the files are elsewhere.
pub(crate) fn folder(output: &Path, about: &FilmHeader, cli: &Cli) -> Result<PathBuf> {
    let folder = about.folder.as_path();
    if seal::is_ours(&about.seal, output, folder, &about.command) {
        return Ok(folder.to_owned());
    }
    let Folders { allow_outside, allow_folder } = &cli.loading.folders;
    let camera_file =
        cli.camera_file.as_deref().map(|path| views::split(path, Some(&about.folder)).0);
    let inputs: Vec<&PathBuf> =
        cli.paths.iter().chain(&cli.environment).chain(&camera_file).collect();
    let own = resolved(&folder_of(output));
    let is_in_own = |path: &&PathBuf| {
        let place = resolved(&own.join(path));
        path.is_relative() && place.starts_with(&own) && place.exists()
    };
    if inputs.iter().all(is_in_own) {
        return Ok(own);
    }
    let is_allowed = |place: &Path| {
        place.starts_with(&own) || allow_folder.iter().any(|dir| place.starts_with(resolved(dir)))
    };
    let places = inputs.iter().map(|path| resolved(&folder.join(path)));
    if let Some(place) = places.into_iter().find(|place| !allow_outside && !is_allowed(place)) {
        bail!(
            "{}: its command reads {} outside of its folder, and the file was not created here by \
             this program; if you trust it, --allow-folder {} allows that folder, and \
             --allow-outside all",
            output.display(),
            place.display(),
            folder_of(&place).display()
        );
    }
    Ok(folder.to_owned())
}

/// Changes to a folder. A missing folder is ignored: paths of the command may be absolute.
fn enter_folder(folder: &Path) -> Result<()> {
    if folder.is_dir() {
        std::env::set_current_dir(folder)
            .with_context(|| format!("{}: cannot enter the folder", folder.display()))?;
    }
    Ok(())
}
