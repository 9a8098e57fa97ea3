//! Parameters that may be values or textures, and nested bsdfs.

use std::sync::Arc;

use pt_scene::texture::{Color, Input, Pattern, Scalar, Texture};

use super::super::object::{ChildObject, ColorRole, MitsubaObject, Parameters, error};
use super::super::texture::{MitsubaTextureCache, as_number};
use crate::LoadError;
use crate::shared::names::quote;

/// Reads the parameters and nested objects of a bsdf, and records which were requested.
pub(super) struct Inputs<'a, 't> {
    pub(super) textures: &'a mut MitsubaTextureCache<'t>,
    pub(super) object: &'a MitsubaObject,
    pub(super) parameters: Parameters<'a>,
    /// Names of textures that were requested.
    known: Vec<&'static str>,
    /// True if a texture of any name was requested.
    takes_textures: bool,
    /// True if nested bsdfs were requested.
    takes_bsdfs: bool,
}

impl<'a, 't> Inputs<'a, 't> {
    pub(super) fn new(
        textures: &'a mut MitsubaTextureCache<'t>,
        object: &'a MitsubaObject,
    ) -> Self {
        let parameters = Parameters::new(object);
        let known = Vec::new();
        Self { textures, object, parameters, known, takes_textures: false, takes_bsdfs: false }
    }

    /// Returns the children with a tag, and the indices of their objects.
    fn children(&self, tag: &str) -> Result<Vec<(&'a ChildObject, usize)>, LoadError> {
        let tree = self.textures.tree;
        let mut found = Vec::new();
        for child in &self.object.children {
            let index = tree.target(child)?;
            if tree.objects[index].tag == tag {
                found.push((child, index));
            }
        }
        Ok(found)
    }

    /// Returns the texture of a parameter, if there is one.
    fn texture(&mut self, name: &'static str) -> Result<Option<Arc<Texture>>, LoadError> {
        self.known.push(name);
        let found = self.children("texture")?.into_iter().find(|(child, _)| child.name == name);
        found.map(|(_, index)| self.textures.get(index)).transpose()
    }

    /// Returns the texture of a scalar parameter, if there is one.
    fn number_texture(&mut self, name: &'static str) -> Result<Option<Arc<Texture>>, LoadError> {
        Ok(self.texture(name)?.map(as_number))
    }

    /// Returns the only texture, whatever its name.
    pub(super) fn any_texture(&mut self) -> Result<Arc<Texture>, LoadError> {
        self.takes_textures = true;
        match self.children("texture")?.as_slice() {
            [(_, index)] => self.textures.get(*index),
            found => {
                let message = format!(
                    "expected one <texture> inside of {}, found {}",
                    self.object.describe(),
                    found.len()
                );
                Err(error(&self.object.at, message))
            }
        }
    }

    /// Returns a required texture: the texture or colour of this name, or the only unnamed texture.
    pub(super) fn only_texture(&mut self, name: &'static str) -> Result<Arc<Texture>, LoadError> {
        if let Some(texture) = self.texture(name)? {
            return Ok(texture);
        }
        if self.parameters.find(name).is_some() {
            let color = self.parameters.color(name, ColorRole::Level, 0.0)?;
            return Ok(Arc::new(Pattern::Checkerboard([color; 2]).into()));
        }
        match self.children("texture")?.as_slice() {
            [(child, index)] if child.name.is_empty() => self.textures.get(*index),
            _ => {
                let message = format!("missing <texture name={}>", quote(name));
                Err(error(&self.object.at, message))
            }
        }
    }

    /// Reads a reflectance or transmittance.
    pub(super) fn color(&mut self, name: &'static str, default: f64) -> Result<Color, LoadError> {
        if let Some(texture) = self.texture(name)? {
            return Ok(Input::Texture(texture));
        }
        self.parameters.color(name, ColorRole::Share, default).map(Input::Value)
    }

    /// Reads a number from 0 to 1.
    pub(super) fn share(&mut self, name: &'static str, default: f64) -> Result<Scalar, LoadError> {
        if let Some(texture) = self.number_texture(name)? {
            return Ok(Input::Texture(texture));
        }
        let [r, g, b] = self.parameters.color(name, ColorRole::Share, default)?;
        if r == g && g == b {
            return Ok(Input::Value(r));
        }
        let message =
            format!("found a colour for {}, expected one number from 0 to 1", quote(name));
        Err(self.parameters.refuse(name, message))
    }

    /// Reads a number from 0 to `most`, 0 by default.
    pub(super) fn number(&mut self, name: &'static str, most: f64) -> Result<Scalar, LoadError> {
        if let Some(texture) = self.number_texture(name)? {
            return Ok(Input::Texture(texture));
        }
        let value = self.parameters.float(name)?.unwrap_or(0.0);
        if (0.0..=most).contains(&value) {
            return Ok(Input::Value(value as f32));
        }
        let message =
            format!("found {} = {value}, expected a number from 0 to {most}", quote(name));
        Err(self.parameters.refuse(name, message))
    }

    /// Reads a roughness.
    pub(super) fn alpha(
        &mut self,
        name: &'static str,
        default: &Scalar,
    ) -> Result<Scalar, LoadError> {
        if let Some(texture) = self.number_texture(name)? {
            return Ok(Input::Texture(texture));
        }
        if self.parameters.find(name).is_none() {
            return Ok(default.clone());
        }
        Ok(Input::Value(self.parameters.positive(name, 1.0)? as f32))
    }

    /// Returns the nested bsdfs, between `least` and `most` of them.
    pub(super) fn bsdfs(
        &mut self,
        least: usize,
        most: usize,
    ) -> Result<Vec<&'a MitsubaObject>, LoadError>
    where
        't: 'a,
    {
        self.takes_bsdfs = true;
        let tree = self.textures.tree;
        let found = self.children("bsdf")?;
        if !(least..=most).contains(&found.len()) {
            let wanted =
                if least == most { least.to_string() } else { format!("{least} or {most}") };
            let message = format!(
                "expected {wanted} <bsdf> inside of {}, found {}",
                self.object.describe(),
                found.len()
            );
            return Err(error(&self.object.at, message));
        }
        Ok(found.into_iter().map(|(_, index)| &tree.objects[index]).collect())
    }

    /// Rejects parameters and nested objects that were not requested.
    pub(super) fn finish(self) -> Result<(), LoadError> {
        let tree = self.textures.tree;
        for child in &self.object.children {
            let object = &tree.objects[tree.target(child)?];
            let is_known = match object.tag.as_str() {
                "texture" if self.takes_textures => true,
                "texture" => {
                    let only = child.name.is_empty() && !self.known.is_empty();
                    only || self.known.contains(&child.name.as_str())
                }
                "bsdf" => self.takes_bsdfs,
                _ => false,
            };
            if !is_known {
                let name = match child.name.as_str() {
                    "" => String::new(),
                    name => format!(" name={}", quote(name)),
                };
                let known = match self.known.as_slice() {
                    [] => "none".to_owned(),
                    known => known.join(", "),
                };
                let message = format!(
                    "unsupported <{}{name}> inside of {}; textures are supported for: {known}",
                    object.tag,
                    self.object.describe(),
                );
                return Err(error(&child.at, message));
            }
        }
        self.parameters.finish()
    }
}
