//! Output of texts and of image files.

use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, Result};
use pathtracer::cryptomatte::{self, MatteNames};
use pathtracer::image::{self, Extreme, Image, SaveOptions};
use pathtracer::provenance::Provenance;
use pathtracer::{Film, Region, Session, aov, groups};

use crate::denoise::Denoising;
use crate::job::{Mode, OutputJob};
use crate::message::printable;
use crate::provenance::metadata;
use crate::tev::Viewer;

/// Prints a text, [printable], to standard output; a closed reader is no error.
///
/// # Errors
/// If standard output cannot be written, as on a full disk.
pub(crate) fn print(text: &str) -> Result<ExitCode> {
    print_as_is(printable(text).as_bytes())
}

/// Prints a text of the program itself as [`print()`] does, but without escaping control
/// characters.
///
/// # Errors
/// As [`print()`].
pub(crate) fn print_as_is(text: &[u8]) -> Result<ExitCode> {
    let mut out = std::io::stdout();
    match out.write_all(text).and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(e).context("cannot print"),
        _ => Ok(ExitCode::SUCCESS),
    }
}

/// Returns true if the file has this extension.
pub(crate) fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
}

/// Returns true if the extension is that of a film.
pub(crate) fn is_film(path: &Path) -> bool {
    has_ending(path, "film")
}

/// Path of the image of sampling rates beside an image.
fn rate_path(image: &Path) -> PathBuf {
    let stem = image.with_extension("");
    PathBuf::from(format!("{}_rate.png", stem.to_string_lossy()))
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
        "{}: found no folder {}; create it, or choose another location with -f",
        path.display(),
        folder.display()
    );
    anyhow::ensure!(
        !path.is_dir(),
        "{}: found a folder, expected the name of a file",
        path.display()
    );
    pathtracer::check_target(path)?;
    tempfile::Builder::new()
        .prefix(".pathtracer-")
        .tempfile_in(folder)
        .map(drop)
        .with_context(|| format!("{}: cannot create a file in its folder", path.display()))
}

/// Files of a render, and how they are written.
pub(crate) struct Output {
    job: OutputJob,
    mode: Mode,
    denoising: Denoising,
}

impl Output {
    /// Checks that the files can be written, and opens the library for denoising if it is needed.
    ///
    /// # Errors
    /// If they cannot, or the library is missing and the mode is strict.
    pub(crate) fn new(job: OutputJob, mode: Mode, threads: usize) -> Result<Self> {
        for file in std::iter::once(&job.path).chain(&job.summary_json) {
            check_writable(file)?;
        }
        let denoising = Denoising::begin(job.denoise, mode, threads)?;
        Ok(Self { job, mode, denoising })
    }

    /// Path of the image, or of the film that is written instead.
    pub(crate) fn path(&self) -> &Path {
        &self.job.path
    }

    /// Path of the summary in JSON, if it is requested.
    pub(crate) fn summary_json(&self) -> Option<&Path> {
        self.job.summary_json.as_deref()
    }

    /// Returns true if only the film is written.
    pub(crate) fn is_film(&self) -> bool {
        is_film(&self.job.path) && self.mode.policies.films
    }

    /// Connects to the viewer, if one is requested; prints a warning if that fails.
    pub(crate) fn connect(&self) -> Option<Viewer> {
        let address = self.job.tev.as_deref()?;
        let connected = Viewer::connect(address, &self.job.path.display().to_string());
        connected.map_err(|warning| report!("warning: {warning}")).ok()
    }

    /// Writes the image, and the sampling rates of an adaptive render; returns the files.
    ///
    /// # Errors
    /// If a file cannot be written; then it is as it was before.
    pub(crate) fn write(&self, session: &Session, provenance: &Provenance) -> Result<Vec<PathBuf>> {
        let mut files = self.write_film(session.film(), session.names(), provenance)?;
        let path = self.mode.policies.rate_path;
        if path.is_some() || session.settings().adaptive.is_some() {
            let rate = path.unwrap_or(rate_path)(&self.job.path);
            let (width, height, pixels) = session.rate_image();
            image::save_rgb8(&rate, width, height, &pixels)?;
            files.push(rate);
        }
        Ok(files)
    }

    /// Writes the image of a film, denoised if requested, with the names of its Cryptomatte ids;
    /// returns the files.
    ///
    /// # Errors
    /// If a file cannot be written; then it is as it was before.
    pub(crate) fn write_film(
        &self,
        film: &Film,
        names: &MatteNames,
        provenance: &Provenance,
    ) -> Result<Vec<PathBuf>> {
        let path = &self.job.path;
        let rendered = rendered(film);
        let options = self.save_options(&rendered, provenance);
        let Image { width, height, .. } = rendered;
        if !image::is_image(path) {
            let encode = |v| options.transfer.encode8(v);
            let bytes: Vec<[u8; 3]> = rendered.pixels.iter().map(|p| p.map(encode)).collect();
            image::save_rgb8(path, width, height, &bytes)?;
            return Ok(vec![path.clone()]);
        }
        let mut options =
            SaveOptions { alpha: film.alpha(), channels: aov::channels(film), ..options };
        options.channels.extend(cryptomatte::channels(film, names));
        options.metadata.extend(cryptomatte::metadata(film, names));
        options.channels.extend(groups::channels(film));
        let mut files = Vec::new();
        for (path, image, options) in self.denoising.images(film, path, rendered, options) {
            save(&image, &path, &options)?;
            files.push(path);
        }
        Ok(files)
    }

    /// Options of the image file, with its metadata and exposure.
    fn save_options(&self, rendered: &Image, provenance: &Provenance) -> SaveOptions {
        let mut options = SaveOptions {
            metadata: metadata(self.job.metadata, provenance),
            ..self.job.save.clone()
        };
        if self.job.auto_exposure {
            options.tone.exposure = image::auto_exposure(rendered);
        }
        options
    }

    /// Prints a note if a PNG image is nearly all black or white, with a likely cause and a remedy.
    pub(crate) fn report_extremes(&self, session: &Session) {
        if has_ending(&self.job.path, "png")
            && self.mode.policies.notes_extremes
            && !self.job.auto_exposure
            && let Some(message) = extreme(session, self.job.save.tone.exposure)
        {
            report!("note: {message}");
        }
    }
}

/// Writes an image; prints a warning if numbers exceed the pixel type.
///
/// # Errors
/// If the file cannot be written; then it is as it was before.
pub(crate) fn save(image: &Image, path: &Path, options: &SaveOptions) -> Result<()> {
    image::save(image, path, options)?;
    let count = image::count_beyond_half(image, options);
    if has_ending(path, "exr") && count > 0 {
        report!(
            "warning: {}: {count} numbers exceed 65504, the maximum of 16 bits, and are clamped to \
             it; --exr-type float keeps them",
            path.display()
        );
    }
    Ok(())
}

/// Image of a film without denoising.
fn rendered(film: &Film) -> Image {
    let Region { width, height, .. } = film.region();
    Image { width, height, pixels: pathtracer::radiance(film).into() }
}

/// Message about an image that is nearly all black or white.
fn extreme(session: &Session, exposure: f32) -> Option<String> {
    let image = session.image();
    Some(match image::extreme(&image, exposure)? {
        Extreme::Nothing if session.scene().light_count == 0 => return None, // already reported
        Extreme::Nothing => {
            "the image is black: no light reaches the visible surfaces. --integrator normals shows \
             the shapes, --camera fit all of them, and -e FILE.exr adds light from all directions"
                .to_owned()
        }
        Extreme::Dark => format!(
            "nearly all of the image is black: its light is too weak for the distances of the \
             scene, or does not reach the view. --exposure auto brightens it by {:.1} stops; \
             --camera fit shows all surfaces",
            image::auto_exposure(&image)
        ),
        Extreme::Bright => format!(
            "nearly all of the image is brighter than white. --exposure auto darkens it by {:.1} \
             stops, and --tonemap agx maps all light to the range of a screen",
            -image::auto_exposure(&image)
        ),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rate_images_stand_beside_their_image() {
        assert_eq!(rate_path(Path::new("a/b.png")), Path::new("a/b_rate.png"));
    }
}
