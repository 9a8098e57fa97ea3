//! The tables of parameters in the user guide: names, types and defaults are those of the schema.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use pt_formats::json_schema;
use serde_json::Value;

use super::schema::ROOT;

/// Beginning of a table of the type that follows, and its end.
const BEGIN: &str = "<!-- parameters: ";
const END: &str = "<!-- end -->";

/// Definitions in the schema that have a type with parameters.
const DEFINITIONS: [&str; 7] =
    ["Surface", "Light", "Camera", "Medium", "Texture", "Phase", "Material"];

/// Parameters of all types of a kind, which the pages describe once: those of all kinds, of
/// textures and of cameras.
const COMMON: [&str; 17] = [
    "type",
    "name",
    "to_world",
    "layout",
    "to_pattern",
    "aperture",
    "far",
    "fit",
    "focal_distance",
    "lens_radius",
    "medium",
    "meter",
    "motion",
    "near",
    "placement",
    "principal_point_offset",
    "shutter",
];

/// Definitions of the schema.
pub(super) struct Schema(pub(super) Value);

impl Schema {
    /// Definition of this name.
    pub(super) fn definition(&self, name: &str) -> &Value {
        &self.0["$defs"][name]
    }

    /// Parameters of a type, from the first definition that has it. A type with several variants
    /// has the parameters of all, and requires those that all require.
    fn variant(&self, name: &str) -> Option<Value> {
        let of = |definition: &str| {
            let variants = self.0["$defs"][definition]["anyOf"].as_array()?.iter().cloned();
            let same = variants.filter(|variant| variant["properties"]["type"]["const"] == name);
            same.reduce(|all, other| merged(all, &other))
        };
        DEFINITIONS.iter().find_map(|definition| of(definition))
    }

    /// Names of the types of a definition.
    fn types(&self, definition: &str) -> BTreeSet<&str> {
        let variants = self.0["$defs"][definition]["anyOf"].as_array().expect("variants");
        variants.iter().filter_map(|v| v["properties"]["type"]["const"].as_str()).collect()
    }
}

/// Variant with the parameters of both.
pub(super) fn merged(mut first: Value, second: &Value) -> Value {
    let required = |variant: &Value| variant["required"].as_array().cloned().unwrap_or_default();
    let mut both = required(&first);
    both.retain(|name| required(second).contains(name));
    first["required"] = Value::Array(both);
    for (name, schema) in second["properties"].as_object().expect("parameters") {
        if first["properties"].get(name).is_none() {
            first["properties"][name] = schema.clone();
        }
    }
    first
}

/// Type of a parameter in words.
fn words(schema: &Value) -> String {
    if let Some(reference) = schema["$ref"].as_str() {
        let name = reference.rsplit('/').next().expect("a name");
        let spaced =
            |c: char| if c.is_uppercase() { format!(" {}", c.to_lowercase()) } else { c.into() };
        return name.chars().map(spaced).collect::<String>().trim().to_owned();
    }
    if let Some(variants) = schema["anyOf"].as_array() {
        let mut all: Vec<String> = Vec::new();
        for word in variants.iter().map(words) {
            if !word.is_empty() && !all.contains(&word) {
                all.push(word);
            }
        }
        let is_color = all.len() == 2 && all[0] != "number" && all[1] == "3 numbers";
        return if is_color { "colour".to_owned() } else { all.join(" or ") };
    }
    if let Some(names) = schema["enum"].as_array() {
        let names: Vec<_> =
            names.iter().map(|name| format!("`{}`", name.as_str().unwrap_or("null"))).collect();
        return names.join(", ");
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => kinds.iter().find_map(|kind| kind.as_str().filter(|k| *k != "null")),
        kind => kind.as_str(),
    };
    match kind.unwrap_or_default() {
        "null" => String::new(),
        "string" => "name".to_owned(),
        "integer" => format!("whole number{}", range(schema)),
        "number" => format!("number{}", range(schema)),
        "array" => list(schema),
        other => other.to_owned(),
    }
}

/// Range of a number.
fn range(schema: &Value) -> String {
    let bound = |key: &str| schema[key].as_f64();
    match (bound("minimum"), bound("exclusiveMinimum"), bound("maximum")) {
        (Some(low), _, Some(high)) => format!(" from {low} to {high}"),
        (Some(low), _, None) => format!(" ≥ {low}"),
        (None, Some(low), Some(high)) => format!(" above {low} up to {high}"),
        (None, Some(low), None) => format!(" > {low}"),
        (None, None, Some(high)) => format!(" ≤ {high}"),
        (None, None, None) => String::new(),
    }
}

fn list(schema: &Value) -> String {
    let (item, count) = (words(&schema["items"]), schema["minItems"].as_u64());
    let count = count.filter(|_| schema["minItems"] == schema["maxItems"]);
    match count {
        Some(n) if item.starts_with("number") => format!("{n} numbers"),
        Some(n) => format!("{n} × {item}"),
        None => format!("list of {item}"),
    }
}

/// Default of a parameter.
fn default(variant: &Value, name: &str) -> String {
    let is_required =
        variant["required"].as_array().is_some_and(|all| all.iter().any(|n| n == name));
    match &variant["properties"][name]["default"] {
        _ if is_required => "required".to_owned(),
        Value::Null => "none".to_owned(),
        Value::String(word) => format!("`{word}`"),
        value => value.to_string().replace(',', ", "),
    }
}

/// Table of the parameters of a type; the column of meanings is kept.
fn table(variant: &Value, old: &[&str]) -> String {
    let cells =
        |row: &str| row.trim_matches('|').split(" | ").map(|c| c.trim().to_owned()).collect();
    let rows: Vec<Vec<String>> = old.iter().skip(2).map(|row| cells(row)).collect();
    let described: Vec<&str> = rows.iter().map(|row| row[0].trim_matches('`')).collect();
    let properties = variant["properties"].as_object().expect("parameters");
    let known = described.iter().copied().filter(|name| properties.contains_key(*name));
    let set: BTreeSet<_> = described.iter().copied().collect();
    let new = properties.keys().map(String::as_str);
    let new = new.filter(|name| !COMMON.contains(name) && !set.contains(name));
    let line = |name: &str| {
        let row = rows.iter().find(|row| row[0].trim_matches('`') == name);
        let meaning = row.and_then(|row| row.get(3)).map_or("", String::as_str);
        let (kind, default) = (words(&properties[name]), default(variant, name));
        format!("| `{name}` | {kind} | {default} | {meaning} |\n")
    };
    let head = "| parameter | type | default | meaning |\n|---|---|---|---|\n";
    head.to_owned() + &known.chain(new).map(line).collect::<String>()
}

/// A page with its tables as the schema has them.
fn generated(text: &str, schema: &Schema, path: &Path) -> String {
    let mut page = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once(BEGIN) {
        let (name, after) = after.split_once(" -->\n").expect("a name");
        let (old, after) = after.split_once(END).expect("an end");
        let variant = schema.variant(name);
        let variant = variant.unwrap_or_else(|| panic!("{}: no type {name}", path.display()));
        let rows: Vec<_> = old.lines().collect();
        page.extend([before, BEGIN, name, " -->\n", &table(&variant, &rows), END]);
        rest = after;
    }
    page + rest
}

pub(super) fn pages(folder: &Path, all: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a readable folder") {
        let path = entry.expect("a readable entry").path();
        if path.is_dir() {
            pages(&path, all);
        } else if path.extension().is_some_and(|ending| ending == "md") {
            all.push(path);
        }
    }
}

fn schema() -> Schema {
    Schema(serde_json::from_str(&json_schema()).expect("the schema is JSON"))
}

/// Each type has a table of its parameters on some page. Phase functions, which have at most a few,
/// have a row of a common table instead.
#[test]
fn all_types_are_described() {
    let mut paths = Vec::new();
    pages(&Path::new(ROOT).join("docs"), &mut paths);
    let texts: Vec<_> =
        paths.iter().map(|path| fs::read_to_string(path).expect("a readable page")).collect();
    let schema = schema();
    let mut missing = Vec::new();
    for definition in DEFINITIONS {
        let types = schema.types(definition);
        assert!(!types.is_empty(), "{definition} has no types");
        for name in types {
            let mark = if definition == "Phase" {
                format!("\n| `{name}` | ")
            } else {
                format!("{BEGIN}{name} -->\n")
            };
            if !texts.iter().any(|text| text.contains(&mark)) {
                missing.push(format!("{definition} {name}: no page has {mark:?}"));
            }
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

/// `PT_WRITE_GENERATED=1` writes them anew; the meanings of new parameters are then to be filled
/// in.
#[test]
fn tables_of_parameters_are_those_of_the_schema() {
    let schema = schema();
    let mut all = Vec::new();
    pages(&Path::new(ROOT).join("docs"), &mut all);
    let mut tables = 0;
    for path in all {
        let text = fs::read_to_string(&path).expect("a readable page");
        let expected = generated(&text, &schema, &path);
        tables += text.matches(BEGIN).count();
        if std::env::var_os("PT_WRITE_GENERATED").is_some() && text != expected {
            fs::write(&path, &expected).expect("a writable folder");
        } else {
            assert_eq!(text, expected, "{}", path.display());
        }
        let lacks_meaning = expected.lines().find(|line| line.ends_with("|  |"));
        assert_eq!(lacks_meaning, None, "{}: fill in the meaning", path.display());
    }
    assert!(tables > 40, "{tables} tables");
}
