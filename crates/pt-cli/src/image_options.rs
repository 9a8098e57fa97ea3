//! Options of PNG and of OpenEXR files.

use clap::Args;
use pathtracer::image::{BitDepth, Image, Tone, ToneCurve, auto_exposure};

use crate::arg_values::{ExrCompression, ExrType, PngBits, Tonemap};
use crate::parse::{self, Exposure};

/// Options of PNG files.
#[derive(Args, Debug, Clone)]
pub(crate) struct PngOptions {
    /// Bits per channel of a PNG file
    #[arg(long, value_name = "BITS", default_value = "8", help_heading = "Image")]
    png_bits: PngBits,

    /// Exposure of a PNG image in stops, applied before --tonemap; auto chooses it from the image
    /// [default: 0]
    #[arg(long, value_name = "STOPS", allow_negative_numbers = true)]
    #[arg(value_parser = parse::exposure, help_heading = "Image")]
    pub(crate) exposure: Option<Exposure>,

    /// Tone curve of a PNG image [default: linear]
    #[arg(long, value_name = "CURVE", help_heading = "Image")]
    tonemap: Option<Tonemap>,
}

impl PngOptions {
    /// Rejects exposure and tone curve of other images than PNG.
    ///
    /// # Errors
    /// A message with the remedy.
    pub(crate) fn check(&self, is_png: bool) -> Result<(), String> {
        if (self.exposure.is_none() && self.tonemap.is_none()) || is_png {
            return Ok(());
        }
        Err("--exposure and --tonemap require a PNG image: EXR images store radiance, and viewers \
             apply exposure and curves; give -f out.png, or omit them"
            .into())
    }

    pub(crate) fn bits(&self) -> BitDepth {
        match self.png_bits {
            PngBits::Eight => BitDepth::Eight,
            PngBits::Sixteen => BitDepth::Sixteen,
        }
    }

    /// Returns true if the exposure depends on the image.
    pub(crate) fn is_auto(&self) -> bool {
        self.exposure == Some(Exposure::Auto)
    }

    /// Exposure and tone curve; 0 stops if the exposure depends on the image.
    pub(crate) fn tone(&self) -> Tone {
        Tone {
            exposure: self.exposure.and_then(Exposure::stops).unwrap_or(0.0),
            curve: self.tonemap.map_or(ToneCurve::Linear, ToneCurve::from),
        }
    }

    /// Exposure and tone curve of an image.
    pub(crate) fn tone_of(&self, image: &Image) -> Tone {
        let tone = self.tone();
        if self.is_auto() { Tone { exposure: auto_exposure(image), ..tone } } else { tone }
    }
}

/// Options of OpenEXR files.
#[derive(Args, Debug, Clone)]
pub(crate) struct ExrOptions {
    /// Pixel type of an EXR image [default: float]
    #[arg(long, value_name = "TYPE", help_heading = "Image")]
    pub(crate) exr_type: Option<ExrType>,

    /// Compression of an EXR image (DWAA and DWAB cannot be written) [default: zip]
    #[arg(long, value_name = "METHOD", help_heading = "Image")]
    pub(crate) exr_compression: Option<ExrCompression>,
}

impl ExrOptions {
    /// Rejects the options for other images than OpenEXR.
    ///
    /// # Errors
    /// A message with the remedy.
    pub(crate) fn check(&self, is_exr: bool) -> Result<(), String> {
        if (self.exr_type.is_none() && self.exr_compression.is_none()) || is_exr {
            return Ok(());
        }
        Err("--exr-type and --exr-compression require an OpenEXR image, as in -f out.exr".into())
    }
}
