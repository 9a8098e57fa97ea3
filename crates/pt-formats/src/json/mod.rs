//! The scene format of this program: all of a [`Scene`], in JSON with comments, for people and for
//! programs.
//!
//! The content of a file is described once for each type, in the file of its concept
//! (`material.rs`, `light.rs` …), with the macros of `codec.rs`; reader, writer and schema follow
//! from that. `node.rs` has values with their locations, `printer.rs` prints, and `shared.rs` has
//! the tables of named items. Images, and all but small meshes and grids, are written to files
//! beside the scene (`mesh.rs`, `files.rs`).

mod array_nodes;
mod arrays;
mod attached;
mod camera;
mod codec;
mod context;
mod files;
mod former_names;
mod light;
mod material;
mod medium;
mod mesh;
mod node;
mod number;
mod object;
mod pixels;
mod points;
mod printer;
mod schema;
mod settings;
mod shared;
mod transform;

use std::path::Path;
use std::sync::Arc;

use attached::Attachments;
pub use attached::{Attachment, Numbers, SceneValues};
use codec::{JsonCodec, Plain, put};
use context::{JsonReader, JsonWriter, OutFile, Unique};
use node::{JsonDocument, JsonNode, ObjectKeys};
use number::ABOVE_0;
use printer::{Entries, Out};
use pt_scene::image::Image;
use pt_scene::light::IesProfile;
use pt_scene::measured::Measurements;
use pt_scene::medium::Grid;
use pt_scene::{
    Camera, Light, Material, Medium, Mesh, Motion, Object, Points, RenderHints, Scene, Shared,
    Texture,
};
use schema::{Properties, Schemas};
use serde_json::{Value, json};
use shared::{TableEntry, read_table};

use super::encoded::Encoded;
use crate::LoadError;
use crate::shared::cameras;
use crate::shared::context::LoadContext;
use crate::shared::names::quote;
use crate::shared::text;

/// Version that is written; all versions up to it are read.
const VERSION: u32 = 1;
/// Key of the version, which is required.
const HEADER: &str = "pathtracer";

/// Reads a scene.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    parse_with(bytes, Attachments::default(), path, context)
}

/// Reads a scene from a text and its attachments.
pub(super) fn parse_values(
    SceneValues { text, attachments }: SceneValues,
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    parse_with(text.as_bytes(), Attachments::new(attachments), path, context)
}

fn parse_with(
    bytes: &[u8],
    attachments: Attachments,
    path: &Path,
    context: &Arc<LoadContext>,
) -> Result<Scene, LoadError> {
    let bytes = &*text::lines(bytes, path)?;
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].split(|byte| *byte == b'\n').count();
        crate::shared::mesh_file::error(
            path,
            line as u32,
            "found text that is not in UTF-8, expected UTF-8",
        )
    })?;
    let value = node::parse(text, path)?;
    let document = JsonDocument::new(text, path, attachments);
    let root = JsonNode::root(&value, &document);
    let mut keys = root.keys()?;
    check_version(&mut keys)?;
    keys.take("$schema"); // for editors
    let mut cx = JsonReader::new(path.parent().unwrap_or(Path::new("")), context);
    let scene = scene(&mut keys, &mut cx)?;
    keys.finish()?;
    Ok(scene)
}

fn check_version(keys: &mut ObjectKeys<'_>) -> Result<(), LoadError> {
    let Some(node) = keys.take(HEADER) else {
        let message = format!(
            "found no scene of pathtracer, expected a file that begins with {{{}: {VERSION}",
            quote(HEADER)
        );
        return Err(keys.node.error(message));
    };
    match node.digits().and_then(|digits| digits.parse::<u32>().ok()) {
        Some(1..=VERSION) => Ok(()),
        Some(newer) if newer > VERSION => Err(node.error(format!(
            "found version {newer} of the format, expected at most {VERSION}; use a newer \
             pathtracer"
        ))),
        _ => Err(node.unexpected(&format!("the version of the format, {VERSION}"))),
    }
}

/// Reads everything except the version. Tables are read first, whatever their order in the file.
fn scene(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Scene, LoadError> {
    let defaults = Scene::default();
    let settings: RenderHints = keys.read("settings", &Plain, Some(defaults.settings), cx)?;
    if let Some([width, height]) = settings.resolution {
        cx.aspect = f64::from(width) / f64::from(height);
    }
    read_table::<Image>(keys, cx)?;
    read_table::<Grid>(keys, cx)?;
    read_table::<Texture>(keys, cx)?;
    read_table::<IesProfile>(keys, cx)?;
    read_table::<Measurements>(keys, cx)?;
    read_table::<Motion>(keys, cx)?;
    read_table::<Mesh>(keys, cx)?;
    read_table::<Points>(keys, cx)?;
    let media = named::<Medium>("media", keys, cx)?;
    cx.media = numbers_of(&media);
    let materials = named::<Material>("materials", keys, cx)?;
    cx.materials = numbers_of(&materials);
    let mut cameras: Vec<Camera> = list("cameras", keys, cx)?;
    cameras::open_shutters(&mut cameras, cx.context.options().time);
    let used_camera = keys.read("used_camera", &Plain, Some(None), cx)?;
    if let Some(index) = used_camera.filter(|index: &u32| *index as usize >= cameras.len()) {
        let message = format!(
            "found \"used_camera\" = {index}, expected an index of the {} cameras",
            cameras.len()
        );
        return Err(keys.node.error(message));
    }
    Ok(Scene {
        name: keys.read("name", &Plain, Some(defaults.name), cx)?,
        metres_per_unit: keys.read(
            "metres_per_unit",
            &ABOVE_0,
            Some(defaults.metres_per_unit),
            cx,
        )?,
        cameras,
        used_camera,
        materials: materials.into_iter().map(|(_, material)| material).collect(),
        media: media.into_iter().map(|(_, medium)| medium).collect(),
        objects: list("objects", keys, cx)?.into(),
        lights: list("lights", keys, cx)?.into(),
        settings,
        ..defaults
    })
}

/// Reads the entries of a table whose order is significant, and their names.
fn named<T: JsonCodec>(
    table: &'static str,
    keys: &mut ObjectKeys<'_>,
    cx: &mut JsonReader<'_>,
) -> Result<Vec<(String, T)>, LoadError> {
    let Some(node) = keys.take(table) else { return Ok(Vec::new()) };
    let mut entries = Vec::new();
    for (name, node) in node.entries()? {
        name.clone_into(&mut cx.key);
        let read = T::read(&node, cx);
        match cx.context.ok_or_report(read)? {
            Some(entry) => entries.push((name.to_owned(), entry)),
            None => cx.fail(table, name),
        }
    }
    Ok(entries)
}

/// Reads the items of a list, except those with an error or a missing mesh.
fn list<T: JsonCodec>(
    key: &'static str,
    keys: &mut ObjectKeys<'_>,
    cx: &mut JsonReader<'_>,
) -> Result<Vec<T>, LoadError> {
    let Some(node) = keys.take(key) else { return Ok(Vec::new()) };
    let mut items = Vec::new();
    for item in node.list("a list […]")? {
        let read = T::read(&item, cx);
        items.extend(cx.context.ok_or_report(read)?);
    }
    Ok(items)
}

fn numbers_of<T>(entries: &[(String, T)]) -> std::collections::HashMap<String, u32> {
    entries.iter().zip(0..).map(|((name, _), index)| (name.clone(), index)).collect()
}

/// Encodes a scene as a file of this name, and files beside it.
///
/// # Errors
/// Returns a message if a number is not finite, or an index is out of range.
pub(super) fn encode(scene: &Scene, path: &Path) -> Result<Encoded, String> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let folder = format!("{stem}_files");
    let (materials, media) = names_of(scene);
    let cx = &mut JsonWriter::new(folder.clone(), &materials, &media);
    let bytes = write(scene, stem, cx)?.into_bytes();
    let in_folder = |file: OutFile| (Path::new(&folder).join(file.name), file.bytes);
    let files = cx.files.drain(..).map(in_folder).collect();
    Ok(Encoded { bytes, files, notes: Vec::new() })
}

/// Converts a scene to a text with attachments, in place of files beside it.
///
/// # Errors
/// Returns a message if a number is not finite, or an index is out of range.
pub fn values_of(scene: &Scene) -> Result<SceneValues, String> {
    let (materials, media) = names_of(scene);
    let cx = &mut JsonWriter::in_memory(&materials, &media);
    let text = write(scene, String::new(), cx)?;
    Ok(SceneValues { text, attachments: cx.attachments.take().unwrap_or_default() })
}

/// Converts parts of a scene to a text with attachments. Textures, images and other items of tables
/// are in place of their names; `materials` and `media` are the names of those of the scene.
///
/// # Errors
/// As [`values_of`].
pub fn values_of_parts(
    parts: &Scene,
    materials: &[String],
    media: &[String],
) -> Result<SceneValues, String> {
    let cx = &mut JsonWriter::in_memory(materials, media);
    cx.is_inline = true;
    let text = write(parts, String::new(), cx)?;
    Ok(SceneValues { text, attachments: cx.attachments.take().unwrap_or_default() })
}

/// Returns the unique names of the materials and of the media of a scene in scene files.
pub fn names_of(scene: &Scene) -> (Vec<String>, Vec<String>) {
    let materials = unique(scene.materials.iter().map(|m| m.name.as_str()), "material");
    (materials, unique(scene.media.iter().map(|m| m.name.as_str()), "medium"))
}

/// Writes a scene, whose name is that of the file by default.
fn write(scene: &Scene, stem: String, cx: &mut JsonWriter<'_>) -> Result<String, String> {
    let defaults = Scene::default();
    let (materials, media) = (cx.materials, cx.media);
    let mut head = vec![(HEADER.to_owned(), VERSION.write(cx)?)];
    put(&mut head, "name", &Plain, &scene.name, Some(stem), cx)?;
    put(&mut head, "metres_per_unit", &ABOVE_0, &scene.metres_per_unit, Some(1.0), cx)?;
    put(&mut head, "settings", &Plain, &scene.settings, Some(defaults.settings), cx)?;
    let mut body = Entries::new();
    put(&mut body, "cameras", &Plain, &scene.cameras, Some(Vec::new()), cx)?;
    put(&mut body, "used_camera", &Plain, &scene.used_camera, Some(None), cx)?;
    write_named("media", &scene.media, media, &mut body, cx)?;
    write_named("materials", &scene.materials, materials, &mut body, cx)?;
    put(&mut body, "lights", &Plain, &scene.lights, Some(Shared::default()), cx)?;
    put(&mut body, "objects", &Plain, &scene.objects, Some(Shared::default()), cx)?;
    for table in TABLES {
        head.extend(
            cx.tables.remove(table).map(|entries| (table.to_owned(), Out::Object(entries))),
        );
    }
    head.append(&mut body);
    Ok(Out::Object(head).print())
}

/// Tables of shared items; each refers to previous ones only.
const TABLES: [&str; 8] = [
    Image::TABLE.0,
    Grid::TABLE.0,
    Texture::TABLE.0,
    IesProfile::TABLE.0,
    Measurements::TABLE.0,
    Motion::TABLE.0,
    Mesh::TABLE.0,
    Points::TABLE.0,
];

fn unique<'a>(names: impl Iterator<Item = &'a str>, otherwise: &str) -> Vec<String> {
    let mut unique = Unique::default();
    names.map(|name| unique.name(name, otherwise)).collect()
}

fn write_named<T: JsonCodec>(
    table: &str,
    all: &[T],
    names: &[String],
    out: &mut Entries,
    cx: &mut JsonWriter<'_>,
) -> Result<(), String> {
    let mut entries = Entries::new();
    for (entry, name) in all.iter().zip(names) {
        name.clone_into(&mut cx.key);
        let written = entry.write(cx).map_err(|e| format!("{table}.{name}: {e}"))?;
        entries.push((name.clone(), written));
    }
    if !entries.is_empty() {
        out.push((table.to_owned(), Out::Object(entries)));
    }
    Ok(())
}

/// Returns the [schema](https://json-schema.org) of scene files, in JSON.
pub fn schema() -> String {
    schema::of(schema_of_file)
}

fn schema_of_file(schemas: &mut Schemas) -> Value {
    let table = |entry: Value| json!({"type": "object", "additionalProperties": entry});
    let defaults = Scene::default;
    let file = Properties::default()
        .with_schema("$schema", json!({"type": "string"}), false)
        .with_schema(HEADER, json!({"type": "integer", "minimum": 1, "maximum": VERSION}), true)
        .with("name", &Plain, |s: &Scene| &s.name, Some(String::new()), schemas)
        .with("metres_per_unit", &ABOVE_0, |s: &Scene| &s.metres_per_unit, Some(1.0), schemas)
        .with("settings", &Plain, |s: &Scene| &s.settings, Some(defaults().settings), schemas)
        .with_schema(Image::TABLE.0, table(Image::schema_of_entry(schemas)), false)
        .with_schema(Grid::TABLE.0, table(Grid::schema_of_entry(schemas)), false)
        .with_schema(Texture::TABLE.0, table(Texture::schema_of_entry(schemas)), false)
        .with_schema(IesProfile::TABLE.0, table(IesProfile::schema_of_entry(schemas)), false)
        .with_schema(Measurements::TABLE.0, table(Measurements::schema_of_entry(schemas)), false)
        .with_schema(Motion::TABLE.0, table(Motion::schema_of_entry(schemas)), false)
        .with_schema(Mesh::TABLE.0, table(Mesh::schema_of_entry(schemas)), false)
        .with_schema(Points::TABLE.0, table(Points::schema_of_entry(schemas)), false)
        .with_schema("media", table(Medium::schema(schemas)), false)
        .with_schema("materials", table(Material::schema(schemas)), false)
        .with_schema("cameras", Vec::<Camera>::schema(schemas), false)
        .with("used_camera", &Plain, |s: &Scene| &s.used_camera, Some(None), schemas)
        .with_schema("lights", Vec::<Light>::schema(schemas), false)
        .with_schema("objects", Vec::<Object>::schema(schemas), false);
    Properties::any_of(&[file], false)
}
