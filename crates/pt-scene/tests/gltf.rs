//! The reader of glTF scenes.

mod common;
#[path = "gltf/materials.rs"]
mod materials;
#[path = "gltf/shapes.rs"]
mod shapes;
#[path = "gltf/sight.rs"]
mod sight;
#[path = "gltf/text.rs"]
mod text;

use common::{
    check_bad_files, check_damage, check_good_files, check_robustness, files, folder, parse,
};
use pt_scene::Scene;

/// A scene of this text, whose folder is that of the good files.
fn read(text: &str) -> Scene {
    let path = folder("gltf").join("good").join("test.gltf");
    let scene = parse(text.as_bytes(), &path).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    scene
}

/// Why a text is refused.
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

/// The scenes of the project, and those that are beside it, if there are any.
#[test]
fn our_scenes_are_read_without_notes() {
    let root = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");
    for entry in std::fs::read_dir(format!("{root}/scenes/gltf")).expect("the folder exists") {
        let path = entry.expect("a readable entry").path();
        if path.is_file() {
            let scene = pt_scene::format::load(&path).unwrap_or_else(|error| panic!("{error}"));
            common::check_invariants(&scene);
            assert!(!scene.objects.is_empty() && !scene.cameras.is_empty());
            assert_eq!(scene.warnings, [], "{}", path.display());
        }
    }
}

#[test]
fn the_duck_is_read_whole_and_damaged() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/scenes/gltf/Duck.glb");
    let Ok(bytes) = std::fs::read(path) else {
        println!("skipped: ../shared/scenes/gltf/Duck.glb not found");
        return;
    };
    let scene = parse(&bytes, path.as_ref()).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    assert_eq!((scene.objects.len(), scene.warnings.len()), (1, 0));
    check_damage(&[(bytes, path.into())], 200);
}
