//! BMP, GIF, PNM, QOI, TGA, TIFF and WebP files, by the crate `image`.

use std::io::Cursor;

use image::{DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits};
use pt_scene::image::Image;

use super::{Codec, Decoded, ImageMemory, PixelDecoder, PixelEncoding, Transfer};

/// Creates a codec that reads only.
const fn readable(
    name: &'static str,
    extensions: &'static [&'static str],
    read: PixelDecoder,
) -> Codec {
    Codec { name, extensions, read: Some(read), read_all: None, write: None, metadata: None }
}

pub(super) const BMP: Codec = readable("BMP", &["bmp", "dib"], |bytes, numbers, room| {
    read(bytes, numbers, room, ImageFormat::Bmp)
});
pub(super) const GIF: Codec =
    readable("GIF", &["gif"], |bytes, numbers, room| read(bytes, numbers, room, ImageFormat::Gif));
pub(super) const PNM: Codec =
    readable("PNM", &["pnm", "pbm", "pgm", "ppm", "pam"], |bytes, numbers, room| {
        read(bytes, numbers, room, ImageFormat::Pnm)
    });
pub(super) const QOI: Codec =
    readable("QOI", &["qoi"], |bytes, numbers, room| read(bytes, numbers, room, ImageFormat::Qoi));
pub(super) const TGA: Codec =
    readable("TGA", &["tga"], |bytes, numbers, room| read(bytes, numbers, room, ImageFormat::Tga));
pub(super) const TIFF: Codec = readable("TIFF", &["tif", "tiff"], |bytes, numbers, room| {
    read(bytes, numbers, room, ImageFormat::Tiff)
});
pub(super) const WEBP: Codec = readable("WebP", &["webp"], |bytes, numbers, room| {
    read(bytes, numbers, room, ImageFormat::WebP)
});

/// See [`PixelDecoder`]. Grey becomes three equal channels. The files do not specify the transfer
/// function of integers; it is assumed to be sRGB, independent of the caller's default.
/// Floating-point values of TIFF are linear. Of animations, the first picture is read.
fn read(
    bytes: &[u8],
    numbers: PixelEncoding,
    room: &ImageMemory,
    format: ImageFormat,
) -> Result<Decoded, String> {
    let failed = |error: image::ImageError| format!("is not a valid file of this format: {error}");
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::no_limits();
    limits.max_alloc = Some(1 << 30);
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    let pixels = u64::from(width) * u64::from(height);
    let _grant = room.ask(Some(decoder.total_bytes().max(pixels.saturating_mul(16))))?;
    if !matches!(format, ImageFormat::WebP | ImageFormat::Tiff) {
        check_ratio(pixels, bytes.len() as u64)?;
    }
    let has_alpha = decoder.color_type().has_alpha();
    let picture = DynamicImage::from_decoder(decoder).map_err(failed)?;
    let (pixels, alpha) = in_light(picture, numbers);
    Image::check_size(width, height, pixels.len())?;
    // Many writers of TGA and BMP set an unused alpha channel to zero.
    let is_meant = has_alpha
        && (!matches!(format, ImageFormat::Tga | ImageFormat::Bmp)
            || alpha.iter().any(|opacity| *opacity > 0.0));
    Ok(Decoded {
        image: Image { width, height, pixels: pixels.into() },
        alpha: is_meant.then_some(alpha),
        frame: None,
    })
}

/// Rejects images that claim more pixels than their bytes can hold. The best compression of these
/// formats is the LZW of GIF: a code of 12 bits represents at most 4096 pixels. WebP may have one
/// colour for all pixels, and TIFF one bit for an empty row, so they are not checked.
fn check_ratio(pixels: u64, bytes: u64) -> Result<(), String> {
    const SMALL: u64 = 1 << 22;
    let most = (bytes * 4096 * 2 / 3).max(SMALL);
    if pixels <= most {
        return Ok(());
    }
    Err(format!("declares {pixels} pixels, but has {bytes} bytes"))
}

/// Returns the colours of an image and its alpha.
fn in_light(picture: DynamicImage, numbers: PixelEncoding) -> (Vec<[f32; 3]>, Vec<f32>) {
    let level = |level: u16, highest: u16| match numbers {
        PixelEncoding::Light(_) => Transfer::Srgb.decode(level, highest),
        PixelEncoding::Stored => f32::from(level) / f32::from(highest),
    };
    match picture {
        DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_) => {
            let pixels = picture.into_rgba32f();
            pixels.pixels().map(|p| ([p[0], p[1], p[2]], p[3])).unzip()
        }
        DynamicImage::ImageLuma16(_)
        | DynamicImage::ImageLumaA16(_)
        | DynamicImage::ImageRgb16(_)
        | DynamicImage::ImageRgba16(_) => {
            let pixels = picture.into_rgba16();
            let share = |x: u16| f32::from(x) / 65_535.0;
            let light = |x: u16| level(x, u16::MAX);
            pixels.pixels().map(|p| ([p[0], p[1], p[2]].map(light), share(p[3]))).unzip()
        }
        _ => {
            let table: [f32; 256] = std::array::from_fn(|x| level(x as u16, 255));
            let pixels = picture.into_rgba8();
            let light = |x: u8| table[usize::from(x)];
            let share = |x: u8| f32::from(x) / 255.0;
            pixels.pixels().map(|p| ([p[0], p[1], p[2]].map(light), share(p[3]))).unzip()
        }
    }
}
