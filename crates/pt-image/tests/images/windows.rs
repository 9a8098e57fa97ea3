//! EXR files with a data window other than the display window, with other data than colours, or
//! with luminance and chroma.

use std::io::Cursor;
use std::path::Path;

use exr::prelude::*;
use pt_image::{DisplayWindow, PixelEncoding, Transfer, decode, decode_as};
use pt_scene::image::Image;

/// Creates an EXR file of 16 × 8 pixels with a data window, with a distinct value in each pixel of
/// it.
fn window(position: (i32, i32), size: (usize, usize)) -> Vec<u8> {
    let number = |i: usize| {
        let (x, y) = (position.0 + (i % size.0) as i32, position.1 + (i / size.0) as i32);
        (1 + x + 16 * y) as f32
    };
    let values: Vec<f32> = (0..size.0 * size.1).map(number).collect();
    let channels =
        ["R", "G", "B"].map(|name| AnyChannel::new(name, FlatSamples::F32(values.clone())));
    let attributes = LayerAttributes { layer_position: position.into(), ..Default::default() };
    let layer = Layer::new(
        size,
        attributes,
        Encoding::UNCOMPRESSED,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut file = exr::image::Image::from_layer(layer);
    file.attributes.display_window = IntegerBounds::new((0, 0), (16, 8));
    let mut out = Cursor::new(Vec::new());
    file.write().non_parallel().to_buffered(&mut out).expect("it is written");
    out.into_inner()
}

/// The image is the display window: black where the file has no data, and without data beyond its
/// edges.
#[test]
fn the_display_window_is_the_picture() {
    for (position, size) in [
        ((3, 2), (4, 5)),
        ((-2, -1), (20, 12)),
        ((10, -3), (9, 7)),
        ((40, 0), (2, 2)),
        ((0, 0), (16, 8)),
    ] {
        let bytes = window(position, size);
        let path = Path::new("a.exr");
        let picture = decode(&bytes, path, Transfer::Srgb).expect("a picture");
        assert_eq!((picture.width, picture.height), (16, 8));
        for (i, pixel) in picture.pixels.iter().enumerate() {
            let (x, y) = ((i % 16) as i32, (i / 16) as i32);
            let is_there = (position.0..position.0 + size.0 as i32).contains(&x)
                && (position.1..position.1 + size.1 as i32).contains(&y);
            let expected = if is_there { (1 + x + 16 * y) as f32 } else { 0.0 };
            assert_eq!(*pixel, [expected; 3], "{position:?} {size:?}: {x} {y}");
        }
        let pixels = decode_as(&bytes, path, PixelEncoding::Stored).expect("pixels");
        assert_eq!([pixels.image.width, pixels.image.height], [size.0 as u32, size.1 as u32]);
        let offset = [position.0, position.1].map(i64::from);
        let frame = DisplayWindow { offset, size: [16, 8] };
        assert_eq!(pixels.frame, (size != (16, 8)).then_some(frame));
    }
}

/// Y = 0.2126 R + 0.7152 G + 0.0722 B, RY = (R − Y) / Y and BY = (B − Y) / Y.
#[test]
fn luminance_and_chroma_become_colours() {
    let [r, g, b] = [0.9_f32, 0.25, 3.0];
    let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
    let values = [("Y", y), ("RY", (r - y) / y), ("BY", (b - y) / y)];
    let channels =
        values.map(|(name, value)| AnyChannel::new(name, FlatSamples::F32(vec![value; 4])));
    let layer = Layer::new(
        (2, 2),
        LayerAttributes::default(),
        Encoding::UNCOMPRESSED,
        AnyChannels::sort(channels.into_iter().collect()),
    );
    let mut out = Cursor::new(Vec::new());
    let file = exr::image::Image::from_layer(layer);
    file.write().non_parallel().to_buffered(&mut out).expect("it is written");
    let image = decode(&out.into_inner(), Path::new("a.exr"), Transfer::Srgb).expect("an image");
    for pixel in image.pixels {
        for (found, expected) in pixel.into_iter().zip([r, g, b]) {
            assert!((found - expected).abs() < 1e-6 * (1.0 + expected), "{pixel:?}");
        }
    }
}

#[test]
fn values_that_are_no_light_are_counted_and_replaced() {
    let mut image = Image { width: 2, height: 2, pixels: vec![[1.0; 3]; 4].into() };
    assert_eq!((image.make_finite(), image.make_radiance()), (None, None));
    image.pixels[1] = [f32::NAN, -1.0, 2.0];
    image.pixels[2] = [f32::INFINITY, f32::NEG_INFINITY, 0.5];
    let mut light = image.clone();
    let note = image.make_finite().expect("two pixels");
    assert!(
        note.starts_with("2 pixels of 4") && note.contains("(1, 0), [NaN, -1.0, 2.0]"),
        "{note}"
    );
    assert_eq!(image.pixels[1..3], [[0.0, -1.0, 2.0], [2.0, -2.0, 0.5]]);
    assert!(light.make_radiance().is_some());
    assert_eq!(light.pixels[1..3], [[0.0, 0.0, 2.0], [2.0, 0.0, 0.5]]);
    let note = image.make_radiance().expect("two negative pixels");
    assert!(note.contains("(1, 0), [0.0, -1.0, 2.0]"), "{note}");
    assert_eq!(image, light);
}

#[test]
fn square_skies_are_doubted() {
    let image = |width, height| Image {
        width,
        height,
        pixels: vec![[1.0; 3]; (width * height) as usize].into(),
    };
    assert!(image(4, 4).doubt_as_sky().is_some_and(|note| note.contains("4 × 4")));
    assert_eq!(image(8, 4).doubt_as_sky(), None);
    assert_eq!(image(1, 1).doubt_as_sky(), None);
}

/// Files of OpenEXR 3.3.2 with Y = ¼ + x/64 + y/128, RY = x/32 − y/128 and BY = ¼ − x/64, where RY
/// and BY have every second column and row: they are linear in between, and constant at the end.
#[test]
fn chroma_may_have_fewer_pixels() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/formats/images");
    for (method, precision) in [
        ("none", 1e-6),
        ("rle", 1e-3),
        ("zips", 1e-3),
        ("zip", 1e-6),
        ("piz", 1e-3),
        ("pxr24", 1e-4),
        ("dwaa", 2e-2),
    ] {
        let path = format!("{folder}/chroma_{method}.exr");
        let bytes = std::fs::read(&path).expect("a readable file");
        let image = decode(&bytes, Path::new(&path), Transfer::Srgb);
        let image = image.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!((image.width, image.height), (16, 34), "{method}");
        for (i, pixel) in image.pixels.iter().enumerate() {
            let [x, y] = [i % 16, i / 16].map(|n| n as f32);
            let luminance = 0.25 + x / 64.0 + y / 128.0;
            let (cx, cy) = (x.min(14.0), y.min(32.0));
            let r = (1.0 + cx / 32.0 - cy / 128.0) * luminance;
            let b = (1.25 - cx / 64.0) * luminance;
            let g = (luminance - 0.2126 * r - 0.0722 * b) / 0.7152;
            for (got, want) in pixel.iter().zip([r, g, b]) {
                assert!((got - want).abs() < precision, "{method} {x} {y}: {got} is not {want}");
            }
        }
    }
}

/// Creates an EXR file of a gradient in three channels of full resolution, compressed by DWAA.
fn full_dwaa() -> Vec<u8> {
    let values: Vec<_> = (0..40 * 40).map(|i| i as f32 / 1600.0).collect();
    let channels =
        ["R", "G", "B"].map(|name| AnyChannel::new(name, FlatSamples::F32(values.clone())));
    let encoding = Encoding { compression: Compression::DWAA(None), ..Encoding::UNCOMPRESSED };
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let layer = Layer::new((40, 40), LayerAttributes::default(), encoding, channels);
    let mut out = Cursor::new(Vec::new());
    let file = exr::image::Image::from_layer(layer);
    file.write().non_parallel().to_buffered(&mut out).expect("it is written");
    out.into_inner()
}

/// Damaged files are errors, not panics.
#[test]
fn damaged_chroma_does_no_harm() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/formats/images");
    let methods = ["none", "rle", "zip", "piz", "pxr24", "dwaa"];
    let file = |method| std::fs::read(format!("{folder}/chroma_{method}.exr")).expect("a file");
    // Counts in the latter, in which all channels have full resolution, could request hundreds of
    // gigabytes.
    let files = methods.map(|method| (method, file(method))).into_iter();
    for (method, bytes) in files.chain([("full dwaa", full_dwaa())]) {
        for at in 0..bytes.len().min(1500) {
            let mut damaged = bytes.clone();
            damaged[at] ^= 0x55;
            for bytes in [&damaged[..], &bytes[..at]] {
                let path = Path::new("damaged.exr");
                let message = decode(bytes, path, Transfer::Srgb).map_err(|e| e.to_string()).err();
                let message = message.unwrap_or_default();
                assert!(!message.contains("panicked"), "{method}, byte {at}: {message}");
            }
        }
    }
}
