//! Squares of pixels among which paths are reused.

use std::ops::Range;

use pt_core::film::Region;

use crate::sample_range::SampleRange;

/// Squares into which an image is divided while some of its samples are taken. Their positions
/// depend on the sample numbers, so that no borders between them are visible.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ReuseTiles {
    /// Number of pixels along a side: a power of two.
    side: u32,
    /// See [`Self::shift`].
    shift: [u32; 2],
    /// Width and height of the image.
    resolution: [u32; 2],
}

/// Number of consecutive samples of a pixel with the same squares.
pub(crate) const SAMPLES_PER_TILING: u32 = 16;

/// Corners of a square of 2 × 2, ordered so that consecutive ones are far apart.
const CORNERS: [[u32; 2]; 4] = [[0, 0], [1, 1], [1, 0], [0, 1]];

impl ReuseTiles {
    /// Squares of a sample and those after it up to the next multiple of [`SAMPLES_PER_TILING`].
    pub(crate) fn of_sample(side: u32, sample: u32, resolution: [u32; 2]) -> Self {
        let mut shift = [0; 2];
        let mut corner = sample / SAMPLES_PER_TILING;
        let mut step = side;
        while step > 1 {
            step /= 2;
            let [x, y] = CORNERS[corner as usize % CORNERS.len()];
            shift = [shift[0] + step * x, shift[1] + step * y];
            corner /= CORNERS.len() as u32;
        }
        Self { side, shift, resolution }
    }

    /// Offset of the squares to the left of, and above, multiples of their side, in columns and
    /// rows.
    pub(crate) fn shift(&self) -> [u32; 2] {
        self.shift
    }

    /// Square of a pixel, clipped to the image.
    #[inline]
    fn tile_of(&self, pixel: [u32; 2]) -> Region {
        let along = |i: usize| {
            let first = (pixel[i] + self.shift[i]) / self.side * self.side;
            let end = (first + self.side - self.shift[i]).min(self.resolution[i]);
            let start = first.saturating_sub(self.shift[i]);
            (start, end - start)
        };
        let ((x, width), (y, height)) = (along(0), along(1));
        Region { x, y, width, height }
    }

    /// Appends the sample ranges of the pixels of a tile, square by square; `due` returns the
    /// samples that a pixel needs. The other pixels of a square take the same samples, even if they
    /// need none or are not in the tile.
    pub(crate) fn sample_ranges(
        &self,
        tile: Region,
        due: impl Fn([u32; 2]) -> Option<Range<u32>>,
        ranges: &mut Vec<SampleRange>,
    ) {
        // Faster than an iterator chain: nested iterators are efficient only with internal
        // iteration.
        tile.pixels().for_each(|pixel| {
            if self.side == 1 {
                ranges.extend(due(pixel).map(|samples| SampleRange::single(pixel, samples)));
                return;
            }
            let square = self.tile_of(pixel);
            if pixel == [square.x.max(tile.x), square.y.max(tile.y)] {
                let due = |pixel| if tile.contains(pixel) { due(pixel) } else { None };
                add_tile(square, due, ranges);
            }
        });
    }
}

/// Appends the sample ranges of all pixels of a square if one of them needs samples.
fn add_tile(
    square: Region,
    due: impl Fn([u32; 2]) -> Option<Range<u32>>,
    ranges: &mut Vec<SampleRange>,
) {
    let first = ranges.len();
    let mut needed: Option<Range<u32>> = None;
    square.pixels().for_each(|pixel| {
        let kept = due(pixel);
        if let Some(kept) = &kept {
            let all = needed.get_or_insert_with(|| kept.clone());
            *all = all.start.min(kept.start)..all.end.max(kept.end);
        }
        ranges.push(SampleRange { kept: kept.unwrap_or(0..0), ..SampleRange::single(pixel, 0..0) });
    });
    let Some(needed) = needed else { return ranges.truncate(first) };
    for (behind, range) in (0..).zip(ranges[first..].iter_mut().rev()) {
        range.samples = needed.clone();
        range.rest_of_group = behind;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn squares_cover_the_image_once_wherever_they_lie() {
        let resolution = [13, 10];
        for side in [1, 2, 4] {
            for sample in (0..17).map(|i| i * SAMPLES_PER_TILING + i % SAMPLES_PER_TILING) {
                let reuse_tiles = ReuseTiles::of_sample(side, sample, resolution);
                for pixel in Region::full(resolution).pixels() {
                    let square = reuse_tiles.tile_of(pixel);
                    assert!(square.contains(pixel) && square.is_inside(resolution));
                    assert!(square.width.max(square.height) <= side);
                    assert!(square.pixels().all(|other| reuse_tiles.tile_of(other) == square));
                }
            }
        }
    }

    #[test]
    fn all_places_of_a_grid_take_turns() {
        for side in [1, 2, 4] {
            let shift = |i| ReuseTiles::of_sample(side, i * SAMPLES_PER_TILING, [8; 2]).shift();
            let mut shifts: Vec<_> = (0..side * side).map(shift).collect();
            shifts.sort_unstable();
            shifts.dedup();
            assert_eq!(shifts.len() as u32, side * side);
        }
    }

    #[test]
    fn a_square_of_which_one_pixel_needs_samples_takes_them_all() {
        let reuse_tiles = ReuseTiles::of_sample(2, 0, [5, 4]);
        let tile = Region { x: 1, y: 0, width: 4, height: 4 };
        let due = |[x, y]: [u32; 2]| (y == 0 && x < 4).then_some(x..4);
        let mut ranges = Vec::new();
        reuse_tiles.sample_ranges(tile, due, &mut ranges);
        let pixels: Vec<_> =
            ranges.iter().map(|range| (range.pixel, range.samples.clone())).collect();
        let square = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|pixel| (pixel, 1..4));
        assert_eq!(pixels[..4], square);
        let kept: Vec<_> =
            ranges.iter().map(|range| (range.kept.clone(), range.rest_of_group)).collect();
        assert_eq!(kept[..4], [(0..0, 3), (1..4, 2), (0..0, 1), (0..0, 0)]);
        assert_eq!(ranges.len(), 4 + 4, "the last square needs nothing");
    }
}
