//! JSON schema of scene files, derived from the descriptions of their types.

use serde_json::{Map, Value, json};

use super::node::TYPE;

/// Shared definitions.
#[derive(Default)]
pub(super) struct Schemas {
    definitions: Map<String, Value>,
}

impl Schemas {
    /// Returns a reference to the definition of this name, which is created once and may refer to
    /// itself.
    pub(super) fn define(&mut self, name: &str, make: impl FnOnce(&mut Self) -> Value) -> Value {
        if !self.definitions.contains_key(name) {
            self.definitions.insert(name.to_owned(), Value::Null);
            let made = make(self);
            self.definitions.insert(name.to_owned(), made);
        }
        json!({"$ref": format!("#/$defs/{name}")})
    }
}

/// Returns the schema of files whose outermost object has the schema of `make`.
pub(super) fn of(make: impl FnOnce(&mut Schemas) -> Value) -> String {
    let mut schemas = Schemas::default();
    let mut schema = make(&mut schemas);
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    schema["title"] = "A scene of pathtracer".into();
    schema["$defs"] = schemas.definitions.into();
    format!("{schema:#}\n")
}

/// Keys of an object, and which of them are required.
#[derive(Clone, Default)]
pub(super) struct Properties {
    properties: Map<String, Value>,
    required: Vec<String>,
}

impl Properties {
    /// Returns the keys of an object of this "type".
    pub(super) fn tag(name: &str) -> Self {
        Self::default().with_schema(TYPE, json!({"const": name}), true)
    }

    /// Adds a key with this schema.
    pub(super) fn with_schema(mut self, name: &str, schema: Value, is_required: bool) -> Self {
        self.properties.insert(name.to_owned(), schema);
        if is_required {
            self.required.push(name.to_owned());
        }
        self
    }

    /// Adds the keys of `more` to each set.
    pub(super) fn each_with(all: Vec<Self>, more: &Self) -> Vec<Self> {
        let with = |mut one: Self| {
            one.properties.extend(more.properties.clone());
            one.required.extend(more.required.clone());
            one
        };
        all.into_iter().map(with).collect()
    }

    /// Returns the schema of an object with one of these sets of keys, and no others; or of a
    /// string that suffices as its "type".
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

    /// Returns the "type" if nothing else is required.
    fn word(&self) -> Option<&Value> {
        let tag = &self.properties.get(TYPE)?["const"];
        (self.required.as_slice() == [TYPE]).then_some(tag)
    }
}
