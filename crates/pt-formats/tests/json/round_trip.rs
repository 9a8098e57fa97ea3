//! Round trips: scenes are read as they were written, bitwise equal except for locations and
//! warnings.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_formats::{FORMATS, LoadOptions, load, load_with, read_values_with, save, values_of};
use pt_scene::{Geometry, Scene, Span, Submesh};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Removes the locations and warnings of a scene, which differ between files.
fn bare(mut scene: Scene) -> Scene {
    scene.warnings.clear();
    scene.missing.clear();
    scene.objects.iter_mut().for_each(|object| object.at = Span::default());
    scene.lights.iter_mut().for_each(|light| light.at = Span::default());
    scene.media.iter_mut().for_each(|medium| medium.at = Span::default());
    scene
}

/// Finds all scenes in a folder and its subfolders.
fn scenes_in(folder: &Path, found: &mut Vec<PathBuf>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    for path in entries.map(|entry| entry.expect("a readable entry").path()) {
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let is_part = path.file_name().is_some_and(|name| name == "parts" || name == "common");
        if path.is_dir() && !is_part {
            scenes_in(&path, found);
        } else if FORMATS.iter().any(|format| format.extensions.contains(&ending)) {
            found.push(path);
        }
    }
    found.sort();
}

/// Returns the contents of all files in a folder and its subfolders, by relative path.
fn content(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for path in
        std::fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path())
    {
        let name = PathBuf::from(path.file_name().expect("a name"));
        if path.is_dir() {
            all.extend(content(&path).into_iter().map(|(inner, bytes)| (name.join(inner), bytes)));
        } else {
            all.insert(name, std::fs::read(&path).expect("a readable file"));
        }
    }
    all
}

/// Writes a scene, reads it, and writes the result: both files have the same bytes, and both scenes
/// are equal.
fn check(path: &Path) {
    check_scene(load(path).unwrap_or_else(|error| panic!("{error}")), path);
}

fn check_scene(scene: Scene, path: &Path) {
    let [first, second] = [0, 1].map(|_| tempfile::tempdir().expect("a folder"));
    let [a, b] = [&first, &second].map(|folder| folder.path().join("scene.json"));
    check_values(scene.clone(), path);
    save(&scene, &a, false).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let read = load(&a).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    super::common::check_invariants(&read);
    save(&read, &b, false).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(bare(read) == bare(scene), "{}", path.display());
    assert!(content(first.path()) == content(second.path()), "{}", path.display());
}

/// Scenes are converted to values in memory and back.
fn check_values(scene: Scene, path: &Path) {
    let values = values_of(&scene).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let read = read_values_with(values.clone(), Path::new(""), &LoadOptions::default()).scene;
    let read = read.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let again = values_of(&read).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(bare(read) == bare(scene), "{}", path.display());
    assert!(again == values, "{}", path.display());
}

/// Meshes that are too large for the scene file are files of arrays.
#[test]
fn attributes_of_large_meshes_are_read_as_they_were() {
    let path = Path::new(ROOT).join("scenes/mitsuba/attributes.xml");
    let mut scene = load(&path).unwrap_or_else(|error| panic!("{error}"));
    let Some(Geometry::Mesh(mesh)) = scene.objects.last_mut().map(|o| &mut o.geometry) else {
        panic!("no mesh")
    };
    let mesh = Arc::make_mut(mesh);
    let times = 200;
    mesh.triangles = mesh.triangles.repeat(times).into();
    mesh.submeshes = vec![Submesh { triangles: 0..mesh.triangles.len() as u32, slot: 0 }];
    for values in mesh.attributes.faces.values_mut() {
        *values = values.repeat(times).into();
    }
    assert!(mesh.attributes.vertices.contains_key("rough"), "{:?}", mesh.attributes);
    check_scene(scene, &path);
}

#[test]
fn scenes_of_all_formats_are_read_as_they_were() {
    let mut scenes = Vec::new();
    scenes_in(&Path::new(ROOT).join("scenes"), &mut scenes);
    assert!(scenes.len() > 70, "{}", scenes.len());
    for path in &scenes {
        check(path);
    }
}

#[test]
fn good_files_of_all_formats_are_read_as_they_were() {
    let mut scenes = Vec::new();
    for format in ["collada", "gltf", "json", "mitsuba", "obj", "pbrt", "ply"] {
        scenes_in(&Path::new(ROOT).join("tests/formats").join(format).join("good"), &mut scenes);
    }
    assert!(scenes.len() > 30, "{}", scenes.len());
    for path in &scenes {
        check(path);
    }
}

#[test]
#[ignore = "reads scenes of others beside the project; --ignored runs it"]
fn scenes_of_others_are_read_as_they_were() {
    let mut scenes = Vec::new();
    scenes_in(&Path::new(ROOT).join("../shared/scenes"), &mut scenes);
    // Some are parts of others, or contain unsupported features.
    let options = LoadOptions { allow_outside: true, ..LoadOptions::default() };
    let read = |path: &PathBuf| load_with(path, &options).ok();
    let read: Vec<_> = scenes.iter().filter_map(|path| Some((read(path)?, path))).collect();
    assert!(read.len() > 40, "{} of {}", read.len(), scenes.len());
    for (scene, path) in read {
        check_scene(scene, path);
    }
}
