//! The classes of the Python module `pathtracer.build`: they are those of the schema.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use pt_formats::json_schema;
use serde_json::Value;

use super::pages::{Schema, merged, pages};
use super::python_words::{
    COMMON, MODULES, Module, STRUCTS, alias, python_type, table, title, words,
};
use super::schema::ROOT;

/// Maximum number of columns of a line.
const WIDTH: usize = 100;

/// A class: a type of a definition, or a definition without
struct Class {
    name: String,
    /// Value of "type", if the definition has
    tag: Option<String>,
    definition: &'static str,
    schema: Value,
}

/// Name of a class: `diffuse_transmission` as `DiffuseTransmission`.
fn camel(name: &str) -> String {
    let capital = |word: &str| {
        let mut letters = word.chars();
        letters.next().map(|c| c.to_ascii_uppercase()).into_iter().chain(letters).collect()
    };
    name.split('_').map(capital).collect::<Vec<String>>().concat()
}

/// Classes of a definition of the schema, whose names end in `suffix`.
fn classes(schema: &Schema, definition: &'static str, suffix: &str) -> Vec<Class> {
    let whole = schema.definition(definition);
    let variants = match whole["anyOf"].as_array() {
        Some(variants) => variants.clone(),
        None => vec![whole.clone()],
    };
    let mut all: Vec<Class> = Vec::new();
    for variant in variants.into_iter().filter(|variant| variant["properties"].is_object()) {
        let tag = variant["properties"]["type"]["const"].as_str().map(str::to_owned);
        let has_own_name =
            definition == "Object" && !matches!(tag.as_deref(), Some("mesh" | "points"));
        let name = match &tag {
            Some(tag) if has_own_name => camel(tag),
            Some(tag) => camel(tag) + suffix,
            None if definition == "Step" => step_name(&variant),
            None => suffix.to_owned(),
        };
        match all.iter_mut().find(|class| class.name == name) {
            Some(known) => known.schema = merged(known.schema.take(), &variant),
            None => all.push(Class { name, tag, definition, schema: variant }),
        }
    }
    all
}

/// Name of a step of a transform, by the key that it requires.
fn step_name(variant: &Value) -> String {
    camel(variant["required"][0].as_str().expect("a key"))
}

/// Meanings of the parameters of types, from the tables of the pages.
fn meanings() -> BTreeMap<(String, String), String> {
    let mut paths = Vec::new();
    pages(&Path::new(ROOT).join("docs"), &mut paths);
    let mut all = BTreeMap::new();
    for path in paths {
        let text = fs::read_to_string(path).expect("a readable page");
        for part in text.split("<!-- parameters: ").skip(1) {
            let (name, rest) = part.split_once(" -->").expect("a name");
            let table = rest.split("<!-- end -->").next().unwrap_or_default();
            for row in table.lines().filter(|row| row.starts_with("| `")) {
                let cells: Vec<_> = row.trim_matches('|').split(" | ").map(str::trim).collect();
                let parameter = cells[0].trim_matches('`');
                let meaning = cells[3].trim_end_matches('|').trim();
                all.insert((name.to_owned(), parameter.to_owned()), plain(meaning));
            }
        }
    }
    all
}

/// Text of a page without the addresses of its links.
fn plain(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](") {
        out += &before.replace('[', "");
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    out + rest
}

/// Words of a text in lines with an indentation.
fn wrapped(text: &str, indent: usize) -> String {
    let mut lines = String::new();
    let mut line = String::new();
    for word in text.split_whitespace() {
        if !line.is_empty() && indent + line.chars().count() + 1 + word.chars().count() > WIDTH {
            let _ = writeln!(lines, "{:indent$}{line}", "");
            line.clear();
        }
        if !line.is_empty() {
            line.push(' ');
        }
        line.push_str(word);
    }
    let _ = writeln!(lines, "{:indent$}{line}", "");
    lines
}

/// Name of a field; keywords of Python end in `_`.
fn field_name(key: &str) -> String {
    if key == "from" { "from_".to_owned() } else { key.to_owned() }
}

impl Class {
    fn required(&self) -> Vec<&str> {
        let all = self.schema["required"].as_array().expect("required keys");
        all.iter().filter_map(Value::as_str).collect()
    }

    /// Source of the class.
    fn source(&self, meanings: &BTreeMap<(String, String), String>) -> String {
        let Self { name, tag, definition, schema } = self;
        let required = self.required();
        let properties = schema["properties"].as_object().expect("keys");
        let keys: Vec<_> = properties.iter().filter(|(key, _)| *key != "type").collect();
        let (needed, others): (Vec<_>, Vec<_>) =
            keys.into_iter().partition(|(key, _)| required.contains(&key.as_str()));
        let title = match tag {
            Some(tag) => format!("{} of type ``{tag}``.", title(definition)),
            None => title(name).to_owned() + ".",
        };
        let mut docs = format!("    \"\"\"{title}\n");
        let mut fields = String::new();
        if let Some(tag) = tag {
            let _ = writeln!(fields, "    type: ClassVar[str | None] = {tag:?}");
        }
        if let Some(table) = table(definition) {
            let _ = writeln!(fields, "    table: ClassVar[str | None] = {table:?}");
        }
        for (i, (key, schema)) in needed.iter().chain(&others).enumerate() {
            let is_needed = i < needed.len();
            let kind = python_type(definition, key, schema);
            let by_type = tag.as_ref().and_then(|tag| meanings.get(&(tag.clone(), (*key).clone())));
            let of_struct = || {
                let own = STRUCTS.iter().find(|(class, of, _)| {
                    (*class == name || class == definition) && *of == key.as_str()
                });
                own.map(|(_, _, meaning)| (*meaning).to_owned())
            };
            let common = || {
                let common = COMMON.iter().find(|(of, _)| *of == key.as_str());
                common.map(|(_, meaning)| (*meaning).to_owned())
            };
            let meaning = by_type.cloned().or_else(of_struct).or_else(common);
            let meaning = meaning
                .unwrap_or_else(|| panic!("{name}.{key}: add its meaning to python_words.rs"));
            if i == 0 {
                docs += "\n    Parameters\n    ----------\n";
            }
            let default = match &schema["default"] {
                _ if is_needed => String::new(),
                Value::Null => ", optional".to_owned(),
                value if value.is_object() || *value == "" || *value == serde_json::json!([]) => {
                    ", optional".to_owned()
                }
                value => format!(", default {}", literal(value)),
            };
            let field = field_name(key);
            docs += &wrapped(&format!("{field} : {}{default}", words(&kind)), 4);
            let sentence = capital(&meaning);
            docs += &wrapped(&format!("{}.", sentence.trim_end_matches('.')), 8);
            let absent = if is_needed { "" } else { " | None = None" };
            let line = format!("    {field}: {kind}{absent}\n");
            if line.chars().count() <= WIDTH + 1 {
                fields += &line;
            } else {
                let kind = wrapped(&format!("{kind} | None"), 8);
                let _ = write!(fields, "    {field}: (\n{kind}    ) = None\n");
            }
        }
        if needed.is_empty() && others.is_empty() {
            docs = docs.trim_end().to_owned();
            docs += "\"\"\"\n";
        } else {
            docs += "    \"\"\"\n";
        }
        if fields.is_empty() {
            return format!(
                "@dataclass(kw_only=True, eq=False, repr=False)\nclass {name}(Part):\n{docs}"
            );
        }
        format!(
            "@dataclass(kw_only=True, eq=False, repr=False)\nclass {name}(Part):\n{docs}\n{fields}"
        )
    }
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map(|c| c.to_uppercase().to_string()).unwrap_or_default() + letters.as_str()
}

/// Value as Python writes it.
fn literal(value: &Value) -> String {
    match value {
        Value::Bool(true) => "True".to_owned(),
        Value::Bool(false) => "False".to_owned(),
        other => other.to_string().replace(',', ", "),
    }
}

/// Names that a source uses, of those in `known`.
fn used<'k>(source: &str, known: impl Iterator<Item = &'k str>) -> Vec<&'k str> {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let words: Vec<_> = source.split(|c| !is_word(c)).collect();
    let mut names: Vec<_> = known.filter(|name| words.contains(name)).collect();
    names.sort_unstable();
    names
}

/// A line of each item, with a comma.
fn lines(items: impl Iterator<Item = impl std::fmt::Display>, indent: &str) -> String {
    let mut lines = String::new();
    for item in items {
        let _ = writeln!(lines, "{indent}{item},");
    }
    lines
}

/// Import of names from a module, in as many lines as it needs.
fn import(module: &str, names: &[&str], indent: &str) -> String {
    let line = format!("{indent}from {module} import {}\n", names.join(", "));
    if line.len() <= WIDTH {
        return line;
    }
    let names = lines(names.iter(), &format!("{indent}    "));
    format!("{indent}from {module} import (\n{names}{indent})\n")
}

/// Classes, aliases and source of a module, without its imports.
fn body(module: &Module, schema: &Schema) -> (Vec<String>, String) {
    let meanings = meanings();
    let mut names = Vec::new();
    let mut source = String::new();
    for (definition, suffix) in module.definitions {
        let classes = classes(schema, definition, suffix);
        for class in &classes {
            let _ = write!(source, "\n\n{}", class.source(&meanings));
            names.push(class.name.clone());
        }
        if let Some(alias) = alias(definition) {
            let mut all: Vec<_> = classes.iter().map(|class| class.name.clone()).collect();
            all.push("Mapping[str, Any]".to_owned());
            let words = schema.definition(definition)["anyOf"][0]["enum"].as_array().cloned();
            let words: Vec<_> = words.iter().flatten().map(ToString::to_string).collect();
            if !words.is_empty() {
                let words = lines(words.iter(), "        ");
                all.push(format!("Literal[\n{words}    ]"));
            }
            let _ = write!(source, "\n\n{alias}: TypeAlias = (\n    {}\n)\n", all.join("\n    | "));
            names.push(alias.to_owned());
        }
    }
    (names, source)
}

/// All files of the package, by their names.
fn files() -> BTreeMap<String, String> {
    let schema = Schema(serde_json::from_str(&json_schema()).expect("the schema is JSON"));
    let bodies: Vec<_> = MODULES.iter().map(|module| body(module, &schema)).collect();
    let mut files = BTreeMap::new();
    let mut init = String::new();
    let mut exported = Vec::new();
    for (module, (names, source)) in MODULES.iter().zip(&bodies) {
        let mut text = format!(
            "\"\"\"{}\n\nGenerated from the schema of scene files.\n\"\"\"\n\nfrom __future__ import annotations\n\n",
            module.title
        );
        let abc = used(source, ["Mapping", "Sequence"].into_iter());
        let aliases = source.contains(": TypeAlias");
        if aliases {
            text += "from collections.abc import Mapping\n";
        }
        let other_abc: Vec<_> =
            abc.into_iter().filter(|name| !(aliases && *name == "Mapping")).collect();
        let typing = ["Any", "ClassVar", "Literal", "TypeAlias"];
        let mut typing = used(source, typing.into_iter());
        let foreign = MODULES.iter().zip(&bodies).filter(|(other, _)| other.name != module.name);
        let foreign: String = foreign
            .map(|(other, (theirs, _))| {
                let names = used(source, theirs.iter().map(String::as_str));
                let names: Vec<_> =
                    names.into_iter().filter(|n| !is_quoted_only(source, n)).collect();
                if names.is_empty() {
                    return String::new();
                }
                import(&format!(".{}", other.name), &names, "    ")
            })
            .collect();
        let parts = used(source, ["Array", "Color", "Vector"].into_iter());
        let abc = if other_abc.is_empty() {
            String::new()
        } else {
            import("collections.abc", &other_abc, "    ") + "\n"
        };
        let of_parts =
            if parts.is_empty() { String::new() } else { import("._part", &parts, "    ") };
        let checked = format!("{abc}{of_parts}{foreign}");
        if !checked.is_empty() {
            typing.insert(0, "TYPE_CHECKING");
        }
        text += "from dataclasses import dataclass\n";
        if source.contains("PathLike") {
            text += "from os import PathLike\n";
        }
        text += &import("typing", &typing, "");
        text += "\nfrom ._part import Part\n";
        if !checked.is_empty() {
            let _ = write!(text, "\nif TYPE_CHECKING:\n{checked}");
        }
        text += source;
        files.insert(format!("{}.py", module.name), text);
        let mut names: Vec<_> = names.iter().map(String::as_str).collect();
        names.sort_unstable();
        init += &import(&format!(".{}", module.name), &names, "");
        exported.extend(names);
    }
    exported.sort_unstable();
    let all = lines(exported.iter().map(|name| format!("{name:?}")), "    ");
    let head = "\"\"\"Parts of scenes, as classes: the arguments of :class:`pathtracer.Scene`.\n\nGenerated from the schema of scene files.\n\"\"\"\n\n";
    files.insert("__init__.py".to_owned(), format!("{head}{init}\n__all__ = [\n{all}]\n"));
    files
}

/// True if a name is in docstrings or strings only.
fn is_quoted_only(source: &str, name: &str) -> bool {
    let code: Vec<_> = source.split("\"\"\"").step_by(2).collect();
    used(&code.concat(), std::iter::once(name)).is_empty()
}

/// `PT_WRITE_GENERATED=1` writes them anew.
#[test]
fn classes_of_python_are_those_of_the_schema() {
    let folder = Path::new(ROOT).join("crates/python/pathtracer/build");
    for (name, expected) in files() {
        let path = folder.join(&name);
        if std::env::var_os("PT_WRITE_GENERATED").is_some() {
            fs::write(&path, &expected).expect("a writable folder");
        }
        let text = fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(text, expected, "{}", path.display());
    }
}
