//! Points and segments: inline, or in files.

use std::collections::HashMap;
use std::sync::Arc;

use pt_scene::{Points, Shared};
use safetensors::SafeTensors;
use serde_json::{Value, json};

use super::super::{obj, ply};
use super::arrays::{self, check_names, corners, decode, encode, missing, points, reals, wholes};
use super::codec::JsonCodec;
use super::context::{EntryTables, JsonReader, JsonWriter};
use super::files::MAX_INLINE;
use super::mesh::{indices, vectors, write_indices, write_vectors};
use super::node::{JsonNode, ObjectKeys};
use super::number::vector_schema;
use super::printer::{Entries, Out};
use super::schema::{Properties, Schemas};
use super::shared::TableEntry;
use crate::LoadError;
use crate::shared::mesh_file;
use crate::shared::names::quote;

/// `{"file": "cloud.ply"}`, or `{"positions": […], "colors": […], "segments": […]}`.
impl TableEntry for Points {
    const TABLE: (&'static str, &'static str) = ("points", "points");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.points
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        let mut keys = node.keys()?;
        let name = keys.take("name").map(|name| String::read(&name, cx)).transpose()?;
        let name = name.or_else(|| Some(cx.key.clone()).filter(|key| !key.is_empty()));
        let Some(file) = keys.take("file") else {
            let made = inline(&mut keys, cx)?;
            keys.finish()?;
            check(&made).map_err(|e| node.error(e))?;
            return Ok(Arc::new(Self { name: name.unwrap_or_default(), ..made }));
        };
        keys.finish()?;
        let known = of_file(&file, cx)?;
        Ok(match name {
            Some(name) if name != known.name => Arc::new(Self { name, ..Self::clone(&known) }),
            _ => known,
        })
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let mut out = Entries::new();
        if self.name != cx.key {
            out.push(("name".to_owned(), Out::text(&self.name)));
        }
        let count = self.positions.len() * if self.colors.is_some() { 6 } else { 3 };
        if !cx.is_in_memory() && count + 2 * self.segments.len() > MAX_INLINE {
            let key = cx.key.clone();
            out.push(("file".to_owned(), cx.file(&key, arrays::ENDING, to_bytes(self)?)));
            return Ok(Out::Object(out));
        }
        out.push(("positions".to_owned(), write_vectors(&self.positions, cx)?));
        if let Some(colors) = &self.colors {
            out.push(("colors".to_owned(), write_vectors(colors, cx)?));
        }
        if !self.segments.is_empty() {
            out.push(("segments".to_owned(), write_indices(&self.segments, cx)?));
        }
        Ok(Out::Object(out))
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        schemas.define("Points", |_| {
            let text = json!({"type": "string"});
            let name = || Properties::default().with_schema("name", text.clone(), false);
            let list = |width: usize, item: &Value| {
                json!({"type": "array", "items": vector_schema(item, width)})
            };
            let (real, whole) = (json!({"type": "number"}), json!({"type": "integer", "minimum": 0}));
            let file = name().with_schema("file", text.clone(), true);
            let inline = name()
                .with_schema("positions", list(3, &real), true)
                .with_schema("colors", list(3, &real), false)
                .with_schema("segments", list(2, &whole), false);
            Properties::any_of(&[file, inline], false)
        })
    }

    fn name(&self) -> &str {
        &self.name
    }
}

/// Reads the points of a file, once per file.
fn of_file(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Points>, LoadError> {
    let path = cx.path(node)?;
    if let Some(known) = cx.files.points.get(&path) {
        return Ok(Arc::clone(known));
    }
    let bytes = cx.read(&path, node)?;
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    let made = match ending.as_str() {
        arrays::ENDING => {
            let made =
                of_bytes(&bytes).map_err(|e| node.error(format!("{}: {e}", path.display())))?;
            Points { name: mesh_file::name_of(&path), ..made }
        }
        "ply" => ply::parse_points(&bytes, &path)?,
        "obj" => obj::parse_points(&bytes, &path)?,
        _ => {
            let message = format!(
                "unknown point format {}; known extensions: .{}, .ply, .obj",
                quote(&ending),
                arrays::ENDING
            );
            return Err(node.error(message));
        }
    };
    cx.account(made.bytes() as usize, node)?;
    let made = Arc::new(made);
    cx.files.points.insert(path, Arc::clone(&made));
    Ok(made)
}

fn inline(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Points, LoadError> {
    let Some(positions) = keys.take("positions") else {
        return Err(keys.node.error("expected \"file\" or \"positions\""));
    };
    let colors = keys.take("colors").map(|node| vectors(&node)).transpose()?.map(Shared::into_vec);
    let segments =
        keys.take("segments").map(|node| indices(&node, cx)).transpose()?.map(Shared::into_vec);
    Ok(Points {
        name: String::new(),
        positions: vectors(&positions)?.into_vec(),
        colors,
        segments: segments.unwrap_or_default(),
    })
}

/// Checks the invariants of points.
fn check(points: &Points) -> Result<(), String> {
    let count = points.positions.len();
    if count == 0 {
        return Err("missing \"positions\"".to_owned());
    }
    if let Some(colors) = points.colors.as_ref().filter(|colors| colors.len() != count) {
        return Err(format!(
            "found {} \"colors\" for {count} points, expected the same number",
            colors.len()
        ));
    }
    match points.segments.as_flattened().iter().find(|end| **end as usize >= count) {
        Some(end) => {
            Err(format!("found index {end} in \"segments\", expected an index below {count}"))
        }
        None => Ok(()),
    }
}

fn to_bytes(points: &Points) -> Result<Vec<u8>, String> {
    let mut arrays = vec![reals("positions", &points.positions)];
    arrays.extend(points.colors.as_ref().map(|colors| reals("colors", colors)));
    if !points.segments.is_empty() {
        arrays.push(wholes("segments", &points.segments));
    }
    encode(&arrays)
}

/// Decodes the points of a file of arrays, without a name.
fn of_bytes(bytes: &[u8]) -> Result<Points, String> {
    let all: SafeTensors<'_> = decode(bytes)?;
    check_names(&all, &["positions", "colors", "segments"], |_| false)?;
    let made = Points {
        name: String::new(),
        positions: points(&all, "positions")?.ok_or_else(|| missing("positions"))?,
        colors: points(&all, "colors")?,
        segments: corners(&all, "segments")?.unwrap_or_default(),
    };
    check(&made)?;
    Ok(made)
}
