//! Principled materials.

use crate::texture::{Color, Scalar};

/// The principled material: a diffuse base with sheen, facets that reflect as a dielectric or a
/// metal or transmit light, and a clear coat. Parameters are in [0, 1]. [Burley 2012, "Physically
/// Based Shading at Disney"; Burley 2015, "Extending the Disney BRDF to a BSDF with Integrated
/// Subsurface Scattering"; as in Mitsuba 3]
#[derive(Clone, Debug, PartialEq)]
pub struct Principled {
    /// Colour of the base, the metal, and of transmitted light (its square root at each surface).
    pub base_color: Color,
    /// √α of the GGX facets.
    pub roughness: Scalar,
    /// Elongation of highlights along the direction of increasing u.
    pub anisotropic: Scalar,
    /// Weight of the metal.
    pub metallic: Scalar,
    /// Weight of transmission in the dielectric.
    pub spec_trans: Scalar,
    /// Index of refraction of the back side over that of the front side.
    pub ior: f32,
    /// Fraction of the base's tint in the reflection of the dielectric.
    pub spec_tint: Scalar,
    /// Amount of sheen.
    pub sheen: Scalar,
    /// Fraction of the base's tint in the sheen.
    pub sheen_tint: Scalar,
    /// Weight of the approximate subsurface scattering against the diffuse reflection.
    pub flatness: Scalar,
    /// Amount of clear coat.
    pub clearcoat: Scalar,
    /// Gloss of the clear coat, from satin to glossy.
    pub clearcoat_gloss: Scalar,
    /// True if the back side reflects as the front does; otherwise it transmits light or is black.
    pub two_sided: bool,
}

impl Default for Principled {
    /// A grey dielectric of index 1.5 and roughness ½, with all other weights 0.
    fn default() -> Self {
        let none = || Scalar::Value(0.0);
        Self {
            base_color: [0.5; 3].into(),
            roughness: 0.5.into(),
            anisotropic: none(),
            metallic: none(),
            spec_trans: none(),
            ior: 1.5,
            spec_tint: none(),
            sheen: none(),
            sheen_tint: none(),
            flatness: none(),
            clearcoat: none(),
            clearcoat_gloss: none(),
            two_sided: false,
        }
    }
}

impl Principled {
    /// Returns true if the surface transmits light anywhere.
    pub fn transmits(&self) -> bool {
        self.spec_trans != Scalar::Value(0.0)
    }
}

/// [`Principled`] for thin sheets, which light leaves at the point where it enters, such as paper,
/// leaves and frosted panes: diffuse reflection and transmission, and facets that reflect and
/// transmit. Both sides are equal. Parameters are from 0 to 1 unless stated otherwise. [Burley
/// 2015, "Extending the Disney BRDF to a BSDF with Integrated Subsurface Scattering", §5; as in
/// Mitsuba 3]
#[derive(Clone, Debug, PartialEq)]
pub struct PrincipledThin {
    /// Colour of the diffuse part, and of light that facets transmit.
    pub base_color: Color,
    /// √α of the reflecting GGX facets; transmission is smoother for an index below 2.08.
    pub roughness: Scalar,
    /// Elongation of highlights along the direction of increasing u.
    pub anisotropic: Scalar,
    /// Weight of the facets; the remainder is diffuse.
    pub spec_trans: Scalar,
    /// Index of refraction of the sheet over that around it, above 0.
    pub ior: f32,
    /// Fraction of the base's tint in the reflection of facets.
    pub spec_tint: Scalar,
    /// Amount of sheen.
    pub sheen: Scalar,
    /// Fraction of the base's tint in the sheen.
    pub sheen_tint: Scalar,
    /// Weight of the approximate subsurface scattering against the diffuse reflection.
    pub flatness: Scalar,
    /// Diffuse transmission, from 0, all diffuse light is reflected, to 2, all is transmitted.
    pub diff_trans: Scalar,
}

impl Default for PrincipledThin {
    /// A grey diffuse sheet, with index 1.5 and roughness ½ for its facets.
    fn default() -> Self {
        let none = || Scalar::Value(0.0);
        Self {
            base_color: [0.5; 3].into(),
            roughness: 0.5.into(),
            anisotropic: none(),
            spec_trans: none(),
            ior: 1.5,
            spec_tint: none(),
            sheen: none(),
            sheen_tint: none(),
            flatness: none(),
            diff_trans: none(),
        }
    }
}
