//! Change of the number of pixels of an image.

use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Rgba};
use pt_scene::image::Image;

use super::{Decoded, ImageMemory};

type Buffer = ImageBuffer<Rgba<f32>, Vec<f32>>;

impl Decoded {
    /// Returns the image at another size. Pixels are weighted means of premultiplied linear light
    /// with a tent, whose radius is a pixel of the smaller size: without negative weights, there
    /// are no dark seams around lights.
    ///
    /// # Errors
    /// Returns a message if a size is 0, or if the images need more than a gibibyte.
    pub fn resized(self, [width, height]: [u32; 2]) -> Result<Self, String> {
        let own = [self.image.width, self.image.height];
        if [width, height] == own {
            return Ok(self);
        }
        if [width, height].contains(&0) || own.contains(&0) {
            return Err("has no pixels".to_owned());
        }
        // The filter is applied to columns first.
        let pixels =
            u64::from(width.max(own[0])) * u64::from(height) + self.image.pixels.len() as u64;
        let _grant =
            ImageMemory::OF_PROCESS.ask(pixels.checked_mul(size_of::<[f32; 4]>() as u64))?;
        let finite = self.image.pixels.as_flattened().iter().filter(|v| v.is_finite());
        let scale = scale_to_one(finite.clone().fold(0.0, |most, v| most.max(v.abs())));
        let above = self.part_resized([width, height], scale);
        let mut pixels = colors(&above, scale);
        if finite.clone().any(|v| *v < 0.0) {
            let below = self.part_resized([width, height], -scale);
            for (pixel, below) in pixels.iter_mut().zip(colors(&below, scale)) {
                *pixel = [0, 1, 2].map(|c| pixel[c] - below[c]);
            }
        }
        let alpha = self.alpha.is_some().then(|| above.pixels().map(|p| p.0[3]).collect());
        Ok(Self { image: Image { width, height, pixels: pixels.into() }, alpha, frame: None })
    }

    /// Returns the positive part of the scaled image at another size. The library clamps values to
    /// [0, 1].
    fn part_resized(&self, [width, height]: [u32; 2], scale: f32) -> Buffer {
        let alpha = |i: usize| self.alpha.as_ref().map_or(1.0, |alpha| alpha[i]);
        let values = self.image.pixels.iter().enumerate().flat_map(|(i, pixel)| {
            let [r, g, b] = pixel.map(|v| (v * scale).max(0.0));
            [r, g, b, alpha(i)]
        });
        let buffer = Buffer::from_vec(self.image.width, self.image.height, values.collect());
        resize(&buffer.unwrap_or_default(), width, height, FilterType::Triangle)
    }
}

/// Returns the power of two that scales numbers up to `greatest` to numbers up to 1, so that
/// scaling is exact.
fn scale_to_one(greatest: f32) -> f32 {
    if greatest > 1.0 { libm::exp2f(-libm::ceilf(libm::log2f(greatest))) } else { 1.0 }
}

fn colors(buffer: &Buffer, scale: f32) -> Vec<[f32; 3]> {
    buffer.pixels().map(|Rgba([r, g, b, _])| [*r, *g, *b].map(|v| v / scale)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decoded(width: u32, values: &[f32]) -> Decoded {
        let height = values.len() as u32 / width;
        let pixels = values.iter().map(|v| [*v, 2.0 * v, -v]).collect();
        Decoded { image: Image { width, height, pixels }, alpha: None, frame: None }
    }

    /// Constants stay, also above 1 and below 0.
    #[test]
    fn constants_stay() {
        for value in [0.25, 1000.0, 3e38] {
            let image = decoded(4, &[value / 2.0; 12]).resized([7, 2]).expect("it fits").image;
            assert_eq!((image.width, image.height), (7, 2));
            for pixel in image.pixels {
                let expected = [value / 2.0, value, -value / 2.0];
                for c in 0..3 {
                    let error = (pixel[c] - expected[c]).abs();
                    assert!(error <= 1e-6 * value, "{pixel:?}, expected {expected:?}");
                }
            }
        }
    }

    /// Half of the size of one row: the tent has the radius 2 and the weights 1/8, 3/8, 3/8, 1/8 at
    /// distances of 3/2 and 1/2; at the edge, the weights inside are 3/7, 3/7 and 1/7.
    #[test]
    fn means_are_weighted_by_a_tent() {
        let values = [0.0, 7.0, 70.0, 0.0, 0.0, 0.0];
        let image = decoded(6, &values).resized([3, 1]).expect("it fits").image;
        let expected = [3.0 + 10.0, 7.0 / 8.0 + 70.0 * 3.0 / 8.0, 0.0];
        for (pixel, expected) in image.pixels.iter().zip(expected) {
            assert!((pixel[0] - expected).abs() < 1e-4, "{pixel:?}, expected {expected}");
            assert!((pixel[2] + expected).abs() < 1e-4, "{pixel:?}, expected -{expected}");
        }
    }

    #[test]
    fn sizes_beyond_memory_are_refused() {
        let error = decoded(1, &[1.0]).resized([1 << 20, 1 << 20]).expect_err("16 TiB");
        assert!(error.contains("1 GiB"), "{error}");
        assert!(decoded(1, &[1.0]).resized([0, 1]).is_err());
    }
}
