//! Automatic exposure, and detection of images that are nearly black or white.

use pt_math::color;
use pt_scene::image::Image;

/// Target of the logarithmic mean of the luminance. [Reinhard, Stark, Shirley & Ferwerda 2002,
/// "Photographic Tone Reproduction for Digital Images", eq. 1 and 2: the key of an image]
const KEY: f64 = 0.18;
/// Fraction of pixels that remain below white.
const BELOW_WHITE: f64 = 0.95;
/// Fraction of pixels that counts as nearly all.
const NEARLY_ALL: f64 = 0.99;
/// Luminance below which 8-bit sRGB rounds to level 0: half of 1/255 in the linear part of the sRGB
/// curve.
const BLACK: f64 = 0.5 / 255.0 / 12.92;

/// An image with nearly all pixels black or white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Extreme {
    /// Entirely black.
    Nothing,
    /// Black on a screen for lack of exposure.
    Dark,
    /// White on a screen for excess of exposure.
    Bright,
}

/// Returns the exposure in stops with which the logarithmic mean of the luminance of all pixels
/// that are not black becomes 0.18, limited so that 19 of 20 of them stay below white. 0 for images
/// without such pixels.
pub fn auto_exposure(image: &Image) -> f32 {
    let mut luminances = luminances(image);
    luminances.retain(|y| *y > 0.0);
    if luminances.is_empty() {
        return 0.0;
    }
    luminances.sort_by(f64::total_cmp);
    let sum: f64 = luminances.iter().map(|y| libm::log2(*y)).sum();
    let mean = libm::exp2(sum / luminances.len() as f64);
    let bright = share(&luminances, BELOW_WHITE);
    libm::log2((KEY / mean).min(1.0 / bright)) as f32
}

/// Returns the extreme of nearly all pixels at an exposure in stops, or `None`.
pub fn extreme(image: &Image, stops: f32) -> Option<Extreme> {
    let mut luminances = luminances(image);
    if luminances.is_empty() {
        return None;
    }
    luminances.sort_by(f64::total_cmp);
    let scale = libm::exp2(f64::from(stops));
    if share(&luminances, NEARLY_ALL) * scale < BLACK {
        let is_light = luminances.last().is_some_and(|most| *most > 0.0);
        return Some(if is_light { Extreme::Dark } else { Extreme::Nothing });
    }
    let dark = share(&luminances, 1.0 - NEARLY_ALL);
    (dark * scale >= 1.0).then_some(Extreme::Bright)
}

/// Returns the finite luminances of all pixels. [ITU-R BT.709]
fn luminances(image: &Image) -> Vec<f64> {
    let luminance = |pixel: &[f32; 3]| color::luminance(pixel.map(f64::from));
    image.pixels.iter().map(luminance).filter(|y| y.is_finite()).collect()
}

/// Returns a quantile of sorted numbers.
fn share(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: Vec<f32>) -> Image {
        let width = pixels.len() as u32;
        Image { width, height: 1, pixels: pixels.into_iter().map(|v| [v; 3]).collect() }
    }

    /// Pixels of 2⁻⁶ and 2⁻⁴ in equal numbers have the logarithmic mean 2⁻⁵; black pixels are
    /// ignored, and the order has no effect.
    #[test]
    fn the_mean_of_logarithms_becomes_the_key() {
        let want = (0.18f64 * 32.0).log2() as f32;
        let mut pixels = [vec![0.015_625; 50], vec![0.0625; 50], vec![0.0; 900]].concat();
        let first = auto_exposure(&image(pixels.clone()));
        assert!((first - want).abs() < 1e-6, "{first}, {want}");
        pixels.reverse();
        assert_eq!(auto_exposure(&image(pixels)).to_bits(), first.to_bits());
        assert_eq!(auto_exposure(&image(vec![0.0; 4])), 0.0);
    }

    /// If a tenth of the pixels is far brighter, these become white.
    #[test]
    fn bright_pixels_stay_below_white() {
        let pixels = [vec![0.125; 90], vec![8.0; 10]].concat();
        assert_eq!(auto_exposure(&image(pixels)), -3.0);
    }

    #[test]
    fn what_is_nearly_all_of_one_kind_is_distinguished_from_what_is_not() {
        let black = |rest: &[f32]| image([&[0.0; 198], rest].concat());
        assert_eq!(extreme(&black(&[0.0, 0.0]), 0.0), Some(Extreme::Nothing));
        assert_eq!(extreme(&black(&[0.5, 0.0]), 0.0), Some(Extreme::Dark));
        assert_eq!(extreme(&black(&[0.5; 3]), 0.0), None);
        let dim = image(vec![1e-5; 100]);
        assert_eq!([extreme(&dim, 0.0), extreme(&dim, 8.0)], [Some(Extreme::Dark), None]);
        let bright = image(vec![2.0; 100]);
        assert_eq!([extreme(&bright, 0.0), extreme(&bright, -2.0)], [Some(Extreme::Bright), None]);
        assert_eq!(extreme(&image(vec![f32::NAN; 3]), 0.0), None);
    }
}
