//! Surfaces of the compiled scene.

use pt_math::Spectrum;

use crate::bsdf::LobeRecord;
use crate::id::Id;
use crate::light::AnyLight;
use crate::material::Material;
use crate::texture_record::{FloatTexture, TextureRecord};

/// Scattering and emission of a part of a shape.
#[derive(Clone, Copy, Debug)]
pub struct SurfaceRecord {
    /// Lobe of the surface, unless `material` determines it.
    pub lobe: Id<LobeRecord>,
    /// True if the back side scatters as the front side does.
    pub two_sided: bool,
    /// Material that varies over the surface, if any.
    pub material: Option<Id<Material>>,
    /// Opacity in [0, 1]; `None` means opaque.
    pub opacity: Option<FloatTexture>,
    /// True if rays that hit the back side continue as if there were no surface.
    pub cull_backfaces: bool,
    /// Sides that emit light.
    pub emissive_sides: EmissiveSides,
    /// Emitted radiance; 1 if a texture determines it.
    pub emission: Spectrum,
    /// Texture of the emitted radiance.
    pub emission_texture: Option<Id<TextureRecord>>,
    /// Fraction of the surface under a clear coat, which attenuates the emission; see
    /// [`emitted_through`](crate::bsdf::emitted_through).
    pub emission_coat: f32,
    /// Light by which the emission is sampled; `None` if light sampling does not find it.
    pub light: Option<Id<AnyLight>>,
}

/// Sides of a surface that emit light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EmissiveSides {
    /// Side of the normal.
    Front,
    /// Opposite side.
    Back,
    /// Front and back.
    Both,
}
