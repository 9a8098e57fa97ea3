//! Materials of metallic and roughness, with their extensions. [glTF 2.0, §3.9 and app. B]

use std::sync::Arc;

use pt_math::trig;

use super::super::{gloss, substitute};
use super::Reader;
use super::item::Item;
use super::texture::{Content, measured, painted, placement};
use crate::material::{Black, Embossed, Mix, Principled, PrincipledThin};
use crate::medium::{Matter, Medium, Phase};
use crate::texture::{Color, Input, Pattern, Relief, Scalar, Texture};
use crate::{LoadError, Material, Surface};

/// The highest number that is a channel or an intensity.
const ANY: f64 = f32::MAX as f64;
/// Light that is left of a channel behind the distance of its attenuation, at least: 0 would be an endless extinction.
const LEAST_TRANSMITTANCE: f32 = 1e-4;

/// How the textures of a material lie on a mesh.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Layout {
    /// The set of texture coordinates of all of them; `None` if there is no texture.
    pub(super) uv_set: Option<usize>,
    /// Whether one of them has normals, which differ where coordinates lie mirrored.
    pub(super) has_relief: bool,
    /// Whether opacities between 0 and 1 are seen.
    pub(super) is_blended: bool,
    /// Whether the surface is cut where its opacity is below a number.
    pub(super) is_masked: bool,
}

/// The values of a mesh that its material shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Values {
    /// Colours of vertices.
    pub(super) colors: bool,
    /// Directions along which the normals of an image lie.
    pub(super) tangents: bool,
    /// Opacities of vertices.
    pub(super) opacities: bool,
}

impl Values {
    /// The name of the directions among the [attributes](crate::Attributes) of a mesh.
    pub(super) const TANGENTS: &str = "TANGENT";
    /// That of the opacities.
    pub(super) const OPACITIES: &str = "opacity of COLOR_0";
}

/// A material that was made, and the medium inside.
#[derive(Clone, Copy, Debug)]
pub(super) struct Made {
    /// Index into [`crate::Scene::materials`].
    pub(super) material: u32,
    /// Index into [`crate::Scene::media`], of what is inside.
    pub(super) medium: Option<u32>,
    /// Index into [`crate::Scene::materials`], of what emits behind a surface that does so on both sides.
    pub(super) back: Option<u32>,
}

impl<'a> Reader<'a> {
    /// How the textures of a material lie on a mesh.
    pub(super) fn layout(&mut self, material: Option<&Item<'a>>) -> Result<Layout, LoadError> {
        let Some(material) = material else { return Ok(Layout::default()) };
        let mut sets = Vec::new();
        let metal = material.child("pbrMetallicRoughness")?;
        let fields =
            ["baseColorTexture", "metallicRoughnessTexture", "normalTexture", "emissiveTexture"];
        for item in metal.iter().chain([material]) {
            for field in fields {
                sets.extend(Self::uv_set_of(item, field)?);
            }
        }
        for (extension, field) in EXTENSION_TEXTURES {
            if let Some(extension) = material.extension(extension)? {
                sets.extend(Self::uv_set_of(&extension, field)?);
            }
        }
        let uv_set = sets.first().copied();
        if let Some(first) = uv_set
            && sets.iter().any(|set| *set != first)
        {
            let message = format!(
                "its textures lie on several sets of texture coordinates; all are laid on TEXCOORD_{first}"
            );
            self.warn(material, message);
        }
        let mode = material.text("alphaMode")?;
        let (is_blended, is_masked) = (mode == Some("BLEND"), mode == Some("MASK"));
        Ok(Layout { uv_set, has_relief: material.has("normalTexture"), is_blended, is_masked })
    }

    /// The material of a primitive, made once for each kind of values.
    pub(super) fn material(
        &mut self,
        index: Option<usize>,
        described: Option<&Item<'a>>,
        values: Values,
    ) -> Result<Made, LoadError> {
        if let Some(known) = self.materials.get(&(index, values)) {
            return Ok(*known);
        }
        let (material, medium) = match described {
            Some(described) => self.described(described, values)?,
            None => (default_material(values.colors), None),
        };
        let is_double = described.map_or(Ok(false), |described| described.flag("doubleSided"))?;
        let back = (is_double && material.emission != [0.0; 3].into()).then(|| back_of(&material));
        let number = self.scene.materials.len() as u32;
        let made = Made { material: number, medium, back: back.as_ref().map(|_| number + 1) };
        self.scene.materials.extend(std::iter::once(material).chain(back));
        self.materials.insert((index, values), made);
        Ok(made)
    }

    fn described(
        &mut self,
        item: &Item<'a>,
        values: Values,
    ) -> Result<(Material, Option<u32>), LoadError> {
        self.context.was_loud();
        let principled = self.principled(item, values.colors)?;
        if item.extension("KHR_materials_unlit")?.is_some() {
            return Ok((self.unlit(item, principled.base_color, values)?, None));
        }
        let volume = item.extension("KHR_materials_volume")?;
        let thickness = volume
            .as_ref()
            .map_or(Ok(0.0), |volume| volume.number_in("thicknessFactor", 0.0..=ANY, 0.0))?;
        let (surface, medium) = if !principled.transmits() {
            (Principled { two_sided: true, ..principled }.into(), None)
        } else if thickness > 0.0 {
            let medium = volume.map_or(Ok(None), |volume| self.medium(item, &volume))?;
            (principled.into(), medium)
        } else {
            (thin(principled), None)
        };
        let surface = self.embossed(item, surface, values.tangents)?;
        let opacity = self.opacity(item, values)?;
        let emission = self.emission(item)?.times(&opacity);
        let material =
            Material { name: item.name(), surface, emission, hidden_emission: false, opacity };
        if self.context.was_loud() {
            let surface = substitute::surface();
            return Ok((Material { surface, opacity: 1.0.into(), ..material }, None));
        }
        Ok((material, medium))
    }

    /// KHR_materials_unlit: a surface that glows in its base colour, whatever shines on it, and reflects nothing.
    fn unlit(
        &mut self,
        item: &Item<'a>,
        color: Color,
        values: Values,
    ) -> Result<Material, LoadError> {
        self.warn(item, "it emits its base colour, and lights what is around it");
        let opacity = self.opacity(item, values)?;
        Ok(Material {
            name: item.name(),
            surface: Black.into(),
            emission: color.times(&opacity),
            hidden_emission: false,
            opacity,
        })
    }

    /// All that a material is but its relief, its holes and its glow.
    fn principled(&mut self, item: &Item<'a>, is_colored: bool) -> Result<Principled, LoadError> {
        let mut made = Principled {
            base_color: [1.0; 3].into(),
            metallic: 1.0.into(),
            roughness: 1.0.into(),
            multiple_scattering: true,
            layered: true,
            ..Principled::default()
        };
        if let Some(base) = item.child("pbrMetallicRoughness")? {
            let [r, g, b, _] = base_factor(&base)?;
            let texture = self.texture(&base, "baseColorTexture", Content::Colors)?;
            made.base_color = painted([r, g, b], texture);
            let mut number = |field, channel| {
                let factor = base.number_in(field, 0.0..=1.0, 1.0)? as f32;
                let texture =
                    self.texture(&base, "metallicRoughnessTexture", Content::Channel(channel))?;
                Ok::<_, LoadError>(measured(factor, texture))
            };
            made.roughness = number("roughnessFactor", 1)?;
            made.metallic = number("metallicFactor", 2)?;
        }
        made.base_color = tinted(made.base_color, is_colored);
        self.refraction(item, &mut made)?;
        self.coat(item, &mut made)?;
        self.sheen(item, &mut made)?;
        self.anisotropy(item, &mut made)?;
        for (extension, what) in PASSED_OVER {
            if item.extension(extension)?.is_some() {
                self.warn(item, format!("{extension} is passed over: {what}"));
            }
        }
        Ok(made)
    }

    /// KHR_materials_transmission, _ior and _specular. The strength of the reflection becomes an index where no light
    /// goes through: its reflectance at normal incidence is the one that is asked for.
    fn refraction(&mut self, item: &Item<'a>, made: &mut Principled) -> Result<(), LoadError> {
        if let Some(found) = item.extension("KHR_materials_transmission")? {
            let factor = found.number_in("transmissionFactor", 0.0..=1.0, 0.0)? as f32;
            let texture = self.texture(&found, "transmissionTexture", Content::Channel(0))?;
            made.spec_trans = measured(factor, texture.filter(|_| factor > 0.0));
        }
        if let Some(found) = item.extension("KHR_materials_ior")? {
            let ior = found.number_in("ior", 0.0..=ANY, 1.5)?;
            if ior != 0.0 && ior < 1.0 {
                let message = format!("expected an index of at least 1, or 0, found {ior}");
                return Err(found.refuse("ior", message));
            }
            // 0 stands for an index without end; that of 100 reflects 96 %.
            made.ior = if ior == 0.0 { 100.0 } else { ior.min(100.0) as f32 };
        }
        let Some(found) = item.extension("KHR_materials_specular")? else { return Ok(()) };
        let strength = found.number_in("specularFactor", 0.0..=1.0, 1.0)? as f32;
        let color = found.color("specularColorFactor", ANY, [1.0; 3])?;
        if found.has("specularTexture") || found.has("specularColorTexture") {
            self.warn(&found, "its textures are not read; its numbers are");
        }
        if color.iter().any(|c| *c != color[0]) {
            self.warn(&found, "the colour of the reflection becomes a grey of the same luminance");
        }
        let scale = strength * gloss::luminance(color);
        if made.transmits() {
            if scale != 1.0 {
                self.warn(&found, "it is not read where light goes through");
            }
            return Ok(());
        }
        let root = (made.ior - 1.0) / (made.ior + 1.0);
        let root = (root * root * scale).clamp(0.0, 0.96).sqrt();
        made.ior = (1.0 + root) / (1.0 - root);
        Ok(())
    }

    /// KHR_materials_clearcoat.
    fn coat(&mut self, item: &Item<'a>, made: &mut Principled) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_clearcoat")? else { return Ok(()) };
        let factor = found.number_in("clearcoatFactor", 0.0..=1.0, 0.0)? as f32;
        let texture = self.texture(&found, "clearcoatTexture", Content::Channel(0))?;
        made.clearcoat = measured(factor, texture.filter(|_| factor > 0.0));
        let roughness = found.number_in("clearcoatRoughnessFactor", 0.0..=1.0, 0.0)? as f32;
        let content = Content::Complement { factor: roughness.to_bits() };
        let texture = self.texture(&found, "clearcoatRoughnessTexture", content)?;
        let texture = texture.filter(|_| made.clearcoat != Scalar::Value(0.0) && roughness > 0.0);
        made.clearcoat_gloss = match texture {
            Some(texture) => Input::Texture(texture),
            None => (1.0 - roughness).into(),
        };
        if found.has("clearcoatNormalTexture") {
            self.warn(
                &found,
                "the normals of the coat are not read; it has those of what is below",
            );
        }
        Ok(())
    }

    /// KHR_materials_sheen: as much of Burley's sheen as the luminance of its colour.
    fn sheen(&mut self, item: &Item<'a>, made: &mut Principled) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_sheen")? else { return Ok(()) };
        let color = found.color("sheenColorFactor", 1.0, [0.0; 3])?;
        let [r, g, b] = color;
        let texture = self.texture(&found, "sheenColorTexture", Content::Colors)?;
        let texture = texture.filter(|_| color != [0.0; 3]);
        if (r, g) != (g, b) || texture.is_some() {
            self.warn(&found, "the colour of the sheen becomes a grey of the same luminance");
        }
        made.sheen = match painted(color, texture) {
            Input::Texture(texture) => Input::Texture(texture),
            Input::Value(_) => gloss::luminance(color).into(),
        };
        if found.has("sheenRoughnessTexture") {
            self.warn(&found, "its roughness is not read, nor the texture of that");
        }
        Ok(())
    }

    /// KHR_materials_anisotropy, along the direction of u or v. There α is stretched to mix(α, 1, s²) along it;
    /// here αᵤ / αᵥ = 1 / (1 − 0.9 a), and the roots of α give the same product.
    fn anisotropy(&mut self, item: &Item<'a>, made: &mut Principled) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_anisotropy")? else { return Ok(()) };
        let strength = found.number_in("anisotropyStrength", 0.0..=1.0, 0.0)? as f32;
        let rotation = found.number("anisotropyRotation")?.unwrap_or(0.0);
        if strength == 0.0 {
            return Ok(());
        }
        let Scalar::Value(roughness) = made.roughness else {
            self.warn(&found, "it is passed over, as the roughness has a texture");
            return Ok(());
        };
        if rotation != 0.0 || found.has("anisotropyTexture") {
            self.warn(&found, "its rotation and texture are not read; highlights are long along u");
        }
        let (anisotropic, roughness) = stretched(roughness, strength);
        made.anisotropic = anisotropic.into();
        made.roughness = roughness.into();
        Ok(())
    }

    /// KHR_materials_volume: what is left of light behind a distance says the extinction, σt = −ln(c) / d.
    fn medium(&mut self, item: &Item<'a>, volume: &Item<'a>) -> Result<Option<u32>, LoadError> {
        let color = volume.color("attenuationColor", 1.0, [1.0; 3])?;
        if color == [1.0; 3] || !volume.has("attenuationDistance") {
            return Ok(None);
        }
        let distance = volume.number_in("attenuationDistance", 0.0..=ANY, ANY)? as f32;
        if distance <= 0.0 {
            return Err(volume.refuse("attenuationDistance", "expected a distance above 0"));
        }
        let extinction = color.map(|c| -trig::ln(c.max(LEAST_TRANSMITTANCE)) / distance);
        if !extinction.iter().all(|sigma| sigma.is_finite()) {
            return Err(volume.refuse("attenuationDistance", "it is too small; use a larger one"));
        }
        let matter = Matter::Homogeneous { extinction, albedo: [0.0; 3], emission: [0.0; 3] };
        let medium =
            Medium { name: item.name(), matter, phase: Phase::default(), at: volume.span() };
        self.scene.media.push(medium);
        Ok(Some(self.scene.media.len() as u32 - 1))
    }

    /// The material of the triangles on which texture coordinates lie mirrored: there, the normals of an image lean to
    /// the other side of u.
    pub(super) fn mirrored(&mut self, item: &Item<'a>, made: Made) -> Result<u32, LoadError> {
        if let Some(known) = self.mirrored.get(&made.material) {
            return Ok(*known);
        }
        let mut material = self.scene.materials[made.material as usize].clone();
        if let Surface::Embossed(embossed) = &mut material.surface
            && let has_tangents = matches!(embossed.relief, Relief::NormalsAlong(..))
            && let Some(relief) = self.relief(item, true, has_tangents)?
        {
            embossed.relief = relief;
        }
        let mirrored = self.scene.materials.len() as u32;
        self.scene.materials.push(material);
        self.mirrored.insert(made.material, mirrored);
        Ok(mirrored)
    }

    /// A surface with the relief of its normal texture, if it has one.
    fn embossed(
        &mut self,
        item: &Item<'a>,
        surface: Surface,
        has_tangents: bool,
    ) -> Result<Surface, LoadError> {
        Ok(match self.relief(item, false, has_tangents)? {
            Some(relief) => Embossed::new(surface, relief).into(),
            None => surface,
        })
    }

    fn relief(
        &mut self,
        item: &Item<'a>,
        is_mirrored: bool,
        has_tangents: bool,
    ) -> Result<Option<Relief>, LoadError> {
        let Some(info) = item.child("normalTexture")? else { return Ok(None) };
        let scale = info.number_in("scale", -ANY..=ANY, 1.0)? as f32;
        if has_tangents {
            let content = Content::Normals { scale: scale.to_bits(), is_mirrored };
            let normals = self.texture(item, "normalTexture", content)?;
            let tangents = Pattern::FaceAttribute(Values::TANGENTS.into());
            return Ok(normals.map(|map| Relief::NormalsAlong(map, Arc::new(tangents.into()))));
        }
        let to_pattern = placement(&info)?;
        let is_mirrored = is_mirrored != (to_pattern.determinant() < 0.0);
        let is_turned = to_pattern.x_axis.y != 0.0 || to_pattern.x_axis.x < 0.0;
        let content = Content::Normals { scale: scale.to_bits(), is_mirrored };
        let made = if is_turned { Relief::TurnedNormals } else { Relief::Normals };
        Ok(self.texture(item, "normalTexture", content)?.map(made))
    }

    /// Radiance, in candela per square metre.
    fn emission(&mut self, item: &Item<'a>) -> Result<Color, LoadError> {
        let strength = item.extension("KHR_materials_emissive_strength")?;
        let strength = strength
            .map_or(Ok(1.0), |found| found.number_in("emissiveStrength", 0.0..=ANY, 1.0))?;
        let factor = item.color("emissiveFactor", ANY, [0.0; 3])?.map(|c| c * strength as f32);
        if factor == [0.0; 3] {
            return Ok(factor.into());
        }
        if !factor.iter().all(|c| c.is_finite()) {
            return Err(item.refuse(
                "emissiveFactor",
                "it is infinite with its strength; use smaller numbers",
            ));
        }
        let texture = self.texture(item, "emissiveTexture", Content::Colors)?;
        Ok(painted(factor, texture))
    }

    /// The share of the surface that is there, by its alpha mode.
    fn opacity(&mut self, item: &Item<'a>, values: Values) -> Result<Scalar, LoadError> {
        let mode = item.text("alphaMode")?.unwrap_or("OPAQUE");
        if mode == "OPAQUE" {
            return Ok(1.0.into());
        }
        let base = item.child("pbrMetallicRoughness")?;
        let factor = base.as_ref().map_or(Ok([1.0; 4]), base_factor)?[3];
        let mut textured = |content| match &base {
            Some(base) => self.texture(base, "baseColorTexture", content),
            None => Ok(None),
        };
        match mode {
            "BLEND" => {
                let share = measured(factor, textured(Content::Opacity)?);
                Ok(if values.opacities { covered(share) } else { share })
            }
            "MASK" => {
                let cutoff = item.number_in("alphaCutoff", 0.0..=ANY, 0.5)? as f32;
                let is_there = f32::from(u8::from(factor >= cutoff));
                let least = if factor > 0.0 { cutoff / factor } else { f32::INFINITY };
                let texture = textured(Content::Mask(least.to_bits()))?;
                Ok(texture.map_or(is_there.into(), Input::Texture))
            }
            _ => Err(item.refuse("alphaMode", "expected OPAQUE, MASK or BLEND")),
        }
    }
}

/// A share of the opacities of vertices.
fn covered(share: Scalar) -> Scalar {
    let opacities: Arc<Texture> =
        Arc::new(Pattern::VertexAttribute(Values::OPACITIES.into()).into());
    match share {
        Input::Value(share) => measured(share, Some(opacities)),
        Input::Texture(texture) => {
            let factors = [texture, opacities].map(Input::Texture);
            Input::Texture(Arc::new(Pattern::Product(Box::new(factors)).into()))
        }
    }
}

/// What emits the same behind a surface, and lets all light through to it.
fn back_of(front: &Material) -> Material {
    Material { surface: Black.into(), opacity: 0.0.into(), ..front.clone() }
}

/// What has no material: a rough white metal. [glTF 2.0, §3.9.6]
fn default_material(is_colored: bool) -> Material {
    let surface = Principled {
        base_color: tinted([1.0; 3].into(), is_colored),
        metallic: 1.0.into(),
        roughness: 1.0.into(),
        two_sided: true,
        multiple_scattering: true,
        layered: true,
        ..Principled::default()
    };
    Material {
        name: "default".to_owned(),
        surface: surface.into(),
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    }
}

/// Textures of extensions that are read, or stand for numbers that are.
const EXTENSION_TEXTURES: [(&str, &str); 4] = [
    ("KHR_materials_sheen", "sheenColorTexture"),
    ("KHR_materials_transmission", "transmissionTexture"),
    ("KHR_materials_clearcoat", "clearcoatTexture"),
    ("KHR_materials_clearcoat", "clearcoatRoughnessTexture"),
];

/// Extensions of materials without effect, and what that means.
const PASSED_OVER: [(&str, &str); 3] = [
    ("KHR_materials_iridescence", "reflections have no colours of thin films"),
    ("KHR_materials_dispersion", "all colours are refracted alike"),
    ("KHR_materials_diffuse_transmission", "no light goes through diffusely"),
];

/// The factor of the base colour and of the opacity.
fn base_factor(base: &Item<'_>) -> Result<[f32; 4], LoadError> {
    let Some(factor) = base.vector::<4>("baseColorFactor")? else { return Ok([1.0; 4]) };
    if let Some(bad) = factor.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        let message = format!("expected numbers from 0 to 1, found {bad}");
        return Err(base.refuse("baseColorFactor", message));
    }
    Ok(factor.map(|c| c as f32))
}

/// A colour times those of the vertices.
fn tinted(color: Color, is_colored: bool) -> Color {
    if !is_colored {
        return color;
    }
    let colors: Arc<Texture> = Arc::new(Pattern::VertexColors.into());
    match color {
        Input::Value(factor) => painted(factor, Some(colors)),
        Input::Texture(texture) => {
            let factors = [texture, colors].map(Input::Texture);
            Input::Texture(Arc::new(Pattern::Product(Box::new(factors)).into()))
        }
    }
}

/// A sheet without an inside, as light that goes through without a thickness asks for. Where it is a metal, no light
/// goes through.
fn thin(solid: Principled) -> Surface {
    let metallic = solid.metallic.clone();
    let sheet = PrincipledThin {
        base_color: solid.base_color.clone(),
        roughness: solid.roughness.clone(),
        anisotropic: solid.anisotropic.clone(),
        spec_trans: solid.spec_trans.clone(),
        ior: solid.ior,
        sheen: solid.sheen.clone(),
        ..PrincipledThin::default()
    };
    if metallic == Scalar::Value(0.0) {
        return sheet.into();
    }
    let metal =
        Principled { spec_trans: 0.0.into(), metallic: 1.0.into(), two_sided: true, ..solid };
    Mix { first: Box::new(sheet.into()), second: Box::new(metal.into()), share: metallic }.into()
}

/// The anisotropy and √α of facets that glTF stretches by a strength.
pub(super) fn stretched(roughness: f32, strength: f32) -> (f32, f32) {
    /// Below, facets are as good as smooth.
    const LEAST_ALPHA: f32 = 1e-4;
    let across = (roughness * roughness).max(LEAST_ALPHA);
    let along = across + (1.0 - across) * strength * strength;
    let anisotropic = ((1.0 - across / along) / 0.9).clamp(0.0, 1.0);
    (anisotropic, (across * along).sqrt().sqrt().min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn facets_are_stretched_as_much_as_was_asked_for() {
        for (roughness, strength) in [(0.5_f32, 0.5_f32), (0.3, 0.2), (0.8, 1.0), (0.5, 0.0)] {
            let (anisotropic, root) = stretched(roughness, strength);
            let aspect = (1.0 - 0.9 * anisotropic).sqrt();
            let (along, across) = (root * root / aspect, root * root * aspect);
            let alpha = roughness * roughness;
            assert!((across - alpha).abs() < 1e-6);
            assert!((along - (alpha + (1.0 - alpha) * strength * strength)).abs() < 1e-6);
        }
    }
}
