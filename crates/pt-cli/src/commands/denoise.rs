//! `pathtracer denoise`: denoises rendered images.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Result, anyhow};
use pathtracer::Aov;
use pathtracer::denoise::{self, DenoiseError, Denoiser, NEEDED};
use pathtracer::image::{self, ImageFile};

use super::develop::{make_finite, provenance_of};
use crate::command_args::Denoise;
use crate::denoise::{DENOISER, NOISY, description, is_of, noisy_layer};
use crate::lock::Lock;
use crate::output;
use crate::output::has_ending;
use crate::targets::{self, Done, Targets};

/// Denoises images.
///
/// # Errors
/// If the options exclude each other, an output is invalid, or the library is missing. Errors of
/// single images are reported.
pub(crate) fn run(args: &Denoise) -> Result<ExitCode> {
    let open = || Denoiser::open(args.threads.unwrap_or(0));
    targets::reported(args.quiet, |done| denoised(args, open, done))
}

/// Denoises images by a library, and passes the result of each to `done`.
///
/// # Errors
/// If the options exclude each other, an output is invalid, or the library is missing.
pub(crate) fn denoised(
    args: &Denoise,
    open: impl FnOnce() -> Result<Denoiser, DenoiseError>,
    done: Done<'_>,
) -> Result<()> {
    let targets = Targets::new(&args.images, args.output.as_deref(), denoised_path)?;
    args.png.check(targets.have_ending("png")).map_err(anyhow::Error::msg)?;
    let denoiser = open()?;
    targets.for_each(|input, target| write(args, &denoiser, input, target), done);
    Ok(())
}

fn write(args: &Denoise, denoiser: &Denoiser, input: &Path, target: &Path) -> Result<()> {
    let _lock = Lock::take(target)?;
    let file = image::load_file(input)?.framed();
    let mut file = file.map_err(|message| anyhow!("{}: {message}", input.display()))?;
    restore_noisy(&mut file);
    make_finite(&mut file.image, input);
    let names = NEEDED.map(Aov::name);
    let is_missing = |name: &&str| !file.options.channels.iter().any(|c| is_of(c, name));
    if !args.quiet && names.iter().any(is_missing) {
        report!(
            "note: {}: found no layers albedo and normal, which preserve detail; --aov \
             albedo,normal of a render writes them",
            input.display()
        );
    }
    let clean = denoise::denoised_file(denoiser, &file)
        .map_err(|error| anyhow!("{}: {error}", input.display()))?;
    let ImageFile { image: noisy, mut options, .. } = file;
    options.png_bits = args.png.bits();
    options.tone = args.png.tone_of(&noisy);
    let place = if has_ending(target, "exr") {
        options.channels.extend(noisy_layer(&noisy));
        format!("layer {NOISY}")
    } else {
        options.channels.clear();
        options.metadata = provenance_of(&options.metadata);
        input.file_name().unwrap_or_default().to_string_lossy().into_owned()
    };
    options.metadata.retain(|(key, _)| key != DENOISER);
    options.metadata.push((DENOISER.into(), description(denoiser, &place)));
    output::save(&clean, target, &options)
}

/// Replaces the colours of a denoised image by those of its layer with the noisy image.
fn restore_noisy(file: &mut ImageFile) {
    if let Some(pixels) = file.plane(NOISY, ["R", "G", "B"]) {
        file.image.pixels = pixels.into();
        file.options.channels.retain(|channel| !is_of(channel, NOISY));
    }
}

/// Default path of the denoised image beside a noisy one.
fn denoised_path(image: &Path) -> PathBuf {
    let mut name = image.file_stem().unwrap_or_default().to_owned();
    name.push("_denoised.exr");
    image.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn denoised_images_stand_beside_their_image() {
        assert_eq!(denoised_path(Path::new("a/b.c.exr")), Path::new("a/b.c_denoised.exr"));
    }
}
