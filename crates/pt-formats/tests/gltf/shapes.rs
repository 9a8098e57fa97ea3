//! Nodes, meshes, skins and instances.

use std::sync::Arc;

use pt_math::DVec3;
use pt_scene::{Geometry, Mesh, Scene};
use serde_json::{Value, json};

use super::text::Text;
use super::{read, refusal};

fn mesh(scene: &Scene, object: usize) -> &Arc<Mesh> {
    match &scene.objects[object].geometry {
        Geometry::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

/// Returns the position of the origin of an object in the world, and the lengths of its axes.
fn place(scene: &Scene, object: usize) -> (DVec3, DVec3) {
    let to_world = scene.objects[object].to_world;
    let axes = to_world.matrix3;
    (
        to_world.translation,
        DVec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length()),
    )
}

/// A scene of these nodes, whose mesh 0 is a triangle.
fn nodes(nodes: &Value) -> String {
    let mut text = Text::default();
    let attributes = text.triangle();
    text.with(json!({"nodes": nodes, "meshes": [{"primitives": [{"attributes": attributes}]}]}))
}

#[test]
fn nodes_scale_then_turn_then_move() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let scene = read(&nodes(&json!([
        {"children": [1], "translation": [1, 0, 0]},
        {"mesh": 0, "translation": [0, 5, 0], "rotation": [0, 0, half, half], "scale": [2, 3, 4]}
    ])));
    let to_world = scene.objects[0].to_world;
    // +x, of length 2, is rotated to +y.
    let found = to_world.transform_point3(DVec3::X);
    assert!(found.distance(DVec3::new(1.0, 7.0, 0.0)) < 1e-12, "{found}");
    assert!(place(&scene, 0).1.distance(DVec3::new(2.0, 3.0, 4.0)) < 1e-12);
    let matrix = [0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 1, 5, 0, 1];
    let other = read(&nodes(&json!([{"mesh": 0, "matrix": matrix}]))).objects[0].to_world;
    assert!(other.abs_diff_eq(to_world, 1e-12));
}

#[test]
fn nodes_that_show_a_mesh_share_it() {
    let scene = read(&nodes(&json!([{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}])));
    assert!(Arc::ptr_eq(mesh(&scene, 0), mesh(&scene, 1)));
    let names: Vec<_> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    assert_eq!(names, ["a", "b"]);
}

#[test]
fn only_the_nodes_of_the_scene_are_shown() {
    let mut file: Value =
        serde_json::from_str(&nodes(&json!([{"mesh": 0, "name": "a"}, {"mesh": 0, "name": "b"}])))
            .expect("it was written");
    file["scenes"] = json!([{"nodes": [0]}, {"nodes": [1]}]);
    assert_eq!(read(&file.to_string()).objects[0].name, "a");
    file["scene"] = 1.into();
    let scene = read(&file.to_string());
    assert_eq!((scene.objects.len(), scene.objects[0].name.as_str()), (1, "b"));
}

#[test]
fn v_runs_upwards() {
    let mut text = Text::default();
    let mut attributes = text.triangle();
    attributes["TEXCOORD_0"] = text.vectors(&[[0.0, 0.0], [1.0, 0.25], [0.5, 1.0]]).into();
    let scene = read(&text.with(json!({
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": attributes}]}]
    })));
    let uvs = mesh(&scene, 0).uvs.as_ref().expect("it has some");
    assert_eq!(uvs.values, [[0.0, 1.0], [1.0, 0.75], [0.5, 0.0]]);
}

#[test]
fn numbers_may_be_packed_tightly() {
    let mut text = Text::default();
    let positions: Vec<u8> = [0_i16, 0, 0, 32_767, -32_768, 0, 0, 16_384, 0]
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let position = text.accessor(&positions, "VEC3", 5122, 3);
    let mut file: Value = serde_json::from_str(&text.with(json!({
        "nodes": [{"mesh": 0}], "meshes": [{"primitives": [{"attributes": {"POSITION": position}}]}]
    })))
    .expect("it was written");
    let found = read(&file.to_string());
    assert_eq!(mesh(&found, 0).positions[1], [32_767.0, -32_768.0, 0.0]);
    file["accessors"][position]["normalized"] = true.into();
    let found = read(&file.to_string());
    assert_eq!(mesh(&found, 0).positions[1], [1.0, -1.0, 0.0]);
    assert_eq!(mesh(&found, 0).positions[2], [0.0, 16_384.0 / 32_767.0, 0.0]);
}

#[test]
fn morph_targets_are_added_by_the_weights_of_the_node_or_else_of_the_mesh() {
    let mut text = Text::default();
    let attributes = text.triangle();
    let moved = text.vectors(&[[0.0, 0.0, 4.0]; 3]);
    let primitive = json!({"attributes": attributes, "targets": [{"POSITION": moved}]});
    let scene = read(&text.with(json!({
        "nodes": [{"mesh": 0}, {"mesh": 0, "weights": [0.25]}, {"mesh": 0}],
        "meshes": [{"primitives": [primitive], "weights": [0.5]}]
    })));
    let height = |object: usize| mesh(&scene, object).positions[0][2];
    assert_eq!([height(0), height(1), height(2)], [2.0, 1.0, 2.0]);
}

/// The triangle is bound to a joint at (1, 0, 0), which is now at (0, 5, 0).
#[test]
fn skins_follow_their_joints_and_not_their_node() {
    let mut text = Text::default();
    let mut attributes = text.triangle();
    attributes["JOINTS_0"] = text.accessor(&[0; 12], "VEC4", 5121, 3).into();
    attributes["WEIGHTS_0"] = text.vectors(&[[2.0, 0.0, 0.0, 0.0]; 3]).into();
    let mut bound = [0.0; 16];
    [bound[0], bound[5], bound[10], bound[15], bound[12]] = [1.0, 1.0, 1.0, 1.0, -1.0];
    let bound = text.vectors(&[bound]);
    let scene = read(&text.with(json!({
        "nodes": [{"mesh": 0, "skin": 0, "translation": [9, 9, 9]}, {"translation": [0, 5, 0]}],
        "skins": [{"joints": [1], "inverseBindMatrices": bound}],
        "meshes": [{"primitives": [{"attributes": attributes}]}]
    })));
    assert_eq!(place(&scene, 0), (DVec3::ZERO, DVec3::ONE));
    assert_eq!(mesh(&scene, 0).positions[1], [0.0, 5.0, 0.0]);
}

#[test]
fn copies_stand_where_their_accessors_say() {
    let mut text = Text::default();
    let attributes = text.triangle();
    let moved = text.vectors(&[[1.0, 0.0, 0.0], [0.0, 2.0, 0.0]]);
    let scaled = text.vectors(&[[1.0; 3], [3.0; 3]]);
    let copies = json!({"attributes": {"TRANSLATION": moved, "SCALE": scaled}});
    let scene = read(&text.with(json!({
        "nodes": [{"mesh": 0, "scale": [2, 2, 2], "extensions": {"EXT_mesh_gpu_instancing": copies}}],
        "meshes": [{"primitives": [{"attributes": attributes}]}]
    })));
    assert_eq!(place(&scene, 0), (DVec3::new(2.0, 0.0, 0.0), DVec3::splat(2.0)));
    assert_eq!(place(&scene, 1), (DVec3::new(0.0, 4.0, 0.0), DVec3::splat(6.0)));
    assert!(Arc::ptr_eq(mesh(&scene, 0), mesh(&scene, 1)));
}

/// Deeper than any call stack.
#[test]
fn nodes_may_be_nested_deeply() {
    const DEPTH: usize = 50_000;
    let mut all: Vec<_> =
        (1..DEPTH).map(|child| json!({"children": [child], "translation": [1, 0, 0]})).collect();
    all.push(json!({"mesh": 0}));
    let scene = read(&nodes(&all.into()));
    assert_eq!(place(&scene, 0).0, DVec3::new(DEPTH as f64 - 1.0, 0.0, 0.0));
}

#[test]
fn textures_without_coordinates_have_a_note() {
    let mut text = Text::default();
    let attributes = text.triangle();
    let scene = read(&text.with(json!({
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "material": 0}]}],
        "materials": [{"emissiveTexture": {"index": 0, "texCoord": 1}}]
    })));
    let note = scene.warnings[0].to_string();
    assert!(note.contains("meshes[0].primitives[0]: missing TEXCOORD_1"), "{note}");
}

#[test]
fn primitives_cannot_multiply() {
    let mut text = Text::default();
    let primitives = vec![json!({"attributes": text.triangle()}); 2000];
    let nodes = vec![json!({"mesh": 0}); 600];
    let error =
        refusal(&text.with(json!({"nodes": nodes, "meshes": [{"primitives": primitives}]})));
    assert!(error.contains("exceeds 1000000 primitives"), "{error}");
}

/// A default scene that does not exist, without any scenes, shows all nodes.
#[test]
fn all_nodes_are_shown_where_there_are_no_scenes() {
    let mut text = Text::default();
    let attributes = text.triangle();
    let scene = read(&text.with(json!({
        "scene": 0,
        "nodes": [{"mesh": 0}, {"children": [0], "translation": [0, 0, 3]}],
        "meshes": [{"primitives": [{"attributes": attributes}]}]
    })));
    assert_eq!(scene.objects.len(), 1);
    assert_eq!(place(&scene, 0).0, DVec3::new(0.0, 0.0, 3.0));
    assert!(scene.warnings.iter().any(|w| w.message.contains("all nodes are shown")));
}
