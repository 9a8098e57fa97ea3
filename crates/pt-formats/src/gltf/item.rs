//! JSON objects with their paths in the file, for error messages.

use std::ops::RangeInclusive;
use std::path::Path;

use pt_scene::Span;
use serde_json::{Map, Value};

use crate::LoadError;
use crate::shared::names::quote;

/// An object, such as `{"mesh": 3}`, and its path in the file, such as `nodes[2]`.
#[derive(Clone, Debug)]
pub(super) struct Item<'a> {
    fields: &'a Map<String, Value>,
    path: String,
    file: &'a Path,
}

impl<'a> Item<'a> {
    /// Returns the root object of a file.
    ///
    /// # Errors
    /// If the value is not an object.
    pub(super) fn root(value: &'a Value, file: &'a Path) -> Result<Self, LoadError> {
        object(value, String::new(), file)
    }

    /// Location of this object, for messages.
    pub(super) fn span(&self) -> Span {
        span(self.file, self.path.clone())
    }

    /// Location of a field, for messages.
    pub(super) fn span_of(&self, field: &str) -> Span {
        span(self.file, self.path_of(field))
    }

    /// Returns an error at this object.
    pub(super) fn error(&self, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.span(), message: message.into() }
    }

    /// Returns an error at a field.
    pub(super) fn refuse(&self, field: &str, message: impl Into<String>) -> LoadError {
        LoadError::Content { at: self.span_of(field), message: message.into() }
    }

    /// Returns true if the object has this field.
    pub(super) fn has(&self, field: &str) -> bool {
        self.fields.contains_key(field)
    }

    /// Returns the names of all fields.
    pub(super) fn names(&self) -> impl Iterator<Item = &'a str> {
        self.fields.keys().map(String::as_str)
    }

    /// Returns the fields except those with the given names.
    pub(super) fn without(&self, names: &[&str]) -> Map<String, Value> {
        let mut fields = self.fields.clone();
        fields.retain(|name, _| !names.contains(&name.as_str()));
        fields
    }

    /// Returns the value of the field `name`, or the path if there is none.
    pub(super) fn name(&self) -> String {
        let given = self.fields.get("name").and_then(Value::as_str).filter(|name| !name.is_empty());
        given.map_or_else(|| self.path.clone(), str::to_owned)
    }

    /// Returns a field that is an object.
    pub(super) fn child(&self, field: &str) -> Result<Option<Self>, LoadError> {
        let found = self.fields.get(field);
        found.map(|value| object(value, self.path_of(field), self.file)).transpose()
    }

    /// Returns the object of an extension.
    pub(super) fn extension(&self, name: &str) -> Result<Option<Self>, LoadError> {
        self.child("extensions")?.map_or(Ok(None), |extensions| extensions.child(name))
    }

    /// Returns the objects of an array; empty if it is missing.
    pub(super) fn children(&self, field: &str) -> Result<Vec<Self>, LoadError> {
        let all = self.list(field)?.iter().enumerate();
        all.map(|(i, value)| object(value, self.path_at(field, i), self.file)).collect()
    }

    /// Returns the length of an array; 0 if it is missing.
    pub(super) fn count(&self, field: &str) -> Result<usize, LoadError> {
        Ok(self.list(field)?.len())
    }

    /// Returns the object of an array to which field `by` of `from` refers.
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
                "found index {index}, expected an index into {}, which has {} entries",
                self.path_of(list),
                all.len()
            );
            return Err(from.refuse(by, message));
        };
        object(value, self.path_at(list, index), self.file)
    }

    /// Returns a finite number.
    pub(super) fn number(&self, field: &str) -> Result<Option<f64>, LoadError> {
        let read = |value: &Value| {
            let number = value.as_f64().filter(|x| x.is_finite());
            number.ok_or_else(|| self.unexpected(field, value, "a finite number"))
        };
        self.fields.get(field).map(read).transpose()
    }

    /// Returns a number in a range, or a default.
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

    /// Returns an array of `N` finite numbers.
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

    /// Returns a colour with channels from 0 to `highest`, or a default.
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

    /// Returns an array of finite numbers of any length; empty if it is missing.
    pub(super) fn numbers(&self, field: &str) -> Result<Vec<f64>, LoadError> {
        let number = |value: &Value| {
            let number = value.as_f64().filter(|x| x.is_finite());
            number.ok_or_else(|| self.unexpected(field, value, "finite numbers"))
        };
        self.list(field)?.iter().map(number).collect()
    }

    /// Returns a non-negative integer: an index, a size or a code.
    pub(super) fn whole(&self, field: &str) -> Result<Option<usize>, LoadError> {
        let read = |value: &Value| {
            whole(value).ok_or_else(|| self.unexpected(field, value, "a whole number from 0 up"))
        };
        self.fields.get(field).map(read).transpose()
    }

    /// Like [`Self::whole`], for a required field.
    pub(super) fn needed(&self, field: &str) -> Result<usize, LoadError> {
        self.whole(field)?.ok_or_else(|| self.error(format!("missing \"{field}\"")))
    }

    /// Returns an array of non-negative integers; empty if it is missing.
    pub(super) fn wholes(&self, field: &str) -> Result<Vec<usize>, LoadError> {
        let read = |value: &Value| {
            whole(value).ok_or_else(|| self.unexpected(field, value, "whole numbers from 0 up"))
        };
        self.list(field)?.iter().map(read).collect()
    }

    /// Returns a string.
    pub(super) fn text(&self, field: &str) -> Result<Option<&'a str>, LoadError> {
        let read = |value: &'a Value| {
            value.as_str().ok_or_else(|| self.unexpected(field, value, "a text"))
        };
        self.fields.get(field).map(read).transpose()
    }

    /// Returns an array of strings; empty if it is missing.
    pub(super) fn texts(&self, field: &str) -> Result<Vec<&'a str>, LoadError> {
        let read =
            |value: &'a Value| value.as_str().ok_or_else(|| self.unexpected(field, value, "texts"));
        self.list(field)?.iter().map(read).collect()
    }

    /// Returns a boolean; false if it is missing.
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

/// Returns a non-negative integer. Some exporters write 3.0 for 3.
fn whole(value: &Value) -> Option<usize> {
    const LARGEST: f64 = 9_007_199_254_740_992.0; // 2⁵³: up to here all whole numbers are exact
    let whole = match value.as_u64() {
        Some(whole) => whole,
        None => value.as_f64().filter(|x| (0.0..=LARGEST).contains(x) && x.fract() == 0.0)? as u64,
    };
    usize::try_from(whole).ok()
}

/// Describes a value briefly, for messages.
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
