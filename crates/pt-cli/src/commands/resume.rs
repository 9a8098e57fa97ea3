//! `pathtracer resume`: continues a stopped render, or adds samples.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, ensure};
use pathtracer::film_file::{self, FilmFile, FilmHeader, film_of_image};
use pathtracer::{Observer, SamplerKind};

use super::render::{self, RenderResult};
use crate::args::Cli;
use crate::command_args::Resume;
use crate::job::RenderJob;
use crate::output::is_film;
use crate::resolve::{EarlierRun, resolve};
use crate::{command_line, trust};

/// Continues a render with the command stored in its film, in the folder of that command.
///
/// # Errors
/// If no film is found, or as a render.
pub(crate) fn run(resume: &Resume) -> Result<ExitCode> {
    render::run(job(resume, |output, about, cli| trust::enter(output, about, cli).map(|()| None))?)
}

/// Continues a render in a library.
///
/// # Errors
/// As [`run`].
pub(crate) fn resumed(resume: &Resume, observer: &dyn Observer) -> Result<RenderResult> {
    let mut job = job(resume, |output, about, cli| trust::folder(output, about, cli).map(Some))?;
    // The limit of memory would be that of the whole process.
    job.memory.limit = None;
    render::render(job, Some(observer))
}

/// Render that continues an earlier one. `place` returns the folder of the paths of its command;
/// `None` is the current one.
fn job(
    resume: &Resume,
    place: impl FnOnce(&Path, &FilmHeader, &Cli) -> Result<Option<PathBuf>>,
) -> Result<RenderJob> {
    let (film, FilmFile { about, film: samples }) = film_of(&resume.file)?;
    let (spp, taken) = (resume.spp.unwrap_or(about.spp), samples.first() + samples.max_samples());
    ensure!(
        taken <= spp,
        "{}: found {taken} samples per pixel; expected -s {taken} or more",
        film.display()
    );
    drop(samples);
    let mut cli = stored_options(&film, &about)?;
    let is_part = cli.output.as_ref().and_then(Option::as_ref).is_some_and(|path| is_film(path));
    let output = if is_part { film } else { film.with_extension("") };
    let output = std::path::absolute(&output).with_context(|| format!("{}", output.display()))?;
    cli.output = Some(Some(output.clone()));
    let options: &[&str] = match &mut cli.samples {
        Some((_, to)) => {
            *to = spp;
            &[]
        }
        None if cli.stop.has_target() => {
            cli.stop.max_spp = Some(spp);
            &["--max-spp"]
        }
        None => {
            cli.spp = Some(spp);
            &["--spp", "-s"]
        }
    };
    let mut command = about.command.clone();
    if resume.spp.is_some() && !SamplerKind::from(cli.sampler).depends_on_spp() {
        command = with_number(&command, options, spp);
    }
    cli.stop.time_limit = resume.time_limit;
    cli.threads = resume.threads.or(cli.threads);
    cli.checkpoint_every = resume.checkpoint_every.unwrap_or(cli.checkpoint_every);
    cli.quiet |= resume.quiet;
    cli.restart = false;
    trust::distrust(&resume.file, &mut cli, &resume.folders);
    let folder = place(&output, &about, &cli)?;
    let layout = Some(about.layout);
    let earlier = EarlierRun { folder, layout, resumes: true, expected: None };
    resolve(cli, command, earlier).map_err(anyhow::Error::msg)
}

/// Replaces the number behind one of these options in a command; appends the first option if none
/// is present.
fn with_number(command: &[String], options: &[&str], number: u32) -> Vec<String> {
    let number = number.to_string();
    let mut words = command.to_vec();
    for (i, word) in command.iter().enumerate() {
        for option in options {
            match word.strip_prefix(option) {
                Some("") if i + 1 < words.len() => words[i + 1].clone_from(&number),
                Some(value) if value.trim_start_matches('=').parse::<u32>().is_ok() => {
                    words[i] = format!("{option}={number}");
                }
                _ => continue,
            }
            return words;
        }
    }
    words.extend(options.iter().take(1).flat_map(|option| [(*option).to_owned(), number.clone()]));
    words
}

/// Reads the film of an image, or the film itself, and returns its path and contents.
fn film_of(file: &Path) -> Result<(PathBuf, FilmFile)> {
    let path = if is_film(file) { file.to_owned() } else { film_of_image(file) };
    if let Some((film, _)) = film_file::read_newest(&path)? {
        return Ok((path, film));
    }
    let message = format!(
        "{}: found no samples to resume; samples are stored beside images during rendering, and \
         beside finished .exr images",
        path.display()
    );
    Err(io::Error::new(ErrorKind::NotFound, message).into())
}

/// Parses the command that made a film or an image.
///
/// # Errors
/// If this version does not support the command.
pub(crate) fn stored_options(file: &Path, about: &FilmHeader) -> Result<Cli> {
    command_line::stored_options(&about.command).ok_or_else(|| {
        anyhow!(
            "{}: unsupported command of another version: pathtracer {}",
            file.display(),
            about.command.join(" ")
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_has_another_number_where_it_had_one() {
        let with = |command: &str, options: &[&str]| {
            let words: Vec<_> = command.split(' ').map(str::to_owned).collect();
            with_number(&words, options, 9).join(" ")
        };
        let spp = ["--spp", "-s"];
        for (command, wanted) in [
            ("-s 4 a.dae", "-s 9 a.dae"),
            ("-q -s4 a.dae", "-q -s=9 a.dae"),
            ("--spp=4 a.dae", "--spp=9 a.dae"),
            ("a.dae --spp 4", "a.dae --spp 9"),
            ("--seed 4 a.dae", "--seed 4 a.dae --spp 9"),
        ] {
            assert_eq!(with(command, &spp), wanted);
        }
        assert_eq!(with("--max-spp 4 a.dae", &["--max-spp"]), "--max-spp 9 a.dae");
        assert_eq!(with("-s 4 --samples 0..4 a.dae", &[]), "-s 4 --samples 0..4 a.dae");
    }
}
