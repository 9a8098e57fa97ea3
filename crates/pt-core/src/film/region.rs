//! Rectangles of pixels.

/// A rectangle of pixels: columns `x..x + width`, rows `y..y + height` from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Number of columns.
    pub width: u32,
    /// Number of rows.
    pub height: u32,
}

impl Region {
    /// Region of a whole image.
    pub const fn full([width, height]: [u32; 2]) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Returns true if the region is not empty and lies inside of an image of this size.
    pub fn is_inside(&self, [width, height]: [u32; 2]) -> bool {
        let fits = |start: u32, len: u32, end: u32| {
            len > 0 && start.checked_add(len).is_some_and(|sum| sum <= end)
        };
        fits(self.x, self.width, width) && fits(self.y, self.height, height)
    }

    /// Returns true if the region contains the pixel with this column and row.
    pub const fn contains(&self, [x, y]: [u32; 2]) -> bool {
        x >= self.x && x - self.x < self.width && y >= self.y && y - self.y < self.height
    }

    /// Number of pixels.
    pub const fn area(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Columns and rows of all pixels: in blocks of 8 × 8, and in each by the Z-order curve, so
    /// that runs of consecutive pixels are close to each other. [Morton 1966, "A Computer Oriented
    /// Geodetic Data Base"]
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let squares = |start: u32, len: u32| (start..start + len).step_by(SQUARE as usize);
        let origins = squares(self.y, self.height)
            .flat_map(move |y| squares(self.x, self.width).map(move |x| [x, y]));
        let (x1, y1) = (self.x + self.width, self.y + self.height);
        let square = move |[x, y]: [u32; 2]| {
            let (width, height) = (x1 - x, y1 - y);
            let inside = move |&&[dx, dy]: &&[u32; 2]| dx < width && dy < height;
            Z_ORDER.iter().filter(inside).map(move |&[dx, dy]| [x + dx, y + dy])
        };
        origins.flat_map(square)
    }

    /// Columns and rows of all pixels, row by row.
    pub(super) fn rows(self) -> impl Iterator<Item = [u32; 2]> {
        let columns = self.x..self.x + self.width;
        (self.y..self.y + self.height).flat_map(move |y| columns.clone().map(move |x| [x, y]))
    }

    /// Divides the region into tiles of at most `size` × `size` pixels, row by row. Tiles begin at
    /// multiples of `size` minus `shift`, by columns and rows, or with the region.
    pub fn tiles(&self, size: u32, shift: [u32; 2]) -> Vec<Self> {
        let columns = cut(self.x, self.width, size, shift[0]);
        let mut tiles = Vec::new();
        for (y, height) in cut(self.y, self.height, size, shift[1]) {
            tiles.extend(columns.iter().map(|&(x, width)| Self { x, y, width, height }));
        }
        tiles
    }
}

/// Divides `start..start + len` at multiples of `size` minus `shift`. Returns the starts and
/// lengths of the pieces.
fn cut(start: u32, len: u32, size: u32, shift: u32) -> Vec<(u32, u32)> {
    let mut pieces = Vec::new();
    let mut at = start;
    while at < start + len {
        let whole = size - ((u64::from(at) + u64::from(shift)) % u64::from(size)) as u32;
        let piece = whole.min(start + len - at);
        pieces.push((at, piece));
        at += piece;
    }
    pieces
}

/// Side of the blocks of [`Region::pixels`].
const SQUARE: u32 = 8;

/// Pixels of a block along the Z-order curve: the bits of column and row are interleaved.
const Z_ORDER: [[u32; 2]; (SQUARE * SQUARE) as usize] = {
    let mut order = [[0; 2]; (SQUARE * SQUARE) as usize];
    let mut i = 0;
    while i < order.len() {
        let n = i as u32;
        order[i] = [n & 1 | n >> 1 & 2 | n >> 2 & 4, n >> 1 & 1 | n >> 2 & 2 | n >> 3 & 4];
        i += 1;
    }
    order
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_region_has_each_of_its_pixels_once() {
        for [x, y, width, height] in [[0, 0, 32, 32], [3, 5, 17, 9], [7, 1, 1, 30], [2, 2, 8, 8]] {
            let region = Region { x, y, width, height };
            let pixels: Vec<_> = region.pixels().collect();
            let mut sorted = pixels.clone();
            sorted.sort_unstable();
            let all = (x..x + width).flat_map(|x| (y..y + height).map(move |y| [x, y]));
            assert!(sorted.into_iter().eq(all), "{region:?}");
            let near = |square: &[[u32; 2]]| {
                let of = |k: usize| square.iter().map(move |p| p[k]);
                [0, 1].map(|k| of(k).max().unwrap_or(0) - of(k).min().unwrap_or(0))
            };
            if width % 8 == 0 && height % 8 == 0 {
                for (n, side) in [(4, 2), (16, 4), (64, 8)] {
                    assert!(pixels.chunks(n).all(|square| near(square) == [side - 1; 2]));
                }
            }
        }
    }
}
