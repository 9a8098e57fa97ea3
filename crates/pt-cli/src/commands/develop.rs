//! `pathtracer develop`: exposure, tone curve, alpha, crop and size of rendered images.

use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result, anyhow, ensure};
use pathtracer::image::{self, Decoded, Image, ImageFile, SaveOptions};
use pathtracer::{Region, provenance};

use crate::arg_values::Switch;
use crate::command_args::Develop;
use crate::crop;
use crate::denoise::{DENOISER, NOISY};
use crate::lock::Lock;
use crate::output;
use crate::targets::{self, Done, Targets};

/// Develops images.
///
/// # Errors
/// If the options exclude each other, or an output is invalid. Errors of single images are
/// reported.
pub(crate) fn run(develop: &Develop) -> Result<ExitCode> {
    targets::reported(develop.quiet, |done| developed(develop, done))
}

/// Develops images, and passes the result of each to `done`.
///
/// # Errors
/// If the options exclude each other, or an output is invalid.
pub(crate) fn developed(develop: &Develop, done: Done<'_>) -> Result<()> {
    let targets = Targets::new(&develop.images, develop.output.as_deref(), |image| {
        image.with_extension("png")
    })?;
    develop.png.check(targets.have_ending("png")).map_err(anyhow::Error::msg)?;
    develop.exr.check(targets.have_ending("exr")).map_err(anyhow::Error::msg)?;
    targets.for_each(|input, target| write(develop, input, target), done);
    Ok(())
}

fn write(develop: &Develop, input: &Path, target: &Path) -> Result<()> {
    let _lock = Lock::take(target)?;
    let file = image::load_file(input)?;
    let metadata = provenance_of(&file.options.metadata);
    let of_input = |message: String| anyhow!("{}: {message}", input.display());
    let mut shown = layer(file, develop.layer.as_deref()).map_err(of_input)?;
    shown = shown.framed().map_err(of_input)?;
    if let Some(cell) = develop.crop.rectangle() {
        let size = [shown.image.width, shown.image.height];
        let Region { x, y, width, height } =
            crop::region(cell, size).with_context(|| input.display().to_string())?;
        shown = shown.cropped([x, y], [width, height]).map_err(of_input)?;
    }
    make_finite(&mut shown.image, input);
    if let Some([width, height]) = develop.size() {
        let too_large = |message| anyhow!("--resize {width} {height}: {message}");
        shown = shown.resized([width, height]).map_err(too_large)?;
    }
    let Decoded { image, alpha, .. } = shown;
    let options = SaveOptions {
        png_bits: develop.png.bits(),
        tone: develop.png.tone_of(&image),
        exr_type: develop.exr.exr_type.map(Into::into).unwrap_or_default(),
        exr_compression: develop.exr.exr_compression.map(Into::into).unwrap_or_default(),
        metadata,
        alpha: wanted(alpha, develop.alpha, input)?,
        ..SaveOptions::default()
    };
    output::save(&image, target, &options)
}

/// Image of a layer, or of the colours of a file.
fn layer(file: ImageFile, name: Option<&str>) -> Result<Decoded, String> {
    let Some(name) = name else { return Ok(file.into_decoded()) };
    let Some(mut layer) = file.layer(name) else {
        let found = file.layers();
        let found = if found.is_empty() { "none".to_owned() } else { found.join(", ") };
        return Err(format!("found no layer {name:?}, expected one of its layers: {found}"));
    };
    if name == NOISY {
        layer.alpha = layer.alpha.or(file.options.alpha);
    }
    Ok(layer)
}

/// Alpha that is written: that of the image, unless it is switched off.
fn wanted(
    alpha: Option<Vec<f32>>,
    switch: Option<Switch>,
    input: &Path,
) -> Result<Option<Vec<f32>>> {
    ensure!(
        switch != Some(Switch::On) || alpha.is_some(),
        "{}: found no alpha, expected a channel A, as --alpha of a render writes it",
        input.display()
    );
    Ok(alpha.filter(|_| switch != Some(Switch::Off)))
}

/// Replaces values that are not finite, with a warning.
pub(crate) fn make_finite(image: &mut Image, path: &Path) {
    if let Some(message) = image.make_finite() {
        report!("warning: {}: {message}", path.display());
    }
}

/// Metadata of an image of pathtracer that its developed images keep, in the order of a render;
/// those of other programs may not be representable.
pub(crate) fn provenance_of(metadata: &[(String, String)]) -> Vec<(String, String)> {
    if !matches!(provenance::Provenance::find(metadata), Ok(Some(_))) {
        return vec![crate::provenance::software()];
    }
    let keys = ["Software", provenance::KEY, DENOISER];
    let kept = keys.iter().filter_map(|kept| metadata.iter().find(|(key, _)| key == kept));
    kept.cloned().collect()
}
