//! Compressed geometry: files of other programs, and damaged files of ours.

use draco_core::{
    DataType, EncoderBuffer, EncoderOptions, GeometryAttributeType, Mesh as DracoMesh, MeshEncoder,
    PointAttribute,
};
use pt_formats::{LoadError, load};
use pt_math::DVec3;
use pt_scene::{Geometry, Scene};
use serde_json::{Value, json};

use super::text::Text;
use super::{folder, parse, read};

/// A corner of a triangle: position, normal, texture coordinates and colour.
type Corner = [f64; 11];

/// Corners of all triangles.
fn corners(scene: &Scene) -> Vec<Corner> {
    let object = &scene.objects[0];
    let Geometry::Mesh(mesh) = &object.geometry else { panic!("no mesh") };
    let (to_world, to_normal) = (object.to_world, object.to_world.matrix3.inverse().transpose());
    let corner = |vertex: u32| {
        let vector = |values: &[[f32; 3]]| DVec3::from(values[vertex as usize].map(f64::from));
        let p = to_world.transform_point3(vector(&mesh.positions));
        let n = (to_normal * vector(&mesh.normals.as_ref().expect("normals").values)).normalize();
        let uv = mesh.uvs.as_ref().expect("coordinates").values[vertex as usize].map(f64::from);
        let color = vector(&mesh.colors.as_ref().expect("colours").values);
        let all = [p.to_array().as_slice(), &n.to_array(), &uv, &color.to_array()].concat();
        all.try_into().expect("11 numbers")
    };
    mesh.triangles.as_flattened().iter().map(|vertex| corner(*vertex)).collect()
}

fn good(name: &str) -> Scene {
    load(&folder("gltf").join("good").join(name)).unwrap_or_else(|error| panic!("{error}"))
}

/// A torus, uncompressed and as other programs wrote it: Google's Draco 1.5.7 with both of its
/// methods and 16 bits for positions, 12 for normals, 14 for texture coordinates and 10 for
/// colours; meshoptimizer without loss; and gltfpack with 14, 8, 12 and 8 bits, in both forms of
/// the extension.
#[test]
fn compressed_geometry_is_the_geometry() {
    let plain = corners(&good("torus.glb"));
    for (name, [of_position, of_normal, of_uv, of_color]) in [
        ("draco_edgebreaker", [16, 10, 14, 10]),
        ("draco_sequential", [16, 10, 14, 10]),
        ("meshopt_plain", [23; 4]),
        ("meshopt_filtered", [13, 6, 11, 7]),
        ("meshopt_khr", [13, 6, 11, 7]),
    ] {
        let scene = good(&format!("torus_{name}.glb"));
        assert_eq!(scene.warnings, [], "{name}");
        let found = corners(&scene);
        assert_eq!(found.len(), plain.len(), "{name}");
        // Quantization steps over the extent: 2.8 for positions, 2 for normals, and 1.
        let step = |extent: f64, bits: i32| extent * 0.5_f64.powi(bits);
        let most: [f64; 11] = std::array::from_fn(|i| match i {
            0..3 => step(2.8, of_position),
            3..6 => step(2.0, of_normal),
            6..8 => step(1.0, of_uv),
            _ => step(1.0, of_color),
        });
        let is_near =
            |a: &Corner, b: &Corner| (0..11).all(|i| (a[i] - b[i]).abs() <= most[i] + 1e-6);
        // Triangles may begin at another corner, and be in another order.
        for triangle in plain.as_chunks::<3>().0 {
            let is_found = found.as_chunks::<3>().0.iter().any(|other| {
                (0..3).any(|turn| (0..3).all(|c| is_near(&triangle[c], &other[(c + turn) % 3])))
            });
            assert!(is_found, "{name}: {triangle:?}");
        }
    }
}

/// A triangle as Draco data.
fn draco_triangle() -> Vec<u8> {
    let mut mesh = DracoMesh::new();
    mesh.set_num_points(3);
    let mut positions = PointAttribute::new();
    positions.init(GeometryAttributeType::Position, 3, DataType::Float32, false, 3);
    positions.buffer_mut().update_f32s_le(0, &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    mesh.add_attribute(positions);
    mesh.set_num_faces(1);
    mesh.set_faces_from_flat_indices(&[0, 1, 2]);
    let mut encoded = EncoderBuffer::new();
    let mut encoder = MeshEncoder::new();
    encoder.set_mesh(mesh);
    encoder.encode(&EncoderOptions::default(), &mut encoded).expect("a triangle");
    encoded.data().to_vec()
}

/// A scene of one primitive with these data and their description.
fn with_draco(data: &[u8], mut said: Value) -> String {
    said["bufferView"] = 0.into();
    let text = bytes_and(
        data,
        json!({
            "extensionsUsed": ["KHR_draco_mesh_compression"],
            "extensionsRequired": ["KHR_draco_mesh_compression"],
            "nodes": [{"mesh": 0}],
            "meshes": [{"primitives": [{
                "attributes": {"POSITION": 0},
                "extensions": {"KHR_draco_mesh_compression": said}
            }]}]
        }),
    );
    let mut json: Value = serde_json::from_str(&text).expect("our own");
    json["accessors"] = json!([{"componentType": 5126, "count": 3, "type": "VEC3"}]);
    json.to_string()
}

/// A file with the given fields, and a view of the given bytes.
fn bytes_and(bytes: &[u8], fields: Value) -> String {
    let mut text = Text::default();
    text.accessor(bytes, "SCALAR", 5121, bytes.len());
    text.with(fields)
}

fn errors(text: &str) -> String {
    let path = folder("gltf").join("good").join("test.gltf");
    match parse(text.as_bytes(), &path) {
        Ok(scene) => panic!("it is read: {:?}", scene.warnings),
        Err(LoadError::Several(all)) => {
            all.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
        }
        Err(error) => error.to_string(),
    }
}

#[test]
fn draco_data_are_checked_against_the_file() {
    let data = draco_triangle();
    let scene = read(&with_draco(&data, json!({"attributes": {"POSITION": 0}})));
    let Geometry::Mesh(mesh) = &scene.objects[0].geometry else { panic!("no mesh") };
    assert_eq!(mesh.triangles.len(), 1);
    for (said, data, expected) in [
        (json!({"attributes": {"POSITION": 7}}), &data[..], "missing attribute 7"),
        (json!({}), &data, "missing \"attributes\""),
        (
            json!({"attributes": {"POSITION": 0}}),
            &data[..data.len() / 2],
            "damaged compressed data",
        ),
        (json!({"attributes": {"POSITION": 0}}), b"DRACO", "damaged compressed data"),
    ] {
        let found = errors(&with_draco(data, said));
        assert!(found.contains(expected), "{found}");
    }
}

/// Every byte of compressed data changed, and data truncated at any length.
#[test]
fn damaged_data_do_no_harm() {
    let data = draco_triangle();
    for place in 0..data.len() {
        for value in [0, 1, 0x7F, 0x80, 0xFF] {
            let mut damaged = data.clone();
            damaged[place] = value;
            let text = with_draco(&damaged, json!({"attributes": {"POSITION": 0}}));
            drop(parse(text.as_bytes(), &folder("gltf").join("good").join("test.gltf")));
        }
        let text = with_draco(&data[..place.max(1)], json!({"attributes": {"POSITION": 0}}));
        assert!(errors(&text).contains("damaged"), "{place}");
    }
}

fn with_meshopt(said: &Value) -> String {
    let meshes = json!([{"primitives": [{"attributes": {"POSITION": 0}}]}]);
    let text = bytes_and(&[0xA0; 64], json!({"nodes": [{"mesh": 0}], "meshes": meshes}));
    let mut json: Value = serde_json::from_str(&text).expect("our own");
    json["accessors"][0] =
        json!({"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"});
    json["bufferViews"][0]["extensions"] = json!({"EXT_meshopt_compression": said});
    json.to_string()
}

#[test]
fn meshopt_views_are_checked() {
    let said = |mode: &str, filter: &str, count: u64, stride: u64| {
        with_meshopt(&json!({
            "buffer": 0, "byteLength": 64, "byteStride": stride, "count": count, "mode": mode, "filter": filter
        }))
    };
    for (text, expected) in [
        (said("POINTS", "NONE", 3, 12), "expected ATTRIBUTES, TRIANGLES or INDICES"),
        (said("ATTRIBUTES", "BLUR", 3, 12), "expected NONE, OCTAHEDRAL"),
        (said("ATTRIBUTES", "NONE", 3, 13), "damaged compressed data"),
        (said("ATTRIBUTES", "NONE", 1 << 40, 12), "expected at most 1073741824"),
        (said("ATTRIBUTES", "NONE", 1 << 24, 12), "damaged compressed data"),
        (said("TRIANGLES", "NONE", 4, 2), "damaged compressed data"),
        (said("INDICES", "NONE", 3, 4), "damaged compressed data"),
    ] {
        let found = errors(&text);
        assert!(found.contains(expected), "{found}");
    }
}
