//! Compiled materials, from which surfaces are made.

use pt_math::Spectrum;
use pt_scene::{Color, Scalar, Surface};

use super::materials;
use super::textures::{Lowering, ShownValues};
use crate::bsdf::{Diffuse, LobeRecord};
use crate::id::Id;
use crate::material::Material;
use crate::texture_record::{FloatTexture, TextureRecord};

/// A compiled material.
#[derive(Clone)]
pub(super) struct CompiledSurface {
    pub(super) lobe: Id<LobeRecord>,
    pub(super) two_sided: bool,
    pub(super) material: Option<Id<Material>>,
    pub(super) opacity: Option<FloatTexture>,
    /// See [`SurfaceRecord::cull_backfaces`](crate::surface::SurfaceRecord::cull_backfaces).
    pub(super) cull_backfaces: bool,
    /// See [`SurfaceRecord::emission`](crate::surface::SurfaceRecord::emission).
    pub(super) emission: Spectrum,
    pub(super) emission_texture: Option<Id<TextureRecord>>,
    /// See [`SurfaceRecord::emission_coat`](crate::surface::SurfaceRecord::emission_coat).
    pub(super) emission_coat: f32,
    /// True if rays do not see the emission.
    pub(super) hidden_emission: bool,
    /// Mesh values that its textures use.
    pub(super) shown: ShownValues,
}

impl CompiledSurface {
    pub(super) fn of(material: &pt_scene::Material, cx: &mut Lowering) -> Self {
        let surface = materials::lower(&material.surface, cx);
        let opacity = match material.opacity {
            Scalar::Value(opacity) if opacity >= 1.0 => None,
            ref opacity => Some(cx.varying(opacity)),
        };
        let (emission, emission_texture) = match &material.emission {
            Color::Value(emission) => ((*emission).into(), None),
            Color::Texture(texture) => (Spectrum::ONE, Some(cx.texture(texture))),
        };
        let shown = cx.take_shown();
        Self {
            opacity,
            cull_backfaces: material.surface.culls_backfaces(),
            emission,
            emission_texture,
            emission_coat: coat_of(&material.surface),
            hidden_emission: material.hidden_emission,
            shown,
            ..Self::opaque(surface, cx)
        }
    }

    pub(super) fn default_one(cx: &mut Lowering) -> Self {
        let surface = materials::default_material(cx);
        Self::opaque(surface, cx)
    }

    /// Creates an opaque surface without emission.
    fn opaque(surface: Material, cx: &mut Lowering) -> Self {
        let (lobe, two_sided, material) = match surface {
            Material::Lobe(l) if l.is_plain() => (l.lobe, l.two_sided, None),
            varying => {
                let black = Diffuse { rho: Spectrum::ZERO };
                let lobe = cx.lobes.push(black.into());
                (lobe, true, Some(cx.materials.table.push(varying)))
            }
        };
        Self {
            lobe,
            two_sided,
            material,
            opacity: None,
            cull_backfaces: false,
            emission: Spectrum::ZERO,
            emission_texture: None,
            emission_coat: 0.0,
            hidden_emission: false,
            shown: ShownValues::default(),
        }
    }
}

/// Amount of the clear coat through which a surface emits, as specified for the material of glTF; 0
/// for others, and for a coat that varies.
fn coat_of(surface: &Surface) -> f32 {
    match surface {
        Surface::MetallicRoughness(layers) => match &layers.clearcoat {
            Scalar::Value(coat) => *coat,
            Scalar::Texture(_) => 0.0,
        },
        Surface::SurfaceDetail(embossed) => coat_of(&embossed.surface),
        Surface::TwoSided(sided) => coat_of(&sided.front),
        _ => 0.0,
    }
}
