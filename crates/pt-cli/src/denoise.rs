//! Denoised images, written together with the noisy ones.

use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Result, bail};
use pathtracer::Film;
use pathtracer::denoise::{self, DenoiseError, Denoiser, NEEDED};
use pathtracer::image::{Channel, Image, Samples, SaveOptions};

use crate::job::Mode;

/// Layer of an EXR image, and suffix of the name of a PNG image, that contains the noisy image.
pub(crate) const NOISY: &str = "noisy";

/// Key of the metadata of a denoised image.
pub(crate) const DENOISER: &str = "Denoiser";

/// Denoising of images, with the library that it uses.
pub(crate) struct Denoising {
    is_wanted: bool,
    is_quiet: bool,
    denoiser: Option<Denoiser>,
}

impl Denoising {
    /// Opens the library if denoising is requested. If the library is missing, a warning is printed
    /// and the noisy image is written.
    ///
    /// # Errors
    /// If the library is missing and `--strict` is given.
    pub(crate) fn begin(is_wanted: bool, mode: Mode, threads: usize) -> Result<Self> {
        let denoiser = match is_wanted.then(|| Denoiser::open(threads)).transpose() {
            Ok(denoiser) => denoiser,
            Err(error) if mode.strict => bail!("--denoise: {error}"),
            Err(error) => {
                warn(&error);
                None
            }
        };
        Ok(Self { is_wanted, is_quiet: mode.quiet, denoiser })
    }

    /// Returns the files of a rendered image. With denoising, the first one contains the denoised
    /// image. The noisy image is a layer of it, or a second file if the format has no layers.
    pub(crate) fn images(
        &self,
        film: &Film,
        path: &Path,
        rendered: Image,
        mut options: SaveOptions,
    ) -> Vec<(PathBuf, Image, SaveOptions)> {
        let has_layers = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("exr"));
        if self.is_wanted && !has_layers {
            options.channels.retain(|channel| !NEEDED.iter().any(|aov| is_of(channel, aov.name())));
        }
        let Some((denoised, denoiser)) = self.denoised(film) else {
            return vec![(path.to_owned(), rendered, options)];
        };
        let of_rendered = options.clone();
        let beside = noisy_path(path);
        let place = if has_layers {
            options.channels.extend(noisy_layer(&rendered));
            format!("layer {NOISY}")
        } else {
            beside.file_name().unwrap_or_default().to_string_lossy().into_owned()
        };
        options.metadata.push((DENOISER.into(), description(denoiser, &place)));
        let mut files = vec![(path.to_owned(), denoised, options)];
        if !has_layers {
            files.push((beside, rendered, of_rendered));
        }
        files
    }

    fn denoised(&self, film: &Film) -> Option<(Image, &Denoiser)> {
        let denoiser = self.denoiser.as_ref()?;
        let start = Instant::now();
        let denoised = denoise::denoised(denoiser, film).map_err(|error| warn(&error)).ok()?;
        if !self.is_quiet {
            let seconds = start.elapsed().as_secs_f64();
            report!("denoised  by Open Image Denoise {} in {seconds:.2} s", denoiser.version());
        }
        Some((denoised, denoiser))
    }
}

/// Value of the metadata [`DENOISER`]: version of the library and place of the noisy image.
pub(crate) fn description(denoiser: &Denoiser, place: &str) -> String {
    format!("Open Image Denoise {}; as rendered: {place}", denoiser.version())
}

fn warn(error: &DenoiseError) {
    report!("warning: --denoise: {error}\n  the image is written without denoising");
}

/// Path of the noisy image beside a denoised one.
fn noisy_path(image: &Path) -> PathBuf {
    let mut name = image.file_stem().unwrap_or_default().to_owned();
    name.push(format!("_{NOISY}."));
    name.push(image.extension().unwrap_or_default());
    image.with_file_name(name)
}

/// Returns true if a channel belongs to a layer.
pub(crate) fn is_of(channel: &Channel, layer: &str) -> bool {
    channel.name.split('.').next() == Some(layer)
}

/// Layer with the channels of the noisy image.
pub(crate) fn noisy_layer(rendered: &Image) -> [Channel; 3] {
    [("R", 0), ("G", 1), ("B", 2)].map(|(letter, c)| Channel {
        name: format!("{NOISY}.{letter}"),
        samples: Samples::Real(rendered.pixels.iter().map(|p| p[c]).collect()),
        half_suffices: true,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noisy_images_stand_beside_their_image() {
        assert_eq!(noisy_path(Path::new("a/b.c.png")), Path::new("a/b.c_noisy.png"));
        assert_eq!(noisy_path(Path::new("b.PNG")), Path::new("b_noisy.PNG"));
    }
}
