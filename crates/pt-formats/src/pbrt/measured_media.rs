//! Measured media, by their names in pbrt-v4.

use crate::shared::names::{did_you_mean, quote};

/// Coefficients of a medium per millimetre, for red, green and blue. The scattering coefficient is
/// reduced: σs (1 − g).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MeasuredMedium {
    name: &'static str,
    pub(super) scattered: [f32; 3],
    pub(super) absorbed: [f32; 3],
}

impl MeasuredMedium {
    /// Returns the medium with a name.
    ///
    /// # Errors
    /// If there is none; the message suggests the closest name.
    pub(super) fn named(name: &str) -> Result<Self, String> {
        let known = SOLID_AND_LIQUID.iter().chain(DILUTED);
        known.clone().find(|medium| medium.name == name).copied().ok_or_else(|| {
            let hint = did_you_mean(name, known.map(|medium| medium.name));
            format!(
                "unknown measured medium {}{hint}; otherwise give sigma_a and sigma_s",
                quote(name)
            )
        })
    }
}

const fn medium(name: &'static str, scattered: [f32; 3], absorbed: [f32; 3]) -> MeasuredMedium {
    MeasuredMedium { name, scattered, absorbed }
}

/// Solids and liquids. [Jensen, Marschner, Levoy & Hanrahan 2001, "A Practical Model for Subsurface
/// Light Transport", figure 5]
const SOLID_AND_LIQUID: &[MeasuredMedium] = &[
    medium("Apple", [2.29, 2.39, 1.97], [0.003, 0.0034, 0.046]),
    medium("Chicken1", [0.15, 0.21, 0.38], [0.015, 0.077, 0.19]),
    medium("Chicken2", [0.19, 0.25, 0.32], [0.018, 0.088, 0.2]),
    medium("Cream", [7.38, 5.47, 3.15], [0.0002, 0.0028, 0.0163]),
    medium("Ketchup", [0.18, 0.07, 0.03], [0.061, 0.97, 1.45]),
    medium("Marble", [2.19, 2.62, 3.0], [0.0021, 0.0041, 0.0071]),
    medium("Potato", [0.68, 0.7, 0.55], [0.0024, 0.009, 0.12]),
    medium("Skimmilk", [0.7, 1.22, 1.9], [0.0014, 0.0025, 0.0142]),
    medium("Skin1", [0.74, 0.88, 1.01], [0.032, 0.17, 0.48]),
    medium("Skin2", [1.09, 1.59, 1.79], [0.013, 0.07, 0.145]),
    medium("Spectralon", [11.6, 20.4, 14.9], [0.0, 0.0, 0.0]),
    medium("Wholemilk", [2.55, 3.21, 3.77], [0.0011, 0.0024, 0.014]),
];

/// Liquids measured in dilution, with the dilution undone. [Narasimhan, Gupta, Donner, Ramamoorthi,
/// Nayar & Jensen 2006, "Acquiring Scattering Properties of Participating Media by Dilution"]
const DILUTED: &[MeasuredMedium] = &[
    medium("Lowfat Milk", [0.891_87, 1.5136, 2.532], [0.002_875, 0.005_75, 0.0115]),
    medium("Reduced Milk", [2.4858, 3.1669, 4.5214], [0.002_555_6, 0.005_111_1, 0.012_778]),
    medium("Regular Milk", [4.5513, 5.8294, 7.136], [0.001_533_3, 0.0046, 0.019_933]),
    medium("Espresso", [0.723_78, 0.845_57, 1.0247], [4.7984, 6.5751, 8.8493]),
    medium("Mint Mocha Coffee", [0.316_02, 0.385_38, 0.481_31], [3.772, 5.8228, 7.82]),
    medium(
        "Lowfat Soy Milk",
        [0.305_76, 0.342_33, 0.616_64],
        [0.001_437_5, 0.007_187_5, 0.035_937],
    ),
    medium("Regular Soy Milk", [0.592_23, 0.738_66, 1.4693], [0.001_916_7, 0.009_583_3, 0.065_167]),
    medium("Lowfat Chocolate Milk", [0.649_25, 0.839_16, 1.1057], [0.0115, 0.0368, 0.1564]),
    medium("Regular Chocolate Milk", [1.4585, 2.1289, 2.9527], [0.010_063, 0.043_125, 0.143_75]),
    medium("Coke", [0.000_089_053, 0.000_083_72, 0.0], [0.100_14, 0.165_03, 0.2468]),
    medium("Pepsi", [0.000_061_697, 0.000_042_564, 0.0], [0.091_641, 0.141_58, 0.207_29]),
    medium(
        "Sprite",
        [0.000_006_030_6, 0.000_006_413_9, 0.000_006_550_4],
        [0.001_886, 0.001_830_8, 0.002_002_5],
    ),
    medium("Gatorade", [0.002_457_4, 0.003_007, 0.003_732_5], [0.024_794, 0.019_289, 0.008_878]),
    medium(
        "Chardonnay",
        [0.000_017_982, 0.000_013_758, 0.000_012_023],
        [0.010_782, 0.011_855, 0.023_997],
    ),
    medium(
        "White Zinfandel",
        [0.000_017_501, 0.000_019_069, 0.000_012_88],
        [0.012_072, 0.016_184, 0.019_843],
    ),
    medium("Merlot", [0.000_021_129, 0.0, 0.0], [0.116_32, 0.251_91, 0.294_34]),
    medium(
        "Budweiser Beer",
        [0.000_024_356, 0.000_024_079, 0.000_010_564],
        [0.011_492, 0.024_911, 0.057_786],
    ),
    medium(
        "Coors Light Beer",
        [0.000_050_922, 0.000_043_01, 0.0],
        [0.006_164, 0.013_984, 0.034_983],
    ),
    medium("Clorox", [0.002_403_5, 0.003_137_3, 0.003_991], [0.003_354_2, 0.014_892, 0.026_297]),
    medium(
        "Apple Juice",
        [0.000_136_12, 0.000_158_36, 0.000_227],
        [0.012_957, 0.023_741, 0.052_184],
    ),
    medium(
        "Cranberry Juice",
        [0.000_104_02, 0.000_116_46, 0.000_078_139],
        [0.039_437, 0.094_223, 0.124_26],
    ),
    medium("Grape Juice", [0.000_053_82, 0.0, 0.0], [0.104_04, 0.239_58, 0.293_25]),
    medium(
        "Ruby Grapefruit Juice",
        [0.011_002, 0.010_927, 0.011_036],
        [0.085_867, 0.183_14, 0.252_62],
    ),
    medium(
        "White Grapefruit Juice",
        [0.228_26, 0.239_98, 0.327_48],
        [0.0138, 0.018_831, 0.056_781],
    ),
    medium("Shampoo", [0.000_717_6, 0.000_830_3, 0.000_901_6], [0.014_107, 0.045_693, 0.061_717]),
    medium(
        "Strawberry Shampoo",
        [0.000_156_71, 0.000_159_47, 0.000_015_18],
        [0.014_49, 0.057_96, 0.075_823],
    ),
    medium(
        "Head & Shoulders Shampoo",
        [0.023_805, 0.028_804, 0.034_306],
        [0.084_621, 0.156_88, 0.203_65],
    ),
    medium("Lemon Tea Powder", [0.040_224, 0.045_264, 0.051_081], [2.4288, 4.5757, 7.2127]),
    medium(
        "Orange Powder",
        [0.000_156_17, 0.000_174_82, 0.000_176_2],
        [0.001_449, 0.003_441, 0.007_863],
    ),
    medium(
        "Pink Lemonade Powder",
        [0.000_121_03, 0.000_130_73, 0.000_125_28],
        [0.001_165, 0.002_366, 0.003_195],
    ),
    medium("Cappuccino Powder", [1.8436, 2.5851, 2.1662], [35.844, 49.547, 61.084]),
    medium("Salt Powder", [0.027_333, 0.032_451, 0.031_979], [0.284_15, 0.3257, 0.341_48]),
    medium(
        "Sugar Powder",
        [0.000_222_72, 0.000_255_13, 0.000_271],
        [0.012_638, 0.031_051, 0.050_124],
    ),
    medium("Suisse Mocha Powder", [2.7979, 3.5452, 4.3365], [17.502, 27.004, 35.433]),
    medium(
        "Pacific Ocean Surface Water",
        [0.000_176_4, 0.000_320_95, 0.000_196_17],
        [0.031_845, 0.031_324, 0.030_147],
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn media_have_names_and_numbers_of_at_least_0() {
        let all: Vec<_> = SOLID_AND_LIQUID.iter().chain(DILUTED).collect();
        assert_eq!(all.len(), 47);
        for medium in all {
            assert_eq!(MeasuredMedium::named(medium.name), Ok(*medium));
            let sums = [0, 1, 2].map(|c| medium.scattered[c] + medium.absorbed[c]);
            assert!(sums.iter().all(|sum| *sum > 0.0), "{medium:?}");
            let numbers = medium.scattered.into_iter().chain(medium.absorbed);
            assert!(numbers.into_iter().all(|sigma| sigma >= 0.0), "{medium:?}");
        }
        let message = MeasuredMedium::named("Skin3").expect_err("no medium");
        assert!(message.contains("did you mean \"Skin"), "{message}");
    }
}
