//! Conversion of films to images.

use crate::film::Film;

/// Mean radiance of each pixel, in rows from the top.
pub fn radiance(film: &Film) -> Vec<[f32; 3]> {
    film.pixels().map(|p| p.mean().map(|v| v as f32)).collect()
}

/// Mean radiance of each pixel, premultiplied by its coverage, and the coverage; 1 if the film does
/// not keep it. In rows from the top.
pub fn rgba(film: &Film) -> Vec<[f32; 4]> {
    let pixels = radiance(film);
    let alpha = film.alpha().unwrap_or_else(|| vec![1.0; pixels.len()]);
    pixels.into_iter().zip(alpha).map(|([r, g, b], a)| [r, g, b, a]).collect()
}

/// Standard error of the mean luminance of each pixel, in rows from the top; infinite for fewer
/// than two samples.
pub fn standard_error(film: &Film) -> Vec<f32> {
    film.pixels().map(|p| p.luminance().1 as f32).collect()
}

/// Returns a false-colour image of the number of samples of each pixel relative to `spp`: blue for
/// none over green for half to red for all, in rows from the top.
pub fn sampling_rate(film: &Film, spp: u32) -> Vec<[u8; 3]> {
    film.pixels().map(|p| rate_color(p.count() as f32 / spp.max(1) as f32)).collect()
}

/// Returns the false colour of a rate in [0, 1].
pub fn rate_color(rate: f32) -> [u8; 3] {
    let byte = |v: f32| (v.clamp(0.0, 1.0) * 255.0) as u8;
    if rate <= 0.5 {
        [0, byte(2.0 * rate), byte(1.0 - 2.0 * rate)]
    } else {
        [byte(2.0 * rate - 1.0), byte(2.0 - 2.0 * rate), 0]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_run_from_blue_over_green_to_red() {
        assert_eq!(rate_color(0.0), [0, 0, 255]);
        assert_eq!(rate_color(0.5), [0, 255, 0]);
        assert_eq!(rate_color(1.0), [255, 0, 0]);
        assert_eq!(rate_color(0.25), [0, 127, 127]);
    }
}
