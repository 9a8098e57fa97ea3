//! `Texture`: numbers and colours that vary over a surface.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_math::color::linear_from_srgb;
use pt_math::{DAffine3, DMat3, DVec3, trig};

use super::super::context::Folder;
use super::super::placeholder;
use super::super::xml::{did_you_mean, quote};
use super::color::{Role, color};
use super::entity::Entity;
use super::mapping;
use super::token::TokenPosition;
use crate::LoadError;
use crate::image::{Decoded, Image, PixelEncoding};
use crate::texture::{
    Bitmap, Blend, Color, Filter, Input, Pattern, Scalar, Texture, TextureMapping, Wrap,
};

/// Those of colours.
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
/// Those of numbers.
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

/// Most values and patterns that a texture is made of; products of products double with each line.
const MAX_PARTS: usize = 64;

/// Which image, and how its numbers are read.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
struct ImageKey {
    path: PathBuf,
    encoding: String,
    /// True if it gives one number: the mean of its colours, or its opacity if it has that.
    is_number: bool,
    inverts: bool,
    scale_bits: u32,
}

/// The textures of a scene, by name.
pub(super) struct Textures {
    pub(super) folder: Folder,
    colors: HashMap<String, Color>,
    /// One number is three that are equal.
    numbers: HashMap<String, Color>,
    images: HashMap<ImageKey, Arc<Image>>,
    /// Names of those that cannot be read, which was told.
    lost: HashSet<String>,
    /// Names of those, and whether they are numbers, that show an image that is missing.
    loud: HashSet<(String, bool)>,
}

impl Textures {
    pub(super) fn new(folder: Folder) -> Self {
        Self {
            folder,
            colors: HashMap::new(),
            numbers: HashMap::new(),
            images: HashMap::new(),
            lost: HashSet::new(),
            loud: HashSet::new(),
        }
    }

    /// Gives a texture a name, and tells whether it lies in space. `to_world` goes from the
    /// coordinates that hold where it stands.
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
            let message = format!("this is made of more than {MAX_PARTS} textures");
            return Err(entity.at.error(message));
        }
        if self.folder.context.take_placeholder_used() {
            self.loud.insert((name.to_owned(), is_number));
        }
        let is_in_space = texture.texture().is_some_and(|texture| texture.is_in_space());
        let table = if is_number { &mut self.numbers } else { &mut self.colors };
        if table.insert(name.to_owned(), texture).is_some() {
            return Err(entity
                .at
                .error(format!("there is already a texture {} of this type", quote(name))));
        }
        Ok(is_in_space)
    }

    /// Remembers that a texture of a name cannot be read, which was told.
    pub(super) fn lose(&mut self, name: String) {
        self.lost.insert(name);
    }

    /// Notes an image that is missing, and tells what shows it.
    pub(super) fn miss(&self, at: &TokenPosition, why: &str) {
        self.folder.context.missing(at.span(""), format!("{why}; {}", placeholder::INSTEAD));
        self.folder.context.set_placeholder_used();
    }

    /// The texture of a name.
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
        table.get(name).cloned().ok_or_else(|| {
            if self.lost.contains(name) {
                return LoadError::AlreadyReported;
            }
            let hint = did_you_mean(name, table.keys().map(String::as_str));
            entity.refuse(
                parameter,
                format!("there is no {what} texture {} above{hint}", quote(name)),
            )
        })
    }

    /// A number or colour, or a texture.
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
        let value = color(entity, name, Role::Unbounded, &self.folder)?;
        Ok(Input::Value(value.unwrap_or([default; 3])))
    }

    /// A colour of any size, if it is given.
    pub(super) fn unbounded(
        &self,
        entity: &Entity,
        name: &'static str,
    ) -> Result<Option<Color>, LoadError> {
        entity.find(name).map(|_| self.input(entity, name, false, 0.0)).transpose()
    }

    /// A share of light.
    pub(super) fn share(
        &self,
        entity: &Entity,
        name: &'static str,
        default: f32,
    ) -> Result<Color, LoadError> {
        if let Some(texture) = entity.texture_name(name)? {
            return self.named(entity, name, texture, false);
        }
        let value = color(entity, name, Role::Share, &self.folder)?;
        Ok(Input::Value(value.unwrap_or([default; 3])))
    }

    /// A colour that has to be the same everywhere, and whether it is the mean of a texture that is
    /// given instead.
    pub(super) fn mean_of(
        &self,
        entity: &Entity,
        name: &'static str,
        role: Role,
    ) -> Result<(Option<[f32; 3]>, bool), LoadError> {
        match entity.texture_name(name)? {
            Some(texture) => {
                let texture = self.named(entity, name, texture, false)?;
                Ok((Some(texture.mean()), texture.texture().is_some()))
            }
            None => Ok((color(entity, name, role, &self.folder)?, false)),
        }
    }

    /// One number from `range`, if it is given.
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
        let message = format!("{} is {x}; expected a number from {least} to {most}", quote(name));
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

    /// The first of two where the surface looks along a line, the second where it looks across it.
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
            return Err(
                entity.refuse("dir", "expected a direction, but the transform of it has no length")
            );
        };
        let facing = Pattern::AbsNormalDot(direction.as_vec3().to_array());
        Ok(between(across, along, Input::Texture(Arc::new(facing.into()))))
    }

    /// Squares or cubes of side 1 here and ½ in [`Pattern::Checkerboard`] and
    /// [`Pattern::Checkerboard3d`].
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
            let cubes = |colors| Texture { layout, ..Pattern::Checkerboard3d(colors).into() };
            return Ok(one_or_other(inputs, cubes));
        }
        let (layout, to_pattern) = mapping::read(entity, to_world)?;
        let to_pattern = DMat3::from_diagonal(DVec3::new(0.5, 0.5, 1.0)) * to_pattern;
        let squares =
            |colors| Texture { pattern: Pattern::Checkerboard(colors), layout, to_pattern };
        Ok(one_or_other(inputs, squares))
    }

    /// What is called `inside` is seen outside of the dots, as in pbrt-v4, whose code exchanges the
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
        let dots = |colors| Texture { pattern: Pattern::Dots(colors), layout, to_pattern };
        Ok(one_or_other([dot, around], dots))
    }

    /// An image of two by two texels, the middles of which are the corners of the unit square.
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
                    return Err(entity.refuse(name, "expected a value, but this is a texture"));
                }
            }
        }
        let image = Arc::new(Image { width: 2, height: 2, pixels: corners });
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
                let message = format!(
                    "the wrap {} is not supported; supported: repeat, black, clamp",
                    quote(other)
                );
                return Err(entity.refuse("wrap", message));
            }
        };
        let filter = match entity.text("filter")? {
            None | Some("bilinear") => Filter::Bilinear,
            Some("point") => Filter::Nearest,
            Some("trilinear" | "ewa" | "EWA") => Filter::Trilinear,
            Some(other) => {
                let message = format!(
                    "the filter {} is unknown; there are point, bilinear, trilinear, ewa",
                    quote(other)
                );
                return Err(entity.refuse("filter", message));
            }
        };
        let Some(name) = entity.text("filename")? else {
            return Err(entity.at.error("the parameter \"string filename\" is missing"));
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

    /// The image of a file, read once for all that read it alike.
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

    /// A picture whose numbers are not colours: a normal map.
    pub(super) fn raw(&mut self, name: &str) -> Result<Arc<Texture>, String> {
        let path = self.folder.join(name);
        let image = self.folder.context.pixels(&path, PixelEncoding::Stored)?.image;
        let bitmap =
            Bitmap { image: Arc::new(image), wrap: Wrap::REPEAT, filter: Filter::Bilinear };
        Ok(Arc::new(Pattern::Bitmap(bitmap).into()))
    }
}

/// The pictures with levels whose names stand in a file: they are those of textures, as lights and
/// the film have others.
pub(super) fn pictures(text: &str, folder: &Folder) -> Vec<(PathBuf, PixelEncoding)> {
    let names = text.split('"').filter(|text| has_levels(Path::new(text)));
    names.map(|name| (folder.join(name), PixelEncoding::Stored)).collect()
}

/// Returns true if the numbers of a picture are levels, which are light by an encoding.
fn has_levels(path: &Path) -> bool {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
    ["png", "jpg", "jpeg"].iter().any(|known| ending.eq_ignore_ascii_case(known))
}

/// From the numbers of a file to light.
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
            "the encoding {} is unknown; there are sRGB, linear, and gamma with a number",
            quote(other)
        )),
    }
}

fn textured(pattern: Pattern, layout: TextureMapping, to_pattern: DMat3) -> Color {
    Input::Texture(Arc::new(Texture { pattern, layout, to_pattern }))
}

/// What a pattern of two colours makes of two values; of textures, it tells where the second one
/// is.
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

/// Two colours, of which one may be a texture, multiplied.
pub(super) fn product(factors: [Color; 2]) -> Color {
    match factors {
        [Input::Value(a), Input::Value(b)] => Input::Value(std::array::from_fn(|c| a[c] * b[c])),
        [one, other] | [other, one] if other == Input::Value([1.0; 3]) => one,
        factors => Input::Texture(Arc::new(Pattern::Product(Box::new(factors)).into())),
    }
}

/// What is between two colours, by the share of the second.
fn between(first: Color, second: Color, share: Scalar) -> Color {
    Input::Texture(Arc::new(
        Pattern::Blend(Box::new(Blend { first, second, amount: share })).into(),
    ))
}

/// A colour of which all channels are equal, as a number.
fn number_of(color: Color) -> Scalar {
    match color {
        Input::Value([x, ..]) => Input::Value(x),
        Input::Texture(texture) => Input::Texture(texture),
    }
}

/// Returns the number of values and patterns a colour is made of.
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

/// The square root of a number that may vary.
pub(super) fn square_root(number: &Scalar) -> Scalar {
    match number {
        Input::Value(x) => Input::Value(x.max(0.0).sqrt()),
        Input::Texture(texture) => Input::Texture(Arc::new(root_of(texture))),
    }
}

/// The root of a product is that of its factors, as all channels of a number are equal; that of
/// what is between two is between theirs, which is right where there is one of the two.
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
        Pattern::Checkerboard3d(colors) => Pattern::Checkerboard3d(colors.map(root)),
        Pattern::Dots(colors) => Pattern::Dots(colors.map(root)),
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
