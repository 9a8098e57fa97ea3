//! Reader of glTF scenes.

#[path = "gltf/animation.rs"]
mod animation;
mod common;
#[path = "gltf/compressed.rs"]
mod compressed;
#[path = "gltf/image_formats.rs"]
mod image_formats;
#[path = "gltf/layers.rs"]
mod layers;
#[path = "gltf/materials.rs"]
mod materials;
#[path = "gltf/shapes.rs"]
mod shapes;
#[path = "gltf/sight.rs"]
mod sight;
#[path = "gltf/text.rs"]
mod text;
#[path = "gltf/written.rs"]
mod written;

use std::path::Path;

use common::{
    check_bad_files, check_damage, check_good_files, check_robustness, files, folder, parse,
};
use pt_formats::{LoadOptions, load_with};
use pt_scene::{Geometry, Scene, Surface};

/// Parses a scene, whose folder is that of the good files.
fn read(text: &str) -> Scene {
    let path = folder("gltf").join("good").join("test.gltf");
    let scene = parse(text.as_bytes(), &path).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    scene
}

/// Returns the error of an invalid scene.
fn refusal(text: &str) -> String {
    let path = folder("gltf").join("good").join("test.gltf");
    parse(text.as_bytes(), &path).expect_err("it is refused").to_string()
}

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    check_bad_files("gltf", "gltf");
    check_bad_files("gltf", "glb");
}

#[test]
fn good_files_give_the_expected_warnings() {
    check_good_files("gltf", "gltf");
    check_good_files("gltf", "glb");
}

#[test]
fn damaged_files_do_no_harm() {
    for ending in ["gltf", "glb"] {
        check_robustness("gltf", ending, 200 * files("gltf", "good", ending).len());
    }
}

#[test]
fn a_file_may_be_empty_but_for_its_version() {
    let scene = read(r#"{"asset": {"version": "2.0"}}"#);
    assert!(scene.objects.is_empty() && scene.cameras.is_empty() && scene.warnings.is_empty());
}

/// The scenes of the project, and those beside it, if there are any.
#[test]
fn our_scenes_are_read_without_notes() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    for entry in std::fs::read_dir(format!("{root}/scenes/gltf")).expect("the folder exists") {
        let path = entry.expect("a readable entry").path();
        if path.is_file() {
            let time = path.ends_with("animated.gltf").then_some(0.5);
            let options = LoadOptions { time, ..LoadOptions::default() };
            let scene = load_with(&path, &options).unwrap_or_else(|error| panic!("{error}"));
            common::check_invariants(&scene);
            assert!(!scene.objects.is_empty() && !scene.cameras.is_empty());
            assert_eq!(scene.warnings, [], "{}", path.display());
        }
    }
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn the_duck_is_read_whole_and_damaged() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/gltf/Duck.glb");
    let bytes = std::fs::read(path).expect("a readable file");
    let scene = parse(&bytes, path.as_ref()).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    assert_eq!((scene.objects.len(), scene.warnings.len()), (1, 0));
    check_damage(&[(bytes, path.into())], 200);
}

/// A mesh with a missing buffer is replaced by a box of its bounds in magenta and black; without
/// bounds it is omitted.
#[test]
fn boxes_stand_in_for_meshes_whose_buffer_is_missing() {
    let text = |extent: &str| {
        format!(
            r#"{{"asset": {{"version": "2.0"}}, "nodes": [{{"mesh": 0, "translation": [5, 0, 0]}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}}}]}}],
            "accessors": [{{"componentType": 5126, "type": "VEC3", "count": 3, "bufferView": 0{extent}}}],
            "bufferViews": [{{"buffer": 0, "byteLength": 36}}],
            "buffers": [{{"byteLength": 36, "uri": "lost.bin"}}]}}"#
        )
    };
    let read = |extent: &str| {
        let scene = parse(text(extent).as_bytes(), Path::new("lost.gltf"))
            .unwrap_or_else(|error| panic!("{error}"));
        common::check_invariants(&scene);
        assert_eq!(scene.missing.len(), 1, "{:?}", scene.missing);
        scene
    };
    let scene = read(r#", "min": [-1, 0, 2], "max": [1, 3, 4]"#);
    let [object] = scene.objects.as_slice() else { panic!("{:?}", scene.objects) };
    let Geometry::Mesh(mesh) = &object.geometry else { panic!("no mesh") };
    let extent = |fold: fn(f32, f32) -> f32, start: f32| {
        [0, 1, 2].map(|c| mesh.positions.iter().map(|p| p[c]).fold(start, fold))
    };
    assert_eq!(extent(f32::min, f32::MAX), [-1.0, 0.0, 2.0]);
    assert_eq!(extent(f32::max, f32::MIN), [1.0, 3.0, 4.0]);
    assert_eq!(object.to_world.translation.x, 5.0);
    let surface = &scene.materials[0].surface;
    assert!(
        matches!(surface, Surface::Diffuse(m) if m.reflectance.texture().is_some()),
        "{surface:?}"
    );
    assert!(read("").objects.is_empty());
}
