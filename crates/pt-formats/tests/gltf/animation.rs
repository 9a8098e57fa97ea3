//! Animations at a time.

use std::path::Path;

use pt_formats::{LoadError, LoadOptions, load_with, parse_with};
use pt_math::DVec3;
use pt_scene::{Geometry, Scene};
use serde_json::{Value, json};

use super::text::Text;

/// A quarter turn around z.
const QUARTER: [f32; 4] =
    [0.0, 0.0, std::f32::consts::FRAC_1_SQRT_2, std::f32::consts::FRAC_1_SQRT_2];

fn at(text: &str, time: Option<f64>) -> Result<Scene, LoadError> {
    let options = LoadOptions { time, ..LoadOptions::default() };
    parse_with(text.as_bytes(), Path::new("test.gltf"), &options)
}

fn read(text: &str, time: f64) -> Scene {
    let scene = at(text, Some(time)).unwrap_or_else(|error| panic!("{error}"));
    super::common::check_invariants(&scene);
    scene
}

/// A triangle whose node is animated by these samplers, each with a target path.
fn animated(text: Text, attributes: &Value, samplers: &[(&str, Value)]) -> String {
    let target = |path: &str| json!({"node": 1, "path": path});
    let channels = samplers.iter().enumerate();
    let channels: Vec<_> =
        channels.map(|(i, (path, _))| json!({"sampler": i, "target": target(path)})).collect();
    let samplers: Vec<_> = samplers.iter().map(|(_, sampler)| sampler).collect();
    text.with(json!({
        "nodes": [{"children": [1], "translation": [10, 0, 0]}, {"mesh": 0, "translation": [7, 7, 7]}],
        "scenes": [{"nodes": [0]}],
        "meshes": [{"primitives": [{"attributes": attributes}]}],
        "animations": [{"samplers": samplers, "channels": channels}]
    }))
}

fn close(a: DVec3, b: [f64; 3]) -> bool {
    a.distance(DVec3::from_array(b)) < 1e-6
}

#[test]
fn nodes_are_where_their_animations_have_them() {
    let mut text = Text::default();
    let triangle = text.triangle();
    let times = text.vectors(&[[1.0], [2.0], [4.0]]);
    let moved = text.vectors(&[[0.0; 3], [1.0, 0.0, 0.0], [1.0, 4.0, 0.0]]);
    let turned = text.vectors(&[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0], QUARTER]);
    let scaled = text.vectors(&[[1.0; 3], [2.0; 3], [3.0; 3]]);
    let linear = |output| json!({"input": times, "output": output});
    let step = json!({"input": times, "output": scaled, "interpolation": "STEP"});
    let samplers = [("translation", linear(moved)), ("rotation", linear(turned)), ("scale", step)];
    let text = animated(text, &triangle, &samplers);
    let corner = |time| read(&text, time).objects[0].to_world.transform_point3(DVec3::X);
    // Before the first key, halfway, at a key, in between, and after the last key.
    assert!(close(corner(0.0), [11.0, 0.0, 0.0]));
    assert!(close(corner(1.5), [11.5, 0.0, 0.0]));
    assert!(close(corner(2.0), [13.0, 0.0, 0.0]));
    let half = 2.0 * std::f64::consts::FRAC_1_SQRT_2;
    assert!(close(corner(3.0), [11.0 + half, 2.0 + half, 0.0]));
    assert!(close(corner(9.0), [11.0, 7.0, 0.0]));
    let rest = at(&text, None).expect("a scene");
    assert!(close(rest.objects[0].to_world.transform_point3(DVec3::X), [18.0, 7.0, 7.0]));
    let [note] = rest.warnings.as_slice() else { panic!("{:?}", rest.warnings) };
    assert!(note.to_string().contains("the scene is in its rest pose"));
}

#[test]
fn whole_numbers_are_shares() {
    let mut text = Text::default();
    let triangle = text.triangle();
    let times = text.vectors(&[[0.0], [1.0]]);
    let turns: Vec<u8> = [[0_i16, 0, 0, 32_767], [0, 0, 23_170, 23_170]]
        .as_flattened()
        .iter()
        .flat_map(|x| x.to_le_bytes())
        .collect();
    let turned = text.accessor(&turns, "VEC4", 5122, 2);
    let sampler = json!({"input": times, "output": turned});
    let text = animated(text, &triangle, &[("rotation", sampler)]);
    let text = text.replace("\"componentType\":5122", "\"componentType\":5122,\"normalized\":true");
    let corner = read(&text, 1.0).objects[0].to_world.transform_point3(DVec3::X);
    assert!(corner.distance(DVec3::new(17.0, 8.0, 7.0)) < 1e-4, "{corner}");
}

/// A spline from 0 to 1 with the slopes 0 and 3, whose value halfway is ½ − 3/8.
#[test]
fn morph_targets_are_added_as_much_as_their_animation_says() {
    let mut text = Text::default();
    let triangle = text.triangle();
    let raised = text.vectors(&[[0.0, 0.0, 8.0]; 3]);
    let times = text.vectors(&[[0.0], [1.0]]);
    let weights = text.vectors(&[[9.0], [0.0], [0.0], [3.0], [1.0], [9.0]]);
    let sampler = json!({"input": times, "output": weights, "interpolation": "CUBICSPLINE"});
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": "weights"}});
    let text = text.with(json!({
        "nodes": [{"mesh": 0, "weights": [1]}],
        "meshes": [{"primitives": [{"attributes": triangle, "targets": [{"POSITION": raised}]}]}],
        "animations": [{"samplers": [sampler], "channels": [channel]}]
    }));
    let height = |time| match &at(&text, time).expect("a scene").objects[0].geometry {
        Geometry::Mesh(mesh) => mesh.positions[0][2],
        other => panic!("{other:?}"),
    };
    assert_eq!([None, Some(0.0), Some(0.5), Some(1.0)].map(height), [8.0, 0.0, 1.0, 8.0]);
}

/// The joints of the arm rotate by −25° at rest and by 45° a second later.
#[test]
fn skins_follow_their_animated_joints() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/gltf/animated.gltf");
    let tip = |time| {
        let options = LoadOptions { time, ..LoadOptions::default() };
        let scene = load_with(Path::new(path), &options).unwrap_or_else(|error| panic!("{error}"));
        let arm = scene.objects.iter().find(|object| object.name == "arm").expect("an arm");
        let Geometry::Mesh(mesh) = &arm.geometry else { panic!("a mesh") };
        DVec3::from_array(mesh.positions.last().expect("a tip").map(f64::from))
    };
    // The shoulder is at (−0.4, 0, −0.4); upper arm, forearm and hand have length 1, and the hand
    // is scaled by 1.3 at time 1.
    let chain = |elbow: f64, wrist: f64, hand: f64| {
        let along =
            |angle: f64| DVec3::new(-angle.to_radians().sin(), angle.to_radians().cos(), 0.0);
        let shoulder = DVec3::new(-0.4, 0.0, -0.4);
        shoulder + along(0.0) + along(elbow) + hand * along(elbow + wrist)
    };
    for (time, wanted) in [
        (None, chain(0.0, 0.0, 1.0)),
        (Some(0.0), chain(-25.0, -25.0, 1.0)),
        (Some(0.5), chain(10.0, 10.0, 1.15)),
        (Some(1.0), chain(45.0, 45.0, 1.3)),
    ] {
        let found = tip(time);
        assert!(found.distance(wanted) < 1e-4, "{time:?}: {found} {wanted}");
    }
}

#[test]
fn of_two_animations_of_the_same_the_first_one_is_shown_with_a_note() {
    let mut text = Text::default();
    let triangle = text.triangle();
    let time = text.vectors(&[[0.0]]);
    let moved = [[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]].map(|to| text.vectors(&[to]));
    let samplers = moved.map(|output| ("translation", json!({"input": time, "output": output})));
    let scene = read(&animated(text, &triangle, &samplers), 3.0);
    assert_eq!(scene.objects[0].to_world.translation, DVec3::new(11.0, 0.0, 0.0));
    let note = scene.warnings[0].to_string();
    let wanted =
        "animations[0].channels[1].target: duplicate animation of the translation of this node";
    assert!(scene.warnings.len() == 1 && note.contains(wanted), "{note}");
}

#[test]
fn bad_animations_are_reported_with_their_place() {
    let refusal = |times: &[[f32; 1]], values: &[[f32; 3]], path: &str, kind: &str| {
        let mut text = Text::default();
        let triangle = text.triangle();
        let (input, output) = (text.vectors(times), text.vectors(values));
        let sampler = json!({"input": input, "output": output, "interpolation": kind});
        let text = animated(text, &triangle, &[(path, sampler)]);
        at(&text, Some(0.0)).expect_err("it is refused").to_string()
    };
    let three = [[0.0; 3]; 2];
    let sampler = "test.gltf: animations[0].samplers[0]";
    for (found, wanted) in [
        (
            refusal(&[[1.0], [1.0]], &three, "scale", "STEP"),
            format!("{sampler}.input: expected increasing times"),
        ),
        (refusal(&[[1.0]], &three, "scale", "STEP"), format!("{sampler}.output: found 6 numbers")),
        (
            refusal(&[[1.0], [2.0]], &three, "scale", "CUBICSPLINE"),
            "for each of 6 elements".to_owned(),
        ),
        (
            refusal(&[[1.0], [2.0]], &three, "rotation", "LINEAR"),
            format!("{sampler}.output: found elements of 3 numbers in accessors[2]"),
        ),
        (
            refusal(&[[1.0], [2.0]], &three, "scale", "CUBIC"),
            "expected LINEAR, STEP or CUBICSPLINE".to_owned(),
        ),
        (
            refusal(&[[1.0], [2.0]], &three, "size", "STEP"),
            "target.path: expected translation,".to_owned(),
        ),
    ] {
        assert!(found.contains(&wanted), "{found}");
    }
}

#[test]
fn other_formats_have_no_times() {
    let options = LoadOptions { time: Some(1.0), ..LoadOptions::default() };
    let error = parse_with(b"", Path::new("a.ply"), &options).expect_err("it is refused");
    let wanted = "a.ply: unsupported time 1: animations of Stanford PLY are not read; omit the \
                  time or use a scene of glTF 2.0, Mitsuba 3, pathtracer JSON";
    assert_eq!(error.to_string(), wanted);
    let still = r#"{"asset": {"version": "2.0"}}"#;
    let note = &read(still, 1.0).warnings[0];
    assert!(
        note.to_string().ends_with("a time was given for a scene without animations"),
        "{note}"
    );
}

/// Changed digits result in a scene or an error.
#[test]
fn damaged_animations_do_no_harm() {
    let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes/gltf/animated.gltf"));
    let text = std::fs::read(path).expect("it is there");
    let options = LoadOptions { time: Some(0.7), ..LoadOptions::default() };
    let start = text.windows(12).position(|w| w == b"\"animations\"").expect("animations");
    let digits = (start..text.len()).filter(|i| text[*i].is_ascii_digit());
    let mut read = [0, 0];
    for (i, place) in digits.enumerate() {
        let mut damaged = text.clone();
        damaged[place] = [b'9', b'-', b'.', b'1'][i % 4];
        let found = parse_with(&damaged, path, &options);
        read[usize::from(found.is_err())] += 1;
    }
    assert!(read[0] > 0 && read[1] > 100, "{read:?}");
}
