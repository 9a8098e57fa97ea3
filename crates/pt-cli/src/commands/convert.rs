//! `pathtracer convert`: writes a scene in another format.

use std::process::ExitCode;

use anyhow::{Result, ensure};
use pathtracer::{LoadResult, read_with, save};

use crate::command_args::Convert;
use crate::message::WithHints;
use crate::{hints, targets};

/// Reads a scene, and writes it in another format.
///
/// # Errors
/// If the scene cannot be read, or cannot be written in the format of the extension of the output;
/// if both are the same file; or if an existing file is not to be overwritten.
pub(crate) fn run(convert: &Convert) -> Result<ExitCode> {
    let Convert { scene: from, output: to, loading, force, quiet } = convert;
    ensure!(
        !targets::is_same(from, to),
        "found the output {}, which is the scene itself; give the copy another name",
        to.display()
    );
    crate::output::check_writable(to)?;
    let LoadResult { scene, hints, .. } = read_with(from, &loading.options(true));
    let mut scene = scene.map_err(|error| WithHints { error, hints: hints.clone() })?;
    if let Some(placement) = loading.placement() {
        scene.place_camera(placement);
    }
    let notes = save(&scene, to, *force)?;
    if !quiet {
        let of_reading = scene.warnings.iter().map(ToString::to_string);
        for note in of_reading.chain(notes) {
            report!("note: {note}");
        }
        hints::report(&hints);
        report!("saved {}", to.display());
    }
    Ok(ExitCode::SUCCESS)
}
