//! Processes directives in order.

mod transforms;

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use pt_math::DAffine3;
use pt_scene::Warning;

use super::arguments::text;
use super::camera::CameraSetup;
use super::color_space::ColorSpace;
use super::entity::{Entity, MAX_PARAMETERS};
use super::parameter::ParsedParameter;
use super::position::TokenPosition;
use super::state::{GraphicsState, TARGETS};
use super::texture;
use super::token::{Token, TokenKind, Tokens};
use super::types::{MaterialName, MediumInterface, Moving, PlacedShape};
use super::world::PbrtWorld;
use crate::LoadError;
use crate::pbrt::content::content;
use crate::shared::context::{Folder, LoadContext};
use crate::shared::mesh_file;
use crate::shared::names::{did_you_mean, quote};
use crate::shared::reference_stack::{ReferenceError, ReferenceStack};
use crate::shared::text::characters;

/// Maximum nesting depth of included files.
const MAX_INCLUDE_DEPTH: usize = 32;
/// Maximum number of included files. Files that include others twice multiply.
const MAX_FILES: usize = 1000;
/// Maximum nesting depth of attributes.
const MAX_DEPTH: usize = 10_000;

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

/// State saved by a `…Begin` directive, which `…End` restores.
struct Saved {
    /// The directive that saved the state, and its position.
    by: &'static str,
    at: TokenPosition,
    state: GraphicsState,
}

/// State of the reader.
struct PbrtReader {
    /// Folder of the scene file, to which all paths are relative.
    folder: Folder,
    /// The files being read, each included by the one before.
    way: ReferenceStack<PathBuf>,
    state: GraphicsState,
    saved: Vec<Saved>,
    /// Named coordinate systems.
    systems: HashMap<String, Moving>,
    in_world: bool,
    /// Name and shapes of the object that is being defined.
    object: Option<(String, Vec<PlacedShape>)>,
    world: PbrtWorld,
}

/// Reads a scene and the files that it includes.
pub(super) fn read(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<PbrtWorld, LoadError> {
    let folder = Folder { path: mesh_file::folder_of(path), context: Arc::clone(context) };
    let mut reader = PbrtReader {
        world: PbrtWorld::new(&folder, mesh_file::place(path, 0)),
        folder,
        way: ReferenceStack::of_files(context.limits(), MAX_INCLUDE_DEPTH, MAX_FILES),
        state: GraphicsState::new(),
        saved: Vec::new(),
        systems: HashMap::new(),
        in_world: false,
        object: None,
    };
    let _ = reader.way.enter_file(path); // the first file is always allowed
    reader.file(bytes, path, Vec::new())?;
    if let Some(Saved { by, at, .. }) = reader.saved.last()
        && !context.has_errors()
    {
        let end = by.replace("Begin", "End");
        return Err(at.error(format!("{by} without {end}")));
    }
    Ok(reader.world)
}

impl PbrtReader {
    /// Reads a file, whose last directive continues with the parameters `tail`.
    fn file(
        &mut self,
        bytes: &[u8],
        path: &Path,
        tail: Vec<ParsedParameter>,
    ) -> Result<(), LoadError> {
        let text = characters(bytes, path)?;
        self.folder.context.expect_pictures(texture::pictures(&text, &self.folder));
        let mut tokens = Tokens::included(&text, path, tail);
        while let Some(token) = tokens.take()? {
            let at = tokens.place(&token);
            let done = match token.kind {
                TokenKind::Word(word) => self.directive(word, &mut tokens, at),
                other => {
                    let message = format!("found {}, expected a directive", other.describe());
                    Err(at.error(message))
                }
            };
            if self.folder.context.ok_or_report(done)?.is_none() {
                tokens.skip_to(|word| DIRECTIVES.contains(&word))?;
            }
            self.world.scene.warnings.append(&mut tokens.notes);
        }
        let done = match tokens.take_tail()?.first() {
            Some(ParsedParameter { at, name, .. }) => Err(at.error(format!(
                "found the parameter {} without a directive, expected an included file that ends \
                 with a directive with parameters",
                quote(name)
            ))),
            None => Ok(()),
        };
        self.folder.context.ok_or_report(done).map(drop)
    }

    fn directive(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
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
                let GraphicsState { ctm, active, .. } = self.restore("TransformBegin", &at)?;
                self.state = GraphicsState { ctm, active, ..after };
                Ok(())
            }
            "ObjectBegin" => self.object_begin(tokens, at),
            "ObjectEnd" => self.object_end(&at),
            "ObjectInstance" => self.instance(tokens, &at),
            "Include" | "Import" => self.include(word, tokens, &at),
            _ => self.attribute(word, tokens, at),
        }
    }

    fn attribute(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
    ) -> Result<(), LoadError> {
        match word {
            "Attribute" => {
                let target = text(tokens, &at)?;
                let list = ParsedParameter::list(tokens)?;
                let Some(defaults) = self.state.defaults.of(&target) else {
                    let hint = did_you_mean(&target, TARGETS.into_iter());
                    return Err(
                        at.error(format!("unknown attribute target {}{hint}", quote(&target)))
                    );
                };
                let kept =
                    defaults.iter().filter(|old| list.iter().all(|new| new.name != old.name));
                *defaults = kept.cloned().chain(list.iter().cloned()).collect();
                if defaults.len() > MAX_PARAMETERS {
                    return Err(at.error(format!(
                        "more than {MAX_PARAMETERS} attributes of {}",
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
                    return Err(at.error(format!("unknown colour space {}{hint}", quote(&name))));
                };
                self.state.color_space = space;
            }
            "MediumInterface" => {
                let inside = text(tokens, &at)?;
                let has_outside =
                    matches!(tokens.peek()?, Some(Token { kind: TokenKind::Text(_), .. }));
                let outside = if has_outside { text(tokens, &at)? } else { inside.clone() };
                self.state.media = Rc::new(MediumInterface { inside, outside, at: Some(at) });
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
                let world = &mut self.world;
                let warnings = &mut world.scene.warnings;
                let defined = world.media.define(&name, &entity, &self.state, warnings);
                return defined.inspect_err(|_| self.world.media.numbers.fail(name));
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
                    Some((_, shapes)) => {
                        if !shapes.last_mut().is_some_and(|last| last.joins(&placed)) {
                            shapes.push(placed);
                        }
                    }
                    None => self.world.place(placed)?,
                }
            }
            "WorldEnd" => {
                return Err(at.error(
                    "unsupported WorldEnd of pbrt-v3; delete it, or convert the file with pbrt \
                     --upgrade",
                ));
            }
            _ => {
                let hint = did_you_mean(word, DIRECTIVES.into_iter());
                return Err(at.error(format!("unknown directive {}{hint}", quote(word))));
            }
        }
        Ok(())
    }

    /// Reads a directive with a type and parameters.
    fn entity(
        &self,
        directive: &'static str,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
    ) -> Result<Entity, LoadError> {
        let kind = text(tokens, &at)?;
        let parameters = ParsedParameter::list(tokens)?;
        let defaults = &self.state.defaults;
        let defaults = match directive {
            "Shape" => &defaults.shape,
            "LightSource" | "AreaLightSource" => &defaults.light,
            "Material" => &defaults.material,
            _ => &Rc::default(),
        };
        Ok(Entity::new(directive, kind, at, parameters, defaults, self.state.color_space))
    }

    /// Reads a directive with a name, and a type among its parameters.
    fn named(
        &mut self,
        directive: &'static str,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
    ) -> Result<(String, Entity), LoadError> {
        let name = text(tokens, &at)?;
        let entity = self.typed(directive, tokens, at).inspect_err(|_| {
            if directive == "MakeNamedMedium" {
                self.world.media.numbers.fail(name.clone());
            } else {
                self.world.named_materials.fail(name.clone());
            }
        })?;
        Ok((name, entity))
    }

    /// Reads a directive with a type among its parameters.
    fn typed(
        &self,
        directive: &'static str,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
    ) -> Result<Entity, LoadError> {
        let parameters = ParsedParameter::list(tokens)?;
        let defaults = &self.state.defaults;
        let defaults =
            if directive == "MakeNamedMedium" { &defaults.medium } else { &defaults.material };
        let mut entity =
            Entity::new(directive, String::new(), at, parameters, defaults, self.state.color_space);
        let Some(kind) = entity.text("type")?.map(str::to_owned) else {
            return Err(entity.at.error("missing parameter \"string type\""));
        };
        entity.kind = kind;
        Ok(entity)
    }

    fn texture(&mut self, tokens: &mut Tokens<'_>, at: TokenPosition) -> Result<(), LoadError> {
        let name = text(tokens, &at)?;
        let what = text(tokens, &at)?;
        let defined = self.defined(&name, &what, tokens, at);
        defined.inspect_err(|_| self.world.textures.fail(name))
    }

    /// Defines a texture with a name and a value type.
    fn defined(
        &mut self,
        name: &str,
        what: &str,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
    ) -> Result<(), LoadError> {
        let kind = text(tokens, &at)?;
        let parameters = ParsedParameter::list(tokens)?;
        let defaults = &self.state.defaults.texture;
        let entity = Entity::new("Texture", kind, at, parameters, defaults, self.state.color_space);
        let is_number = match what {
            "float" => true,
            "spectrum" => false,
            other => {
                let message =
                    format!("unknown texture type {}; expected float or spectrum", quote(other));
                return Err(entity.at.error(message));
            }
        };
        let [start, end] = self.state.ctm;
        let is_in_space = self.world.textures.define(name, is_number, &entity, start)?;
        if is_in_space && start != end {
            let message =
                "moving textures are not supported; the transform at the start is used".to_owned();
            self.world.scene.warnings.push(Warning { at: entity.at.span(""), message });
        }
        Ok(())
    }

    /// Processes a directive that belongs before the world.
    fn option(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
    ) -> Result<(), LoadError> {
        if self.in_world {
            return Err(at.error(format!("found {word} after WorldBegin, expected before")));
        }
        match word {
            "Option" => {
                let kind = String::new();
                let parameters = ParsedParameter::list(tokens)?;
                let entity =
                    Entity::new("Option", kind, at, parameters, &[], self.state.color_space);
                super::film::check_option(&entity)
            }
            "Camera" => {
                let entity = self.entity("Camera", tokens, at)?;
                let to_world = self.state.ctm.map(|ctm| ctm.inverse());
                if !to_world.iter().all(DAffine3::is_finite) {
                    return Err(entity.at.error(
                        "found a camera transform that flattens space, expected an invertible one",
                    ));
                }
                self.systems.insert("camera".to_owned(), to_world);
                let media = Rc::clone(&self.state.media);
                self.world.sight.camera = Some((entity, to_world, media));
                Ok(())
            }
            _ => {
                let CameraSetup { film, sampler, integrator, filter, .. } = &mut self.world.sight;
                let (slot, directive) = match word {
                    "Film" => (Some(film), "Film"),
                    "Sampler" => (Some(sampler), "Sampler"),
                    "Integrator" => (Some(integrator), "Integrator"),
                    "PixelFilter" => (Some(filter), "PixelFilter"),
                    _ => (None, "Accelerator"),
                };
                let kind = text(tokens, &at)?;
                let parameters = ParsedParameter::list(tokens)?;
                let entity =
                    Entity::new(directive, kind, at, parameters, &[], self.state.color_space);
                if let Some(slot) = slot {
                    *slot = Some(entity);
                }
                Ok(())
            }
        }
    }

    fn world_begin(&mut self, at: &TokenPosition) -> Result<(), LoadError> {
        if self.in_world {
            return Err(at.error("duplicate WorldBegin; expected one"));
        }
        self.in_world = true;
        self.state.ctm = [DAffine3::IDENTITY; 2];
        self.state.active = [true; 2];
        self.systems.insert("world".to_owned(), self.state.ctm);
        Ok(())
    }

    fn require_world(&self, at: &TokenPosition, what: &str) -> Result<(), LoadError> {
        if self.in_world {
            Ok(())
        } else {
            Err(at.error(format!("found {what} before WorldBegin, expected after")))
        }
    }

    fn save(&mut self, by: &'static str, at: TokenPosition) -> Result<(), LoadError> {
        let most = self.folder.context.limits().depth(MAX_DEPTH);
        if self.saved.len() >= most {
            let message = format!("attributes are nested deeper than {most}");
            return Err(LoadContext::exceeded(at.span(""), message));
        }
        self.saved.push(Saved { by, at, state: self.state.clone() });
        Ok(())
    }

    /// Restores the state saved by a directive, and returns it.
    fn restore(&mut self, by: &str, at: &TokenPosition) -> Result<GraphicsState, LoadError> {
        let end = by.replace("Begin", "End");
        match self.saved.pop() {
            Some(saved) if saved.by == by => {
                self.state = saved.state.clone();
                Ok(saved.state)
            }
            Some(saved) => {
                let message =
                    format!("{end} does not match the {} of {}", saved.by, saved.at.span(""));
                Err(at.error(message))
            }
            None => Err(at.error(format!("{end} without {by}"))),
        }
    }

    fn object_begin(
        &mut self,
        tokens: &mut Tokens<'_>,
        at: TokenPosition,
    ) -> Result<(), LoadError> {
        let name = text(tokens, &at)?;
        self.require_world(&at, "ObjectBegin")?;
        if self.object.is_some() {
            return Err(at.error("an object cannot contain another; expected ObjectEnd first"));
        }
        if self.world.objects.contains_key(&name) {
            return Err(at.error(format!("duplicate object {}", quote(&name))));
        }
        self.object = Some((name, Vec::new()));
        self.save("ObjectBegin", at)
    }

    fn object_end(&mut self, at: &TokenPosition) -> Result<(), LoadError> {
        self.restore("ObjectBegin", at)?;
        if let Some((name, shapes)) = self.object.take() {
            self.world.objects.insert(name, shapes.into());
        }
        Ok(())
    }

    fn instance(&mut self, tokens: &mut Tokens<'_>, at: &TokenPosition) -> Result<(), LoadError> {
        let name = text(tokens, at)?;
        self.require_world(at, "ObjectInstance")?;
        if self.object.is_some() {
            return Err(at.error("an object cannot contain instances; expected ObjectEnd first"));
        }
        self.world.instance(&name, self.state.ctm, at)
    }

    fn include(
        &mut self,
        word: &str,
        tokens: &mut Tokens<'_>,
        at: &TokenPosition,
    ) -> Result<(), LoadError> {
        let name = text(tokens, at)?;
        let tail = ParsedParameter::list(tokens)?;
        let path = self.folder.join(&name);
        match self.way.enter_file(&path) {
            Ok(()) => {}
            Err(circle @ ReferenceError::Circle) => return Err(at.error(circle.of_file(&name))),
            Err(barred) => return Err(LoadContext::exceeded(at.span(""), barred.of_file(&name))),
        }
        let done = self.included(word, (&name, &path), tail, at);
        self.way.leave();
        done
    }

    /// Reads an included file.
    fn included(
        &mut self,
        word: &str,
        (name, path): (&str, &Path),
        tail: Vec<ParsedParameter>,
        at: &TokenPosition,
    ) -> Result<(), LoadError> {
        let bytes = match content(&self.folder.context, path) {
            Ok(bytes) => bytes,
            Err(why) => {
                let message = format!("{why}; its content is omitted");
                self.folder.context.missing(at.span(""), message);
                return Ok(());
            }
        };
        if word == "Include" {
            return self.file(&bytes, path, tail);
        }
        self.require_world(at, "Import")?;
        let (state, open) = (self.state.clone(), self.saved.len());
        self.file(&bytes, path, tail)?;
        if self.saved.len() != open {
            return Err(at.error(format!(
                "found an AttributeBegin or AttributeEnd in {} without the other, expected pairs",
                quote(name)
            )));
        }
        self.state = state;
        Ok(())
    }
}
