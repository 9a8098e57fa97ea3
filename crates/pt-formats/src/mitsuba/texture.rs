//! `<texture>`: values that vary over a surface.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

use pt_image::PixelEncoding;
use pt_math::{DAffine3, DMat3, DVec3};
use pt_scene::image::Image;
use pt_scene::medium::PlacedGrid;
use pt_scene::texture::{Bitmap, Color, Filter, Pattern, Texture, TextureMapping, Wrap};

use super::super::ply::attributes::RequestedAttributes;
use super::object::{ColorRole, MitsubaObject, ObjectTree, Parameters, unsupported};
use super::value::ParameterValue;
use super::volume::{Grids, VolumeField};
use crate::LoadError;
use crate::shared::names::quote;
use crate::shared::placeholder;

const KINDS: [&str; 5] = ["bitmap", "checkerboard", "mesh_attribute", "rawconstant", "volume"];

/// Returns a texture as Mitsuba 3.9.1 reads it for a scalar parameter: its `checkerboard` then
/// exchanges `color0` and `color1`.
pub(super) fn as_number(texture: Arc<Texture>) -> Arc<Texture> {
    let Pattern::Checkerboard([first, second]) = texture.pattern else { return texture };
    Arc::new(Texture { pattern: Pattern::Checkerboard([second, first]), ..(*texture).clone() })
}

/// Reads the number or vector of a `rawconstant`.
fn raw_value(
    object: &MitsubaObject,
    parameters: &mut Parameters<'_>,
) -> Result<[f32; 3], LoadError> {
    let is_vector =
        parameters.find("value").is_some_and(|p| matches!(p.value, ParameterValue::Vector(_)));
    let value = if is_vector {
        parameters.vector("value")?.map(|v| v.to_array())
    } else {
        parameters.float("value")?.map(|x| [x; 3])
    };
    let Some(value) = value else {
        let message = "missing <float name=\"value\"> or <vector name=\"value\">";
        return Err(super::object::error(&object.at, message));
    };
    if value.iter().any(|x| !(0.0..=f64::from(f32::MAX)).contains(x)) {
        return Err(parameters.refuse("value", "expected numbers of at least 0"));
    }
    Ok(value.map(|x| x as f32))
}

/// Cache of the textures of a scene and their images.
pub(super) struct MitsubaTextureCache<'t> {
    pub(super) tree: &'t ObjectTree,
    /// Textures by object index; `None` if the image is missing.
    made: HashMap<usize, Option<Arc<Texture>>>,
    /// Images by file, and true if their values are used without conversion.
    images: HashMap<(PathBuf, bool), Arc<Image>>,
    grids: Grids,
}

impl<'t> MitsubaTextureCache<'t> {
    pub(super) fn new(tree: &'t ObjectTree) -> Self {
        let (made, images) = (HashMap::new(), HashMap::new());
        Self { tree, made, images, grids: Grids::default() }
    }

    /// Returns the texture of an object.
    pub(super) fn get(&mut self, index: usize) -> Result<Arc<Texture>, LoadError> {
        if let Some(known) = self.made.get(&index) {
            return Ok(self.or_substitute(known.clone()));
        }
        let object = &self.tree.objects[index];
        let inside: &[&str] = if object.kind == "volume" { &["volume"] } else { &[] };
        let children = self.tree.children(object, inside)?;
        let mut parameters = Parameters::new(object);
        let texture = match object.kind.as_str() {
            "volume" => Some(self.volume(object, &children)?),
            "bitmap" => self.bitmap(object, &mut parameters)?,
            "mesh_attribute" => Some(mesh_attribute(object, &mut parameters)?),
            "checkerboard" => {
                let to_uv = coordinates(parameters.transform("to_uv")?);
                let first = parameters.color("color0", ColorRole::Level, 0.4)?;
                let second = parameters.color("color1", ColorRole::Level, 0.2)?;
                self.note_levels_above_1(object, first.into_iter().chain(second));
                let pattern = Pattern::Checkerboard([first, second]);
                Some(Texture::on_surface(pattern, to_uv))
            }
            "rawconstant" => {
                let value = raw_value(object, &mut parameters)?;
                self.note_levels_above_1(object, value.into_iter());
                Some(Pattern::Checkerboard([value; 2]).into())
            }
            _ => return Err(unsupported(object, &KINDS)),
        };
        parameters.finish()?;
        let texture = texture.map(Arc::new);
        self.made.insert(index, texture.clone());
        Ok(self.or_substitute(texture))
    }

    /// Reads a volume as a texture. Outside of its box, a grid is extended from its boundary.
    fn volume(&mut self, object: &MitsubaObject, children: &[usize]) -> Result<Texture, LoadError> {
        let [volume] = children else {
            let message =
                format!("expected one <volume name=\"volume\">, found {}", children.len());
            return Err(super::object::error(&object.at, message));
        };
        let field = self.grids.volume(self.tree, &self.tree.objects[*volume], ColorRole::Level)?;
        Ok(match field {
            VolumeField::Constant(color, _) => {
                self.note_levels_above_1(object, color.into_iter());
                Pattern::Checkerboard([color; 2]).into()
            }
            VolumeField::Grid(PlacedGrid { grid, to_world, filter }) => {
                self.note_levels_above_1(object, grid.values.iter().copied());
                Texture {
                    pattern: Pattern::Grid { grid, filter },
                    layout: TextureMapping::Space { to_texture: to_world.inverse() },
                    to_pattern: DMat3::IDENTITY,
                }
            }
        })
    }

    fn note_levels_above_1(&self, object: &MitsubaObject, mut levels: impl Iterator<Item = f32>) {
        if levels.any(|level| level > 1.0) {
            let message =
                "values above 1 are clamped to 1 where the texture is a reflectance or a weight";
            self.tree.context.note(object.at.clone(), message.to_owned());
        }
    }

    /// Returns the texture, or a placeholder, whose use is noted in the context for the material.
    fn or_substitute(&self, texture: Option<Arc<Texture>>) -> Arc<Texture> {
        texture.unwrap_or_else(|| {
            self.tree.context.set_placeholder_used();
            placeholder::texture()
        })
    }

    /// Returns the texture of the only parameter of an object that may have one.
    pub(super) fn of(
        &mut self,
        object: &MitsubaObject,
        name: &str,
    ) -> Result<Option<Arc<Texture>>, LoadError> {
        let mut found = None;
        for (child, index) in object.children.iter().zip(self.tree.children(object, &["texture"])?)
        {
            if child.name != name || found.is_some() {
                let message = format!(
                    "unsupported <texture> inside of {}; expected at most one, for {name}",
                    object.describe()
                );
                return Err(super::object::error(&child.at, message));
            }
            found = Some(self.get(index)?);
        }
        Ok(found)
    }

    /// Reads an image texture; `None` if the image is missing, which is reported.
    fn bitmap(
        &mut self,
        object: &MitsubaObject,
        parameters: &mut Parameters<'_>,
    ) -> Result<Option<Texture>, LoadError> {
        let to_uv = coordinates(parameters.transform("to_uv")?);
        parameters.pass_over(&["format", "accel"]);
        let Some(text) = parameters.text("filename")? else {
            let message = "missing <string name=\"filename\">";
            return Err(super::object::error(&object.at, message));
        };
        let is_raw = parameters.boolean("raw")?;
        let wrap = match parameters.text("wrap_mode")? {
            None | Some("repeat") => Wrap::REPEAT,
            Some("mirror") => Wrap::MIRROR,
            Some("clamp") => Wrap::CLAMP,
            Some(other) => {
                let message = format!("found {}, expected repeat, mirror or clamp", quote(other));
                return Err(parameters.refuse("wrap_mode", message));
            }
        };
        let filter = match parameters.text("filter_type")? {
            None | Some("bilinear") => Filter::Bilinear,
            Some("nearest") => Filter::Nearest,
            Some(other) => {
                let message = format!("found {}, expected bilinear or nearest", quote(other));
                return Err(parameters.refuse("filter_type", message));
            }
        };
        let path = self.tree.resolve(text).ok_or_else(|| self.tree.not_found(text));
        let image = match path.and_then(|path| self.image(path, is_raw)) {
            Ok(image) => image,
            Err(why) => {
                self.tree.miss(parameters.place("filename"), &why, placeholder::INSTEAD)?;
                return Ok(None);
            }
        };
        let pattern = Pattern::Bitmap(Bitmap { image, wrap, filter });
        Ok(Some(Texture::on_surface(pattern, UPSIDE_DOWN * to_uv)))
    }

    /// Returns the image of a file, which is read once.
    fn image(&mut self, path: PathBuf, is_raw: bool) -> Result<Arc<Image>, String> {
        if let Some(known) = self.images.get(&(path.clone(), is_raw)) {
            return Ok(Arc::clone(known));
        }
        let image = self.tree.context.pixels(&path, PixelEncoding::of_raw(is_raw))?.image;
        let image = Arc::new(image);
        self.images.insert((path, is_raw), Arc::clone(&image));
        Ok(image)
    }
}

/// Returns the image files of the textures and environment maps of a scene.
pub(super) fn pictures(tree: &ObjectTree) -> impl Iterator<Item = (PathBuf, PixelEncoding)> {
    tree.objects.iter().filter_map(|object| {
        if !matches!(object.kind.as_str(), "bitmap" | "envmap") {
            return None;
        }
        let value = |name| object.parameters.iter().find(|p| p.name == name).map(|p| &p.value);
        let Some(ParameterValue::Text(file)) = value("filename") else { return None };
        let is_raw = matches!(value("raw"), Some(ParameterValue::Boolean(true)));
        Some((tree.resolve(file)?, PixelEncoding::of_raw(is_raw)))
    })
}

/// Prefixes of the names of vertex and face attributes.
const OF_VERTICES: &str = "vertex_";
const OF_FACES: &str = "face_";

/// Name of the attributes that meshes have as colours.
pub(super) const COLOR: &str = "color";

/// Returns the mesh attributes that textures use.
pub(super) fn attributes(tree: &ObjectTree) -> RequestedAttributes {
    let mut wanted = RequestedAttributes::default();
    for object in tree.objects.iter().filter(|object| object.kind == "mesh_attribute") {
        let name = object.parameters.iter().find(|p| p.name == "name").map(|p| &p.value);
        let Some(ParameterValue::Text(name)) = name else { continue };
        match (name.strip_prefix(OF_VERTICES), name.strip_prefix(OF_FACES)) {
            (Some(name), _) => drop(wanted.vertices.insert(name.to_owned())),
            (_, Some(name)) => drop(wanted.faces.insert(name.to_owned())),
            _ => {}
        }
    }
    wanted
}

/// Reads a texture of a mesh attribute times a number.
fn mesh_attribute(
    object: &MitsubaObject,
    parameters: &mut Parameters<'_>,
) -> Result<Texture, LoadError> {
    let name = parameters.text("name")?.unwrap_or_default();
    let pattern = match (name.strip_prefix(OF_VERTICES), name.strip_prefix(OF_FACES)) {
        (Some(COLOR), _) => Pattern::VertexColors,
        (_, Some(COLOR)) => Pattern::FaceColors,
        (Some(name), _) if !name.is_empty() => Pattern::VertexAttribute(name.to_owned()),
        (_, Some(name)) if !name.is_empty() => Pattern::FaceAttribute(name.to_owned()),
        _ if name.is_empty() => {
            let message =
                "missing <string name=\"name\">; expected one such as vertex_color or face_color";
            return Err(super::object::error(&object.at, message));
        }
        _ => {
            let message = format!(
                "found attribute {}, expected a name that begins with vertex_ or face_",
                quote(name)
            );
            return Err(parameters.refuse("name", message));
        }
    };
    let scale = parameters.float("scale")?.unwrap_or(1.0);
    if scale < 0.0 {
        let message = format!("found \"scale\" = {scale}, expected a number of at least 0");
        return Err(parameters.refuse("scale", message));
    }
    if scale == 1.0 {
        return Ok(pattern.into());
    }
    let factors = [Color::Texture(Arc::new(pattern.into())), [scale as f32; 3].into()];
    Ok(Pattern::Product(Box::new(factors)).into())
}

/// v ↦ 1 − v: in Mitsuba, v increases downwards in an image.
const UPSIDE_DOWN: DMat3 =
    DMat3::from_cols(DVec3::X, DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.0, 1.0, 1.0));

/// Returns the part of a transform that acts on (u, v, 1).
fn coordinates(transform: DAffine3) -> DMat3 {
    let DAffine3 { matrix3, translation } = transform;
    let flat = |c: DVec3, z: f64| DVec3::new(c.x, c.y, z);
    DMat3::from_cols(flat(matrix3.x_axis, 0.0), flat(matrix3.y_axis, 0.0), flat(translation, 1.0))
}
