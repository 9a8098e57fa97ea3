//! Mipmap levels of images. [Williams 1983, "Pyramidal Parametrics"]

use pt_math::Vec2;

/// Width and height of a level, and its values row by row.
pub(crate) type MipLevel = ([u32; 2], Vec<[f32; 3]>);

/// Returns the coarser levels of an image, each of half the width and height of the one before,
/// down to one value.
pub(crate) fn mip_levels(size: [u32; 2], pixels: &[[f32; 3]]) -> impl Iterator<Item = MipLevel> {
    let half = |size: [u32; 2], pixels: &[[f32; 3]]| (size != [1, 1]).then(|| halved(size, pixels));
    std::iter::successors(half(size, pixels), move |(size, pixels)| half(*size, pixels))
}

/// Returns an image of half the size (rounded down, and at least 1). Each value is the mean over
/// the area that it covers, so the mean of the image is preserved.
fn halved([width, height]: [u32; 2], pixels: &[[f32; 3]]) -> MipLevel {
    let half = [width, height].map(|n| (n / 2).max(1));
    let (columns, rows) = (covered(width, half[0]), covered(height, half[1]));
    let value = |row: &[(usize, f64)], column: &[(usize, f64)]| {
        let mut sum = [0.0; 3];
        for &(y, of_row) in row {
            for &(x, of_column) in column {
                let pixel = pixels[y * width as usize + x];
                for (sum, channel) in sum.iter_mut().zip(pixel) {
                    *sum += f64::from(channel) * of_row * of_column;
                }
            }
        }
        sum.map(|s| s as f32)
    };
    let all = rows.iter().flat_map(|row| columns.iter().map(|column| value(row, column)));
    (half, all.collect())
}

/// Returns the indices of the values, of `n`, that each of `half` values covers, with their
/// weights.
fn covered(n: u32, half: u32) -> Vec<Vec<(usize, f64)>> {
    let step = f64::from(n) / f64::from(half);
    let of_one = |i: u32| {
        let (start, end) = (f64::from(i) * step, (f64::from(i + 1) * step).min(f64::from(n)));
        let share = |j: u32| {
            let inside = end.min(f64::from(j + 1)) - start.max(f64::from(j));
            (j as usize, inside / step)
        };
        (start as u32..end.ceil() as u32).map(share).collect()
    };
    (0..half).map(of_one).collect()
}

/// Returns the length of the shorter axis of the ellipse to which a linear map, given by the images
/// of the unit vectors, maps the unit circle: its smaller singular value.
#[inline]
pub(crate) fn shorter_axis([a, b]: [Vec2; 2]) -> f32 {
    let sum = a.length_squared() + b.length_squared();
    let determinant = a.perp_dot(b);
    let root = (sum * sum - 4.0 * determinant * determinant).max(0.0).sqrt();
    // The product of both singular values is the determinant; dividing by the greater avoids
    // cancellation.
    let greater = (0.5 * (sum + root)).sqrt();
    if greater > 0.0 { determinant.abs() / greater } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;

    fn mean(pixels: &[[f32; 3]]) -> [f64; 3] {
        let n = pixels.len() as f64;
        [0, 1, 2].map(|c| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / n)
    }

    /// For various widths and heights, also where levels are not exact halves.
    #[test]
    fn every_level_has_the_mean_of_the_image() {
        let mut random = Random::new(5);
        for size in [[1, 1], [2, 2], [64, 64], [37, 21], [1, 13], [100, 3], [5, 128]] {
            let count = (size[0] * size[1]) as usize;
            let pixels: Vec<[f32; 3]> =
                (0..count).map(|_| [random.unit(), random.unit() * 9.0, random.unit()]).collect();
            let want = mean(&pixels);
            let mut last = size;
            for (size, pixels) in mip_levels(size, &pixels) {
                assert_eq!(size, last.map(|n| (n / 2).max(1)));
                assert_eq!(pixels.len(), (size[0] * size[1]) as usize);
                let found = mean(&pixels);
                let near = found.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-6 * b);
                assert!(near, "{size:?}: {found:?} {want:?}");
                last = size;
            }
            assert_eq!(last, [1, 1]);
        }
    }

    /// For a circle that is stretched and rotated, and rotated by any angle before.
    #[test]
    fn ellipses_have_their_shorter_axis() {
        let mut random = Random::new(6);
        for _ in 0..1000 {
            let [long, share, turn, before] = [(); 4].map(|()| random.unit() + 0.01);
            let (long, short) = (10.0 * long, 10.0 * long * share.min(1.0));
            let (axis, turned) = (Vec2::from_angle(6.0 * turn), Vec2::from_angle(6.0 * before));
            let image = |v: Vec2| axis * (long * v.x) + axis.perp() * (short * v.y);
            let found = shorter_axis([image(turned), image(turned.perp())]);
            assert!((found / short - 1.0).abs() < 1e-4, "{found} {short}");
        }
        assert_eq!(shorter_axis([Vec2::ZERO; 2]), 0.0);
        assert_eq!(shorter_axis([Vec2::X, Vec2::X]), 0.0);
    }
}
