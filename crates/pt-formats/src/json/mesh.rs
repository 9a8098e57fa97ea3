//! Meshes: inline, by the name of a shape, or in files.
//!
//! Meshes too large for the scene file are written as safetensors: arrays with names, types and
//! sizes. [Hugging Face 2022, "Safetensors", format 0.4]

use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_scene::shapes::{cube, cylinder, disk, rectangle, single_part};
use pt_scene::{Attribute, Attributes, Mesh, Shared, Submesh};
use safetensors::SafeTensors;
use serde_json::{Value, json};

use super::super::{obj, ply, serialized, stl};
use super::arrays::{self, check_names, corners, decode, encode, missing, points, reals, wholes};
use super::attached::Numbers;
use super::codec::JsonCodec;
use super::context::{EntryTables, JsonReader, JsonWriter};
use super::files::MAX_INLINE;
use super::node::{JsonNode, ObjectKeys};
use super::number::{ANY, numbers, vector, vector_schema};
use super::printer::{Entries, Out};
use super::schema::{Properties, Schemas};
use super::shared::TableEntry;
use crate::LoadError;
use crate::shared::mesh_file;
use crate::shared::names::quote;

/// Constructor of a generated mesh.
pub(super) type MeshGenerator = fn() -> Mesh;

/// Generated meshes by name.
pub(super) const SHAPES: [(&str, MeshGenerator); 4] =
    [("rectangle", rectangle), ("cube", cube), ("disk", disk), ("cylinder", cylinder)];

/// Prefixes of the names of attributes in such files.
const VERTEX_PREFIX: &str = "vertex_attributes.";
const FACE_PREFIX: &str = "face_attributes.";

impl TableEntry for Mesh {
    const TABLE: (&'static str, &'static str) = ("meshes", "mesh");

    fn table(tables: &mut EntryTables) -> &mut HashMap<String, Arc<Self>> {
        &mut tables.meshes
    }

    fn read_entry(node: &JsonNode<'_>, cx: &mut JsonReader<'_>) -> Result<Arc<Self>, LoadError> {
        let mut keys = node.keys()?;
        let name = keys.take("name").map(|name| String::read(&name, cx)).transpose()?;
        let name = name.or_else(|| Some(cx.key.clone()).filter(|key| !key.is_empty()));
        let file = keys.take("file");
        let shape = keys.take("shape");
        let mesh = match (file, shape) {
            (Some(file), None) => {
                let group = keys.take("shape_index").map_or(Ok(0), |node| u32::read(&node, cx))?;
                keys.finish()?;
                return of_file(&file, group, name, cx);
            }
            (None, Some(shape)) => {
                keys.finish()?;
                return of_shape(&shape, name, cx);
            }
            (None, None) => inline(&mut keys, cx)?,
            (Some(_), Some(shape)) => {
                return Err(shape.error("expected a \"file\" or a \"shape\", found both"));
            }
        };
        keys.finish()?;
        let mesh = Mesh { name: name.unwrap_or_default(), ..mesh };
        check(&mesh).map_err(|e| node.error(e))?;
        Ok(Arc::new(mesh))
    }

    fn write_entry(&self, cx: &mut JsonWriter<'_>) -> Result<Out, String> {
        let mut out = Entries::new();
        if self.name != cx.key {
            out.push(("name".to_owned(), Out::text(&self.name)));
        }
        if let Some(shape) = shape_of(self) {
            out.push(("shape".to_owned(), Out::text(shape)));
        } else if cx.is_in_memory() || count(self) <= MAX_INLINE {
            write_inline(self, &mut out, cx)?;
        } else {
            let (bytes, key) = (to_bytes(self)?, cx.key.clone());
            out.push(("file".to_owned(), cx.file(&key, arrays::ENDING, bytes)));
        }
        Ok(Out::Object(out))
    }

    fn schema_of_entry(schemas: &mut Schemas) -> Value {
        schemas.define("Mesh", |_| {
            let text = json!({"type": "string"});
            let name = || Properties::default().with_schema("name", text.clone(), false);
            let whole = json!({"type": "integer", "minimum": 0});
            let list = |width: usize, item: &Value| {
                json!({"type": "array", "items": vector_schema(item, width)})
            };
            let real = json!({"type": "number"});
            let named = |item: &Value| json!({"type": "object", "additionalProperties": item});
            let names: Vec<_> = SHAPES.iter().map(|(name, _)| name).collect();
            let file = name().with_schema("file", text.clone(), true);
            let shape = name().with_schema("shape", json!({"enum": names}), true);
            let mut inline = name()
                .with_schema("positions", list(3, &real), true)
                .with_schema("triangles", list(3, &whole), true)
                .with_schema("face_colors", list(3, &real), false)
                .with_schema("vertex_attributes", named(&list(3, &real)), false)
                .with_schema("face_attributes", named(&list(3, &real)), false)
                .with_schema("parts", list(3, &whole), false);
            for (values, indices, width) in
                [("normals", "normal_indices", 3), ("uvs", "uv_indices", 2), ("colors", "color_indices", 3)]
            {
                inline = inline
                    .with_schema(values, list(width, &real), false)
                    .with_schema(indices, list(3, &whole), false);
            }
            Properties::any_of(&[file.with_schema("shape_index", whole, false), shape, inline], false)
        })
    }

    fn name(&self) -> &str {
        &self.name
    }
}

/// Returns the name of the generated mesh that is equal, but for its name.
fn shape_of(mesh: &Mesh) -> Option<&'static str> {
    let is_equal = |make: MeshGenerator| {
        let made = make();
        made.triangles.len() == mesh.triangles.len() && to_bytes(&made) == to_bytes(mesh)
    };
    SHAPES.iter().find(|(_, make)| is_equal(*make)).map(|(shape, _)| *shape)
}

/// Returns the number of values of a mesh.
fn count(mesh: &Mesh) -> usize {
    let of = |values: usize, indices: Option<&Shared<[u32; 3]>>| {
        values + indices.map_or(0, |i| 3 * i.len())
    };
    let normals = mesh.normals.as_ref().map_or(0, |a| of(3 * a.values.len(), a.indices.as_ref()));
    let uvs = mesh.uvs.as_ref().map_or(0, |a| of(2 * a.values.len(), a.indices.as_ref()));
    let colors = mesh.colors.as_ref().map_or(0, |a| of(3 * a.values.len(), a.indices.as_ref()));
    let faces = mesh.face_colors.as_ref().map_or(0, |colors| 3 * colors.len());
    let named: usize = mesh.attributes.all().map(|(_, values)| 3 * values.len()).sum();
    3 * (mesh.positions.len() + mesh.triangles.len())
        + normals
        + uvs
        + colors
        + faces
        + named
        + 3 * mesh.submeshes.len()
}

/// Returns a generated mesh, which is shared by all references without a name of their own.
fn of_shape(
    node: &JsonNode<'_>,
    name: Option<String>,
    cx: &mut JsonReader<'_>,
) -> Result<Arc<Mesh>, LoadError> {
    let wanted = node.text().ok_or_else(|| node.unexpected("the name of a shape"))?;
    let found = SHAPES.iter().find(|(shape, _)| *shape == wanted);
    let unknown = || node.unknown("shape", wanted, SHAPES.iter().map(|(shape, _)| *shape));
    let (shape, make) = found.ok_or_else(unknown)?;
    Ok(shape_named(shape, *make, name, cx))
}

/// See [`of_shape`].
pub(super) fn shape_named(
    shape: &str,
    make: MeshGenerator,
    name: Option<String>,
    cx: &mut JsonReader<'_>,
) -> Arc<Mesh> {
    let name = name.unwrap_or_else(|| shape.to_owned());
    // Paths of files are not empty.
    let place = (PathBuf::new(), format!("{shape} {name}"));
    let known = cx.files.meshes.entry(place);
    Arc::clone(known.or_insert_with(|| Arc::new(Mesh { name, ..make() })))
}

/// Reads the mesh of a file.
fn of_file(
    node: &JsonNode<'_>,
    group: u32,
    name: Option<String>,
    cx: &mut JsonReader<'_>,
) -> Result<Arc<Mesh>, LoadError> {
    let path = cx.path(node)?;
    let place = (path.clone(), format!("{group} {}", name.as_deref().unwrap_or_default()));
    if let Some(known) = cx.files.meshes.get(&place) {
        return Ok(Arc::clone(known));
    }
    let read = cx.read(&path, node).and_then(|bytes| parse(&bytes, &path, group, node));
    let mut mesh = read.map_err(|error| {
        let why = match error {
            LoadError::Content { at, message } if at.file == node.span().file => message,
            LoadError::Content { .. } => error.to_string(),
            other => return other,
        };
        cx.context.missing(node.span(), format!("{why}; its objects are omitted"));
        LoadError::AlreadyReported
    })?;
    if let Some(name) = name {
        mesh.name = name;
    }
    cx.account(4 * count(&mesh), node)?;
    let mesh = Arc::new(mesh);
    cx.files.meshes.insert(place, Arc::clone(&mesh));
    Ok(mesh)
}

/// Extensions of mesh files.
const ENDINGS: [&str; 5] = [arrays::ENDING, "ply", "obj", "stl", "serialized"];

fn parse(bytes: &[u8], path: &Path, group: u32, node: &JsonNode<'_>) -> Result<Mesh, LoadError> {
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_lowercase();
    match ending.as_str() {
        arrays::ENDING => {
            let mesh =
                of_bytes(bytes).map_err(|e| node.error(format!("{}: {e}", path.display())))?;
            Ok(Mesh { name: mesh_file::name_of(path), ..mesh })
        }
        "ply" => Ok(ply::parse_mesh(bytes, path)?.mesh),
        "obj" => Ok(obj::parse_mesh(bytes, path)?.mesh),
        "stl" => stl::parse_mesh(bytes, path),
        "serialized" => Ok(serialized::parse_mesh(bytes, path, group)?.mesh),
        _ => {
            let known = ENDINGS.map(|ending| format!(".{ending}")).join(", ");
            Err(node.error(format!("unknown mesh format; known extensions: {known}")))
        }
    }
}

/// Checks the invariants of meshes.
fn check(mesh: &Mesh) -> Result<(), String> {
    if mesh.triangles.is_empty() {
        return Err("mesh without triangles".to_owned());
    }
    let triangles = mesh.triangles.len();
    let below = |what: &str, indices: &[[u32; 3]], count: usize| match indices
        .as_flattened()
        .iter()
        .find(|index| **index as usize >= count)
    {
        Some(index) => {
            Err(format!("found index {index} in {what}, expected an index below {count}"))
        }
        None => Ok(()),
    };
    below("\"triangles\"", &mesh.triangles, mesh.positions.len())?;
    let attribute = |what: &str, count: usize, indices: Option<&Shared<[u32; 3]>>| match indices {
        Some(indices) if indices.len() != triangles => Err(format!(
            "found indices of {what} for {} triangles, expected {triangles}",
            indices.len()
        )),
        Some(indices) => below(&format!("the indices of {what}"), indices, count),
        None if count == mesh.positions.len() => Ok(()),
        None => Err(format!(
            "found {count} {what} for {} positions, expected the same number, or indices",
            mesh.positions.len()
        )),
    };
    let all = [
        mesh.normals.as_ref().map(|a| ("normals", a.values.len(), a.indices.as_ref())),
        mesh.uvs.as_ref().map(|a| ("uvs", a.values.len(), a.indices.as_ref())),
        mesh.colors.as_ref().map(|a| ("colors", a.values.len(), a.indices.as_ref())),
    ];
    all.into_iter()
        .flatten()
        .try_for_each(|(what, count, indices)| attribute(what, count, indices))?;
    if let Some(colors) = mesh.face_colors.as_ref().filter(|colors| colors.len() != triangles) {
        return Err(format!(
            "found {} face_colors for {triangles} triangles, expected the same number",
            colors.len()
        ));
    }
    let Attributes { vertices, faces } = &mesh.attributes;
    let of = [("vertex", vertices, mesh.positions.len()), ("face", faces, triangles)];
    for (of, named, count) in of {
        if let Some((name, values)) = named.iter().find(|(_, values)| values.len() != count) {
            let there = values.len();
            return Err(format!(
                "found {there} values of the {of} attribute {}, expected {count}",
                quote(name)
            ));
        }
    }
    let mut next = 0;
    for Submesh { triangles, .. } in &mesh.submeshes {
        if triangles.start != next || triangles.end < next {
            return Err(
                "found parts that are not consecutive from triangle 0, expected consecutive ones"
                    .to_owned(),
            );
        }
        next = triangles.end;
    }
    let slots = mesh.submeshes.iter().map(|part| part.slot).max().unwrap_or_default();
    if next as usize != triangles || slots as usize >= triangles.max(1) + mesh.submeshes.len() {
        return Err(format!(
            "found parts with {next} of {triangles} triangles and slots up to {slots}, expected \
             all triangles, and slots that are numbered from 0"
        ));
    }
    Ok(())
}

// ---- inline -------------------------------------------------------------------------------------

fn inline(keys: &mut ObjectKeys<'_>, cx: &mut JsonReader<'_>) -> Result<Mesh, LoadError> {
    let Some((positions, triangles)) = keys.take("positions").zip(keys.take("triangles")) else {
        let message = "expected a \"file\", a \"shape\", or \"positions\" and \"triangles\"";
        return Err(keys.node.error(message));
    };
    let (positions, triangles) = (vectors(&positions)?, indices(&triangles, cx)?);
    let normals = attribute(keys, "normals", "normal_indices", cx)?;
    let uvs = attribute(keys, "uvs", "uv_indices", cx)?;
    let colors = attribute(keys, "colors", "color_indices", cx)?;
    let face_colors = keys.take("face_colors").map(|node| vectors(&node)).transpose()?;
    let vertices = named_values(keys.take("vertex_attributes"))?;
    let attributes = Attributes { vertices, faces: named_values(keys.take("face_attributes"))? };
    let parts = match keys.take("parts") {
        None => single_part(triangles.len()),
        Some(node) => {
            let part = |[start, end, slot]: [u32; 3]| Submesh { triangles: start..end, slot };
            indices(&node, cx)?.into_iter().map(part).collect()
        }
    };
    let name = String::new();
    Ok(Mesh {
        name,
        positions,
        triangles,
        normals,
        uvs,
        colors,
        face_colors,
        attributes,
        submeshes: parts,
    })
}

/// Reads named values.
fn named_values(
    node: Option<JsonNode<'_>>,
) -> Result<BTreeMap<String, Shared<[f32; 3]>>, LoadError> {
    let entries = node.map_or(Ok(Vec::new()), |node| node.entries())?;
    let values = |(name, node): (&str, JsonNode<'_>)| Ok((name.to_owned(), vectors(&node)?));
    entries.into_iter().map(values).collect()
}

fn attribute<const N: usize>(
    keys: &mut ObjectKeys<'_>,
    values: &'static str,
    corners: &'static str,
    cx: &mut JsonReader<'_>,
) -> Result<Option<Attribute<[f32; N]>>, LoadError> {
    let values = keys.take(values).map(|node| vectors(&node)).transpose()?;
    let found = keys.take(corners);
    let indices = found.as_ref().map(|node| indices(node, cx)).transpose()?;
    match (values, found) {
        (None, Some(node)) => Err(node.error("indices given without vertices")),
        (values, _) => Ok(values.map(|values| Attribute { values, indices })),
    }
}

pub(super) fn vectors<const N: usize>(node: &JsonNode<'_>) -> Result<Shared<[f32; N]>, LoadError> {
    if let Some(rows) = node.rows_of_reals() {
        return rows;
    }
    let expected = format!("{N} numbers");
    node.list("a list")?.iter().map(|item| vector(item, &ANY, &expected)).collect()
}

pub(super) fn indices<const N: usize>(
    node: &JsonNode<'_>,
    cx: &mut JsonReader<'_>,
) -> Result<Shared<[u32; N]>, LoadError> {
    node.rows_of_wholes().unwrap_or_else(|| Shared::read(node, cx))
}

/// Writes rows of numbers: an array in memory, otherwise lists.
pub(super) fn write_vectors<const N: usize>(
    rows: &[[f32; N]],
    cx: &mut JsonWriter<'_>,
) -> Result<Out, String> {
    if cx.is_in_memory() {
        return Ok(cx.array(&[rows.len(), N], Numbers::Reals(rows.as_flattened().to_vec().into())));
    }
    rows.iter().map(|row| numbers(row)).collect::<Result<_, _>>().map(Out::List)
}

/// Writes rows of indices: an array in memory, otherwise lists.
pub(super) fn write_indices<const N: usize>(
    rows: &[[u32; N]],
    cx: &mut JsonWriter<'_>,
) -> Result<Out, String> {
    if cx.is_in_memory() {
        return Ok(cx.array(&[rows.len(), N], Numbers::Wholes(rows.as_flattened().to_vec().into())));
    }
    rows.iter().map(|row| row.write(cx)).collect::<Result<_, _>>().map(Out::List)
}

fn write_inline(mesh: &Mesh, out: &mut Entries, cx: &mut JsonWriter<'_>) -> Result<(), String> {
    fn put<const N: usize>(
        attribute: Option<&Attribute<[f32; N]>>,
        [name, corners]: [&str; 2],
        out: &mut Entries,
        cx: &mut JsonWriter<'_>,
    ) -> Result<(), String> {
        let Some(attribute) = attribute else { return Ok(()) };
        out.push((name.to_owned(), write_vectors(&attribute.values, cx)?));
        if let Some(indices) = &attribute.indices {
            out.push((corners.to_owned(), write_indices(indices, cx)?));
        }
        Ok(())
    }
    out.push(("positions".to_owned(), write_vectors(&mesh.positions, cx)?));
    out.push(("triangles".to_owned(), write_indices(&mesh.triangles, cx)?));
    put(mesh.normals.as_ref(), ["normals", "normal_indices"], out, cx)?;
    put(mesh.uvs.as_ref(), ["uvs", "uv_indices"], out, cx)?;
    put(mesh.colors.as_ref(), ["colors", "color_indices"], out, cx)?;
    if let Some(colors) = &mesh.face_colors {
        out.push(("face_colors".to_owned(), write_vectors(colors, cx)?));
    }
    let Attributes { vertices, faces } = &mesh.attributes;
    for (key, named) in [("vertex_attributes", vertices), ("face_attributes", faces)] {
        let entries = named.iter().map(|(name, of)| Ok((name.clone(), write_vectors(of, cx)?)));
        let entries = entries.collect::<Result<Entries, String>>()?;
        if !entries.is_empty() {
            out.push((key.to_owned(), Out::Object(entries)));
        }
    }
    if mesh.submeshes != single_part(mesh.triangles.len()) {
        out.push(("parts".to_owned(), write_indices(&rows_of_parts(mesh), cx)?));
    }
    Ok(())
}

/// Returns the first triangle, the end of the range of triangles, and the slot of each part.
fn rows_of_parts(mesh: &Mesh) -> Vec<[u32; 3]> {
    mesh.submeshes
        .iter()
        .map(|part| [part.triangles.start, part.triangles.end, part.slot])
        .collect()
}

// ---- files of arrays ----------------------------------------------------------------------------

fn to_bytes(mesh: &Mesh) -> Result<Vec<u8>, String> {
    let mut arrays =
        vec![reals("positions", &mesh.positions), wholes("triangles", &mesh.triangles)];
    if let Some(Attribute { values, indices }) = &mesh.normals {
        arrays.push(reals("normals", values));
        arrays.extend(indices.as_ref().map(|indices| wholes("normal_indices", indices)));
    }
    if let Some(Attribute { values, indices }) = &mesh.uvs {
        arrays.push(reals("uvs", values));
        arrays.extend(indices.as_ref().map(|indices| wholes("uv_indices", indices)));
    }
    if let Some(Attribute { values, indices }) = &mesh.colors {
        arrays.push(reals("colors", values));
        arrays.extend(indices.as_ref().map(|indices| wholes("color_indices", indices)));
    }
    arrays.extend(mesh.face_colors.as_ref().map(|colors| reals("face_colors", colors)));
    let Attributes { vertices, faces } = &mesh.attributes;
    for (prefix, named) in [(VERTEX_PREFIX, vertices), (FACE_PREFIX, faces)] {
        arrays.extend(named.iter().map(|(name, of)| reals(&format!("{prefix}{name}"), of)));
    }
    if mesh.submeshes != single_part(mesh.triangles.len()) {
        arrays.push(wholes("parts", &rows_of_parts(mesh)));
    }
    encode(&arrays)
}

/// Decodes the mesh of a file, without a name.
fn of_bytes(bytes: &[u8]) -> Result<Mesh, String> {
    let all = decode(bytes)?;
    let known = [
        "positions",
        "triangles",
        "normals",
        "normal_indices",
        "uvs",
        "uv_indices",
        "colors",
        "color_indices",
        "face_colors",
        "parts",
    ];
    let is_named = |name: &str| name.starts_with(VERTEX_PREFIX) || name.starts_with(FACE_PREFIX);
    check_names(&all, &known, is_named)?;
    let triangles = corners(&all, "triangles")?.ok_or_else(|| missing("triangles"))?;
    let parts = match corners(&all, "parts")? {
        None => single_part(triangles.len()),
        Some(rows) => {
            rows.into_iter().map(|[a, b, slot]| Submesh { triangles: a..b, slot }).collect()
        }
    };
    let mesh = Mesh {
        name: String::new(),
        positions: points(&all, "positions")?.ok_or_else(|| missing("positions"))?.into(),
        triangles: triangles.into(),
        normals: attribute_of(&all, "normals", "normal_indices")?,
        uvs: attribute_of(&all, "uvs", "uv_indices")?,
        colors: attribute_of(&all, "colors", "color_indices")?,
        face_colors: points(&all, "face_colors")?.map(Into::into),
        attributes: Attributes {
            vertices: named_points(&all, VERTEX_PREFIX)?,
            faces: named_points(&all, FACE_PREFIX)?,
        },
        submeshes: parts,
    };
    check(&mesh)?;
    Ok(mesh)
}

/// Decodes named values with a prefix.
fn named_points(
    all: &SafeTensors<'_>,
    prefix: &str,
) -> Result<BTreeMap<String, Shared<[f32; 3]>>, String> {
    let names = all.names().into_iter().filter(|name| name.starts_with(prefix));
    let values = names.map(|name| {
        let values = points(all, name)?.unwrap_or_default();
        Ok((name[prefix.len()..].to_owned(), values.into()))
    });
    values.collect()
}

fn attribute_of<const N: usize>(
    all: &SafeTensors<'_>,
    values: &str,
    indices: &str,
) -> Result<Option<Attribute<[f32; N]>>, String> {
    let indices = corners(all, indices)?.map(Into::into);
    Ok(points(all, values)?.map(|values| Attribute { values: values.into(), indices }))
}
