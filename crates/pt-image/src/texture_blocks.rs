//! Files with GPU texture formats: DDS, KTX 2.0 and Basis Universal. Of arrays, cubes, volumes and
//! mipmaps, the first and largest image is read. [Microsoft, "DDS_HEADER"; Khronos, "KTX File
//! Format Specification 2.0"; Binomial, ".basis File Format and ETC1S Texture Video Specification"]

use std::io::{Cursor, Read};

use basisu::{DecodeFlags, SourceFormat, TargetFormat, Transcoder};
use image_dds::ddsfile::{Dds, DxgiFormat, PixelFormat, PixelFormatFlags};
use image_dds::{ImageFormat, Surface};
use ktx2::{Format, SupercompressionScheme, TransferFunction};
use pt_io::guarded;
use pt_math::color::linear_from_srgb;
use pt_memory::Grant;
use pt_scene::image::Image;

use super::{Codec, Decoded, ImageMemory, PixelEncoding, check_size};

pub(super) const DDS: Codec = Codec {
    name: "DDS",
    extensions: &["dds"],
    read: Some(read_dds),
    read_all: None,
    write: None,
    metadata: None,
};

pub(super) const KTX2: Codec = Codec {
    name: "KTX 2.0",
    extensions: &["ktx2"],
    read: Some(read_ktx2),
    read_all: None,
    write: None,
    metadata: None,
};

pub(super) const BASIS: Codec = Codec {
    name: "Basis Universal",
    extensions: &["basis"],
    read: Some(read_basis),
    read_all: None,
    write: None,
    metadata: None,
};

/// Transfer function of integers.
#[derive(Clone, Copy, PartialEq, Eq)]
enum IntegerTransfer {
    Srgb,
    Linear,
}

/// See [`super::PixelDecoder`]. Integers are decoded as sRGB even if the file has the linear
/// variant of the format, since most programs write that for colours.
fn read_dds(bytes: &[u8], numbers: PixelEncoding, room: &ImageMemory) -> Result<Decoded, String> {
    let dds = Dds::read(Cursor::new(bytes))
        .map_err(|error| format!("is not a valid DDS file: {error}"))?;
    let size = [dds.header.width, dds.header.height];
    check_pixels(size)?;
    if dds.header10.is_none() && dds.header.spf.fourcc.is_none() {
        let pixels = by_masks(&dds.header.spf, size, &dds.data)?;
        return decoded(
            size,
            ImageFormat::Rgba8Unorm,
            &pixels,
            (IntegerTransfer::Srgb, numbers),
            room,
        );
    }
    let format = match dds.get_dxgi_format().and_then(of_no_type) {
        Some(format) => format,
        None => image_dds::dds_image_format(&dds).map_err(|error| {
            format!(
                "has an unsupported pixel format ({error:?}); save it as BC1 to BC7, RGBA or PNG"
            )
        })?,
    };
    decoded(size, format, &dds.data, (IntegerTransfer::Srgb, numbers), room)
}

/// Returns the format of a typeless block format.
fn of_no_type(format: DxgiFormat) -> Option<ImageFormat> {
    Some(match format {
        DxgiFormat::BC1_Typeless => ImageFormat::BC1RgbaUnorm,
        DxgiFormat::BC2_Typeless => ImageFormat::BC2RgbaUnorm,
        DxgiFormat::BC3_Typeless => ImageFormat::BC3RgbaUnorm,
        DxgiFormat::BC4_Typeless => ImageFormat::BC4RUnorm,
        DxgiFormat::BC5_Typeless => ImageFormat::BC5RgUnorm,
        DxgiFormat::BC6H_Typeless => ImageFormat::BC6hRgbUfloat,
        DxgiFormat::BC7_Typeless => ImageFormat::BC7RgbaUnorm,
        DxgiFormat::R8G8B8A8_Typeless => ImageFormat::Rgba8Unorm,
        DxgiFormat::B8G8R8A8_Typeless => ImageFormat::Bgra8Unorm,
        _ => return None,
    })
}

/// Decodes pixels of up to 32 bits with channel masks to 8 bits of red, green, blue and alpha.
fn by_masks(form: &PixelFormat, [width, height]: [u32; 2], data: &[u8]) -> Result<Vec<u8>, String> {
    let is_grey = form.flags.contains(PixelFormatFlags::LUMINANCE);
    let bits = form.rgb_bit_count.unwrap_or(0);
    if !matches!(bits, 8 | 16 | 24 | 32) || !(is_grey || form.flags.contains(PixelFormatFlags::RGB))
    {
        return Err(
            "has an unsupported pixel format; save it as BC1 to BC7, RGBA or PNG".to_owned()
        );
    }
    let mask = |mask: Option<u32>| mask.unwrap_or(0);
    let (r, a) = (mask(form.r_bit_mask), mask(form.a_bit_mask));
    let [g, b] = if is_grey { [r; 2] } else { [form.g_bit_mask, form.b_bit_mask].map(mask) };
    let size = bits as usize / 8;
    let (count, length) = (width as usize * height as usize, data.len());
    if data.len() < count * size {
        return Err(format!(
            "is truncated: found {length} bytes of pixels, expected {}",
            count * size
        ));
    }
    let has_alpha = form.flags.contains(PixelFormatFlags::ALPHA_PIXELS) && a != 0;
    let pixel = |bytes: &[u8]| {
        let word = bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
        let level = |mask: u32| {
            let shift = mask.trailing_zeros().min(31);
            let (value, most) = (u64::from(word & mask) >> shift, u64::from(mask) >> shift);
            (255 * value + most / 2).checked_div(most).unwrap_or(0) as u8
        };
        [level(r), level(g), level(b), if has_alpha { level(a) } else { 255 }]
    };
    Ok(data.chunks_exact(size).take(count).flat_map(pixel).collect())
}

/// See [`super::PixelDecoder`]. The transfer function is that of the file.
fn read_ktx2(bytes: &[u8], numbers: PixelEncoding, room: &ImageMemory) -> Result<Decoded, String> {
    let invalid = |why: String| format!("is not a valid KTX 2.0 file: {why}");
    check_texel_block(bytes).map_err(invalid)?;
    let reader = ktx2::Reader::new(bytes).map_err(|error| invalid(error.to_string()))?;
    let header = reader.header();
    let size = [header.pixel_width, header.pixel_height.max(1)];
    let most = check_pixels(size)?;
    let curve = match reader.transfer_function() {
        Some(TransferFunction::Linear) => IntegerTransfer::Linear,
        _ => IntegerTransfer::Srgb,
    };
    let level = reader.levels().next().ok_or_else(|| invalid("it has no image".to_owned()))?;
    if level.uncompressed_byte_length > most {
        let found = level.uncompressed_byte_length;
        return Err(invalid(format!("found an image of {found} bytes, expected at most {most}")));
    }
    let Some(format) = header.format.and_then(image_format) else {
        return transcoded(bytes, (curve, numbers), room);
    };
    match header.supercompression_scheme {
        None => decoded(size, format, level.data, (curve, numbers), room),
        Some(SupercompressionScheme::Zstandard) => {
            let stream = ruzstd::StreamingDecoder::new(level.data);
            let stream = stream.map_err(|error| invalid(error.to_string()))?;
            let data = unpacked(stream, level.uncompressed_byte_length).map_err(invalid)?;
            decoded(size, format, &data, (curve, numbers), room)
        }
        Some(SupercompressionScheme::ZLIB) => {
            let stream = flate2::read::ZlibDecoder::new(level.data);
            let data = unpacked(stream, level.uncompressed_byte_length).map_err(invalid)?;
            decoded(size, format, &data, (curve, numbers), room)
        }
        Some(other) => Err(format!("has an unsupported compression ({})", other.value())),
    }
}

/// Rejects texel blocks with a side of 256 texels, at which the crate `ktx2` fails.
fn check_texel_block(bytes: &[u8]) -> Result<(), String> {
    /// Offset of the offset of the data format descriptor in the file, and offset of the block size
    /// in the descriptor.
    const PLACE: usize = 48;
    const BLOCK: usize = 16;
    let place = bytes
        .get(PLACE..PLACE + 4)
        .and_then(|place| Some(u32::from_le_bytes(place.try_into().ok()?)));
    let block = place.and_then(|place| bytes.get((place as usize).checked_add(BLOCK)?..)?.get(..4));
    match block {
        Some(block) if !block.contains(&u8::MAX) => Ok(()),
        _ => Err("damaged data format descriptor".to_owned()),
    }
}

/// Reads at most this number of bytes of a stream.
fn unpacked(stream: impl Read, length: u64) -> Result<Vec<u8>, String> {
    let mut data = Vec::new();
    stream.take(length).read_to_end(&mut data).map_err(|error| error.to_string())?;
    Ok(data)
}

/// See [`super::PixelDecoder`]. The files do not specify a transfer function; it is assumed to be
/// sRGB.
fn read_basis(bytes: &[u8], numbers: PixelEncoding, room: &ImageMemory) -> Result<Decoded, String> {
    if has_wrong_slices(bytes) {
        return Err(
            "has a slice whose number of blocks does not match its size: the file is damaged"
                .to_owned(),
        );
    }
    transcoded(bytes, (IntegerTransfer::Srgb, numbers), room)
}

/// Returns true if a slice of a Basis Universal file has no blocks, by which basisu 0.1 divides, or
/// more than one for 4 × 4 texels. Slice descriptions have 23 bytes, of which four are the width
/// and height and four the numbers of blocks; their number and position are in the header.
fn has_wrong_slices(bytes: &[u8]) -> bool {
    const COUNT: usize = 14;
    const PLACE: usize = 65;
    const SIZE: usize = 23;
    const NUMBERS: std::ops::Range<usize> = 5..13;
    let (Some([a, b, c]), Some(place)) =
        (bytes.get(COUNT..).and_then(|rest| rest.first_chunk()), bytes.get(PLACE..PLACE + 4))
    else {
        return false;
    };
    let count = u32::from_le_bytes([*a, *b, *c, 0]) as usize;
    let place = place.iter().rev().fold(0, |place, byte| place << 8 | usize::from(*byte));
    let slices = bytes.get(place..).unwrap_or_default().chunks_exact(SIZE).take(count);
    let mut numbers = slices.map(|slice| {
        let words = slice[NUMBERS].as_chunks().0;
        [0, 1, 2, 3].map(|i: usize| u16::from_le_bytes(words[i]))
    });
    let is_wrong = |texels: u16, blocks: u16| blocks == 0 || blocks > texels.div_ceil(4);
    numbers.any(|[width, height, x, y]| is_wrong(width, x) || is_wrong(height, y))
}

/// Decodes an image in Basis Universal or ASTC, in either container.
fn transcoded(
    bytes: &[u8],
    (curve, numbers): (IntegerTransfer, PixelEncoding),
    room: &ImageMemory,
) -> Result<Decoded, String> {
    let invalid = |error: basisu::Error| format!("has no readable image: {error:?}");
    let transcode = || -> Result<_, String> {
        let texture = Transcoder::new(bytes).map_err(invalid)?;
        let (width, height) = texture.base_dimensions();
        let (target, format) = match texture.source_format() {
            SourceFormat::UastcHdr4x4 | SourceFormat::UastcHdr6x6 | SourceFormat::AstcHdr6x6 => {
                (TargetFormat::RgbaHalf, ImageFormat::Rgba16Float)
            }
            _ => (TargetFormat::Rgba32, ImageFormat::Rgba8Unorm),
        };
        let _grant = ask_for([width, height], room)?;
        let data = texture.transcode_image(0, 0, 0, target, DecodeFlags::NONE).map_err(invalid)?;
        Ok(([width, height], format, data))
    };
    // basisu 0.1 panics at some damaged files.
    let transcoded = guarded("Basis Universal", transcode)
        .map_err(|_| "has no readable image: the file is damaged".to_owned())?;
    let (size, format, data) = transcoded?;
    decoded(size, format, &data, (curve, numbers), room)
}

/// Returns the bytes of an image in single precision, after a check of its size.
fn check_pixels([width, height]: [u32; 2]) -> Result<u64, String> {
    let bytes = u64::from(width).saturating_mul(u64::from(height)).saturating_mul(16);
    check_size(Some(bytes), usize::MAX)?;
    Ok(bytes.max(1024))
}

/// Reserves the memory of an image.
fn ask_for(size: [u32; 2], room: &ImageMemory) -> Result<Grant, String> {
    room.ask(Some(check_pixels(size)?))
}

/// Decodes an image in a GPU texture format.
fn decoded(
    size: [u32; 2],
    format: ImageFormat,
    data: &[u8],
    (curve, numbers): (IntegerTransfer, PixelEncoding),
    room: &ImageMemory,
) -> Result<Decoded, String> {
    let _grant = ask_for(size, room)?;
    let [width, height] = size;
    let surface =
        Surface { width, height, depth: 1, layers: 1, mipmaps: 1, image_format: format, data };
    let pixels = surface.decode_rgbaf32().map_err(|error| format!("is damaged: {error}"))?.data;
    let kind = BlockValues::of(format);
    let light = |share: f32| match (numbers, curve) {
        (PixelEncoding::Light(_), IntegerTransfer::Srgb) if !kind.is_real => {
            linear_from_srgb(share)
        }
        _ => share,
    };
    let color = |[r, g, b, _]: [f32; 4]| {
        let [r, g, b] =
            if kind.is_signed { [r, g, b].map(|share| 0.5 * share + 0.5) } else { [r, g, b] };
        match (kind.channels, numbers) {
            (1, _) => [light(r); 3],
            (2, PixelEncoding::Stored) => [r, g, third(r, g)],
            (2, PixelEncoding::Light(_)) => [light(r), light(g), 0.0],
            _ => [r, g, b].map(light),
        }
    };
    let pixels = pixels.as_chunks::<4>().0;
    let is_clear = kind.channels == 4 && pixels.iter().any(|[.., a]| *a < 1.0);
    let alpha = is_clear.then(|| pixels.iter().map(|[.., a]| *a).collect());
    let pixels: Vec<_> = pixels.iter().map(|pixel| color(*pixel)).collect();
    Image::check_size(width, height, pixels.len())?;
    Ok(Decoded { image: Image { width, height, pixels: pixels.into() }, alpha, frame: None })
}

/// Returns the z of a unit normal from its x and y, all encoded from 0 to 1.
fn third(r: f32, g: f32) -> f32 {
    let [x, y] = [2.0 * r - 1.0, 2.0 * g - 1.0];
    0.5 * (1.0 - x * x - y * y).max(0.0).sqrt() + 0.5
}

/// Properties of the values of a format.
struct BlockValues {
    channels: usize,
    is_real: bool,
    /// True if integers represent −1 to 1.
    is_signed: bool,
}

impl BlockValues {
    fn of(format: ImageFormat) -> Self {
        use ImageFormat as F;
        let channels = match format {
            F::R8Unorm
            | F::R8Snorm
            | F::R16Unorm
            | F::R16Snorm
            | F::R16Float
            | F::R32Float
            | F::BC4RUnorm
            | F::BC4RSnorm => 1,
            F::Rg8Unorm
            | F::Rg8Snorm
            | F::Rg16Unorm
            | F::Rg16Snorm
            | F::Rg16Float
            | F::Rg32Float
            | F::BC5RgUnorm
            | F::BC5RgSnorm => 2,
            F::Rgb32Float | F::Bgr8Unorm | F::BC6hRgbUfloat | F::BC6hRgbSfloat => 3,
            _ => 4,
        };
        let is_real = matches!(
            format,
            F::R16Float
                | F::R32Float
                | F::Rg16Float
                | F::Rg32Float
                | F::Rgb32Float
                | F::Rgba16Float
                | F::Rgba32Float
                | F::BC6hRgbUfloat
                | F::BC6hRgbSfloat
        );
        let is_signed = matches!(
            format,
            F::R8Snorm
                | F::Rg8Snorm
                | F::Rgba8Snorm
                | F::R16Snorm
                | F::Rg16Snorm
                | F::Rgba16Snorm
                | F::BC4RSnorm
                | F::BC5RgSnorm
        );
        Self { channels, is_real, is_signed }
    }
}

/// Returns the format of a Vulkan format number; `None` for Basis Universal and ASTC, and for
/// unsupported formats.
fn image_format(format: Format) -> Option<ImageFormat> {
    Some(match format {
        Format::BC1_RGB_UNORM_BLOCK | Format::BC1_RGBA_UNORM_BLOCK => ImageFormat::BC1RgbaUnorm,
        Format::BC1_RGB_SRGB_BLOCK | Format::BC1_RGBA_SRGB_BLOCK => ImageFormat::BC1RgbaUnormSrgb,
        Format::BC2_UNORM_BLOCK => ImageFormat::BC2RgbaUnorm,
        Format::BC2_SRGB_BLOCK => ImageFormat::BC2RgbaUnormSrgb,
        Format::BC3_UNORM_BLOCK => ImageFormat::BC3RgbaUnorm,
        Format::BC3_SRGB_BLOCK => ImageFormat::BC3RgbaUnormSrgb,
        Format::BC4_UNORM_BLOCK => ImageFormat::BC4RUnorm,
        Format::BC4_SNORM_BLOCK => ImageFormat::BC4RSnorm,
        Format::BC5_UNORM_BLOCK => ImageFormat::BC5RgUnorm,
        Format::BC5_SNORM_BLOCK => ImageFormat::BC5RgSnorm,
        Format::BC6H_UFLOAT_BLOCK => ImageFormat::BC6hRgbUfloat,
        Format::BC6H_SFLOAT_BLOCK => ImageFormat::BC6hRgbSfloat,
        Format::BC7_UNORM_BLOCK => ImageFormat::BC7RgbaUnorm,
        Format::BC7_SRGB_BLOCK => ImageFormat::BC7RgbaUnormSrgb,
        Format::R8_UNORM | Format::R8_SRGB => ImageFormat::R8Unorm,
        Format::R8G8_UNORM | Format::R8G8_SRGB => ImageFormat::Rg8Unorm,
        Format::R8G8B8A8_UNORM | Format::R8G8B8A8_SRGB => ImageFormat::Rgba8Unorm,
        Format::B8G8R8A8_UNORM | Format::B8G8R8A8_SRGB => ImageFormat::Bgra8Unorm,
        Format::B8G8R8_UNORM | Format::B8G8R8_SRGB => ImageFormat::Bgr8Unorm,
        Format::R16_UNORM => ImageFormat::R16Unorm,
        Format::R16G16_UNORM => ImageFormat::Rg16Unorm,
        Format::R16G16B16A16_UNORM => ImageFormat::Rgba16Unorm,
        Format::R16_SFLOAT => ImageFormat::R16Float,
        Format::R16G16_SFLOAT => ImageFormat::Rg16Float,
        Format::R16G16B16A16_SFLOAT => ImageFormat::Rgba16Float,
        Format::R32_SFLOAT => ImageFormat::R32Float,
        Format::R32G32_SFLOAT => ImageFormat::Rg32Float,
        Format::R32G32B32_SFLOAT => ImageFormat::Rgb32Float,
        Format::R32G32B32A32_SFLOAT => ImageFormat::Rgba32Float,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use std::path::{Path, PathBuf};

    use super::super::{Transfer, decode_as};
    use super::*;

    /// Two files found by fuzzing, at which the decoder panics: a length beyond the file, and a
    /// block that ends early.
    #[test]
    fn files_at_which_the_decoder_panics_are_damaged() {
        let folder: PathBuf =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/formats/images/damaged");
        for name in ["length.ktx2", "block.basis"] {
            let bytes = std::fs::read(folder.join(name)).expect("it is there");
            let error = decode_as(&bytes, Path::new(name), PixelEncoding::Light(Transfer::Srgb));
            let message = error.expect_err("it is damaged").to_string();
            assert!(message.contains(": the file is damaged"), "{message}");
        }
    }
}
