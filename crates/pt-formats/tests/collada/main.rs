//! The COLLADA reader: good files are interpreted correctly, bad files are rejected with a helpful
//! message, and no file causes a panic or an excess of time and memory.
//!
//! The files are in `tests/formats/collada`. The error of a bad file is in a file beside it, as are
//! the warnings of a good one, if it has any. `PT_WRITE_EXPECTED=1 cargo test` rewrites those;
//! review the difference before keeping it.

#[expect(dead_code, reason = "other tests use more of it")]
#[path = "../common/mod.rs"]
mod common;
mod course;
mod cs184_log;
mod geometry;
mod look;
mod robustness;
mod variants;

use std::path::{Path, PathBuf};

use pt_formats::{LoadError, parse};
use pt_scene::texture::Input;
use pt_scene::{Geometry, Scene};

const FILES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/formats/collada");

/// Returns the constant value of a parameter.
fn value<T: Copy>(input: &Input<T>) -> T {
    match input {
        Input::Value(value) => *value,
        Input::Texture(_) => panic!("a texture"),
    }
}

/// Returns all `.dae` files of a folder, in order.
fn files(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(Path::new(FILES).join(folder)).expect("the folder exists");
    let mut files: Vec<_> = entries.map(|e| e.expect("a readable entry").path()).collect();
    files.retain(|f| f.extension().is_some_and(|e| e == "dae"));
    files.sort();
    assert!(!files.is_empty());
    files
}

fn good_text(name: &str) -> String {
    let path = Path::new(FILES).join("good").join(name);
    std::fs::read_to_string(path).expect("the file exists")
}

fn read(text: &str) -> Result<Scene, LoadError> {
    parse(text.as_bytes(), Path::new("scene.dae"))
}

fn good(name: &str) -> Scene {
    read(&good_text(name)).expect("a good file")
}

/// Compares a text with the file beside it, or writes that file if requested.
fn check_expected(file: &Path, found: &str) {
    let expected = file.with_extension("expected");
    if std::env::var_os("PT_WRITE_EXPECTED").is_some() {
        if found.is_empty() {
            std::fs::remove_file(&expected).ok();
        } else {
            std::fs::write(&expected, found).expect("a writable folder");
        }
    }
    let wanted = std::fs::read_to_string(&expected).unwrap_or_default();
    assert_eq!(found, wanted, "{}", file.display());
}

fn name_of(file: &Path) -> &Path {
    Path::new(file.file_name().expect("a file"))
}

/// Checks the invariants of scenes.
fn check_invariants(scene: &Scene) {
    for object in &scene.objects {
        assert!(object.to_world.is_finite());
        assert!(object.materials.iter().flatten().all(|m| (*m as usize) < scene.materials.len()));
        let Geometry::Mesh(mesh) = &object.geometry else { continue };
        assert!(mesh.positions.iter().flatten().all(|c| c.is_finite()));
        let in_range = |n: usize, t: &[[u32; 3]]| t.iter().flatten().all(|i| (*i as usize) < n);
        assert!(in_range(mesh.positions.len(), &mesh.triangles));
        for (i, triangle) in mesh.triangles.iter().enumerate() {
            let within = |n: usize, corners: [u32; 3]| corners.iter().all(|i| (*i as usize) < n);
            let normals = mesh.normals.as_ref();
            assert!(normals.is_none_or(|a| within(a.values.len(), a.corners(i, *triangle))));
            let uvs = mesh.uvs.as_ref();
            assert!(uvs.is_none_or(|a| within(a.values.len(), a.corners(i, *triangle))));
        }
        let mut covered = 0;
        for part in &mesh.submeshes {
            assert_eq!(part.triangles.start, covered);
            assert!((part.slot as usize) < object.materials.len());
            covered = part.triangles.end;
        }
        assert_eq!(covered as usize, mesh.triangles.len());
    }
}

#[test]
fn bad_files_are_refused_with_the_expected_message() {
    for file in files("bad") {
        let bytes = std::fs::read(&file).expect("a readable file");
        let error = parse(&bytes, name_of(&file)).expect_err("a bad file");
        check_expected(&file, &format!("{error}\n"));
    }
}

#[test]
fn good_files_give_the_expected_warnings() {
    for file in files("good") {
        let bytes = std::fs::read(&file).expect("a readable file");
        let scene = parse(&bytes, name_of(&file)).expect("a good file");
        let missing = scene.missing.iter().map(|missing| format!("missing: {missing}\n"));
        let warnings = scene.warnings.iter().map(|warning| format!("{warning}\n"));
        check_expected(&file, &missing.chain(warnings).collect::<String>());
    }
}

#[test]
fn unknown_endings_name_the_known_ones() {
    let error = pt_formats::load(Path::new("scene.blend")).expect_err("no such format");
    assert!(error.to_string().contains(".dae"), "{error}");
}
