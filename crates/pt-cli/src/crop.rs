//! Rectangles of pixels on the command line, whose rows are counted from the bottom.

use anyhow::{Result, anyhow};
use clap::Args;
use pathtracer::Region;

use crate::parse;

/// Option of a rectangle of an image.
#[derive(Args, Debug, Clone, Default)]
pub(crate) struct CropOption {
    /// Only this rectangle: X, Y of its lower left corner, counted from the lower left, and its
    /// size in pixels
    #[arg(short = 'p', long = "crop", visible_alias = "cell", value_names = ["X", "Y", "DX", "DY"], num_args = 4, allow_negative_numbers = true)]
    #[arg(value_parser = parse::count, help_heading = "Image")]
    cell: Option<Vec<u32>>,
}

impl CropOption {
    /// X, Y, width and height.
    pub(crate) fn rectangle(&self) -> Option<[u32; 4]> {
        self.cell.as_deref().and_then(|numbers| numbers.try_into().ok())
    }
}

/// Pixels of a rectangle of the command line.
///
/// # Errors
/// If they are not inside an image of this size.
pub(crate) fn region([x, y, dx, dy]: [u32; 4], [width, height]: [u32; 2]) -> Result<Region> {
    let top = u64::from(y) + u64::from(dy);
    let row = u64::from(height).checked_sub(top).map(|row| row as u32);
    let region = row.map(|row| Region { x, y: row, width: dx, height: dy });
    region.filter(|region| region.is_inside([width, height])).ok_or_else(|| {
        anyhow!(
            "-p {x} {y} {dx} {dy}: expected a cell with pixels inside of the image of {width} x \
             {height}"
        )
    })
}

/// Rectangle of the command line with these pixels of an image with `rows` rows.
pub(crate) fn rectangle(region: Region, rows: u32) -> [u32; 4] {
    let Region { x, y, width, height } = region;
    [x, rows - y - height, width, height]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_counted_from_the_bottom() {
        let pixels = region([1, 2, 3, 4], [9, 10]).expect("it is inside");
        assert_eq!(pixels, Region { x: 1, y: 4, width: 3, height: 4 });
        assert_eq!(rectangle(pixels, 10), [1, 2, 3, 4]);
        for outside in [[7, 0, 3, 1], [0, 0, 0, 1], [0, 9, 1, 2], [0, u32::MAX, 1, u32::MAX]] {
            assert!(region(outside, [9, 10]).is_err(), "{outside:?}");
        }
    }
}
