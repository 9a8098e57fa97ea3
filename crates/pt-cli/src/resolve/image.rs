//! Options of image files.

use std::path::{Path, PathBuf};

use pathtracer::cryptomatte;
use pathtracer::image::SaveOptions;

use crate::arg_values::ExrCompression;
use crate::args::Cli;
use crate::job::OutputJob;
use crate::output::{has_ending, is_film};

/// Rejects image options that the format does not support or that conflict.
///
/// # Errors
/// A message with the option and the remedy.
pub(super) fn check(cli: &Cli) -> Result<(), String> {
    let output = cli.output.as_ref().and_then(Option::as_ref);
    let is = |ending| output.is_some_and(|path| has_ending(path, ending) || is_film(path));
    cli.png.check(output.is_none() || is("png"))?;
    if cli.png.is_auto() && cli.stop.has_target() {
        return Err(
            "--exposure auto depends on the image, but an error target requires a fixed exposure; \
             give a number of stops"
                .into(),
        );
    }
    cli.exr.check(is("exr"))?;
    if matches!(cli.exr.exr_compression, Some(ExrCompression::Pxr24))
        && cryptomatte::is_among(&cli.aov)
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
            png_bits: cli.png.bits(),
            transfer: cli.policies().transfer,
            tone: cli.png.tone(),
            exr_type: cli.exr.exr_type.map(Into::into).unwrap_or_default(),
            exr_compression: cli.exr.exr_compression.map(Into::into).unwrap_or_default(),
            ..SaveOptions::default()
        },
        auto_exposure: cli.png.is_auto(),
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
