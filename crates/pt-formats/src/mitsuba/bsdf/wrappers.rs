//! Bsdfs that contain other bsdfs.

use pt_scene::Surface;
use pt_scene::material::{Averted, Black, Conductor, Mirror, Mix, SurfaceDetail, TwoSided};
use pt_scene::texture::NormalOrBump;

use super::super::object::{MitsubaObject, error};
use super::super::texture::MitsubaTextureCache;
use super::inputs::Inputs;
use super::{Scattering, surface};
use crate::LoadError;
use crate::shared::names::quote;

/// Reads a surface with an opacity.
pub(super) fn mask(
    textures: &mut MitsubaTextureCache<'_>,
    object: &MitsubaObject,
) -> Result<Scattering, LoadError> {
    let mut inputs = Inputs::new(textures, object);
    let opacity = inputs.share("opacity", 0.5)?;
    let inner = inputs.bsdfs(1, 1)?;
    let surface = surface(inputs.textures, inner[0])?;
    inputs.finish()?;
    Ok(Scattering { surface, opacity })
}

/// Reads a `null`: an invisible surface.
pub(super) fn null(
    textures: &mut MitsubaTextureCache<'_>,
    object: &MitsubaObject,
) -> Result<Scattering, LoadError> {
    Inputs::new(textures, object).finish()?;
    Ok(Scattering { surface: Black.into(), opacity: 0.0.into() })
}

/// Reads a surface for both sides, or one for each.
pub(super) fn two_sided(inputs: &mut Inputs<'_, '_>) -> Result<Surface, LoadError> {
    let inner = inputs.bsdfs(1, 2)?;
    let mut sides = Vec::new();
    for side in inner {
        if side.kind == "twosided" {
            return Err(error(&side.at, "bsdf \"twosided\" inside of another bsdf \"twosided\""));
        }
        let surface = surface(inputs.textures, side)?;
        if surface.transmits() {
            let message = format!(
                "{} transmits light, expected an opaque bsdf inside of \"twosided\"",
                quote(&side.kind)
            );
            return Err(error(&side.at, message));
        }
        sides.push(surface);
    }
    Ok(match <[Surface; 2]>::try_from(sides) {
        Ok([front, back]) => {
            TwoSided { front: front.into(), back: on_both_sides(back).into() }.into()
        }
        Err(mut one) => on_both_sides(one.remove(0)),
    })
}

/// Reads a weighted sum of two surfaces.
pub(super) fn blend(inputs: &mut Inputs<'_, '_>) -> Result<Surface, LoadError> {
    let share = inputs.share("weight", 0.5)?;
    let inner = inputs.bsdfs(2, 2)?;
    let mut part = |i: usize| surface(inputs.textures, inner[i]).map(Box::new);
    Ok(Mix { first: part(0)?, second: part(1)?, amount: share }.into())
}

/// Reads a surface with a normal map.
pub(super) fn normal_map(inputs: &mut Inputs<'_, '_>) -> Result<Surface, LoadError> {
    let relief = NormalOrBump::Normals(inputs.only_texture("normalmap")?);
    embossed(inputs, relief)
}

/// Reads a surface with a bump map.
pub(super) fn bump_map(inputs: &mut Inputs<'_, '_>) -> Result<Surface, LoadError> {
    let texture = inputs.any_texture()?;
    if texture.shows_colors_of_mesh() {
        let message =
            "found a \"mesh_attribute\" in a \"bumpmap\", expected the heights of an image";
        return Err(error(&inputs.object.at, message));
    }
    let scale = inputs.parameters.float("scale")?.unwrap_or(1.0) as f32;
    embossed(inputs, NormalOrBump::Heights(texture, scale))
}

/// Reads the nested bsdf of a normal or bump map. By default, Mitsuba 3.9 applies a shadowing term,
/// and flips normals that face away from the viewer.
fn embossed(inputs: &mut Inputs<'_, '_>, relief: NormalOrBump) -> Result<Surface, LoadError> {
    let shadowing = inputs.parameters.boolean_or("use_shadowing_function", true)?;
    let turns = inputs.parameters.boolean_or("flip_invalid_normals", true)?;
    let averted = if turns { Averted::Turned } else { Averted::Black };
    let inner = inputs.bsdfs(1, 1)?;
    let surface = surface(inputs.textures, inner[0])?;
    Ok(SurfaceDetail { shadowing, averted, ..SurfaceDetail::new(surface, relief) }.into())
}

/// Makes a surface reflect on its back as on its front.
fn on_both_sides(surface: Surface) -> Surface {
    let both = |surface: Box<Surface>| Box::new(on_both_sides(*surface));
    match surface {
        // With a real part of 0, all light is reflected at every angle.
        Surface::Conductor(Conductor {
            eta: [0.0, 0.0, 0.0],
            roughness: None,
            reflectance,
            ..
        }) => Mirror { reflectance }.into(),
        Surface::Mix(Mix { first, second, amount: share }) => {
            Mix { first: both(first), second: both(second), amount: share }.into()
        }
        Surface::SurfaceDetail(SurfaceDetail { surface, relief, shadowing, averted, .. }) => {
            let surface = both(surface);
            SurfaceDetail { surface, relief, shadowing, averted, mirrored: true }.into()
        }
        mut other => {
            if let Some(two_sided) = other.two_sided_mut() {
                *two_sided = true;
            }
            other
        }
    }
}
