//! Image files: linear light in memory; PNG, OpenEXR, Radiance, JPEG and other formats on disk.
//!
//! To add a codec: write its file, add its line to [`CODECS`].

mod error;
mod exposure;
mod exr;
mod hdr;
mod image_file;
mod jpeg;
mod layer;
mod mosaic;
mod png;
mod raster;
mod resize;
mod room;
mod texture_blocks;
mod tone;
mod window;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

pub use error::ImageError;
pub use exposure::{Extreme, auto_exposure, extreme};
pub use image_file::{ImageFile, decode_file, load_file};
pub use mosaic::{Mosaic, MosaicError};
use pt_io::{file, guarded, write_atomically};
use pt_math::color;
pub use pt_scene::image::{Channel, Image, Samples};
pub use room::ImageMemory;
use room::check_size;
pub use tone::{Tone, ToneCurve};
pub use window::DisplayWindow;

/// Transfer function between linear light and the integers of files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Transfer {
    /// The sRGB curve, rounded to the nearest level.
    #[default]
    Srgb,
    /// Exposure √2 and gamma 2.2: (√2·L)^(1/2.2), truncated to a level.
    Gamma,
}

/// Bits per channel of integer files.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 256 levels.
    #[default]
    Eight,
    /// 65 536 levels.
    Sixteen,
}

/// Floating-point precision of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits.
    #[default]
    Float,
    /// 16 bits, up to 65504, for the colours and the channels for which they suffice; 32 bits for
    /// the other channels.
    Half,
}

/// Compression of an EXR file. DWAA and DWAB cannot be written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// No compression.
    None,
    /// Run-length encoding.
    Rle,
    /// Deflate, line by line.
    Zips,
    /// Deflate, 16 lines at a time.
    #[default]
    Zip,
    /// Wavelets and Huffman coding, for noisy images.
    Piz,
    /// Deflate; 32-bit floating-point numbers are rounded to 24 bits.
    Pxr24,
    /// Lossy: blocks of 4 × 4 16-bit numbers take 14 bytes each; other numbers are not compressed.
    B44,
    /// As [`Self::B44`], but constant blocks take 3 bytes.
    B44a,
}

/// Options of writing an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SaveOptions {
    /// Bits per channel of a PNG file.
    pub png_bits: BitDepth,
    /// Transfer function of a PNG file; EXR files are linear.
    pub transfer: Transfer,
    /// Exposure and tone curve of a PNG file, applied before the transfer function; EXR files
    /// contain the radiance unchanged.
    pub tone: Tone,
    /// Precision of an EXR file.
    pub exr_type: Precision,
    /// Compression of an EXR file.
    pub exr_compression: Compression,
    /// Keys and values of text chunks or attributes.
    pub metadata: Vec<(String, String)>,
    /// Alpha of each pixel, with which the colours are premultiplied; `None` for a file without
    /// alpha. PNG files contain alpha clamped to [0, 1] and straight colours, black where alpha
    /// is 0.
    pub alpha: Option<Vec<f32>>,
    /// Additional channels of an EXR file; other formats do not support them.
    pub channels: Vec<Channel>,
}

/// Encoding of the values that a reader returns.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PixelEncoding {
    /// Linear light; the transfer function is used for files that do not specify one.
    Light(Transfer),
    /// Stored values, independent of the file's transfer function: integers divided by the highest
    /// level, in [0, 1], and floating-point values unchanged.
    Stored,
}

impl PixelEncoding {
    /// Returns the encoding for an image that is or is not marked as raw.
    pub fn of_raw(is_raw: bool) -> Self {
        if is_raw { Self::Stored } else { Self::Light(Transfer::Srgb) }
    }
}

/// A decoded image with its alpha.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// Colours; premultiplied with alpha in OpenEXR files, straight in PNG files.
    pub image: Image,
    /// Alpha of each pixel, in the order of the colours; 0 is transparent, 1 opaque. `None` if the
    /// file has no alpha.
    pub alpha: Option<Vec<f32>>,
    /// Position of the pixels in the display window of OpenEXR, if it differs from that of the
    /// data.
    pub frame: Option<DisplayWindow>,
}

/// Decodes the bytes of a file. The error describes the problem of the content.
pub type PixelDecoder = fn(&[u8], PixelEncoding, &ImageMemory) -> Result<Decoded, String>;

/// Decodes the bytes of a file with all of its channels and texts. The error describes the problem
/// of the content.
pub type FileDecoder = fn(&[u8], &ImageMemory) -> Result<ImageFile, String>;

/// Reads the keys and values of the texts in a file, without the pixels. The error describes the
/// problem of the content.
pub type MetadataReader = fn(BufReader<File>) -> Result<Vec<(String, String)>, String>;

/// Encodes pixels as the bytes of a file. The error describes what cannot be represented.
pub type PixelEncoder = fn(&Image, &SaveOptions) -> Result<Vec<u8>, String>;

/// An image file format.
#[derive(Debug)]
pub struct Codec {
    /// Name for messages.
    pub name: &'static str,
    /// File name extensions, lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// Decoder; `None` if the format cannot be read.
    pub read: Option<PixelDecoder>,
    /// Decoder of all channels; `None` if the format has only colours and alpha.
    pub read_all: Option<FileDecoder>,
    /// Encoder; `None` if the format cannot be written.
    pub write: Option<PixelEncoder>,
    /// Reader of the texts written from [`SaveOptions::metadata`]; `None` if there are none.
    pub metadata: Option<MetadataReader>,
}

/// All codecs.
pub static CODECS: &[Codec] = &[
    Codec {
        name: "PNG",
        extensions: &["png"],
        read: Some(png::read),
        read_all: None,
        write: Some(png::write),
        metadata: Some(png::metadata),
    },
    Codec {
        name: "OpenEXR",
        extensions: &["exr"],
        read: Some(exr::read),
        read_all: Some(exr::read_all),
        write: Some(exr::write),
        metadata: Some(exr::metadata),
    },
    Codec {
        name: "Radiance",
        extensions: &["hdr", "rgbe"],
        read: Some(hdr::read),
        read_all: None,
        write: None,
        metadata: None,
    },
    Codec {
        name: "JPEG",
        extensions: &["jpg", "jpeg"],
        read: Some(jpeg::read),
        read_all: None,
        write: None,
        metadata: None,
    },
    raster::TGA,
    raster::BMP,
    raster::TIFF,
    raster::WEBP,
    raster::GIF,
    raster::PNM,
    raster::QOI,
    texture_blocks::DDS,
    texture_blocks::KTX2,
    texture_blocks::BASIS,
];

/// Returns true if [`save`] supports the extension of a file name.
pub fn is_image(path: &Path) -> bool {
    codec_with(path, |codec| codec.write).is_ok()
}

/// Writes an image in the format of the file name extension, by [`write_atomically`].
///
/// # Errors
/// Returns an error if the extension is unknown, the number of pixels is not width · height or is
/// zero, the metadata or channels cannot be represented in the format, or the file cannot be
/// written.
pub fn save(image: &Image, path: &Path, options: &SaveOptions) -> Result<(), ImageError> {
    Ok(write_atomically(path, &encode(image, path, options)?)?)
}

/// Encodes an image in the format of the file name extension.
///
/// # Errors
/// Returns the errors of [`save`] except those of writing.
pub fn encode(image: &Image, path: &Path, options: &SaveOptions) -> Result<Vec<u8>, ImageError> {
    let write = codec_with(path, |codec| codec.write)?;
    let refused = |message| ImageError::Refused { path: path.to_owned(), message };
    Image::check_size(image.width, image.height, image.pixels.len()).map_err(refused)?;
    if let Some(alpha) = &options.alpha {
        Image::check_size(image.width, image.height, alpha.len()).map_err(refused)?;
    }
    for channel in &options.channels {
        Image::check_size(image.width, image.height, channel.samples.count()).map_err(refused)?;
    }
    write(image, options).map_err(refused)
}

/// Returns the number of finite values beyond ±65504, the largest 16-bit float, that an EXR file
/// with these options would clamp to it.
pub fn count_beyond_half(image: &Image, options: &SaveOptions) -> usize {
    exr::count_beyond_half(image, options)
}

/// Encodes values from 0 to 1 as a PNG file without a transfer function, with alpha if there is
/// one.
///
/// # Errors
/// Returns a message if the number of values does not match the size, or the file cannot be
/// encoded.
pub fn encode_stored(stored: &Decoded, bits: BitDepth) -> Result<Vec<u8>, String> {
    png::write_stored(stored, bits)
}

/// Writes display-encoded pixels as an 8-bit PNG file, independent of the file name extension, by
/// [`write_atomically`]. Rows run from the top.
///
/// # Errors
/// Returns an error if the number of pixels is not `width` · `height` or is zero, or the file
/// cannot be written.
pub fn save_rgb8(
    path: &Path,
    width: u32,
    height: u32,
    pixels: &[[u8; 3]],
) -> Result<(), ImageError> {
    let refused = |message| ImageError::Refused { path: path.to_owned(), message };
    Image::check_size(width, height, pixels.len()).map_err(refused)?;
    let bytes = png::write_bytes(width, height, pixels).map_err(refused)?;
    Ok(write_atomically(path, &bytes)?)
}

/// Reads an image in the format of the file name extension. Files without a transfer function are
/// decoded as sRGB.
///
/// # Errors
/// Returns an error if the extension is unknown, the file cannot be read, its content is invalid,
/// or it has more than a gibibyte of pixels.
pub fn load(path: &Path) -> Result<Image, ImageError> {
    load_as(path, Transfer::Srgb)
}

/// Reads an image as [`load`] does, with the transfer function of files that do not specify one.
///
/// # Errors
/// Returns the errors of [`load`].
pub fn load_as(path: &Path, untagged: Transfer) -> Result<Image, ImageError> {
    // An unknown extension gives the better message if the file is missing as well.
    codec_with(path, |codec| codec.read)?;
    decode(&read_file(path)?, path, untagged)
}

/// Reads the stored values of an image: integers divided by the highest level, in [0, 1], and
/// floating-point values unchanged. This is for images of other data than colours: normals, masks,
/// roughness.
///
/// # Errors
/// Returns the errors of [`load`].
pub fn load_raw(path: &Path) -> Result<Image, ImageError> {
    Ok(load_rgba_raw(path)?.image)
}

/// Reads an image as [`load_raw`] does, with its alpha if the file has one.
///
/// # Errors
/// Returns the errors of [`load`].
pub fn load_rgba_raw(path: &Path) -> Result<Decoded, ImageError> {
    codec_with(path, |codec| codec.read)?;
    decode_framed(&read_file(path)?, path, PixelEncoding::Stored)
}

/// Checks that images with the extension of a file name can be read.
///
/// # Errors
/// Returns an error if they cannot.
pub fn check_readable(path: &Path) -> Result<(), ImageError> {
    codec_with(path, |codec| codec.read).map(drop)
}

/// Reads the keys and values of the texts in an image file: those of [`SaveOptions::metadata`], and
/// those of other programs.
///
/// # Errors
/// Returns an error if the extension is unknown or that of a format without texts, or the file
/// cannot be read or is invalid.
pub fn metadata(path: &Path) -> Result<Vec<(String, String)>, ImageError> {
    let (name, metadata) = codec_with(path, |codec| Some((codec.name, codec.metadata?)))?;
    let file =
        file::open(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
    guarded(name, || metadata(BufReader::new(file))).flatten().map_err(content_error(path))
}

/// Decodes the content of a file; `path` provides the extension, and the name for messages.
///
/// # Errors
/// Returns the errors of [`load`] except those of reading.
pub fn decode(bytes: &[u8], path: &Path, untagged: Transfer) -> Result<Image, ImageError> {
    Ok(decode_framed(bytes, path, PixelEncoding::Light(untagged))?.image)
}

fn decode_framed(bytes: &[u8], path: &Path, numbers: PixelEncoding) -> Result<Decoded, ImageError> {
    decode_as(bytes, path, numbers)?.framed().map_err(content_error(path))
}

/// Decodes the content of a file; `path` provides the extension, and the name for messages. The
/// pixels are those of the data window, whatever its position in the [display
/// window](Decoded::framed).
///
/// # Errors
/// Returns the errors of [`decode`].
pub fn decode_as(bytes: &[u8], path: &Path, numbers: PixelEncoding) -> Result<Decoded, ImageError> {
    decode_in(bytes, path, numbers, &ImageMemory::OF_PROCESS)
}

/// Decodes a file as [`decode_as`] does, with another source of memory reservations.
///
/// # Errors
/// Returns the errors of [`decode`].
pub fn decode_in(
    bytes: &[u8],
    path: &Path,
    numbers: PixelEncoding,
    room: &ImageMemory,
) -> Result<Decoded, ImageError> {
    let (name, read) = codec_with(path, |codec| Some((codec.name, codec.read?)))?;
    guarded(name, || read(bytes, numbers, room)).flatten().map_err(content_error(path))
}

/// Returns a function that wraps a message about the content of a file.
fn content_error(path: &Path) -> impl FnOnce(String) -> ImageError {
    |message| ImageError::Content { path: path.to_owned(), message }
}

fn read_file(path: &Path) -> Result<Vec<u8>, ImageError> {
    file::read(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })
}

impl Transfer {
    /// Encodes linear light as one of 256 levels.
    pub fn encode8(self, l: f32) -> u8 {
        match self {
            Self::Srgb => color::encode_srgb8(l),
            Self::Gamma => color::encode_gamma8(l),
        }
    }

    /// Encodes linear light as one of 65 536 levels.
    pub fn encode16(self, l: f32) -> u16 {
        match self {
            Self::Srgb => color::encode_srgb16(l),
            Self::Gamma => color::encode_gamma16(l),
        }
    }

    /// Decodes a level to linear light, where the highest level is `highest`.
    pub fn decode(self, level: u16, highest: u16) -> f32 {
        match self {
            Self::Srgb => color::linear_from_srgb(f32::from(level) / f32::from(highest)),
            Self::Gamma => color::linear_from_gamma((f32::from(level) + 0.5) / f32::from(highest)),
        }
    }
}

/// Returns the function that `choose` selects from the codec for a file name.
fn codec_with<F>(path: &Path, choose: impl Fn(&Codec) -> Option<F>) -> Result<F, ImageError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    CODECS
        .iter()
        .filter(|codec| codec.extensions.contains(&ending.as_str()))
        .find_map(&choose)
        .ok_or_else(|| {
            let able = CODECS.iter().filter(|codec| choose(codec).is_some());
            let known: Vec<_> =
                able.flat_map(|codec| codec.extensions).map(|e| format!(".{e}")).collect();
            ImageError::UnknownFormat { path: path.to_owned(), known: known.join(", ") }
        })
}
