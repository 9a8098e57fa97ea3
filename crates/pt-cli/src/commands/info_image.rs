//! `pathtracer info` of an image or a film: its provenance metadata.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Result, anyhow};
use pathtracer::film_file::{self, FilmFile, film_of_image};
use pathtracer::image;
use pathtracer::provenance::{Provenance, RunStatistics};

use super::info_scene;
use crate::command_args::Info;
use crate::output;
use crate::output::is_film;

/// Prints the provenance metadata of an image or a film, or the contents of a scene.
///
/// # Errors
/// If the file cannot be read, or has no metadata.
pub(crate) fn run(info: &Info) -> Result<ExitCode> {
    if pathtracer::is_scene(&info.file) {
        return info_scene::run(info);
    }
    let receipt = receipt_of(&info.file)?;
    let text = if info.json { receipt.to_text() + "\n" } else { text(&receipt) };
    output::print(&text)
}

/// Provenance of a film, of an image, or of the film beside an image without metadata.
fn receipt_of(path: &Path) -> Result<Provenance> {
    if is_film(path) {
        return of_film(path);
    }
    let found = Provenance::find(&image::metadata(path)?)
        .map_err(|message| anyhow!("{}: {message}", path.display()))?;
    let film = film_of_image(path);
    match found {
        Some(receipt) => Ok(receipt),
        None if film.is_file() => of_film(&film),
        None => Err(anyhow!(
            "{}: missing provenance metadata, which images of pathtracer have except with \
             --metadata none",
            path.display()
        )),
    }
}

fn of_film(path: &Path) -> Result<Provenance> {
    let FilmFile { about, film } = film_file::read(path)?;
    let run = RunStatistics {
        command: about.command.clone(),
        folder: about.folder.clone(),
        seal: String::new(),
        layout: about.layout,
        seconds: about.seconds,
        rays: about.rays,
        threads: None,
        machine: None,
        date: None,
    };
    Ok(Provenance::new(&about, &film, Some(run)))
}

fn text(receipt: &Provenance) -> String {
    let mut text = String::new();
    let mut line = |name: &str, value: &str| {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name:<40}{value}");
    };
    line("version", &receipt.version);
    line("state", if receipt.finished { "finished" } else { "not finished" });
    let Provenance { first, spp, samples, .. } = receipt;
    line(
        "samples",
        &format!("{first} to {spp}, {samples} in all, {:.1} per pixel", receipt.per_pixel()),
    );
    line("samples refused", if receipt.refused.is_empty() { "none" } else { &receipt.refused });
    let error = receipt.error.map(|error| format!("{:.3} %", 100.0 * error));
    line("error, if samples are independent", &error.unwrap_or("not known".into()));
    if let Some([error, least, most]) = receipt.measured.map(|all| all.map(|e| 100.0 * e)) {
        line("error, as measured", &format!("{error:.3} % ({least:.3} to {most:.3})"));
    }
    let film = if receipt.film.is_empty() { "not known (joined images)" } else { &receipt.film };
    line("hash of the film", film);
    if let Some(run) = &receipt.run {
        line("rays", &run.rays.to_string());
        line("seconds", &format!("{:.1}", run.seconds));
        for (name, value) in [("machine", &run.machine), ("date", &run.date)] {
            line(name, value.as_deref().unwrap_or("not known"));
        }
        let threads = run.threads.map_or("not known".into(), |threads| threads.to_string());
        line("threads", &threads);
        line("folder", &run.folder.display().to_string());
        let words = run.command.iter().map(String::as_str);
        // Arguments contain no NUL.
        line("command", &format!("pathtracer {}", shlex::try_join(words).unwrap_or_default()));
    }
    for missing in &receipt.missing {
        line("missing", missing);
    }
    for (name, hash) in &receipt.files {
        line(&format!("file {name}"), hash);
    }
    for (name, value) in &receipt.settings {
        line(name, value);
    }
    text
}
