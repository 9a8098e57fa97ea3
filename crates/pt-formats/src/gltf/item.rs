//! Objects of a JSON text, which know where they stand, so that errors can say so.

use std::ops::RangeInclusive;
use std::path::Path;

use serde_json::{Map, Value};

use super::super::xml::quote;
use crate::{LoadError, Span};

/// An object, such as `{"mesh": 3}`, and its path in the file, such as `nodes[2]`.
#[derive(Clone, Debug)]
pub(super) struct Item<'a> {
    fields: &'a Map<String, Value>,
    path: String,
    file: &'a Path,
}

impl<'a> Item<'a> {
    /// The outermost object of a file.
    ///
    /// # Errors
    /// If the text is something else.
    pub(super) fn root(value: &'a Value, file: &'a Path) -> Result<Self, LoadError> {
        object(value, String::new(), file)
    }

    /// Where it stands, for messages.
    pub(super) fn span(&self) -> Span {
        span(self.file, self.path.clone())
    }

    /// Where one of its fields stands.
    pub(super) fn span_of(&self, field: &str) -> Span {
        span(self.file, self.path_of(field))
    }

    /// An error about the whole of it.
    pub(super) fn error(&self, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.span(), message: message.into() }
    }

    /// An error about one of its fields.
    pub(super) fn refuse(&self, field: &str, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.span_of(field), message: message.into() }
    }

    /// Returns true if there is such a field.
    pub(super) fn has(&self, field: &str) -> bool {
        self.fields.contains_key(field)
    }

    /// The names of its fields.
    pub(super) fn names(&self) -> impl Iterator<Item = &'a str> {
        self.fields.keys().map(String::as_str)
    }

    /// Its fields without some.
    pub(super) fn without(&self, names: &[&str]) -> Map<String, Value> {
        let mut fields = self.fields.clone();
        fields.retain(|name, _| !names.contains(&name.as_str()));
        fields
    }

    /// The name that its author gave it, or else its path.
    pub(super) fn name(&self) -> String {
        let given = self.fields.get("name").and_then(Value::as_str).filter(|name| !name.is_empty());
        given.map_or_else(|| self.path.clone(), str::to_owned)
    }

    /// A field that is an object.
    pub(super) fn child(&self, field: &str) -> Result<Option<Self>, LoadError> {
        let found = self.fields.get(field);
        found.map(|value| object(value, self.path_of(field), self.file)).transpose()
    }

    /// The object of an extension.
    pub(super) fn extension(&self, name: &str) -> Result<Option<Self>, LoadError> {
        self.child("extensions")?.map_or(Ok(None), |extensions| extensions.child(name))
    }

    /// The objects of a list; none if it is missing.
    pub(super) fn children(&self, field: &str) -> Result<Vec<Self>, LoadError> {
        let all = self.list(field)?.iter().enumerate();
        all.map(|(i, value)| object(value, self.path_at(field, i), self.file)).collect()
    }

    /// How long a list is; 0 if it is missing.
    pub(super) fn count(&self, field: &str) -> Result<usize, LoadError> {
        Ok(self.list(field)?.len())
    }

    /// One object of a list, which `from` refers to in its field `by`.
    pub(super) fn member(
        &self,
        list: &str,
        index: usize,
        from: &Item<'_>,
        by: &str,
    ) -> Result<Self, LoadError> {
        let all = self.list(list)?;
        let Some(value) = all.get(index) else {
            let message = format!(
                "{index} is no index into {}, which has {} entries",
                self.path_of(list),
                all.len()
            );
            return Err(from.refuse(by, message));
        };
        object(value, self.path_at(list, index), self.file)
    }

    /// A finite number.
    pub(super) fn number(&self, field: &str) -> Result<Option<f64>, LoadError> {
        let read = |value: &Value| {
            let number = value.as_f64().filter(|x| x.is_finite());
            number.ok_or_else(|| self.unexpected(field, value, "a finite number"))
        };
        self.fields.get(field).map(read).transpose()
    }

    /// A number in a range, or a default.
    pub(super) fn number_in(
        &self,
        field: &str,
        range: RangeInclusive<f64>,
        default: f64,
    ) -> Result<f64, LoadError> {
        let Some(number) = self.number(field)? else { return Ok(default) };
        if range.contains(&number) {
            return Ok(number);
        }
        let (from, to) = (range.start(), range.end());
        let expected = if *to >= f64::from(f32::MAX) {
            format!("of at least {from}")
        } else {
            format!("from {from} to {to}")
        };
        Err(self.refuse(field, format!("expected a number {expected}, found {number}")))
    }

    /// A list of `N` finite numbers.
    pub(super) fn vector<const N: usize>(
        &self,
        field: &str,
    ) -> Result<Option<[f64; N]>, LoadError> {
        let Some(value) = self.fields.get(field) else { return Ok(None) };
        let expected = format!("{N} finite numbers");
        let wrong = || self.unexpected(field, value, &expected);
        let list = value.as_array().filter(|list| list.len() == N).ok_or_else(wrong)?;
        let mut vector = [0.0; N];
        for (number, value) in vector.iter_mut().zip(list) {
            *number = value.as_f64().filter(|x| x.is_finite()).ok_or_else(wrong)?;
        }
        Ok(Some(vector))
    }

    /// A colour with channels from 0 to the highest one that is allowed, or a default.
    pub(super) fn color(
        &self,
        field: &str,
        highest: f64,
        default: [f32; 3],
    ) -> Result<[f32; 3], LoadError> {
        let Some(color) = self.vector::<3>(field)? else { return Ok(default) };
        if let Some(bad) = color.iter().find(|c| !(0.0..=highest).contains(*c)) {
            let most = if highest < f64::from(f32::MAX) {
                format!(" to {highest}")
            } else {
                String::new()
            };
            return Err(self.refuse(field, format!("expected channels from 0{most}, found {bad}")));
        }
        Ok(color.map(|c| c as f32))
    }

    /// Finite numbers, as many as there are; none if the list is missing.
    pub(super) fn numbers(&self, field: &str) -> Result<Vec<f64>, LoadError> {
        let number = |value: &Value| {
            let number = value.as_f64().filter(|x| x.is_finite());
            number.ok_or_else(|| self.unexpected(field, value, "finite numbers"))
        };
        self.list(field)?.iter().map(number).collect()
    }

    /// A whole number from 0 up: an index, a size or a code.
    pub(super) fn whole(&self, field: &str) -> Result<Option<usize>, LoadError> {
        let read = |value: &Value| {
            whole(value).ok_or_else(|| self.unexpected(field, value, "a whole number from 0 up"))
        };
        self.fields.get(field).map(read).transpose()
    }

    /// Like [`Self::whole`], of a field that has to be there.
    pub(super) fn needed(&self, field: &str) -> Result<usize, LoadError> {
        self.whole(field)?.ok_or_else(|| self.error(format!("its \"{field}\" is missing")))
    }

    /// Whole numbers from 0 up; none if the list is missing.
    pub(super) fn wholes(&self, field: &str) -> Result<Vec<usize>, LoadError> {
        let read = |value: &Value| {
            whole(value).ok_or_else(|| self.unexpected(field, value, "whole numbers from 0 up"))
        };
        self.list(field)?.iter().map(read).collect()
    }

    /// A text.
    pub(super) fn text(&self, field: &str) -> Result<Option<&'a str>, LoadError> {
        let read = |value: &'a Value| {
            value.as_str().ok_or_else(|| self.unexpected(field, value, "a text"))
        };
        self.fields.get(field).map(read).transpose()
    }

    /// Texts; none if the list is missing.
    pub(super) fn texts(&self, field: &str) -> Result<Vec<&'a str>, LoadError> {
        let read =
            |value: &'a Value| value.as_str().ok_or_else(|| self.unexpected(field, value, "texts"));
        self.list(field)?.iter().map(read).collect()
    }

    /// True or false; false if it is missing.
    pub(super) fn flag(&self, field: &str) -> Result<bool, LoadError> {
        let Some(value) = self.fields.get(field) else { return Ok(false) };
        value.as_bool().ok_or_else(|| self.unexpected(field, value, "true or false"))
    }

    fn list(&self, field: &str) -> Result<&'a [Value], LoadError> {
        let Some(value) = self.fields.get(field) else { return Ok(&[]) };
        let list = value.as_array().map(Vec::as_slice);
        list.ok_or_else(|| self.unexpected(field, value, "a list"))
    }

    fn unexpected(&self, field: &str, found: &Value, expected: &str) -> LoadError {
        self.refuse(field, format!("expected {expected}, found {}", described(found)))
    }

    fn path_of(&self, field: &str) -> String {
        if self.path.is_empty() { field.to_owned() } else { format!("{}.{field}", self.path) }
    }

    fn path_at(&self, field: &str, index: usize) -> String {
        format!("{}[{index}]", self.path_of(field))
    }
}

fn span(file: &Path, element: String) -> Span {
    Span { file: file.to_owned(), element, ..Span::default() }
}

fn object<'a>(value: &'a Value, path: String, file: &'a Path) -> Result<Item<'a>, LoadError> {
    match value {
        Value::Object(fields) => Ok(Item { fields, path, file }),
        other => {
            let message = format!("expected an object {{…}}, found {}", described(other));
            Err(LoadError::Content { at: span(file, path), message })
        }
    }
}

/// Exporters write 3.0 for 3.
fn whole(value: &Value) -> Option<usize> {
    const LARGEST: f64 = 9_007_199_254_740_992.0; // 2⁵³: up to here all whole numbers are exact
    let whole = match value.as_u64() {
        Some(whole) => whole,
        None => value.as_f64().filter(|x| (0.0..=LARGEST).contains(x) && x.fract() == 0.0)? as u64,
    };
    usize::try_from(whole).ok()
}

/// A value in a few words.
fn described(value: &Value) -> String {
    match value {
        Value::Null => "null".to_owned(),
        Value::Bool(flag) => flag.to_string(),
        Value::Number(number) => number.to_string(),
        Value::String(text) => quote(text),
        Value::Array(list) => format!("a list of {}", list.len()),
        Value::Object(_) => "an object".to_owned(),
    }
}
