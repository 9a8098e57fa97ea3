//! Objects with typed parameters: the content of XML files before interpretation.

use std::path::PathBuf;
use std::sync::Arc;

use pt_math::{DAffine3, DVec3};
use pt_scene::{Motion, Span, Warning};

use super::refused;
use super::value::ParameterValue;
use crate::LoadError;
use crate::shared::context::LoadContext;
use crate::shared::names::{meant, quote};
use crate::shared::parameters::{NamedParameter, RequestedParameters, above_zero};
use crate::shared::registry::Registry;

/// All objects of a scene and its included files.
#[derive(Debug)]
pub(super) struct ObjectTree {
    pub(super) context: Arc<LoadContext>,
    /// Objects, of which the first is the scene itself.
    pub(super) objects: Vec<MitsubaObject>,
    /// Objects by their identifiers.
    pub(super) ids: Registry<usize>,
    /// True if a search folder is missing, so that missing files are not reported.
    pub(super) has_lost_folder: bool,
    /// Search folders for files, in order.
    pub(super) search: Vec<PathBuf>,
    pub(super) warnings: Vec<Warning>,
}

/// Object such as `<shape type="sphere" id="ball">`, with its content.
#[derive(Debug)]
pub(super) struct MitsubaObject {
    /// Tag, such as `shape`.
    pub(super) tag: String,
    /// Type, such as `sphere`.
    pub(super) kind: String,
    /// Identifier, such as `ball`; empty if there is none.
    pub(super) id: String,
    pub(super) at: Span,
    pub(super) parameters: Vec<ObjectParameter>,
    pub(super) children: Vec<ChildObject>,
    /// True if some of its content could not be read, which was reported.
    pub(super) is_broken: bool,
}

/// A named value of an object.
#[derive(Debug)]
pub(super) struct ObjectParameter {
    pub(super) name: String,
    pub(super) value: ParameterValue,
    pub(super) at: Span,
}

impl NamedParameter for ObjectParameter {
    fn name(&self) -> &str {
        &self.name
    }
}

/// An object inside an object.
#[derive(Debug)]
pub(super) struct ChildObject {
    /// Role within the enclosing object, such as `reflectance`; empty if not specified.
    pub(super) name: String,
    /// Location of the object or of the reference.
    pub(super) at: Span,
    pub(super) target: ChildTarget,
}

#[derive(Debug)]
pub(super) enum ChildTarget {
    /// Nested object; an index into [`ObjectTree::objects`].
    Object(usize),
    /// Object elsewhere with this identifier.
    Reference(String),
}

/// Returns an error at a location.
pub(super) fn error(at: &Span, message: impl Into<String>) -> LoadError {
    LoadError::Content { at: at.clone(), message: message.into() }
}

/// Returns an error about a type of object that is not supported.
pub(super) fn unsupported(object: &MitsubaObject, supported: &[&str]) -> LoadError {
    let MitsubaObject { tag, kind, .. } = object;
    let list = supported.join(", ");
    if let Some(reason) = refused::reason(tag, kind) {
        let message = format!("unsupported {tag} type {}: {reason}", quote(kind));
        return error(&object.at, message);
    }
    let near = meant(kind, supported.iter().copied());
    let message = format!("unsupported {tag} type {}{near}; supported: {list}", quote(kind));
    error(&object.at, message)
}

impl ObjectTree {
    /// Returns the index of the object of a child. If that could not be read, the error was
    /// reported.
    pub(super) fn target(&self, child: &ChildObject) -> Result<usize, LoadError> {
        let index = match &child.target {
            ChildTarget::Object(index) => *index,
            ChildTarget::Reference(id) => {
                let undefined =
                    |hint: &str| error(&child.at, format!("undefined id {}{hint}", quote(id)));
                *self.ids.get(id, undefined)?
            }
        };
        if self.objects[index].is_broken { Err(LoadError::AlreadyReported) } else { Ok(index) }
    }

    /// Returns the nested objects, each of which must have one of the supported tags.
    pub(super) fn children(
        &self,
        object: &MitsubaObject,
        supported: &[&str],
    ) -> Result<Vec<usize>, LoadError> {
        let mut targets = Vec::new();
        for child in &object.children {
            let index = self.target(child)?;
            let tag = self.objects[index].tag.as_str();
            if !supported.contains(&tag) {
                let advice = match (tag, object.tag.as_str()) {
                    ("texture", "bsdf" | "emitter") => "; give the colour as <rgb>",
                    _ => "",
                };
                let message =
                    format!("unsupported <{tag}> inside of {}{advice}", object.describe());
                return Err(error(&child.at, message));
            }
            targets.push(index);
        }
        Ok(targets)
    }

    /// Returns the only object with a tag among the given ones; `None` if there is none.
    pub(super) fn only(&self, among: &[usize], tag: &str) -> Result<Option<usize>, LoadError> {
        let mut found = among.iter().copied().filter(|i| self.objects[*i].tag == tag);
        let first = found.next();
        match found.next() {
            Some(second) => {
                let message = format!("duplicate <{tag}>; expected at most one");
                Err(error(&self.objects[second].at, message))
            }
            None => Ok(first),
        }
    }
}

impl MitsubaObject {
    /// Returns the tag and type, such as `shape "sphere"`.
    pub(super) fn describe(&self) -> String {
        if self.kind.is_empty() {
            self.tag.clone()
        } else {
            format!("{} {}", self.tag, quote(&self.kind))
        }
    }

    /// Adds a parameter.
    pub(super) fn add_parameter(
        &mut self,
        name: String,
        value: ParameterValue,
        at: Span,
    ) -> Result<(), LoadError> {
        if self.parameters.iter().any(|p| p.name == name) {
            return Err(error(&at, format!("duplicate parameter {}", quote(&name))));
        }
        self.parameters.push(ObjectParameter { name, value, at });
        Ok(())
    }

    /// Returns the identifier, or the type if there is none.
    pub(super) fn name(&self) -> &str {
        if self.id.is_empty() { &self.kind } else { &self.id }
    }
}

/// Meaning and range of a colour.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum ColorRole {
    /// A reflectance or transmittance, in [0, 1].
    Share,
    /// A texture value, non-negative; a reflectance of 1 reflects all light.
    Level,
    /// Emitted light, non-negative.
    Emission,
    /// Real or imaginary part of an index of refraction, non-negative.
    Index,
    /// Extinction or absorption per unit of length, non-negative.
    Extinction,
}

/// Reads the parameters of an object and records which were requested, so that unknown ones can be
/// rejected.
pub(super) struct Parameters<'t> {
    object: &'t MitsubaObject,
    requested: RequestedParameters,
}

impl<'t> Parameters<'t> {
    pub(super) fn new(object: &'t MitsubaObject) -> Self {
        Self { object, requested: RequestedParameters::default() }
    }

    /// Ignores parameters without an effect here.
    pub(super) fn pass_over(&mut self, names: &[&'static str]) {
        self.requested.ignore(names);
    }

    /// Rejects parameters that were neither requested nor ignored.
    pub(super) fn finish(self) -> Result<(), LoadError> {
        let Self { object, requested } = self;
        match requested.unknown(object.parameters.iter(), &object.describe()) {
            Some((unknown, message)) => Err(error(&unknown.at, message)),
            None => Ok(()),
        }
    }

    /// Returns a parameter; `None` if it is not specified.
    pub(super) fn find(&mut self, name: &'static str) -> Option<&'t ObjectParameter> {
        self.requested.find(&self.object.parameters, name)
    }

    /// Returns a parameter of a type that `convert` accepts.
    fn get<T>(
        &mut self,
        name: &'static str,
        expected: &str,
        convert: impl Fn(&'t ParameterValue) -> Option<T>,
    ) -> Result<Option<T>, LoadError> {
        let Some(parameter) = self.find(name) else { return Ok(None) };
        convert(&parameter.value).map(Some).ok_or_else(|| {
            error(&parameter.at, format!("wrong type of {}; expected {expected}", quote(name)))
        })
    }

    pub(super) fn float(&mut self, name: &'static str) -> Result<Option<f64>, LoadError> {
        self.get(name, "a <float>", |value| match value {
            ParameterValue::Float(x) => Some(*x),
            ParameterValue::Integer(x) => Some(*x as f64),
            _ => None,
        })
    }

    /// Returns a number above 0.
    pub(super) fn positive(&mut self, name: &'static str, default: f64) -> Result<f64, LoadError> {
        let x = self.float(name)?.unwrap_or(default);
        above_zero(name, x).map_err(|message| self.refuse(name, message))
    }

    pub(super) fn integer(&mut self, name: &'static str) -> Result<Option<i64>, LoadError> {
        self.get(name, "an <integer>", |value| match value {
            ParameterValue::Integer(x) => Some(*x),
            _ => None,
        })
    }

    /// Returns an integer from 1 to `most`.
    pub(super) fn count(
        &mut self,
        name: &'static str,
        most: u32,
    ) -> Result<Option<u32>, LoadError> {
        let Some(x) = self.integer(name)? else { return Ok(None) };
        let count = u32::try_from(x).ok().filter(|x| (1..=most).contains(x));
        count.map(Some).ok_or_else(|| {
            let message =
                format!("found {} = {x}, expected a whole number from 1 to {most}", quote(name));
            self.refuse(name, message)
        })
    }

    pub(super) fn boolean(&mut self, name: &'static str) -> Result<bool, LoadError> {
        self.boolean_or(name, false)
    }

    pub(super) fn boolean_or(
        &mut self,
        name: &'static str,
        default: bool,
    ) -> Result<bool, LoadError> {
        let value = self.get(name, "a <boolean>", |value| match value {
            ParameterValue::Boolean(x) => Some(*x),
            _ => None,
        });
        Ok(value?.unwrap_or(default))
    }

    pub(super) fn text(&mut self, name: &'static str) -> Result<Option<&'t str>, LoadError> {
        self.get(name, "a <string>", |value| match value {
            ParameterValue::Text(x) => Some(x.as_str()),
            _ => None,
        })
    }

    pub(super) fn vector(&mut self, name: &'static str) -> Result<Option<DVec3>, LoadError> {
        self.get(name, "a <point> or <vector>", |value| match value {
            ParameterValue::Vector(x) => Some(DVec3::from_array(*x)),
            _ => None,
        })
    }

    /// Returns an invertible transform, the identity by default. For an animated transform, returns
    /// the identity and the motion.
    pub(super) fn placement(
        &mut self,
        name: &'static str,
    ) -> Result<(DAffine3, Option<Motion>), LoadError> {
        if let Some(ObjectParameter { value: ParameterValue::Animation(motion), .. }) =
            self.find(name)
        {
            return Ok((DAffine3::IDENTITY, Some(motion.clone())));
        }
        Ok((self.transform(name)?, None))
    }

    /// Returns an invertible transform; the identity by default.
    pub(super) fn transform(&mut self, name: &'static str) -> Result<DAffine3, LoadError> {
        if let Some(ObjectParameter { value: ParameterValue::Animation(_), .. }) = self.find(name) {
            let what = self.object.describe();
            let message = format!(
                "{what} does not support motion; expected a <transform>, and an <animation> only \
                 as the \"to_world\" of shapes, instances and sensors"
            );
            return Err(self.refuse(name, message));
        }
        let found = self.get(name, "a <transform>", |value| match value {
            ParameterValue::Transform(x) => Some(*x),
            _ => None,
        });
        let transform = found?.unwrap_or(DAffine3::IDENTITY);
        if transform.inverse().is_finite() {
            return Ok(transform);
        }
        Err(self.refuse(
            name,
            format!("found a singular {}, expected an invertible transform", quote(name)),
        ))
    }

    /// Returns a colour; `default` in all channels if there is none.
    pub(super) fn color(
        &mut self,
        name: &'static str,
        role: ColorRole,
        default: f64,
    ) -> Result<[f32; 3], LoadError> {
        Ok(self.given_color(name, role)?.unwrap_or([default as f32; 3]))
    }

    /// Returns a colour, if there is one.
    pub(super) fn given_color(
        &mut self,
        name: &'static str,
        role: ColorRole,
    ) -> Result<Option<[f32; 3]>, LoadError> {
        let found = self.get(name, "an <rgb>", |value| match (value, role) {
            (ParameterValue::Rgb(rgb), _) => Some(*rgb),
            (ParameterValue::Spectrum(spectrum), ColorRole::Emission) => Some(spectrum.emitted),
            // A reflectance of at most 1 at all wavelengths is clamped to 1 in all channels.
            (ParameterValue::Spectrum(spectrum), ColorRole::Share | ColorRole::Level)
                if spectrum.most <= 1.0 =>
            {
                Some(spectrum.reflected.map(|x| x.min(1.0)))
            }
            (ParameterValue::Spectrum(spectrum), _) => Some(spectrum.reflected),
            (ParameterValue::Float(x), _) => Some([*x; 3]),
            (ParameterValue::Integer(x), _) => Some([*x as f64; 3]),
            _ => None,
        });
        let Some(color) = found? else { return Ok(None) };
        let (range, name_of_range) = match role {
            ColorRole::Share => (0.0..=1.0, "from 0 to 1"),
            ColorRole::Level | ColorRole::Emission | ColorRole::Index | ColorRole::Extinction => {
                (0.0..=f64::from(f32::MAX), "of at least 0")
            }
        };
        match color.iter().find(|x| !range.contains(x)) {
            Some(bad) => {
                let message = format!(
                    "found a channel of {bad:?} in {}, expected numbers {name_of_range}",
                    quote(name)
                );
                Err(self.refuse(name, message))
            }
            None => Ok(Some(color.map(|x| x as f32))),
        }
    }

    /// Location of a parameter, or of the object if the parameter is not specified.
    pub(super) fn place(&self, name: &str) -> &'t Span {
        let written = self.object.parameters.iter().find(|p| p.name == name);
        written.map_or(&self.object.at, |p| &p.at)
    }

    /// Returns an error at a parameter, or at the object if the parameter is not specified.
    pub(super) fn refuse(&self, name: &str, message: impl Into<String>) -> LoadError {
        error(self.place(name), message)
    }
}
