//! Files of measured materials, in the scenes that refer to them.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use pt_formats::{Limits, LoadError, LoadOptions, load, parse_with, save};
use pt_scene::material::{Diffuse, Measured, Mix, SurfaceDetail};
use pt_scene::texture::{Color, Pattern};
use pt_scene::{Scene, Surface};
use tempfile::TempDir;

use crate::common::{check_damage_with, check_invariants, without_panics};

const SEEDS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fuzz/seeds");

/// Returns the bytes of a small file.
fn seed(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(SEEDS).join(name)).expect("a readable file")
}

/// Creates a folder with a file `m.bsdf` of these bytes.
fn folder(bytes: &[u8]) -> TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("m.bsdf"), bytes).expect("a writable folder");
    folder
}

fn json(name: &str) -> String {
    format!(
        r#"{{"pathtracer": 1, "materials": {{"m": {{"type": "measured", "measurements": {{"file": "{name}"}}}}}}}}"#
    )
}

fn pbrt(material: &str) -> String {
    format!("Camera \"perspective\" WorldBegin {material} Shape \"sphere\"")
}

fn mitsuba(bsdf: &str) -> String {
    format!("<scene version=\"3.0.0\"><shape type=\"cube\">{bsdf}</shape></scene>")
}

fn plain_mitsuba(name: &str) -> String {
    format!("<bsdf type=\"measured\"><string name=\"filename\" value=\"{name}\"/></bsdf>")
}

/// Returns a scene of each format with a material of this file.
fn scenes(name: &str) -> [(&'static str, String); 3] {
    [
        ("json", json(name)),
        ("pbrt", pbrt(&format!("Material \"measured\" \"string filename\" \"{name}\""))),
        ("xml", mitsuba(&plain_mitsuba(name))),
    ]
}

fn read_with(
    folder: &Path,
    ending: &str,
    text: &str,
    options: &LoadOptions,
) -> Result<Scene, LoadError> {
    parse_with(text.as_bytes(), &folder.join("scene").with_extension(ending), options)
}

fn read(folder: &Path, ending: &str, text: &str) -> Scene {
    let scene = read_with(folder, ending, text, &LoadOptions::default());
    scene.unwrap_or_else(|error| panic!("{error}"))
}

fn measured(surface: &Surface) -> &Measured {
    let Surface::Measured(measured) = surface else { panic!("{surface:?} is not measured") };
    measured
}

#[test]
fn all_formats_read_the_same_tables() {
    let folder = folder(&seed("colours.bsdf"));
    let all = scenes("m.bsdf").map(|(ending, text)| read(folder.path(), ending, &text));
    let all = all.each_ref().map(|scene| measured(&scene.materials[0].surface));
    let tables = all[0].measurements.tables();
    assert_eq!(
        (tables.description.as_str(), tables.theta.as_slice()),
        ("colours", &[0.0, 1.5][..])
    );
    assert_eq!((tables.vndf.columns, tables.vndf.rows, tables.is_relative), (3, 2, true));
    assert!(all.iter().all(|one| one.measurements == all[0].measurements));
    // As in Mitsuba and pbrt-v4.
    assert_eq!(all.map(|one| one.two_sided), [true, true, false]);
}

#[test]
fn mitsuba_puts_them_into_other_bsdfs() {
    let folder = folder(&seed("spectra.bsdf"));
    let inner = plain_mitsuba("m.bsdf");
    let surface =
        |bsdf: &str| read(folder.path(), "xml", &mitsuba(bsdf)).materials[0].surface.clone();
    let two_sided = surface(&format!("<bsdf type=\"twosided\">{inner}</bsdf>"));
    assert!(measured(&two_sided).two_sided);
    let mixed = surface(&format!("<bsdf type=\"blendbsdf\">{inner}{inner}</bsdf>"));
    let Surface::Mix(Mix { first, second, .. }) = mixed else { panic!("no mixture") };
    let [first, second] = [&first, &second].map(|part| measured(part));
    assert!(Arc::ptr_eq(&first.measurements, &second.measurements), "the file is read once");
    let heights = "<texture type=\"checkerboard\" name=\"arbitrary\"/>";
    let bumpy = surface(&format!("<bsdf type=\"bumpmap\">{heights}{inner}</bsdf>"));
    let Surface::SurfaceDetail(SurfaceDetail { surface, .. }) = bumpy else { panic!("no relief") };
    measured(&surface);
}

#[test]
fn pbrt_has_them_by_name_and_in_mixtures() {
    let folder = folder(&seed("colours.bsdf"));
    let named = r#"MakeNamedMaterial "m" "string type" "measured" "string filename" "m.bsdf""#;
    let scene = read(folder.path(), "pbrt", &pbrt(&format!("{named} NamedMaterial \"m\"")));
    measured(&scene.materials[0].surface);
    let mix = r#"Material "mix" "string materials" ["m" "m"]"#;
    let scene = read(folder.path(), "pbrt", &pbrt(&format!("{named} {mix}")));
    assert!(matches!(scene.materials[0].surface, Surface::Mix(_)));
}

#[test]
fn what_is_written_is_read() {
    for name in ["colours.bsdf", "spectra.bsdf"] {
        let folder = folder(&seed(name));
        let scene = read(folder.path(), "json", &json("m.bsdf"));
        let copy = folder.path().join("copy.json");
        save(&scene, &copy, true).expect("it is written");
        assert_eq!(load(&copy).expect("it is read").materials, scene.materials);
    }
}

/// Returns true if the only material is a magenta placeholder.
fn is_loud(scene: &Scene) -> bool {
    match &scene.materials[0].surface {
        Surface::Diffuse(Diffuse { reflectance: Color::Texture(texture), .. }) => {
            texture.pattern == Pattern::Checkerboard([[1.0, 0.0, 1.0], [0.0; 3]])
        }
        Surface::Measured(measured) => {
            let colors = &measured.measurements.tables().colors;
            colors.iter().all(|[r, g, b]| *r > 0.1 && *g == 0.0 && r == b)
        }
        _ => false,
    }
}

#[test]
fn what_is_missing_is_loud_and_an_error_if_that_is_asked_for() {
    let folder = folder(&seed("colours.bsdf"));
    for (ending, text) in scenes("lost.bsdf") {
        let scene = read(folder.path(), ending, &text);
        assert!(is_loud(&scene), "{ending}: {:?}", scene.materials);
        let [missing] = scene.missing.as_slice() else { panic!("{:?}", scene.missing) };
        let message = missing.to_string();
        assert!(message.contains("lost.bsdf") && message.contains("shown instead"), "{message}");
        let strict = LoadOptions { strict: true, ..LoadOptions::default() };
        let error = read_with(folder.path(), ending, &text, &strict).expect_err("it is missing");
        assert_eq!(error.to_string(), message);
    }
}

#[test]
fn files_outside_of_the_folder_are_read_only_if_that_is_allowed() {
    let folder = folder(&seed("colours.bsdf"));
    let inside = folder.path().join("inside");
    std::fs::create_dir(&inside).expect("a writable folder");
    for (ending, text) in scenes("../m.bsdf") {
        let scene = read(&inside, ending, &text);
        let [missing] = scene.missing.as_slice() else { panic!("{:?}", scene.missing) };
        assert!(
            is_loud(&scene) && missing.message.contains("outside of the scene folder"),
            "{missing}"
        );
        let options = LoadOptions { allow_outside: true, ..LoadOptions::default() };
        let scene = read_with(&inside, ending, &text, &options).expect("it may be read");
        assert!(scene.missing.is_empty() && !is_loud(&scene), "{ending}");
    }
}

#[test]
fn what_is_broken_is_an_error_with_the_file_and_the_field() {
    let mut bytes = seed("colours.bsdf");
    // The last byte is that of the jacobian, and the two before are the most significant ones of
    // the last colour.
    let end = bytes.len() - 1;
    bytes[end - 2..end].copy_from_slice(&[0x80, 0x7F]);
    let folder = folder(&bytes);
    for (ending, text) in scenes("m.bsdf") {
        let error = read_with(folder.path(), ending, &text, &LoadOptions::default());
        let message = error.expect_err("it is broken").to_string();
        assert!(message.contains("m.bsdf: found "), "{message}");
        assert!(message.contains("as number 23") && message.contains("\"rgb\""), "{message}");
    }
}

#[test]
fn memory_is_limited() {
    let folder = folder(&seed("colours.bsdf"));
    let limits = Limits { memory: Some(750), ..Limits::default() };
    let options = LoadOptions { limits, ..LoadOptions::default() };
    for (ending, text) in scenes("m.bsdf") {
        // Meshes, which count as well, exceed the rest of the limit.
        let message = match read_with(folder.path(), ending, &text, &options) {
            Ok(scene) => scene.missing.first().map(ToString::to_string),
            Err(error) => Some(error.to_string()),
        };
        let is_reported =
            |message: String| message.contains("exceeds the memory limit of 750 bytes");
        assert!(message.is_some_and(is_reported), "{ending}");
    }
}

/// Reads the scene with a file of these bytes.
fn with(folder: &TempDir, bytes: &[u8]) -> Result<Scene, LoadError> {
    std::fs::write(folder.path().join("m.bsdf"), bytes).expect("a writable folder");
    read_with(folder.path(), "json", &json("m.bsdf"), &LoadOptions::default())
}

#[test]
fn no_beginning_of_a_file_passes_for_the_whole() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["colours.bsdf", "spectra.bsdf"] {
        let bytes = seed(name);
        without_panics(|| {
            for length in 0..bytes.len() {
                assert!(with(&folder, &bytes[..length]).is_err(), "{name}: {length}");
            }
        });
    }
}

#[test]
fn no_damage_makes_the_reader_of_measurements_panic() {
    let folder = tempfile::tempdir().expect("a folder");
    let all = ["colours.bsdf", "spectra.bsdf"].map(|name| (seed(name), PathBuf::from(name)));
    check_damage_with(&all, 4000, |bytes, _| {
        let scene = with(&folder, bytes)?;
        check_invariants(&scene);
        Ok(scene)
    });
}
