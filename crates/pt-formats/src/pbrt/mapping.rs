//! Texture mappings, and textures of noise in space.

use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::texture::{Marble, Noise, Pattern, Procedural, Texture, TextureMapping};

use super::entity::Entity;
use crate::LoadError;
use crate::shared::names::quote;

/// Reads the mapping of a texture, and the transform of its coordinates.
pub(super) fn read(
    entity: &Entity,
    to_world: DAffine3,
) -> Result<(TextureMapping, DMat3), LoadError> {
    let layout = match entity.text("mapping")? {
        None | Some("uv") => {
            let [u, v] = [entity.float("uscale", 1.0)?, entity.float("vscale", 1.0)?];
            let moved = DVec3::new(entity.float("udelta", 0.0)?, entity.float("vdelta", 0.0)?, 1.0);
            let to_pattern = DMat3::from_cols(DVec3::X * u, DVec3::Y * v, moved);
            return Ok((TextureMapping::Surface, to_pattern));
        }
        Some("planar") => {
            let u = entity.vector("v1")?.unwrap_or(DVec3::X);
            let v = entity.vector("v2")?.unwrap_or(DVec3::Y);
            let moved = DVec3::new(entity.float("udelta", 0.0)?, entity.float("vdelta", 0.0)?, 0.0);
            let rows = DMat3::from_cols(u, v, DVec3::ZERO).transpose();
            let to_plane = DAffine3::from_mat3_translation(rows, moved);
            TextureMapping::Space { to_texture: to_plane * to_texture(entity, to_world)? }
        }
        Some("spherical") => TextureMapping::Sphere { to_texture: to_texture(entity, to_world)? },
        Some("cylindrical") => {
            TextureMapping::Cylinder { to_texture: to_texture(entity, to_world)? }
        }
        Some(other) => {
            let message = format!(
                "unknown mapping {}; expected uv, planar, spherical or cylindrical",
                quote(other)
            );
            return Err(entity.refuse("mapping", message));
        }
    };
    match layout {
        TextureMapping::Space { to_texture } if !to_texture.is_finite() => {
            Err(entity.refuse("v1", "v1 and v2 give a mapping that is too large to be represented"))
        }
        layout => Ok((layout, DMat3::IDENTITY)),
    }
}

/// Returns the transform from the world to the coordinates in which a texture is defined.
pub(super) fn to_texture(entity: &Entity, to_world: DAffine3) -> Result<DAffine3, LoadError> {
    let inverse = to_world.inverse();
    if inverse.is_finite() && to_world.matrix3.determinant() != 0.0 {
        return Ok(inverse);
    }
    let message = "found a transform that flattens the texture space, expected an invertible one";
    Err(entity.at.error(message))
}

/// Reads a texture of noise in space.
pub(super) fn of_noise(entity: &Entity, to_world: DAffine3) -> Result<Texture, LoadError> {
    let mut to_texture = to_texture(entity, to_world)?;
    let pattern = match entity.kind.as_str() {
        "fbm" => Procedural::Fbm(noise(entity)?),
        "wrinkled" => Procedural::Wrinkled(noise(entity)?),
        "windy" => Procedural::Windy,
        _ => {
            let scale = entity.float("scale", 1.0)?;
            to_texture = DAffine3::from_scale(DVec3::splat(scale)) * to_texture;
            if !to_texture.is_finite() {
                return Err(entity.refuse(
                    "scale",
                    "the scale gives a texture transform that is too large to be represented",
                ));
            }
            let variation = entity.float("variation", 0.2)? as f32;
            Procedural::Marble(Marble { noise: noise(entity)?, variation })
        }
    };
    Ok(Texture {
        layout: TextureMapping::Space { to_texture },
        ..Pattern::Procedural(pattern).into()
    })
}

fn noise(entity: &Entity) -> Result<Noise, LoadError> {
    let octaves = entity.count("octaves", 8, [0, Noise::MAX_OCTAVES])?;
    let roughness = entity.float("roughness", 0.5)?;
    if (0.0..=2.0).contains(&roughness) {
        return Ok(Noise { octaves, roughness: roughness as f32 });
    }
    let message =
        format!("found {} = {roughness}, expected a number from 0 to 2", quote("roughness"));
    Err(entity.refuse("roughness", message))
}
