//! Directives: a type, and a list of typed parameters.

use std::cell::RefCell;

use pt_math::DVec3;
use pt_scene::Warning;

use super::color_space::ColorSpace;
use super::position::TokenPosition;
use super::token::{TokenKind, Tokens};
use crate::LoadError;
use crate::pbrt::parameter::{ParameterValues, ParsedParameter};
use crate::shared::names::{did_you_mean, quote};
use crate::shared::number::number;
use crate::shared::parameters::{RequestedParameters, above_zero};

/// Maximum number of parameters of a directive, which are compared pairwise.
pub(super) const MAX_PARAMETERS: usize = 100;

/// Types of parameters. `point3`, `vector3` and `normal3` are synonyms of `point`, `vector` and
/// `normal`.
const TYPES: [&str; 16] = [
    "integer",
    "float",
    "point2",
    "point",
    "point3",
    "vector2",
    "vector",
    "vector3",
    "normal",
    "normal3",
    "rgb",
    "blackbody",
    "spectrum",
    "string",
    "bool",
    "texture",
];

/// A directive with a type and parameters: `Shape "sphere" "float radius" 0.5`.
#[derive(Clone, Debug)]
pub(super) struct Entity {
    /// Name of the directive, such as `Shape`.
    pub(super) directive: &'static str,
    /// Type, such as `sphere`.
    pub(super) kind: String,
    pub(super) at: TokenPosition,
    /// Colour space of its colours.
    pub(super) color_space: ColorSpace,
    parameters: Vec<ParsedParameter>,
    requested: RefCell<RequestedParameters>,
}

impl ParsedParameter {
    /// Reads all parameters up to the next directive, including those that follow the end of an
    /// included file. Of parameters with the same name, the last one is used.
    pub(super) fn list(tokens: &mut Tokens<'_>) -> Result<Vec<Self>, LoadError> {
        let mut list: Vec<Self> = Vec::new();
        Self::read(tokens, &mut list)?;
        for parameter in tokens.take_tail()? {
            parameter.add(tokens, &mut list)?;
        }
        Ok(list)
    }

    /// Returns an error about values in quotes whose type is written without them.
    fn in_quotes(&self, what: &str, text: &str) -> LoadError {
        let Self { kind, name, at, .. } = self;
        at.error(format!(
            "{what} are written without quotes: \"{kind} {name}\" {text}, not \"{text}\""
        ))
    }

    /// Adds a parameter to a list, or replaces the one with the same name.
    fn add(self, tokens: &mut Tokens<'_>, list: &mut Vec<Self>) -> Result<(), LoadError> {
        if let Some(first) = list.iter_mut().find(|p| p.name == self.name) {
            let message =
                format!("duplicate parameter {}; the last one is used", quote(&self.name));
            tokens.notes.push(Warning { at: self.at.span(""), message });
            *first = self;
        } else if list.len() < MAX_PARAMETERS {
            list.push(self);
        } else {
            let message = format!("directive with more than {MAX_PARAMETERS} parameters");
            return Err(self.at.error(message));
        }
        Ok(())
    }

    fn read(tokens: &mut Tokens<'_>, list: &mut Vec<Self>) -> Result<(), LoadError> {
        while let Some(token) = tokens.peek()? {
            let TokenKind::Text(declaration) = token.kind.clone() else { break };
            let token = token.clone();
            let at = tokens.place(&token);
            tokens.take()?;
            let mut words = declaration.split_ascii_whitespace();
            let (Some(kind), Some(name), None) = (words.next(), words.next(), words.next()) else {
                let message = format!(
                    "found {}, expected a parameter with a type and a name, such as \"float \
                     radius\"",
                    quote(&declaration)
                );
                return Err(at.error(message));
            };
            let Some(kind) = TYPES.iter().find(|known| **known == kind) else {
                let hint = did_you_mean(kind, TYPES.into_iter());
                return Err(at.error(format!("unknown type {}{hint}", quote(kind))));
            };
            let values = ParameterValues::read(tokens, &at, kind, name)?;
            let name = name.to_owned();
            let parameter = Self { kind, name, values, at, is_default: false };
            parameter.add(tokens, list)?;
        }
        Ok(())
    }
}

impl ParameterValues {
    /// Reads one value, or several in brackets.
    fn read(
        tokens: &mut Tokens<'_>,
        at: &TokenPosition,
        of: &str,
        name: &str,
    ) -> Result<Self, LoadError> {
        let missing = || at.error(format!("missing value of the parameter {}", quote(name)));
        let first = tokens.take()?.ok_or_else(missing)?;
        let mut values = None;
        match first.kind {
            TokenKind::Open => loop {
                let token = tokens.take()?.ok_or_else(|| {
                    at.error(format!(
                        "unterminated list of the parameter {}; expected a \"]\"",
                        quote(name)
                    ))
                })?;
                if token.kind == TokenKind::Close {
                    return Ok(values.unwrap_or(Self::Numbers(Vec::new())));
                }
                Self::push(&mut values, of, &token.kind)
                    .map_err(|message| tokens.place(&token).error(message))?;
            },
            TokenKind::Close => Err(missing()),
            ref kind => {
                Self::push(&mut values, of, kind)
                    .map_err(|message| tokens.place(&first).error(message))?;
                values.ok_or_else(missing)
            }
        }
    }

    /// Adds a value of a parameter of one of [`TYPES`]; it must be of the same kind as those
    /// before.
    fn push(values: &mut Option<Self>, of: &str, kind: &TokenKind<'_>) -> Result<(), String> {
        let mixed = |what: &TokenKind<'_>| {
            format!(
                "found {}, expected a value of the same type as those before it",
                what.describe()
            )
        };
        match kind {
            TokenKind::Text(text) => match values.get_or_insert_with(|| Self::Texts(Vec::new())) {
                Self::Texts(texts) => texts.push(text.clone().into_owned()),
                _ => return Err(mixed(kind)),
            },
            TokenKind::Word(word) if is_boolean(word) => {
                match values.get_or_insert_with(|| Self::Booleans(Vec::new())) {
                    Self::Booleans(booleans) => booleans.push(*word == "true"),
                    _ => return Err(mixed(kind)),
                }
            }
            TokenKind::Word(word) => {
                let number = number(word).map_err(|message| match of {
                    "bool" => format!("found {}, expected true or false", quote(word)),
                    "string" | "texture" => {
                        format!(
                            "found {word} without quotes, expected a text in quotes: \"{word}\""
                        )
                    }
                    _ => message,
                })?;
                match values.get_or_insert_with(|| Self::Numbers(Vec::new())) {
                    Self::Numbers(numbers) => numbers.push(number),
                    _ => return Err(mixed(kind)),
                }
            }
            TokenKind::Open | TokenKind::Close => {
                return Err(format!(
                    "found {} in a list, expected a value or \"]\"",
                    kind.describe()
                ));
            }
        }
        Ok(())
    }
}

fn is_boolean(word: &str) -> bool {
    matches!(word, "true" | "false")
}

impl Entity {
    /// Creates a directive. Missing parameters are taken from `defaults`, set by an `Attribute`.
    pub(super) fn new(
        directive: &'static str,
        kind: String,
        at: TokenPosition,
        mut parameters: Vec<ParsedParameter>,
        defaults: &[ParsedParameter],
        color_space: ColorSpace,
    ) -> Self {
        for default in defaults {
            if !parameters.iter().any(|p| p.name == default.name) {
                parameters.push(ParsedParameter { is_default: true, ..default.clone() });
            }
        }
        Self { directive, kind, at, color_space, parameters, requested: RefCell::default() }
    }

    /// Returns the directive and type, such as `Shape "sphere"`.
    pub(super) fn describe(&self) -> String {
        format!("{} {}", self.directive, quote(&self.kind))
    }

    /// Returns an error that this type is not supported.
    pub(super) fn unsupported(&self, supported: &[&str]) -> LoadError {
        let hint = supported.join(", ");
        self.at.error(format!("unsupported {}; supported: {hint}", self.describe()))
    }

    /// Location of a parameter, or of the directive if the parameter is not specified.
    pub(super) fn place(&self, name: &str) -> &TokenPosition {
        self.parameters.iter().find(|p| p.name == name).map_or(&self.at, |p| &p.at)
    }

    /// Returns an error at a parameter, or at the directive if the parameter is not specified.
    pub(super) fn refuse(&self, name: &str, message: impl Into<String>) -> LoadError {
        self.place(name).error(message)
    }

    /// Returns a parameter; `None` if it is not specified.
    pub(super) fn find(&self, name: &'static str) -> Option<&ParsedParameter> {
        self.requested.borrow_mut().find(&self.parameters, name)
    }

    /// Ignores parameters without an effect here.
    pub(super) fn pass_over(&self, names: &[&'static str]) {
        self.requested.borrow_mut().ignore(names);
    }

    /// Rejects parameters that were neither requested nor ignored.
    pub(super) fn finish(&self) -> Result<(), LoadError> {
        let written = self.parameters.iter().filter(|p| !p.is_default);
        match self.requested.borrow().unknown(written, &self.describe()) {
            Some((unknown, message)) => Err(unknown.at.error(message)),
            None => Ok(()),
        }
    }

    /// Returns a parameter, which must have one of the given types.
    fn values(
        &self,
        name: &'static str,
        kinds: &[&str],
    ) -> Result<Option<&ParsedParameter>, LoadError> {
        let Some(parameter) = self.find(name) else { return Ok(None) };
        if kinds.contains(&parameter.kind) {
            return Ok(Some(parameter));
        }
        let ParsedParameter { kind, at, .. } = parameter;
        Err(at.error(format!("found {} of the type {kind}, expected {}", quote(name), kinds[0])))
    }

    fn numbers_of(&self, name: &'static str, kinds: &[&str]) -> Result<Option<&[f64]>, LoadError> {
        let Some(parameter) = self.values(name, kinds)? else { return Ok(None) };
        match &parameter.values {
            ParameterValues::Numbers(numbers) => Ok(Some(numbers)),
            ParameterValues::Texts(texts) if texts.iter().all(|text| number(text).is_ok()) => {
                Err(parameter.in_quotes("numbers", &texts[0]))
            }
            _ => Err(parameter.at.error(format!(
                "found values of {} that are not numbers, expected numbers",
                quote(name)
            ))),
        }
    }

    /// Returns the only value of a parameter.
    fn one<T: Copy>(&self, name: &str, values: &[T]) -> Result<T, LoadError> {
        if let [value] = values {
            return Ok(*value);
        }
        let message = format!("expected one value for {}, found {}", quote(name), values.len());
        Err(self.refuse(name, message))
    }

    pub(super) fn given_float(&self, name: &'static str) -> Result<Option<f64>, LoadError> {
        self.numbers_of(name, &["float"])?.map(|numbers| self.one(name, numbers)).transpose()
    }

    pub(super) fn float(&self, name: &'static str, default: f64) -> Result<f64, LoadError> {
        Ok(self.given_float(name)?.unwrap_or(default))
    }

    /// Returns a number above 0.
    pub(super) fn positive(&self, name: &'static str, default: f64) -> Result<f64, LoadError> {
        let x = self.float(name, default)?;
        above_zero(name, x).map_err(|message| self.refuse(name, message))
    }

    /// Returns a number of at least 0.
    pub(super) fn not_negative(&self, name: &'static str, default: f64) -> Result<f64, LoadError> {
        let x = self.float(name, default)?;
        if x >= 0.0 {
            return Ok(x);
        }
        Err(self
            .refuse(name, format!("found {} = {x}, expected a number of at least 0", quote(name))))
    }

    /// Returns an integer from `least` to `most`.
    pub(super) fn count(
        &self,
        name: &'static str,
        default: u32,
        [least, most]: [u32; 2],
    ) -> Result<u32, LoadError> {
        let Some(numbers) = self.numbers_of(name, &["integer"])? else { return Ok(default) };
        let x = self.one(name, numbers)?;
        if x.fract() == 0.0 && (f64::from(least)..=f64::from(most)).contains(&x) {
            return Ok(x as u32);
        }
        let message =
            format!("found {} = {x}, expected a whole number from {least} to {most}", quote(name));
        Err(self.refuse(name, message))
    }

    pub(super) fn boolean(&self, name: &'static str, default: bool) -> Result<bool, LoadError> {
        let Some(parameter) = self.values(name, &["bool"])? else { return Ok(default) };
        match &parameter.values {
            ParameterValues::Booleans(values) => self.one(name, values),
            ParameterValues::Texts(texts) if matches!(texts.as_slice(), [text] if is_boolean(text)) => {
                Err(parameter.in_quotes("true and false", &texts[0]))
            }
            _ => Err(parameter.at.error(format!(
                "found a value of {} that is not a boolean, expected true or false",
                quote(name)
            ))),
        }
    }

    pub(super) fn texts(&self, name: &'static str) -> Result<Option<&[String]>, LoadError> {
        let Some(parameter) = self.values(name, &["string"])? else { return Ok(None) };
        match &parameter.values {
            ParameterValues::Texts(texts) => Ok(Some(texts)),
            _ => Err(parameter.at.error(format!(
                "found values of {} without quotes, expected texts in quotes",
                quote(name)
            ))),
        }
    }

    pub(super) fn text(&self, name: &'static str) -> Result<Option<&str>, LoadError> {
        match self.texts(name)? {
            None => Ok(None),
            Some([text]) => Ok(Some(text)),
            Some(texts) => {
                let message =
                    format!("expected one text for {}, found {}", quote(name), texts.len());
                Err(self.refuse(name, message))
            }
        }
    }

    /// Returns the name of the texture of a parameter, if it is a texture.
    pub(super) fn texture_name(&self, name: &'static str) -> Result<Option<&str>, LoadError> {
        let Some(parameter) = self.find(name).filter(|p| p.kind == "texture") else {
            return Ok(None);
        };
        match &parameter.values {
            ParameterValues::Texts(texts) if texts.len() == 1 => Ok(Some(&texts[0])),
            _ => Err(parameter
                .at
                .error(format!("expected the name of one texture for {}", quote(name)))),
        }
    }

    /// Returns a list of numbers.
    pub(super) fn floats(&self, name: &'static str) -> Result<Option<&[f64]>, LoadError> {
        self.numbers_of(name, &["float"])
    }

    /// Returns a list of integers, each at least 0 and below `end`.
    pub(super) fn indices(
        &self,
        name: &'static str,
        end: usize,
    ) -> Result<Option<Vec<u32>>, LoadError> {
        let Some(numbers) = self.numbers_of(name, &["integer"])? else { return Ok(None) };
        let index = |x: &f64| {
            if x.fract() == 0.0 && 0.0 <= *x && *x < end as f64 && *x <= f64::from(u32::MAX) {
                return Ok(*x as u32);
            }
            let message = format!(
                "found the number {x} in {}, expected whole numbers from 0 on and below {end}",
                quote(name)
            );
            Err(self.refuse(name, message))
        };
        numbers.iter().map(index).collect::<Result<_, _>>().map(Some)
    }

    /// Returns a list of points or directions of `N` numbers each.
    fn tuples<const N: usize>(
        &self,
        name: &'static str,
        kinds: &[&str],
    ) -> Result<Option<Vec<[f64; N]>>, LoadError> {
        let Some(numbers) = self.numbers_of(name, kinds)? else { return Ok(None) };
        let (tuples, rest) = numbers.as_chunks::<N>();
        if rest.is_empty() {
            return Ok(Some(tuples.to_vec()));
        }
        let message =
            format!("{} has {} numbers; expected {N} for each of them", quote(name), numbers.len());
        Err(self.refuse(name, message))
    }

    /// Returns a list of points in space.
    pub(super) fn points(&self, name: &'static str) -> Result<Option<Vec<[f64; 3]>>, LoadError> {
        self.tuples(name, &["point3", "point"])
    }

    /// Returns a list of points in the plane.
    pub(super) fn points2(&self, name: &'static str) -> Result<Option<Vec<[f64; 2]>>, LoadError> {
        self.tuples(name, &["point2"])
    }

    /// Returns a list of colours, uninterpreted.
    pub(super) fn rgbs(&self, name: &'static str) -> Result<Option<Vec<[f64; 3]>>, LoadError> {
        self.tuples(name, &["rgb"])
    }

    /// Returns a list of normals.
    pub(super) fn normals(&self, name: &'static str) -> Result<Option<Vec<[f64; 3]>>, LoadError> {
        self.tuples(name, &["normal", "normal3"])
    }

    /// Returns a point in space.
    pub(super) fn point(&self, name: &'static str) -> Result<Option<DVec3>, LoadError> {
        let Some(points) = self.points(name)? else { return Ok(None) };
        self.one(name, &points).map(|p| Some(DVec3::from_array(p)))
    }

    /// Returns a direction.
    pub(super) fn vector(&self, name: &'static str) -> Result<Option<DVec3>, LoadError> {
        let Some(vectors) = self.tuples(name, &["vector3", "vector"])? else { return Ok(None) };
        self.one(name, &vectors).map(|v| Some(DVec3::from_array(v)))
    }

    /// Returns a colour or spectrum, uninterpreted.
    pub(super) fn spectrum(
        &self,
        name: &'static str,
    ) -> Result<Option<&ParsedParameter>, LoadError> {
        match self.find(name) {
            Some(p) if p.kind == "texture" => Err(p.at.error(format!(
                "found a texture for {} of {}, which is not supported; give an rgb or a spectrum",
                quote(name),
                self.describe()
            ))),
            _ => self.values(name, &["rgb", "spectrum", "blackbody"]),
        }
    }
}
