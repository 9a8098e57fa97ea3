//! The material of glTF.

use std::sync::Arc;

use crate::texture::{Color, NormalOrBump, Scalar, Texture};

/// The normals of a clear coat.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum CoatNormals {
    /// Those of what is below it.
    #[default]
    Base,
    /// Those of the shape, whatever relief is below it.
    Shape,
    /// Those of the shape with a relief of its own.
    Relief(NormalOrBump),
}

/// The material of glTF, with its extensions: a mixture of a metal and of a dielectric with a
/// diffuse base, or with one that light goes through, under a sheen and a clear coat. Each layer
/// has the light that those above leave to it, so that no light is gained (to 0.6 %, the precision
/// of the tables), and light that one facet reflects to another is followed on. Numbers are from 0
/// to 1 where nothing else is said. [glTF 2.0, app. B, and the extensions KHR_materials_anisotropy,
/// _clearcoat, _diffuse_transmission, _ior, _iridescence, _sheen, _specular, _transmission,
/// _volume]
#[derive(Clone, Debug, PartialEq)]
pub struct MetallicRoughness {
    /// Colour of the base, of the metal, and of light that goes through: at once of a sheet, else
    /// its square root at each surface.
    pub base_color: Color,
    /// Share of metal.
    pub metallic: Scalar,
    /// √α of the facets, which are those of GGX.
    pub roughness: Scalar,
    /// Index of refraction of the back side over that of the front side, at least 1.
    pub ior: f32,
    /// Amount of the reflection of the dielectric.
    pub specular: Scalar,
    /// Its colour at normal incidence; not negative.
    pub specular_color: Color,
    /// Share of the dielectric that light goes through.
    pub transmission: Scalar,
    /// Share of the diffuse base that scatters light to the other side; sheets alone have one.
    pub diffuse_transmission: Scalar,
    /// Colour of that light.
    pub diffuse_transmission_color: Color,
    /// How far the roughness α along a direction is from that across it to 1, by its square.
    pub anisotropy: Scalar,
    /// That direction along the surface, where u and then v grow: −1 to 1 as these numbers go from
    /// 0 to 1.
    pub anisotropy_direction: [Scalar; 2],
    /// The angle in radians by which it is turned, from where u grows to where v does.
    pub anisotropy_rotation: f32,
    /// The direction that stands for that in which u grows, if another one does: its red and green
    /// are the shares of ∂p/∂u and ∂p/∂v.
    pub anisotropy_along: Option<Arc<Texture>>,
    /// Share of the surface with a thin film.
    pub iridescence: Scalar,
    /// Index of refraction of the film, at least 1.
    pub film_ior: f32,
    /// Its thickness in nanometres, at least 0.
    pub film_thickness: Scalar,
    /// Colour of the sheen.
    pub sheen_color: Color,
    /// √α of the sheen.
    pub sheen_roughness: Scalar,
    /// Amount of clear coat.
    pub clearcoat: Scalar,
    /// √α of its facets.
    pub clearcoat_roughness: Scalar,
    /// The normals of the clear coat.
    pub clearcoat_normals: CoatNormals,
    /// True if it is a sheet without an inside, the same from both sides.
    pub thin: bool,
    /// True if the back side of what light does not go through reflects as the front does; else it
    /// is black.
    pub two_sided: bool,
}

impl Default for MetallicRoughness {
    /// A white dielectric of index 1.5 and roughness 1, without anything else.
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
    /// Returns true if light goes through it anywhere.
    pub fn transmits(&self) -> bool {
        self.transmission != Scalar::Value(0.0) || self.diffuse_transmission != Scalar::Value(0.0)
    }
}
