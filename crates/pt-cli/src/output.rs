//! Output of texts and of image files.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use pathtracer::cryptomatte::{self, Names};
use pathtracer::image::{self, Extreme, Image, SaveOptions};
use pathtracer::provenance::Provenance;
use pathtracer::{Film, Region, Session, aov, groups};

use crate::denoise::Denoising;
use crate::image_options::{self, Exposure};
use crate::message::printable;
use crate::resolve::RenderJob;

/// Prints a text, [printable], to standard output; a closed reader is no error.
///
/// # Errors
/// If standard output cannot be written, as on a full disk.
pub(crate) fn print(text: &str) -> Result<ExitCode> {
    print_as_is(printable(text).as_bytes())
}

/// Prints a text of the program itself as [`print`] does, but without escaping control characters.
///
/// # Errors
/// As [`print`].
pub(crate) fn print_as_is(text: &[u8]) -> Result<ExitCode> {
    let mut out = std::io::stdout();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("cannot print"),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Path of the image of sampling rates beside an image.
pub(crate) fn rate_path(image: &Path, course: bool) -> PathBuf {
    let text = image.to_string_lossy();
    let stem = if course {
        // The course's program removes the last four characters, whatever they are.
        let keep = text.chars().count().saturating_sub(4);
        text.chars().take(keep).collect()
    } else {
        image.with_extension("").to_string_lossy().into_owned()
    };
    PathBuf::from(format!("{stem}_rate.png"))
}

/// Checks before rendering that the folder of the image exists and files can be created in it.
///
/// # Errors
/// If that is not so.
pub(crate) fn check_writable(path: &Path) -> Result<()> {
    let folder = match path.parent() {
        Some(p) if !p.as_os_str().is_empty() => p,
        _ => Path::new("."),
    };
    anyhow::ensure!(
        folder.is_dir(),
        "{}: there is no folder {}; make it, or choose another place with -f",
        path.display(),
        folder.display()
    );
    anyhow::ensure!(!path.is_dir(), "{}: is a folder; expected the name of a file", path.display());
    pathtracer::check_target(path)?;
    tempfile::Builder::new()
        .prefix(".pathtracer-")
        .tempfile_in(folder)
        .map(drop)
        .with_context(|| format!("{}: no file can be made in its folder", path.display()))
}

/// Writes the image of a film, denoised if requested, with the names of its Cryptomatte ids;
/// returns the files.
///
/// # Errors
/// If a file cannot be written; then it is as it was before.
pub(crate) fn write_image(
    film: &Film,
    names: &Names,
    path: &Path,
    options: SaveOptions,
    denoising: &Denoising,
) -> Result<Vec<PathBuf>> {
    let rendered = rendered(film);
    let Image { width, height, .. } = rendered;
    if image::is_image(path) {
        let mut options =
            SaveOptions { alpha: film.alpha(), channels: aov::channels(film), ..options };
        options.channels.extend(cryptomatte::channels(film, names));
        options.metadata.extend(cryptomatte::metadata(film, names));
        options.channels.extend(groups::channels(film));
        let mut files = Vec::new();
        for (path, image, options) in denoising.images(film, path, rendered, options) {
            image::save(&image, &path, &options)?;
            warn_beyond_half(&path, image::count_beyond_half(&image, &options));
            files.push(path);
        }
        return Ok(files);
    }
    let transfer = options.transfer;
    let bytes: Vec<[u8; 3]> =
        rendered.pixels.iter().map(|p| p.map(|v| transfer.encode8(v))).collect();
    image::save_rgb8(path, width, height, &bytes)?;
    Ok(vec![path.to_owned()])
}

fn warn_beyond_half(path: &Path, count: usize) {
    if count > 0 {
        report!(
            "warning: {}: {count} numbers are beyond 65504, the greatest of 16 bits, and are written as that; \
             --exr-type float keeps them",
            path.display()
        );
    }
}

/// Options for writing the image of a film.
pub(crate) fn save_options(request: &RenderJob, receipt: &Provenance, film: &Film) -> SaveOptions {
    let mut options = request.save_options(receipt);
    if request.cli.exposure == Some(Exposure::Auto) {
        options.tone.exposure = image::auto_exposure(&rendered(film));
    }
    options
}

/// Image of a film without denoising.
fn rendered(film: &Film) -> Image {
    let Region { width, height, .. } = film.region();
    Image { width, height, pixels: pathtracer::radiance(film) }
}

/// Writes the image, and the sampling rates of an adaptive render; returns the files.
///
/// # Errors
/// If a file cannot be written; then it is as it was before.
pub(crate) fn write(
    session: &Session,
    request: &RenderJob,
    receipt: &Provenance,
    denoising: &Denoising,
) -> Result<Vec<PathBuf>> {
    let path = request.output();
    let course = request.cli.cs184;
    let options = save_options(request, receipt, session.film());
    let mut files = write_image(session.film(), session.names(), &path, options, denoising)?;
    if course || session.settings().adaptive.is_some() {
        let rate = rate_path(&path, course);
        let (width, height, pixels) = session.rate_image();
        image::save_rgb8(&rate, width, height, &pixels)?;
        files.push(rate);
    }
    Ok(files)
}

/// Prints a note if a PNG image is nearly all black or white, with a likely cause and a remedy.
pub(crate) fn report_extremes(session: &Session, request: &RenderJob) {
    let is_png = request.output().extension().is_some_and(|e| e.eq_ignore_ascii_case("png"));
    if !is_png || request.cli.cs184 || request.cli.exposure == Some(Exposure::Auto) {
        return;
    }
    let image = session.image();
    let message = match image::extreme(&image, image_options::tone(&request.cli).exposure) {
        None => return,
        Some(Extreme::Nothing) if session.scene().light_count == 0 => return, // already reported
        Some(Extreme::Nothing) => {
            "the image is black: no light reaches what is seen. --integrator normals shows the shapes, --camera fit all of them, \
             and -e FILE.exr gives light from all around"
                .to_owned()
        }
        Some(Extreme::Dark) => format!(
            "nearly all of the image is black: its light is too weak for the distances of the scene, or falls elsewhere. \
             --exposure auto makes it brighter, by {:.1} stops; --camera fit shows all surfaces",
            image::auto_exposure(&image)
        ),
        Some(Extreme::Bright) => format!(
            "nearly all of the image is brighter than white. --exposure auto makes it darker, by {:.1} stops, and --tonemap \
             agx brings all light into the range of a screen",
            -image::auto_exposure(&image)
        ),
    };
    report!("note: {message}");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_images_stand_beside_their_image() {
        assert_eq!(rate_path(Path::new("a/b.png"), false), Path::new("a/b_rate.png"));
        assert_eq!(rate_path(Path::new("b.exr"), true), Path::new("b_rate.png"));
        assert_eq!(rate_path(Path::new("outx"), true), Path::new("_rate.png"));
    }
}
