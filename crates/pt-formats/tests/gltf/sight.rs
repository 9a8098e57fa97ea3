//! Cameras and lights.

use pt_math::{DAffine3, DVec3};
use pt_scene::{LightKind, Projection, Scene};
use serde_json::{Value, json};

use super::read;
use super::text::Text;

fn seen(cameras: &Value) -> Scene {
    let count = cameras.as_array().map_or(0, Vec::len);
    let nodes: Vec<_> = (0..count)
        .map(|i| json!({"camera": i, "name": format!("camera {i}"), "translation": [i, 0, 0]}))
        .collect();
    read(&Text::default().with(json!({"nodes": nodes, "cameras": cameras})))
}

fn lit(light: &Value) -> LightKind {
    let nodes = json!([{"extensions": {"KHR_lights_punctual": {"light": 0}}, "scale": [5, 5, 5]}]);
    let lights = json!({"KHR_lights_punctual": {"lights": [light]}});
    let scene = read(&Text::default().with(json!({"nodes": nodes, "extensions": lights})));
    scene.lights[0].kind.clone()
}

#[test]
fn the_first_camera_is_the_one_that_is_used() {
    let view = json!({"yfov": 1, "aspectRatio": 2, "znear": 0.5, "zfar": 8});
    let camera = json!({"type": "perspective", "perspective": view});
    let scene = seen(&json!([camera, camera]));
    assert_eq!(scene.cameras.len(), 2);
    let used = scene.camera().expect("a camera");
    assert!(scene.warnings[0].to_string().contains("\"camera 0\" is used"));
    assert_eq!((used.name.as_str(), used.to_world.translation), ("camera 0", DVec3::ZERO));
    assert_eq!((used.near, used.far), (0.5, 8.0));
    let Projection::Perspective { x_fov, y_fov } = used.projection else { panic!("{used:?}") };
    assert!((y_fov.to_radians() - 1.0).abs() < 1e-12);
    let tangent = |degrees: f64| (0.5 * degrees.to_radians()).tan();
    assert!((tangent(x_fov) / tangent(y_fov) - 2.0).abs() < 1e-12);
}

#[test]
fn cameras_do_not_follow_the_scale_of_their_nodes() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let node = json!({"camera": 0, "scale": [2, 3, 4], "rotation": [0, half, 0, half], "translation": [1, 2, 3]});
    let flat = json!({"camera": 0, "scale": [1, 0, 1]});
    let view = json!({"xmag": 3, "ymag": 2, "znear": 0, "zfar": 8});
    let cameras = json!([{"type": "orthographic", "orthographic": view}]);
    let text = Text::default().with(json!({"nodes": [flat, node], "cameras": cameras}));
    let [camera] = read(&text).cameras.try_into().expect("the flat one is left out");
    let turn = DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let wanted = DAffine3::from_translation(DVec3::new(1.0, 2.0, 3.0)) * turn;
    assert!(camera.to_world.abs_diff_eq(wanted, 1e-12));
}

#[test]
fn magnifications_are_half_of_what_is_seen() {
    let view = json!({"xmag": 3, "ymag": 2, "znear": 0, "zfar": 8});
    let scene = seen(&json!([{"type": "orthographic", "orthographic": view}]));
    let wanted = Projection::Orthographic { half_width: 3.0, half_height: 2.0 };
    assert_eq!(scene.cameras[0].projection, wanted);
}

#[test]
fn lights_have_their_colour_times_their_intensity() {
    let light = |kind: &str| {
        lit(&json!({"type": kind, "color": [1, 0.5, 0.25], "intensity": 4, "spot": {
            "innerConeAngle": 0.25, "outerConeAngle": 0.5
        }}))
    };
    let wanted = [4.0, 2.0, 1.0];
    assert_eq!(light("point"), LightKind::Point { intensity: wanted });
    assert_eq!(light("directional"), LightKind::Directional { irradiance: wanted });
    let LightKind::PunctualSpot { intensity, inner_angle, outer_angle } = light("spot") else {
        panic!("{:?}", light("spot"))
    };
    assert_eq!(intensity, wanted);
    assert!((inner_angle.to_radians() - 0.25).abs() < 1e-12);
    assert!((outer_angle.to_radians() - 0.5).abs() < 1e-12);
}

#[test]
fn without_a_word_lights_are_white_and_of_intensity_1() {
    assert_eq!(lit(&json!({"type": "point"})), LightKind::Point { intensity: [1.0; 3] });
}
