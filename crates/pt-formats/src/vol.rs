//! Grid volumes of Mitsuba (`.vol`). [Jakob et al. 2022, documentation of Mitsuba 3.9, "Grid-based
//! volume data source"]
//!
//! ```text
//! "VOL", version 3 │ encoding, cells along x, y, z, channels │ box: least, greatest │ numbers
//! ```
//!
//! All numbers are little-endian and of 32 bits. Those of a cell are consecutive; x is the
//! innermost index of the cells, then y, then z.

use pt_math::{DAffine3, DVec3};
use pt_scene::medium::Grid;

const IDENTIFIER: [u8; 4] = *b"VOL\x03";
/// Encoding of 32-bit floats.
const FLOAT32: i32 = 1;
/// Maximum number of bytes of a grid, as for images.
const MAX_BYTES: u64 = 1 << 30;

/// A grid and its bounding box.
#[derive(Debug)]
pub(super) struct VolFile {
    pub(super) grid: Grid,
    /// Unit cube to the box.
    pub(super) to_box: DAffine3,
}

/// Reads a grid of finite values.
///
/// # Errors
/// Returns a message if the format or the encoding is another one, the file is truncated, or has
/// other numbers of channels than 1, 3 and 6. The caller adds the location of the reference in the
/// scene.
pub(super) fn parse(bytes: &[u8]) -> Result<VolFile, String> {
    let Some((identifier, rest)) = bytes.split_first_chunk::<4>() else {
        return Err("file too short for a grid".to_owned());
    };
    check_identifier(*identifier)?;
    let Some((header, rest)) = rest.split_first_chunk::<44>() else {
        return Err("unexpected end of the file within its header; it may be incomplete".to_owned());
    };
    let word = |i: usize| [0, 1, 2, 3].map(|byte| header[4 * i + byte]);
    let whole = |i: usize| i32::from_le_bytes(word(i));
    if whole(0) != FLOAT32 {
        return Err(format!("found encoding {} of the grid, expected 1 (32-bit float)", whole(0)));
    }
    let (resolution, channels) = sizes([1, 2, 3].map(whole), whole(4))?;
    let number = |i: usize| f64::from(f32::from_le_bytes(word(i)));
    let corner = |i: usize| DVec3::new(number(i), number(i + 1), number(i + 2));
    let (least, greatest) = (corner(5), corner(8));
    let to_box = DAffine3::from_translation(least) * DAffine3::from_scale(greatest - least);
    let values = numbers(rest, resolution, channels)?;
    Ok(VolFile { grid: Grid { resolution, channels, values }, to_box })
}

/// Encodes a grid as a file, with the unit cube as its box.
///
/// # Errors
/// Returns a message if it has more cells along an axis than the format can represent.
pub(super) fn write(grid: &Grid) -> Result<Vec<u8>, String> {
    let [x, y, z] = grid.resolution;
    let mut bytes = IDENTIFIER.to_vec();
    for number in [FLOAT32 as u32, x, y, z, grid.channels] {
        let number = i32::try_from(number)
            .map_err(|_| format!("found a grid of {x} x {y} x {z} cells, which is too large"))?;
        bytes.extend(number.to_le_bytes());
    }
    let corners = [0.0f32, 0.0, 0.0, 1.0, 1.0, 1.0];
    bytes.extend(corners.iter().chain(&grid.values).flat_map(|x| x.to_le_bytes()));
    Ok(bytes)
}

fn check_identifier(identifier: [u8; 4]) -> Result<(), String> {
    match identifier {
        IDENTIFIER => Ok(()),
        [b'V', b'O', b'L', version] => Err(format!("found grid version {version}, expected 3")),
        _ => {
            Err("found no grid of Mitsuba, expected a file that begins with the letters VOL"
                .to_owned())
        }
    }
}

/// Returns the cells along each axis, and the values per cell, if they are within limits.
fn sizes(cells: [i32; 3], channels: i32) -> Result<([u32; 3], u32), String> {
    let [x, y, z] = cells;
    let says = format!("the grid header declares {x} x {y} x {z} cells of {channels} numbers");
    if !matches!(channels, 1 | 3 | 6) {
        return Err(format!("{says}, expected 1, 3 or 6 numbers"));
    }
    let cells = cells.map(|n| u32::try_from(n).unwrap_or(0));
    if cells.contains(&0) {
        return Err(format!("{says}, expected at least one cell along each axis"));
    }
    let bytes = cells.iter().try_fold(4 * channels as u64, |all, &n| all.checked_mul(n.into()));
    if bytes.is_none_or(|bytes| bytes > MAX_BYTES) {
        return Err(format!("{says}, which exceed 1 GiB; reduce the resolution"));
    }
    Ok((cells, channels as u32))
}

fn numbers(bytes: &[u8], cells: [u32; 3], channels: u32) -> Result<Vec<f32>, String> {
    let count = cells.iter().map(|&n| n as usize).product::<usize>() * channels as usize;
    let Some(bytes) = bytes.get(..4 * count) else {
        return Err(format!(
            "the grid header declares {count} numbers, but the file ends after {}; it may be \
             incomplete",
            bytes.len() / 4
        ));
    };
    let values: Vec<_> = bytes.as_chunks().0.iter().map(|&word| f32::from_le_bytes(word)).collect();
    match values.iter().position(|x| !x.is_finite()) {
        None => Ok(values),
        Some(bad) => {
            let [nx, ny, _] = cells.map(|n| n as usize);
            let cell = bad / channels as usize;
            let [x, y, z] = [cell % nx, cell / nx % ny, cell / nx / ny];
            Err(format!("found {} in cell ({x}, {y}, {z}), expected a finite number", values[bad]))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a file of two cells along x with a box of 2 × 1 × 1 around the origin.
    fn file(words: [i32; 5], values: &[f32]) -> Vec<u8> {
        let mut bytes = IDENTIFIER.to_vec();
        bytes.extend(words.iter().flat_map(|w| w.to_le_bytes()));
        let corners = [-1.0f32, -0.5, -0.5, 1.0, 0.5, 0.5];
        bytes.extend(corners.iter().chain(values).flat_map(|x| x.to_le_bytes()));
        bytes
    }

    #[test]
    fn grids_are_read_with_their_box() {
        let read = parse(&file([1, 2, 1, 1, 1], &[0.5, 2.0])).unwrap();
        assert_eq!(read.grid, Grid { resolution: [2, 1, 1], channels: 1, values: vec![0.5, 2.0] });
        let corner = read.to_box.transform_point3(DVec3::ONE);
        assert_eq!(corner, DVec3::new(1.0, 0.5, 0.5));
    }

    #[test]
    fn a_file_that_ends_early_is_refused() {
        let whole = file([1, 1, 2, 1, 3], &[0.0; 6]);
        assert!(parse(&whole).is_ok());
        for length in 0..whole.len() {
            let message = parse(&whole[..length]).unwrap_err();
            assert!(message.contains("end") || message.contains("short"), "{length}: {message}");
        }
    }

    #[test]
    fn what_makes_no_sense_is_reported() {
        let cases = [
            (file([3, 1, 1, 1, 1], &[0.0]), "encoding 3"),
            (file([1, 0, 1, 1, 1], &[0.0]), "at least one cell"),
            (file([1, 1, -1, 1, 1], &[0.0]), "1 x -1 x 1 cells"),
            (file([1, 1, 1, 1, 2], &[0.0; 2]), "expected 1, 3 or 6 numbers"),
            (file([1, i32::MAX, i32::MAX, i32::MAX, 3], &[0.0]), "exceed 1 GiB"),
            (file([1, 1024, 1024, 64, 1], &[0.0]), "ends after 1;"),
            (file([1, 2, 2, 1, 1], &[0.0, 0.0, f32::NAN, 0.0]), "found NaN in cell (0, 1, 0)"),
            (b"VOL\x02 and so on".to_vec(), "version 2"),
            (b"PLY and so on".to_vec(), "letters VOL"),
        ];
        for (bytes, want) in cases {
            let message = parse(&bytes).unwrap_err();
            assert!(message.contains(want), "{message}, expected {want}");
        }
    }
}
