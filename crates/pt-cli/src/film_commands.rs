//! Commands on films and images as functions of a library, which print nothing.

use std::ffi::OsString;
use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::slice;

use clap::Parser;
use pathtracer::cryptomatte::MatteNames;
use pathtracer::denoise::DenoiseError;
use pathtracer::provenance::Provenance;
use pathtracer::{CompileError, Film, LoadError, Observer};

use crate::command_args::Command;
use crate::commands::render::RenderResult;
use crate::commands::{merge as merging, rerender as rerendering, resume as resuming};
use crate::keywords::in_keywords;
use crate::message::{self, WithHints, collected};
use crate::origin::argument;
use crate::request::{Purpose, Words, arguments};
use crate::views;

/// Film of an image, and what is known about it.
pub struct FilmImage {
    /// The samples.
    pub film: Film,
    /// Names of the objects and materials that the film counts.
    pub names: MatteNames,
    /// Notes about the scene, and warnings of the command.
    pub notes: Vec<String>,
    /// Provenance metadata of the image.
    pub provenance: Provenance,
}

/// Reason for which a command fails. Options in the message are written as keywords.
#[derive(Debug, thiserror::Error)]
pub enum CommandError {
    /// A file cannot be read or written.
    #[error("{message}")]
    File {
        /// Kind of the cause.
        kind: ErrorKind,
        /// The message.
        message: String,
    },
    /// The scene cannot be read or rendered.
    #[error("{0}")]
    Scene(String),
    /// The arguments, films or images are invalid.
    #[error("{0}")]
    Input(String),
    /// A second image differs from the first one.
    #[error("{0}")]
    Different(String),
}

impl From<anyhow::Error> for CommandError {
    fn from(error: anyhow::Error) -> Self {
        let message = in_keywords(&message::of_error(&error));
        let is_scene = |cause: &(dyn std::error::Error + 'static)| {
            cause.is::<LoadError>() || cause.is::<WithHints>() || cause.is::<CompileError>()
        };
        if error.chain().any(is_scene) {
            return Self::Scene(message);
        }
        let io = error.chain().find_map(|cause| cause.downcast_ref::<io::Error>());
        let is_library = |cause: &(dyn std::error::Error + 'static)| {
            cause.downcast_ref().is_some_and(DenoiseError::is_about_library)
        };
        match io {
            Some(cause) => Self::File { kind: cause.kind(), message },
            None if error.chain().any(is_library) => Self::File { kind: ErrorKind::Other, message },
            None => Self::Input(message),
        }
    }
}

/// Continues a render from its film, or from the film beside its image, and writes both.
///
/// The keywords are those of [`Purpose::Resume`].
///
/// # Errors
/// As `pathtracer resume`.
pub fn resume(
    file: &Path,
    keywords: &Words,
    observer: &dyn Observer,
) -> Result<FilmImage, CommandError> {
    let command = command(Purpose::Resume, slice::from_ref(&file), None, keywords)?;
    let Command::Resume(resume) = command else {
        return Err(CommandError::Input("resume is no command".into()));
    };
    let (resumed, warnings) = collected(|| resuming::resumed(&resume, observer));
    Ok(image(resumed?, warnings))
}

/// Renders an image again by its provenance metadata, writes the second image, and compares the
/// two. If the observer cancels the render, nothing is compared.
///
/// The keywords are those of [`Purpose::Rerender`].
///
/// # Errors
/// As `pathtracer rerender`, and if the two images differ.
pub fn rerender(
    file: &Path,
    keywords: &Words,
    observer: &dyn Observer,
) -> Result<FilmImage, CommandError> {
    let command = command(Purpose::Rerender, slice::from_ref(&file), None, keywords)?;
    let Command::Rerender(rerender) = command else {
        return Err(CommandError::Input("rerender is no command".into()));
    };
    let (second, warnings) = collected(|| rerendering::rerendered(&rerender, observer));
    let second = second?;
    match second.difference {
        Some(difference) => Err(CommandError::Different(difference)),
        None => Ok(image(second.result, warnings)),
    }
}

/// Merges films, writes the image or the film of the sum, and returns it.
///
/// # Errors
/// As `pathtracer merge`.
pub fn merge(films: &[PathBuf], output: &Path) -> Result<FilmImage, CommandError> {
    if films.is_empty() {
        return Err(CommandError::Input("films: found none, expected at least one".into()));
    }
    let (whole, notes) = collected(|| merging::merged(films, output));
    let whole = whole?;
    let provenance = merging::provenance_of(&whole);
    Ok(FilmImage { film: whole.film, names: whole.about.names, notes, provenance })
}

/// File of views and numbers of those that a path selects, as `transforms.json#0..99/10` does; all
/// without a selection.
///
/// # Errors
/// If the file cannot be read, or lacks one of the views.
pub fn view_numbers(path: &Path) -> Result<(PathBuf, Vec<u32>), CommandError> {
    views::numbers(path).map_err(|error| match error.downcast_ref() {
        Some(LoadError::Io { source, .. }) => {
            CommandError::File { kind: source.kind(), message: message::of_error(&error) }
        }
        _ => error.into(),
    })
}

/// Command of a purpose for files, with its output and the options of keywords.
pub(crate) fn command(
    purpose: Purpose,
    files: &[impl AsRef<Path>],
    output: Option<&Path>,
    keywords: &Words,
) -> Result<Command, CommandError> {
    let options = arguments(purpose, keywords).map_err(CommandError::Input)?;
    let name = purpose.name_of_command().unwrap_or_default();
    let mut words: Vec<_> = ["pathtracer", name, "--quiet"].map(OsString::from).into();
    words.extend(options.into_iter().map(OsString::from));
    if let Some(output) = output {
        let mut word = OsString::from("--output=");
        word.push(output);
        words.push(word);
    }
    words.extend(files.iter().map(|file| argument(file.as_ref())));
    Command::try_parse_from(words)
        .map_err(|error| CommandError::Input(in_keywords(&message::of_parser(&error))))
}

/// The image of a render with its notes and warnings.
fn image(result: RenderResult, warnings: Vec<String>) -> FilmImage {
    let RenderResult { session, provenance, .. } = result;
    let (names, mut notes) = (session.names().clone(), session.notes().to_vec());
    notes.extend(warnings);
    FilmImage { film: session.into_film(), names, notes, provenance }
}
