//! Metallic-roughness materials and their extensions. [glTF 2.0, §3.9, and the registry of
//! extensions]

use std::sync::Arc;

use pt_math::trig;
use pt_scene::material::MetallicRoughness;
use pt_scene::medium::MediumProperties;
use pt_scene::texture::{NormalOrBump, Pattern, Scalar};
use pt_scene::{Color, Material, Medium, Surface};
use serde_json::{Map, Value, json};

use super::super::texture::TextureUsage;
use super::GltfWriter;
use super::approximate::{ApproximateMaterial, BaseMaterial, approximate};
use super::exact::near_f32;
use super::layer::{ColorSource, Layer, MaterialParameter, normals, power_of_two};
use crate::shared::names::quote;

/// Names and values of the extensions of a material.
type Extensions = Vec<(&'static str, Value)>;

/// A material that was written, and its requirements of meshes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Worn {
    /// Index of the material in the file.
    pub(super) index: usize,
    /// Mesh colours that the material uses.
    pub(super) colors: Option<ColorSource>,
    /// True if the material has textures, which require texture coordinates.
    pub(super) has_textures: bool,
    /// True if the material has a normal map.
    pub(super) has_relief: bool,
}

/// State of a material that is being written.
pub(super) struct Writing {
    pub(super) place: String,
    has_textures: bool,
    fields: Map<String, Value>,
    pub(super) extensions: Extensions,
}

impl GltfWriter<'_> {
    /// Writes a material with an interior medium, once, and returns it. `None` is the default
    /// material.
    pub(super) fn material(
        &mut self,
        material: Option<u32>,
        interior: Option<u32>,
    ) -> Result<Worn, String> {
        if let Some(known) = self.worn.get(&(material, interior)) {
            return Ok(*known);
        }
        let missing = |i: u32| {
            format!("an object references material {i}, which does not exist in the scene")
        };
        let scene = self.scene;
        let described = match material {
            None => &default_material(),
            Some(i) => scene.materials.get(i as usize).ok_or_else(|| missing(i))?,
        };
        let medium = interior.and_then(|i| scene.media.get(i as usize));
        let worn = self.described(described, medium)?;
        self.worn.insert((material, interior), worn);
        Ok(worn)
    }

    /// Writes a material.
    pub(super) fn described(
        &mut self,
        material: &Material,
        medium: Option<&Medium>,
    ) -> Result<Worn, String> {
        let mut writing = Writing {
            place: format!("material {}", quote(&material.name)),
            has_textures: false,
            fields: Map::new(),
            extensions: Vec::new(),
        };
        let cx = &mut writing;
        let ApproximateMaterial { look, body, relief } =
            approximate(&material.surface, &mut |note| self.notes.note(&cx.place, note));
        let opacity = match material.opacity {
            Scalar::Value(0.0) if material.emission != [0.0; 3].into() => {
                self.notes.note(&cx.place, "a surface with opacity 0 that emits becomes opaque");
                1.0.into()
            }
            ref opacity => opacity.clone(),
        };
        let base = self.base(&look, &opacity, cx)?;
        self.refraction(&look, body, medium, cx)?;
        let mut fields = std::mem::take(&mut cx.fields);
        let done = self.relief(&mut fields, "normalTexture", relief.as_ref(), cx);
        cx.fields = fields;
        let has_relief = done? | self.layers(&look, relief.as_ref(), cx)?;
        let emits = self.emission(material, &opacity, cx)?;
        if body == BaseMaterial::Opaque && !look.two_sided {
            self.notes.note(&cx.place, "the black back side becomes like the front side");
        }
        // Emission here is one-sided, and light passes through both sides of a solid anyway.
        if !emits && (look.two_sided || body == BaseMaterial::Sheet) {
            cx.fields.insert("doubleSided".to_owned(), true.into());
        }
        let Writing { has_textures, mut fields, extensions, .. } = writing;
        if !material.name.is_empty() {
            fields.insert("name".to_owned(), material.name.clone().into());
        }
        if !extensions.is_empty() {
            fields.insert("extensions".to_owned(), self.extended(extensions));
        }
        self.materials.push(Value::Object(fields));
        let index = self.materials.len() - 1;
        Ok(Worn { index, colors: base.colors, has_textures, has_relief })
    }

    /// Writes base colour, opacity, metallic and roughness. Returns the base colour.
    fn base(
        &mut self,
        look: &MetallicRoughness,
        opacity: &Scalar,
        cx: &mut Writing,
    ) -> Result<MaterialParameter, String> {
        let color = MaterialParameter::of(&look.base_color);
        if color.lost {
            self.notes.note(&cx.place, "base colour: one of the combined textures is omitted");
        }
        let opacity = self.number(opacity, "opacity", cx);
        let mut pbr = Map::new();
        let mut images = Vec::new();
        images.extend(color.layer.as_ref().map(|layer| (TextureUsage::Colors, layer)));
        let content = match (&opacity.layer, opacity.number()) {
            (_, Some(1.0)) => None,
            (Some(layer), _) if is_mask(layer) && opacity.factor[0] == 1.0 => {
                cx.fields.insert("alphaMode".to_owned(), "MASK".into());
                Some(TextureUsage::Mask(0.5_f32.to_bits()))
            }
            _ => {
                cx.fields.insert("alphaMode".to_owned(), "BLEND".into());
                Some(TextureUsage::Opacity)
            }
        };
        images.extend(content.and_then(|content| Some((content, opacity.layer.as_ref()?))));
        self.put_texture(&mut pbr, "baseColorTexture", &images, cx)?;
        let [r, g, b] = color.factor.map(|c| self.share(c, "colour", cx));
        let alpha = self.share(opacity.factor[0], "opacity", cx);
        if [r, g, b, alpha] != [1.0; 4] {
            pbr.insert("baseColorFactor".to_owned(), json!([r, g, b, alpha]));
        }
        let metallic = self.number(&look.metallic, "metal", cx);
        let roughness = self.number(&look.roughness, "roughness", cx);
        let mut images = Vec::new();
        images.extend(roughness.layer.as_ref().map(|layer| (TextureUsage::Channel(1), layer)));
        images.extend(metallic.layer.as_ref().map(|layer| (TextureUsage::Channel(2), layer)));
        self.put_texture(&mut pbr, "metallicRoughnessTexture", &images, cx)?;
        for (name, what, number) in
            [("metallicFactor", "metal", &metallic), ("roughnessFactor", "roughness", &roughness)]
        {
            let factor = self.share(number.factor[0], what, cx);
            if factor != 1.0 {
                pbr.insert(name.to_owned(), factor.into());
            }
        }
        cx.fields.insert("pbrMetallicRoughness".to_owned(), pbr.into());
        Ok(color)
    }

    /// Converts a number to a factor and an image.
    pub(super) fn number(
        &mut self,
        number: &Scalar,
        what: &str,
        cx: &Writing,
    ) -> MaterialParameter {
        let made = MaterialParameter::of_number(number);
        if made.colors.is_some() {
            let note = format!("{what}: colours of the mesh are ignored");
            self.notes.note(&cx.place, note);
        }
        if made.lost {
            let note = format!("{what}: one of the combined textures is omitted");
            self.notes.note(&cx.place, note);
        }
        made
    }

    /// Clamps a number to [0, 1], with a note if that changes it.
    pub(super) fn share(&mut self, number: f32, what: &str, cx: &Writing) -> f32 {
        if (0.0..=1.0).contains(&number) {
            return number;
        }
        let note = format!("{what} is outside of 0 to 1; the nearest of these is written");
        self.notes.note(&cx.place, note);
        if number > 1.0 { 1.0 } else { 0.0 }
    }

    pub(super) fn put_texture(
        &mut self,
        fields: &mut Map<String, Value>,
        name: &str,
        images: &[(TextureUsage, &Layer)],
        cx: &mut Writing,
    ) -> Result<(), String> {
        if !images.is_empty() {
            cx.has_textures = true;
            fields.insert(name.to_owned(), self.texture(images, &cx.place)?);
        }
        Ok(())
    }

    /// Writes a factor and a texture in the red channel.
    fn put_number(
        &mut self,
        fields: &mut Map<String, Value>,
        [factor, texture]: [&str; 2],
        number: &MaterialParameter,
        what: &str,
        cx: &mut Writing,
    ) -> Result<(), String> {
        let value = self.share(number.factor[0], what, cx);
        fields.insert(factor.to_owned(), value.into());
        let image = number.layer.as_ref().map(|layer| (TextureUsage::Channel(0), layer));
        self.put_texture(fields, texture, image.as_slice(), cx)
    }

    /// KHR_materials_transmission, _volume and _ior.
    fn refraction(
        &mut self,
        look: &MetallicRoughness,
        body: BaseMaterial,
        medium: Option<&Medium>,
        cx: &mut Writing,
    ) -> Result<(), String> {
        if look.transmission != Scalar::Value(0.0) {
            let number = self.number(&look.transmission, "transmission", cx);
            let mut fields = Map::new();
            let names = ["transmissionFactor", "transmissionTexture"];
            self.put_number(&mut fields, names, &number, "transmission", cx)?;
            cx.extensions.push(("KHR_materials_transmission", fields.into()));
        }
        if body == BaseMaterial::Solid {
            let mut fields = Map::from_iter([("thicknessFactor".to_owned(), 1.0.into())]);
            if let Some(medium) = medium {
                self.absorption(medium, &mut fields);
            }
            cx.extensions.push(("KHR_materials_volume", fields.into()));
        } else if let Some(medium) = medium {
            self.notes.note(
                &medium.at,
                "the medium is omitted: the surface around it has no interior in glTF",
            );
        }
        if look.ior != 1.5 {
            cx.extensions.push(("KHR_materials_ior", json!({"ior": look.ior})));
        }
        Ok(())
    }

    /// Writes the attenuation of a medium: c = exp(−σt d).
    fn absorption(&mut self, medium: &Medium, fields: &mut Map<String, Value>) {
        let MediumProperties::Homogeneous { extinction, albedo, .. } = &medium.matter else {
            self.notes.note(&medium.at, "the medium is omitted: media of glTF are homogeneous");
            return;
        };
        if *albedo != [0.0; 3] {
            self.notes.note(&medium.at, "scattering becomes absorption");
        }
        if medium.matter.emits() {
            self.notes.note(&medium.at, "the emission of the medium is omitted");
        }
        let (color, distance) = attenuation(extinction.map(|sigma| sigma / self.metres as f32));
        fields.insert("attenuationColor".to_owned(), color.to_vec().into());
        fields.insert("attenuationDistance".to_owned(), distance.into());
    }

    /// Writes a normal map. Returns true if there is one.
    pub(super) fn relief(
        &mut self,
        fields: &mut Map<String, Value>,
        name: &str,
        relief: Option<&NormalOrBump>,
        cx: &mut Writing,
    ) -> Result<bool, String> {
        let normals = match relief {
            None => return Ok(false),
            Some(NormalOrBump::Normals(texture) | NormalOrBump::TurnedNormals(texture)) => {
                normals(texture)
            }
            Some(NormalOrBump::NormalsAlong(texture, _)) => {
                self.notes.note(&cx.place, "the normals are along u, as tangents are not written");
                normals(texture)
            }
            Some(NormalOrBump::Heights(..)) => None,
        };
        let Some(layer) = normals else {
            self.notes.note(&cx.place, "the bump map is omitted: glTF supports normal maps only");
            return Ok(false);
        };
        let content = TextureUsage::Normals { scale: 1.0_f32.to_bits(), is_mirrored: false };
        self.put_texture(fields, name, &[(content, &layer)], cx).map(|()| true)
    }

    /// Writes the emission of a fully opaque surface. Returns true if it emits.
    fn emission(
        &mut self,
        material: &Material,
        opacity: &Scalar,
        cx: &mut Writing,
    ) -> Result<bool, String> {
        let (whole, is_certain) = emitted_by_the_whole(&material.emission, opacity);
        let emission = MaterialParameter::of(&whole);
        if emission.factor == [0.0; 3] {
            return Ok(false);
        }
        if !is_certain {
            self.notes.note(&cx.place, "the emission is multiplied by the opacity");
        }
        if !emission.factor.iter().all(|c| c.is_finite()) {
            return Err(format!("{}: found an emission that is not finite", cx.place));
        }
        if material.hidden_emission {
            self.notes.note(&cx.place, "emission that is invisible to the camera becomes visible");
        }
        if emission.colors.is_some() || emission.lost {
            self.notes.note(&cx.place, "only one image of the emission is written");
        }
        let strength = power_of_two(emission.factor.into_iter().fold(0.0, f32::max));
        let factor = emission.factor.map(|c| c.max(0.0) / strength);
        cx.fields.insert("emissiveFactor".to_owned(), factor.to_vec().into());
        if strength != 1.0 {
            let extension = json!({"emissiveStrength": strength});
            cx.extensions.push(("KHR_materials_emissive_strength", extension));
        }
        let image = emission.layer.as_ref().map(|layer| (TextureUsage::Colors, layer));
        let mut fields = std::mem::take(&mut cx.fields);
        let done = self.put_texture(&mut fields, "emissiveTexture", image.as_slice(), cx);
        cx.fields = fields;
        done.map(|()| true)
    }
}

/// Divides the emission by the opacity: returns the emission of the opaque surface, and true if it
/// is exact.
fn emitted_by_the_whole(emission: &Color, opacity: &Scalar) -> (Color, bool) {
    let share = match opacity {
        // Nothing is emitted where the opacity is 0.
        Scalar::Value(1.0 | 0.0) => return (emission.clone(), true),
        Scalar::Value(share) => {
            let inverse = Color::Value([share.recip(); 3]);
            return match emission {
                Color::Value(emitted) => (emitted.map(|c| c / share).into(), true),
                Color::Texture(_) => {
                    let factors = Box::new([emission.clone(), inverse]);
                    (Color::Texture(Arc::new(Pattern::Product(factors).into())), true)
                }
            };
        }
        Scalar::Texture(texture) => Color::Texture(Arc::clone(texture)),
    };
    if *emission == share {
        return ([1.0; 3].into(), true);
    }
    if let Color::Texture(texture) = emission
        && let Pattern::Product(factors) = &texture.pattern
        && factors[1] == share
    {
        return (factors[0].clone(), true);
    }
    (emission.clone(), *emission == [0.0; 3].into())
}

/// Returns an attenuation colour and distance from which readers compute an extinction per metre.
/// The result is exact if such a distance exists among those tried, at which the transmittance of
/// the densest channel is from e⁻¹ to e⁻⁵.
fn attenuation(extinction: [f32; 3]) -> ([f32; 3], f32) {
    const TRIED: u8 = 255;
    let most = extinction.into_iter().fold(f32::MIN_POSITIVE, f32::max);
    let left = |distance: f32| {
        extinction.map(|sigma| {
            let is_right = |c: f32| c <= 1.0 && -trig::ln(c) / distance == sigma;
            near_f32(trig::exp(-sigma * distance), is_right)
        })
    };
    let distance = |i: u8| ((1.0 + f32::from(i) / 64.0) / most).min(f32::MAX);
    let is_exact = |d: &f32| {
        let found = left(*d).map(|c| -trig::ln(c) / d);
        found == extinction
    };
    let distance = (0..TRIED).map(distance).find(is_exact).unwrap_or(distance(0));
    (left(distance), distance)
}

/// Material of objects without one.
fn default_material() -> Material {
    let matte = pt_scene::material::Diffuse { reflectance: [0.5; 3].into(), two_sided: true };
    Material {
        name: "default".to_owned(),
        surface: Surface::from(matte),
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    }
}

/// Returns true if each texel is either 0 or 1.
fn is_mask(layer: &Layer) -> bool {
    layer.image.pixels.iter().all(|[x, ..]| *x == 0.0 || *x == 1.0)
}

/// Returns true if a material equals another one except that its normal map is reversed along v, as
/// readers of glTF create it for triangles with mirrored coordinates.
pub(super) fn is_mirrored(material: &Material, of: &Material) -> bool {
    let (Surface::SurfaceDetail(one), Surface::SurfaceDetail(other)) =
        (&material.surface, &of.surface)
    else {
        return false;
    };
    let ((NormalOrBump::Normals(a), NormalOrBump::Normals(b))
    | (NormalOrBump::TurnedNormals(a), NormalOrBump::TurnedNormals(b))) =
        (&one.relief, &other.relief)
    else {
        return false;
    };
    let (Some(a), Some(b)) = (normals(a), normals(b)) else { return false };
    let leans = |(p, q): (&[f32; 3], &[f32; 3])| {
        [p[0] - q[0], p[1] + q[1] - 1.0, p[2] - q[2]].iter().all(|x| x.abs() < 1e-6)
    };
    one.surface == other.surface
        && (&material.name, &material.emission, &material.opacity)
            == (&of.name, &of.emission, &of.opacity)
        && material.hidden_emission == of.hidden_emission
        && a.lies_as(&b)
        && [a.image.width, a.image.height] == [b.image.width, b.image.height]
        && a.image.pixels.iter().zip(&b.image.pixels).all(leans)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn attenuation_means_the_extinction_that_it_was_made_of() {
        for extinction in [[0.0; 3], [1.0, 2.0, 3.0], [1e-3, 0.0, 0.2], [400.0, 7.5, 0.1]] {
            let (left, distance) = attenuation(extinction);
            let most = extinction.into_iter().fold(0.0, f32::max);
            for (c, wanted) in left.into_iter().zip(extinction) {
                let found = -trig::ln(c) / distance;
                assert!((0.0..=1.0).contains(&c), "{c}");
                assert!((found - wanted).abs() <= 2e-7 * most, "{found} {wanted}");
            }
        }
    }
}
