//! PNG files.

use std::fs::File;
use std::io::{BufReader, Cursor};

use png::{BitDepth as Depth, ColorType, Decoder, Encoder, Limits, Transformations};
use pt_math::trig::powf;
use pt_scene::image::Image;

use super::{BitDepth, Decoded, ImageMemory, PixelEncoding, SaveOptions, Transfer, check_size};

/// Maximum number of bytes of all texts of a file.
const TEXT_LIMIT: usize = 1 << 26;

/// Maximum number of bytes that the decoder may allocate.
const DECODER_LIMIT: usize = 1 << 30;

/// See [`super::PixelEncoder`]. Files in sRGB are tagged as such; other files have no tag.
pub(super) fn write(image: &Image, options: &SaveOptions) -> Result<Vec<u8>, String> {
    if let Some(channel) = options.channels.first() {
        return Err(format!("the channel {} is not representable in PNG", channel.name));
    }
    let transfer = options.transfer;
    let alphas = options.alpha.as_deref();
    let pixels = image.pixels.iter().enumerate().map(|(i, &rgb)| match alphas {
        Some(alphas) => (options.tone.map(straight(rgb, alphas[i])), Some(alphas[i])),
        None => (options.tone.map(rgb), None),
    });
    let (depth, data): (_, Vec<u8>) = match options.png_bits {
        BitDepth::Eight => {
            let levels = |(rgb, alpha): ([f32; 3], Option<f32>)| {
                let alpha = alpha.map(|alpha| level(alpha, 255.0) as u8);
                rgb.map(|l| transfer.encode8(l)).into_iter().chain(alpha)
            };
            (Depth::Eight, pixels.flat_map(levels).collect())
        }
        BitDepth::Sixteen => {
            let levels = |(rgb, alpha): ([f32; 3], Option<f32>)| {
                let alpha = alpha.map(|alpha| level(alpha, 65_535.0));
                rgb.map(|l| transfer.encode16(l)).into_iter().chain(alpha)
            };
            (Depth::Sixteen, pixels.flat_map(levels).flat_map(u16::to_be_bytes).collect())
        }
    };
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, image.width, image.height);
    encoder.set_color(if alphas.is_some() { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(depth);
    if transfer == Transfer::Srgb {
        encoder.set_source_srgb(png::SrgbRenderingIntent::RelativeColorimetric);
    }
    for (key, value) in &options.metadata {
        add_text(&mut encoder, key, value)?;
    }
    finish(encoder, &data)?;
    Ok(out)
}

/// Divides a premultiplied colour by its alpha; black where alpha is 0.
fn straight(rgb: [f32; 3], alpha: f32) -> [f32; 3] {
    if alpha > 0.0 { rgb.map(|v| v / alpha) } else { [0.0; 3] }
}

/// Returns the level nearest to a fraction of the highest one, clamped to the range.
fn level(share: f32, highest: f32) -> u16 {
    (highest * share + 0.5).min(highest) as u16
}

/// Encodes display-encoded pixels.
pub(super) fn write_bytes(width: u32, height: u32, pixels: &[[u8; 3]]) -> Result<Vec<u8>, String> {
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, width, height);
    encoder.set_color(ColorType::Rgb);
    finish(encoder, pixels.as_flattened())?;
    Ok(out)
}

/// Encodes values as the nearest levels, where 1 is the highest.
pub(super) fn write_stored(stored: &Decoded, bits: BitDepth) -> Result<Vec<u8>, String> {
    let Decoded { image, alpha, .. } = stored;
    let numbers = image.pixels.iter().enumerate().flat_map(|(i, [r, g, b])| {
        [Some(*r), Some(*g), Some(*b), alpha.as_ref().map(|alpha| alpha[i])].into_iter().flatten()
    });
    let (depth, data): (_, Vec<u8>) = match bits {
        BitDepth::Eight => (Depth::Eight, numbers.map(|x| level(x, 255.0) as u8).collect()),
        BitDepth::Sixteen => {
            (Depth::Sixteen, numbers.flat_map(|x| level(x, 65_535.0).to_be_bytes()).collect())
        }
    };
    let mut out = Vec::new();
    let mut encoder = Encoder::new(&mut out, image.width, image.height);
    encoder.set_color(if alpha.is_some() { ColorType::Rgba } else { ColorType::Rgb });
    encoder.set_depth(depth);
    finish(encoder, &data)?;
    Ok(out)
}

/// Writes the header and the data.
fn finish(encoder: Encoder<'_, &mut Vec<u8>>, data: &[u8]) -> Result<(), String> {
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(data).map_err(|e| e.to_string())?;
    writer.finish().map_err(|e| e.to_string())
}

/// Adds a `tEXt` chunk, or `iTXt` if the value has characters beyond Latin-1.
///
/// A keyword has 1 to 79 printable Latin-1 characters. [PNG specification, 3rd ed., §11.3.3.1]
fn add_text(encoder: &mut Encoder<'_, &mut Vec<u8>>, key: &str, value: &str) -> Result<(), String> {
    let length = key.chars().count();
    let printable = |c: char| matches!(c, ' '..='~' | '\u{a1}'..='\u{ff}');
    if !(1..=79).contains(&length) || !key.chars().all(printable) {
        return Err(format!(
            "invalid metadata key {key:?}: a PNG key has 1 to 79 Latin-1 characters"
        ));
    }
    if value.contains('\0') {
        return Err(format!("the value of the metadata key {key:?} contains a NUL character"));
    }
    let (key, text) = (key.to_owned(), value.to_owned());
    let added = if value.chars().all(|c| u32::from(c) < 256) {
        encoder.add_text_chunk(key, text)
    } else {
        encoder.add_itxt_chunk(key, text)
    };
    added.map_err(|e| e.to_string())
}

/// See [`super::PixelDecoder`]. Grey becomes three equal channels.
pub(super) fn read(
    bytes: &[u8],
    numbers: PixelEncoding,
    room: &ImageMemory,
) -> Result<Decoded, String> {
    let failed = |e: png::DecodingError| format!("is not a valid PNG file: {e}");
    let limits = Limits { bytes: DECODER_LIMIT };
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), limits);
    decoder.set_transformations(Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(failed)?;
    let info = reader.info();
    let (width, height, curve) = (info.width, info.height, LevelCurve::of(info, numbers));
    let packed = (u64::from(width) * info.bits_per_pixel() as u64).div_ceil(8);
    check_size(packed.checked_mul(u64::from(height)), bytes.len())?;
    let in_memory = match reader.output_color_type().0 {
        ColorType::GrayscaleAlpha | ColorType::Rgba => size_of::<[f32; 4]>(),
        _ => size_of::<[f32; 3]>(),
    };
    let _grant = room.ask((u64::from(width) * u64::from(height)).checked_mul(in_memory as u64))?;
    let size = reader.output_buffer_size().ok_or("is too large")?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(failed)?;
    reader.finish().map_err(failed)?;
    let pixels = decode(&data, frame.color_type, frame.bit_depth, curve)?;
    Image::check_size(width, height, pixels.len())?;
    let alpha = alpha(&data, frame.color_type, frame.bit_depth);
    Ok(Decoded { image: Image { width, height, pixels: pixels.into() }, alpha, frame: None })
}

/// See [`super::MetadataReader`]. Reads the chunks `tEXt` and `iTXt` before the pixels.
pub(super) fn metadata(file: BufReader<File>) -> Result<Vec<(String, String)>, String> {
    let failed = |e: png::DecodingError| format!("is not a valid PNG file: {e}");
    let limits = Limits { bytes: TEXT_LIMIT };
    let reader = Decoder::new_with_limits(file, limits).read_info().map_err(failed)?;
    let info = reader.info();
    let latin = info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone()));
    let others =
        info.utf8_text.iter().filter_map(|t| Some((t.keyword.clone(), t.get_text().ok()?)));
    Ok(latin.chain(others).collect())
}

/// Mapping from levels to values.
#[derive(Clone, Copy)]
enum LevelCurve {
    /// A named transfer function.
    Named(Transfer),
    /// L = vᵞ.
    Power(f32),
    /// The level divided by the highest one.
    Share,
}

impl LevelCurve {
    /// Returns the mapping for an encoding; for light, that of the `sRGB` and `gAMA` chunks, if
    /// there are any.
    fn of(info: &png::Info<'_>, numbers: PixelEncoding) -> Self {
        let PixelEncoding::Light(untagged) = numbers else { return Self::Share };
        if info.srgb.is_some() {
            return Self::Named(Transfer::Srgb);
        }
        match info.gama_chunk.map(png::ScaledFloat::into_value) {
            Some(g) if g > 0.0 => Self::Power(1.0 / g),
            _ => Self::Named(untagged),
        }
    }

    /// Decodes a level.
    fn decode(self, level: u16, highest: u16) -> f32 {
        match self {
            Self::Named(transfer) => transfer.decode(level, highest),
            Self::Power(gamma) => powf(f32::from(level) / f32::from(highest), gamma),
            Self::Share => f32::from(level) / f32::from(highest),
        }
    }
}

/// Converts samples to pixels.
fn decode(
    data: &[u8],
    color: ColorType,
    depth: Depth,
    curve: LevelCurve,
) -> Result<Vec<[f32; 3]>, String> {
    let rgb = match color {
        ColorType::Grayscale | ColorType::GrayscaleAlpha => [0, 0, 0],
        ColorType::Rgb | ColorType::Rgba => [0, 1, 2],
        ColorType::Indexed => return Err("has a palette that could not be expanded".to_owned()),
    };
    let samples = color.samples();
    let pixels = if depth == Depth::Sixteen {
        let table: Vec<f32> = (0..=u16::MAX).map(|v| curve.decode(v, u16::MAX)).collect();
        let light = |p: &[u8]| rgb.map(|c| table[usize::from(level16(p, c))]);
        data.chunks_exact(2 * samples).map(light).collect()
    } else {
        let table: Vec<f32> = (0..=255).map(|v| curve.decode(v, 255)).collect();
        data.chunks_exact(samples).map(|p| rgb.map(|c| table[usize::from(p[c])])).collect()
    };
    Ok(pixels)
}

/// Returns the level of a channel of a 16-bit pixel.
fn level16(pixel: &[u8], channel: usize) -> u16 {
    u16::from_be_bytes([pixel[2 * channel], pixel[2 * channel + 1]])
}

/// Returns the alpha channel as fractions of the highest level, or `None` if there is none.
fn alpha(data: &[u8], color: ColorType, depth: Depth) -> Option<Vec<f32>> {
    let last = match color {
        ColorType::GrayscaleAlpha | ColorType::Rgba => color.samples() - 1,
        _ => return None,
    };
    Some(if depth == Depth::Sixteen {
        let share = |p: &[u8]| f32::from(level16(p, last)) / f32::from(u16::MAX);
        data.chunks_exact(2 * (last + 1)).map(share).collect()
    } else {
        data.chunks_exact(last + 1).map(|p| f32::from(p[last]) / 255.0).collect()
    })
}
