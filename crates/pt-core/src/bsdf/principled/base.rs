//! The diffuse part of principled materials: rough diffuse reflection, an approximation of
//! subsurface scattering, and the sheen of cloth.

use std::f32::consts::FRAC_1_PI;

use pt_math::{FloatExt, Spectrum, Vec3};

use crate::bsdf::fresnel::schlick_weight;

/// Parameters of the base under the facets.
#[derive(Clone, Copy, Debug)]
pub(super) struct Base {
    /// Colour of the base.
    pub(super) color: Spectrum,
    /// Roughness from 0 to 1, which brightens the rim.
    pub(super) roughness: f32,
    /// Weight of the approximate subsurface scattering, from 0 to 1.
    pub(super) flatness: f32,
}

/// Colour normalized to luminance 1; white for black.
#[inline]
pub(super) fn tint(color: Spectrum) -> Spectrum {
    let luminance = color.luminance();
    if luminance > 0.0 { color / luminance } else { Spectrum::ONE }
}

/// Cosine between `wi` and the half vector of two directions above the surface.
#[inline]
fn cos_half(wo: Vec3, wi: Vec3) -> f32 {
    wi.dot((wo + wi).normalize())
}

impl Base {
    /// f cos θi for two directions above the surface.
    /// [Burley 2012, "Physically Based Shading at Disney", §5.3; flatness: Burley 2015, "Extending
    /// the Disney BRDF to a BSDF with Integrated Subsurface Scattering", §3, after Hanrahan &
    /// Krueger 1993]
    #[inline]
    pub(super) fn eval(&self, wo: Vec3, wi: Vec3) -> Spectrum {
        let (f_o, f_i) = (schlick_weight(wo.z), schlick_weight(wi.z));
        let cos = cos_half(wo, wi);
        let back = 2.0 * self.roughness * cos * cos;
        let diffuse = (1.0 - 0.5 * f_o) * (1.0 - 0.5 * f_i);
        let retro = back * (f_o + f_i + f_o * f_i * (back - 1.0));
        let ss = 1.0.lerp(0.5 * back, f_o) * 1.0.lerp(0.5 * back, f_i);
        // Multiplied by cos θi, which bounds 1 / (cos θo + cos θi).
        let flat = 1.25 * (ss * (wi.z / (wo.z + wi.z) - 0.5 * wi.z) + 0.5 * wi.z);
        self.color * (FRAC_1_PI * ((diffuse + retro) * wi.z).lerp(flat, self.flatness))
    }
}

/// Blends white with a tint by `amount`, from 0 to 1.
#[inline]
pub(super) fn tinted(tint: Spectrum, amount: f32) -> Spectrum {
    Spectrum::ONE + (tint - Spectrum::ONE) * amount
}

/// Sheen of fibres at the rim, f cos θi: Schlick's weight of the half vector, times a colour.
/// [Burley 2012, §5.4]
#[inline]
pub(super) fn sheen(color: Spectrum, wo: Vec3, wi: Vec3) -> Spectrum {
    color * (sheen_weight(wo, wi) * wi.z)
}

/// Schlick's weight of the half vector.
#[inline]
pub(super) fn sheen_weight(wo: Vec3, wi: Vec3) -> f32 {
    schlick_weight(cos_half(wo, wi))
}

/// Approximate albedo of [`sheen`] at a cosine, for sampling probabilities.
#[inline]
pub(super) fn about_sheen(cos: f32) -> f32 {
    0.05 + 0.4 * schlick_weight(cos)
}
