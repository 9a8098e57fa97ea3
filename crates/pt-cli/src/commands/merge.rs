//! `pathtracer merge`: merges the samples of several films, and writes their image.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, bail, ensure};
use pathtracer::checkpoint::{differences, in_lines};
use pathtracer::film_file::{self, FilmFile, FilmHeader, Written};
use pathtracer::image;
use pathtracer::provenance::Provenance;

use super::resume;
use crate::command_args::Merge;
use crate::film_header::run_of;
use crate::job::OutputJob;
use crate::lock::Lock;
use crate::output::{Output, is_film};
use crate::resolve::{EarlierRun, resolve};
use crate::{output, seal};

/// A film, its path, and the range of its samples.
struct FilmPart {
    path: PathBuf,
    file: FilmFile,
    samples: Range<u32>,
}

/// Merges films, and writes the image or the film of the sum.
///
/// # Errors
/// As [`merged`].
pub(crate) fn run(merge: &Merge) -> Result<ExitCode> {
    let whole = merged(&merge.films, &merge.output)?;
    if !merge.quiet {
        report!(
            "saved {} of samples {} to {} per pixel, from {} films",
            merge.output.display(),
            whole.film.first(),
            whole.about.spp,
            merge.films.len()
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Merges films, writes the image or the film of the sum, and returns it.
///
/// # Errors
/// If a film cannot be read or does not match the others, or the output cannot be written.
pub(crate) fn merged(films: &[PathBuf], path: &Path) -> Result<FilmFile> {
    ensure!(
        image::is_image(path) || is_film(path),
        "-f {}: unknown extension; expected .png, .exr or .film",
        path.display()
    );
    output::check_writable(path)?;
    let _lock = Lock::take(path)?;
    let mut parts = films.iter().map(|path| read(path)).collect::<Result<Vec<_>>>()?;
    parts.sort_by_key(|part| part.samples.start);
    check(&parts, !is_film(path))?;
    let are_ours = parts.iter().all(is_ours);
    let (paths, mut whole) = sum(parts);
    let FilmHeader { folder, command, .. } = &whole.about;
    whole.about.seal = if are_ours { seal::of(path, folder, command) } else { String::new() };
    if is_film(path) {
        film_file::write(path, &whole.about, &whole.film).and_then(Written::place)?;
    } else {
        let cli = resume::stored_options(&paths[0], &whole.about)?;
        let job = resolve(cli, Vec::new(), EarlierRun::default()).map_err(anyhow::Error::msg)?;
        let receipt = provenance_of(&whole);
        let job_of_output = OutputJob { path: path.to_owned(), summary_json: None, ..job.output };
        let output = Output::new(job_of_output, job.mode, 0)?;
        output.write_film(&whole.film, &whole.about.names, &receipt)?;
    }
    Ok(whole)
}

/// Provenance of the image of a film.
pub(crate) fn provenance_of(FilmFile { about, film }: &FilmFile) -> Provenance {
    Provenance::new(about, film, Some(run_of(about, None)))
}

/// Returns true if the program made the film for this user in its place: as an output, or beside an
/// image.
fn is_ours(part: &FilmPart) -> bool {
    let FilmHeader { seal, folder, command, .. } = &part.file.about;
    let outputs = [part.path.clone(), part.path.with_extension("")];
    outputs.iter().any(|output| seal::is_ours(seal, output, folder, command))
}

/// Reads a film, all pixels of which must have the same samples.
fn read(path: &Path) -> Result<FilmPart> {
    let file = film_file::read(path)?;
    ensure!(
        !file.film.has_half_buffers(),
        "{}: a film with two halves (error target, half_a or half_b) cannot be merged",
        path.display()
    );
    let Some(count) = file.film.uniform_spp().filter(|_| file.about.finished) else {
        bail!(
            "{}: unfinished film with {:.1} of {} samples per pixel; continue it with pathtracer \
             resume {}",
            path.display(),
            file.film.samples() as f64 / file.film.region().area().max(1) as f64,
            file.about.spp.saturating_sub(file.film.first()),
            path.display()
        );
    };
    let first = file.film.first();
    Ok(FilmPart { path: path.to_owned(), file, samples: first..first + count })
}

/// Returns an error if the films do not match: if they are of different images, if samples are
/// repeated, or if samples are missing in between or, with `from_first`, before the first.
fn check(parts: &[FilmPart], from_first: bool) -> Result<()> {
    for pair in parts.windows(2) {
        let [first, second] = [&pair[0], &pair[1]];
        let (a, b) = (first.path.display(), second.path.display());
        let differences = differences(&first.file.about, &second.file.about);
        ensure!(
            differences.is_empty(),
            "{a} and {b} are films of different images (of {a} \"before\", of {b} \"now\"):{}",
            in_lines(&differences)
        );
        let [x, y] = [&first.file.film, &second.file.film];
        ensure!(
            x.region() == y.region() && x.has_same_layout(y),
            "{a} and {b} have different pixels or channels, although their headers agree: one of \
             them is not a film of pathtracer"
        );
        let (end, start) = (first.samples.end, second.samples.start);
        let twice = start..end.min(second.samples.end);
        ensure!(
            twice.is_empty(),
            "found samples {} to {} in both {a} and {b}, expected disjoint ranges; give one of \
             them",
            twice.start,
            twice.end
        );
        ensure!(
            end == start,
            "missing samples {end} to {start} between {a} and {b}; render them with --samples \
             {end}..{start} -f missing.film"
        );
    }
    let start = parts.first().map_or(0, |part| part.samples.start);
    ensure!(
        !from_first || start == 0,
        "missing samples 0 to {start}; render them with --samples 0..{start} -f missing.film, or \
         merge to a .film file"
    );
    Ok(())
}

/// Merges the films; returns their paths and the sum.
fn sum(parts: Vec<FilmPart>) -> (Vec<PathBuf>, FilmFile) {
    let paths = parts.iter().map(|part| part.path.clone()).collect();
    let sum = parts.into_iter().map(|part| part.file).reduce(|mut sum, next| {
        sum.film.merge(&next.film);
        let (seconds, rays) = (next.about.seconds, next.about.rays);
        let about = sum.about;
        sum.about = FilmHeader {
            spp: next.about.spp,
            seconds: about.seconds + seconds,
            rays: about.rays + rays,
            ..about
        };
        sum
    });
    (paths, sum.expect("the command line has one at least"))
}
