//! Image files: round trips, and rejection of broken files with a reason.

mod blocks;
mod files;
mod metadata;
mod opacity;
mod pictures;
mod raster;
mod windows;

use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

use pt_image::{
    BitDepth, Compression, ImageError, Precision, SaveOptions, Tone, ToneCurve, Transfer,
    count_beyond_half, decode, decode_file, load, load_as, save, save_rgb8,
};
use pt_io::{WriteError, write_atomically};
use pt_scene::image::{Channel, Image, Samples};
use pt_testing::without_panics;

/// An image with a different colour in every pixel, some of them above 1.
fn picture(width: u32, height: u32) -> Image {
    let pixel = |i: u32| {
        let t = i as f32 / (width * height) as f32;
        [t * t, 1.25 * (1.0 - t), (7 * i % 13) as f32 / 13.0]
    };
    Image { width, height, pixels: (0..width * height).map(pixel).collect() }
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn both_transfers_and_depths() -> impl Iterator<Item = SaveOptions> {
    [Transfer::Srgb, Transfer::Gamma].into_iter().flat_map(|transfer| {
        [BitDepth::Eight, BitDepth::Sixteen].map(|png_bits| SaveOptions {
            png_bits,
            transfer,
            ..SaveOptions::default()
        })
    })
}

/// Returns the names and data of the chunks of a PNG file.
fn chunks(png: &[u8]) -> Vec<(String, Vec<u8>)> {
    let mut rest = &png[8..];
    let mut found = Vec::new();
    while let [a, b, c, d, name @ ..] = rest {
        let length = u32::from_be_bytes([*a, *b, *c, *d]) as usize;
        let text = String::from_utf8_lossy(&name[..4]).into_owned();
        found.push((text, name[4..4 + length].to_vec()));
        rest = &name[length + 8..];
    }
    found
}

#[test]
fn exr_files_take_more_channels() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    let image = picture(3, 2);
    let channel =
        |name: &str, samples| Channel { name: name.to_owned(), samples, half_suffices: false };
    let depth = vec![0.5, 1.0, f32::INFINITY, -2.0, 0.0, 3.0];
    let id = vec![0, 1, u32::MAX, 3, 4, 1 << 24 | 1];
    let channels = vec![
        channel("albedo.R", Samples::Real(vec![9.0; 6])),
        channel("albedo.G", Samples::Real(vec![9.0; 6])),
        channel("albedo.B", Samples::Real(vec![9.0; 6])),
        channel("depth.Z", Samples::Real(depth.clone())),
        channel("a_1.id", Samples::Whole(id.clone())),
    ];
    let options = SaveOptions { channels, ..Default::default() };
    save(&image, &path, &options).unwrap();
    assert_eq!(load(&path).unwrap(), image, "the colours are those of the image");
    let file = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
    let stored = |name: &str| {
        let channels = &file.layer_data[0].channel_data.list;
        let found = channels.iter().find(|c| c.name == *name).expect("it was written");
        found.sample_data.clone()
    };
    assert_eq!(stored("depth.Z"), exr::prelude::FlatSamples::F32(depth));
    assert_eq!(stored("a_1.id"), exr::prelude::FlatSamples::U32(id));
    assert_eq!(file.layer_data[0].channel_data.list.len(), 8);
}

/// Colours and directions get 16 bits; positions and integers keep 32.
#[test]
fn exr_files_have_halves_where_they_suffice() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    let mut image = picture(4, 1);
    image.pixels[1] = [65_504.0, 65_519.0, 1e9];
    image.pixels[2] = [f32::INFINITY, -1e9, f32::NAN];
    let channel = |name: &str, samples, half_suffices| Channel {
        name: name.to_owned(),
        samples,
        half_suffices,
    };
    let values = vec![0.1, 70_000.0, -2.0, 1e-9];
    let ids = vec![1, 65_505, u32::MAX, 1 << 30];
    let channels = vec![
        channel("albedo.R", Samples::Real(values.clone()), true),
        channel("depth.Z", Samples::Real(values.clone()), false),
        channel("object.id", Samples::Whole(ids.clone()), true),
    ];
    let float = SaveOptions { channels, ..Default::default() };
    assert_eq!(count_beyond_half(&image, &float), 0);
    let half = SaveOptions { exr_type: Precision::Half, ..float };
    assert_eq!(count_beyond_half(&image, &half), 4);
    save(&image, &path, &half).unwrap();
    let file = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
    let stored = |name: &str| {
        let channels = &file.layer_data[0].channel_data.list;
        channels.iter().find(|c| c.name == *name).expect("it was written").sample_data.clone()
    };
    let nearest = |v: f32| exr::prelude::f16::from_f32(v);
    let albedo = [0.1, 65_504.0, -2.0, 1e-9].map(nearest).to_vec();
    assert_eq!(stored("albedo.R"), exr::prelude::FlatSamples::F16(albedo));
    assert_eq!(stored("depth.Z"), exr::prelude::FlatSamples::F32(values));
    assert_eq!(stored("object.id"), exr::prelude::FlatSamples::U32(ids));
    let back = load(&path).unwrap();
    assert_eq!(back.pixels[1], [65_504.0; 3]);
    assert_eq!(back.pixels[2][..2], [f32::INFINITY, -65_504.0]);
    assert!(back.pixels[2][2].is_nan());
}

const LOSSLESS: [Compression; 5] =
    [Compression::None, Compression::Rle, Compression::Zips, Compression::Zip, Compression::Piz];

/// Lossy compression: PXR24 keeps 24 of 32 bits, and B44 stores differences of 6 bits in blocks of
/// 16-bit numbers. The differences are in steps of 2ⁿ units in the last place, of which 31 must
/// span from the minimum to the maximum of a block. From 0 to 1.25, whose bits are 0x3d00, this
/// gives n = 9, and the error of each number is at most 256 units.
#[test]
fn every_compression_is_read_back_and_keeps_what_it_should() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    let image = picture(37, 19);
    let ids: Vec<u32> = (0..37 * 19_u32).map(|i| i.wrapping_mul(40_503_001)).collect();
    let id =
        Channel { name: "a.id".into(), samples: Samples::Whole(ids.clone()), half_suffices: true };
    let rounded = |to: fn(f32) -> f32| image.pixels.iter().map(|p| p.map(to)).collect::<Vec<_>>();
    let half = |v: f32| exr::prelude::f16::from_f32(v).to_f32();
    let lossy = [Compression::Pxr24, Compression::B44, Compression::B44a];
    for exr_compression in LOSSLESS.into_iter().chain(lossy) {
        for exr_type in [Precision::Float, Precision::Half] {
            let channels = vec![id.clone()];
            let options = SaveOptions { exr_type, exr_compression, channels, ..Default::default() };
            save(&image, &path, &options).unwrap();
            let what = format!("{exr_compression:?} {exr_type:?}");
            let wanted = if exr_type == Precision::Half { rounded(half) } else { rounded(|v| v) };
            let is_near = |b: f32, w: f32| match (exr_compression, exr_type) {
                (Compression::Pxr24, Precision::Float) => (b - w).abs() <= w / 65_536.0,
                (Compression::B44 | Compression::B44a, Precision::Half) => {
                    // Units from 0; B44 may go slightly below 0.
                    let units = |v: f32| {
                        let size = i32::from(exr::prelude::f16::from_f32(v.abs()).to_bits());
                        if v < 0.0 { -size } else { size }
                    };
                    (units(b) - units(w)).abs() <= 256
                }
                _ => b == w,
            };
            let back = load(&path).unwrap().pixels;
            for (b, w) in back.as_flattened().iter().zip(wanted.as_flattened()) {
                assert!(is_near(*b, *w), "{what}: {b} is not {w}");
            }
            let file = exr::prelude::read_all_flat_layers_from_file(&path).unwrap();
            let list = &file.layer_data[0].channel_data.list;
            let stored = list.iter().find(|c| c.name == *"a.id").expect("it was written");
            assert_eq!(stored.sample_data, exr::prelude::FlatSamples::U32(ids.clone()), "{what}");
        }
    }
}

/// The tone changes the levels of PNG files, by its curve, and no bit of EXR files.
#[test]
fn tone_is_for_png_files_alone() {
    let folder = folder();
    let (png, exr) = (folder.path().join("a.png"), folder.path().join("a.exr"));
    let image = picture(12, 9);
    for curve in [ToneCurve::Filmic, ToneCurve::Agx, ToneCurve::Aces, ToneCurve::PbrNeutral] {
        let tone = Tone { exposure: 1.5, curve };
        let options = SaveOptions { tone, png_bits: BitDepth::Sixteen, ..Default::default() };
        save(&image, &png, &options).unwrap();
        save(&image, &exr, &options).unwrap();
        assert_eq!(load(&exr).unwrap(), image);
        for (shown, light) in load(&png).unwrap().pixels.iter().zip(&image.pixels) {
            for (s, m) in shown.iter().zip(tone.map(*light)) {
                assert!((s - m).abs() < 4e-5, "{curve:?}: {s} is not {m}");
            }
        }
    }
}

#[test]
fn channels_that_fit_into_no_file_are_refused() {
    let folder = folder();
    let channel = |name: &str, n| Channel {
        name: name.into(),
        samples: Samples::Real(vec![0.; n]),
        half_suffices: false,
    };
    for (file, channels, wanted) in [
        ("a.png", vec![channel("depth.Z", 6)], "channel depth.Z is not representable"),
        ("a.exr", vec![channel("depth.Z", 5)], "found 5 pixels, expected"),
        ("a.exr", vec![channel("R", 6)], "invalid name \"R\""),
        ("a.exr", vec![channel("a", 6), channel("a", 6)], "invalid name \"a\""),
        ("a.exr", vec![channel("", 6)], "invalid name \"\""),
        ("a.exr", vec![channel("☀", 6)], "invalid name \"☀\""),
    ] {
        let options = SaveOptions { channels, ..Default::default() };
        let error = save(&picture(3, 2), &folder.path().join(file), &options).unwrap_err();
        assert!(error.to_string().contains(wanted), "{error}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn exr_keeps_every_bit() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    let mut image = picture(37, 19);
    image.pixels[5] = [f32::MAX, -0.0, f32::from_bits(1)];
    save(&image, &path, &SaveOptions::default()).unwrap();
    let back = load(&path).unwrap();
    let bits = |image: &Image| image.pixels.iter().map(|p| p.map(f32::to_bits)).collect::<Vec<_>>();
    assert_eq!((back.width, back.height, bits(&back)), (37, 19, bits(&image)));
}

#[test]
fn png_keeps_every_level() {
    let folder = folder();
    let path = folder.path().join("a.png");
    for options in both_transfers_and_depths() {
        let image = picture(37, 19);
        save(&image, &path, &options).unwrap();
        let back = load_as(&path, options.transfer).unwrap();
        assert_eq!((back.width, back.height), (37, 19));
        let level = |l: f32| match options.png_bits {
            BitDepth::Eight => u16::from(options.transfer.encode8(l)),
            BitDepth::Sixteen => options.transfer.encode16(l),
        };
        for (original, read) in image.pixels.iter().zip(&back.pixels) {
            assert_eq!(original.map(level), read.map(level), "{options:?}");
        }
    }
}

#[test]
fn every_level_decodes_to_light_that_encodes_to_it() {
    for transfer in [Transfer::Srgb, Transfer::Gamma] {
        for v in 0..=u8::MAX {
            assert_eq!(transfer.encode8(transfer.decode(u16::from(v), 255)), v, "{transfer:?}");
        }
        for v in 0..=u16::MAX {
            assert_eq!(transfer.encode16(transfer.decode(v, u16::MAX)), v, "{transfer:?}");
        }
    }
}

#[test]
fn png_says_srgb_only_where_it_is() {
    let folder = folder();
    let path = folder.path().join("a.png");
    for options in both_transfers_and_depths() {
        save(&picture(4, 3), &path, &options).unwrap();
        let names: Vec<_> = chunks(&fs::read(&path).unwrap()).into_iter().map(|c| c.0).collect();
        let has = |name: &str| names.iter().any(|n| n == name);
        assert_eq!(has("sRGB"), options.transfer == Transfer::Srgb);
        assert!(!has("gAMA") && !has("iCCP"), "{names:?}");
    }
    // A file without tags is decoded with the transfer function that the caller passes.
    save(&picture(4, 3), &path, &SaveOptions { transfer: Transfer::Gamma, ..Default::default() })
        .unwrap();
    assert_ne!(load_as(&path, Transfer::Gamma).unwrap(), load(&path).unwrap());
    save(&picture(4, 3), &path, &SaveOptions::default()).unwrap();
    assert_eq!(load_as(&path, Transfer::Gamma).unwrap(), load(&path).unwrap());
}

#[test]
fn byte_images_keep_their_bytes() {
    let folder = folder();
    let path = folder.path().join("rate.png");
    let pixels: Vec<[u8; 3]> = (0..12).map(|i| [i, 255 - i, 7 * i]).collect();
    save_rgb8(&path, 4, 3, &pixels).unwrap();
    let mut reader = png::Decoder::new(Cursor::new(fs::read(&path).unwrap())).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut data).unwrap();
    assert_eq!(data, pixels.as_flattened());
    assert!(matches!(save_rgb8(&path, 4, 4, &pixels), Err(ImageError::Refused { .. })));
}

/// Creates a PNG file of a colour type.
fn png_of(color: png::ColorType, depth: png::BitDepth, size: (u32, u32), data: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    let mut encoder = png::Encoder::new(&mut out, size.0, size.1);
    encoder.set_color(color);
    encoder.set_depth(depth);
    if color == png::ColorType::Indexed {
        encoder.set_palette(vec![255, 0, 0, 0, 0, 255]);
    }
    encoder.write_header().unwrap().write_image_data(data).unwrap();
    out
}

#[test]
fn other_kinds_of_png_are_read() {
    use png::{BitDepth as Depth, ColorType};
    let folder = folder();
    let path = folder.path().join("a.png");
    let (white, red, blue) = ([1.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
    let cases = [
        (ColorType::Grayscale, Depth::One, vec![0b0100_0000], [[0.0; 3], white]),
        (ColorType::Grayscale, Depth::Sixteen, vec![255, 255, 0, 0], [white, [0.0; 3]]),
        (ColorType::GrayscaleAlpha, Depth::Eight, vec![255, 9, 0, 0], [white, [0.0; 3]]),
        (ColorType::Rgba, Depth::Eight, vec![255, 0, 0, 1, 0, 0, 255, 2], [red, blue]),
        (ColorType::Indexed, Depth::One, vec![0b0100_0000], [red, blue]),
    ];
    for (color, depth, data, expected) in cases {
        fs::write(&path, png_of(color, depth, (2, 1), &data)).unwrap();
        assert_eq!(load(&path).unwrap().pixels, expected, "{color:?} {depth:?}");
    }
}

/// Name and channels of a part of an EXR file.
type Part<'a> = (Option<&'a str>, &'a [(&'a str, f32)]);

/// Creates an EXR file with parts of (name, channels), where each channel is constant.
fn exr_of(parts: &[Part<'_>]) -> Vec<u8> {
    use exr::prelude::*;
    let layers = parts.iter().map(|(name, channels)| {
        let list = channels.iter().map(|&(name, value)| {
            let samples = FlatSamples::F16(vec![f16::from_f32(value); 6]);
            AnyChannel::new(name, samples)
        });
        let attributes = LayerAttributes { layer_name: name.map(Text::from), ..Default::default() };
        Layer::new((3, 2), attributes, Encoding::UNCOMPRESSED, AnyChannels::sort(list.collect()))
    });
    let attributes = ImageAttributes::with_size((3, 2));
    let mut out = Cursor::new(Vec::new());
    let image = Image::from_layers(attributes, layers.collect::<Layers<_>>());
    image.write().non_parallel().to_buffered(&mut out).unwrap();
    out.into_inner()
}

#[test]
fn exr_channels_are_found_by_name() {
    let folder = folder();
    let path = folder.path().join("a.exr");
    let rgb: &[_] = &[("R", 0.25), ("G", 0.5), ("B", 0.75)];
    let with_alpha: &[_] = &[("A", 9.0), ("B", 0.75), ("G", 0.5), ("R", 0.25), ("Z", 8.0)];
    let prefixed: &[_] = &[("Z", 8.0), ("sun.B", 0.75), ("sun.G", 0.5), ("sun.R", 0.25)];
    let other: &[_] = &[("R", 4.0), ("G", 5.0), ("B", 6.0)];
    let cases: [(&[_], _); 5] = [
        (&[(None, rgb)], [0.25, 0.5, 0.75]),
        (&[(None, with_alpha)], [0.25, 0.5, 0.75]),
        (&[(None, prefixed)], [0.25, 0.5, 0.75]),
        (&[(None, &[("Y", 0.125)])], [0.125; 3]),
        (
            &[(Some("depth"), &[("Z", 1.0)]), (Some("a"), rgb), (Some("b"), other)],
            [0.25, 0.5, 0.75],
        ),
    ];
    for (parts, expected) in cases {
        fs::write(&path, exr_of(parts)).unwrap();
        let image = load(&path).unwrap();
        assert_eq!((image.width, image.height), (3, 2));
        assert_eq!(image.pixels, [expected; 6], "{parts:?}");
    }
    fs::write(&path, exr_of(&[(None, &[("Z", 1.0)])])).unwrap();
    let message = load(&path).unwrap_err().to_string();
    assert!(message.contains("a.exr") && message.contains("found Z"), "{message}");
}

/// Files of other programs: path below the shared folder, width, height, and the mean of all
/// channels as other programs read it (OpenEXR's own library; Pillow and the sRGB curve).
const FOREIGN: [(&str, u32, u32, f64); 5] = [
    ("scenes/mitsuba/common/textures/museum.exr", 512, 256, 0.330_511), // half, PIZ
    ("scenes/pbrt/spheres.exr", 384, 192, 0.256_58),                    // half, ZIP
    ("bench/out/ref_cornell_blob_512_d6.exr", 512, 512, 0.136_728),     // float, ZIP
    ("reference/cs184/bunny_m5.png", 480, 360, 0.346_976),
    ("scenes/mitsuba/common/textures/leaf_mask.png", 239, 241, 0.443_935), // grey and alpha
];

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn files_of_other_programs_are_read() {
    let shared = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared"));
    for (name, width, height, mean) in FOREIGN {
        let path = shared.join(name);
        let image = load(&path).unwrap();
        assert_eq!((image.width, image.height), (width, height), "{name}");
        let light = image.pixels.as_flattened();
        let sum: f64 = light.iter().map(|&l| f64::from(l)).sum();
        assert!(
            (sum / light.len() as f64 - mean).abs() < 1e-6,
            "{name}: {}",
            sum / light.len() as f64
        );
    }
}

/// Returns valid files to damage: (name, bytes).
fn valid_files() -> Vec<(&'static str, Vec<u8>)> {
    let folder = folder();
    let bytes_of = |name: &str, options: &SaveOptions| {
        let path = folder.path().join(name);
        save(&picture(16, 16), &path, options).unwrap();
        fs::read(path).unwrap()
    };
    let sixteen = SaveOptions {
        png_bits: BitDepth::Sixteen,
        metadata: metadata::texts(),
        ..Default::default()
    };
    vec![
        ("8.png", bytes_of("8.png", &SaveOptions::default())),
        ("16.png", bytes_of("16.png", &sixteen)),
        ("zip.exr", bytes_of("zip.exr", &sixteen)),
        (
            "parts.exr",
            exr_of(&[
                (Some("a"), &[("R", 1.0), ("G", 2.0), ("B", 3.0)]),
                (Some("b"), &[("Y", 1.0)]),
            ]),
        ),
    ]
}

#[test]
fn every_prefix_of_a_file_is_refused_with_its_name() {
    without_panics(|| {
        for (name, bytes) in valid_files() {
            for length in 0..bytes.len() {
                let error = decode(&bytes[..length], Path::new(name), Transfer::Srgb)
                    .expect_err(&format!("{name} cut to {length} bytes"));
                assert!(error.to_string().contains(name), "{error}");
            }
        }
    });
}

#[test]
fn damaged_files_give_an_error_or_an_image_of_their_size() {
    without_panics(|| {
        let mut random = 1u32;
        let mut next = move || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as usize
        };
        for (name, bytes) in valid_files() {
            for _ in 0..5000 {
                let mut damaged = bytes.clone();
                for _ in 0..=next() % 4 {
                    // Half of the damage is in the headers.
                    let range = if next() % 2 == 0 { bytes.len().min(400) } else { bytes.len() };
                    damaged[next() % range] = next() as u8;
                }
                if let Ok(image) = decode(&damaged, Path::new(name), Transfer::Srgb) {
                    let count = u64::from(image.width) * u64::from(image.height);
                    assert_eq!(count, image.pixels.len() as u64);
                }
                if let Ok(file) = decode_file(&damaged, Path::new(name)) {
                    let count = file.image.pixels.len();
                    let channels = &file.options.channels;
                    assert!(channels.iter().all(|channel| channel.samples.count() == count));
                }
            }
        }
    });
}

#[test]
fn small_files_that_claim_to_be_huge_are_refused() {
    let folder = folder();
    let path = folder.path().join("bomb.png");
    let mut bytes = png_of(png::ColorType::Rgb, png::BitDepth::Eight, (1, 1), &[1, 2, 3]);
    // Width and height, and the matching checksum of the header.
    bytes[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    let checksum = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    fs::write(&path, &bytes).unwrap();
    let message = load(&path).unwrap_err().to_string();
    assert!(message.contains("1 GiB"), "{message}");
}

#[test]
fn exr_windows_that_claim_to_be_huge_are_refused() {
    let folder = folder();
    let path = folder.path().join("bomb.exr");
    let bytes = exr_of(&[(None, &[("R", 1.0), ("G", 2.0), ("B", 3.0)])]);
    for (side, reason) in [(8_000i32, "declares"), (60_000, "1 GiB")] {
        let mut bytes = bytes.clone();
        for window in ["dataWindow\0box2i\0", "displayWindow\0box2i\0"] {
            let at = bytes.windows(window.len()).position(|w| w == window.as_bytes()).unwrap();
            // After the size of the attribute: minimum x and y, then the maximum.
            let greatest = at + window.len() + 4 + 8;
            bytes[greatest..greatest + 4].copy_from_slice(&(side - 1).to_le_bytes());
            bytes[greatest + 4..greatest + 8].copy_from_slice(&(side - 1).to_le_bytes());
        }
        fs::write(&path, &bytes).unwrap();
        let message = load(&path).unwrap_err().to_string();
        assert!(message.contains(reason), "{message}");
    }
}

/// Returns the checksum of a PNG chunk. [PNG specification, 3rd ed., annex D]
fn crc32(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 0 { crc >> 1 } else { (crc >> 1) ^ 0xedb8_8320 };
    !bytes.iter().fold(!0, |crc, &b| (0..8).fold(crc ^ u32::from(b), step))
}

/// Returns the names in a folder.
fn names(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let folder = folder();
    let path = folder.path().join("a.png");
    save(&picture(4, 3), &path, &SaveOptions::default()).unwrap();
    let old = fs::read(&path).unwrap();
    let broken = Image { width: 4, height: 3, pixels: vec![[0.0; 3]; 11].into() };
    assert!(save(&broken, &path, &SaveOptions::default()).is_err());
    assert_eq!(fs::read(&path).unwrap(), old);
    save(&picture(5, 3), &path, &SaveOptions::default()).unwrap();
    assert_eq!(load(&path).unwrap().width, 5);
    assert_eq!(names(folder.path()), [path]);
}

#[test]
fn places_that_cannot_be_written_are_named() {
    let folder = folder();
    let missing = folder.path().join("no such folder");
    let error = write_atomically(&missing.join("a.png"), b"x").unwrap_err();
    assert!(matches!(error, WriteError::Folder { .. }));
    assert!(error.to_string().contains("no such folder"), "{error}");
    let error = write_atomically(folder.path(), b"x").unwrap_err().to_string();
    assert!(error.contains("it is a folder"), "{error}");
    assert!(names(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn new_files_have_ordinary_permissions_and_links_are_followed() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let folder = folder();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode();
    let (ordinary, ours) = (folder.path().join("ordinary"), folder.path().join("ours"));
    fs::write(&ordinary, b"x").unwrap();
    write_atomically(&ours, b"x").unwrap();
    assert_eq!(mode(&ours), mode(&ordinary));
    let link = folder.path().join("link");
    symlink(&ours, &link).unwrap();
    write_atomically(&link, b"through").unwrap();
    assert_eq!(fs::read(&ours).unwrap(), b"through");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    write_atomically(Path::new("/dev/null"), b"gone").unwrap();
}

#[test]
fn unknown_endings_and_missing_files_are_named() {
    let folder = folder();
    let path = folder.path().join("a.bmp");
    let message = save(&picture(2, 2), &path, &SaveOptions::default()).unwrap_err().to_string();
    assert!(message.contains("a.bmp") && message.contains(".png, .exr"), "{message}");
    let message = load(&folder.path().join("none.PNG")).unwrap_err().to_string();
    assert!(message.contains("none.PNG: cannot be read"), "{message}");
    let empty = Image { width: 0, height: 3, pixels: Vec::new().into() };
    assert!(save(&empty, &folder.path().join("a.png"), &SaveOptions::default()).is_err());
}
