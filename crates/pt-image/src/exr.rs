//! OpenEXR files.

mod subsampled;

use std::fs::File;
use std::io::{BufReader, Cursor};

use exr::block::chunk::{Chunk, CompressedBlock};
use exr::image::{FlatImage, FlatSamples};
use exr::meta::MetaData;
use exr::meta::attribute::Chromaticities;
use exr::meta::header::Header;
use exr::prelude::{
    AnyChannel, AnyChannels, AttributeValue, Compression as Method, Encoding, IntegerBounds, Layer,
    LayerAttributes, ReadChannels, ReadLayers, SmallVec, Text, Vec2, WritableImage, f16,
    read as exr_read,
};
use pt_math::color::LUMINANCE;
use pt_memory::Grant;
use pt_scene::image::{Channel, Image, Samples};

use super::{
    Compression, Decoded, DisplayWindow, ImageFile, ImageMemory, PixelEncoding, Precision,
    SaveOptions, check_size,
};

/// Primaries and white point of Rec. 709. [ITU-R BT.709]
const REC709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// See [`super::PixelEncoder`]. Writes one part in scan lines, with the channels B, G, R, A if
/// there is an alpha, and those of the options.
pub(super) fn write(image: &Image, options: &SaveOptions) -> Result<Vec<u8>, String> {
    let size = (image.width as usize, image.height as usize);
    let plane = |c: usize| real(image.pixels.iter().map(|p| p[c]), options.exr_type);
    let mut channels = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(c, name)| AnyChannel::new(name, plane(c)))
        .collect::<SmallVec<_>>();
    if let Some(alpha) = &options.alpha {
        channels.push(AnyChannel::new("A", real(alpha.iter().copied(), options.exr_type)));
    }
    for channel in &options.channels {
        channels.push(AnyChannel::new(
            channel_name(&channel.name, &channels)?,
            samples(channel, options.exr_type),
        ));
    }
    let channels = AnyChannels::sort(channels);
    let mut attributes = LayerAttributes::default();
    for (key, value) in &options.metadata {
        let (name, text) = attribute(key, value)?;
        attributes.other.insert(name, text);
    }
    let compression = method(options.exr_compression);
    let encoding = Encoding { compression, ..Encoding::SMALL_LOSSLESS };
    let layer = Layer::new(size, attributes, encoding, channels);
    let mut file = exr::image::Image::from_layer(layer);
    file.attributes.chromaticities = Some(REC709);
    let mut out = Cursor::new(Vec::new());
    file.write().non_parallel().to_buffered(&mut out).map_err(|e| e.to_string())?;
    let mut bytes = out.into_inner();
    sort_attributes(&mut bytes);
    Ok(bytes)
}

/// Checks that a channel name is valid and not taken.
fn channel_name(name: &str, taken: &[AnyChannel<FlatSamples>]) -> Result<Text, String> {
    let fits = |c: char| matches!(c, ' '..='~');
    let text = Text::new_or_none(name).filter(|_| !name.is_empty() && name.chars().all(fits));
    text.filter(|text| taken.iter().all(|channel| channel.name != *text)).ok_or_else(|| {
        format!(
            "invalid name {name:?} of a channel: duplicate, or other characters than those of \
             ASCII"
        )
    })
}

fn samples(channel: &Channel, precision: Precision) -> FlatSamples {
    let precision = if channel.half_suffices { precision } else { Precision::Float };
    match &channel.samples {
        Samples::Real(values) => real(values.iter().copied(), precision),
        Samples::Whole(values) => FlatSamples::U32(values.clone()),
    }
}

fn real(values: impl Iterator<Item = f32>, precision: Precision) -> FlatSamples {
    match precision {
        Precision::Float => FlatSamples::F32(values.collect()),
        Precision::Half => FlatSamples::F16(values.map(half).collect()),
    }
}

/// Largest finite 16-bit float.
const GREATEST_HALF: f32 = 65_504.0;

/// Returns the nearest 16-bit float; finite for finite values.
fn half(v: f32) -> f16 {
    let is_beyond = v.is_finite() && v.abs() > GREATEST_HALF;
    f16::from_f32(if is_beyond { GREATEST_HALF.copysign(v) } else { v })
}

/// See [`super::count_beyond_half`].
pub(super) fn count_beyond_half(image: &Image, options: &SaveOptions) -> usize {
    if options.exr_type == Precision::Float {
        return 0;
    }
    let narrow = options.channels.iter().filter(|channel| channel.half_suffices);
    let reals = narrow.filter_map(|channel| match &channel.samples {
        Samples::Real(values) => Some(values),
        Samples::Whole(_) => None,
    });
    let values = image.pixels.as_flattened().iter().chain(reals.flatten());
    values.filter(|v| v.is_finite() && v.abs() > GREATEST_HALF).count()
}

fn method(compression: Compression) -> Method {
    match compression {
        Compression::None => Method::Uncompressed,
        Compression::Rle => Method::RLE,
        Compression::Zips => Method::ZIP1,
        Compression::Zip => Method::ZIP16,
        Compression::Piz => Method::PIZ,
        Compression::Pxr24 => Method::PXR24,
        Compression::B44 => Method::B44,
        Compression::B44a => Method::B44A,
    }
}

/// Compression with which a file is written again; those that cannot be written become the default.
fn compression(method: Method) -> Compression {
    match method {
        Method::Uncompressed => Compression::None,
        Method::RLE => Compression::Rle,
        Method::ZIP1 => Compression::Zips,
        Method::PIZ => Compression::Piz,
        Method::PXR24 => Compression::Pxr24,
        Method::B44 => Compression::B44,
        Method::B44A => Compression::B44a,
        _ => Compression::Zip,
    }
}

/// Creates the name and value of a text attribute. The format stores bytes for both; they are UTF-8
/// here.
fn attribute(key: &str, value: &str) -> Result<(Text, AttributeValue), String> {
    if !(1..=255).contains(&key.len()) || key.contains('\0') {
        return Err(format!("invalid metadata key {key:?}: an EXR key has 1 to 255 bytes"));
    }
    let text = |s: &str| Text::from_slice_unchecked(s.as_bytes());
    Ok((text(key), AttributeValue::Text(text(value))))
}

/// Sorts the attributes of a single-part file by name, so that the same image always gives the same
/// bytes: the encoder takes them from a hash map.
///
/// After magic number and version, a header is a sequence of name, type (both end with a NUL), size
/// and value, and ends with a NUL. The order of attributes is unspecified. [OpenEXR File Layout]
fn sort_attributes(bytes: &mut [u8]) {
    const PREAMBLE: usize = 8;
    let mut attributes = Vec::new();
    let mut rest = bytes.get(PREAMBLE..).unwrap_or_default();
    while let Some(length) = attribute_length(rest) {
        let (attribute, after) = rest.split_at(length);
        attributes.push(attribute.to_vec());
        rest = after;
    }
    attributes.sort();
    let sorted = attributes.concat();
    bytes[PREAMBLE..PREAMBLE + sorted.len()].copy_from_slice(&sorted);
}

/// Returns the length in bytes of the attribute at the start of `header`; `None` at the end.
fn attribute_length(header: &[u8]) -> Option<usize> {
    let text = |at: usize| header.get(at..)?.iter().position(|&b| b == 0);
    let name = text(0).filter(|&length| length > 0)?;
    let size_at = name + 1 + text(name + 1)? + 1;
    let size: [u8; 4] = header.get(size_at..size_at + 4)?.try_into().ok()?;
    let length = size_at + 4 + u32::from_le_bytes(size) as usize;
    (length <= header.len()).then_some(length)
}

/// See [`super::PixelDecoder`]. Reads the half, float and integer channels R, G, B, or Y alone or
/// with RY and BY, and A beside them, of the unnamed part or otherwise of the first part that has
/// them; other channels are ignored. The values are linear light.
pub(super) fn read(bytes: &[u8], _: PixelEncoding, room: &ImageMemory) -> Result<Decoded, String> {
    let failed = |e: exr::error::Error| format!("is not a valid EXR file: {e}");
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(failed)?;
    if subsampled::is_of_this_kind(&meta) {
        return subsampled::read(bytes, meta, room);
    }
    let (file, _grant) = flat(bytes, &meta, room, bytes_in_memory)?;
    let part = color_part(&file)?;
    picture(&names(part), &planes(part), data_window(part), file.attributes.display_window)
}

/// See [`super::FileDecoder`]. Of files with subsampled channels, the colours and alpha only;
/// otherwise the channels of all parts with the data window of the colours. Channels of other parts
/// have the name of their part before theirs.
pub(super) fn read_all(bytes: &[u8], room: &ImageMemory) -> Result<ImageFile, String> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false)
        .map_err(|e| format!("is not a valid EXR file: {e}"))?;
    let metadata = texts(&meta)?;
    if subsampled::is_of_this_kind(&meta) {
        return Ok(ImageFile::new(subsampled::read(bytes, meta, room)?, metadata));
    }
    let in_memory = |header: &Header| bytes_in_memory(header) + header.channels.bytes_per_pixel;
    let (file, _grant) = flat(bytes, &meta, room, in_memory)?;
    let main = color_part(&file)?;
    let window = data_window(main);
    let decoded = picture(&names(main), &planes(main), window, file.attributes.display_window)?;
    let mut read = ImageFile::new(decoded, metadata);
    let is_half =
        |channel: &AnyChannel<FlatSamples>| matches!(channel.sample_data, FlatSamples::F16(_));
    let (colors, alpha) = color_channels(&names(main)).ok_or("has no colours")?;
    let list = &main.channel_data.list;
    if colors.channels().iter().all(|c| is_half(&list[*c])) {
        read.options.exr_type = Precision::Half;
    }
    read.options.exr_compression = compression(main.encoding.compression);
    let is_color = |index: usize| colors.channels().contains(&index) || alpha == Some(index);
    for part in file.layer_data.iter().filter(|part| data_window(part) == window) {
        let is_main = std::ptr::eq(part, main);
        for (index, channel) in part.channel_data.list.iter().enumerate() {
            if is_main && is_color(index) {
                continue;
            }
            read.options.channels.push(Channel {
                name: if is_main { channel.name.to_string() } else { full_name(part, channel) },
                samples: match &channel.sample_data {
                    FlatSamples::U32(values) => Samples::Whole(values.clone()),
                    values => Samples::Real(values.values_as_f32().collect()),
                },
                half_suffices: is_half(channel),
            });
        }
    }
    Ok(read)
}

/// Name of a channel with the name of its part before it.
fn full_name(part: &FlatPart, channel: &AnyChannel<FlatSamples>) -> String {
    let name = channel.name.to_string();
    match &part.attributes.layer_name {
        Some(layer) if !name.starts_with(&format!("{layer}.")) => format!("{layer}.{name}"),
        _ => name,
    }
}

/// A part of a file with its channels.
type FlatPart = Layer<AnyChannels<FlatSamples>>;

/// Reads all channels of a file without subsampling; `in_memory` is the number of bytes per pixel
/// of a part for which memory is reserved, as long as the grant is kept.
fn flat(
    bytes: &[u8],
    meta: &MetaData,
    room: &ImageMemory,
    in_memory: impl Fn(&Header) -> usize,
) -> Result<(FlatImage, Grant), String> {
    let failed = |e: exr::error::Error| format!("is not a valid EXR file: {e}");
    check_size(sum_of_pixels(meta, |header| header.channels.bytes_per_pixel), bytes.len())?;
    let grant = room.ask(sum_of_pixels(meta, in_memory))?;
    if meta.headers.iter().any(is_dwa) {
        check_blocks(bytes)?;
    }
    let file = exr_read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .non_parallel()
        .from_buffered(Cursor::new(bytes))
        .map_err(failed)?;
    Ok((file, grant))
}

/// Returns the unnamed part if it has colours, or otherwise the first part that has them.
fn color_part(file: &FlatImage) -> Result<&FlatPart, String> {
    let mut parts: Vec<_> = file.layer_data.iter().collect();
    parts.sort_by_key(|part| part.attributes.layer_name.is_some());
    let part = parts.iter().find(|part| color_channels(&names(part)).is_some());
    part.copied().ok_or_else(|| {
        let all: Vec<_> = parts.iter().flat_map(|part| names(part)).collect();
        format!("has no channels R, G, B and no Y; found {}", all.join(", "))
    })
}

fn names(part: &FlatPart) -> Vec<String> {
    part.channel_data.list.iter().map(|channel| channel.name.to_string()).collect()
}

fn planes(part: &FlatPart) -> Vec<&FlatSamples> {
    part.channel_data.list.iter().map(|channel| &channel.sample_data).collect()
}

fn data_window(part: &FlatPart) -> IntegerBounds {
    IntegerBounds::new(part.attributes.layer_position, part.size)
}

fn is_dwa(header: &Header) -> bool {
    matches!(header.compression, Method::DWAA(_) | Method::DWAB(_))
}

/// Rejects files with a DWA block that claims more values than possible.
fn check_blocks(bytes: &[u8]) -> Result<(), String> {
    let failed = |e: exr::error::Error| format!("is not a valid EXR file: {e}");
    let reader = exr::block::read(Cursor::new(bytes), false).map_err(failed)?;
    let headers = reader.headers().to_vec();
    for chunk in reader.all_chunks(false).map_err(failed)? {
        let Chunk { layer_index, compressed_block } = chunk.map_err(failed)?;
        let Some(header) = headers.get(layer_index).filter(|header| is_dwa(header)) else {
            continue;
        };
        let place = header.get_block_data_indices(&compressed_block);
        let place = place.and_then(|place| header.get_absolute_block_pixel_coordinates(place));
        let stored = place.map_err(failed)?.size.area() * header.channels.bytes_per_pixel;
        match &compressed_block {
            CompressedBlock::ScanLine(block) => {
                check_counts(header, &block.compressed_pixels_le, stored)?;
            }
            CompressedBlock::Tile(block) => {
                check_counts(header, &block.compressed_pixels_le, stored)?;
            }
            CompressedBlock::DeepScanLine(_) | CompressedBlock::DeepTile(_) => {}
        }
    }
    Ok(())
}

/// Rejects a DWA block whose counts request more memory than any such block needs, since the
/// library allocates what they state. Without compression, the block would have `stored` bytes.
///
/// The block begins with eleven 64-bit numbers: the version, sizes and counts of four sections, and
/// a kind of compression. A section has at most the values of all channels, padded to squares of 8
/// pixels, and codes twice as long.
fn check_counts(header: &Header, block: &[u8], stored: usize) -> Result<(), String> {
    /// Positions of sizes before compression, and of counts.
    const COUNTS: [usize; 5] = [1, 6, 7, 8, 9];
    let Vec2(width, height) = header.max_block_pixel_size();
    let squares = |n: usize| n.next_multiple_of(8) as u64;
    let numbers = squares(width) * squares(height) * header.channels.list.len() as u64;
    let most = 8 * numbers + 4096;
    let words = block.as_chunks().0;
    let count = |place: usize| words.get(place).map_or(0, |word| u64::from_le_bytes(*word));
    // Blocks that could not be compressed are stored raw.
    if block.len() == stored || COUNTS.iter().all(|place| count(*place) <= most) {
        return Ok(());
    }
    Err("has a block that declares more numbers than it has pixels".to_owned())
}

/// Assembles the image of a part from its channels, whose data window lies in a display window.
fn picture(
    names: &[String],
    planes: &[&FlatSamples],
    data: IntegerBounds,
    display: IntegerBounds,
) -> Result<Decoded, String> {
    let Some((colors, alpha)) = color_channels(names) else {
        return Err(format!("has no channels R, G, B and no Y; found {}", names.join(", ")));
    };
    let plane = |c: usize| planes[c];
    let mut decoded = assemble(data.size, colors.channels().map(plane), alpha.map(plane))?;
    if let Colors::Chroma(_) = colors {
        decoded.image.pixels.iter_mut().for_each(|pixel| *pixel = from_chroma(*pixel));
    }
    let offset = [(data.position.0, display.position.0), (data.position.1, display.position.1)]
        .map(|(data, display)| i64::from(data) - i64::from(display));
    if offset != [0; 2] || data.size != display.size {
        let side = |n: usize| u32::try_from(n).map_err(|_| "is too large".to_owned());
        let size = [side(display.size.0)?, side(display.size.1)?];
        decoded.frame = Some(DisplayWindow { offset, size });
    }
    Ok(decoded)
}

/// The colour channels of a part, by their indices.
#[derive(Clone, Copy)]
enum Colors {
    /// Red, green and blue.
    Rgb([usize; 3]),
    /// Luminance only.
    Grey(usize),
    /// RY, luminance and BY.
    Chroma([usize; 3]),
}

impl Colors {
    fn channels(self) -> [usize; 3] {
        match self {
            Self::Rgb(channels) | Self::Chroma(channels) => channels,
            Self::Grey(channel) => [channel; 3],
        }
    }
}

/// Converts RY = (R − Y) / Y, Y and BY = (B − Y) / Y to red, green and blue. [Kainz & Bogart,
/// "Technical Introduction to OpenEXR", section on luminance/chroma images]
fn from_chroma([ry, y, by]: [f32; 3]) -> [f32; 3] {
    let [weight_r, weight_g, weight_b] = LUMINANCE.map(|weight| weight as f32);
    let (r, b) = ((ry + 1.0) * y, (by + 1.0) * y);
    [r, (y - r * weight_r - b * weight_b) / weight_g, b]
}

/// See [`super::MetadataReader`]. Reads the text attributes of the first part.
pub(super) fn metadata(file: BufReader<File>) -> Result<Vec<(String, String)>, String> {
    let meta = MetaData::read_from_buffered(file, false)
        .map_err(|e| format!("is not a valid EXR file: {e}"))?;
    texts(&meta)
}

/// Returns the text attributes of the first part.
fn texts(meta: &MetaData) -> Result<Vec<(String, String)>, String> {
    let part = meta.headers.first().ok_or("has no parts")?;
    let attributes = part.own_attributes.other.iter().chain(&part.shared_attributes.other);
    let mut texts: Vec<_> = attributes
        .filter_map(|(key, value)| match value {
            AttributeValue::Text(text) => Some((utf8(key), utf8(text))),
            _ => None,
        })
        .collect();
    texts.sort();
    Ok(texts)
}

/// Decodes a text as UTF-8; invalid bytes become U+FFFD.
fn utf8(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

/// Returns the bytes per pixel of a part in memory, as `f32`.
fn bytes_in_memory(part: &Header) -> usize {
    let is_alpha = |name: &str| name.rsplit('.').next() == Some("A");
    let has_alpha = part.channels.list.iter().any(|c| is_alpha(&c.name.to_string()));
    if has_alpha { size_of::<[f32; 4]>() } else { size_of::<[f32; 3]>() }
}

/// Returns the bytes of all pixels of all parts; `None` beyond 2⁶⁴.
fn sum_of_pixels(meta: &MetaData, bytes_per_pixel: impl Fn(&Header) -> usize) -> Option<u64> {
    meta.headers.iter().try_fold(0u64, |sum, header| {
        let pixels = (header.layer_size.0 as u64).checked_mul(header.layer_size.1 as u64)?;
        sum.checked_add(pixels.checked_mul(bytes_per_pixel(header) as u64)?)
    })
}

/// Finds the colour channels of a part: R, G, B without a prefix; otherwise Y, perhaps with RY and
/// BY; otherwise those of the first prefix (a layer name and a dot) that has them; and A with the
/// same prefix.
fn color_channels(names: &[String]) -> Option<(Colors, Option<usize>)> {
    let position = |name: String| names.iter().position(|n| *n == name);
    let with_prefix = |prefix: &str| {
        let color = |c: &str| position(format!("{prefix}{c}"));
        let rgb = match (color("R"), color("G"), color("B"), color("Y")) {
            (Some(r), Some(g), Some(b), _) => Colors::Rgb([r, g, b]),
            (_, _, _, Some(y)) => match (color("RY"), color("BY")) {
                (Some(ry), Some(by)) => Colors::Chroma([ry, y, by]),
                _ => Colors::Grey(y),
            },
            _ => return None,
        };
        Some((rgb, color("A")))
    };
    let prefixes = names.iter().filter_map(|n| Some(&n[..=n.rfind('.')?]));
    std::iter::once("").chain(prefixes).find_map(with_prefix)
}

/// Interleaves three planes to pixels.
fn assemble(
    size: Vec2<usize>,
    rgb: [&FlatSamples; 3],
    alpha: Option<&FlatSamples>,
) -> Result<Decoded, String> {
    let side = |n: usize| u32::try_from(n).map_err(|_| "is too large".to_owned());
    let (width, height) = (side(size.0)?, side(size.1)?);
    for plane in rgb.into_iter().chain(alpha) {
        Image::check_size(width, height, plane.len())?;
    }
    let [r, g, b] = rgb.map(FlatSamples::values_as_f32);
    let pixels = r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
    let alpha = alpha.map(|plane| plane.values_as_f32().collect());
    Ok(Decoded { image: Image { width, height, pixels }, alpha, frame: None })
}
