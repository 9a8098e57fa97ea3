//! Image files: linear light in memory, PNG, OpenEXR, Radiance pictures, JPEG and others on disk.
//!
//! To add a codec: write its file, add its line to [`CODECS`].

mod error;
mod exposure;
mod exr;
mod hdr;
mod jpeg;
mod png;
mod raster;
mod room;
mod texture_blocks;
mod tone;
mod write;

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use pt_math::color;

use crate::catch_panic::guarded;
use crate::file;
pub use error::ImageError;
pub use exposure::{Extreme, auto_exposure, extreme};
pub use room::Room;
use room::check_size;
pub use tone::{Tone, ToneCurve};
pub use write::{check_target, folder_of, sync_folder, write_atomically};

/// An image in linear Rec. 709.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green and blue of each pixel, row by row from the top, from left to right.
    pub pixels: Vec<[f32; 3]>,
}

impl Image {
    /// Replaces what is no number by 0, and what is infinite by the greatest finite number of the
    /// image, of either sign. Says how many pixels had such a channel, and where the first one
    /// is; `None` if none had.
    pub fn make_finite(&mut self) -> Option<String> {
        self.mend(f32::NEG_INFINITY, "that are no finite numbers")
    }

    /// As [`Self::make_finite`], and replaces negative numbers by 0.
    pub fn make_radiance(&mut self) -> Option<String> {
        self.mend(0.0, "that are no radiance (finite numbers from 0 up)")
    }

    fn mend(&mut self, least: f32, what: &str) -> Option<String> {
        let is_good = |v: &f32| v.is_finite() && *v >= least;
        let is_bad = |p: &[f32; 3]| !p.iter().all(is_good);
        let first = self.pixels.iter().position(is_bad)?;
        let value = self.pixels[first];
        let finite = self.pixels.as_flattened().iter().filter(|v| v.is_finite());
        let greatest = finite.fold(0.0_f32, |most, v| most.max(v.abs()));
        let mut count = 0_usize;
        for pixel in self.pixels[first..].iter_mut().filter(|p| is_bad(p)) {
            count += 1;
            *pixel = pixel.map(|v| {
                let v = if v.is_nan() { 0.0 } else { v.clamp(-greatest, greatest) };
                v.max(least)
            });
        }
        let (x, y) = (first % self.width as usize, first / self.width as usize);
        let (all, s) = (self.pixels.len(), if count == 1 { "" } else { "s" });
        Some(format!(
            "{count} pixel{s} of {all} with values {what}; the first one is ({x}, {y}), {value:?}, counted from the upper \
             left. What is no number or negative becomes 0, what is infinite the greatest number of the image"
        ))
    }

    /// What may be meant otherwise of an image that is taken as a sky in latitude and longitude: a
    /// square one.
    pub fn doubt_as_sky(&self) -> Option<String> {
        (self.width == self.height && self.width > 1).then(|| {
            format!(
                "the image of the sky is square ({} × {}), and taken as latitude and longitude, which is twice as wide as \
                 high; turn light probes (angular maps, mirrored balls) and octahedral maps into that first, or give \
                 them by --environment with --environment-layout",
                self.width, self.height
            )
        })
    }

    /// Checks that the pixels are radiance.
    ///
    /// # Errors
    /// If they are not as many as there should be, or one of them, which is named, is not finite or
    /// negative.
    pub fn check_radiance(&self) -> Result<(), String> {
        self.check(0.0, "radiance must be a finite number from 0 up")
    }

    /// Checks that the pixels are finite.
    ///
    /// # Errors
    /// If they are not as many as there should be, or one of them, which is named, is not finite.
    pub fn check_finite(&self) -> Result<(), String> {
        self.check(f32::NEG_INFINITY, "radiance must be a finite number")
    }

    fn check(&self, least: f32, rule: &str) -> Result<(), String> {
        check_shape(self.width, self.height, self.pixels.len())?;
        let is_good = |p: &[f32; 3]| p.iter().all(|v| v.is_finite() && *v >= least);
        let Some(i) = self.pixels.iter().position(|p| !is_good(p)) else { return Ok(()) };
        let (x, y) = (i % self.width as usize, i / self.width as usize);
        Err(format!("pixel ({x}, {y}) is {:?}; {rule}", self.pixels[i]))
    }

    /// A note of how many pixels are negative, and where the first one is, for an image of
    /// emission, in which they count as 0.
    pub fn negative_radiance(&self) -> Option<String> {
        let is_negative = |p: &[f32; 3]| p.iter().any(|v| *v < 0.0);
        let first = self.pixels.iter().position(is_negative)?;
        let count = self.pixels.iter().filter(|p| is_negative(p)).count();
        let (x, y) = (first % self.width as usize, first / self.width as usize);
        let (all, s) = (self.pixels.len(), if count == 1 { "" } else { "s" });
        Some(format!(
            "an image of emission has {count} pixel{s} of {all} with negative radiance, which counts as 0; the first one is \
             ({x}, {y}), {:?}, counted from the upper left",
            self.pixels[first]
        ))
    }
}

/// How linear light and the numbers of files without floating point relate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Transfer {
    /// The sRGB curve, rounded to the nearest level.
    #[default]
    Srgb,
    /// The curve of the course program: (√2·L)^(1/2.2), cut off to a level.
    Course,
}

/// Bits per channel of files without floating point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BitDepth {
    /// 256 levels.
    #[default]
    Eight,
    /// 65 536 levels.
    Sixteen,
}

/// Numbers of files with floating point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Precision {
    /// 32 bits.
    #[default]
    Float,
    /// 16 bits, up to 65504, for the colours and those channels for which they suffice; 32 for the
    /// others.
    Half,
}

/// How an EXR file is made smaller. DWAA and DWAB can be neither written nor read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Not at all.
    None,
    /// Runs of equal bytes.
    Rle,
    /// Deflate, line by line.
    Zips,
    /// Deflate, 16 lines at a time.
    #[default]
    Zip,
    /// Wavelets and Huffman codes, for noisy images.
    Piz,
    /// Deflate; of 32-bit real numbers, only 24 bits are kept.
    Pxr24,
    /// Blocks of 4 × 4 16-bit numbers of 14 bytes each, with losses; other numbers are kept as they
    /// are.
    B44,
    /// Likewise, and blocks of one value are 3 bytes.
    B44a,
}

/// What to write, beside the pixels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SaveOptions {
    /// Bits per channel of a PNG file.
    pub png_bits: BitDepth,
    /// Transfer of a PNG file; EXR files are linear.
    pub transfer: Transfer,
    /// Exposure and tone curve of a PNG file, before the transfer; EXR files have the light
    /// itself.
    pub tone: Tone,
    /// Numbers of an EXR file.
    pub exr_type: Precision,
    /// Compression of an EXR file.
    pub exr_compression: Compression,
    /// Keys and values to write into the file, as text chunks or attributes.
    pub metadata: Vec<(String, String)>,
    /// The opacity of each pixel, with which its colour is multiplied already, if the file is to
    /// have it. PNG files have it from 0 to 1, and colours that are not multiplied with it;
    /// where it is 0, black.
    pub alpha: Option<Vec<f32>>,
    /// More channels of an EXR file; other files have no place for them.
    pub channels: Vec<Channel>,
}

/// Numbers of an image besides its colours.
#[derive(Clone, Debug, PartialEq)]
pub struct Channel {
    /// Its name, which no other channel has: letters, digits and dots, as in "depth.Z".
    pub name: String,
    /// The number of each pixel, in the order of [`Image::pixels`].
    pub samples: Samples,
    /// True if [`Precision::Half`] makes real ones 16 bits wide, as suits colours and directions.
    pub half_suffices: bool,
}

/// The numbers of a channel.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Real ones.
    Real(Vec<f32>),
    /// Whole ones.
    Whole(Vec<u32>),
}

impl Samples {
    /// Returns the count.
    fn count(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Whole(values) => values.len(),
        }
    }
}

/// Which numbers a reader gives.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PixelEncoding {
    /// Linear light; the transfer is that of files that do not name one.
    Light(Transfer),
    /// What is stored, whatever the file says about light: levels as shares of the highest one,
    /// in [0, 1], and numbers of files with floating point as they are.
    Stored,
}

impl PixelEncoding {
    /// Those of an image that an author calls raw, or not.
    pub(crate) fn of_raw(is_raw: bool) -> Self {
        if is_raw { Self::Stored } else { Self::Light(Transfer::Srgb) }
    }
}

/// An image and its opacity.
#[derive(Clone, Debug, PartialEq)]
pub struct Decoded {
    /// The colours. OpenEXR files have them multiplied with the opacity, PNG files have not.
    pub image: Image,
    /// The opacity of each pixel in the order of the colours, if the file has it; 0 is clear and 1
    /// is opaque.
    pub alpha: Option<Vec<f32>>,
    /// Where the pixels lie in the picture, if that has another size: the display window of
    /// OpenEXR.
    pub frame: Option<Frame>,
}

/// A picture of which some pixels are there, or that has some beyond its edges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    /// Where the first pixel is, from the upper left corner of the picture to the right and down.
    pub offset: [i64; 2],
    /// Width and height of the picture.
    pub size: [u32; 2],
}

impl Decoded {
    /// The picture: black and clear where no pixels are, and without those beyond its edges.
    ///
    /// # Errors
    /// If it holds more than a gibibyte of pixels.
    pub fn framed(self) -> Result<Self, String> {
        let Some(Frame { offset, size: [width, height] }) = self.frame else { return Ok(self) };
        let count = u64::from(width) * u64::from(height);
        let _grant = Room::OF_PROCESS.ask(count.checked_mul(size_of::<[f32; 4]>() as u64))?;
        let count = count as usize;
        let mut picture = Self {
            image: Image { width, height, pixels: vec![[0.0; 3]; count] },
            alpha: self.alpha.as_ref().map(|_| vec![0.0; count]),
            frame: None,
        };
        let of = |side: i64, begin: i64, length: u32| {
            let from = (-begin).clamp(0, side);
            let to = (i64::from(length) - begin).clamp(from, side);
            from as usize..to as usize
        };
        let columns = of(i64::from(self.image.width), offset[0], width);
        for row in of(i64::from(self.image.height), offset[1], height) {
            let from = row * self.image.width as usize;
            let source = from + columns.start..from + columns.end;
            let to = (row as i64 + offset[1]) as usize * width as usize;
            let start = to + (columns.start as i64 + offset[0]) as usize;
            let target = start..start + columns.len();
            picture.image.pixels[target.clone()]
                .copy_from_slice(&self.image.pixels[source.clone()]);
            if let (Some(alpha), Some(own)) = (&mut picture.alpha, &self.alpha) {
                alpha[target].copy_from_slice(&own[source]);
            }
        }
        Ok(picture)
    }
}

/// Bytes of a file to pixels. The error says what is wrong with the content.
pub type Reader = fn(&[u8], PixelEncoding, &Room) -> Result<Decoded, String>;

/// Keys and values of the texts in a file, of which no more is read than what they need. The error
/// says what is wrong with the content.
pub type MetadataReader = fn(BufReader<File>) -> Result<Vec<(String, String)>, String>;

/// Pixels to the bytes of a file. The error says what cannot be written.
pub type Writer = fn(&Image, &SaveOptions) -> Result<Vec<u8>, String>;

/// A file format of images.
#[derive(Debug)]
pub struct Codec {
    /// Name for messages.
    pub name: &'static str,
    /// File name endings, lower case, without the dot.
    pub extensions: &'static [&'static str],
    /// Decodes, where the format can be read.
    pub read: Option<Reader>,
    /// Encodes, where the format can be written.
    pub write: Option<Writer>,
    /// Finds what was written as [`SaveOptions::metadata`].
    pub metadata: Option<MetadataReader>,
}

/// All codecs.
pub static CODECS: &[Codec] = &[
    Codec {
        name: "PNG",
        extensions: &["png"],
        read: Some(png::read),
        write: Some(png::write),
        metadata: Some(png::metadata),
    },
    Codec {
        name: "OpenEXR",
        extensions: &["exr"],
        read: Some(exr::read),
        write: Some(exr::write),
        metadata: Some(exr::metadata),
    },
    Codec {
        name: "Radiance",
        extensions: &["hdr", "rgbe"],
        read: Some(hdr::read),
        write: None,
        metadata: None,
    },
    Codec {
        name: "JPEG",
        extensions: &["jpg", "jpeg"],
        read: Some(jpeg::read),
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

/// Returns true if [`save`] knows the ending of a name.
pub fn is_image(path: &Path) -> bool {
    codec_with(path, |codec| codec.write).is_ok()
}

/// Writes an image in the format that the ending of the name says, by [`write_atomically`].
///
/// # Errors
/// If the ending is unknown, the number of pixels is not width · height or zero, the metadata or
/// channels do not fit into the format, or the file cannot be written.
pub fn save(image: &Image, path: &Path, options: &SaveOptions) -> Result<(), ImageError> {
    write_atomically(path, &encode(image, path, options)?)
}

/// The bytes of an image file in the format that the ending of the name says.
///
/// # Errors
/// As [`save`], but nothing is written.
pub fn encode(image: &Image, path: &Path, options: &SaveOptions) -> Result<Vec<u8>, ImageError> {
    let write = codec_with(path, |codec| codec.write)?;
    let refused = |message| ImageError::Refused { path: path.to_owned(), message };
    check_shape(image.width, image.height, image.pixels.len()).map_err(refused)?;
    if let Some(alpha) = &options.alpha {
        check_shape(image.width, image.height, alpha.len()).map_err(refused)?;
    }
    for channel in &options.channels {
        check_shape(image.width, image.height, channel.samples.count()).map_err(refused)?;
    }
    write(image, options).map_err(refused)
}

/// Returns the number of finite numbers that an EXR file of these options cannot hold, since they
/// are beyond ±65504, the greatest 16-bit number, which takes their place.
pub fn count_beyond_half(image: &Image, options: &SaveOptions) -> usize {
    exr::count_beyond_half(image, options)
}

/// The bytes of a PNG file of numbers from 0 to 1 as they are to be stored, with the opacity if
/// there is one.
///
/// # Errors
/// If there are not as many as the size says, or they do not fit into the format.
pub(crate) fn encode_stored(stored: &Decoded, bits: BitDepth) -> Result<Vec<u8>, String> {
    png::write_stored(stored, bits)
}

/// Writes bytes that are ready for the screen as an 8-bit PNG file, whatever the ending of the
/// name, by [`write_atomically`]. Rows run from the top.
///
/// # Errors
/// If the number of pixels is not `width` · `height` or zero, or the file cannot be written.
pub fn save_rgb8(
    path: &Path,
    width: u32,
    height: u32,
    pixels: &[[u8; 3]],
) -> Result<(), ImageError> {
    let refused = |message| ImageError::Refused { path: path.to_owned(), message };
    check_shape(width, height, pixels.len()).map_err(refused)?;
    let bytes = png::write_bytes(width, height, pixels).map_err(refused)?;
    write_atomically(path, &bytes)
}

/// Reads an image in the format that the ending of its name says. Files that do not say how
/// their numbers relate to light are taken as sRGB.
///
/// # Errors
/// If the ending is unknown, the file cannot be read, its content is wrong, or it holds more than
/// a gibibyte of pixels.
pub fn load(path: &Path) -> Result<Image, ImageError> {
    load_as(path, Transfer::Srgb)
}

/// Like [`load`], with the transfer of files that do not name one.
///
/// # Errors
/// As [`load`].
pub fn load_as(path: &Path, untagged: Transfer) -> Result<Image, ImageError> {
    // An unknown ending is the better message where the file is missing as well.
    codec_with(path, |codec| codec.read)?;
    decode(&read_file(path)?, path, untagged)
}

/// Reads the numbers of an image as they are stored: levels as shares of the highest one, in
/// [0, 1], and numbers of files with floating point as they are. This is for images that hold
/// something other than colours: normals, masks, roughness.
///
/// # Errors
/// As [`load`].
pub fn load_raw(path: &Path) -> Result<Image, ImageError> {
    Ok(load_rgba_raw(path)?.image)
}

/// Like [`load_raw`], with the opacity of PNG and OpenEXR files that have one.
///
/// # Errors
/// As [`load`].
pub fn load_rgba_raw(path: &Path) -> Result<Decoded, ImageError> {
    codec_with(path, |codec| codec.read)?;
    decode_framed(&read_file(path)?, path, PixelEncoding::Stored)
}

/// Checks that images with the extension of a name can be read.
///
/// # Errors
/// If they cannot.
pub fn check_readable(path: &Path) -> Result<(), ImageError> {
    codec_with(path, |codec| codec.read).map(drop)
}

/// Keys and values of the texts in an image file: what [`SaveOptions::metadata`] said, and what
/// others wrote.
///
/// # Errors
/// If the ending is unknown, or of a format without texts, or the file cannot be read or is none.
pub fn metadata(path: &Path) -> Result<Vec<(String, String)>, ImageError> {
    let (name, metadata) = codec_with(path, |codec| Some((codec.name, codec.metadata?)))?;
    let file =
        file::open(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })?;
    guarded(name, || metadata(BufReader::new(file))).flatten().map_err(content_error(path))
}

/// Decodes the content of a file; `path` gives the ending, and the name for messages.
///
/// # Errors
/// As [`load`], but nothing is read.
pub fn decode(bytes: &[u8], path: &Path, untagged: Transfer) -> Result<Image, ImageError> {
    Ok(decode_framed(bytes, path, PixelEncoding::Light(untagged))?.image)
}

fn decode_framed(bytes: &[u8], path: &Path, numbers: PixelEncoding) -> Result<Decoded, ImageError> {
    decode_as(bytes, path, numbers)?.framed().map_err(content_error(path))
}

/// Decodes the content of a file; `path` gives the ending, and the name for messages. The pixels
/// are those that the file has, wherever they lie in the [picture](Decoded::framed).
///
/// # Errors
/// As [`decode`].
pub fn decode_as(bytes: &[u8], path: &Path, numbers: PixelEncoding) -> Result<Decoded, ImageError> {
    decode_in(bytes, path, numbers, &Room::OF_PROCESS)
}

/// Like [`decode_as`], with another place where memory is asked for.
///
/// # Errors
/// As [`decode`].
pub fn decode_in(
    bytes: &[u8],
    path: &Path,
    numbers: PixelEncoding,
    room: &Room,
) -> Result<Decoded, ImageError> {
    let (name, read) = codec_with(path, |codec| Some((codec.name, codec.read?)))?;
    guarded(name, || read(bytes, numbers, room)).flatten().map_err(content_error(path))
}

/// The error about the content of a file.
fn content_error(path: &Path) -> impl FnOnce(String) -> ImageError {
    |message| ImageError::Content { path: path.to_owned(), message }
}

fn read_file(path: &Path) -> Result<Vec<u8>, ImageError> {
    file::read(path).map_err(|source| ImageError::Read { path: path.to_owned(), source })
}

impl Transfer {
    /// Linear light to one of 256 levels.
    pub fn encode8(self, l: f32) -> u8 {
        match self {
            Self::Srgb => color::encode_srgb8(l),
            Self::Course => color::encode_course8(l),
        }
    }

    /// Linear light to one of 65 536 levels.
    pub fn encode16(self, l: f32) -> u16 {
        match self {
            Self::Srgb => color::encode_srgb16(l),
            Self::Course => color::encode_course16(l),
        }
    }

    /// The linear light that `level` stands for, when the highest level is `highest`.
    pub fn decode(self, level: u16, highest: u16) -> f32 {
        match self {
            Self::Srgb => color::linear_from_srgb(f32::from(level) / f32::from(highest)),
            Self::Course => {
                color::linear_from_course((f32::from(level) + 0.5) / f32::from(highest))
            }
        }
    }
}

/// The function of the codec for this name that `choose` picks.
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

/// Checks that `count` is the number of pixels, and above 0.
fn check_shape(width: u32, height: u32, count: usize) -> Result<(), String> {
    let expected = u64::from(width) * u64::from(height);
    if expected == 0 || expected != count as u64 {
        return Err(format!("{width} × {height} pixels do not make an image of {count} pixels"));
    }
    Ok(())
}
