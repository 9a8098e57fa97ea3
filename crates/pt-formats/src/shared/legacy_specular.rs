//! Conversion of Phong exponents and gloss values to roughness.

use pt_math::Spectrum;
use pt_scene::material::{Diffuse, Plastic};
use pt_scene::{Color, Surface};

/// Luminance above which a specular colour or a reflectivity makes a second lobe. Water, the common
/// dielectric with the lowest reflectance, reflects 0.02 at normal incidence; exporters write lower
/// values for none.
pub(crate) const MIN: f32 = 0.02;
/// Default exponent: that of modelling tools.
pub(crate) const DEFAULT_EXPONENT: f32 = 50.0;

/// Returns a diffuse surface with a glossy reflection, from a specular colour and Phong's exponent,
/// at least 0; without the reflection if the colour is nearly black. Both sides are equal.
pub(crate) fn phong(diffuse: Color, specular: Color, exponent: f32) -> Surface {
    if amount(&specular) <= MIN {
        return Diffuse { reflectance: diffuse, two_sided: true }.into();
    }
    Plastic { diffuse, specular, alpha: alpha(exponent), two_sided: true }.into()
}

/// Returns the roughness α of the Beckmann distribution closest to cosˢ: α² = 2/(s + 2). [Walter et
/// al. 2007, section 5.2]
pub(crate) fn alpha(exponent: f32) -> f32 {
    (2.0 / (exponent + 2.0)).sqrt()
}

/// Returns the roughness, from 0 to 1, of a clear coat of Burley's gloss: its square α is 0.1 at
/// gloss 0 and 0.001 at gloss 1. [Burley 2012, app. B]
pub(crate) fn roughness_of_coat(gloss: f32) -> f32 {
    (0.1 - (0.1 - 0.001) * gloss.clamp(0.0, 1.0)).sqrt()
}

/// Returns the luminance of a colour; for a texture, that of a medium grey.
pub(crate) fn amount(color: &Color) -> f32 {
    match color {
        Color::Value(color) => Spectrum::from(*color).luminance(),
        Color::Texture(_) => 0.5,
    }
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
