//! Options of image files.

use std::path::{Path, PathBuf};

use pathtracer::cryptomatte;
use pathtracer::image::{BitDepth, SaveOptions, Tone, ToneCurve};

use crate::arg_values::{ExrCompression, PngBits};
use crate::args::Cli;
use crate::job::OutputJob;
use crate::output::is_film;
use crate::parse::Exposure;

/// Rejects image options that the format does not support or that conflict.
///
/// # Errors
/// A message with the option and the remedy.
pub(super) fn check(cli: &Cli) -> Result<(), String> {
    let has_ending =
        |path: &PathBuf, ending| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    let output = cli.output.as_ref().and_then(Option::as_ref);
    let is = |ending| output.is_some_and(|path| has_ending(path, ending) || is_film(path));
    if (cli.exposure.is_some() || cli.tonemap.is_some()) && output.is_some() && !is("png") {
        return Err(
            "--exposure and --tonemap require a PNG image: EXR images store radiance, and viewers \
             apply exposure and curves; give -f out.png, or omit them"
                .into(),
        );
    }
    if cli.exposure == Some(Exposure::Auto) && cli.stop.has_target() {
        return Err(
            "--exposure auto depends on the image, but an error target requires a fixed exposure; \
             give a number of stops"
                .into(),
        );
    }
    if (cli.exr_type.is_some() || cli.exr_compression.is_some()) && !is("exr") {
        return Err(
            "--exr-type and --exr-compression require an OpenEXR image, as in -f out.exr".into()
        );
    }
    if matches!(cli.exr_compression, Some(ExrCompression::Pxr24)) && cryptomatte::is_among(&cli.aov)
    {
        return Err(
            "--exr-compression pxr24 keeps 24 of 32 bits, but --aov cryptomatte_object and \
             cryptomatte_material require all; choose zip, zips or piz"
                .into(),
        );
    }
    Ok(())
}

/// Files of a render of a scene.
pub(super) fn output(cli: &Cli, scene: Option<&Path>) -> OutputJob {
    OutputJob {
        path: path(cli, scene),
        save: SaveOptions {
            png_bits: match cli.png_bits {
                PngBits::Eight => BitDepth::Eight,
                PngBits::Sixteen => BitDepth::Sixteen,
            },
            transfer: cli.policies().transfer,
            tone: Tone {
                exposure: cli.exposure.and_then(Exposure::stops).unwrap_or(0.0),
                curve: cli.tonemap.map_or(ToneCurve::Linear, ToneCurve::from),
            },
            exr_type: cli.exr_type.map(Into::into).unwrap_or_default(),
            exr_compression: cli.exr_compression.map(Into::into).unwrap_or_default(),
            ..SaveOptions::default()
        },
        auto_exposure: cli.exposure == Some(Exposure::Auto),
        metadata: cli.receipt,
        denoise: cli.denoise,
        summary_json: cli.summary_json.clone(),
        tev: cli.tev.clone(),
    }
}

/// Path of the image: as given, or the name of the scene with `.png`.
fn path(cli: &Cli, scene: Option<&Path>) -> PathBuf {
    if let Some(Some(path)) = &cli.output {
        return path.clone();
    }
    let stem = scene.and_then(Path::file_stem).unwrap_or("cornell".as_ref());
    let mut name = stem.to_owned();
    name.push(".png");
    name.into()
}
