//! GPU texture formats: files that other programs wrote of one picture, and blocks made by hand.

use std::fs;
use std::path::{Path, PathBuf};

use pt_image::{Decoded, PixelEncoding, Transfer, decode_as};
use pt_math::color::linear_from_srgb;

const LIGHT: PixelEncoding = PixelEncoding::Light(Transfer::Srgb);

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/formats/images/blocks")
}

fn read(name: &str, numbers: PixelEncoding) -> Decoded {
    let path = folder().join(name);
    let bytes = fs::read(&path).expect("it is there");
    decode_as(&bytes, &path, numbers).unwrap_or_else(|error| panic!("{error}"))
}

/// Red, green, blue and alpha at a pixel of the picture in all files, from 0 to 1.
fn expected([width, height]: [f32; 2], [x, y]: [f32; 2]) -> [f32; 4] {
    let level = |x: f32| x.round_ties_even() / 255.0;
    [
        level(40.0 + 160.0 * x / (width - 1.0)),
        level(200.0 - 150.0 * y / (height - 1.0)),
        level(60.0 + 100.0 * (x + y) / (width + height - 2.0)),
        level(255.0 - 120.0 * x / (width - 1.0)),
    ]
}

/// Returns the mean differences of colour and of alpha.
fn differences(name: &str) -> [f32; 2] {
    let Decoded { image, alpha, .. } = read(name, PixelEncoding::Stored);
    let size = [image.width, image.height].map(|n| n as f32);
    let mut sums = [0.0_f32; 2];
    for (i, [r, g, b]) in image.pixels.iter().enumerate() {
        let (x, y) = (i % image.width as usize, i / image.width as usize);
        let wanted = expected(size, [x as f32, y as f32]);
        let found = [*r, *g, *b, alpha.as_ref().map_or(1.0, |alpha| alpha[i])];
        let by = |c: usize| (found[c] - wanted[c]).abs();
        sums[0] += (by(0) + by(1) + by(2)) / 3.0;
        sums[1] += by(3);
    }
    sums.map(|sum| sum / image.pixels.len() as f32)
}

/// Files of Pillow 13 (BC1 to BC3 and uncompressed ones; the alpha of BC2 is made by hand, since
/// that of Pillow is wrong), etcpak 0.9 (BC7) and Binomial's encoder (Basis Universal), in their
/// own containers; KTX 2.0 without Basis Universal is written by a script according to the
/// specification.
#[test]
fn textures_show_their_picture() {
    for (name, most, has_alpha) in [
        ("rgba.dds", 0.0, true),
        ("rgb.dds", 0.0, false),
        ("rgba_linear.ktx2", 0.0, true),
        ("bc1.dds", 0.06, false),
        ("bc2.dds", 0.06, true),
        ("bc3.dds", 0.06, true),
        ("bc7.dds", 0.04, true),
        ("odd_bc7.dds", 0.04, true),
        ("bc7.ktx2", 0.04, true),
        ("bc7_zstd.ktx2", 0.04, true),
        ("bc7_zlib.ktx2", 0.04, true),
        ("etc1s.ktx2", 0.1, true),
        ("basis.basis", 0.1, true),
        ("uastc.ktx2", 0.04, true),
        ("uastc_zstd.ktx2", 0.04, true),
        ("mip.ktx2", 0.04, true),
    ] {
        let [color, opacity] = differences(name);
        println!("{name}: {color:.4} {opacity:.4}");
        assert!(color <= most && (!has_alpha || opacity <= most), "{name}: {color} {opacity}");
        assert_eq!(read(name, LIGHT).alpha.is_some(), has_alpha, "{name}");
    }
}

#[test]
fn levels_are_light_by_what_the_file_says() {
    let [stored, light] = [PixelEncoding::Stored, LIGHT].map(|n| read("rgba.dds", n).image.pixels);
    for (stored, light) in stored.iter().zip(light) {
        assert_eq!(stored.map(linear_from_srgb), light);
    }
    let [stored, light] =
        [PixelEncoding::Stored, LIGHT].map(|n| read("linear.ktx2", n).image.pixels);
    assert_eq!(stored, light);
}

/// One channel is grey; for normals with two channels, the third gives them unit length.
#[test]
fn channels_that_are_missing_are_made() {
    let grey = read("grey.dds", PixelEncoding::Stored).image.pixels;
    assert!(grey.iter().all(|[r, g, b]| r == g && g == b));
    for [r, g, b] in read("bc5.dds", PixelEncoding::Stored).image.pixels {
        let [x, y, z] = [r, g, b].map(|share| 2.0 * share - 1.0);
        let length = x * x + y * y + z * z;
        let is_within = x * x + y * y < 1.0;
        assert!(if is_within { (length - 1.0).abs() < 1e-5 } else { z == 0.0 }, "{r} {g} {b}");
    }
}

/// Creates a DDS file of one block in a DXGI format.
fn dds_of_block(format: u32, block: [u8; 16]) -> Vec<u8> {
    let mut bytes = b"DDS ".to_vec();
    let header = [124, 0x8_1007, 4, 4, 16, 0, 1].into_iter().chain([0; 11]);
    let pixels = [32, 4, u32::from_le_bytes(*b"DX10"), 0, 0, 0, 0, 0];
    let caps = [0x1000, 0, 0, 0, 0];
    let more = [format, 3, 0, 1, 0];
    let words = header.chain(pixels).chain(caps).chain(more);
    bytes.extend(words.flat_map(u32::to_le_bytes));
    bytes.extend(block);
    bytes
}

/// A block of BC6H in mode 11 whose ends are both (256, 512, 768) of 1023: the end e represents the
/// half with the bits (((e · 2¹⁶ + 2¹⁵) / 2¹⁰) · 31) / 2⁶. [Microsoft, "BC6H Format"]
#[test]
fn real_blocks_are_light() {
    let ends = [256_u128, 512, 768];
    let mut block = 0b00011;
    for (i, end) in ends.iter().chain(&ends).enumerate() {
        block |= end << (5 + 10 * i);
    }
    let bytes = dds_of_block(95, block.to_le_bytes());
    for numbers in [PixelEncoding::Stored, LIGHT] {
        let found = decode_as(&bytes, Path::new("a.dds"), numbers).expect("a block").image;
        assert_eq!([found.width, found.height], [4, 4]);
        let expected = ends.map(|end| {
            let bits = ((((end << 16) + (1 << 15)) >> 10) * 31) >> 6;
            // A half with exponent e and mantissa m is 2^(e − 15) (1 + m / 1024).
            let (exponent, mantissa) = (bits >> 10, bits & 1023);
            2_f32.powi(exponent as i32 - 15) * (1.0 + mantissa as f32 / 1024.0)
        });
        assert!(found.pixels.iter().all(|pixel| *pixel == expected), "{:?}", found.pixels);
    }
}

#[test]
fn wrong_textures_are_refused_with_a_reason() {
    let refusal = |bytes: &[u8], name: &str| {
        decode_as(bytes, Path::new(name), LIGHT).expect_err("it is wrong").to_string()
    };
    assert!(refusal(b"DDS ", "a.dds").contains("is not a valid DDS file"));
    assert!(refusal(b"\xABKTX 20\xBB\r\n\x1A\n", "a.ktx2").contains("is not a valid KTX 2.0 file"));
    assert!(refusal(b"sB", "a.basis").contains("has no readable image"));
    assert!(refusal(&dds_of_block(3, [0; 16]), "a.dds").contains("pixel format"));
    let mut empty = fs::read(folder().join("basis.basis")).expect("it is there");
    let slices = u32::from_le_bytes([empty[65], empty[66], empty[67], empty[68]]) as usize;
    for blocks in [0_u16, 6000] {
        empty[slices + 9..slices + 11].copy_from_slice(&blocks.to_le_bytes());
        assert!(refusal(&empty, "a.basis").contains("number of blocks does not match its size"));
    }
    let mut huge = fs::read(folder().join("bc7.dds")).expect("it is there");
    huge[12..20].copy_from_slice(&[0xFF; 8]);
    assert!(refusal(&huge, "a.dds").contains("exceeds 1 GiB"));
    let mut huge = fs::read(folder().join("uastc.ktx2")).expect("it is there");
    huge[20..28].copy_from_slice(&[0xFF, 0xFF, 0, 0, 0xFF, 0xFF, 0, 0]);
    assert!(refusal(&huge, "a.ktx2").contains("exceeds 1 GiB"));
    // Uncompressed length.
    let mut bomb = fs::read(folder().join("uastc_zstd.ktx2")).expect("it is there");
    bomb[96..104].copy_from_slice(&(1_u64 << 40).to_le_bytes());
    assert!(refusal(&bomb, "a.ktx2").contains("found an image of 1099511627776 bytes"));
}

/// Files truncated at any position, and with each byte changed.
#[test]
fn damaged_textures_do_no_harm() {
    for entry in fs::read_dir(folder()).expect("it is there") {
        let path = entry.expect("it is there").path();
        let bytes = fs::read(&path).expect("it is there");
        for place in 0..bytes.len() {
            for value in [0, 1, 0x7F, 0x80, 0xFF] {
                let mut damaged = bytes.clone();
                damaged[place] = value;
                drop(decode_as(&damaged, &path, LIGHT));
            }
            drop(decode_as(&bytes[..place], &path, LIGHT));
        }
    }
}
