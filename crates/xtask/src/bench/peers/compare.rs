//! Differences of images from a reference.

use std::path::Path;

use anyhow::{Result, ensure};
use pt_scene::image::Image;

/// Difference of an image from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ImageDifference {
    /// See [`relative_mse`].
    pub(super) relative_mse: f64,
    /// The same error for means of squares of [`COARSE`]² pixels: it measures correlated noise of
    /// neighbours.
    pub(super) coarse_mse: f64,
    /// Ratios of the means of red, green and blue to those of the reference.
    pub(super) mean_ratio: [f64; 3],
}

/// Compares two files.
///
/// # Errors
/// If one cannot be read, or their sizes differ.
pub(super) fn compare(path: &Path, reference: &Path) -> Result<ImageDifference> {
    let [found, wanted] = [pt_image::load(path)?, pt_image::load(reference)?];
    let [size, asked] = [&found, &wanted].map(|i| (i.width, i.height));
    ensure!(
        size == asked,
        "{} has {size:?} pixels, and {} {asked:?}",
        path.display(),
        reference.display()
    );
    Ok(difference(&found, &wanted))
}

fn difference(found: &Image, wanted: &Image) -> ImageDifference {
    let [mean, asked] = [found, wanted].map(means);
    ImageDifference {
        relative_mse: relative_mse(found, wanted),
        coarse_mse: relative_mse(&coarse(found), &coarse(wanted)),
        mean_ratio: [0, 1, 2].map(|c| mean[c] / asked[c]),
    }
}

/// Mean of (I − R)² / (R² + 0.01) over pixels and channels.
fn relative_mse(found: &Image, wanted: &Image) -> f64 {
    let pairs = found.pixels.as_flattened().iter().zip(wanted.pixels.as_flattened());
    let error = |(&i, &r): (&f32, &f32)| {
        let [i, r] = [i, r].map(f64::from);
        (i - r) * (i - r) / (r * r + 0.01)
    };
    pairs.map(error).sum::<f64>() / (3 * wanted.pixels.len()) as f64
}

/// Side of the squares of [`ImageDifference::coarse_mse`].
pub(super) const COARSE: u32 = 8;

/// Means of squares of pixels; incomplete squares at the right and bottom are omitted.
fn coarse(image: &Image) -> Image {
    let [width, height] = [image.width, image.height].map(|side| side / COARSE);
    let mean = |i: u32| {
        let [x, y] = [i % width, i / width].map(|v| v * COARSE);
        let row = |y: u32| (y * image.width + x) as usize;
        let pixels = (y..y + COARSE).flat_map(|y| &image.pixels[row(y)..][..COARSE as usize]);
        let sum = pixels.fold([0.0; 3], |sum: [f32; 3], p| [0, 1, 2].map(|c| sum[c] + p[c]));
        sum.map(|s| s / (COARSE * COARSE) as f32)
    };
    Image { width, height, pixels: (0..width * height).map(mean).collect() }
}

fn means(image: &Image) -> [f64; 3] {
    let sum = |c: usize| image.pixels.iter().map(|p| f64::from(p[c])).sum::<f64>();
    [0, 1, 2].map(|c| sum(c) / image.pixels.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_to_the_reference() {
        let image = |value| Image { width: 16, height: 9, pixels: vec![[value; 3]; 144].into() };
        let d = difference(&image(1.1), &image(1.0));
        assert!((d.relative_mse - 0.01 / 1.01).abs() < 1e-6);
        assert!((d.coarse_mse - d.relative_mse).abs() < 1e-6);
        assert!(d.mean_ratio.iter().all(|r| (r - 1.1).abs() < 1e-6));
    }

    #[test]
    fn noise_that_neighbours_do_not_share_is_gone_in_squares() {
        let pixels = (0..144).map(|i| [if i % 2 == 0 { 1.5 } else { 0.5 }; 3]).collect();
        let noisy = Image { width: 16, height: 9, pixels };
        let d = difference(&noisy, &Image { pixels: vec![[1.0; 3]; 144].into(), ..noisy.clone() });
        assert!((d.relative_mse - 0.25 / 1.01).abs() < 1e-6 && d.coarse_mse < 1e-12, "{d:?}");
    }
}
