//! EXR files with subsampled channels, such as luminance and chroma.
//!
//! The library that reads all other files does not assemble these, but it reads their headers and
//! decompresses their blocks, which are located and split here. [OpenEXR File Layout]

use exr::image::FlatSamples;
use exr::meta::attribute::SampleType;
use exr::meta::header::Header;
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{Compression as Method, IntegerBounds, Vec2, f16};

use super::super::{Decoded, ImageMemory, check_size};
use super::{attribute_length, bytes_in_memory, check_counts, is_dwa, picture};

/// Message for files with subsampling that is not supported.
const ADVICE: &str = "has subsampled channels, which are supported only in a single image in scan \
                      lines whose size is a multiple of the sampling rates; save it with all \
                      channels at full resolution";
/// Returns true if any channel of a file is subsampled.
pub(super) fn is_of_this_kind(meta: &MetaData) -> bool {
    meta.headers.iter().flat_map(|header| &header.channels.list).any(|c| c.sampling != Vec2(1, 1))
}

/// See [`super::read`].
pub(super) fn read(bytes: &[u8], meta: MetaData, room: &ImageMemory) -> Result<Decoded, String> {
    let [mut header] = <[Header; 1]>::try_from(meta.headers.into_vec()).map_err(|_| ADVICE)?;
    let (size, position) = (header.layer_size, header.own_attributes.layer_position);
    let divides = |n: usize, size: usize, position: i32| {
        n > 0 && size.is_multiple_of(n) && i64::from(position) % n as i64 == 0
    };
    let fits =
        |Vec2(x, y): Vec2<usize>| divides(x, size.0, position.0) && divides(y, size.1, position.1);
    let is_plain = header.blocks == BlockDescription::ScanLines && !header.deep;
    if !is_plain || !header.channels.list.iter().all(|channel| fits(channel.sampling)) {
        return Err(ADVICE.into());
    }
    // The library miscounts the values of these.
    if matches!(header.compression, Method::B44 | Method::B44A) {
        let message = "has subsampled channels with B44 compression, which is not supported; save \
                       it with another compression, or with all channels at full resolution";
        return Err(message.into());
    }
    let pixels = header.layer_size.area() as u64;
    let _grant = room.ask(pixels.checked_mul(bytes_in_memory(&header) as u64))?;
    let stored = header.channels.list.iter().map(|channel| {
        let pixels = header.layer_size.area() / channel.sampling.area();
        (pixels * channel.sample_type.bytes_per_sample()) as u64
    });
    check_size(Some(stored.sum()), bytes.len())?;
    let planes = planes(bytes, &mut header)?;
    let size = header.layer_size;
    let full = header.channels.list.iter().zip(planes).map(|(channel, plane)| {
        let plane = spread(&plane, size, channel.sampling);
        FlatSamples::F32(plane)
    });
    let full: Vec<_> = full.collect();
    let names: Vec<_> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let data = IntegerBounds::new(header.own_attributes.layer_position, size);
    let display = header.shared_attributes.display_window;
    picture(&names, &full.iter().collect::<Vec<_>>(), data, display)
}

fn incomplete() -> String {
    "ends early, or its block table is incomplete".to_owned()
}

/// Returns the end of the attributes in the header of a single-part file.
fn end_of_header(bytes: &[u8]) -> Option<usize> {
    /// Number of bytes before the attributes.
    const PREAMBLE: usize = 8;
    let mut at = PREAMBLE;
    while let Some(length) = attribute_length(bytes.get(at..)?) {
        at += length;
    }
    (bytes.get(at) == Some(&0)).then_some(at + 1)
}

/// Returns the first line of a block and its compressed bytes, by its entry in the offset table.
fn block(bytes: &[u8], entry: usize) -> Option<(i32, &[u8])> {
    let offset = u64::from_le_bytes(bytes.get(entry..)?.first_chunk().copied()?);
    let block = bytes.get(usize::try_from(offset).ok()?..)?;
    let (y, block) = block.split_first_chunk()?;
    let (size, data) = block.split_first_chunk()?;
    let size = usize::try_from(i32::from_le_bytes(*size)).ok()?;
    Some((i32::from_le_bytes(*y), data.get(..size)?))
}

/// Decompresses the samples of all channels.
fn planes(bytes: &[u8], header: &mut Header) -> Result<Vec<Vec<f32>>, String> {
    let Vec2(width, height) = header.layer_size;
    let Vec2(left, top) = header.own_attributes.layer_position;
    let channels = header.channels.list.clone();
    let pixels = |rate: Vec2<usize>| (width / rate.0) * (height / rate.1);
    let mut planes: Vec<_> = channels.iter().map(|c| vec![0.0; pixels(c.sampling)]).collect();
    let lines_of_block = header.compression.scan_lines_per_block();
    let table = end_of_header(bytes).ok_or_else(incomplete)?;
    for number in 0..header.chunk_count {
        let (y, data) = block(bytes, table + 8 * number).ok_or_else(incomplete)?;
        let first = usize::try_from(i64::from(y) - i64::from(top)).ok();
        let first = first.filter(|first| *first < height && first % lines_of_block == 0);
        let first = first.ok_or("has a block beyond the image")?;
        let lines = lines_of_block.min(height - first);
        let section = IntegerBounds::new(Vec2(left, y), Vec2(width, lines));
        let is_there = |line: usize, rate: Vec2<usize>| (first + line).is_multiple_of(rate.1);
        let mut expected = 0;
        for line in 0..lines {
            for channel in channels.iter().filter(|c| is_there(line, c.sampling)) {
                expected += width / channel.sampling.0 * channel.sample_type.bytes_per_sample();
            }
        }
        // The library computes the size of a block as its number of pixels times this number.
        let area = width * lines;
        if !expected.is_multiple_of(area) {
            return Err(ADVICE.into());
        }
        header.channels.bytes_per_pixel = expected / area;
        if is_dwa(header) {
            check_counts(header, data, expected)?;
        }
        let made = header.compression.decompress_image_section_from_le(
            header,
            data.to_vec(),
            section,
            false,
        );
        let made = made.map_err(|e| format!("is not a valid EXR file: {e}"))?;
        let mut rest = made.get(..expected).ok_or("has a block that ends early")?;
        for line in 0..lines {
            for (channel, plane) in channels.iter().zip(&mut planes) {
                if !is_there(line, channel.sampling) {
                    continue;
                }
                let columns = width / channel.sampling.0;
                let row = (first + line) / channel.sampling.1 * columns;
                let (own, more) = rest.split_at(columns * channel.sample_type.bytes_per_sample());
                rest = more;
                take(own, channel.sample_type, &mut plane[row..row + columns]);
            }
        }
    }
    Ok(planes)
}

/// Converts the samples of a line, which are in native byte order.
fn take(bytes: &[u8], kind: SampleType, to: &mut [f32]) {
    match kind {
        SampleType::F16 => {
            for (to, two) in to.iter_mut().zip(bytes.as_chunks().0) {
                *to = f16::from_ne_bytes(*two).to_f32();
            }
        }
        SampleType::F32 => {
            for (to, four) in to.iter_mut().zip(bytes.as_chunks().0) {
                *to = f32::from_ne_bytes(*four);
            }
        }
        SampleType::U32 => {
            for (to, four) in to.iter_mut().zip(bytes.as_chunks().0) {
                *to = u32::from_ne_bytes(*four) as f32;
            }
        }
    }
}

/// Upsamples a channel to all pixels: its samples are at the first pixels of their cells, with
/// linear interpolation in between.
fn spread(plane: &[f32], size: Vec2<usize>, rate: Vec2<usize>) -> Vec<f32> {
    if rate == Vec2(1, 1) {
        return plane.to_vec();
    }
    let [columns, rows] = [size.0 / rate.0, size.1 / rate.1];
    let between = |at: usize, rate: usize, count: usize| {
        let first = at / rate;
        (first, (first + 1).min(count - 1), (at % rate) as f32 / rate as f32)
    };
    let mut full = Vec::with_capacity(size.0 * size.1);
    for y in 0..size.1 {
        let (y0, y1, fy) = between(y, rate.1, rows);
        for x in 0..size.0 {
            let (x0, x1, fx) = between(x, rate.0, columns);
            let line = |y: usize| {
                let [a, b] = [x0, x1].map(|x| plane[y * columns + x]);
                a + (b - a) * fx
            };
            let (a, b) = (line(y0), line(y1));
            full.push(a + (b - a) * fy);
        }
    }
    full
}
