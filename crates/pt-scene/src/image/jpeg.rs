//! JPEG files. [ITU-T T.81; JFIF, ITU-T T.871]

use jpeg_decoder::{Decoder, PixelFormat};

use super::{Decoded, Image, Numbers, Transfer, check_size};

/// See [`super::Reader`]. Grey and colour of 8 bits, sequential and progressive; grey becomes
/// three equal channels, and colours of lower resolution are interpolated.
pub(super) fn read(bytes: &[u8], numbers: Numbers) -> Result<Decoded, String> {
    let failed = |e: jpeg_decoder::Error| format!("is no valid JPEG file: {e}");
    let mut decoder = Decoder::new(bytes);
    decoder.read_info().map_err(failed)?;
    let info = decoder.info().ok_or("is no valid JPEG file: it has no frame")?;
    let channels = match info.pixel_format {
        PixelFormat::L8 => 1,
        PixelFormat::RGB24 => 3,
        PixelFormat::L16 => return Err("has 16 bits per sample; expected 8".to_owned()),
        PixelFormat::CMYK32 => return Err("has printing colours (CMYK); save it as RGB".to_owned()),
    };
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    let count = u64::from(width) * u64::from(height);
    check_size(Some(count * channels), bytes.len())?;
    check_size(Some(count * 12), usize::MAX)?;
    let data = decoder.decode().map_err(failed)?;
    let table: [f32; 256] = std::array::from_fn(|level| light(level as u16, numbers));
    let pixels: Vec<_> = if channels == 1 {
        data.iter().map(|&v| [table[usize::from(v)]; 3]).collect()
    } else {
        let pixels = data.as_chunks::<3>().0.iter();
        pixels.map(|p| p.map(|v| table[usize::from(v)])).collect()
    };
    super::check_shape(width, height, pixels.len())?;
    Ok(Decoded { image: Image { width, height, pixels }, alpha: None, frame: None })
}

/// What one of 256 levels stands for. Files do not say how they relate to light; they are taken as
/// sRGB whatever those of other formats would be.
fn light(level: u16, numbers: Numbers) -> f32 {
    match numbers {
        Numbers::Light(_) => Transfer::Srgb.decode(level, 255),
        Numbers::Stored => f32::from(level) / 255.0,
    }
}
