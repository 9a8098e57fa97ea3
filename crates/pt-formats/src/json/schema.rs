//! The JSON schema of scene files, made of the descriptions by which they are read.

use serde_json::{Map, Value, json};

use super::codec::FieldCodec;
use super::node::TYPE;
use super::printer::Out;
use super::shared::JsonWriter;

/// Definitions that several places refer to.
#[derive(Default)]
pub(super) struct Schemas {
    definitions: Map<String, Value>,
}

impl Schemas {
    /// A reference to the definition of this name, which is made once; it may refer to itself.
    pub(super) fn define(&mut self, name: &str, make: impl FnOnce(&mut Self) -> Value) -> Value {
        if !self.definitions.contains_key(name) {
            self.definitions.insert(name.to_owned(), Value::Null);
            let made = make(self);
            self.definitions.insert(name.to_owned(), made);
        }
        json!({"$ref": format!("#/$defs/{name}")})
    }
}

/// The schema of files whose outermost object is as told.
pub(super) fn of(make: impl FnOnce(&mut Schemas) -> Value) -> String {
    let mut schemas = Schemas::default();
    let mut schema = make(&mut schemas);
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    schema["title"] = "A scene of pathtracer".into();
    schema["$defs"] = schemas.definitions.into();
    format!("{schema:#}\n")
}

/// Keys that an object may have, and those that it must have.
#[derive(Clone, Default)]
pub(super) struct Properties {
    properties: Map<String, Value>,
    required: Vec<String>,
}

impl Properties {
    /// Those of an object of this "type".
    pub(super) fn tag(name: &str) -> Self {
        Self::default().with_schema(TYPE, json!({"const": name}), true)
    }

    /// With the field of a type, of which `_field` says no more than which it is.
    pub(super) fn with<T, K: FieldCodec<T>, S>(
        self,
        name: &str,
        kind: &K,
        _field: fn(&S) -> &T,
        default: Option<T>,
        schemas: &mut Schemas,
    ) -> Self {
        if !K::IS_WRITTEN {
            return self;
        }
        let mut schema = kind.schema(schemas);
        let is_required = default.is_none() && K::IS_NEEDED;
        let written = default.and_then(|value| kind.write(&value, &mut JsonWriter::default()).ok());
        if let Some(default) = written.filter(|default| *default != Out::Null) {
            schema["default"] = serde_json::from_str(&default.print()).unwrap_or_default();
        }
        self.with_schema(name, schema, is_required)
    }

    /// With a key of this schema.
    pub(super) fn with_schema(mut self, name: &str, schema: Value, is_required: bool) -> Self {
        self.properties.insert(name.to_owned(), schema);
        if is_required {
            self.required.push(name.to_owned());
        }
        self
    }

    /// Each of some with the keys of another.
    pub(super) fn each_with(all: Vec<Self>, more: &Self) -> Vec<Self> {
        let with = |mut one: Self| {
            one.properties.extend(more.properties.clone());
            one.required.extend(more.required.clone());
            one
        };
        all.into_iter().map(with).collect()
    }

    /// An object that has one of these sets of keys, and no others; or a text that is enough as its
    /// "type".
    pub(super) fn any_of(all: &[Self], is_tagged: bool) -> Value {
        let mut schemas: Vec<_> = all.iter().map(Self::object).collect();
        let words: Vec<_> = all.iter().filter_map(Self::word).collect();
        if is_tagged && !words.is_empty() {
            schemas.insert(0, json!({"enum": words}));
        }
        match schemas.as_mut_slice() {
            [one] => one.take(),
            _ => json!({"anyOf": schemas}),
        }
    }

    fn object(&self) -> Value {
        let Self { properties, required } = self;
        json!({
            "type": "object", "properties": properties, "required": required, "additionalProperties": false
        })
    }

    /// The "type" where nothing else is required.
    fn word(&self) -> Option<&Value> {
        let tag = &self.properties.get(TYPE)?["const"];
        (self.required.as_slice() == [TYPE]).then_some(tag)
    }
}
