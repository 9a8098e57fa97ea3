//! Outputs of commands that take several images.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, ensure};
use pathtracer::{file, image};

use crate::{FAILURE, hints, message, output};

/// Images that are read, each with the file that is written.
pub(crate) struct Targets(Vec<(PathBuf, PathBuf)>);

impl Targets {
    /// Chooses the outputs: as given by `-f`; in that folder, if it is one; or beside the inputs.
    /// `rename` returns the name of an output beside its input.
    ///
    /// # Errors
    /// If several images have the same output, an output is an input, or it cannot be written.
    pub(crate) fn new(
        inputs: &[PathBuf],
        given: Option<&Path>,
        rename: impl Fn(&Path) -> PathBuf,
    ) -> Result<Self> {
        for input in inputs {
            ensure!(
                !input.is_dir() && input.file_name().is_some(),
                "{}: found a folder, expected an image",
                input.display()
            );
        }
        let folder = given.filter(|path| is_folder(path));
        if let Some(given) = given {
            ensure!(
                folder.is_some() || inputs.len() == 1,
                "-f {}: found the name of a file for {} images, expected a folder, as in -f folder/",
                given.display(),
                inputs.len()
            );
        }
        let target = |input: &PathBuf| match (folder, given) {
            (Some(folder), _) => folder.join(rename(input).file_name().unwrap_or_default()),
            (None, Some(given)) => given.to_owned(),
            (None, None) => rename(input),
        };
        let pairs: Vec<_> = inputs.iter().map(|input| (input.clone(), target(input))).collect();
        let mut writers = HashMap::new();
        for (input, target) in &pairs {
            check(target, inputs)?;
            if let Some(other) = writers.insert(file::resolved(target), input) {
                anyhow::bail!(
                    "found the same output for {} and {}: {}; give one of them another name with -f",
                    other.display(),
                    input.display(),
                    target.display()
                );
            }
        }
        Ok(Self(pairs))
    }

    /// Returns true if all outputs have this extension.
    pub(crate) fn have_ending(&self, ending: &str) -> bool {
        self.0.iter().all(|(_, target)| output::has_ending(target, ending))
    }

    /// Writes the outputs in order, and passes the result of each to `done`, until that returns
    /// false. An error does not prevent the other outputs.
    pub(crate) fn for_each(&self, write: impl Fn(&Path, &Path) -> Result<()>, done: Done<'_>) {
        for (input, target) in &self.0 {
            if !done(target, write(input, target)) {
                return;
            }
        }
    }
}

/// Receives each output with its result, and returns true if more are to be written.
pub(crate) type Done<'a> = &'a mut dyn FnMut(&Path, Result<()>) -> bool;

/// Runs a command that writes several outputs, and reports each.
///
/// # Errors
/// As the command; errors of single outputs are reported.
pub(crate) fn reported(
    quiet: bool,
    command: impl FnOnce(Done<'_>) -> Result<()>,
) -> Result<ExitCode> {
    let mut status = ExitCode::SUCCESS;
    command(&mut |target, result| {
        match result {
            Ok(()) if quiet => {}
            Ok(()) => report!("saved {}", target.display()),
            Err(error) => {
                message::report_error(&error);
                hints::report_for(&error);
                status = ExitCode::from(FAILURE);
            }
        }
        true
    })?;
    Ok(status)
}

/// Returns true for an existing folder and for a path with a separator at its end.
fn is_folder(path: &Path) -> bool {
    path.is_dir() || path.to_string_lossy().ends_with(std::path::is_separator)
}

/// Checks that a file is an image that can be written, and none of the inputs.
///
/// # Errors
/// If it is not.
pub(crate) fn check(target: &Path, inputs: &[PathBuf]) -> Result<()> {
    ensure!(
        image::is_image(target),
        "-f {}: unknown extension; expected .png or .exr",
        target.display()
    );
    let is_input = inputs.iter().any(|input| is_same(input, target));
    ensure!(
        !is_input,
        "found the output {}, which is an input; give it another name with -f",
        target.display()
    );
    output::check_writable(target)
}

/// Returns true if two paths are those of the same file.
pub(crate) fn is_same(first: &Path, second: &Path) -> bool {
    file::resolved(first) == file::resolved(second)
}
