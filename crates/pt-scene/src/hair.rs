//! Absorption of hair fibres, and the colour of hair that consists of them.

/// Absorption coefficients of eumelanin and pheomelanin in a fibre of radius 1, per unit of
/// concentration. [d'Eon et al. 2011, "An Energy-Conserving Hair Reflectance Model", §6.1]
const EUMELANIN: [f32; 3] = [0.419, 0.697, 1.37];
const PHEOMELANIN: [f32; 3] = [0.187, 0.4, 1.05];
/// Minimum of a channel of a colour; darker channels are clamped to it.
const DARKEST: f32 = 1e-6;

/// Returns the absorption of fibres with these concentrations of eumelanin, which is brown, and
/// pheomelanin, which is red.
pub fn melanin([eumelanin, pheomelanin]: [f32; 2]) -> [f32; 3] {
    std::array::from_fn(|c| eumelanin * EUMELANIN[c] + pheomelanin * PHEOMELANIN[c])
}

/// Returns −ln C / √σa for hair of colour C whose fibres have the absorption σa and this azimuthal
/// roughness, from 0 to 1. [Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model
/// for Production Path Tracing", §4.2]
pub fn slope(roughness: f32) -> f32 {
    const POWERS: [f64; 6] = [0.245, 5.574, -10.73, 2.532, -0.215, 5.969];
    let b = f64::from(roughness.clamp(0.0, 1.0));
    POWERS.iter().fold(0.0, |sum, c| sum * b + c) as f32
}

/// Returns the colour of hair from the absorption of its fibres, C = exp(−√σa · [`slope`]).
pub fn color(absorption: [f32; 3], roughness: f32) -> [f32; 3] {
    let slope = slope(roughness);
    absorption.map(|a| libm::expf(-a.max(0.0).sqrt() * slope))
}

/// Returns the absorption of the fibres of hair from its colour, σa = (ln C / [`slope`])².
pub fn absorption(color: [f32; 3], slope: f32) -> [f32; 3] {
    color.map(|c| {
        let root = libm::logf(c.clamp(DARKEST, 1.0)) / slope;
        root * root
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For β = 0.3, the polynomial is 5.969 − 0.0645 + 0.22788 − 0.28971 + 0.0451494 + 0.000595 =
    /// 5.888415.
    #[test]
    fn the_slope_is_its_polynomial() {
        assert!((slope(0.3) - 5.888_415).abs() < 1e-5);
        assert!((slope(1.0) - 3.375).abs() < 1e-5);
    }

    #[test]
    fn colours_and_what_is_absorbed_are_inverse() {
        for roughness in [0.1, 0.3, 1.0] {
            for a in [0.0, 0.01, 0.5, 3.0] {
                let [back, ..] = absorption(color([a; 3], roughness), slope(roughness));
                assert!((back - a).abs() < 1e-4 * a.max(1.0), "{a}: {back}");
            }
        }
        let black = absorption([0.0; 3], slope(0.3));
        assert!(black.iter().all(|a| *a > 5.0 && a.is_finite()), "{black:?}");
    }
}
