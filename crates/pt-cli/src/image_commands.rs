//! Commands on image files as functions of a library, which print nothing.

use std::path::{Path, PathBuf};

use anyhow::Result;
use pathtracer::Observer;
use pathtracer::denoise::Denoiser;

use crate::command_args::Command;
use crate::commands::{denoise as denoising, develop as developing, join as joining};
use crate::film_commands::{CommandError, command};
use crate::keywords::in_keywords;
use crate::message::{self, collected};
use crate::request::{Purpose, Words};
use crate::targets::Done;

/// Image files that a command has written.
pub struct ImageFiles {
    /// Paths in the order of the inputs.
    pub paths: Vec<PathBuf>,
    /// Notes and warnings, as about values that are not finite.
    pub warnings: Vec<String>,
}

/// Develops image files: as `output`, in that folder, or each beside its image. An observer that
/// cancels prevents the images that are not written yet.
///
/// The keywords are those of [`Purpose::Develop`].
///
/// # Errors
/// As `pathtracer develop`. The error of an image does not prevent the others.
pub fn develop(
    images: &[PathBuf],
    output: Option<&Path>,
    keywords: &Words,
    observer: &dyn Observer,
) -> Result<ImageFiles, CommandError> {
    let Command::Develop(develop) = of_images(Purpose::Develop, images, output, keywords)? else {
        return Err(CommandError::Input("develop is no command".into()));
    };
    written(observer, |done| developing::developed(&develop, done))
}

/// Denoises image files, as [`develop`] develops them. The library is searched for in `folders`,
/// too.
///
/// The keywords are those of [`Purpose::Denoise`].
///
/// # Errors
/// As `pathtracer denoise`. The error of an image does not prevent the others.
pub fn denoise(
    images: &[PathBuf],
    output: Option<&Path>,
    keywords: &Words,
    folders: &[PathBuf],
    observer: &dyn Observer,
) -> Result<ImageFiles, CommandError> {
    let Command::Denoise(denoise) = of_images(Purpose::Denoise, images, output, keywords)? else {
        return Err(CommandError::Input("denoise is no command".into()));
    };
    let open = || Denoiser::open_in(folders, denoise.threads.unwrap_or(0));
    written(observer, |done| denoising::denoised(&denoise, open, done))
}

/// Joins images of parts.
///
/// The keywords are those of [`Purpose::Join`].
///
/// # Errors
/// As `pathtracer join`.
pub fn join(
    parts: &[PathBuf],
    output: &Path,
    keywords: &Words,
) -> Result<ImageFiles, CommandError> {
    let Command::Join(join) = of_images(Purpose::Join, parts, Some(output), keywords)? else {
        return Err(CommandError::Input("join is no command".into()));
    };
    let (result, warnings) = collected(|| joining::write(&join));
    result?;
    Ok(ImageFiles { paths: vec![output.to_owned()], warnings })
}

/// Command of a purpose for at least one image.
fn of_images(
    purpose: Purpose,
    images: &[PathBuf],
    output: Option<&Path>,
    keywords: &Words,
) -> Result<Command, CommandError> {
    if images.is_empty() {
        return Err(CommandError::Input("images: found none, expected at least one".into()));
    }
    command(purpose, images, output, keywords)
}

/// Runs a command that writes several images; the first error has the messages of all.
fn written(
    observer: &dyn Observer,
    command: impl FnOnce(Done<'_>) -> Result<()>,
) -> Result<ImageFiles, CommandError> {
    let (mut paths, mut failures) = (Vec::new(), Vec::new());
    let mut done = |target: &Path, result: Result<()>| {
        match result {
            Ok(()) => paths.push(target.to_owned()),
            Err(error) => failures.push(error),
        }
        !observer.cancelled()
    };
    let (result, warnings) = collected(|| command(&mut done));
    result?;
    let messages: Vec<_> = failures.iter().map(message::of_error).collect();
    match failures.into_iter().next() {
        None => Ok(ImageFiles { paths, warnings }),
        Some(first) if messages.len() == 1 => Err(first.into()),
        Some(first) => Err(match CommandError::from(first) {
            CommandError::File { kind, .. } => {
                CommandError::File { kind, message: in_keywords(&messages.join("\n")) }
            }
            _ => CommandError::Input(in_keywords(&messages.join("\n"))),
        }),
    }
}
