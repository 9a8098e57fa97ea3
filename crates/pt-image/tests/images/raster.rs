//! Other raster formats: files written by the crate `image` are read with the same levels.

use std::io::Cursor;
use std::path::Path;

use image::{DynamicImage, ImageFormat, Rgba, Rgba32FImage, RgbaImage};
use pt_image::{Decoded, PixelEncoding, Transfer, decode_as};

/// Returns 5 × 3 pixels with a different colour in each, and alpha from 1 to 241.
fn picture() -> RgbaImage {
    RgbaImage::from_fn(5, 3, |x, y| {
        let i = (x + 5 * y) as u8;
        Rgba([17 * i, 255 - 11 * i, 40 * x as u8, 241 - 16 * i])
    })
}

fn encoded(picture: &DynamicImage, format: ImageFormat) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    picture.write_to(&mut bytes, format).unwrap_or_else(|error| panic!("{format:?}: {error}"));
    bytes.into_inner()
}

fn read(bytes: &[u8], name: &str, numbers: PixelEncoding) -> Decoded {
    decode_as(bytes, Path::new(name), numbers).unwrap_or_else(|error| panic!("{name}: {error}"))
}

#[test]
fn levels_are_those_that_were_written() {
    let with_alpha = DynamicImage::ImageRgba8(picture());
    let opaque = DynamicImage::ImageRgb8(with_alpha.to_rgb8());
    for (name, format, keeps_alpha) in [
        ("a.bmp", ImageFormat::Bmp, false),
        ("a.dib", ImageFormat::Bmp, false),
        ("a.ppm", ImageFormat::Pnm, false),
        ("a.tga", ImageFormat::Tga, true),
        ("a.tif", ImageFormat::Tiff, true),
        ("a.TIFF", ImageFormat::Tiff, true),
        ("a.qoi", ImageFormat::Qoi, true),
        ("a.webp", ImageFormat::WebP, true),
    ] {
        let written = if keeps_alpha { &with_alpha } else { &opaque };
        let bytes = encoded(written, format);
        let [light, stored] = [PixelEncoding::Light(Transfer::Gamma), PixelEncoding::Stored]
            .map(|numbers| read(&bytes, name, numbers));
        let pixels = picture();
        assert_eq!((light.image.width, light.image.height), (5, 3), "{name}");
        for (i, Rgba([r, g, b, a])) in pixels.pixels().enumerate() {
            let levels = [r, g, b].map(|x| u16::from(*x));
            let srgb = levels.map(|x| Transfer::Srgb.decode(x, 255));
            assert_eq!(light.image.pixels[i], srgb, "{name}, {i}");
            assert_eq!(stored.image.pixels[i], levels.map(|x| f32::from(x) / 255.0), "{name}");
            let opacity = light.alpha.as_ref().map(|alpha| alpha[i]);
            assert_eq!(opacity, keeps_alpha.then_some(f32::from(*a) / 255.0), "{name}, {i}");
        }
    }
}

/// A GIF has a palette, and alpha is on or off.
#[test]
fn the_first_picture_of_an_animation_is_read() {
    let frame = |color: [u8; 4]| image::Frame::new(RgbaImage::from_pixel(4, 2, Rgba(color)));
    let mut bytes = Vec::new();
    let mut encoder = image::codecs::gif::GifEncoder::new(&mut bytes);
    encoder.encode_frames([frame([255, 0, 51, 255]), frame([0, 255, 0, 255])]).expect("a GIF");
    drop(encoder);
    let read = read(&bytes, "a.gif", PixelEncoding::Stored);
    assert_eq!(read.image.pixels, [[1.0, 0.0, 0.2]; 8]);
    // A canvas that these bytes cannot fill.
    bytes[6..10].copy_from_slice(&[0, 0x20, 0, 0x20]);
    let error =
        decode_as(&bytes, Path::new("a.gif"), PixelEncoding::Stored).expect_err("it is too large");
    assert!(error.to_string().contains("declares 67108864 pixels, but has"), "{error}");
}

/// An empty page of 5.8 million pixels takes one bit per row, in fax compression.
#[test]
fn empty_pages_are_no_false_claims() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/formats/images/empty_page.tiff");
    let bytes = std::fs::read(path).expect("it is there");
    assert!(bytes.len() < 1200);
    let read = read(&bytes, "a.tiff", PixelEncoding::Stored);
    assert_eq!([read.image.width, read.image.height], [2400; 2]);
    assert!(read.image.pixels.iter().all(|pixel| *pixel == [1.0; 3]));
}

#[test]
fn sixteen_bits_are_levels_and_real_numbers_are_light() {
    let deep = image::ImageBuffer::from_fn(2, 1, |x, _| image::Rgb([x as u16 * 65_535, 1, 40_000]));
    for (name, format) in [("a.tiff", ImageFormat::Tiff), ("a.ppm", ImageFormat::Pnm)] {
        let bytes = encoded(&DynamicImage::ImageRgb16(deep.clone()), format);
        let read = read(&bytes, name, PixelEncoding::Light(Transfer::Srgb));
        let want = |x: u16| [x, 1, 40_000].map(|level| Transfer::Srgb.decode(level, u16::MAX));
        assert_eq!(read.image.pixels, [want(0), want(65_535)], "{name}");
    }
    let real = Rgba32FImage::from_pixel(1, 1, Rgba([0.25, 7.5, -1.0, 0.5]));
    let bytes = encoded(&DynamicImage::ImageRgba32F(real), ImageFormat::Tiff);
    let read = read(&bytes, "a.tiff", PixelEncoding::Light(Transfer::Srgb));
    assert_eq!((&read.image.pixels[..], read.alpha), (&[[0.25, 7.5, -1.0]][..], Some(vec![0.5])));
}

#[test]
fn opacity_of_zero_everywhere_is_none_in_tga_files() {
    let clear = RgbaImage::from_pixel(2, 2, Rgba([255, 0, 0, 0]));
    let bytes = encoded(&DynamicImage::ImageRgba8(clear), ImageFormat::Tga);
    let read = read(&bytes, "a.tga", PixelEncoding::Stored);
    assert_eq!((&read.image.pixels[..], read.alpha), (&[[1.0, 0.0, 0.0]; 4][..], None));
}

/// A few bytes that claim more than a gibibyte of pixels.
#[test]
fn pictures_that_are_too_large_are_refused_by_their_headers() {
    let mut qoi = b"qoif".to_vec();
    qoi.extend([0, 0, 0x40, 0, 0, 0, 0x40, 0, 4, 0]);
    qoi.extend([0; 64]);
    let ppm = b"P6 65535 65535 255\n".to_vec();
    let mut tga = vec![0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF, 32, 8];
    tga.extend([0; 64]);
    for (name, bytes) in [("a.qoi", qoi), ("a.ppm", ppm), ("a.tga", tga)] {
        let refused = decode_as(&bytes, Path::new(name), PixelEncoding::Stored).expect_err(name);
        assert!(refused.to_string().contains("1 GiB"), "{refused}");
    }
}
