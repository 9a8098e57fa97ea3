//! Layers of a material, each of which is an extension.

use std::sync::Arc;

use pt_scene::Color;
use pt_scene::material::{CoatNormals, MetallicRoughness};
use pt_scene::texture::{Blend, Input, NormalOrBump, Pattern, Scalar};
use serde_json::{Map, Value, json};

use super::super::texture::TextureUsage;
use super::GltfWriter;
use super::layer::MaterialParameter;
use super::material::Writing;

const NONE: Scalar = Scalar::Value(0.0);

impl GltfWriter<'_> {
    /// Writes the extensions of all layers of a material. Returns true if the clearcoat has a
    /// normal map.
    pub(super) fn layers(
        &mut self,
        look: &MetallicRoughness,
        relief: Option<&NormalOrBump>,
        cx: &mut Writing,
    ) -> Result<bool, String> {
        self.specular(look, cx)?;
        self.anisotropy(look, cx)?;
        self.diffuse_transmission(look, cx)?;
        self.film(look, cx)?;
        self.sheen(look, cx)?;
        self.coat(look, relief, cx)
    }

    /// Writes a colour as a factor and a texture.
    fn put_color(
        &mut self,
        fields: &mut Map<String, Value>,
        [factor, texture]: [&str; 2],
        color: &Color,
        what: &str,
        cx: &mut Writing,
    ) -> Result<(), String> {
        let made = MaterialParameter::of(color);
        if made.lost || made.colors.is_some() {
            let note = format!("{what}: one of the combined textures is omitted");
            self.notes.note(&cx.place, note);
        }
        fields.insert(factor.to_owned(), made.factor.to_vec().into());
        let image = made.layer.as_ref().map(|layer| (TextureUsage::Colors, layer));
        self.put_texture(fields, texture, image.as_slice(), cx)
    }

    /// Writes a number as a factor and a texture in the given channels.
    fn put_factor(
        &mut self,
        fields: &mut Map<String, Value>,
        [factor, texture]: [&str; 2],
        (number, content): (&Scalar, TextureUsage),
        what: &str,
        cx: &mut Writing,
    ) -> Result<(), String> {
        let made = self.number(number, what, cx);
        fields.insert(factor.to_owned(), self.share(made.factor[0], what, cx).into());
        let image = made.layer.as_ref().map(|layer| (content, layer));
        self.put_texture(fields, texture, image.as_slice(), cx)
    }

    /// KHR_materials_specular.
    fn specular(&mut self, look: &MetallicRoughness, cx: &mut Writing) -> Result<(), String> {
        let mut fields = Map::new();
        if look.specular != Scalar::Value(1.0) {
            let names = ["specularFactor", "specularTexture"];
            let number = (&look.specular, TextureUsage::Opacity);
            self.put_factor(&mut fields, names, number, "reflection", cx)?;
        }
        if look.specular_color != Color::Value([1.0; 3]) {
            let names = ["specularColorFactor", "specularColorTexture"];
            self.put_color(&mut fields, names, &look.specular_color, "reflection", cx)?;
        }
        if !fields.is_empty() {
            cx.extensions.push(("KHR_materials_specular", fields.into()));
        }
        Ok(())
    }

    /// KHR_materials_anisotropy. A constant direction becomes a rotation.
    fn anisotropy(&mut self, look: &MetallicRoughness, cx: &mut Writing) -> Result<(), String> {
        if look.anisotropy == NONE {
            return Ok(());
        }
        if look.anisotropy_along.is_some() {
            self.notes.note(&cx.place, "the anisotropy is along u, as tangents are not written");
        }
        let strength = self.number(&look.anisotropy, "anisotropy", cx);
        let factor = self.share(strength.factor[0], "anisotropy", cx);
        let mut fields = Map::from_iter([("anisotropyStrength".to_owned(), factor.into())]);
        let [x, y] = look.anisotropy_direction.each_ref();
        let mut rotation = look.anisotropy_rotation;
        let mut images = Vec::new();
        let directions = [x, y].map(|number| self.number(number, "direction of anisotropy", cx));
        if let [Some(x), Some(y)] = directions.each_ref().map(MaterialParameter::number) {
            if (x, y) != (1.0, 0.5) {
                rotation += libm::atan2f(2.0 * y - 1.0, 2.0 * x - 1.0);
            }
        } else {
            for (channel, number) in directions.iter().enumerate() {
                images.extend(number.layer.as_ref().map(|l| (TextureUsage::Channel(channel), l)));
            }
        }
        images.extend(strength.layer.as_ref().map(|layer| (TextureUsage::Channel(2), layer)));
        self.put_texture(&mut fields, "anisotropyTexture", &images, cx)?;
        if rotation != 0.0 {
            fields.insert("anisotropyRotation".to_owned(), rotation.into());
        }
        cx.extensions.push(("KHR_materials_anisotropy", fields.into()));
        Ok(())
    }

    /// KHR_materials_diffuse_transmission.
    fn diffuse_transmission(
        &mut self,
        look: &MetallicRoughness,
        cx: &mut Writing,
    ) -> Result<(), String> {
        if look.diffuse_transmission == NONE {
            return Ok(());
        }
        let mut fields = Map::new();
        let names = ["diffuseTransmissionFactor", "diffuseTransmissionTexture"];
        let number = (&look.diffuse_transmission, TextureUsage::Opacity);
        self.put_factor(&mut fields, names, number, "diffuse transmission", cx)?;
        let names = ["diffuseTransmissionColorFactor", "diffuseTransmissionColorTexture"];
        let color = &look.diffuse_transmission_color;
        self.put_color(&mut fields, names, color, "diffuse transmission", cx)?;
        cx.extensions.push(("KHR_materials_diffuse_transmission", fields.into()));
        Ok(())
    }

    /// KHR_materials_iridescence. A textured thickness interpolates between two numbers.
    fn film(&mut self, look: &MetallicRoughness, cx: &mut Writing) -> Result<(), String> {
        if look.iridescence == NONE {
            return Ok(());
        }
        let mut fields = Map::new();
        let names = ["iridescenceFactor", "iridescenceTexture"];
        let number = (&look.iridescence, TextureUsage::Channel(0));
        self.put_factor(&mut fields, names, number, "film", cx)?;
        fields.insert("iridescenceIor".to_owned(), look.film_ior.into());
        let (least, most, image) = match &look.film_thickness {
            Scalar::Value(thickness) => (None, *thickness, None),
            Scalar::Texture(texture) => {
                if let Some(([least, most], share)) = between(&texture.pattern) {
                    let made = self.number(&Input::Texture(Arc::clone(share)), "film", cx);
                    (Some(least), most, made.layer)
                } else {
                    let note = "the thickness of the film becomes its mean";
                    self.notes.note(&cx.place, note);
                    (None, texture.pattern.mean()[0], None)
                }
            }
        };
        fields.extend(least.map(|least| ("iridescenceThicknessMinimum".to_owned(), json!(least))));
        fields.insert("iridescenceThicknessMaximum".to_owned(), most.into());
        let image = image.as_ref().map(|layer| (TextureUsage::Channel(1), layer));
        self.put_texture(&mut fields, "iridescenceThicknessTexture", image.as_slice(), cx)?;
        cx.extensions.push(("KHR_materials_iridescence", fields.into()));
        Ok(())
    }

    /// KHR_materials_clearcoat. `base` is the normal map of the base, if there is one. Returns true
    /// if a normal map was written for the coat.
    fn coat(
        &mut self,
        look: &MetallicRoughness,
        base: Option<&NormalOrBump>,
        cx: &mut Writing,
    ) -> Result<bool, String> {
        if look.clearcoat == NONE {
            return Ok(false);
        }
        let mut fields = Map::new();
        let names = ["clearcoatFactor", "clearcoatTexture"];
        let number = (&look.clearcoat, TextureUsage::Channel(0));
        self.put_factor(&mut fields, names, number, "coat", cx)?;
        let names = ["clearcoatRoughnessFactor", "clearcoatRoughnessTexture"];
        let number = (&look.clearcoat_roughness, TextureUsage::Channel(1));
        self.put_factor(&mut fields, names, number, "roughness of the coat", cx)?;
        let relief = match &look.clearcoat_normals {
            CoatNormals::Base => base,
            CoatNormals::Shape => None,
            CoatNormals::Relief(own) => Some(own),
        };
        let has_relief = self.relief(&mut fields, "clearcoatNormalTexture", relief, cx)?;
        cx.extensions.push(("KHR_materials_clearcoat", fields.into()));
        Ok(has_relief)
    }

    /// KHR_materials_sheen.
    fn sheen(&mut self, look: &MetallicRoughness, cx: &mut Writing) -> Result<(), String> {
        if look.sheen_color == Color::Value([0.0; 3]) {
            return Ok(());
        }
        let mut fields = Map::new();
        let names = ["sheenColorFactor", "sheenColorTexture"];
        self.put_color(&mut fields, names, &look.sheen_color, "sheen", cx)?;
        let names = ["sheenRoughnessFactor", "sheenRoughnessTexture"];
        let number = (&look.sheen_roughness, TextureUsage::Opacity);
        self.put_factor(&mut fields, names, number, "roughness of the sheen", cx)?;
        cx.extensions.push(("KHR_materials_sheen", fields.into()));
        Ok(())
    }
}

/// Returns the two greys of a blend and the texture that interpolates between them.
fn between(pattern: &Pattern) -> Option<([f32; 2], &Arc<pt_scene::Texture>)> {
    let Pattern::Blend(blend) = pattern else { return None };
    let Blend { first: Input::Value(first), second: Input::Value(second), amount: share } =
        &**blend
    else {
        return None;
    };
    Some(([first[0], second[0]], share.texture()?))
}
