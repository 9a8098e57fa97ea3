//! `pathtracer info`: what is in a film.

use std::fmt::Write as _;
use std::process::ExitCode;

use anyhow::Result;
use pathtracer::film_file::{self, FilmFile, film_of_image};

use crate::check::is_film;
use crate::commands::Info;
use crate::output;

/// Prints what a film says about itself.
///
/// # Errors
/// If it cannot be read.
pub(crate) fn run(info: &Info) -> Result<ExitCode> {
    let path = if is_film(&info.file) { info.file.clone() } else { film_of_image(&info.file) };
    output::print(text(&film_file::read(&path)?).as_bytes())
}

fn text(file: &FilmFile) -> String {
    let FilmFile { about, film } = file;
    let area = film.region().area().max(1) as f64;
    let mut text = String::new();
    let mut line = |name: &str, value: &str| {
        // Strings take all.
        let _ = writeln!(text, "{name:<40}{value}");
    };
    line("version", &about.version);
    let state = if about.finished { "finished" } else { "not finished" };
    line("state", state);
    let taken = film.samples() as f64 / area;
    line("samples", &format!("{} to {}, {taken:.1} per pixel", film.first(), about.spp));
    let rejections = film.rejections();
    let refused = if rejections.count() == 0 { "none".into() } else { rejections.to_string() };
    line("samples refused", &refused);
    line("rays", &about.rays.to_string());
    line("seconds", &format!("{:.1}", about.seconds));
    line("folder", &about.folder.display().to_string());
    line("command", &format!("pathtracer {}", about.command.join(" ")));
    for (name, hash) in &about.files {
        line(&format!("file {name}"), hash);
    }
    for (name, value) in &about.settings {
        line(name, value);
    }
    text
}
