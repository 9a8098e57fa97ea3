//! Colour spaces, by the chromaticities of their primaries.

use pt_math::{DMat3, DVec3, cie};

/// A linear colour space, by the chromaticities of its primaries and its white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct ColorSpace {
    pub(super) name: &'static str,
    /// x and y of red, green, blue and white.
    chromaticities: [[f64; 2]; 4],
}

/// Chromaticity of D65. [ITU-R BT.709]
pub(super) const D65: [f64; 2] = [0.3127, 0.3290];

impl ColorSpace {
    /// Rec. 709, the colour space of all scenes.
    pub(super) const SRGB: Self =
        Self { name: "srgb", chromaticities: [[0.64, 0.33], [0.30, 0.60], [0.15, 0.06], D65] };

    /// All colour spaces of pbrt-v4. [SMPTE RP 431-2 with white D65, ITU-R BT.2020, SMPTE ST
    /// 2065-1]
    pub(super) const ALL: [Self; 4] = [
        Self::SRGB,
        Self { name: "dci-p3", chromaticities: [[0.68, 0.32], [0.265, 0.69], [0.15, 0.06], D65] },
        Self {
            name: "rec2020",
            chromaticities: [[0.708, 0.292], [0.170, 0.797], [0.131, 0.046], D65],
        },
        Self {
            name: "aces2065-1",
            chromaticities: [[0.7347, 0.2653], [0.0, 1.0], [0.0001, -0.077], [0.32168, 0.33767]],
        },
    ];

    /// Converts a colour of this space to linear Rec. 709. Negative channels, of colours outside of
    /// its gamut, become 0.
    ///
    /// The columns of RGB to XYZ are the primaries, scaled so that they add up to white with Y = 1.
    pub(super) fn to_rec709(self, rgb: [f64; 3]) -> [f64; 3] {
        if self == Self::SRGB {
            return rgb;
        }
        let [red, green, blue, white] = self.chromaticities.map(xyz_of);
        let primaries = DMat3::from_cols(red, green, blue);
        let shares = primaries.inverse() * white;
        let xyz = primaries * (shares * DVec3::from_array(rgb));
        cie::rec709_from_xyz(xyz.to_array()).map(|c| c.max(0.0))
    }
}

/// CIE XYZ of a chromaticity, with Y = 1.
pub(super) fn xyz_of([x, y]: [f64; 2]) -> DVec3 {
    DVec3::new(x / y, 1.0, (1.0 - x - y) / y)
}

/// Returns light of a chromaticity in linear Rec. 709, with luminance 1.
pub(super) fn light_of(chromaticity: [f64; 2]) -> [f64; 3] {
    cie::rec709_from_xyz(xyz_of(chromaticity).to_array()).map(|c| c.max(0.0))
}

#[cfg(test)]
mod tests {
    use pt_math::color::luminance;

    use super::*;

    #[test]
    fn white_of_d65_is_white_in_all_spaces_that_have_it() {
        for space in &ColorSpace::ALL[..3] {
            for c in space.to_rec709([1.0; 3]) {
                assert!((c - 1.0).abs() < 2e-3, "{}: {c}", space.name);
            }
        }
        let white = ColorSpace::ALL[3].to_rec709([1.0; 3]);
        assert!(white[0] > 1.0 && white[2] < 1.0 && (luminance(white) - 1.0).abs() < 2e-3);
    }

    #[test]
    fn what_rec709_has_not_is_cut() {
        let [_, green, blue] = ColorSpace::ALL[2].to_rec709([1.0, 0.0, 0.0]);
        assert_eq!((green, blue), (0.0, 0.0));
        let [r, g, b] = light_of(D65);
        assert!([r, g, b].iter().all(|c| (c - 1.0).abs() < 2e-3));
    }
}
