//! Values of JSON with comments, with their locations for error messages.

use std::collections::HashSet;
use std::path::Path;

use jsonc_parser::ast::{ObjectProp, Value};
use jsonc_parser::common::{Range, Ranged};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use pt_scene::Span;

use super::attached::Attachments;
use super::former_names::former_key;
use crate::LoadError;
use crate::shared::names::{quote, suggestions};
use crate::shared::source_map::SourceMap;

/// Maximum nesting of values.
const MAX_DEPTH: u32 = 100;

/// JSON with `//` and `/* */` comments, and no other extensions.
const OPTIONS: ParseOptions = ParseOptions {
    allow_comments: true,
    allow_loose_object_property_names: false,
    allow_trailing_commas: false,
    allow_missing_commas: false,
    allow_single_quoted_strings: false,
    allow_hexadecimal_numbers: false,
    allow_unary_plus_numbers: false,
    allow_bare_decimal_point_numbers: false,
    allow_non_finite_numbers: false,
    allow_extended_string_escapes: false,
};

/// Parses a text.
///
/// # Errors
/// Returns an error if it is no valid JSON.
pub(super) fn parse<'a>(text: &'a str, file: &Path) -> Result<Value<'a>, LoadError> {
    let error = |line: usize, column: usize, message: String| {
        let [line, column] = [line, column].map(|n| n as u32);
        let at = Span { file: file.to_owned(), line, column, element: String::new() };
        LoadError::Content { at, message }
    };
    match parse_to_ast(text, &CollectOptions::default(), &OPTIONS) {
        Ok(result) => {
            result.value.ok_or_else(|| error(0, 0, "found an empty file, expected {…}".into()))
        }
        Err(e) => {
            let message = format!("invalid JSON: {}", e.kind());
            Err(error(e.line_display(), e.column_display(), message))
        }
    }
}

/// A text, its file, and what is attached to it.
pub(super) struct JsonDocument<'a> {
    text: &'a str,
    file: &'a Path,
    map: SourceMap,
    pub(super) attachments: Attachments,
}

impl<'a> JsonDocument<'a> {
    pub(super) fn new(text: &'a str, file: &'a Path, attachments: Attachments) -> Self {
        Self { text, file, map: SourceMap::new(text), attachments }
    }

    fn error(&self, range: Range, path: &str, message: String) -> LoadError {
        let (line, column) = self.map.line_and_column(self.text, range.start);
        let file = self.file.to_owned();
        LoadError::Content { at: Span { file, line, column, element: path.to_owned() }, message }
    }
}

/// A value and its path in the file, such as `objects[2].material`.
#[derive(Clone)]
pub(super) struct JsonNode<'a> {
    value: &'a Value<'a>,
    path: String,
    depth: u32,
    document: &'a JsonDocument<'a>,
}

impl<'a> JsonNode<'a> {
    pub(super) fn root(value: &'a Value<'a>, document: &'a JsonDocument<'a>) -> Self {
        Self { value, path: String::new(), depth: 0, document }
    }

    /// Returns the location, without a column.
    pub(super) fn span(&self) -> Span {
        let JsonDocument { text, map, .. } = self.document;
        let (line, _) = map.line_and_column(text, self.value.range().start);
        Span { file: self.document.file.to_owned(), line, column: 0, element: self.path.clone() }
    }

    pub(super) fn error(&self, message: impl Into<String>) -> LoadError {
        self.document.error(self.value.range(), &self.path, message.into())
    }

    /// Returns an error that describes the value found.
    pub(super) fn unexpected(&self, expected: &str) -> LoadError {
        let found = self.described_attachment().unwrap_or_else(|| described(self.value));
        self.error(format!("expected {expected}, found {found}"))
    }

    /// Returns an error about an unknown name.
    pub(super) fn unknown<'c>(
        &self,
        what: &str,
        name: &str,
        known: impl Iterator<Item = &'c str>,
    ) -> LoadError {
        self.error(unknown(what, name, known))
    }

    /// Returns the text to which the value belongs.
    pub(super) fn document(&self) -> &'a JsonDocument<'a> {
        self.document
    }

    pub(super) fn value(&self) -> &'a Value<'a> {
        self.value
    }

    /// Returns the string, or `None` for other values.
    pub(super) fn text(&self) -> Option<&'a str> {
        self.value.as_string_lit().map(|text| &*text.value)
    }

    /// Returns the digits of a number, or `None` for other values.
    pub(super) fn digits(&self) -> Option<&'a str> {
        self.value.as_number_lit().map(|number| number.value)
    }

    /// Returns the items of a list.
    pub(super) fn list(&self, expected: &str) -> Result<Vec<Self>, LoadError> {
        let list = self.value.as_array().ok_or_else(|| self.unexpected(expected))?;
        let children = list.elements.iter().enumerate();
        children.map(|(i, value)| self.child(value, format!("{}[{i}]", self.path))).collect()
    }

    /// Returns the keys and values of an object; keys must be unique.
    pub(super) fn entries(&self) -> Result<Vec<(&'a str, Self)>, LoadError> {
        let object = self.value.as_object().ok_or_else(|| self.unexpected("an object {…}"))?;
        let mut seen = HashSet::new();
        for property in &object.properties {
            if !seen.insert(property.name.as_str()) {
                let message = format!("duplicate key {}", quote(property.name.as_str()));
                return Err(self.document.error(property.range, &self.path, message));
            }
        }
        let properties = object.properties.iter();
        properties.map(|p| Ok((p.name.as_str(), self.child(&p.value, self.path_of(p))?))).collect()
    }

    /// Returns the object as [`ObjectKeys`].
    pub(super) fn keys(&self) -> Result<ObjectKeys<'a>, LoadError> {
        let entries = self.entries()?;
        Ok(ObjectKeys { node: self.clone(), entries, known: Vec::new() })
    }

    /// Returns the keys of an object with only this string as its "type".
    pub(super) fn word(&self) -> ObjectKeys<'a> {
        let entries = vec![(TYPE, self.clone())];
        ObjectKeys { node: self.clone(), entries, known: Vec::new() }
    }

    fn child(&self, value: &'a Value<'a>, path: String) -> Result<Self, LoadError> {
        if self.depth >= MAX_DEPTH {
            return Err(self.error(format!("nesting deeper than {MAX_DEPTH}")));
        }
        Ok(Self { value, path, depth: self.depth + 1, document: self.document })
    }

    fn path_of(&self, property: &ObjectProp<'a>) -> String {
        let name = property.name.as_str();
        let is_plain = |c: char| c.is_alphanumeric() || c == '_';
        match (self.path.as_str(), name.chars().all(is_plain)) {
            ("", true) => name.to_owned(),
            (path, true) => format!("{path}.{name}"),
            (path, false) => format!("{path}[{}]", quote(name)),
        }
    }
}

/// Key of the variant of an enum.
pub(super) const TYPE: &str = "type";

/// Keys of an object, and those that its reader requested.
pub(super) struct ObjectKeys<'a> {
    pub(super) node: JsonNode<'a>,
    pub(super) entries: Vec<(&'a str, JsonNode<'a>)>,
    pub(super) known: Vec<&'static str>,
}

impl<'a> ObjectKeys<'a> {
    /// Returns the value of a key, which may have its former name, if it is there.
    pub(super) fn take(&mut self, name: &'static str) -> Option<JsonNode<'a>> {
        self.known.push(name);
        let value = |name| self.entries.iter().find(|(key, _)| *key == name).map(|(_, node)| node);
        if let Some(node) = value(name) {
            return Some(node.clone());
        }
        let former = former_key(name)?;
        let node = value(former)?.clone();
        self.known.push(former);
        Some(node)
    }

    /// Returns the value of the key "type".
    pub(super) fn tag(&mut self) -> Result<JsonNode<'a>, LoadError> {
        self.take(TYPE).ok_or_else(|| self.node.error(format!("missing {}", quote(TYPE))))
    }

    /// Returns an error if there are keys that were not requested.
    pub(super) fn finish(self) -> Result<(), LoadError> {
        let Some((name, node)) = self.entries.iter().find(|(key, _)| !self.known.contains(key))
        else {
            return Ok(());
        };
        Err(node.unknown("key", name, self.known.iter().copied()))
    }
}

fn unknown<'c>(what: &str, name: &str, known: impl Iterator<Item = &'c str>) -> String {
    const MAX_LISTED: usize = 40;
    let all: Vec<_> = known.collect();
    let meant = match suggestions(name, all.iter().copied()).first() {
        Some(meant) => format!("did you mean {}? ", quote(meant)),
        None => String::new(),
    };
    let listed: Vec<_> = all.iter().take(MAX_LISTED).map(|name| quote(name)).collect();
    let more = if all.len() > MAX_LISTED { " …" } else { "" };
    let listed = if all.is_empty() { "none".to_owned() } else { listed.join(", ") };
    format!("unknown {what} {}; {meant}known: {listed}{more}", quote(name))
}

/// Describes a value in a few words.
fn described(value: &Value<'_>) -> String {
    match value {
        Value::NullKeyword(_) => "null".to_owned(),
        Value::BooleanLit(flag) => flag.value.to_string(),
        Value::NumberLit(number) => number.value.to_owned(),
        Value::StringLit(text) => quote(&text.value),
        Value::Array(list) => format!("a list of {}", list.elements.len()),
        Value::Object(_) => "an object".to_owned(),
    }
}
