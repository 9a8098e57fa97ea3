//! JPEG files. [ITU-T T.81; JFIF, ITU-T T.871]

use jpeg_decoder::{Decoder, PixelFormat};
use pt_scene::image::Image;

use super::{Decoded, ImageMemory, PixelEncoding, Transfer, check_size};

/// See [`super::PixelDecoder`]. Reads sequential and progressive files in grey or colour with 8
/// bits. Grey becomes three equal channels, and subsampled chroma is interpolated.
pub(super) fn read(
    bytes: &[u8],
    numbers: PixelEncoding,
    room: &ImageMemory,
) -> Result<Decoded, String> {
    let failed = |e: jpeg_decoder::Error| format!("is not a valid JPEG file: {e}");
    let mut decoder = Decoder::new(bytes);
    decoder.read_info().map_err(failed)?;
    let info = decoder.info().ok_or("is not a valid JPEG file: it has no frame")?;
    let channels = match info.pixel_format {
        PixelFormat::L8 => 1,
        PixelFormat::RGB24 => 3,
        PixelFormat::L16 => return Err("has 16 bits per sample; expected 8".to_owned()),
        PixelFormat::CMYK32 => {
            return Err("has CMYK colours, which are not supported; save it as RGB".to_owned());
        }
    };
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    let count = u64::from(width) * u64::from(height);
    check_size(Some(count * channels), bytes.len())?;
    check_scans(bytes, count * channels / 64)?;
    let _grant = room.ask(Some(count * 12))?;
    let data = decoder.decode().map_err(failed)?;
    let table: [f32; 256] = std::array::from_fn(|level| light(level as u16, numbers));
    let pixels: Vec<_> = if channels == 1 {
        data.iter().map(|&v| [table[usize::from(v)]; 3]).collect()
    } else {
        let pixels = data.as_chunks::<3>().0.iter();
        pixels.map(|p| p.map(|v| table[usize::from(v)])).collect()
    };
    Image::check_size(width, height, pixels.len())?;
    Ok(Decoded { image: Image { width, height, pixels: pixels.into() }, alpha: None, frame: None })
}

/// Rejects images whose scans visit their blocks of 64 samples more often than those of any
/// encoder.
fn check_scans(bytes: &[u8], blocks: u64) -> Result<(), String> {
    /// Maximum number of scans; encoders produce about 10.
    const MAX_SCANS: u64 = 200;
    /// Maximum number of blocks in all scans.
    const MAX_VISITS: u64 = 1 << 28;
    let scans = scans(bytes);
    if scans > MAX_SCANS || scans * blocks > MAX_VISITS {
        return Err(format!(
            "has {scans} scans of {blocks} blocks; expected at most {MAX_SCANS} scans and \
             {MAX_VISITS} blocks in total"
        ));
    }
    Ok(())
}

/// Returns the number of scans of a file. [ITU-T T.81, §B.1.1 and §B.2]
fn scans(bytes: &[u8]) -> u64 {
    /// Marker of the start of a scan (SOS).
    const START: u8 = 0xDA;
    let (mut count, mut rest) = (0, bytes);
    // In the data of a scan, a byte 255 is followed by 0 or is one of the markers below.
    while let Some(at) = memchr::memchr(0xFF, rest) {
        rest = &rest[at + 1..];
        let Some(&mark) = rest.first() else { break };
        match mark {
            0x00 | 0x01 | 0xD0..=0xD8 | 0xFF => {}
            0xD9 => break,
            _ => {
                count += u64::from(mark == START);
                let length =
                    rest.get(1..3).map_or(0, |l| usize::from(l[0]) << 8 | usize::from(l[1]));
                rest = rest.get(1 + length..).unwrap_or_default();
            }
        }
    }
    count
}

/// Returns the value of one of 256 levels. The files do not specify a transfer function; it is
/// assumed to be sRGB, independent of the caller's default.
fn light(level: u16, numbers: PixelEncoding) -> f32 {
    match numbers {
        PixelEncoding::Light(_) => Transfer::Srgb.decode(level, 255),
        PixelEncoding::Stored => f32::from(level) / 255.0,
    }
}
