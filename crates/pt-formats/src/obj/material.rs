//! Conversion of MTL materials.
//!
//! | in the file | becomes |
//! |---|---|
//! | `Pr`, `Pm`, `Ps`, `Pc`, `Pcr`, `aniso`, `map_Pr` or `map_Pm` | [`MetallicRoughness`] |
//! | `illum` 6 or 7, without `map_d` | [`Glass`] |
//! | `illum` 4 or 9, without `map_d`, and `d` missing or 0 | [`ThinGlass`] |
//! | `illum` 3 or 5, `Kd` black and `Ks` not | [`Mirror`] |
//! | `illum` 0 or 1, or `Ks` missing or black | [`Diffuse`](pt_scene::material::Diffuse) |
//! | others | [`Plastic`](pt_scene::material::Plastic) |

use std::sync::Arc;

use pt_math::Spectrum;
use pt_scene::image::Image;
use pt_scene::material::{Glass, MetallicRoughness, Mirror, SurfaceDetail, ThinGlass};
use pt_scene::texture::{Color, Input, NormalOrBump, Pattern, Scalar, Texture};
use pt_scene::{Material, Surface};

use super::library::Described;
use super::map::{MapImages, MapUsage, TextureMap};
use super::mtl::{self, StatementValues};
use super::notes::MaterialNotes;
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::names::quote;
use crate::shared::{legacy_specular, placeholder};

/// √α of the sheen, which files do not specify.
const SHEEN_ROUGHNESS: f32 = 0.5;
/// Default diffuse colour of materials without an image: that of objects without a material.
const DEFAULT_DIFFUSE: f32 = 0.5;
/// Default index of refraction of glass: that of windows.
const DEFAULT_IOR: f32 = 1.5;
/// Maximum index of refraction, whose reflectance is 96 %.
const MAX_IOR: f32 = 100.0;
/// Default roughness of a physically based material without `Ns`.
const DEFAULT_ROUGHNESS: f32 = 0.5;
/// Statements that make a material physically based.
const PHYSICAL: [&str; 8] = ["Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "map_Pr", "map_Pm"];

/// Converter of the materials of a file.
pub(super) struct MaterialConverter<'f, 'n> {
    folder: &'f Folder,
    images: MapImages<'f>,
    notes: &'n mut MaterialNotes,
    /// True if any material has an image.
    pub(super) shows_images: bool,
}

impl<'f, 'n> MaterialConverter<'f, 'n> {
    pub(super) fn new(folder: &'f Folder, notes: &'n mut MaterialNotes) -> Self {
        Self { folder, images: MapImages::new(folder), notes, shows_images: false }
    }

    /// Converts a material.
    ///
    /// # Errors
    /// Returns an error if nothing more can be read.
    pub(super) fn material(
        &mut self,
        name: &str,
        described: &Described,
    ) -> Result<Material, LoadError> {
        let context = &self.folder.context;
        let values = StatementValues::read(described, context, self.notes)?;
        context.take_placeholder_used();
        let mut made = MaterialBuilder { maker: self, described, values };
        let (surface, opacity) = made.surface();
        let surface = made.embossed(surface);
        let emission = made.painted("Ke", "map_Ke", 0.0);
        // Transparent parts do not emit.
        let emission = emission.times(&opacity);
        let is_loud = context.take_placeholder_used();
        Ok(Material {
            name: name.to_owned(),
            surface: if is_loud { placeholder::surface() } else { surface },
            emission,
            hidden_emission: false,
            opacity: if is_loud { 1.0.into() } else { opacity },
        })
    }
}

/// A material under construction.
struct MaterialBuilder<'m, 'd, 'f, 'n> {
    maker: &'m mut MaterialConverter<'f, 'n>,
    described: &'d Described,
    values: StatementValues,
}

impl MaterialBuilder<'_, '_, '_, '_> {
    /// Adds a warning about a statement.
    fn note(&mut self, word: &str, message: String) {
        let at = self.values.at(word).unwrap_or_else(|| mtl::place(self.described));
        self.maker.notes.add(at, message);
    }

    fn texture(&mut self, map: &TextureMap, content: MapUsage) -> Arc<Texture> {
        self.maker.shows_images = true;
        self.maker.images.texture(map, content)
    }

    /// Returns the scattering and the opacity of the surface.
    fn surface(&mut self) -> (Surface, Scalar) {
        let model = self.values.number("illum").unwrap_or(2.0);
        if model.fract() != 0.0 || model == 10.0 {
            self.note("illum", format!("unsupported illum {model}; illum 2 is used"));
        }
        let is_solid_glass = (model == 6.0 || model == 7.0) && !self.values.has("map_d");
        let dissolve = self.dissolve();
        if PHYSICAL.iter().any(|word| self.values.has(word)) {
            let surface = self.metallic_roughness(is_solid_glass).into();
            return (surface, if is_solid_glass { 1.0.into() } else { self.opacity(dissolve) });
        }
        let is_thin_glass = (model == 4.0 || model == 9.0)
            && !self.values.has("map_d")
            && dissolve.unwrap_or(0.0) == 0.0;
        if is_solid_glass || is_thin_glass {
            if dissolve.is_some_and(|d| d > 0.0 && d < 1.0) {
                self.note(
                    "d",
                    "\"d\" is ignored for glass: it transmits all light that it does not reflect"
                        .to_owned(),
                );
            }
            return (self.glass(is_thin_glass), 1.0.into());
        }
        let is_mirror = model == 3.0 || model == 5.0;
        let has_gloss = model >= 2.0;
        let surface = self.opaque(is_mirror, has_gloss);
        (surface, self.opacity(dissolve))
    }

    /// Returns the opacity as a number, if it is given.
    fn dissolve(&mut self) -> Option<f32> {
        let inverse = self.values.number("Tr").map(|transparency| 1.0 - transparency);
        let Some(dissolve) = self.values.number("d") else { return inverse };
        if inverse.is_some_and(|inverse| (inverse - dissolve).abs() > 1e-3) {
            self.note(
                "Tr",
                "found \"d\" and \"Tr\" that do not add up to 1; \"d\" is used".to_owned(),
            );
        }
        Some(dissolve)
    }

    fn opacity(&mut self, dissolve: Option<f32>) -> Scalar {
        if let Some(map) = self.values.map("map_d").cloned() {
            let texture = self.texture(&map, MapUsage::Opacity);
            let factor = dissolve.filter(|d| *d > 0.0).unwrap_or(1.0);
            return scaled(texture, factor);
        }
        if dissolve == Some(0.0) {
            let message =
                "invisible material; for glass, use illum 4, 6 or 7, otherwise \"d\" above 0";
            let word = if self.values.has("d") { "d" } else { "Tr" };
            self.note(word, message.to_owned());
        }
        dissolve.unwrap_or(1.0).into()
    }

    /// Returns the index of refraction of glass.
    fn ior(&mut self) -> f32 {
        match self.values.number("Ni") {
            Some(0.0) => {
                self.note("Ni", format!("found \"Ni\" 0; {DEFAULT_IOR} is used"));
                DEFAULT_IOR
            }
            Some(ior) => ior.clamp(1.0 / MAX_IOR, MAX_IOR),
            None => DEFAULT_IOR,
        }
    }

    fn glass(&mut self, is_thin: bool) -> Surface {
        let ior = self.ior();
        let reflectance = [1.0; 3].into();
        let transmittance = self.values.color("Tf").unwrap_or([1.0; 3]).into();
        if is_thin {
            ThinGlass { reflectance, transmittance, ior }.into()
        } else {
            Glass { reflectance, transmittance, ior, roughness: None }.into()
        }
    }

    /// Returns an opaque surface with the Phong model.
    fn opaque(&mut self, is_mirror: bool, has_gloss: bool) -> Surface {
        let tints = self.values.color("Tf").is_some_and(|tf| tf != [1.0; 3] && tf != [0.0; 3]);
        if tints {
            self.note(
                "Tf",
                "\"Tf\" is ignored: it is supported for glass only (illum 4, 6, 7 or 9)".to_owned(),
            );
        }
        let diffuse = self.painted("Kd", "map_Kd", DEFAULT_DIFFUSE);
        let specular = if has_gloss { self.painted("Ks", "map_Ks", 0.0) } else { [0.0; 3].into() };
        if is_mirror && legacy_specular::amount(&specular) > legacy_specular::MIN {
            if legacy_specular::amount(&diffuse) <= legacy_specular::MIN {
                return Mirror { reflectance: specular }.into();
            }
            let message = "mirrors that are also diffuse are not supported; the gloss of \"Ks\" \
                           and \"Ns\" is used";
            self.note("illum", message.to_owned());
        }
        let exponent = self.exponent().unwrap_or(legacy_specular::DEFAULT_EXPONENT);
        legacy_specular::phong(diffuse, specular, exponent)
    }

    /// Returns `Ns`, clamped to at least 0.
    fn exponent(&mut self) -> Option<f32> {
        let exponent = self.values.number("Ns")?;
        if exponent < 0.0 {
            self.note("Ns", "found \"Ns\" below 0; 0 is used".to_owned());
        }
        Some(exponent.max(0.0))
    }

    /// Returns a physically based surface, for which `Ks` is ignored, and `illum` except for
    /// transmission.
    fn metallic_roughness(&mut self, is_glass: bool) -> MetallicRoughness {
        let number = |word| self.values.number(word).unwrap_or(0.0);
        let (sheen, coat, coat_roughness) = (number("Ps"), number("Pc"), number("Pcr"));
        // The rotation is a fraction of a turn.
        let (anisotropy, rotation) = (number("aniso"), number("anisor") * std::f32::consts::TAU);
        let through =
            self.values.color("Tf").map_or(1.0, |color| Spectrum::from(color).luminance());
        // The exponent gives the α of Beckmann, whose square root is the roughness.
        let roughness = if self.values.has("Pr") || self.values.has("map_Pr") {
            1.0
        } else {
            self.exponent().map_or(DEFAULT_ROUGHNESS, |n| legacy_specular::alpha(n).sqrt())
        };
        MetallicRoughness {
            base_color: self.painted("Kd", "map_Kd", DEFAULT_DIFFUSE),
            roughness: self.measured("Pr", "map_Pr", roughness),
            metallic: self.measured("Pm", "map_Pm", 0.0),
            transmission: if is_glass { through } else { 0.0 }.into(),
            ior: self.ior().max(1.0),
            sheen_color: [sheen; 3].into(),
            sheen_roughness: SHEEN_ROUGHNESS.into(),
            anisotropy: anisotropy.into(),
            anisotropy_rotation: rotation,
            clearcoat: coat.into(),
            clearcoat_roughness: coat_roughness.into(),
            two_sided: !is_glass,
            ..MetallicRoughness::default()
        }
    }

    /// Returns a colour times an image, if there is one. Beside an image, black is ignored with a
    /// warning, since the image would be invisible; except for `Ks`, where black removes the glossy
    /// part.
    fn painted(&mut self, word: &str, map: &str, default: f32) -> Color {
        let color = self.values.color(word);
        let Some(image) = self.values.map(map).cloned() else {
            return color.unwrap_or([default; 3]).into();
        };
        let texture = self.texture(&image, MapUsage::Colors);
        match color {
            Some(color) if color == [0.0; 3] && word == "Ks" => color.into(),
            Some(color) if color == [0.0; 3] => {
                let message = format!("{} is black beside an image; 1 1 1 is used", quote(word));
                self.note(word, message);
                Input::Texture(texture)
            }
            Some(color) if color != [1.0; 3] => product(texture, color),
            _ => Input::Texture(texture),
        }
    }

    /// Returns a number times an image, if there is one; 0 is ignored beside an image.
    fn measured(&mut self, word: &str, map: &str, default: f32) -> Scalar {
        let number = self.values.number(word);
        match self.values.map(map).cloned() {
            None => number.unwrap_or(default).into(),
            Some(image) => {
                let texture = self.texture(&image, MapUsage::Number);
                scaled(texture, number.filter(|number| *number > 0.0).unwrap_or(1.0))
            }
        }
    }

    /// Returns the surface with its relief, if there is one: normals have precedence over heights.
    fn embossed(&mut self, surface: Surface) -> Surface {
        let words = ["norm", "map_bump", "bump"];
        let Some(word) = words.into_iter().find(|word| self.values.map(word).is_some()) else {
            return surface;
        };
        let Some(map) = self.values.map(word).cloned() else { return surface };
        let texture = self.texture(&map, MapUsage::Relief);
        let has_normals = word == "norm" || self.shows_normals(word, &texture);
        if has_normals && map.height != 1.0 {
            self.note(word, "\"-bm\" is ignored: normal maps are not scaled".to_owned());
        }
        let relief = if has_normals {
            NormalOrBump::Normals(texture)
        } else {
            NormalOrBump::Heights(texture, map.height)
        };
        SurfaceDetail::new(surface, relief).into()
    }

    /// Returns true if an image of heights contains normals, as some tools write it.
    fn shows_normals(&mut self, word: &str, texture: &Texture) -> bool {
        let is_found = match &texture.pattern {
            Pattern::Bitmap(bitmap) => has_normals(&bitmap.image),
            _ => false,
        };
        if is_found {
            let message = "found a normal map, expected heights; it is read as \"norm\"".to_owned();
            self.note(word, message);
        }
        is_found
    }
}

/// Returns true if nearly all colours c of an image are normals that point outwards, and not greys:
/// 2 c − 1 has length 1.
fn has_normals(image: &Image) -> bool {
    let is_normal = |[r, g, b]: &&[f32; 3]| {
        let [x, y, z] = [r, g, b].map(|c| 2.0 * c - 1.0);
        let length = (x * x + y * y + z * z).sqrt();
        z > 0.0 && (length - 1.0).abs() < 0.1 && !(r == g && g == b)
    };
    let normals = image.pixels.iter().filter(is_normal).count();
    20 * normals >= 19 * image.pixels.len()
}

fn product(texture: Arc<Texture>, factor: [f32; 3]) -> Color {
    let factors = [Input::Texture(texture), factor.into()];
    Input::Texture(Arc::new(Pattern::Product(Box::new(factors)).into()))
}

fn scaled(texture: Arc<Texture>, factor: f32) -> Scalar {
    if factor == 1.0 {
        return Input::Texture(texture);
    }
    match product(texture, [factor; 3]) {
        Input::Texture(texture) => Input::Texture(texture),
        Input::Value([value, ..]) => Input::Value(value),
    }
}
