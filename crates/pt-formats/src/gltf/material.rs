//! Metallic-roughness materials and their extensions. [glTF 2.0, §3.9 and app. B]

use std::sync::Arc;

use pt_math::trig;
use pt_scene::material::{Black, CoatNormals, MetallicRoughness, SurfaceDetail};
use pt_scene::medium::{Medium, MediumProperties, Phase};
use pt_scene::texture::{Blend, Color, Input, NormalOrBump, Pattern, Scalar, Texture};
use pt_scene::{Material, Surface};

use super::GltfReader;
use super::item::Item;
use super::texture::{TextureUsage, measured, painted, placement};
use crate::LoadError;
use crate::shared::placeholder;

/// Upper limit of channels and intensities without a limit: the largest single-precision number.
const ANY: f64 = f32::MAX as f64;
/// Minimum transmittance at the attenuation distance; 0 would require an infinite extinction.
const MIN_TRANSMITTANCE: f32 = 1e-4;

/// Texture coordinates and alpha mode of a material.
#[derive(Clone, Debug, Default)]
pub(super) struct MaterialLayout {
    /// Texture coordinate set of the first texture, which is the normal map if there is one; `None`
    /// without textures.
    pub(super) uv_set: Option<usize>,
    /// Other texture coordinate sets that are used, in no particular order.
    pub(super) other_sets: Vec<u32>,
    /// True if there is a normal map or anisotropy, which differ on triangles with mirrored
    /// coordinates.
    pub(super) has_frame: bool,
    /// True if the alpha mode is BLEND.
    pub(super) is_blended: bool,
    /// True if the alpha mode is MASK.
    pub(super) is_masked: bool,
}

/// Mesh attributes that a material uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct MeshAttributes {
    /// True if the vertices have colours.
    pub(super) colors: bool,
    /// True if the mesh has tangents for normal maps.
    pub(super) tangents: bool,
    /// True if the vertices have opacities.
    pub(super) opacities: bool,
}

impl MeshAttributes {
    /// Name of the tangents among the [attributes](pt_scene::Attributes) of a mesh.
    pub(super) const TANGENTS: &str = "TANGENT";
    /// Name of the opacities among the attributes of a mesh.
    pub(super) const OPACITIES: &str = "opacity of COLOR_0";
}

/// Indices of a material and its interior medium.
#[derive(Clone, Copy, Debug)]
pub(super) struct MaterialIndices {
    /// Index into [`pt_scene::Scene::materials`].
    pub(super) material: u32,
    /// Index into [`pt_scene::Scene::media`] of the interior medium.
    pub(super) medium: Option<u32>,
    /// Index into [`pt_scene::Scene::materials`] of the emitter behind a surface that emits on both
    /// sides.
    pub(super) back: Option<u32>,
}

impl<'a> GltfReader<'a> {
    /// Finds the texture coordinate sets and the alpha mode of a material.
    pub(super) fn layout(material: Option<&Item<'a>>) -> Result<MaterialLayout, LoadError> {
        let Some(material) = material else { return Ok(MaterialLayout::default()) };
        let mut sets = Vec::new();
        sets.extend(Self::uv_set_of(material, "normalTexture")?);
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
        let coat = material.extension("KHR_materials_clearcoat")?;
        if let Some(coat) = &coat {
            sets.extend(Self::uv_set_of(coat, "clearcoatNormalTexture")?);
        }
        let uv_set = sets.first().copied();
        let mut other_sets = Vec::new();
        for set in sets.into_iter().filter(|set| Some(*set) != uv_set) {
            let number =
                u32::try_from(set).map_err(|_| material.error("found no such TEXCOORD"))?;
            if !other_sets.contains(&number) {
                other_sets.push(number);
            }
        }
        let mode = material.text("alphaMode")?;
        let (is_blended, is_masked) = (mode == Some("BLEND"), mode == Some("MASK"));
        let has_frame = material.has("normalTexture")
            || coat.is_some_and(|coat| coat.has("clearcoatNormalTexture"))
            || material.extension("KHR_materials_anisotropy")?.is_some();
        Ok(MaterialLayout { uv_set, other_sets, has_frame, is_blended, is_masked })
    }

    /// Returns the material of a primitive, which is created once per set of mesh attributes.
    pub(super) fn material(
        &mut self,
        index: Option<usize>,
        described: Option<&Item<'a>>,
        values: MeshAttributes,
    ) -> Result<MaterialIndices, LoadError> {
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
        let made =
            MaterialIndices { material: number, medium, back: back.as_ref().map(|_| number + 1) };
        self.scene.materials.extend(std::iter::once(material).chain(back));
        self.materials.insert((index, values), made);
        Ok(made)
    }

    fn described(
        &mut self,
        item: &Item<'a>,
        values: MeshAttributes,
    ) -> Result<(Material, Option<u32>), LoadError> {
        self.context.take_placeholder_used();
        self.uv_set = Self::layout(Some(item))?.uv_set;
        let look = self.look(item, values)?;
        if item.extension("KHR_materials_unlit")?.is_some() {
            return Ok((self.unlit(item, look.base_color, values)?, None));
        }
        let volume = item.extension("KHR_materials_volume")?;
        let thickness = volume
            .as_ref()
            .map_or(Ok(0.0), |volume| volume.number_in("thicknessFactor", 0.0..=ANY, 0.0))?;
        let (surface, medium) = if !look.transmits() {
            (MetallicRoughness { two_sided: true, ..look }, None)
        } else if thickness > 0.0 && look.transmission != Scalar::Value(0.0) {
            let medium = volume.map_or(Ok(None), |volume| self.medium(item, &volume))?;
            if look.diffuse_transmission != Scalar::Value(0.0) {
                let message = "diffuse transmission is ignored for volumes";
                self.warn(item, message);
            }
            (MetallicRoughness { diffuse_transmission: 0.0.into(), ..look }, medium)
        } else {
            (MetallicRoughness { thin: true, ..look }, None)
        };
        let surface = surface.into();
        let surface = self.embossed(item, surface, values.tangents)?;
        let opacity = self.opacity(item, values)?;
        let emission = self.emission(item)?.times(&opacity);
        let material =
            Material { name: item.name(), surface, emission, hidden_emission: false, opacity };
        if self.context.take_placeholder_used() {
            let surface = placeholder::surface();
            return Ok((Material { surface, opacity: 1.0.into(), ..material }, None));
        }
        Ok((material, medium))
    }

    /// KHR_materials_unlit: a surface that emits its base colour and reflects nothing.
    fn unlit(
        &mut self,
        item: &Item<'a>,
        color: Color,
        values: MeshAttributes,
    ) -> Result<Material, LoadError> {
        self.warn(item, "unlit material: its base colour is emitted and lights the scene");
        let opacity = self.opacity(item, values)?;
        Ok(Material {
            name: item.name(),
            surface: Black.into(),
            emission: color.times(&opacity),
            hidden_emission: false,
            opacity,
        })
    }

    /// Reads the scattering parameters of a material, without normal map, alpha and emission.
    fn look(
        &mut self,
        item: &Item<'a>,
        values: MeshAttributes,
    ) -> Result<MetallicRoughness, LoadError> {
        let mut made = MetallicRoughness { metallic: 1.0.into(), ..MetallicRoughness::default() };
        if let Some(base) = item.child("pbrMetallicRoughness")? {
            let [r, g, b, _] = base_factor(&base)?;
            let texture = self.texture(&base, "baseColorTexture", TextureUsage::Colors)?;
            made.base_color = painted([r, g, b], texture);
            let mut number = |field, channel| {
                let factor = base.number_in(field, 0.0..=1.0, 1.0)? as f32;
                let texture = self.texture(
                    &base,
                    "metallicRoughnessTexture",
                    TextureUsage::Channel(channel),
                )?;
                Ok::<_, LoadError>(measured(factor, texture))
            };
            made.roughness = number("roughnessFactor", 1)?;
            made.metallic = number("metallicFactor", 2)?;
        }
        made.base_color = tinted(made.base_color, values.colors);
        self.refraction(item, &mut made)?;
        self.diffuse_transmission(item, &mut made)?;
        self.coat(item, values, &mut made)?;
        self.sheen(item, &mut made)?;
        self.anisotropy(item, &mut made, values.tangents)?;
        self.film(item, &mut made)?;
        for (extension, what) in PASSED_OVER {
            if item.extension(extension)?.is_some() {
                self.warn(item, format!("{extension} is ignored: {what}"));
            }
        }
        Ok(made)
    }

    /// Reads a factor from 0 to 1 times a channel of a texture.
    fn factor(
        &mut self,
        found: &Item<'a>,
        [factor, texture]: [&str; 2],
        content: TextureUsage,
        usual: f64,
    ) -> Result<Scalar, LoadError> {
        let factor = found.number_in(factor, 0.0..=1.0, usual)? as f32;
        let texture = self.texture(found, texture, content)?;
        Ok(measured(factor, texture.filter(|_| factor > 0.0)))
    }

    /// Reads a colour factor with channels up to a maximum times a texture.
    fn colored(
        &mut self,
        found: &Item<'a>,
        [factor, texture]: [&str; 2],
        (most, usual): (f64, f32),
    ) -> Result<Color, LoadError> {
        let color = found.color(factor, most, [usual; 3])?;
        let texture = self.texture(found, texture, TextureUsage::Colors)?;
        Ok(painted(color, texture.filter(|_| color != [0.0; 3])))
    }

    /// KHR_materials_transmission, _ior and _specular.
    fn refraction(
        &mut self,
        item: &Item<'a>,
        made: &mut MetallicRoughness,
    ) -> Result<(), LoadError> {
        if let Some(found) = item.extension("KHR_materials_transmission")? {
            let names = ["transmissionFactor", "transmissionTexture"];
            made.transmission = self.factor(&found, names, TextureUsage::Channel(0), 0.0)?;
        }
        if let Some(found) = item.extension("KHR_materials_ior")? {
            let ior = found.number_in("ior", 0.0..=ANY, 1.5)?;
            if ior != 0.0 && ior < 1.0 {
                let message = format!("expected an index of at least 1, or 0, found {ior}");
                return Err(found.refuse("ior", message));
            }
            // 0 stands for an infinite index; an index of 100 reflects 96 %.
            made.ior = if ior == 0.0 { 100.0 } else { ior.min(100.0) as f32 };
        }
        if let Some(found) = item.extension("KHR_materials_specular")? {
            let names = ["specularFactor", "specularTexture"];
            made.specular = self.factor(&found, names, TextureUsage::Opacity, 1.0)?;
            let names = ["specularColorFactor", "specularColorTexture"];
            made.specular_color = self.colored(&found, names, (ANY, 1.0))?;
        }
        Ok(())
    }

    /// KHR_materials_diffuse_transmission.
    fn diffuse_transmission(
        &mut self,
        item: &Item<'a>,
        made: &mut MetallicRoughness,
    ) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_diffuse_transmission")? else {
            return Ok(());
        };
        let names = ["diffuseTransmissionFactor", "diffuseTransmissionTexture"];
        made.diffuse_transmission = self.factor(&found, names, TextureUsage::Opacity, 0.0)?;
        let names = ["diffuseTransmissionColorFactor", "diffuseTransmissionColorTexture"];
        made.diffuse_transmission_color = self.colored(&found, names, (1.0, 1.0))?;
        Ok(())
    }

    /// KHR_materials_clearcoat.
    fn coat(
        &mut self,
        item: &Item<'a>,
        values: MeshAttributes,
        made: &mut MetallicRoughness,
    ) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_clearcoat")? else { return Ok(()) };
        let names = ["clearcoatFactor", "clearcoatTexture"];
        made.clearcoat = self.factor(&found, names, TextureUsage::Channel(0), 0.0)?;
        if made.clearcoat == Scalar::Value(0.0) {
            return Ok(());
        }
        let names = ["clearcoatRoughnessFactor", "clearcoatRoughnessTexture"];
        made.clearcoat_roughness = self.factor(&found, names, TextureUsage::Channel(1), 0.0)?;
        made.clearcoat_normals = self.coat_normals(item, (false, values.tangents))?;
        Ok(())
    }

    /// Normals of a clearcoat: its own normal map, or the normals of the shape regardless of the
    /// base's normal map.
    pub(super) fn coat_normals(
        &mut self,
        item: &Item<'a>,
        lie: (bool, bool),
    ) -> Result<CoatNormals, LoadError> {
        let Some(found) = item.extension("KHR_materials_clearcoat")? else {
            return Ok(CoatNormals::Base);
        };
        Ok(match self.relief(&found, "clearcoatNormalTexture", lie)? {
            Some(relief) => CoatNormals::Relief(relief),
            None if item.has("normalTexture") => CoatNormals::Shape,
            None => CoatNormals::Base,
        })
    }

    /// KHR_materials_sheen.
    fn sheen(&mut self, item: &Item<'a>, made: &mut MetallicRoughness) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_sheen")? else { return Ok(()) };
        let names = ["sheenColorFactor", "sheenColorTexture"];
        made.sheen_color = self.colored(&found, names, (1.0, 0.0))?;
        if made.sheen_color == Color::Value([0.0; 3]) {
            return Ok(());
        }
        let names = ["sheenRoughnessFactor", "sheenRoughnessTexture"];
        made.sheen_roughness = self.factor(&found, names, TextureUsage::Opacity, 0.0)?;
        Ok(())
    }

    /// KHR_materials_anisotropy: the first two channels of the texture are the direction, the third
    /// one is a factor of the strength.
    fn anisotropy(
        &mut self,
        item: &Item<'a>,
        made: &mut MetallicRoughness,
        has_tangents: bool,
    ) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_anisotropy")? else { return Ok(()) };
        let names = ["anisotropyStrength", "anisotropyTexture"];
        made.anisotropy = self.factor(&found, names, TextureUsage::Channel(2), 0.0)?;
        if made.anisotropy == Scalar::Value(0.0) {
            return Ok(());
        }
        made.anisotropy_rotation = found.number("anisotropyRotation")?.unwrap_or(0.0) as f32;
        let mut channel = |c| self.texture(&found, "anisotropyTexture", TextureUsage::Channel(c));
        if let (Some(x), Some(y)) = (channel(0)?, channel(1)?) {
            made.anisotropy_direction = [x, y].map(Input::Texture);
        }
        made.anisotropy_along = has_tangents.then(tangents);
        Ok(())
    }

    /// KHR_materials_iridescence: without a texture, the film has its maximum thickness.
    fn film(&mut self, item: &Item<'a>, made: &mut MetallicRoughness) -> Result<(), LoadError> {
        let Some(found) = item.extension("KHR_materials_iridescence")? else { return Ok(()) };
        let names = ["iridescenceFactor", "iridescenceTexture"];
        made.iridescence = self.factor(&found, names, TextureUsage::Channel(0), 0.0)?;
        if made.iridescence == Scalar::Value(0.0) {
            return Ok(());
        }
        made.film_ior = found.number_in("iridescenceIor", 1.0..=ANY, 1.3)? as f32;
        let least = found.number_in("iridescenceThicknessMinimum", 0.0..=ANY, 100.0)? as f32;
        let most = found.number_in("iridescenceThicknessMaximum", 0.0..=ANY, 400.0)? as f32;
        let texture =
            self.texture(&found, "iridescenceThicknessTexture", TextureUsage::Channel(1))?;
        made.film_thickness = match texture {
            None => most.into(),
            Some(texture) => {
                let [first, second] = [least, most].map(|thickness| [thickness; 3].into());
                let blend = Blend { first, second, amount: Input::Texture(texture) };
                Input::Texture(Arc::new(Pattern::Blend(Box::new(blend)).into()))
            }
        };
        Ok(())
    }

    /// KHR_materials_volume: the extinction is σt = −ln(c) / d, where c is the attenuation colour
    /// and d the attenuation distance.
    fn medium(&mut self, item: &Item<'a>, volume: &Item<'a>) -> Result<Option<u32>, LoadError> {
        let color = volume.color("attenuationColor", 1.0, [1.0; 3])?;
        if color == [1.0; 3] || !volume.has("attenuationDistance") {
            return Ok(None);
        }
        let distance = volume.number_in("attenuationDistance", 0.0..=ANY, ANY)? as f32;
        if distance <= 0.0 {
            return Err(volume.refuse("attenuationDistance", "expected a distance above 0"));
        }
        let extinction = color.map(|c| -trig::ln(c.max(MIN_TRANSMITTANCE)) / distance);
        if !extinction.iter().all(|sigma| sigma.is_finite()) {
            return Err(volume.refuse(
                "attenuationDistance",
                "found a distance that is too small; use a larger one",
            ));
        }
        let matter =
            MediumProperties::Homogeneous { extinction, albedo: [0.0; 3], emission: [0.0; 3] };
        let medium =
            Medium { name: item.name(), matter, phase: Phase::default(), at: volume.span() };
        self.scene.media.push(medium);
        Ok(Some(self.scene.media.len() as u32 - 1))
    }

    /// Adds the normal map of a material to its surface, if it has one.
    fn embossed(
        &mut self,
        item: &Item<'a>,
        surface: Surface,
        has_tangents: bool,
    ) -> Result<Surface, LoadError> {
        Ok(match self.relief(item, "normalTexture", (false, has_tangents))? {
            Some(relief) => SurfaceDetail::new(surface, relief).into(),
            None => surface,
        })
    }

    /// Reads a normal map, for mirrored texture coordinates or along tangents if so specified.
    pub(super) fn relief(
        &mut self,
        item: &Item<'a>,
        field: &'static str,
        (is_mirrored, has_tangents): (bool, bool),
    ) -> Result<Option<NormalOrBump>, LoadError> {
        let Some(info) = item.child(field)? else { return Ok(None) };
        let scale = info.number_in("scale", -ANY..=ANY, 1.0)? as f32;
        if has_tangents {
            let content = TextureUsage::Normals { scale: scale.to_bits(), is_mirrored };
            let normals = self.texture(item, field, content)?;
            return Ok(normals.map(|map| NormalOrBump::NormalsAlong(map, tangents())));
        }
        let to_pattern = placement(&info)?;
        let is_mirrored = is_mirrored != (to_pattern.determinant() < 0.0);
        let is_turned = to_pattern.x_axis.y != 0.0 || to_pattern.x_axis.x < 0.0;
        let content = TextureUsage::Normals { scale: scale.to_bits(), is_mirrored };
        let made = if is_turned { NormalOrBump::TurnedNormals } else { NormalOrBump::Normals };
        Ok(self.texture(item, field, content)?.map(made))
    }

    /// Reads the emitted radiance, in candela per square metre.
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
                "the product of emission and strength is infinite; use smaller numbers",
            ));
        }
        let texture = self.texture(item, "emissiveTexture", TextureUsage::Colors)?;
        Ok(painted(factor, texture))
    }

    /// Reads the opacity according to the alpha mode.
    fn opacity(&mut self, item: &Item<'a>, values: MeshAttributes) -> Result<Scalar, LoadError> {
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
                let share = measured(factor, textured(TextureUsage::Opacity)?);
                Ok(if values.opacities { covered(share) } else { share })
            }
            "MASK" => {
                let cutoff = item.number_in("alphaCutoff", 0.0..=ANY, 0.5)? as f32;
                let is_there = f32::from(u8::from(factor >= cutoff));
                let least = if factor > 0.0 { cutoff / factor } else { f32::INFINITY };
                let texture = textured(TextureUsage::Mask(least.to_bits()))?;
                Ok(texture.map_or(is_there.into(), Input::Texture))
            }
            _ => Err(item.refuse("alphaMode", "expected OPAQUE, MASK or BLEND")),
        }
    }
}

/// Multiplies an opacity by those of the vertices.
fn covered(share: Scalar) -> Scalar {
    let opacities: Arc<Texture> =
        Arc::new(Pattern::VertexAttribute(MeshAttributes::OPACITIES.into()).into());
    match share {
        Input::Value(share) => measured(share, Some(opacities)),
        Input::Texture(texture) => {
            let factors = [texture, opacities].map(Input::Texture);
            Input::Texture(Arc::new(Pattern::Product(Box::new(factors)).into()))
        }
    }
}

/// Creates the emitter behind a two-sided surface: the same emission, and no surface.
fn back_of(front: &Material) -> Material {
    Material { surface: Black.into(), opacity: 0.0.into(), ..front.clone() }
}

/// Tangents of a mesh as coefficients of ∂p/∂u and ∂p/∂v.
fn tangents() -> Arc<Texture> {
    Arc::new(Pattern::FaceAttribute(MeshAttributes::TANGENTS.into()).into())
}

/// Default material: a rough white metal. [glTF 2.0, §3.9.6]
fn default_material(is_colored: bool) -> Material {
    let surface = MetallicRoughness {
        base_color: tinted([1.0; 3].into(), is_colored),
        metallic: 1.0.into(),
        two_sided: true,
        ..MetallicRoughness::default()
    };
    Material {
        name: "default".to_owned(),
        surface: surface.into(),
        emission: [0.0; 3].into(),
        hidden_emission: false,
        opacity: 1.0.into(),
    }
}

/// Textures of supported extensions.
const EXTENSION_TEXTURES: [(&str, &str); 12] = [
    ("KHR_materials_anisotropy", "anisotropyTexture"),
    ("KHR_materials_clearcoat", "clearcoatRoughnessTexture"),
    ("KHR_materials_clearcoat", "clearcoatTexture"),
    ("KHR_materials_diffuse_transmission", "diffuseTransmissionColorTexture"),
    ("KHR_materials_diffuse_transmission", "diffuseTransmissionTexture"),
    ("KHR_materials_iridescence", "iridescenceTexture"),
    ("KHR_materials_iridescence", "iridescenceThicknessTexture"),
    ("KHR_materials_sheen", "sheenColorTexture"),
    ("KHR_materials_sheen", "sheenRoughnessTexture"),
    ("KHR_materials_specular", "specularColorTexture"),
    ("KHR_materials_specular", "specularTexture"),
    ("KHR_materials_transmission", "transmissionTexture"),
];

/// Material extensions that are ignored, with the consequence of that.
const PASSED_OVER: [(&str, &str); 1] =
    [("KHR_materials_dispersion", "all colours are refracted alike")];

/// Reads the factor of base colour and opacity.
fn base_factor(base: &Item<'_>) -> Result<[f32; 4], LoadError> {
    let Some(factor) = base.vector::<4>("baseColorFactor")? else { return Ok([1.0; 4]) };
    if let Some(bad) = factor.iter().find(|c| !(0.0..=1.0).contains(*c)) {
        let message = format!("expected numbers from 0 to 1, found {bad}");
        return Err(base.refuse("baseColorFactor", message));
    }
    Ok(factor.map(|c| c as f32))
}

/// Multiplies a colour by the vertex colours, if there are any.
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
