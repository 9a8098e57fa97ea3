//! Materials on triangles on which texture coordinates lie mirrored, and on objects that their
//! nodes mirror: there, the second axis of directions along the surface is on the other side.

use super::Reader;
use super::item::Item;
use super::material::Made;
use super::texture::Content;
use crate::material::{CoatNormals, MetallicRoughness};
use crate::texture::{Input, NormalOrBump, Scalar};
use crate::{LoadError, Surface};

impl<'a> Reader<'a> {
    /// The material of the triangles on which texture coordinates lie mirrored: there, the normals
    /// of an image lean to the other side of u.
    pub(super) fn mirrored(&mut self, item: &Item<'a>, made: Made) -> Result<u32, LoadError> {
        if let Some(known) = self.mirrored.get(&made.material) {
            return Ok(*known);
        }
        let mut material = self.scene.materials[made.material as usize].clone();
        let has_tangents = |relief: &NormalOrBump| matches!(relief, NormalOrBump::NormalsAlong(..));
        let mut surface = &mut material.surface;
        let mut is_other = false;
        if let Surface::SurfaceDetail(embossed) = surface {
            let lie = (true, has_tangents(&embossed.relief));
            if let Some(relief) = self.relief(item, "normalTexture", lie)? {
                (embossed.relief, is_other) = (relief, true);
            }
            surface = &mut embossed.surface;
        }
        if let Surface::MetallicRoughness(look) = surface {
            if let CoatNormals::Relief(relief) = &look.clearcoat_normals {
                let lie = (true, has_tangents(relief));
                (look.clearcoat_normals, is_other) = (self.coat_normals(item, lie)?, true);
            }
            is_other |= self.mirror_anisotropy(item, look)?;
        }
        if !is_other {
            return Ok(made.material);
        }
        let mirrored = self.scene.materials.len() as u32;
        self.scene.materials.push(material);
        self.mirrored.extend([(made.material, mirrored), (mirrored, made.material)]);
        Ok(mirrored)
    }

    /// Turns the direction of anisotropy to the other side of u, for triangles on which texture
    /// coordinates lie mirrored; tells whether there is one.
    fn mirror_anisotropy(
        &mut self,
        item: &Item<'a>,
        look: &mut MetallicRoughness,
    ) -> Result<bool, LoadError> {
        let Some(found) = item.extension("KHR_materials_anisotropy")? else { return Ok(false) };
        if look.anisotropy == Scalar::Value(0.0) {
            return Ok(false);
        }
        look.anisotropy_rotation = -look.anisotropy_rotation;
        let [_, across] = &mut look.anisotropy_direction;
        if let Some(y) = self.texture(&found, "anisotropyTexture", Content::Opposite(1))? {
            *across = Input::Texture(y);
        }
        Ok(true)
    }
}
