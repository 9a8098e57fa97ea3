//! Options of image files.

use std::path::PathBuf;

use clap::ValueEnum;
use pathtracer::cryptomatte;
use pathtracer::image::{Compression, Precision, Tone, ToneCurve};

use crate::args::Cli;
use crate::resolve::is_film;

/// Tone curves.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Tonemap {
    /// No curve, clipped at white
    Linear,
    /// The curve of film of Hable (2010) in each channel
    Filmic,
    /// AgX of Sobotka, without a look
    Agx,
    /// ACES as fitted by Hill; darker than the others
    Aces,
    /// Khronos PBR Neutral: colours up to 0.8 stay
    PbrNeutral,
}

impl From<Tonemap> for ToneCurve {
    fn from(t: Tonemap) -> Self {
        match t {
            Tonemap::Linear => Self::Linear,
            Tonemap::Filmic => Self::Filmic,
            Tonemap::Agx => Self::Agx,
            Tonemap::Aces => Self::Aces,
            Tonemap::PbrNeutral => Self::PbrNeutral,
        }
    }
}

/// Pixel types of an OpenEXR file.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum ExrType {
    /// 16 bits, up to 65504, for colours, albedo and normals; 32 for the rest
    Half,
    /// 32 bits
    Float,
}

impl From<ExrType> for Precision {
    fn from(t: ExrType) -> Self {
        match t {
            ExrType::Half => Self::Half,
            ExrType::Float => Self::Float,
        }
    }
}

/// Compressions of an OpenEXR file.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum ExrCompression {
    /// No compression
    None,
    /// Runs of equal bytes
    Rle,
    /// Deflate, line by line
    Zips,
    /// Deflate, 16 lines at a time
    Zip,
    /// Wavelets, for noisy images
    Piz,
    /// Deflate; keeps 24 of 32 bits
    Pxr24,
    /// Blocks of 4 x 4 halves, with losses; float is kept as it is
    B44,
    /// As b44, with smaller blocks in flat areas
    B44a,
}

impl From<ExrCompression> for Compression {
    fn from(c: ExrCompression) -> Self {
        match c {
            ExrCompression::None => Self::None,
            ExrCompression::Rle => Self::Rle,
            ExrCompression::Zips => Self::Zips,
            ExrCompression::Zip => Self::Zip,
            ExrCompression::Piz => Self::Piz,
            ExrCompression::Pxr24 => Self::Pxr24,
            ExrCompression::B44 => Self::B44,
            ExrCompression::B44a => Self::B44a,
        }
    }
}

/// Exposure of PNG images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Exposure {
    /// Exposure in stops.
    Stops(f32),
    /// Exposure computed from the image.
    Auto,
}

impl Exposure {
    /// Exposure in stops, or `None` if it depends on the image.
    pub(crate) fn stops(self) -> Option<f32> {
        match self {
            Self::Stops(stops) => Some(stops),
            Self::Auto => None,
        }
    }
}

/// Parses a number of stops, or `auto`.
pub(crate) fn exposure(text: &str) -> Result<Exposure, String> {
    match text.parse::<f32>() {
        Ok(v) if v.abs() <= 100.0 => Ok(Exposure::Stops(v)),
        _ if text == "auto" => Ok(Exposure::Auto),
        _ => {
            Err("expected a number of stops from -100 up to 100, as in --exposure -1.5, or auto"
                .into())
        }
    }
}

/// Parses HOST:PORT.
pub(crate) fn address(text: &str) -> Result<String, String> {
    match text.rsplit_once(':') {
        Some((host, port)) if !host.is_empty() && port.parse::<u16>().is_ok_and(|p| p > 0) => {
            Ok(text.into())
        }
        _ => Err("expected the host and port where tev listens, as in 127.0.0.1:14158".into()),
    }
}

/// Rejects image options that the format does not support or that conflict.
///
/// # Errors
/// A message with the option and the remedy.
pub(crate) fn check(cli: &Cli) -> Result<(), String> {
    let has_ending =
        |path: &PathBuf, ending| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    let output = cli.output.as_ref().and_then(Option::as_ref);
    let is = |ending| output.is_some_and(|path| has_ending(path, ending) || is_film(path));
    if (cli.exposure.is_some() || cli.tonemap.is_some()) && output.is_some() && !is("png") {
        return Err("--exposure and --tonemap are for PNG images: an EXR image holds the light itself, and \
                    viewers have an exposure and curves of their own; give -f out.png, or leave them out"
            .into());
    }
    if cli.exposure == Some(Exposure::Auto) && cli.stop.has_target() {
        return Err("--exposure auto depends on the image, but an error target needs to know ahead what is white; give a number \
                    of stops"
            .into());
    }
    if (cli.exr_type.is_some() || cli.exr_compression.is_some()) && !is("exr") {
        return Err(
            "--exr-type and --exr-compression need an OpenEXR image, as in -f out.exr".into()
        );
    }
    if matches!(cli.exr_compression, Some(ExrCompression::Pxr24)) && cryptomatte::is_among(&cli.aov)
    {
        return Err("--exr-compression pxr24 keeps 24 of the 32 bits of a number, by all of which --aov \
                    cryptomatte_object and cryptomatte_material know a thing; choose zip, zips or piz"
            .into());
    }
    Ok(())
}

/// Exposure and tone curve of PNG images; the exposure is 0 stops if it depends on the image.
pub(crate) fn tone(cli: &Cli) -> Tone {
    Tone {
        exposure: cli.exposure.and_then(Exposure::stops).unwrap_or(0.0),
        curve: cli.tonemap.map_or(ToneCurve::Linear, ToneCurve::from),
    }
}
