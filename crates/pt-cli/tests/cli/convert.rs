//! Conversion of scenes.

use std::path::Path;

use pathtracer::{Aov, INTEGRATORS};

use crate::common::{Folder, SCENE, TINY};

const SCENES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes");

/// Asserts that a scene and its copy render to the same image.
fn renders_alike(folder: &Folder, scene: &str, copy: &str) {
    let [original, again] = [scene, copy].map(|path| folder.exr(&format!("{path} {TINY}")));
    assert!(original == again, "{scene}");
}

#[test]
fn converted_scenes_render_to_the_same_bits() {
    for name in [
        "mitsuba/textures.xml",
        "mitsuba/smoke.xml",
        "mitsuba/instances.xml",
        "mitsuba/envmap.xml",
        "mitsuba/measured.xml",
        "pbrt/motion.pbrt",
        "pbrt/lights.pbrt",
        "gltf/glass.glb",
        "gltf/textures.gltf",
        "cornell.dae",
        "json/files.json",
    ] {
        let folder = Folder::new();
        let scene = format!("{SCENES}/{name}");
        let run = folder.succeed(&format!("convert {scene} copy.json"));
        assert!(run.err.ends_with("saved copy.json\n"), "{run:?}");
        renders_alike(&folder, &scene, "copy.json");
    }
}

#[test]
fn scenes_of_gltf_render_to_the_same_bits_as_their_copies() {
    for name in ["glass.glb", "instances.glb", "lights.gltf", "materials.gltf", "skin.glb"] {
        let folder = Folder::new();
        let scene = format!("{SCENES}/gltf/{name}");
        let run = folder.succeed(&format!("convert {scene} copy.glb"));
        assert!(run.err.ends_with("saved copy.glb\n"), "{run:?}");
        renders_alike(&folder, &scene, "copy.glb");
    }
}

#[test]
fn what_gltf_cannot_say_is_reported_with_its_place() {
    let folder = Folder::new();
    let run = folder.succeed(&format!("convert {SCENES}/mitsuba/envmap.xml a.glb"));
    let note = "environment lights are not representable in glTF; the light is omitted";
    let line = run.err.lines().find(|line| line.contains(note)).unwrap_or_default();
    assert!(line.starts_with("note: ") && line.contains("envmap.xml:"), "{run:?}");
    assert_eq!(folder.files(), ["a.glb"]);
    let quiet = folder.succeed(&format!("convert -q {SCENES}/mitsuba/envmap.xml b.glb"));
    assert!(quiet.err.is_empty() && folder.read("a.glb") == folder.read("b.glb"), "{quiet:?}");
}

#[test]
fn a_converted_scene_may_move_with_its_files() {
    let folder = Folder::new();
    folder.succeed(&format!("convert -q {SCENES}/mitsuba/envmap.xml a.json"));
    assert_eq!(folder.files(), ["a.json", "a_files"]);
    std::fs::create_dir(folder.path("there")).expect("the folder takes folders");
    for name in ["a.json", "a_files"] {
        let to = folder.path("there").join(name);
        std::fs::rename(folder.path(name), to).expect("it can be moved");
    }
    renders_alike(&folder, &format!("{SCENES}/mitsuba/envmap.xml"), "there/a.json");
}

#[test]
fn nothing_is_overwritten_unless_that_is_asked_for() {
    let folder = Folder::new();
    folder.write("a.json", "{}");
    let run = folder.run("convert SCENE a.json");
    assert!(run.code == Some(2) && run.err.contains("a.json exists already"), "{run:?}");
    assert_eq!(folder.read("a.json"), b"{}");
    folder.succeed("convert SCENE a.json --force");
    let itself = folder.run("convert a.json ./a.json --force");
    assert!(
        itself.code == Some(2) && itself.err.contains("which is the scene itself"),
        "{itself:?}"
    );
    let other = folder.run("convert a.json a.usd");
    let known = "unknown scene format for writing; known: .json, .glb";
    assert!(other.code == Some(2) && other.err.contains(known), "{other:?}");
    let nowhere = folder.run("convert a.json missing/b.json");
    assert!(nowhere.code == Some(2) && nowhere.err.contains("found no folder"), "{nowhere:?}");
    folder.write("b_files", "not a folder");
    folder.succeed("convert a.json b.json --force");
    assert_eq!(folder.files(), ["a.json", "b.json", "b_files"]);
    assert!(SCENE.ends_with("cornell.dae") && folder.read("b.json").starts_with(b"{\n"));
}

#[test]
fn what_was_defined_stands_in_the_copy() {
    let folder = Folder::new();
    folder.write(
        "a.xml",
        r#"<scene version="3.0.0"><default name="r" value="1"/>
            <shape type="sphere"><float name="radius" value="$r"/></shape></scene>"#,
    );
    folder.succeed("convert a.xml a.json -D r=7.5");
    let text = String::from_utf8(folder.read("a.json")).expect("a text");
    assert!(text.contains(r#""radius": 7.5"#), "{text}");
}

/// Scene files may name all integrators and AOVs. `PT_WRITE_GENERATED=1` writes the names anew.
#[test]
fn names_in_scene_files_are_those_of_the_program() {
    let integrators: Vec<_> = INTEGRATORS.iter().map(|integrator| integrator.name).collect();
    let aovs: Vec<_> = Aov::NAMES.iter().map(|(name, _)| *name).collect();
    for (file, names) in [("integrators.txt", integrators), ("aovs.txt", aovs)] {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../pt-formats/src/json");
        let path = folder.join(file);
        let text = names.join("\n") + "\n";
        if std::env::var_os("PT_WRITE_GENERATED").is_some() {
            std::fs::write(&path, &text).expect("a writable folder");
        }
        assert_eq!(std::fs::read_to_string(&path).expect("a readable file"), text, "{file}");
    }
}

#[test]
fn a_file_may_ask_for_all_that_there_is() {
    let folder = Folder::new();
    let sphere = r#""objects": [{"type": "sphere"}]"#;
    for name in INTEGRATORS.iter().map(|integrator| integrator.name) {
        folder.write(
            "a.json",
            format!(r#"{{"pathtracer": 1, "settings": {{"integrator": "{name}"}}, {sphere}}}"#),
        );
        folder.succeed("a.json -r 2 2 -s 1");
    }
    let names: Vec<_> = Aov::NAMES.iter().map(|(name, _)| format!("\"{name}\"")).collect();
    let names = names.join(", ");
    folder.write(
        "a.json",
        format!(r#"{{"pathtracer": 1, "settings": {{"aovs": [{names}]}}, {sphere}}}"#),
    );
    folder.succeed("a.json -r 2 2 -s 2 -f a.exr");
}
