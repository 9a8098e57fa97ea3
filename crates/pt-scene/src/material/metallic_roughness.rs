//! The metallic-roughness material of glTF.

use std::sync::Arc;

use crate::texture::{Color, NormalOrBump, Scalar, Texture};

/// Normals of a clear coat.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum CoatNormals {
    /// Normals of the layers below, with their relief.
    #[default]
    Base,
    /// Normals of the shape, without the relief of the layers below.
    Shape,
    /// Normals of the shape, perturbed by a relief of the coat.
    Relief(NormalOrBump),
}

/// The metallic-roughness material of glTF, with its extensions: a mixture of a metal and a
/// dielectric with a diffuse or transmissive base, under sheen and clear coat. Each layer receives
/// the light that the layers above transmit, so that no energy is gained (to 0.6 %, the precision
/// of the tables), and multiple scattering between facets is included. Parameters are from 0 to 1
/// unless stated otherwise. [glTF 2.0, app. B, and the extensions KHR_materials_anisotropy,
/// _clearcoat, _diffuse_transmission, _ior, _iridescence, _sheen, _specular, _transmission,
/// _volume]
#[derive(Clone, Debug, PartialEq)]
pub struct MetallicRoughness {
    /// Colour of the base, of the metal, and of transmitted light: once for sheets, otherwise its
    /// square root at each surface.
    pub base_color: Color,
    /// Weight of the metal.
    pub metallic: Scalar,
    /// √α of the GGX facets.
    pub roughness: Scalar,
    /// Index of refraction of the back side over that of the front side, at least 1.
    pub ior: f32,
    /// Amount of specular reflection of the dielectric.
    pub specular: Scalar,
    /// Colour of the specular reflection of the dielectric at normal incidence; not negative.
    pub specular_color: Color,
    /// Weight of transmission in the dielectric.
    pub transmission: Scalar,
    /// Fraction of the diffuse base that scatters light to the other side; only for sheets.
    pub diffuse_transmission: Scalar,
    /// Colour of diffuse transmission.
    pub diffuse_transmission_color: Color,
    /// Strength of anisotropy: its square interpolates α along [`Self::anisotropy_direction`]
    /// between α across it and 1.
    pub anisotropy: Scalar,
    /// Direction of anisotropy along increasing u and v: the values from 0 to 1 are mapped to −1
    /// to 1.
    pub anisotropy_direction: [Scalar; 2],
    /// Angle in radians by which the direction of anisotropy is rotated from increasing u to
    /// increasing v.
    pub anisotropy_rotation: f32,
    /// Direction that replaces that of increasing u: its red and green channels are the
    /// coefficients of ∂p/∂u and ∂p/∂v.
    pub anisotropy_along: Option<Arc<Texture>>,
    /// Weight of the thin film.
    pub iridescence: Scalar,
    /// Index of refraction of the film, at least 1.
    pub film_ior: f32,
    /// Thickness of the film in nanometres, at least 0.
    pub film_thickness: Scalar,
    /// Colour of the sheen.
    pub sheen_color: Color,
    /// √α of the sheen.
    pub sheen_roughness: Scalar,
    /// Amount of clear coat.
    pub clearcoat: Scalar,
    /// √α of the clear coat.
    pub clearcoat_roughness: Scalar,
    /// The normals of the clear coat.
    pub clearcoat_normals: CoatNormals,
    /// True if the material is a sheet without an interior, equal on both sides.
    pub thin: bool,
    /// True if the back side of opaque parts reflects as the front does; otherwise it is black.
    pub two_sided: bool,
}

impl Default for MetallicRoughness {
    /// A white dielectric of index 1.5 and roughness 1, with all other weights 0.
    fn default() -> Self {
        let (none, white) = (|| Scalar::Value(0.0), || Color::Value([1.0; 3]));
        Self {
            base_color: white(),
            metallic: none(),
            roughness: 1.0.into(),
            ior: 1.5,
            specular: 1.0.into(),
            specular_color: white(),
            transmission: none(),
            diffuse_transmission: none(),
            diffuse_transmission_color: white(),
            anisotropy: none(),
            anisotropy_direction: [1.0.into(), 0.5.into()],
            anisotropy_rotation: 0.0,
            anisotropy_along: None,
            iridescence: none(),
            film_ior: 1.3,
            film_thickness: 400.0.into(),
            sheen_color: [0.0; 3].into(),
            sheen_roughness: none(),
            clearcoat: none(),
            clearcoat_roughness: none(),
            clearcoat_normals: CoatNormals::Base,
            thin: false,
            two_sided: false,
        }
    }
}

impl MetallicRoughness {
    /// Returns true if the surface transmits light anywhere.
    pub fn transmits(&self) -> bool {
        self.transmission != Scalar::Value(0.0) || self.diffuse_transmission != Scalar::Value(0.0)
    }
}
