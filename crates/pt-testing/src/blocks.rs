//! Comparison of two images block by block: a block has less noise than a pixel, and locates the
//! difference.

use std::fmt;

/// Block of pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Column and row of its first pixel.
    pub corner: [u32; 2],
    /// Mean of the first image.
    pub a: [f64; 3],
    /// Mean of the second image.
    pub b: [f64; 3],
    /// Maximum difference over the channels, divided by the mean of all channels of both images; 0
    /// for black blocks.
    pub relative: f64,
    /// Maximum difference over the channels in standard errors; 0 without a difference, ∞ for a
    /// difference without variance.
    pub standard_errors: f64,
}

/// Differences of two images.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockReport {
    /// Blocks, row by row; those at the right and the lower edge may be smaller.
    pub blocks: Vec<Block>,
    /// All pixels as one block.
    pub whole: Block,
}

impl BlockReport {
    /// Returns the block with the greatest relative difference.
    pub fn worst(&self) -> &Block {
        self.blocks.iter().max_by(|x, y| x.relative.total_cmp(&y.relative)).unwrap_or(&self.whole)
    }

    /// Returns the blocks that differ by more than `relative` and by more than `standard_errors`.
    pub fn beyond(&self, relative: f64, standard_errors: f64) -> Vec<&Block> {
        // Written so that NaN exceeds every bound.
        let within = |b: &Block| b.relative <= relative || b.standard_errors <= standard_errors;
        self.blocks.iter().filter(|b| !within(b)).collect()
    }
}

impl fmt::Display for BlockReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let show = |f: &mut fmt::Formatter<'_>, b: &Block| {
            let percent = 100.0 * b.relative;
            write!(f, "{percent:.3} % ({:.1} standard errors)", b.standard_errors)
        };
        write!(f, "whole image: ")?;
        show(f, &self.whole)?;
        let worst = self.worst();
        write!(f, "; worst block, at {:?}: ", worst.corner)?;
        show(f, worst)
    }
}

/// Compares two images in blocks of `block` × `block` pixels. `var_a` and `var_b` are the variances
/// of the pixels' means.
///
/// # Panics
/// If a slice does not have `width` · `height` pixels, or `block` is 0.
pub fn compare_blocks(
    a: &[[f32; 3]],
    b: &[[f32; 3]],
    var_a: &[[f32; 3]],
    var_b: &[[f32; 3]],
    width: u32,
    height: u32,
    block: u32,
) -> BlockReport {
    let count = width as usize * height as usize;
    assert!([a, b, var_a, var_b].iter().all(|s| s.len() == count), "images of other sizes");
    let compare = |[x0, y0]: [u32; 2], [x1, y1]: [u32; 2]| {
        let mut sums = BlockSums::default();
        for y in y0..y1.min(height) {
            let row = y as usize * width as usize;
            for i in row + x0 as usize..row + x1.min(width) as usize {
                sums.add(a[i], b[i], var_a[i], var_b[i]);
            }
        }
        sums.block([x0, y0])
    };
    let corners = (0..height)
        .step_by(block as usize)
        .flat_map(|y| (0..width).step_by(block as usize).map(move |x| [x, y]));
    let blocks = corners.map(|[x, y]| compare([x, y], [x + block, y + block])).collect();
    BlockReport { blocks, whole: compare([0, 0], [width, height]) }
}

/// Sums over the pixels of a block.
#[derive(Default)]
struct BlockSums {
    count: f64,
    a: [f64; 3],
    b: [f64; 3],
    variance: [f64; 3],
}

impl BlockSums {
    fn add(&mut self, a: [f32; 3], b: [f32; 3], var_a: [f32; 3], var_b: [f32; 3]) {
        self.count += 1.0;
        for c in 0..3 {
            self.a[c] += f64::from(a[c]);
            self.b[c] += f64::from(b[c]);
            self.variance[c] += f64::from(var_a[c]) + f64::from(var_b[c]);
        }
    }

    fn block(&self, corner: [u32; 2]) -> Block {
        let (a, b) = (self.a.map(|s| s / self.count), self.b.map(|s| s / self.count));
        let level = (0..3).map(|c| a[c].abs() + b[c].abs()).sum::<f64>() / 6.0;
        let ratio = |x: f64, y: f64| if x == 0.0 { 0.0 } else { x / y };
        let greatest = |f: &dyn Fn(usize) -> f64| (0..3).map(f).fold(0.0, nan_max);
        let difference = |c: usize| (a[c] - b[c]).abs();
        let error = |c: usize| self.variance[c].sqrt() / self.count;
        Block {
            corner,
            a,
            b,
            relative: greatest(&|c| ratio(difference(c), level)),
            standard_errors: greatest(&|c| ratio(difference(c), error(c))),
        }
    }
}

/// Maximum of two numbers; NaN if either is NaN.
fn nan_max(x: f64, y: f64) -> f64 {
    if x.is_nan() || y.is_nan() { f64::NAN } else { x.max(y) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: (u32, u32) = (20, 10);

    fn compare(a: &[[f32; 3]], b: &[[f32; 3]], variance: f32) -> BlockReport {
        let v = vec![[variance; 3]; a.len()];
        compare_blocks(a, b, &v, &v, SIZE.0, SIZE.1, 8)
    }

    #[test]
    fn differences_are_found_where_they_are() {
        let a = vec![[1.0; 3]; 200];
        let mut b = a.clone();
        // A pixel of the block at (8, 0), which has 64.
        b[3 * 20 + 10] = [1.0, 1.64, 1.0];
        let report = compare(&a, &b, 0.5);
        assert_eq!(report.blocks.len(), 6);
        let worst = report.worst();
        assert_eq!(worst.corner, [8, 0]);
        // 0.64/64 = 0.01 of a level of 1 + 0.01/6; the standard error is √(64·(½ + ½))/64 = ⅛.
        assert!((worst.relative - 0.01 / (1.0 + 0.01 / 6.0)).abs() < 1e-6);
        assert!((worst.standard_errors - 0.08).abs() < 1e-6);
        assert_eq!(report.beyond(0.005, 0.05).len(), 1);
        assert!(report.beyond(0.005, 0.1).is_empty() && report.beyond(0.02, 0.05).is_empty());
    }

    #[test]
    fn blocks_cover_every_pixel_once() {
        let a: Vec<_> = (0..200u8).map(|i| [f32::from(i); 3]).collect();
        let report = compare(&a, &a, 1.0);
        let pixels =
            |b: &Block| f64::from((SIZE.0 - b.corner[0]).min(8) * (SIZE.1 - b.corner[1]).min(8));
        let sum: f64 = report.blocks.iter().map(|b| b.a[0] * pixels(b)).sum();
        assert!((sum - 199.0 * 100.0).abs() < 1e-9);
        assert_eq!((report.whole.relative, report.whole.standard_errors), (0.0, 0.0));
    }

    #[test]
    fn what_is_no_number_is_beyond_everything() {
        let a = vec![[0.0; 3]; 200];
        let mut b = a.clone();
        b[0][2] = f32::NAN;
        assert_eq!(compare(&a, &b, 1.0).beyond(1e9, 1e9).len(), 1);
        b[0][2] = 1.0;
        let report = compare(&a, &b, 0.0);
        assert_eq!(report.worst().standard_errors, f64::INFINITY);
    }
}
