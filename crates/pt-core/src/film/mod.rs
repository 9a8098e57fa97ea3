//! The film: exact sums of samples, so that neither threads nor tiles nor the order in which
//! partial films are merged can change a bit of the image.

mod exact;

use pt_math::Spectrum;

pub use self::exact::ExactSum;
use self::exact::{CHANNELS, moments, sums};

/// What is known of one pixel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelSums {
    /// Red, green, blue, and the square of the luminance.
    sums: [ExactSum; CHANNELS],
    count: u32,
}

impl PixelSums {
    /// Adds a sample whose channels are finite and at most [`ExactSum::LIMIT`].
    fn add(&mut self, l: Spectrum) {
        for (sum, value) in self.sums.iter_mut().zip(moments(l)) {
            sum.add(value);
        }
        self.count += 1;
    }

    /// Number of samples.
    #[inline]
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Mean radiance; black without samples.
    pub fn mean(&self) -> [f64; 3] {
        let n = f64::from(self.count.max(1));
        let [r, g, b, _] = self.sums;
        [r, g, b].map(|s| s.value() / n)
    }

    /// Mean luminance, and the standard error of that mean: σ/√n with the sample variance
    /// σ² = (Σy² − (Σy)²/n)/(n − 1). Infinite below two samples.
    pub fn luminance(&self) -> (f64, f64) {
        let [r, g, b] = self.mean();
        let mean = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if self.count < 2 {
            return (mean, f64::INFINITY);
        }
        let n = f64::from(self.count);
        let [.., squares] = self.sums;
        let variance = (squares.value() - n * mean * mean).max(0.0) / (n - 1.0);
        (mean, (variance / n).sqrt())
    }

    /// Adds the samples of another.
    pub fn merge(&mut self, other: &Self) {
        for (a, b) in self.sums.iter_mut().zip(other.sums) {
            a.merge(b);
        }
        self.count += other.count;
    }
}

/// A sample that is no number, and was not added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Rejected {
    /// Row, from the top.
    pub y: u32,
    /// Column.
    pub x: u32,
    /// Index of the sample.
    pub sample: u32,
}

/// Samples that were NaN, infinite or beyond [`ExactSum::LIMIT`]: how many, and the first ones.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rejections {
    /// How many.
    pub count: u64,
    /// The first in row, column, sample order.
    pub first: Vec<Rejected>,
}

impl Rejections {
    const KEPT: usize = 16;

    fn add(&mut self, r: Rejected) {
        self.count += 1;
        self.keep(&[r]);
    }

    fn keep(&mut self, more: &[Rejected]) {
        self.first.extend_from_slice(more);
        self.first.sort_unstable();
        self.first.truncate(Self::KEPT);
    }

    /// Adds those of another film.
    pub fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.keep(&other.first);
    }
}

/// A rectangle of pixels: columns `x..x + width`, rows `y..y + height` from the top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First column.
    pub x: u32,
    /// First row.
    pub y: u32,
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Region {
    /// The whole of an image.
    pub const fn full([width, height]: [u32; 2]) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Whether it has pixels, and all of them belong to an image of this size.
    pub fn is_inside(&self, [width, height]: [u32; 2]) -> bool {
        let fits = |start: u32, len: u32, end: u32| {
            len > 0 && start.checked_add(len).is_some_and(|sum| sum <= end)
        };
        fits(self.x, self.width, width) && fits(self.y, self.height, height)
    }

    /// Number of pixels.
    pub const fn area(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Columns and rows of all pixels, row by row.
    pub fn pixels(self) -> impl Iterator<Item = [u32; 2]> {
        let columns = self.x..self.x + self.width;
        (self.y..self.y + self.height).flat_map(move |y| columns.clone().map(move |x| [x, y]))
    }

    /// Cuts the region into tiles of at most `size` × `size` pixels, row by row.
    pub fn tiles(&self, size: u32) -> Vec<Self> {
        let (x1, y1) = (self.x + self.width, self.y + self.height);
        let mut tiles = Vec::new();
        for y in (self.y..y1).step_by(size as usize) {
            for x in (self.x..x1).step_by(size as usize) {
                tiles.push(Self { x, y, width: size.min(x1 - x), height: size.min(y1 - y) });
            }
        }
        tiles
    }
}

/// The sums of a rectangle of pixels.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Film {
    region: Region,
    pixels: Vec<PixelSums>,
    rejections: Rejections,
}

impl Film {
    /// A film without samples.
    pub fn new(region: Region) -> Self {
        let pixels = vec![PixelSums::default(); region.area()];
        Self { region, pixels, rejections: Rejections::default() }
    }

    /// The pixels that are covered.
    pub fn region(&self) -> Region {
        self.region
    }

    #[inline]
    fn index(&self, x: u32, y: u32) -> usize {
        (y - self.region.y) as usize * self.region.width as usize + (x - self.region.x) as usize
    }

    /// The sums of a pixel inside of the region.
    #[inline]
    pub fn pixel(&self, x: u32, y: u32) -> &PixelSums {
        &self.pixels[self.index(x, y)]
    }

    /// Sums in rows from the top.
    pub fn pixels(&self) -> &[PixelSums] {
        &self.pixels
    }

    /// Samples that were refused.
    pub fn rejections(&self) -> &Rejections {
        &self.rejections
    }

    /// Adds consecutive samples of a pixel, of which the first has number `first`. One that is no
    /// number counts as black, and is reported in [`Self::rejections`].
    #[inline]
    pub fn add(&mut self, [x, y]: [u32; 2], first: u32, samples: &[Spectrum]) {
        let i = self.index(x, y);
        let pixel = &mut self.pixels[i];
        if let Some(sums) = sums(samples) {
            for (sum, value) in pixel.sums.iter_mut().zip(sums) {
                sum.add_multiple(value);
            }
            pixel.count += samples.len() as u32;
        } else {
            self.add_one_by_one([x, y], first, samples);
        }
    }

    /// [`Self::add`] for samples that are no numbers, or too different to be summed in `f64`.
    #[cold]
    fn add_one_by_one(&mut self, [x, y]: [u32; 2], first: u32, samples: &[Spectrum]) {
        let i = self.index(x, y);
        for (sample, &l) in (first..).zip(samples) {
            let usable = l.0.abs().max_element() <= ExactSum::LIMIT && l.is_finite();
            self.pixels[i].add(if usable { l } else { Spectrum::ZERO });
            if !usable {
                self.rejections.add(Rejected { y, x, sample });
            }
        }
    }

    /// Adds the samples of a film whose region lies inside of this one's.
    pub fn merge(&mut self, other: &Self) {
        let r = other.region;
        for (row, pixels) in other.pixels.chunks_exact(r.width as usize).enumerate() {
            let start = self.index(r.x, r.y + row as u32);
            for (mine, theirs) in self.pixels[start..].iter_mut().zip(pixels) {
                mine.merge(theirs);
            }
        }
        self.rejections.merge(&other.rejections);
    }

    /// Replaces the pixels of `other`'s region by its own, and adds its rejections; for tiles
    /// that continue from a copy taken by [`Self::tile`].
    pub fn put(&mut self, other: &Self) {
        let r = other.region;
        for (row, pixels) in other.pixels.chunks_exact(r.width as usize).enumerate() {
            let start = self.index(r.x, r.y + row as u32);
            self.pixels[start..start + pixels.len()].copy_from_slice(pixels);
        }
        self.rejections.merge(&other.rejections);
    }

    /// A copy of the pixels of a region inside of this one's, without rejections.
    pub fn tile(&self, region: Region) -> Self {
        let mut pixels = Vec::with_capacity(region.area());
        for y in region.y..region.y + region.height {
            let start = self.index(region.x, y);
            pixels.extend_from_slice(&self.pixels[start..start + region.width as usize]);
        }
        Self { region, pixels, rejections: Rejections::default() }
    }

    /// Total number of samples.
    pub fn samples(&self) -> u64 {
        self.pixels.iter().map(|p| u64::from(p.count)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_error_are_those_of_the_textbook() {
        let mut p = PixelSums::default();
        for v in [1.0, 2.0, 3.0, 6.0] {
            p.add(Spectrum::splat(v));
        }
        let (mean, error) = p.luminance();
        assert!((mean - 3.0).abs() < 1e-6);
        assert!((error - (14.0f64 / 3.0 / 4.0).sqrt()).abs() < 1e-6, "{error}");
    }

    #[test]
    fn what_is_no_number_is_refused_and_located() {
        let mut film = Film::new(Region::full([4, 2]));
        film.add([3, 1], 7, &[Spectrum::rgb(1.0, f32::NAN, 0.0)]);
        film.add([0, 0], 2, &[Spectrum::splat(f32::INFINITY), Spectrum::ONE]);
        assert_eq!(film.rejections().count, 2);
        assert_eq!(film.rejections().first[1], Rejected { y: 1, x: 3, sample: 7 });
        assert_eq!(film.pixel(0, 0).mean(), [0.5; 3]);
    }

    #[test]
    fn merging_parts_is_rendering_the_whole() {
        let whole = Region::full([5, 3]);
        let mut all = Film::new(whole);
        let mut merged = Film::new(whole);
        for (n, tile) in whole.tiles(2).into_iter().enumerate().rev() {
            let mut part = Film::new(tile);
            for y in tile.y..tile.y + tile.height {
                for x in tile.x..tile.x + tile.width {
                    let l = Spectrum::rgb(x as f32 * 0.1, y as f32 * 0.3, n as f32);
                    part.add([x, y], 0, &[l]);
                    all.add([x, y], 0, &[l]);
                }
            }
            merged.merge(&part);
        }
        assert_eq!(all, merged);
    }
}
