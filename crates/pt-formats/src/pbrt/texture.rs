//! `Texture`: numbers and colours that vary over a surface.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_image::{Decoded, PixelEncoding};
use pt_math::color::linear_from_srgb;
use pt_math::{DAffine3, DMat3, DVec3, trig};
use pt_scene::image::Image;
use pt_scene::texture::{
    Bitmap, Blend, Color, Filter, Input, Pattern, Procedural, Scalar, Texture, TextureMapping, Wrap,
};

use super::color::{SpectrumType, color};
use super::entity::Entity;
use super::mapping;
use super::position::TokenPosition;
use crate::LoadError;
use crate::shared::context::Folder;
use crate::shared::names::quote;
use crate::shared::placeholder;
use crate::shared::registry::Registry;

/// Types of colour textures.
const COLORS: [&str; 9] = [
    "bilerp",
    "checkerboard",
    "constant",
    "directionmix",
    "dots",
    "imagemap",
    "marble",
    "mix",
    "scale",
];
/// Types of number textures.
const NUMBERS: [&str; 11] = [
    "bilerp",
    "checkerboard",
    "constant",
    "directionmix",
    "dots",
    "fbm",
    "imagemap",
    "mix",
    "scale",
    "windy",
    "wrinkled",
];

/// Maximum number of values and patterns in a texture; products of products double with each line.
const MAX_PARTS: usize = 64;

/// Key of an image: the file, and the options with which it is read.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct ImageKey {
    path: PathBuf,
    encoding: String,
    /// True for a number texture: the mean of the colours, or alpha if the image has it.
    is_number: bool,
    inverts: bool,
    scale_bits: u32,
}

/// Textures of a scene, by name.
pub(super) struct PbrtTextures {
    pub(super) folder: Folder,
    colors: Registry<Color>,
    /// Number textures, with three equal channels.
    numbers: Registry<Color>,
    images: HashMap<ImageKey, Arc<Image>>,
    /// Textures with a missing image, by name, and true for number textures.
    loud: HashSet<(String, bool)>,
}

impl PbrtTextures {
    pub(super) fn new(folder: Folder) -> Self {
        Self {
            folder,
            colors: Registry::default(),
            numbers: Registry::default(),
            images: HashMap::new(),
            loud: HashSet::new(),
        }
    }

    /// Defines a texture. Returns true if it is in space. `to_world` is the transform from the
    /// coordinates in which it is defined.
    pub(super) fn define(
        &mut self,
        name: &str,
        is_number: bool,
        entity: &Entity,
        to_world: DAffine3,
    ) -> Result<bool, LoadError> {
        self.folder.context.take_placeholder_used();
        let kinds = if is_number { &NUMBERS[..] } else { &COLORS };
        let kind = entity.kind.as_str();
        let texture = match kind {
            _ if !kinds.contains(&kind) => return Err(entity.unsupported(kinds)),
            "constant" => self.input(entity, "value", is_number, 1.0)?,
            "scale" => {
                let factors = [
                    self.input(entity, "tex", is_number, 1.0)?,
                    self.input(entity, "scale", true, 1.0)?,
                ];
                product(factors)
            }
            "mix" => self.mix(entity, is_number)?,
            "directionmix" => self.mix_by_direction(entity, is_number, to_world)?,
            "checkerboard" => self.checkerboard(entity, is_number, to_world)?,
            "dots" => self.dots(entity, is_number, to_world)?,
            "bilerp" => self.bilerp(entity, is_number, to_world)?,
            "imagemap" => self.imagemap(entity, is_number, to_world)?,
            _ => Input::Texture(Arc::new(mapping::of_noise(entity, to_world)?)),
        };
        entity.finish()?;
        if leaves(&texture) > MAX_PARTS {
            let message = format!("texture of more than {MAX_PARTS} parts");
            return Err(entity.at.error(message));
        }
        if self.folder.context.take_placeholder_used() {
            self.loud.insert((name.to_owned(), is_number));
        }
        let is_in_space = texture.texture().is_some_and(|texture| texture.is_in_space());
        let table = if is_number { &mut self.numbers } else { &mut self.colors };
        if !table.define(name.to_owned(), texture) {
            return Err(entity.at.error(format!("duplicate texture {} of this type", quote(name))));
        }
        Ok(is_in_space)
    }

    /// Records that a texture has an error, which was reported.
    pub(super) fn fail(&mut self, name: String) {
        self.colors.fail(name.clone());
        self.numbers.fail(name);
    }

    /// Reports a missing image, and notes in the context that a placeholder is used.
    pub(super) fn miss(&self, at: &TokenPosition, why: &str) {
        self.folder.context.missing(at.span(""), format!("{why}; {}", placeholder::INSTEAD));
        self.folder.context.set_placeholder_used();
    }

    /// Returns the texture with a name.
    fn named(
        &self,
        entity: &Entity,
        parameter: &str,
        name: &str,
        is_number: bool,
    ) -> Result<Color, LoadError> {
        let (table, what) =
            if is_number { (&self.numbers, "float") } else { (&self.colors, "spectrum") };
        if self.loud.contains(&(name.to_owned(), is_number)) {
            self.folder.context.set_placeholder_used();
        }
        let undefined = |hint: &str| {
            let message = format!(
                "undefined {what} texture {}; expected the name of a texture above{hint}",
                quote(name)
            );
            entity.refuse(parameter, message)
        };
        table.get(name, undefined).cloned()
    }

    /// Reads a number or colour, or a texture.
    fn input(
        &self,
        entity: &Entity,
        name: &'static str,
        is_number: bool,
        default: f32,
    ) -> Result<Color, LoadError> {
        if let Some(texture) = entity.texture_name(name)? {
            return self.named(entity, name, texture, is_number);
        }
        if is_number {
            return Ok(Input::Value([entity.float(name, f64::from(default))? as f32; 3]));
        }
        let value = color(entity, name, SpectrumType::Unbounded, &self.folder)?;
        Ok(Input::Value(value.unwrap_or([default; 3])))
    }

    /// Reads a colour without an upper limit, if it is specified.
    pub(super) fn unbounded(
        &self,
        entity: &Entity,
        name: &'static str,
    ) -> Result<Option<Color>, LoadError> {
        entity.find(name).map(|_| self.input(entity, name, false, 0.0)).transpose()
    }

    /// Reads a reflectance or transmittance.
    pub(super) fn share(
        &self,
        entity: &Entity,
        name: &'static str,
        default: f32,
    ) -> Result<Color, LoadError> {
        if let Some(texture) = entity.texture_name(name)? {
            return self.named(entity, name, texture, false);
        }
        let value = color(entity, name, SpectrumType::Share, &self.folder)?;
        Ok(Input::Value(value.unwrap_or([default; 3])))
    }

    /// Reads a colour that must be constant. Returns true with it if it is the mean of a texture.
    pub(super) fn mean_of(
        &self,
        entity: &Entity,
        name: &'static str,
        role: SpectrumType,
    ) -> Result<(Option<[f32; 3]>, bool), LoadError> {
        match entity.texture_name(name)? {
            Some(texture) => {
                let texture = self.named(entity, name, texture, false)?;
                Ok((Some(texture.mean()), texture.texture().is_some()))
            }
            None => Ok((color(entity, name, role, &self.folder)?, false)),
        }
    }

    /// Reads a number in a range, if it is specified.
    pub(super) fn number(
        &self,
        entity: &Entity,
        name: &'static str,
        [least, most]: [f32; 2],
    ) -> Result<Option<Scalar>, LoadError> {
        if let Some(texture) = entity.texture_name(name)? {
            return Ok(Some(match self.named(entity, name, texture, true)? {
                Input::Value([x, ..]) => Input::Value(x.clamp(least, most)),
                Input::Texture(texture) => Input::Texture(texture),
            }));
        }
        let Some(x) = entity.given_float(name)? else { return Ok(None) };
        if (f64::from(least)..=f64::from(most)).contains(&x) {
            return Ok(Some(Input::Value(x as f32)));
        }
        let message =
            format!("found {} = {x}, expected a number from {least} to {most}", quote(name));
        Err(entity.refuse(name, message))
    }

    fn mix(&self, entity: &Entity, is_number: bool) -> Result<Color, LoadError> {
        let [first, second] = [
            self.input(entity, "tex1", is_number, 0.0)?,
            self.input(entity, "tex2", is_number, 1.0)?,
        ];
        let amount = self.input(entity, "amount", true, 0.5)?;
        match (first, second, amount) {
            (Input::Value(a), Input::Value(b), Input::Value([t, ..])) => {
                Ok(Input::Value(std::array::from_fn(|c| a[c] * (1.0 - t) + b[c] * t)))
            }
            (first, second, amount) => Ok(between(first, second, number_of(amount))),
        }
    }

    /// Reads a mixture: the first texture where the normal is along a direction, the second one
    /// where it is perpendicular.
    fn mix_by_direction(
        &self,
        entity: &Entity,
        is_number: bool,
        to_world: DAffine3,
    ) -> Result<Color, LoadError> {
        let [along, across] = [
            self.input(entity, "tex1", is_number, 0.0)?,
            self.input(entity, "tex2", is_number, 1.0)?,
        ];
        let direction = entity.vector("dir")?.unwrap_or(DVec3::Y);
        let Some(direction) = to_world.transform_vector3(direction).try_normalize() else {
            return Err(entity.refuse(
                "dir",
                "found a direction that the transform maps to zero, expected a direction",
            ));
        };
        let facing = Pattern::AbsNormalDot(direction.as_vec3().to_array());
        Ok(between(across, along, Input::Texture(Arc::new(facing.into()))))
    }

    /// Reads a checkerboard. Its squares or cubes have side 1 in pbrt-v4, and ½ in
    /// [`Pattern::Checkerboard`] and [`Procedural::Checkerboard3d`].
    fn checkerboard(
        &self,
        entity: &Entity,
        is_number: bool,
        to_world: DAffine3,
    ) -> Result<Color, LoadError> {
        let fills_space = entity.count("dimension", 2, [2, 3])? == 3;
        let inputs = [
            self.input(entity, "tex1", is_number, 1.0)?,
            self.input(entity, "tex2", is_number, 0.0)?,
        ];
        if fills_space {
            let to_texture = mapping::to_texture(entity, to_world)?;
            let to_texture = DAffine3::from_scale(DVec3::splat(0.5)) * to_texture;
            let layout = TextureMapping::Space { to_texture };
            let cubes = |colors| {
                let pattern = Pattern::Procedural(Procedural::Checkerboard3d(colors));
                Texture { layout, ..pattern.into() }
            };
            return Ok(one_or_other(inputs, cubes));
        }
        let (layout, to_pattern) = mapping::read(entity, to_world)?;
        let to_pattern = DMat3::from_diagonal(DVec3::new(0.5, 0.5, 1.0)) * to_pattern;
        let squares =
            |colors| Texture { pattern: Pattern::Checkerboard(colors), layout, to_pattern };
        Ok(one_or_other(inputs, squares))
    }

    /// Reads dots. `inside` is used outside of the dots, as in pbrt-v4, whose code exchanges the
    /// two.
    fn dots(
        &self,
        entity: &Entity,
        is_number: bool,
        to_world: DAffine3,
    ) -> Result<Color, LoadError> {
        let [around, dot] = [
            self.input(entity, "inside", is_number, 1.0)?,
            self.input(entity, "outside", is_number, 0.0)?,
        ];
        let (layout, to_pattern) = mapping::read(entity, to_world)?;
        let dots = |colors| {
            let pattern = Pattern::Procedural(Procedural::Dots(colors));
            Texture { pattern, layout, to_pattern }
        };
        Ok(one_or_other([dot, around], dots))
    }

    /// Reads a bilinear interpolation, as an image of 2 × 2 texels whose centres are the corners of
    /// the unit square.
    fn bilerp(
        &self,
        entity: &Entity,
        is_number: bool,
        to_world: DAffine3,
    ) -> Result<Color, LoadError> {
        let mut corners = Vec::new();
        for (name, default) in [("v01", 1.0), ("v11", 1.0), ("v00", 0.0), ("v10", 0.0)] {
            match self.input(entity, name, is_number, default)? {
                Input::Value(value) => corners.push(value),
                Input::Texture(_) => {
                    return Err(entity.refuse(name, "found a texture, expected a value"));
                }
            }
        }
        let image = Arc::new(Image { width: 2, height: 2, pixels: corners.into() });
        let to_middles =
            DMat3::from_cols(DVec3::X * 0.5, DVec3::Y * 0.5, DVec3::new(0.25, 0.25, 1.0));
        let bitmap = Bitmap { image, wrap: Wrap::CLAMP, filter: Filter::Bilinear };
        let (layout, to_pattern) = mapping::read(entity, to_world)?;
        Ok(textured(Pattern::Bitmap(bitmap), layout, to_middles * to_pattern))
    }

    fn imagemap(
        &mut self,
        entity: &Entity,
        is_number: bool,
        to_world: DAffine3,
    ) -> Result<Color, LoadError> {
        let (layout, to_pattern) = mapping::read(entity, to_world)?;
        entity.pass_over(&["maxanisotropy"]);
        let wrap = match entity.text("wrap")? {
            None | Some("repeat") => Wrap::REPEAT,
            Some("clamp") => Wrap::CLAMP,
            Some("black") => Wrap::BLACK,
            Some(other) => {
                let message =
                    format!("unsupported wrap {}; supported: repeat, black, clamp", quote(other));
                return Err(entity.refuse("wrap", message));
            }
        };
        let filter = match entity.text("filter")? {
            None | Some("bilinear") => Filter::Bilinear,
            Some("point") => Filter::Nearest,
            Some("trilinear" | "ewa" | "EWA") => Filter::Trilinear,
            Some(other) => {
                let message = format!(
                    "unknown filter {}; expected point, bilinear, trilinear or ewa",
                    quote(other)
                );
                return Err(entity.refuse("filter", message));
            }
        };
        let Some(name) = entity.text("filename")? else {
            return Err(entity.at.error("missing parameter \"string filename\""));
        };
        let key = ImageKey {
            path: self.folder.join(name),
            encoding: entity.text("encoding")?.unwrap_or("sRGB").to_owned(),
            is_number,
            inverts: entity.boolean("invert", false)?,
            scale_bits: (entity.float("scale", 1.0)? as f32).to_bits(),
        };
        let decode = decoder(&key).map_err(|message| entity.refuse("encoding", message))?;
        let image = match self.image(key, &decode) {
            Ok(image) => image,
            Err(why) => {
                self.miss(entity.place("filename"), &why);
                return Ok(Input::Texture(placeholder::texture()));
            }
        };
        Ok(textured(Pattern::Bitmap(Bitmap { image, wrap, filter }), layout, to_pattern))
    }

    /// Returns the image of a file, which is read once per key.
    fn image(&mut self, key: ImageKey, decode: &dyn Fn(f32) -> f32) -> Result<Arc<Image>, String> {
        if let Some(known) = self.images.get(&key) {
            return Ok(Arc::clone(known));
        }
        let Decoded { mut image, alpha, .. } =
            self.folder.context.pixels(&key.path, PixelEncoding::Stored)?;
        let alpha = alpha.filter(|alpha| key.is_number && alpha.iter().any(|a| *a < 1.0));
        let scale = f32::from_bits(key.scale_bits);
        for (i, pixel) in image.pixels.iter_mut().enumerate() {
            let light = match &alpha {
                Some(alpha) => [alpha[i]; 3],
                None => pixel.map(decode),
            };
            let mean = light.iter().sum::<f32>() / 3.0;
            let value = if key.is_number { [mean; 3] } else { light };
            let invert = |x: f32| if key.inverts { (1.0 - x).max(0.0) } else { x };
            *pixel = value.map(|x| invert(x * scale));
        }
        let image = Arc::new(image);
        self.images.insert(key, Arc::clone(&image));
        Ok(image)
    }

    /// Reads an image whose values are not colours: a normal map.
    pub(super) fn raw(&mut self, name: &str) -> Result<Arc<Texture>, String> {
        let path = self.folder.join(name);
        let image = self.folder.context.pixels(&path, PixelEncoding::Stored)?.image;
        let bitmap =
            Bitmap { image: Arc::new(image), wrap: Wrap::REPEAT, filter: Filter::Bilinear };
        Ok(Arc::new(Pattern::Bitmap(bitmap).into()))
    }
}

/// Returns the image files with encoded values that a file names. They belong to textures, since
/// lights and the film use other formats.
pub(super) fn pictures(text: &str, folder: &Folder) -> Vec<(PathBuf, PixelEncoding)> {
    let names = text.split('"').filter(|text| has_levels(Path::new(text)));
    names.map(|name| (folder.join(name), PixelEncoding::Stored)).collect()
}

/// Returns true if an image file has encoded values rather than linear light.
fn has_levels(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["png", "jpg", "jpeg"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// Returns the conversion from stored values to linear light.
fn decoder(key: &ImageKey) -> Result<Box<dyn Fn(f32) -> f32>, String> {
    if !has_levels(&key.path) {
        return Ok(Box::new(|x| x));
    }
    let gamma = key.encoding.strip_prefix("gamma ").map(|text| text.trim().parse::<f32>());
    match (key.encoding.as_str(), gamma) {
        ("sRGB", _) => Ok(Box::new(linear_from_srgb)),
        ("linear", _) => Ok(Box::new(|x| x)),
        (_, Some(Ok(gamma))) if gamma > 0.0 && gamma.is_finite() => {
            Ok(Box::new(move |x| trig::powf(x.max(0.0), gamma)))
        }
        (other, _) => Err(format!(
            "unknown encoding {}; expected sRGB, linear, or gamma with a number",
            quote(other)
        )),
    }
}

fn textured(pattern: Pattern, layout: TextureMapping, to_pattern: DMat3) -> Color {
    Input::Texture(Arc::new(Texture { pattern, layout, to_pattern }))
}

/// Applies a pattern of two colours. If one of them is a texture, the pattern selects between them.
fn one_or_other(inputs: [Color; 2], pattern: impl Fn([[f32; 3]; 2]) -> Texture) -> Color {
    match inputs {
        [Input::Value(first), Input::Value(second)] => {
            Input::Texture(Arc::new(pattern([first, second])))
        }
        [first, second] => {
            between(first, second, Input::Texture(Arc::new(pattern([[0.0; 3], [1.0; 3]]))))
        }
    }
}

/// Multiplies two colours, which may be textures.
pub(super) fn product(factors: [Color; 2]) -> Color {
    match factors {
        [Input::Value(a), Input::Value(b)] => Input::Value(std::array::from_fn(|c| a[c] * b[c])),
        [one, other] | [other, one] if other == Input::Value([1.0; 3]) => one,
        factors => Input::Texture(Arc::new(Pattern::Product(Box::new(factors)).into())),
    }
}

/// Interpolates between two colours; `share` is the weight of the second.
fn between(first: Color, second: Color, share: Scalar) -> Color {
    Input::Texture(Arc::new(
        Pattern::Blend(Box::new(Blend { first, second, amount: share })).into(),
    ))
}

/// Converts a colour with equal channels to a number.
fn number_of(color: Color) -> Scalar {
    match color {
        Input::Value([x, ..]) => Input::Value(x),
        Input::Texture(texture) => Input::Texture(texture),
    }
}

/// Returns the number of values and patterns in a colour.
fn leaves(color: &Color) -> usize {
    fn of<T>(input: &Input<T>) -> usize {
        match input.texture().map(|texture| &texture.pattern) {
            Some(Pattern::Product(factors)) => of(&factors[0]) + of(&factors[1]),
            Some(Pattern::Blend(blend)) => of(&blend.first) + of(&blend.second) + of(&blend.amount),
            Some(Pattern::Sqrt(square)) => of(square),
            _ => 1,
        }
    }
    of(color)
}

/// Returns the square root of a number that may be a texture.
pub(super) fn square_root(number: &Scalar) -> Scalar {
    match number {
        Input::Value(x) => Input::Value(x.max(0.0).sqrt()),
        Input::Texture(texture) => Input::Texture(Arc::new(root_of(texture))),
    }
}

/// Returns the square root of a texture. The root of a product is the product of the roots, as all
/// channels of a number are equal. A blend is approximated by the blend of the roots, which is
/// exact at weights 0 and 1.
fn root_of(texture: &Texture) -> Texture {
    let root = |color: [f32; 3]| color.map(|x| x.max(0.0).sqrt());
    let of = |color: &Color| match color {
        Input::Value(value) => Input::Value(root(*value)),
        Input::Texture(texture) => Input::Texture(Arc::new(root_of(texture))),
    };
    let pattern = match &texture.pattern {
        Pattern::Bitmap(bitmap) => {
            let Image { width, height, pixels } = &*bitmap.image;
            let pixels = pixels.iter().map(|pixel| root(*pixel)).collect();
            let image = Arc::new(Image { width: *width, height: *height, pixels });
            Pattern::Bitmap(Bitmap { image, ..bitmap.clone() })
        }
        Pattern::Checkerboard(colors) => Pattern::Checkerboard(colors.map(root)),
        Pattern::Procedural(pattern) if let Some(roots) = pattern.recolored(root) => {
            Pattern::Procedural(roots)
        }
        Pattern::Product(factors) => Pattern::Product(Box::new([of(&factors[0]), of(&factors[1])])),
        Pattern::Blend(blend) => Pattern::Blend(Box::new(Blend {
            first: of(&blend.first),
            second: of(&blend.second),
            amount: blend.amount.clone(),
        })),
        _ => return Pattern::Sqrt(Input::Texture(Arc::new(texture.clone()))).into(),
    };
    Texture { pattern, ..texture.clone() }
}
