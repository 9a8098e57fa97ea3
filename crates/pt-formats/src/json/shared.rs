//! Items that are referred to by name: tables of meshes, points, images, textures, grids, profiles,
//! measurements and motions; and materials and media, which have indices in a scene.

use std::collections::HashMap;
use std::sync::Arc;

use serde_json::{Value, json};

use super::codec::{FieldCodec, JsonCodec};
use super::node::{JsonNode, ObjectKeys};
use super::printer::Out;
use super::schema::Schemas;
use crate::LoadError;
use crate::json::context::{EntryTables, JsonReader, JsonWriter};

/// Types whose values are entries of a table, referred to by name, or inline.
pub(super) trait TableEntry: Sized {
    /// Key of the table, and term for one of its entries.
    const TABLE: (&'static str, &'static str);

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>>;
    /// Called with all entries of the table before the first one is read.
    fn look_ahead(_entries: &[(&str, JsonNode<'_>)], _cx: &JsonReader<'_>) {}
    /// Reads an entry, or an inline value.
    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError>;
    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String>;
    fn schema_of_entry(schemas: &mut Schemas) -> Value;
    /// Returns the preferred name.
    fn name(&self) -> &str {
        Self::TABLE.1
    }
}

impl<T: TableEntry> JsonCodec for Arc<T> {
    fn read(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Self, LoadError> {
        let Some(name) = node.text() else {
            cx.key.clear();
            return T::read_entry(node, cx);
        };
        if let Some(found) = T::table(&mut cx.tables).get(name) {
            return Ok(Arc::clone(found));
        }
        let table = std::mem::take(T::table(&mut cx.tables));
        let error = cx.unknown(node, T::TABLE, name, &table);
        *T::table(&mut cx.tables) = table;
        Err(error)
    }

    fn write(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        if cx.is_inline {
            return self.write_entry(cx);
        }
        let (table, _) = T::TABLE;
        let place = (table, Arc::as_ptr(self) as usize);
        if let Some(name) = cx.names.get(&place) {
            return Ok(Out::text(name));
        }
        let name = cx.taken.entry(table).or_default().name(self.name(), T::TABLE.1);
        let around = std::mem::replace(&mut cx.key, name.clone());
        let entry = self.write_entry(cx).map_err(|e| format!("{table}.{name}: {e}"))?;
        cx.key = around;
        cx.tables.entry(table).or_default().push((name.clone(), entry));
        cx.names.insert(place, name.clone());
        Ok(Out::Text(name))
    }

    fn schema(schemas: &mut Schemas) -> Value {
        json!({"anyOf": [{"type": "string"}, T::schema_of_entry(schemas)]})
    }
}

/// Reads a table; entries may refer to previous ones.
pub(super) fn read_table<T: TableEntry>(
    root: &mut ObjectKeys<'_>,
    cx: &mut JsonReader<'_>,
) -> Result<(), LoadError> {
    let Some(node) = root.take(T::TABLE.0) else { return Ok(()) };
    let entries = node.entries()?;
    T::look_ahead(&entries, cx);
    for (name, node) in entries {
        name.clone_into(&mut cx.key);
        let read = T::read_entry(&node, cx);
        match cx.context.ok_or_report(read)? {
            Some(entry) => drop(T::table(&mut cx.tables).insert(name.to_owned(), entry)),
            None => cx.fail(T::TABLE.0, name),
        }
    }
    Ok(())
}

/// Codec of the name of an entry, whose default is the key of the entry.
pub(super) struct EntryName;

impl FieldCodec<String> for EntryName {
    const IS_NEEDED: bool = false;

    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<String, LoadError> {
        String::read(node, cx)
    }

    fn write(&self, value: &String, _: &mut JsonWriter<'_>) -> Result<Out, String> {
        Ok(Out::text(value))
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        json!({"type": "string"})
    }

    fn missing(&self, _: &JsonNode<'_>, cx: &JsonReader<'_>) -> Option<String> {
        Some(cx.key.clone())
    }

    fn is_understood(&self, value: &String, cx: &JsonWriter<'_>) -> bool {
        *value == cx.key
    }
}

/// Codec of a material or a medium, by the name of its entry.
#[derive(Clone, Copy)]
pub(super) enum Numbered {
    Material,
    Medium,
}

impl Numbered {
    fn what(self) -> &'static str {
        match self {
            Self::Material => "material",
            Self::Medium => "medium",
        }
    }
}

impl FieldCodec<Option<u32>> for Numbered {
    fn read(&self, node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Option<u32>, LoadError> {
        if node.value().as_null_keyword().is_some() {
            return Ok(None);
        }
        let (key, table) = match self {
            Self::Material => ("materials", &cx.materials),
            Self::Medium => ("media", &cx.media),
        };
        let what = self.what();
        let name = node.text().ok_or_else(|| node.unexpected(&format!("the name of a {what}")))?;
        let index = table.get(name).copied();
        index.map(Some).ok_or_else(|| cx.unknown(node, (key, what), name, table))
    }

    fn write(&self, value: &Option<u32>, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let Some(index) = *value else { return Ok(Out::Null) };
        let names = match self {
            Self::Material => cx.materials,
            Self::Medium => cx.media,
        };
        let name = names.get(index as usize);
        name.map(Out::text).ok_or_else(|| format!("undefined {} {index}", self.what()))
    }

    fn schema(&self, _: &mut Schemas) -> Value {
        json!({"type": ["string", "null"]})
    }
}
