//! Compressed geometry, which is decoded into additional buffers and then read like any other
//! geometry. [KHR_draco_mesh_compression; EXT_meshopt_compression; KHR_meshopt_compression]

use std::path::Path;

use draco_core::geometry_indices::PointIndex;
use draco_core::{DataType, DecodeLimits, DecoderBuffer, Mesh, MeshDecoder, PointAttribute};
use meshoptimizer_rs::{Limits, Workspace, codec};
use pt_io::guarded;
use serde_json::{Map, Value, json};

use super::buffer::Buffers;
use super::item::Item;
use crate::LoadError;
use crate::gltf::buffer::meshopt_of;
use crate::shared::context::LoadContext;
use crate::shared::names::quote;

/// Name of the extension for compressed primitives.
pub(super) const DRACO: &str = "KHR_draco_mesh_compression";

/// Maximum number of bytes decoded from one buffer view or primitive.
const MAX_BYTES: u64 = 1 << 30;

/// Decodes all compressed geometry, and lets buffer views and accessors refer to the decoded bytes.
/// Data that cannot be decoded are reported and left unchanged.
///
/// # Errors
/// If loading cannot continue.
pub(super) fn decode(
    json: &mut Value,
    buffers: &mut Buffers<'_>,
    file: &Path,
    context: &LoadContext,
) -> Result<(), LoadError> {
    let mut views = Vec::new();
    let root = Item::root(json, file)?;
    for (i, view) in root.children("bufferViews")?.iter().enumerate() {
        if let Some(decoded) =
            context.ok_or_report(meshopt_view(&root, view, buffers, context))?.flatten()
        {
            views.push((i, decoded));
        }
    }
    for (i, view) in views {
        replace_view(json, i, view, buffers);
    }
    let mut primitives = Vec::new();
    let root = Item::root(json, file)?;
    for (mesh, item) in root.children("meshes")?.iter().enumerate() {
        for (i, primitive) in item.children("primitives")?.iter().enumerate() {
            let decoded = draco_primitive(&root, primitive, buffers, context);
            if let Some(decoded) = context.ok_or_report(decoded)?.flatten() {
                primitives.push(([mesh, i], decoded));
            }
        }
    }
    for (place, primitive) in primitives {
        replace_primitive(json, place, primitive, buffers);
    }
    Ok(())
}

/// A decoded buffer view.
struct DecodedView {
    bytes: Vec<u8>,
    /// Stride in bytes of vertex attributes.
    stride: Option<usize>,
}

/// Decodes a buffer view, if it is compressed.
fn meshopt_view(
    root: &Item<'_>,
    view: &Item<'_>,
    buffers: &Buffers<'_>,
    context: &LoadContext,
) -> Result<Option<DecodedView>, LoadError> {
    let Some(found) = meshopt_of(view)? else { return Ok(None) };
    let mode = found.text("mode")?.unwrap_or_default();
    let decode = match mode {
        "ATTRIBUTES" => codec::decode_vertex_buffer,
        "TRIANGLES" => codec::decode_index_buffer,
        "INDICES" => codec::decode_index_sequence,
        other => {
            let message =
                format!("found mode {}, expected ATTRIBUTES, TRIANGLES or INDICES", quote(other));
            return Err(found.refuse("mode", message));
        }
    };
    let filter: Option<UnfilterFn> = match found.text("filter")?.unwrap_or("NONE") {
        "NONE" => None,
        "OCTAHEDRAL" => Some(codec::decode_filter_oct),
        "QUATERNION" => Some(codec::decode_filter_quat),
        "EXPONENTIAL" => Some(codec::decode_filter_exp),
        "COLOR" => Some(codec::decode_filter_color),
        other => {
            let message = format!(
                "found filter {}, expected NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR",
                quote(other)
            );
            return Err(found.refuse("filter", message));
        }
    };
    let (count, stride) = (found.needed("count")?, found.needed("byteStride")?);
    let source = buffers.part(root, &found)?;
    reserve((count as u64).saturating_mul(stride as u64), &found, context)?;
    let failed = |why: String| found.error(format!("damaged compressed data: {why}"));
    let bytes = guarded("meshopt data", || {
        let mut workspace = Workspace::new(Limits::default());
        let mut bytes = decode(count, stride, source, &mut workspace)?;
        if let Some(unfilter) = filter {
            unfilter(&mut bytes, count, stride, &mut workspace)?;
        }
        Ok::<_, meshoptimizer_rs::Error>(bytes)
    })
    .map_err(failed)?
    .map_err(|error| failed(error.to_string()))?;
    Ok(Some(DecodedView { bytes, stride: (mode == "ATTRIBUTES").then_some(stride) }))
}

/// Function that reverses a filter. Its arguments are the data, the number of elements and the size
/// of an element in bytes.
type UnfilterFn =
    fn(&mut [u8], usize, usize, &mut Workspace) -> Result<(), meshoptimizer_rs::Error>;

/// Counts decoded bytes against the limits before they are allocated.
fn reserve(bytes: u64, item: &Item<'_>, context: &LoadContext) -> Result<(), LoadError> {
    if bytes > MAX_BYTES {
        let message = format!("found {bytes} bytes of decoded data, expected at most {MAX_BYTES}");
        return Err(item.error(message));
    }
    context.reserve(bytes).map(drop).map_err(|why| item.error(why))
}

/// Makes a buffer view refer to decoded bytes.
fn replace_view(json: &mut Value, index: usize, view: DecodedView, buffers: &mut Buffers<'_>) {
    let mut new = new_view(json, view.bytes, buffers);
    if let (Some(stride), Value::Object(new)) = (view.stride, &mut new) {
        new.insert("byteStride".to_owned(), stride.into());
    }
    if let Some(view) = json.get_mut("bufferViews").and_then(|views| views.get_mut(index)) {
        *view = new;
    }
}

/// Adds a buffer and returns a view of all of it.
fn new_view(json: &mut Value, bytes: Vec<u8>, buffers: &mut Buffers<'_>) -> Value {
    let length = bytes.len();
    let number = buffers.push(bytes);
    if let Some(Value::Array(all)) = json.get_mut("buffers") {
        // Unreadable buffers have entries as well.
        all.resize(number, Value::Object(Map::new()));
        all.push(json!({ "byteLength": length }));
    }
    json!({ "buffer": number, "byteLength": length })
}

/// A decoded primitive.
struct DecodedPrimitive {
    /// Indices of 32 bits, three per triangle.
    indices: Vec<u8>,
    /// Name, accessor and data of each attribute.
    attributes: Vec<(String, Value, Vec<u8>)>,
}

/// Decodes a primitive, if it is compressed.
fn draco_primitive(
    root: &Item<'_>,
    primitive: &Item<'_>,
    buffers: &Buffers<'_>,
    context: &LoadContext,
) -> Result<Option<DecodedPrimitive>, LoadError> {
    let Some(found) = primitive.extension(DRACO)? else { return Ok(None) };
    let view = buffers.view(root, found.needed("bufferView")?, &found, "bufferView")?;
    let room = context.room().min(MAX_BYTES);
    let limits = DecodeLimits::default()
        .with_max_points(room / 12)
        .with_max_faces(room / 12)
        .with_max_decoded_bytes(room);
    let failed = |why: String| found.error(format!("damaged compressed data: {why}"));
    let mesh = guarded("Draco data", || {
        let mut source = DecoderBuffer::new(view.bytes).with_limits(limits);
        let mut mesh = Mesh::new();
        MeshDecoder::new().decode(&mut source, &mut mesh).map(|()| mesh)
    })
    .map_err(failed)?
    .map_err(|error| failed(error.to_string()))?;
    let (points, triangles) = (mesh.num_points(), mesh.num_faces());
    reserve(12 * triangles as u64, &found, context)?;
    let indices = mesh.faces().iter().flatten().flat_map(|point| point.0.to_le_bytes()).collect();
    let named = found.child("attributes")?.ok_or_else(|| found.error("missing \"attributes\""))?;
    let accessors = primitive.child("attributes")?;
    let accessors = accessors.ok_or_else(|| primitive.error("missing \"attributes\""))?;
    let mut attributes = Vec::new();
    for name in named.names() {
        let id = named.needed(name)?;
        let attribute = u32::try_from(id).ok().and_then(|id| mesh.attribute_by_unique_id(id));
        let attribute = attribute.ok_or_else(|| {
            named.refuse(name, format!("missing attribute {id} in the compressed data"))
        })?;
        let Some(index) = accessors.whole(name)? else { continue };
        let accessor = root.member("accessors", index, &accessors, name)?;
        let (code, size) = component(attribute.data_type()).ok_or_else(|| {
            named.refuse(name, format!("unsupported number type {:?}", attribute.data_type()))
        })?;
        let size = size * usize::from(attribute.num_components());
        reserve(points as u64 * size as u64, &found, context)?;
        let values = values(attribute, points, size).ok_or_else(|| {
            named.refuse(name, "the compressed data have fewer values than the accessor")
        })?;
        let mut described = accessor.without(&["bufferView", "byteOffset", "sparse"]);
        described.insert("componentType".to_owned(), code.into());
        described.insert("count".to_owned(), points.into());
        attributes.push((name.to_owned(), Value::Object(described), values));
    }
    Ok(Some(DecodedPrimitive { indices, attributes }))
}

/// Returns the code of a component type and its size in bytes. [glTF 2.0, §3.6.2.2]
fn component(kind: DataType) -> Option<(u32, usize)> {
    Some(match kind {
        DataType::Int8 => (5120, 1),
        DataType::Uint8 | DataType::Bool => (5121, 1),
        DataType::Int16 => (5122, 2),
        DataType::Uint16 => (5123, 2),
        DataType::Uint32 => (5125, 4),
        DataType::Float32 => (5126, 4),
        DataType::Invalid
        | DataType::Int32
        | DataType::Int64
        | DataType::Uint64
        | DataType::Float64 => return None,
    })
}

/// Returns the values of an attribute at all points, tightly packed, or `None` if some are missing.
fn values(attribute: &PointAttribute, points: usize, size: usize) -> Option<Vec<u8>> {
    let (data, stride) =
        (attribute.buffer().data(), usize::try_from(attribute.byte_stride()).ok()?);
    let mut values = Vec::with_capacity(points * size);
    for point in 0..u32::try_from(points).ok()? {
        let index = attribute.mapped_index(PointIndex(point)).0 as usize;
        let start = index.checked_mul(stride)?;
        values.extend_from_slice(data.get(start..start.checked_add(size)?)?);
    }
    Some(values)
}

/// Makes a primitive refer to decoded triangles and attributes.
fn replace_primitive(
    json: &mut Value,
    [mesh, primitive]: [usize; 2],
    decoded: DecodedPrimitive,
    buffers: &mut Buffers<'_>,
) {
    let DecodedPrimitive { indices, attributes } = decoded;
    let count = indices.len() / size_of::<u32>();
    let described = json!({ "componentType": 5125, "count": count, "type": "SCALAR" });
    let indices = new_accessor(json, described, indices, buffers);
    let attributes: Vec<(String, usize)> = attributes
        .into_iter()
        .map(|(name, described, values)| (name, new_accessor(json, described, values, buffers)))
        .collect();
    let Some(Value::Object(primitive)) = json
        .get_mut("meshes")
        .and_then(|meshes| meshes.get_mut(mesh)?.get_mut("primitives")?.get_mut(primitive))
    else {
        return;
    };
    if let Some(Value::Object(extensions)) = primitive.get_mut("extensions") {
        extensions.remove(DRACO);
    }
    primitive.insert("mode".to_owned(), 4.into());
    primitive.insert("indices".to_owned(), indices.into());
    if let Some(Value::Object(named)) = primitive.get_mut("attributes") {
        named.extend(attributes.into_iter().map(|(name, index)| (name, index.into())));
    }
}

/// Adds an accessor for all of a new buffer and returns its index.
fn new_accessor(
    json: &mut Value,
    mut described: Value,
    bytes: Vec<u8>,
    buffers: &mut Buffers<'_>,
) -> usize {
    let view = new_view(json, bytes, buffers);
    let views = list(json, "bufferViews");
    views.push(view);
    let view = views.len() - 1;
    if let Value::Object(described) = &mut described {
        described.insert("bufferView".to_owned(), view.into());
    }
    let accessors = list(json, "accessors");
    accessors.push(described);
    accessors.len() - 1
}

/// Returns a top-level array, which is created if it is missing.
fn list<'j>(json: &'j mut Value, name: &str) -> &'j mut Vec<Value> {
    if !json[name].is_array() {
        json[name] = Value::Array(Vec::new());
    }
    json[name].as_array_mut().expect("a list")
}
