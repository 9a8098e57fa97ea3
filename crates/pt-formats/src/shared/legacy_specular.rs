//! Glosses that other descriptions give by other numbers than ours.

use crate::material::{Diffuse, Plastic};
use crate::{Color, Surface};

/// Luminance from which a specular colour or a reflectivity makes a second lobe. Water, the
/// dullest of common dielectrics, reflects 0.02 at normal incidence; what is below is what
/// exporters write for none.
pub(super) const MIN: f32 = 0.02;
/// Exponent of glosses that give none: what modelling tools start with.
pub(super) const DEFAULT_EXPONENT: f32 = 50.0;

/// A diffuse surface with the gloss of a specular colour and Phong's exponent, from 0 up; without a
/// gloss where the colour is as good as black. It is the same from both sides.
pub(super) fn phong(diffuse: Color, specular: Color, exponent: f32) -> Surface {
    if amount(&specular) <= MIN {
        return Diffuse { reflectance: diffuse, two_sided: true }.into();
    }
    Plastic { diffuse, specular, alpha: alpha(exponent), two_sided: true }.into()
}

/// Roughness α of the Beckmann distribution nearest to cosˢ: α² = 2/(s + 2). [Walter et al. 2007,
/// section 5.2]
pub(super) fn alpha(exponent: f32) -> f32 {
    (2.0 / (exponent + 2.0)).sqrt()
}

/// The roughness, from 0 to 1, of the coat of Burley of a gloss: its square α is 0.1 at gloss 0 and
/// 0.001 at gloss 1. [Burley 2012, app. B]
pub(super) fn roughness_of_coat(gloss: f32) -> f32 {
    (0.1 - (0.1 - 0.001) * gloss.clamp(0.0, 1.0)).sqrt()
}

/// The luminance of a colour; of a texture, that of a grey in the middle.
pub(super) fn amount(color: &Color) -> f32 {
    match color {
        Color::Value(color) => luminance(*color),
        Color::Texture(_) => 0.5,
    }
}

/// Luminance of linear Rec. 709.
pub(super) fn luminance([r, g, b]: [f32; 3]) -> f32 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_roughness_of_a_coat_is_the_root_of_its_alpha() {
        for (gloss, alpha) in [(0.0, 0.1), (0.5, 0.0505), (1.0, 0.001_f32)] {
            assert!((roughness_of_coat(gloss).powi(2) - alpha).abs() < 1e-6);
        }
    }
}
