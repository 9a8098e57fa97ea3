//! Materials of triangles with mirrored texture coordinates, and of objects with mirroring
//! transforms. Their bitangents point to the opposite side.

use pt_scene::Surface;
use pt_scene::material::{CoatNormals, MetallicRoughness};
use pt_scene::texture::{Input, NormalOrBump, Scalar};

use super::GltfReader;
use super::item::Item;
use super::material::MaterialIndices;
use super::texture::TextureUsage;
use crate::LoadError;

impl<'a> GltfReader<'a> {
    /// Returns the material for triangles with mirrored texture coordinates, on which the v
    /// component of normal maps is reversed.
    pub(super) fn mirrored(
        &mut self,
        item: &Item<'a>,
        made: MaterialIndices,
    ) -> Result<u32, LoadError> {
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

    /// Mirrors the direction of anisotropy about u, for triangles with mirrored texture
    /// coordinates. Returns true if the material is anisotropic.
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
        if let Some(y) = self.texture(&found, "anisotropyTexture", TextureUsage::Opposite(1))? {
            *across = Input::Texture(y);
        }
        Ok(true)
    }
}
