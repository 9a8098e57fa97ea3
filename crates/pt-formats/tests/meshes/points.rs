//! Points and lines in all formats that support them.

use std::path::Path;
use std::sync::Arc;

use pt_formats::{LoadOptions, load, parse_with, save};
use pt_math::color::linear_from_srgb;
use pt_math::{DAffine3, DVec3};
use pt_scene::material::Diffuse;
use pt_scene::texture::{Color, Pattern};
use pt_scene::{Geometry, Object, Points, Scene, Surface};
use serde_json::json;

use super::common::{check_invariants, parse};

fn read(text: &str, name: &str) -> Scene {
    let scene = parse(text.as_bytes(), Path::new(name)).unwrap_or_else(|error| panic!("{error}"));
    check_invariants(&scene);
    scene
}

fn refusal(text: &str, name: &str) -> String {
    parse(text.as_bytes(), Path::new(name)).expect_err("it makes no sense").to_string()
}

fn points(object: &Object) -> &Arc<Points> {
    let Geometry::Points { points, radius: None } = &object.geometry else { panic!("no points") };
    points
}

/// Returns the only points of a scene.
fn only(scene: &Scene) -> &Arc<Points> {
    let [object] = scene.objects.as_slice() else { panic!("{} objects", scene.objects.len()) };
    points(object)
}

/// Returns true if the material of an object has the colours of points.
fn shows_colors(scene: &Scene, object: usize) -> bool {
    let material = scene.objects[object].materials[0].expect("a material");
    let Surface::Diffuse(Diffuse { reflectance: Color::Texture(texture), .. }) =
        &scene.materials[material as usize].surface
    else {
        return false;
    };
    texture.pattern == Pattern::VertexColors
}

const CLOUD: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                     property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n";

#[test]
fn vertices_of_ply_without_faces_are_points_in_their_colours() {
    let scene =
        read(&format!("{CLOUD}end_header\n0 0 0 255 0 0\n1 0 0 0 51 0\n0 1 0 0 0 0\n"), "a.ply");
    let points = only(&scene);
    assert_eq!(points.positions, [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    let green = linear_from_srgb(0.2);
    assert_eq!(points.colors.as_deref(), Some(&[[1.0, 0.0, 0.0], [0.0, green, 0.0], [0.0; 3]][..]));
    assert!(points.segments.is_empty() && shows_colors(&scene, 0));
    assert!(scene.warnings.is_empty());
}

/// The element `face` may exist without any rows.
#[test]
fn ply_files_with_no_face_are_points() {
    let header = CLOUD.replace(
        "property uchar red\nproperty uchar green\nproperty uchar blue\n",
        "element face 0\nproperty list uchar int vertex_indices\n",
    );
    let scene = read(&format!("{header}end_header\n0 0 0\n1 0 0\n0 1 0\n"), "a.ply");
    assert!(only(&scene).colors.is_none());
    assert_eq!(scene.objects[0].materials, [None]);
    let header = header.replace("face 0", "face 1");
    let scene = read(&format!("{header}end_header\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n"), "a.ply");
    assert_eq!(only(&scene).positions.len(), 3);
    let is_noted = scene.warnings.iter().any(|w| w.message.contains("shown as points"));
    assert!(is_noted, "{:?}", scene.warnings);
}

#[test]
fn edges_of_ply_are_segments() {
    let rows = "0 0 0 255 0 0\n1 0 0 0 51 0\n0 1 0 0 0 0\n";
    let edges = "element edge 2\nproperty int vertex1\nproperty int vertex2\nproperty uchar red\n";
    let scene = read(&format!("{CLOUD}{edges}end_header\n{rows}0 1 9\n2 0 9\n"), "a.ply");
    assert_eq!(only(&scene).segments, [[0, 1], [2, 0]]);
    let message = refusal(&format!("{CLOUD}{edges}end_header\n{rows}0 1 9\n2 3 9\n"), "a.ply");
    assert!(message.contains("found vertex 3 in edge 1, expected 0 to 2"), "{message}");
}

/// Missing measurements of scanners are removed, in text and binary files.
#[test]
fn points_that_are_nowhere_are_left_out() {
    let text = format!("{CLOUD}end_header\n0 0 0 255 0 0\nnan nan nan 0 51 0\n0 1 0 0 0 255\n");
    let header = CLOUD.replace("ascii", "binary_little_endian");
    let mut binary = format!("{header}end_header\n").into_bytes();
    for (p, color) in
        [([0.0; 3], [255, 0, 0]), ([f32::NAN; 3], [0, 51, 0]), ([0.0, 1.0, 0.0], [0, 0, 255])]
    {
        binary.extend(p.into_iter().flat_map(f32::to_le_bytes).chain(color));
    }
    for bytes in [text.as_bytes(), &binary] {
        let scene = parse(bytes, Path::new("a.ply")).unwrap_or_else(|error| panic!("{error}"));
        check_invariants(&scene);
        let points = only(&scene);
        assert_eq!(points.positions, [[0.0; 3], [0.0, 1.0, 0.0]]);
        assert_eq!(points.colors.as_deref(), Some(&[[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]][..]));
        let [warning] = scene.warnings.as_slice() else { panic!("{:?}", scene.warnings) };
        assert!(warning.message.ends_with("non-finite coordinates are omitted: 1"), "{warning}");
    }
}

#[test]
fn vertices_of_obj_alone_are_points() {
    let scene = read("o a\nv 0 0 0 1 0.5 0\nv 1 0 0 0 0 1\n", "a.obj");
    let points = only(&scene);
    assert_eq!(points.name, "a");
    assert_eq!(points.positions, [[0.0; 3], [1.0, 0.0, 0.0]]);
    let half = linear_from_srgb(0.5);
    assert_eq!(points.colors.as_deref(), Some(&[[1.0, half, 0.0], [0.0, 0.0, 1.0]][..]));
    assert!(shows_colors(&scene, 0));
    let scene = read("v 0 0 0\nv 1 0 0\n", "a.obj");
    assert_eq!(scene.objects[0].materials, [None]);
    assert!(refusal("o nothing\n", "a.obj").contains("no faces"));
    // With an invalid face, the vertices are not points.
    assert!(refusal("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "a.obj").contains("expected an index"));
}

/// Points and lines of each material are an object; indices may be relative, and have texture
/// coordinates.
#[test]
fn points_and_lines_of_obj_have_their_materials() {
    let text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 5 5 5\nvt 0 0\nf 1 2 3\nl 1/1 2/1 3/1\n\
                usemtl red\nl -5 -2\np 5\nusemtl other\nl 4 1\nusemtl red\np 1 2\n";
    let scene = read(text, "a.obj");
    let [mesh, bare, red, other] = scene.objects.as_slice() else {
        panic!("{} objects", scene.objects.len())
    };
    assert!(matches!(&mesh.geometry, Geometry::Mesh(mesh) if mesh.triangles.len() == 1));
    assert_eq!(points(bare).positions, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    assert_eq!(points(bare).segments, [[0, 1], [1, 2]]);
    let all = [[0.0; 3], [0.0, 1.0, 0.0], [5.0; 3], [1.0, 0.0, 0.0]];
    assert_eq!(points(red).positions, all);
    assert_eq!(points(red).segments, [[0, 1]]);
    assert_eq!(points(other).segments, [[0, 1]]);
    assert_eq!(points(other).positions, [[0.0, 1.0, 0.0], [0.0; 3]]);
    assert!(refusal("v 0 0 0\nv 1 0 0\nl 1 3\n", "a.obj").contains("expected an index"));
    let scene = read("v 0 0 0\nv 1 0 0\nl 1\nl 1 2\n", "a.obj");
    assert_eq!(only(&scene).segments, [[0, 1]]);
    assert!(
        scene.warnings[0]
            .message
            .contains("found fewer than two points of a line, expected at least two")
    );
}

#[test]
fn materials_of_lines_are_those_of_the_library() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.obj");
    std::fs::write(folder.path().join("a.mtl"), "newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\n")
        .expect("a file");
    let text = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl blue\nl 1 2\nusemtl red\nl 2 3\n";
    std::fs::write(&path, text).expect("a file");
    let scene = load(&path).unwrap_or_else(|error| panic!("{error}"));
    let names = scene.objects.iter().map(|object| {
        let material = object.materials[0].expect("a material");
        scene.materials[material as usize].name.as_str()
    });
    assert_eq!(names.collect::<Vec<_>>(), ["blue", "red"]);
}

/// Returns a file of four points with primitives of these modes and indices.
fn gltf(primitives: &[(u32, Option<&[u8]>)], node: &serde_json::Value) -> String {
    let mut bytes = Vec::new();
    let positions = [[0.0_f32, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    bytes.extend(positions.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
    let mut views = vec![json!({"buffer": 0, "byteLength": bytes.len()})];
    bytes.extend([255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 51, 51, 51, 255]);
    views.push(json!({"buffer": 0, "byteOffset": 48, "byteLength": 16}));
    let mut accessors = vec![
        json!({"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
               "min": [0, 0, 0], "max": [1, 1, 0]}),
        json!({"bufferView": 1, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": true}),
    ];
    let mut written = Vec::new();
    for (mode, indices) in primitives {
        let mut primitive = json!({"attributes": {"POSITION": 0, "COLOR_0": 1}, "mode": mode});
        if let Some(indices) = indices {
            let (start, length) = (bytes.len(), indices.len());
            views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
            bytes.extend_from_slice(indices);
            accessors.push(json!({"bufferView": views.len() - 1, "componentType": 5121,
                                  "count": length, "type": "SCALAR"}));
            primitive["indices"] = (accessors.len() - 1).into();
        }
        written.push(primitive);
    }
    let uri = bytes.iter().fold(String::new(), |uri, byte| uri + &format!("%{byte:02X}"));
    json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [node],
        "meshes": [{"primitives": written}], "accessors": accessors, "bufferViews": views,
        "buffers": [{"byteLength": bytes.len(), "uri": format!("data:application/octet-stream,{uri}")}]
    })
    .to_string()
}

#[test]
fn points_and_lines_of_gltf_are_shown() {
    let modes: [(u32, Option<&[u8]>); 6] =
        [(0, None), (0, Some(&[2, 1])), (1, None), (2, None), (3, None), (3, Some(&[3, 1, 0]))];
    let scene = read(&gltf(&modes, &json!({"mesh": 0, "scale": [2, 2, 2]})), "a.gltf");
    assert_eq!(scene.objects.len(), 6);
    let of = |object: usize| points(&scene.objects[object]);
    assert_eq!(of(0).positions.len(), 4);
    assert_eq!(of(1).positions, [[1.0, 1.0, 0.0], [1.0, 0.0, 0.0]]);
    assert_eq!(of(1).colors.as_deref(), Some(&[[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]][..]));
    assert_eq!(of(2).segments, [[0, 1], [2, 3]]);
    assert_eq!(of(3).segments, [[0, 1], [1, 2], [2, 3], [3, 0]]);
    assert_eq!(of(4).segments, [[0, 1], [1, 2], [2, 3]]);
    assert_eq!(of(5).segments, [[3, 1], [1, 0]]);
    // Colours of glTF are linear.
    assert_eq!(of(0).colors.as_deref().map(|colors| colors[3]), Some([0.2; 3]));
    let at = scene.objects[0].to_world.transform_point3(DVec3::ONE);
    assert_eq!(at, DVec3::splat(2.0));
    let message = refusal(&gltf(&[(1, Some(&[0, 4]))], &json!({"mesh": 0})), "a.gltf");
    assert!(message.contains("found index 4, expected an index of"), "{message}");
    assert!(refusal(&gltf(&[(7, None)], &json!({"mesh": 0})), "a.gltf").contains("found mode 7"));
}

/// A radius in the options is in world units, whatever the scale of an object.
#[test]
fn a_radius_that_is_given_is_the_same_for_all() {
    let text = gltf(&[(0, None), (1, None)], &json!({"mesh": 0, "scale": [2, 4, 1]}));
    let options = LoadOptions { point_radius: Some(0.1), ..LoadOptions::default() };
    let scene = parse_with(text.as_bytes(), Path::new("a.gltf"), &options).expect("a scene");
    for object in &scene.objects {
        let Geometry::Points { radius: Some(radius), .. } = object.geometry else { panic!("none") };
        assert!((radius - 0.05).abs() < 1e-12);
    }
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let scene = parse_with(mesh.as_bytes(), Path::new("a.obj"), &options).expect("a scene");
    assert!(scene.warnings[0].message.contains("no points or lines"), "{:?}", scene.warnings);
}

fn scene_of(points: Points, radius: Option<f64>) -> Scene {
    let object = Object {
        name: "cloud".into(),
        to_world: DAffine3::from_translation(DVec3::X),
        motion: None,
        geometry: Geometry::Points { points: Arc::new(points), radius },
        materials: vec![None],
        media: None,
        at: pt_scene::Span::default(),
    };
    Scene {
        objects: vec![object.clone(), Object { name: "again".into(), ..object }].into(),
        ..Scene::default()
    }
}

/// Small point sets are inline, large ones in files of arrays; shared ones stay shared.
#[test]
fn points_are_written_and_read_as_they_were() {
    for count in [4, 4000] {
        let positions: Vec<_> =
            (0..count).map(|i| [i as f32 * 0.1, (i % 7) as f32, -1.5]).collect();
        let colors = positions.iter().map(|[x, ..]| [x * 1e-3, 0.5, 1.0]).collect();
        let points = Points {
            name: "some".into(),
            positions,
            colors: Some(colors),
            segments: vec![[0, 1], [3, 2]],
        };
        for (points, radius) in [
            (points.clone(), Some(0.25)),
            (Points { colors: None, segments: Vec::new(), ..points }, None),
        ] {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("a.json");
            save(&scene_of(points.clone(), radius), &path, false).expect("it can be written");
            let scene = load(&path).unwrap_or_else(|error| panic!("{error}"));
            let found = scene.objects.iter().map(|object| match &object.geometry {
                Geometry::Points { points, radius } => (Arc::clone(points), *radius),
                other => panic!("{other:?}"),
            });
            let found: Vec<_> = found.collect();
            assert!(Arc::ptr_eq(&found[0].0, &found[1].0));
            assert!(*found[0].0 == points && found[0].1 == radius);
        }
    }
}

#[test]
fn points_of_our_own_files_may_be_of_other_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("a file");
        path
    };
    write("a.ply", &format!("{CLOUD}end_header\n0 0 0 255 0 0\n1 0 0 0 51 0\n0 1 0 0 0 0\n"));
    write("a.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nl 1 2\n");
    let scene = |points: &str| {
        let text = format!(
            "{{\"pathtracer\": 1, \"objects\": [{{\"type\": \"points\", \"points\": {points}}}]}}"
        );
        load(&write("scene.json", &text)).map_err(|error| error.to_string())
    };
    let of = |points: &str| Arc::clone(only(&scene(points).expect("a scene")));
    assert_eq!(of("{\"file\": \"a.ply\"}").colors.as_ref().map(Vec::len), Some(3));
    assert_eq!(of("{\"file\": \"a.obj\"}").segments, [[0, 1]]);
    assert_eq!(of("{\"positions\": [[1, 2, 3]]}").positions, [[1.0, 2.0, 3.0]]);
    let cases = [
        ("{}", "expected \"file\" or \"positions\""),
        ("{\"positions\": []}", "missing \"positions\""),
        (
            "{\"positions\": [[1, 2, 3]], \"colors\": []}",
            "found 0 \"colors\" for 1 points, expected the same number",
        ),
        ("{\"positions\": [[1, 2, 3]], \"segments\": [[0, 1]]}", "found index 1 in \"segments\""),
        ("{\"file\": \"a.stl\"}", "a.stl"),
        ("{\"file\": \"scene.json\"}", "unknown point format"),
    ];
    for (points, want) in cases {
        let message = scene(points).expect_err("it makes no sense");
        assert!(message.contains(want), "{message}");
    }
}

/// Points without a segment are kept; a radius has a warning.
#[test]
fn gltf_has_points_and_lines_as_they_were() {
    let points = Points {
        name: "some".into(),
        positions: vec![[0.0; 3], [1.0, 2.0, 3.0], [4.0; 3]],
        colors: Some(vec![[0.25, 0.5, 1.0]; 3]),
        segments: vec![[2, 0]],
    };
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.glb");
    let notes = save(&scene_of(points, Some(0.5)), &path, false).expect("it can be written");
    assert!(
        notes.iter().any(|note| note.contains("radius of points and lines is not representable")),
        "{notes:?}"
    );
    let scene = load(&path).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(scene.objects.len(), 4);
    let [lines, alone] = [0, 1].map(|i| points_of(&scene.objects[i]));
    assert_eq!(lines.positions.len(), 3);
    assert_eq!(lines.segments, [[2, 0]]);
    assert_eq!(alone.positions, [[1.0, 2.0, 3.0]]);
    assert_eq!(alone.colors.as_deref(), Some(&[[0.25, 0.5, 1.0]][..]));
}

fn points_of(object: &Object) -> Arc<Points> {
    Arc::clone(points(object))
}
