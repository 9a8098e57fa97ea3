//! Reader of pbrt-v4 scenes.

mod common;
#[path = "pbrt/emission.rs"]
mod emission;
#[path = "pbrt/lights.rs"]
mod lights;
#[path = "pbrt/materials.rs"]
mod materials;
#[path = "pbrt/noise.rs"]
mod noise;
#[path = "pbrt/shapes.rs"]
mod shapes;
#[path = "pbrt/sight.rs"]
mod sight;
#[path = "pbrt/subsurface.rs"]
mod subsurface;

use common::{check_bad_files, check_good_files, check_robustness, files, folder, parse};
use pt_scene::Scene;

/// Parses a scene with the given text before and after WorldBegin, whose folder is that of the good
/// files.
fn read(before: &str, world: &str) -> Scene {
    let text = format!("{before}\nCamera \"perspective\"\nWorldBegin\n{world}");
    read_all(&text)
}

fn read_all(text: &str) -> Scene {
    let path = folder("pbrt").join("good").join("test.pbrt");
    let scene = parse(text.as_bytes(), &path).unwrap_or_else(|error| panic!("{error}"));
    common::check_invariants(&scene);
    scene
}

/// Returns the error of an invalid world.
fn refusal(world: &str) -> String {
    let text = format!("Camera \"perspective\"\nWorldBegin\n{world}");
    let path = folder("pbrt").join("good").join("test.pbrt");
    parse(text.as_bytes(), &path).expect_err("it is refused").to_string()
}

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    check_bad_files("pbrt", "pbrt");
}

#[test]
fn good_files_give_the_expected_warnings() {
    check_good_files("pbrt", "pbrt");
}

#[test]
fn damaged_files_do_no_harm() {
    let rounds = 200 * files("pbrt", "good", "pbrt").len();
    check_robustness("pbrt", "pbrt", rounds);
}

#[test]
fn files_that_include_each_other_are_cut() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = |i: usize| folder.path().join(format!("{i}.pbrt"));
    for i in 0..12 {
        let next = format!("Include \"{}.pbrt\"\n", i + 1);
        std::fs::write(file(i), next.repeat(2)).expect("a writable folder");
    }
    std::fs::write(file(12), "Camera \"perspective\"\n").expect("a writable folder");
    let error = pt_formats::load(&file(0)).expect_err("too many").to_string();
    assert!(error.contains("more than 1000 included files"), "{error}");
    assert!(pt_formats::load(&file(10)).is_ok());
}

#[test]
fn instances_of_instances_cannot_multiply() {
    let shapes = "Shape \"sphere\"\n".repeat(2000);
    let instances = "ObjectInstance \"a\"\n".repeat(600);
    let error = refusal(&format!("ObjectBegin \"a\"\n{shapes}ObjectEnd\n{instances}"));
    assert!(error.contains("number of shapes exceeds 1000000"), "{error}");
}

#[test]
fn round_shapes_cannot_fill_memory() {
    let error = refusal(&"Shape \"sphere\" \"float phimax\" 359\n".repeat(300));
    assert!(error.contains("limit of 16777216 triangles"), "{error}");
}

#[test]
fn products_of_textures_cannot_multiply() {
    let doubled = |i: u32| {
        let next = i + 1;
        format!(
            "Texture \"{next}\" \"float\" \"scale\" \"texture tex\" \"{i}\" \"texture scale\" \"{i}\"\n"
        )
    };
    let text = "Texture \"0\" \"float\" \"checkerboard\"\n".to_owned();
    assert!(
        read("", &(text.clone() + &(0..6).map(doubled).collect::<String>())).objects.is_empty()
    );
    let error = refusal(&(text + &(0..40).map(doubled).collect::<String>()));
    assert!(error.contains("more than 64 parts"), "{error}");
}
