//! The schema equals the documented one, and accepts the files written.

use std::path::Path;

use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use jsonschema::Validator;
use pt_formats::{json_schema, load, save};
use serde_json::Value;

pub(super) const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

fn validator() -> Validator {
    let schema = serde_json::from_str(&json_schema()).expect("the schema is JSON");
    jsonschema::validator_for(&schema).expect("the schema is one")
}

/// Returns the value of a file with comments.
fn value_of(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).expect("a readable file");
    let parsed = parse_to_ast(&text, &CollectOptions::default(), &ParseOptions::default());
    parsed.expect("it is JSON").value.map_or(Value::Null, Into::into)
}

#[test]
fn the_schema_of_the_page_is_that_of_the_program() {
    let page = Path::new(ROOT).join("docs/scene.schema.json");
    if std::env::var_os("PT_WRITE_GENERATED").is_some() {
        std::fs::write(&page, json_schema()).expect("a writable folder");
    }
    assert_eq!(std::fs::read_to_string(&page).expect("a readable page"), json_schema());
}

#[test]
fn what_people_write_and_what_the_program_writes_is_as_the_schema_says() {
    let validator = validator();
    let folder = tempfile::tempdir().expect("a folder");
    let copy = folder.path().join("scene.json");
    let mut checked = 0;
    for place in [
        "scenes/json",
        "scenes/gltf",
        "scenes/mitsuba",
        "scenes/obj",
        "scenes/pbrt",
        "tests/formats/json/good",
    ] {
        for entry in std::fs::read_dir(Path::new(ROOT).join(place)).expect("the folder exists") {
            let path = entry.expect("a readable entry").path();
            let Ok(scene) = load(&path) else { continue };
            save(&scene, &copy, true).unwrap_or_else(|error| panic!("{error}"));
            let is_ours = path.extension().is_some_and(|ending| ending == "json");
            for file in [Some(&copy), Some(&path).filter(|_| is_ours)].into_iter().flatten() {
                if let Err(error) = validator.validate(&value_of(file)) {
                    panic!(
                        "{} ({}): {error}: {}",
                        file.display(),
                        path.display(),
                        error.instance_path()
                    );
                }
            }
            checked += 1;
        }
    }
    assert!(checked > 70, "{checked}");
}

#[test]
fn what_is_refused_for_its_form_is_not_as_the_schema_says() {
    let validator = validator();
    for name in [
        "no_header",
        "no_object",
        "newer",
        "version",
        "unknown_key",
        "unknown_key_inner",
        "unknown_type",
        "type_missing",
        "unknown_surface",
        "surface_missing",
        "radius",
        "share",
        "color",
        "text_for_number",
        "whole",
        "flag",
        "list",
        "null",
        "integrator",
        "aov",
        "fov",
        "fov_wide",
        "step",
        "steps_two",
        "matrix_rows",
        "motion_one",
        "mesh_nothing",
        "mesh_both",
        "mesh_shape",
        "scattering",
        "phase",
    ] {
        let path = Path::new(ROOT).join("tests/formats/json/bad").join(name).with_extension("json");
        assert!(!validator.is_valid(&value_of(&path)), "{name}");
    }
}
