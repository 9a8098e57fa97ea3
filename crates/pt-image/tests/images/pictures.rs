//! Radiance pictures, JPEG files, and images with stored values.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use jpeg_encoder::{ColorType, Encoder, SamplingFactor};
use pt_image::{
    PixelEncoding, SaveOptions, Transfer, decode, decode_as, load, load_raw, load_rgba_raw, save,
};
use pt_scene::image::Image;

fn read(bytes: &[u8], name: &str) -> Image {
    decode(bytes, Path::new(name), Transfer::Srgb).unwrap_or_else(|error| panic!("{error}"))
}

fn stored(bytes: &[u8], name: &str) -> Image {
    let decoded = decode_as(bytes, Path::new(name), PixelEncoding::Stored);
    decoded.unwrap_or_else(|error| panic!("{error}")).image
}

fn refusal(bytes: &[u8], name: &str) -> String {
    decode(bytes, Path::new(name), Transfer::Srgb).expect_err("it is wrong").to_string()
}

/// Returns a generator of pseudo-random numbers (linear congruential).
fn random() -> impl FnMut() -> usize {
    let mut state = 1u32;
    move || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize
    }
}

// ---- Radiance ----------------------------------------------------------------------------------

const HEADER: &str = "#?RADIANCE\n# made by hand\nFORMAT=32-bit_rle_rgbe\n";

/// Creates a Radiance picture from the lines of its header, its size and its pixels.
fn hdr(header: &str, size: [usize; 2], data: &[u8]) -> Vec<u8> {
    let text = format!("{header}\n-Y {} +X {}\n", size[1], size[0]);
    [text.as_bytes(), data].concat()
}

/// Encodes a row channel by channel, each as a run of one byte and then its other bytes.
fn packed(row: &[[u8; 4]]) -> Vec<u8> {
    let [high, low] = (row.len() as u16).to_be_bytes();
    let mut data = vec![2, 2, high, low];
    for channel in 0..4 {
        let bytes: Vec<_> = row.iter().map(|pixel| pixel[channel]).collect();
        let run = bytes.iter().take_while(|b| **b == bytes[0]).take(127).count();
        data.extend([128 + run as u8, bytes[0]]);
        for rest in bytes[run..].chunks(128) {
            data.push(rest.len() as u8);
            data.extend(rest);
        }
    }
    data
}

/// Returns rows with runs in some channels.
fn rows() -> Vec<Vec<[u8; 4]>> {
    let pixel = |x: u8, y: u8| [200, if x < 5 { 3 } else { 7 * x }, 40 * y, 120 + x / 4];
    (0..3).map(|y| (0..12).map(|x| pixel(x, y)).collect()).collect()
}

#[test]
fn mantissas_and_exponents_are_light() {
    let data =
        [[128, 64, 0, 129], [255, 1, 2, 0], [1, 2, 4, 128 + 8], [255, 0, 0, 255], [1, 0, 0, 1]];
    let image = read(&hdr(HEADER, [5, 1], data.as_flattened()), "a.hdr");
    let largest = 255.0 * 2f32.powi(119);
    let expected = [
        [1.0, 0.5, 0.0],
        [0.0; 3],
        [1.0, 2.0, 4.0],
        [largest, 0.0, 0.0],
        [2f32.powi(-126) / 512.0, 0.0, 0.0], // 2⁻¹³⁵
    ];
    assert_eq!((image.width, image.height), (5, 1));
    assert_eq!(image.pixels, expected);
}

#[test]
fn all_ways_to_pack_pixels_give_the_same_picture() {
    let rows = rows();
    let (width, height) = (rows[0].len(), rows.len());
    let plain = read(&hdr(HEADER, [width, height], rows.concat().as_flattened()), "a.hdr");
    assert_eq!(plain.pixels.len(), width * height);
    let by_channel: Vec<u8> = rows.iter().flat_map(|row| packed(row)).collect();
    assert_eq!(read(&hdr(HEADER, [width, height], &by_channel), "a.rgbe"), plain);
    // Rows may be encoded in different ways.
    let mixed = [packed(&rows[0]), rows[1].concat(), packed(&rows[2])].concat();
    assert_eq!(read(&hdr("#?RGBE\n", [width, height], &mixed), "a.hdr"), plain);
}

#[test]
fn runs_of_pixels_count_in_digits_of_256() {
    let (red, blue) = ([128, 0, 0, 129], [0, 0, 128, 129]);
    // 1 + 2 + 1 · 256 red pixels, then a blue one and two more.
    let data = [red, [1, 1, 1, 2], [1, 1, 1, 1], blue, [1, 1, 1, 2]];
    let image = read(&hdr(HEADER, [262, 1], data.as_flattened()), "a.hdr");
    let reds = image.pixels.iter().take_while(|p| **p == [1.0, 0.0, 0.0]).count();
    assert_eq!(reds, 259);
    assert!(image.pixels[259..].iter().all(|p| *p == [0.0, 0.0, 1.0]));
}

#[test]
fn what_pixels_were_multiplied_by_is_undone() {
    let header = format!("{HEADER}EXPOSURE=2\nSOFTWARE=x=y\nEXPOSURE= 4\nCOLORCORR=1 2 0.5\n");
    let bytes = hdr(&header, [1, 1], &[128, 128, 128, 132]);
    assert_eq!(read(&bytes, "a.hdr").pixels, [[1.0, 0.5, 2.0]]);
    assert_eq!(stored(&bytes, "a.hdr").pixels, [[8.0; 3]]);
    let radiance = "PRIMARIES=0.640 0.330 0.290 0.600 0.150 0.060 0.333 0.333\n";
    let bytes = hdr(&format!("{HEADER}{radiance}"), [1, 1], &[128, 128, 128, 129]);
    assert_eq!(read(&bytes, "a.hdr").pixels, [[1.0; 3]]);
}

#[test]
fn wrong_radiance_pictures_are_refused_with_a_reason() {
    let pixel = [128, 128, 128, 129];
    let with = |line: &str| hdr(&format!("{HEADER}{line}\n"), [1, 1], &pixel);
    let wide = |data: &[u8]| hdr(HEADER, [8, 1], data);
    let of_size = |size: &str| [format!("{HEADER}\n{size}\n").as_bytes(), &pixel].concat();
    let cases: [(Vec<u8>, &str); 19] = [
        (b"P6 1 1 255\n".to_vec(), "does not begin with \"#?\""),
        (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n".to_vec(), "ends in its header"),
        (with("FORMAT=32-bit_rle_xyze"), "32-bit_rle_xyze"),
        (with("EXPOSURE=0"), "EXPOSURE=\"0\""),
        (with("EXPOSURE=nan"), "expected 1 numbers above 0"),
        (with("EXPOSURE=1e-300"), "EXPOSURE and COLORCORR"),
        (with("COLORCORR=1 2"), "expected 3 numbers above 0"),
        (with("PRIMARIES=0.7 0.3 0.2 0.8 0.13 0.05 0.31 0.33"), "Rec. 709"),
        (of_size("+Y 1 +X 1"), "-Y height +X width"),
        (of_size("-Y 0 +X 1"), "-Y height +X width"),
        (of_size("-Y 99999999999 +X 1"), "-Y height +X width"),
        (of_size("-Y 60000 +X 60000"), "1 GiB"),
        (of_size("-Y 1 +X 2"), "row 0 of 1 is truncated"),
        (wide(&[2, 2, 0, 9, 136, 1]), "declares 9 pixels"),
        (wide(&[2, 2, 0, 8, 0, 1]), "a run of no bytes"),
        (wide(&[2, 2, 0, 8, 137, 1]), "runs beyond its end"),
        (wide(&[1, 1, 1, 8]), "begins with a run"),
        (wide(&[9, 9, 9, 9, 1, 1, 1, 9]), "runs beyond its end"),
        (
            hdr(&format!("{HEADER}EXPOSURE=1e-20\n"), [1, 1], &[255, 255, 255, 255]),
            "infinite colours",
        ),
    ];
    for (bytes, expected) in cases {
        let message = refusal(&bytes, "a.hdr");
        assert!(message.starts_with("a.hdr: ") && message.contains(expected), "{message}");
    }
}

// ---- JPEG --------------------------------------------------------------------------------------

const WIDTH: u16 = 37;
const HEIGHT: u16 = 29;

/// Returns smooth colours, which survive the compression.
fn levels() -> Vec<[u8; 3]> {
    let pixel = |i: u16| {
        let (x, y) = (i % WIDTH, i / WIDTH);
        [40 + 4 * x, 200 - 5 * y, 60 + 2 * x + 2 * y].map(|v| v as u8)
    };
    (0..WIDTH * HEIGHT).map(pixel).collect()
}

/// Creates a JPEG file.
fn jpeg(color: ColorType, data: &[u8], setup: impl Fn(&mut Encoder<&mut Vec<u8>>)) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, 100);
    encoder.set_sampling_factor(SamplingFactor::R_4_4_4);
    setup(&mut encoder);
    encoder.encode(data, WIDTH, HEIGHT, color).expect("it can be encoded");
    bytes
}

/// Returns the same colours in all supported kinds of files.
fn jpegs() -> Vec<(&'static str, Vec<u8>)> {
    let levels = levels();
    let rgb =
        |setup: fn(&mut Encoder<&mut Vec<u8>>)| jpeg(ColorType::Rgb, levels.as_flattened(), setup);
    vec![
        ("sequential", rgb(|_| {})),
        ("progressive", rgb(|encoder| encoder.set_progressive(true))),
        ("restarts", rgb(|encoder| encoder.set_restart_interval(3))),
        ("half", rgb(|encoder| encoder.set_sampling_factor(SamplingFactor::R_4_2_0))),
        (
            "progressive half",
            rgb(|encoder| {
                encoder.set_progressive(true);
                encoder.set_sampling_factor(SamplingFactor::R_4_2_0);
            }),
        ),
    ]
}

#[test]
fn jpeg_colours_come_back_within_a_few_levels() {
    for (name, bytes) in jpegs() {
        let image = stored(&bytes, "a.jpg");
        assert_eq!((image.width, image.height), (u32::from(WIDTH), u32::from(HEIGHT)));
        let most = if name.contains("half") { 8.0 } else { 3.0 };
        for (found, expected) in image.pixels.iter().zip(levels()) {
            for c in 0..3 {
                let error = (255.0 * found[c] - f32::from(expected[c])).abs();
                assert!(error <= most, "{name}: {found:?} {expected:?}");
            }
        }
        // Linear light is decoded from the levels by the sRGB curve.
        let light = read(&bytes, "a.jpeg");
        for (level, light) in image.pixels.as_flattened().iter().zip(light.pixels.as_flattened()) {
            let level = (255.0 * level).round() as u16;
            assert_eq!(*light, Transfer::Srgb.decode(level, 255), "{name}");
        }
    }
}

#[test]
fn grey_jpeg_has_three_equal_channels() {
    let grey: Vec<u8> = levels().iter().map(|p| p[0]).collect();
    for progressive in [false, true] {
        let bytes = jpeg(ColorType::Luma, &grey, |encoder| encoder.set_progressive(progressive));
        let image = stored(&bytes, "a.jpg");
        for (found, expected) in image.pixels.iter().zip(&grey) {
            assert!(found[0] == found[1] && found[1] == found[2]);
            assert!((255.0 * found[0] - f32::from(*expected)).abs() <= 2.0, "{found:?} {expected}");
        }
    }
}

#[test]
fn other_jpegs_are_refused_with_a_reason() {
    let ink = vec![99; 4 * usize::from(WIDTH) * usize::from(HEIGHT)];
    let message = refusal(&jpeg(ColorType::Cmyk, &ink, |_| {}), "a.jpg");
    assert!(message.contains("CMYK"), "{message}");
    assert!(refusal(b"\xff\xd8\xff\xd9", "a.jpg").contains("not a valid JPEG file"));
    // The frame header contains the size after its marker, length and bits per sample.
    let (_, bytes) = &jpegs()[0];
    let at = bytes.windows(2).position(|w| w == [0xff, 0xc0]).expect("a frame") + 5;
    for (side, expected) in [(65_535u16, "1 GiB"), (9000, "declares")] {
        let mut bytes = bytes.clone();
        bytes[at..at + 2].copy_from_slice(&side.to_be_bytes());
        bytes[at + 2..at + 4].copy_from_slice(&side.to_be_bytes());
        let message = refusal(&bytes, "a.jpg");
        assert!(message.contains(expected), "{message}");
    }
}

/// Means over all channels of linear and stored values of files of other programs, as Mitsuba reads
/// them (libjpeg).
#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn jpegs_of_other_programs_are_read() {
    let shared = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/mitsuba/common");
    for (name, size, light, levels) in [
        ("floor_tiles.jpg", (2048, 2048), 0.097_944, 0.309_134),
        ("floor_tiles_normalmap.jpg", (2048, 2048), 0.450_294, 0.650_211),
        ("wood.jpg", (2048, 1571), 0.278_097, 0.561_037),
    ] {
        let path = Path::new(shared).join("textures").join(name);
        let mean = |image: &Image| {
            let numbers = image.pixels.as_flattened();
            numbers.iter().map(|x| f64::from(*x)).sum::<f64>() / numbers.len() as f64
        };
        let image = load(&path).unwrap();
        assert_eq!((image.width, image.height), size, "{name}");
        assert!((mean(&image) - light).abs() < 2e-4, "{name}: {}", mean(&image));
        let raw = load_raw(&path).unwrap();
        assert!((mean(&raw) - levels).abs() < 2e-4, "{name}: {}", mean(&raw));
    }
}

// ---- damage ------------------------------------------------------------------------------------

/// Returns valid files to damage.
fn valid_files() -> Vec<(&'static str, Vec<u8>)> {
    let rows = rows();
    let size = [rows[0].len(), rows.len()];
    let by_channel: Vec<u8> = rows.iter().flat_map(|row| packed(row)).collect();
    let runs = [[128, 0, 0, 129], [1, 1, 1, 5], [0, 0, 9, 120], [1, 1, 1, 5]];
    let grey: Vec<u8> = levels().iter().map(|p| p[0]).collect();
    let mut files = vec![
        ("flat.hdr", hdr(HEADER, size, rows.concat().as_flattened())),
        ("packed.hdr", hdr(&format!("{HEADER}EXPOSURE=2\n"), size, &by_channel)),
        ("runs.hdr", hdr(HEADER, [6, 2], runs.as_flattened())),
        ("grey.jpg", jpeg(ColorType::Luma, &grey, |_| {})),
    ];
    files.extend(jpegs().into_iter().map(|(_, bytes)| ("colour.jpg", bytes)));
    files.extend(raster_files());
    files
}

/// Returns files of the formats that the crate `image` reads.
fn raster_files() -> Vec<(&'static str, Vec<u8>)> {
    let next = &mut random();
    let picture = image::RgbaImage::from_fn(9, 7, |_, _| image::Rgba([0; 4].map(|_| next() as u8)));
    let picture = image::DynamicImage::ImageRgba8(picture);
    [
        ("a.bmp", image::ImageFormat::Bmp),
        ("a.gif", image::ImageFormat::Gif),
        ("a.pam", image::ImageFormat::Pnm),
        ("a.qoi", image::ImageFormat::Qoi),
        ("a.tga", image::ImageFormat::Tga),
        ("a.tif", image::ImageFormat::Tiff),
        ("a.webp", image::ImageFormat::WebP),
    ]
    .map(|(name, format)| {
        let mut bytes = Cursor::new(Vec::new());
        picture.write_to(&mut bytes, format).expect("a picture");
        (name, bytes.into_inner())
    })
    .to_vec()
}

#[test]
fn beginnings_of_files_are_refused_or_have_the_size_of_the_whole() {
    for (name, bytes) in valid_files() {
        let whole = read(&bytes, name);
        for length in 0..bytes.len() {
            match decode(&bytes[..length], Path::new(name), Transfer::Srgb) {
                Err(error) => assert!(error.to_string().contains(name), "{error}"),
                // The last rows of a JPEG file may be missing, as in other programs.
                Ok(image) => {
                    assert!(!name.contains("hdr"), "{name} cut to {length} bytes");
                    assert_eq!((image.width, image.height), (whole.width, whole.height));
                }
            }
        }
    }
}

#[test]
fn damaged_files_give_an_error_or_an_image_of_their_size() {
    let mut next = random();
    for (name, bytes) in valid_files() {
        let (mut read, rounds) = (0, 5000);
        for _ in 0..rounds {
            let mut damaged = bytes.clone();
            for _ in 0..=next() % 4 {
                // Half of the damage is in the headers.
                let range =
                    if next().is_multiple_of(2) { bytes.len().min(700) } else { bytes.len() };
                damaged[next() % range] = next() as u8;
            }
            if let Ok(image) = decode(&damaged, Path::new(name), Transfer::Srgb) {
                let count = u64::from(image.width) * u64::from(image.height);
                assert_eq!(count, image.pixels.len() as u64);
                read += 1;
            }
        }
        assert!(read > 0 && read < rounds, "{name}: {read} of {rounds} were read");
    }
}

// ---- stored values -----------------------------------------------------------------------------

/// Creates a PNG file of two pixels with a `gAMA` chunk.
fn png_of(color: png::ColorType, depth: png::BitDepth, data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    encoder.set_source_gamma(png::ScaledFloat::new(0.25));
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![255, 51, 0, 0, 0, 255]);
        encoder.set_trns(vec![102]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    bytes
}

#[test]
fn stored_levels_are_shares_of_the_highest() {
    use png::{BitDepth as Depth, ColorType as Color};
    let clear = Some(vec![0.4, 1.0]);
    let cases = [
        (Color::Grayscale, Depth::Two, vec![0b0111_0000], [[1.0 / 3.0; 3], [1.0; 3]], None),
        (Color::Grayscale, Depth::Eight, vec![51, 255], [[0.2; 3], [1.0; 3]], None),
        (
            Color::GrayscaleAlpha,
            Depth::Eight,
            vec![51, 102, 0, 255],
            [[0.2; 3], [0.0; 3]],
            clear.clone(),
        ),
        (
            Color::Rgb,
            Depth::Sixteen,
            vec![0, 0, 0x33, 0x33, 0xff, 0xff, 0x66, 0x66, 0, 0, 0, 0],
            [[0.0, 0.2, 1.0], [0.4, 0.0, 0.0]],
            None,
        ),
        (
            Color::Rgba,
            Depth::Sixteen,
            vec![0, 0, 0x33, 0x33, 0xff, 0xff, 0x66, 0x66, 0, 0, 0, 0, 0, 0, 0xff, 0xff],
            [[0.0, 0.2, 1.0], [0.0; 3]],
            clear.clone(),
        ),
        (Color::Indexed, Depth::One, vec![0b0100_0000], [[1.0, 0.2, 0.0], [0.0, 0.0, 1.0]], clear),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    for (color, depth, data, pixels, alpha) in cases {
        fs::write(&path, png_of(color, depth, &data)).unwrap();
        assert_eq!(load_raw(&path).unwrap().pixels, pixels, "{color:?} {depth:?}");
        let decoded = load_rgba_raw(&path).unwrap();
        assert_eq!(
            (decoded.image.pixels.to_vec(), decoded.alpha),
            (pixels.to_vec(), alpha),
            "{color:?}"
        );
        // Linear light of the same file: L = v⁴.
        let light = load(&path).unwrap().pixels;
        for (light, level) in light.as_flattened().iter().zip(pixels.as_flattened()) {
            assert!((light - level.powi(4)).abs() < 1e-6, "{color:?} {depth:?}: {light} {level}");
        }
    }
}

#[test]
fn stored_numbers_with_floating_point_are_as_they_are() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let image =
        Image { width: 2, height: 1, pixels: vec![[-3.0, 0.25, 1e6], [0.0, 1.0, 2.0]].into() };
    save(&image, &path, &SaveOptions::default()).unwrap();
    let decoded = load_rgba_raw(&path).unwrap();
    assert_eq!((decoded.image, decoded.alpha), (image, None));
}

#[test]
fn exr_files_may_have_opacity() {
    use exr::prelude::*;
    let channels =
        SpecificChannels::rgba(|p: Vec2<usize>| (0.5f32, 0.25f32, 0.125f32, p.x() as f32));
    let image = exr::image::Image::from_channels((2, 1), channels);
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes).unwrap();
    let decoded = decode_as(bytes.get_ref(), std::path::Path::new("a.exr"), PixelEncoding::Stored);
    let decoded = decoded.unwrap();
    assert_eq!(decoded.image.pixels, [[0.5, 0.25, 0.125]; 2]);
    assert_eq!(decoded.alpha, Some(vec![0.0, 1.0]));
}

#[test]
fn unknown_endings_and_missing_files_are_named() {
    for result in [load_raw(Path::new("a.svg")).err(), load(Path::new("a.svg")).err()] {
        let message = result.expect("no format").to_string();
        assert!(message.contains(".png, .exr, .hdr, .rgbe, .jpg, .jpeg, .tga"), "{message}");
    }
    let message = load_raw(Path::new("missing.jpg")).unwrap_err().to_string();
    assert!(message.contains("missing.jpg: cannot be read"), "{message}");
    let image = Image { width: 1, height: 1, pixels: vec![[0.5; 3]].into() };
    let message = save(&image, Path::new("a.jpg"), &SaveOptions::default()).unwrap_err();
    assert!(message.to_string().ends_with("known extensions: .png, .exr"), "{message}");
}
