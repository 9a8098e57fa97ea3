//! Radiance pictures. [Ward 1991, "Real Pixels", Graphics Gems II;
//! Radiance, "File Formats"]

use pt_scene::image::Image;

use super::{Decoded, ImageMemory, PixelEncoding};

/// Image widths for which rows may be run-length encoded channel by channel.
const PACKED_WIDTHS: std::ops::Range<usize> = 8..0x8000;
/// Tolerance of primaries and white point against those of Rec. 709: the default ones of Radiance
/// (with the white x = y = 1/3) are accepted as equal.
const PRIMARIES_TOLERANCE: f64 = 0.025;
/// Chromaticities x, y of red, green, blue and white. [ITU-R BT.709]
const REC709: [f64; 8] = [0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290];

/// See [`super::PixelDecoder`]. A mantissa m and an exponent e decode to m · 2^(e − 136), without
/// the half that Radiance itself adds to m. Light is divided by the factors in the header
/// (`EXPOSURE`, `COLORCORR`); stored values are not.
pub(super) fn read(
    bytes: &[u8],
    numbers: PixelEncoding,
    room: &ImageMemory,
) -> Result<Decoded, String> {
    let mut data = Data { rest: bytes };
    let header = HdrHeader::read(&mut data)?;
    let HdrHeader { width, height, .. } = header;
    let _grant = room.ask((width as u64 * height as u64).checked_mul(12))?;
    let divisors = match numbers {
        PixelEncoding::Light(_) => header.divisors,
        PixelEncoding::Stored => [1.0; 3],
    };
    let scales: [f32; 256] = std::array::from_fn(|e| match e {
        0 => 0.0,
        _ => f64::from_bits((e as u64 + 1023 - 136) << 52) as f32,
    });
    let mut pixels = Vec::new();
    let mut row = vec![[0; 4]; width];
    for y in 0..height {
        data.row(&mut row).map_err(|message| format!("row {y} of {height} {message}"))?;
        pixels.extend(row.iter().map(|&[r, g, b, e]| {
            let mantissas = [r, g, b].map(f32::from);
            std::array::from_fn(|c| {
                let stored = mantissas[c] * scales[usize::from(e)];
                (f64::from(stored) / divisors[c]) as f32
            })
        }));
    }
    if pixels.as_flattened().iter().any(|x: &f32| x.is_infinite()) {
        return Err("has infinite colours after division by EXPOSURE or COLORCORR".to_owned());
    }
    Image::check_size(width as u32, height as u32, pixels.len())?;
    Ok(Decoded {
        image: Image { width: width as u32, height: height as u32, pixels: pixels.into() },
        alpha: None,
        frame: None,
    })
}

/// Header of a file.
struct HdrHeader {
    width: usize,
    height: usize,
    /// Factors with which red, green and blue were multiplied.
    divisors: [f64; 3],
}

impl HdrHeader {
    /// Reads lines of text up to an empty one, then the size.
    fn read(data: &mut Data<'_>) -> Result<Self, String> {
        if !data.line()?.starts_with("#?") {
            return Err("is not a Radiance picture: it does not begin with \"#?\"".to_owned());
        }
        let mut divisors = [1.0; 3];
        loop {
            let line = data.line()?;
            if line.is_empty() {
                break;
            }
            let Some((name, value)) = line.split_once('=').filter(|_| !line.starts_with('#'))
            else {
                continue;
            };
            match name.trim() {
                "FORMAT" if value.trim() != "32-bit_rle_rgbe" => {
                    return Err(format!("has the format {value:?}; expected 32-bit_rle_rgbe"));
                }
                "EXPOSURE" => {
                    let [x] = factors(name, value)?;
                    divisors = divisors.map(|d| d * x);
                }
                "COLORCORR" => {
                    let factors: [f64; 3] = factors(name, value)?;
                    divisors = std::array::from_fn(|c| divisors[c] * factors[c]);
                }
                "PRIMARIES" => check_primaries(value)?,
                _ => {}
            }
        }
        if !divisors.iter().all(|d| (1e-30..=1e30).contains(d)) {
            return Err(format!(
                "has a product {divisors:?} of EXPOSURE and COLORCORR, expected normal numbers"
            ));
        }
        let (width, height) = size(&data.line()?)?;
        Ok(Self { width, height, divisors })
    }
}

/// Parses the positive numbers of a header line.
fn factors<const N: usize>(name: &str, value: &str) -> Result<[f64; N], String> {
    let numbers: Option<Vec<f64>> = value.split_whitespace().map(|w| w.parse().ok()).collect();
    let is_good = |x: &f64| *x > 0.0 && x.is_finite();
    let good = numbers.filter(|all| all.iter().all(is_good)).and_then(|all| all.try_into().ok());
    good.ok_or_else(|| format!("has {name}={value:?}; expected {N} numbers above 0"))
}

/// Checks that the primaries are those of Rec. 709.
fn check_primaries(value: &str) -> Result<(), String> {
    let found: [f64; 8] = factors("PRIMARIES", value)?;
    if found.iter().zip(REC709).any(|(x, expected)| (x - expected).abs() > PRIMARIES_TOLERANCE) {
        return Err(format!("has the PRIMARIES {value:?}; expected those of Rec. 709"));
    }
    Ok(())
}

/// Parses width and height from `-Y height +X width`: rows from the top, from left to right.
fn size(line: &str) -> Result<(usize, usize), String> {
    let words: Vec<_> = line.split_whitespace().collect();
    let count = |word: &str| word.parse().ok().filter(|n| (1..=u32::MAX as usize).contains(n));
    if let ["-Y", height, "+X", width] = words.as_slice()
        && let (Some(width), Some(height)) = (count(width), count(height))
    {
        return Ok((width, height));
    }
    Err(format!("has the size {line:?}; expected \"-Y height +X width\", rows from the top"))
}

/// Bytes not read yet.
struct Data<'a> {
    rest: &'a [u8],
}

impl Data<'_> {
    /// Reads the next line of text.
    fn line(&mut self) -> Result<String, String> {
        let end = self.rest.iter().position(|b| *b == b'\n');
        let end = end.ok_or("ends in its header")?;
        let line = String::from_utf8_lossy(&self.rest[..end]).trim_end().to_owned();
        self.rest = &self.rest[end + 1..];
        Ok(line)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let (first, rest) = self.rest.split_first_chunk().ok_or("is truncated")?;
        self.rest = rest;
        Ok(*first)
    }

    /// Reads a row of pixels.
    fn row(&mut self, row: &mut [[u8; 4]]) -> Result<(), String> {
        match self.rest {
            [2, 2, high @ 0..0x80, low, rest @ ..] if PACKED_WIDTHS.contains(&row.len()) => {
                let width = usize::from(u16::from_be_bytes([*high, *low]));
                if width != row.len() {
                    return Err(format!("declares {width} pixels"));
                }
                self.rest = rest;
                (0..4).try_for_each(|channel| self.channel(row, channel))
            }
            _ => self.pixels(row),
        }
    }

    /// Reads one channel of a row. A count above 128 precedes a byte that is repeated count − 128
    /// times; any other count precedes that many literal bytes.
    fn channel(&mut self, row: &mut [[u8; 4]], channel: usize) -> Result<(), String> {
        let mut at = 0;
        while at < row.len() {
            let [count] = self.take()?;
            let (length, repeated) = match count {
                0 => return Err("has a run of no bytes".to_owned()),
                1..=128 => (usize::from(count), None),
                _ => (usize::from(count - 128), Some(self.take::<1>()?[0])),
            };
            let run = row.get_mut(at..at + length).ok_or("has runs beyond its end")?;
            for pixel in run {
                pixel[channel] = match repeated {
                    Some(byte) => byte,
                    None => self.take::<1>()?[0],
                };
            }
            at += length;
        }
        Ok(())
    }

    /// Reads a row pixel by pixel. Mantissas of 1, 1, 1 are a run that repeats the previous pixel;
    /// the exponent is the count, which is multiplied by 256 for each directly preceding run.
    fn pixels(&mut self, row: &mut [[u8; 4]]) -> Result<(), String> {
        let (mut at, mut shift) = (0, 0);
        while at < row.len() {
            let pixel = self.take()?;
            if let [1, 1, 1, count] = pixel {
                let before =
                    *at.checked_sub(1).and_then(|i| row.get(i)).ok_or("begins with a run")?;
                let length = usize::from(count).checked_shl(shift).unwrap_or(usize::MAX);
                let end = at.saturating_add(length);
                row.get_mut(at..end).ok_or("has runs beyond its end")?.fill(before);
                (at, shift) = (end, shift + 8);
            } else {
                row[at] = pixel;
                (at, shift) = (at + 1, 0);
            }
        }
        Ok(())
    }
}
