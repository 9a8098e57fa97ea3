//! Directives, one after the other.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;

use flate2::read::GzDecoder;
use pt_math::{DAffine3, DVec3};

use super::super::context::{Context, Folder};
use super::super::mesh_file;
use super::super::transform::{look_at, rotate};
use super::super::xml::{did_you_mean, quote};
use super::arguments::{active, numbers, text};
use super::color_space::ColorSpace;
use super::entity::{Entity, MAX_PARAMETERS, Parameter};
use super::medium::Interface;
use super::scene::{MaterialName, Placed, Sight, World};
use super::state::{Moving, State, TARGETS, matrix};
use super::token::{Kind, Place, Token, Tokens};
use crate::LoadError;

/// Deepest nesting of included files.
const MAX_INCLUDE_DEPTH: usize = 32;
/// Most files that a scene may include; two that include one another twice would make many.
const MAX_FILES: usize = 1000;
/// Deepest nesting of attributes.
const MAX_DEPTH: usize = 10_000;
/// Most bytes that a compressed file may hold.
const MAX_UNPACKED: u64 = 1 << 30;

/// All directives.
const DIRECTIVES: [&str; 40] = [
    "Accelerator",
    "ActiveTransform",
    "AreaLightSource",
    "Attribute",
    "AttributeBegin",
    "AttributeEnd",
    "Camera",
    "ColorSpace",
    "ConcatTransform",
    "CoordSysTransform",
    "CoordinateSystem",
    "Film",
    "Identity",
    "Import",
    "Include",
    "Integrator",
    "LightSource",
    "LookAt",
    "MakeNamedMaterial",
    "MakeNamedMedium",
    "Material",
    "MediumInterface",
    "NamedMaterial",
    "ObjectBegin",
    "ObjectEnd",
    "ObjectInstance",
    "Option",
    "PixelFilter",
    "ReverseOrientation",
    "Rotate",
    "Sampler",
    "Scale",
    "Shape",
    "Texture",
    "Transform",
    "TransformBegin",
    "TransformEnd",
    "TransformTimes",
    "Translate",
    "WorldBegin",
];

/// What `…End` goes back to.
struct Saved {
    /// The directive that began it, and where.
    by: &'static str,
    at: Place,
    state: State,
}

/// Reads directives, and remembers what they change.
struct Reader {
    /// That of the scene's own file, in which all others are looked for.
    folder: Folder,
    files: usize,
    state: State,
    saved: Vec<Saved>,
    /// Transforms that have a name.
    systems: HashMap<String, Moving>,
    in_world: bool,
    /// The shapes of the object that is described, with its name.
    object: Option<(String, Vec<Placed>)>,
    world: World,
}

/// Reads a scene and the files that it includes.
pub(super) fn read(bytes: &[u8], path: &Path, context: &Arc<Context>) -> Result<World, LoadError> {
    let folder = Folder { path: mesh_file::folder_of(path), context: Arc::clone(context) };
    let mut reader = Reader {
        world: World::new(&folder, mesh_file::place(path, 0)),
        folder,
        files: 0,
        state: State::new(),
        saved: Vec::new(),
        systems: HashMap::new(),
        in_world: false,
        object: None,
    };
    reader.file(bytes, path, 0)?;
    if let Some(Saved { by, at, .. }) = reader.saved.last() {
        let end = by.replace("Begin", "End");
        return Err(at.error(format!("{by} has no {end}")));
    }
    Ok(reader.world)
}

/// The content of a file that a scene names; what is compressed (`.gz`) is unpacked.
///
/// # Errors
/// If it cannot be read, for the place where the scene names it.
pub(super) fn content(context: &Context, path: &Path) -> Result<Vec<u8>, String> {
    let bytes = context.read(path)?;
    if path.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("gz")) {
        return Ok(bytes);
    }
    let mut unpacked = Vec::new();
    let message = |why: &str| format!("{} cannot be unpacked: {why}", path.display());
    let unpack = GzDecoder::new(bytes.as_slice()).take(MAX_UNPACKED).read_to_end(&mut unpacked);
    match unpack {
        Err(error) => Err(message(&error.to_string())),
        Ok(length) if length as u64 >= MAX_UNPACKED => Err(message("it holds 1 GiB or more")),
        Ok(_) => Ok(unpacked),
    }
}

impl Reader {
    fn file(&mut self, bytes: &[u8], path: &Path, depth: usize) -> Result<(), LoadError> {
        let text = String::from_utf8_lossy(bytes);
        let mut tokens = Tokens::new(&text, path);
        while let Some(token) = tokens.take()? {
            let at = tokens.place(&token);
            let Kind::Word(word) = token.kind else {
                let message =
                    format!("{} stands alone; expected a directive", token.kind.describe());
                return Err(at.error(message));
            };
            self.directive(word, &mut tokens, at, depth)?;
        }
        Ok(())
    }

    fn directive(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: Place,
        depth: usize,
    ) -> Result<(), LoadError> {
        match word {
            "Identity" | "Translate" | "Scale" | "Rotate" | "LookAt" | "Transform"
            | "ConcatTransform" | "CoordinateSystem" | "CoordSysTransform" | "ActiveTransform"
            | "TransformTimes" => self.transform(word, tokens, &at),
            "Camera" | "Film" | "Sampler" | "Integrator" | "PixelFilter" | "Accelerator"
            | "Option" => self.option(word, tokens, at),
            "WorldBegin" => self.world_begin(&at),
            "AttributeBegin" => self.save("AttributeBegin", at),
            "TransformBegin" => self.save("TransformBegin", at),
            "AttributeEnd" => self.restore("AttributeBegin", &at).map(drop),
            "TransformEnd" => {
                let after = self.state.clone();
                let State { ctm, active, .. } = self.restore("TransformBegin", &at)?;
                self.state = State { ctm, active, ..after };
                Ok(())
            }
            "ObjectBegin" => self.object_begin(tokens, at),
            "ObjectEnd" => self.object_end(&at),
            "ObjectInstance" => self.instance(tokens, &at),
            "Include" | "Import" => self.include(word, tokens, &at, depth),
            _ => self.attribute(word, tokens, at),
        }
    }

    fn attribute(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: Place,
    ) -> Result<(), LoadError> {
        match word {
            "Attribute" => {
                let target = text(tokens, &at)?;
                let list = Parameter::list(tokens)?;
                let Some(defaults) = self.state.defaults.of(&target) else {
                    let hint = did_you_mean(&target, TARGETS.into_iter());
                    return Err(
                        at.error(format!("there are no attributes of {}{hint}", quote(&target)))
                    );
                };
                let kept =
                    defaults.iter().filter(|old| list.iter().all(|new| new.name != old.name));
                *defaults = kept.cloned().chain(list.iter().cloned()).collect();
                if defaults.len() > MAX_PARAMETERS {
                    return Err(at.error(format!(
                        "there are more than {MAX_PARAMETERS} attributes of {}",
                        quote(&target)
                    )));
                }
            }
            "ReverseOrientation" => self.state.reverses ^= true,
            "ColorSpace" => {
                let name = text(tokens, &at)?;
                let Some(space) = ColorSpace::ALL.into_iter().find(|space| space.name == name)
                else {
                    let hint = did_you_mean(&name, ColorSpace::ALL.iter().map(|space| space.name));
                    return Err(
                        at.error(format!("there is no colour space {}{hint}", quote(&name)))
                    );
                };
                self.state.color_space = space;
            }
            "MediumInterface" => {
                let inside = text(tokens, &at)?;
                let has_outside = matches!(tokens.peek()?, Some(Token { kind: Kind::Text(_), .. }));
                let outside = if has_outside { text(tokens, &at)? } else { inside.clone() };
                self.state.media = Rc::new(Interface { inside, outside, at: Some(at) });
            }
            "Material" => {
                let entity = self.entity("Material", tokens, at)?;
                self.state.material = self.world.add_material(entity);
            }
            "NamedMaterial" => {
                self.state.material = MaterialName::Named(text(tokens, &at)?.into(), at);
            }
            "MakeNamedMaterial" => {
                let (name, entity) = self.named("MakeNamedMaterial", tokens, at)?;
                self.world.name_material(name, entity)?;
            }
            "MakeNamedMedium" => {
                let (name, entity) = self.named("MakeNamedMedium", tokens, at)?;
                self.world.media.define(name, &entity, &self.state)?;
            }
            "AreaLightSource" => {
                let entity = self.entity("AreaLightSource", tokens, at)?;
                self.state.area_light = Some(Rc::new(entity));
            }
            "LightSource" => {
                let entity = self.entity("LightSource", tokens, at)?;
                self.require_world(&entity.at, "LightSource")?;
                self.world.add_light(&entity, &self.state)?;
            }
            "Texture" => self.texture(tokens, at)?,
            "Shape" => {
                let entity = self.entity("Shape", tokens, at)?;
                self.require_world(&entity.at, "Shape")?;
                let in_object = self.object.is_some();
                let placed = self.world.shape(&entity, &self.state, in_object)?;
                match &mut self.object {
                    Some((_, shapes)) => shapes.push(placed),
                    None => self.world.place(placed)?,
                }
            }
            "WorldEnd" => {
                return Err(at.error(
                    "WorldEnd is of pbrt-v3; delete it, or convert the file with pbrt --upgrade",
                ));
            }
            _ => {
                let hint = did_you_mean(word, DIRECTIVES.into_iter());
                return Err(at.error(format!("there is no directive {}{hint}", quote(word))));
            }
        }
        Ok(())
    }

    /// A directive with a type and parameters.
    fn entity(
        &self,
        directive: &'static str,
        tokens: &mut Tokens<'_>,
        at: Place,
    ) -> Result<Entity, LoadError> {
        let kind = text(tokens, &at)?;
        let parameters = Parameter::list(tokens)?;
        let defaults = &self.state.defaults;
        let defaults = match directive {
            "Shape" => &defaults.shape,
            "LightSource" | "AreaLightSource" => &defaults.light,
            "Material" => &defaults.material,
            _ => &Rc::default(),
        };
        Ok(Entity::new(directive, kind, at, parameters, defaults, self.state.color_space))
    }

    /// A directive with a name, and a type among its parameters.
    fn named(
        &self,
        directive: &'static str,
        tokens: &mut Tokens<'_>,
        at: Place,
    ) -> Result<(String, Entity), LoadError> {
        let name = text(tokens, &at)?;
        let parameters = Parameter::list(tokens)?;
        let defaults = &self.state.defaults;
        let defaults =
            if directive == "MakeNamedMedium" { &defaults.medium } else { &defaults.material };
        let mut entity =
            Entity::new(directive, String::new(), at, parameters, defaults, self.state.color_space);
        let Some(kind) = entity.text("type")?.map(str::to_owned) else {
            return Err(entity.at.error("the parameter \"string type\" is missing"));
        };
        entity.kind = kind;
        Ok((name, entity))
    }

    fn texture(&mut self, tokens: &mut Tokens<'_>, at: Place) -> Result<(), LoadError> {
        let name = text(tokens, &at)?;
        let what = text(tokens, &at)?;
        let kind = text(tokens, &at)?;
        let parameters = Parameter::list(tokens)?;
        let defaults = &self.state.defaults.texture;
        let entity = Entity::new("Texture", kind, at, parameters, defaults, self.state.color_space);
        let is_number = match what.as_str() {
            "float" => true,
            "spectrum" => false,
            other => {
                let message =
                    format!("{} is no type of a texture; expected float or spectrum", quote(other));
                return Err(entity.at.error(message));
            }
        };
        self.world.textures.define(&name, is_number, &entity)
    }

    fn transform(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: &Place,
    ) -> Result<(), LoadError> {
        let finite = |map: DAffine3| {
            if map.is_finite() {
                Ok(map)
            } else {
                Err(at.error("the transform is no longer finite"))
            }
        };
        match word {
            "Identity" => self.state.change(|_| DAffine3::IDENTITY),
            "Translate" => {
                let step = DAffine3::from_translation(DVec3::from_array(numbers(tokens, at)?));
                self.state.change(|ctm| ctm * step);
            }
            "Scale" => {
                let step = DAffine3::from_scale(DVec3::from_array(numbers(tokens, at)?));
                self.state.change(|ctm| ctm * step);
            }
            "Rotate" => {
                let [angle, x, y, z] = numbers(tokens, at)?;
                let axis = DVec3::new(x, y, z);
                if axis.try_normalize().is_none() {
                    return Err(
                        at.error("the axis of Rotate is zero; expected an angle and a direction")
                    );
                }
                let step = rotate(axis, angle);
                self.state.change(|ctm| ctm * step);
            }
            "LookAt" => {
                let n: [f64; 9] = numbers(tokens, at)?;
                let [eye, target, up] = [0, 3, 6].map(|i| DVec3::new(n[i], n[i + 1], n[i + 2]));
                let Some(node) = look_at(eye, target, up) else {
                    return Err(at.error("eye, target and up direction of LookAt lie on one line"));
                };
                let step = node.inverse();
                self.state.change(|ctm| ctm * step);
            }
            "Transform" | "ConcatTransform" => {
                let map = matrix(&numbers(tokens, at)?).map_err(|message| at.error(message))?;
                let replaces = word == "Transform";
                self.state.change(|ctm| if replaces { map } else { ctm * map });
            }
            "CoordinateSystem" => {
                let name = text(tokens, at)?;
                self.systems.insert(name, self.state.ctm);
            }
            "CoordSysTransform" => {
                let name = text(tokens, at)?;
                let Some(system) = self.systems.get(&name) else {
                    let hint = did_you_mean(&name, self.systems.keys().map(String::as_str));
                    return Err(
                        at.error(format!("there is no coordinate system {}{hint}", quote(&name)))
                    );
                };
                self.state.ctm = *system;
            }
            "ActiveTransform" => self.state.active = active(tokens, at)?,
            _ => self.times(tokens, at)?,
        }
        self.state.ctm.into_iter().try_for_each(|ctm| finite(ctm).map(drop))
    }

    fn times(&mut self, tokens: &mut Tokens<'_>, at: &Place) -> Result<(), LoadError> {
        let times: [f64; 2] = numbers(tokens, at)?;
        if self.in_world {
            return Err(at.error("TransformTimes belongs before WorldBegin"));
        }
        if times[0] >= times[1] {
            return Err(at.error("expected TransformTimes with an end that is after the start"));
        }
        self.world.times = times;
        Ok(())
    }

    /// What belongs before the world.
    fn option(&mut self, word: &str, tokens: &mut Tokens<'_>, at: Place) -> Result<(), LoadError> {
        if self.in_world {
            return Err(at.error(format!("{word} belongs before WorldBegin")));
        }
        match word {
            "Option" => {
                let kind = String::new();
                let parameters = Parameter::list(tokens)?;
                let entity =
                    Entity::new("Option", kind, at, parameters, &[], self.state.color_space);
                super::film::check_option(&entity)
            }
            "Camera" => {
                let entity = self.entity("Camera", tokens, at)?;
                let to_world = self.state.ctm.map(|ctm| ctm.inverse());
                if !to_world.iter().all(DAffine3::is_finite) {
                    return Err(entity.at.error("the transform of the camera flattens space"));
                }
                self.systems.insert("camera".to_owned(), to_world);
                let media = Rc::clone(&self.state.media);
                self.world.sight.camera = Some((entity, to_world, media));
                Ok(())
            }
            _ => {
                let Sight { film, sampler, integrator, filter, .. } = &mut self.world.sight;
                let (slot, directive) = match word {
                    "Film" => (Some(film), "Film"),
                    "Sampler" => (Some(sampler), "Sampler"),
                    "Integrator" => (Some(integrator), "Integrator"),
                    "PixelFilter" => (Some(filter), "PixelFilter"),
                    _ => (None, "Accelerator"),
                };
                let kind = text(tokens, &at)?;
                let parameters = Parameter::list(tokens)?;
                let entity =
                    Entity::new(directive, kind, at, parameters, &[], self.state.color_space);
                if let Some(slot) = slot {
                    *slot = Some(entity);
                }
                Ok(())
            }
        }
    }

    fn world_begin(&mut self, at: &Place) -> Result<(), LoadError> {
        if self.in_world {
            return Err(at.error("the world has begun already; expected one WorldBegin"));
        }
        self.in_world = true;
        self.state.ctm = [DAffine3::IDENTITY; 2];
        self.state.active = [true; 2];
        self.systems.insert("world".to_owned(), self.state.ctm);
        Ok(())
    }

    fn require_world(&self, at: &Place, what: &str) -> Result<(), LoadError> {
        if self.in_world {
            Ok(())
        } else {
            Err(at.error(format!("{what} belongs behind WorldBegin")))
        }
    }

    fn save(&mut self, by: &'static str, at: Place) -> Result<(), LoadError> {
        if self.saved.len() >= MAX_DEPTH {
            return Err(at.error(format!("attributes are nested deeper than {MAX_DEPTH}")));
        }
        self.saved.push(Saved { by, at, state: self.state.clone() });
        Ok(())
    }

    /// Goes back to what was saved by a directive, and gives it.
    fn restore(&mut self, by: &str, at: &Place) -> Result<State, LoadError> {
        let end = by.replace("Begin", "End");
        match self.saved.pop() {
            Some(saved) if saved.by == by => {
                self.state = saved.state.clone();
                Ok(saved.state)
            }
            Some(saved) => {
                let message = format!("{end} closes the {} of {}", saved.by, saved.at.span(""));
                Err(at.error(message))
            }
            None => Err(at.error(format!("{end} has no {by}"))),
        }
    }

    fn object_begin(&mut self, tokens: &mut Tokens<'_>, at: Place) -> Result<(), LoadError> {
        let name = text(tokens, &at)?;
        self.require_world(&at, "ObjectBegin")?;
        if self.object.is_some() {
            return Err(at.error("an object cannot contain another; expected ObjectEnd before"));
        }
        if self.world.objects.contains_key(&name) {
            return Err(at.error(format!("there is already an object {}", quote(&name))));
        }
        self.object = Some((name, Vec::new()));
        self.save("ObjectBegin", at)
    }

    fn object_end(&mut self, at: &Place) -> Result<(), LoadError> {
        self.restore("ObjectBegin", at)?;
        if let Some((name, shapes)) = self.object.take() {
            self.world.objects.insert(name, shapes.into());
        }
        Ok(())
    }

    fn instance(&mut self, tokens: &mut Tokens<'_>, at: &Place) -> Result<(), LoadError> {
        let name = text(tokens, at)?;
        self.require_world(at, "ObjectInstance")?;
        if self.object.is_some() {
            return Err(at.error("an object cannot contain instances; expected ObjectEnd before"));
        }
        self.world.instance(&name, self.state.ctm, at)
    }

    fn include(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: &Place,
        depth: usize,
    ) -> Result<(), LoadError> {
        let name = text(tokens, at)?;
        self.files += 1;
        if depth >= MAX_INCLUDE_DEPTH {
            return Err(at.error(format!(
                "files are included more than {MAX_INCLUDE_DEPTH} deep; do they include each other?"
            )));
        }
        if self.files > MAX_FILES {
            return Err(at.error(format!("more than {MAX_FILES} files are included")));
        }
        let path = self.folder.join(&name);
        let bytes = content(&self.folder.context, &path).map_err(|message| at.error(message))?;
        if word == "Include" {
            return self.file(&bytes, &path, depth + 1);
        }
        self.require_world(at, "Import")?;
        let (state, open) = (self.state.clone(), self.saved.len());
        self.file(&bytes, &path, depth + 1)?;
        if self.saved.len() != open {
            return Err(at.error(format!(
                "{} leaves an AttributeBegin or AttributeEnd without the other",
                quote(&name)
            )));
        }
        self.state = state;
        Ok(())
    }
}
