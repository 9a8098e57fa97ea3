//! The sun and the sky, and luminaires.

use pt_math::DVec3;
use pt_scene::{Daylight, LightKind, Scene};

use super::common::folder;
use super::{read, refusal};

fn sunsky(parameters: &str) -> Scene {
    read(&format!("<emitter type=\"sunsky\">{parameters}</emitter>"))
}

/// Returns the daylight of the only light, and the world-space direction to the sun.
fn daylight(scene: &Scene) -> (Daylight, DVec3) {
    let light = &scene.lights[0];
    let LightKind::Daylight(daylight) = &light.kind else { panic!("{:?}", light.kind) };
    (daylight.clone(), light.to_world.transform_vector3(daylight.to_sun.into()))
}

/// Expected results are of Mitsuba 3.9.1, which counts days since the year 2000 in single
/// precision: its time is accurate to a quarter of a day, and the position of the sun to 0.2°.
#[test]
fn the_sun_stands_where_it_does_in_mitsuba() {
    let cases = [
        ("", [0.051_385, 0.691_748, 0.720_308]),
        ("<float name=\"hour\" value=\"9\"/>", [0.095_695, -0.614_786, 0.782_867]),
        (
            "<integer name=\"year\" value=\"2003\"/><integer name=\"month\" value=\"10\"/>\
             <integer name=\"day\" value=\"17\"/><float name=\"hour\" value=\"12\"/>\
             <float name=\"minute\" value=\"30\"/><float name=\"second\" value=\"30\"/>\
             <float name=\"latitude\" value=\"39.742476\"/>\
             <float name=\"longitude\" value=\"-105.1786\"/><float name=\"timezone\" value=\"-7\"/>",
            [0.743_335, 0.190_032, 0.641_359],
        ),
    ];
    let turn = "<transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/></transform>";
    for (parameters, [x, y, z]) in cases {
        for (turn, want) in [("", DVec3::new(x, y, z)), (turn, DVec3::new(x, z, -y))] {
            let (_, to_sun) = daylight(&sunsky(&format!("{parameters}{turn}")));
            let degrees = to_sun.angle_between(want).to_degrees();
            assert!(degrees < 0.2, "{parameters}: {to_sun} {want}, {degrees}°");
        }
    }
}

/// The direction is in world space, and up is +z of the emitter.
#[test]
fn directions_of_the_sun_are_those_of_the_world() {
    let scene = sunsky(
        "<vector name=\"sun_direction\" x=\"0\" y=\"4\" z=\"3\"/><float name=\"turbidity\" value=\"6\"/>\
         <rgb name=\"albedo\" value=\"0.5 0.25 1\"/><float name=\"sky_scale\" value=\"2\"/>\
         <float name=\"sun_scale\" value=\"0\"/><float name=\"sun_aperture\" value=\"5\"/>\
         <boolean name=\"complex_sun\" value=\"true\"/>\
         <transform name=\"to_world\"><rotate x=\"1\" angle=\"-90\"/></transform>",
    );
    let (light, to_sun) = daylight(&scene);
    assert!((to_sun - DVec3::new(0.0, 0.8, 0.6)).length() < 1e-12, "{to_sun}");
    assert!((scene.lights[0].to_world.y_axis - DVec3::Y).length() < 1e-12);
    let want = Daylight {
        to_sun: light.to_sun,
        turbidity: 6.0,
        albedo: [0.5, 0.25, 1.0],
        sky: 2.0,
        sun: 0.0,
        aperture: 5.0,
        limb_darkening: true,
        span: None,
    };
    assert_eq!(light, want);
}

/// The nadir is +z of the emitter, and the horizontal angle of 90° is −y.
#[test]
fn luminaires_hang_along_z() {
    let file = folder("mitsuba").join("../../../scenes/mitsuba/parts/downlight.ies");
    let scene = read(&format!(
        "<emitter type=\"ies\"><string name=\"filename\" value=\"{}\"/>\
         <rgb name=\"intensity\" value=\"1 2 3\"/>\
         <transform name=\"to_world\"><translate x=\"5\"/></transform></emitter>",
        file.display()
    ));
    let light = &scene.lights[0];
    let LightKind::Ies { profile, scale } = &light.kind else { panic!("{:?}", light.kind) };
    assert_eq!((profile.candela(0.0, 0.0), *scale), (40.0, [1.0, 2.0, 3.0]));
    assert_eq!(light.to_world.transform_vector3(DVec3::NEG_Z), DVec3::Z);
    assert_eq!(light.to_world.transform_vector3(DVec3::X), DVec3::X);
    assert_eq!(light.to_world.transform_vector3(DVec3::Y), DVec3::NEG_Y);
    assert_eq!(light.to_world.translation, DVec3::X * 5.0);
}

#[test]
fn skies_and_luminaires_that_make_no_sense_are_refused() {
    let sunsky = |parameters: &str| format!("<emitter type=\"sunsky\">{parameters}</emitter>");
    let timed = |parameters: &str| format!("<emitter type=\"timed_sunsky\">{parameters}</emitter>");
    let broken = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(broken.path(), "TILT=NONE\n1 1000 1 2 x\n").unwrap();
    let ies = |path: &str| {
        format!("<emitter type=\"ies\"><string name=\"filename\" value=\"{path}\"/></emitter>")
    };
    let cases = [
        (
            sunsky("<float name=\"turbidity\" value=\"11\"/>"),
            "found turbidity = 11, expected 1 to 10",
        ),
        (
            sunsky("<float name=\"sky_scale\" value=\"-1\"/>"),
            "found sky_scale = -1, expected 0 or more",
        ),
        (sunsky("<float name=\"sun_aperture\" value=\"0\"/>"), "found sun_aperture = 0, expected"),
        (sunsky("<integer name=\"month\" value=\"13\"/>"), "found month = 13, expected 1 to 12"),
        (sunsky("<rgb name=\"albedo\" value=\"0 2 0\"/>"), "expected numbers from 0 to 1"),
        (
            sunsky(
                "<vector name=\"sun_direction\" x=\"0\" y=\"0\" z=\"1\"/>\
                 <float name=\"hour\" value=\"3\"/>",
            ),
            "expected hour or sun_direction, not both",
        ),
        (sunsky("<vector name=\"sun_direction\" x=\"0\" y=\"0\" z=\"0\"/>"), "zero or infinite"),
        (
            sunsky("<transform name=\"to_world\"><scale value=\"2\"/></transform>"),
            "found a scale of the sky",
        ),
        (timed("<float name=\"window_end_time\" value=\"6\"/>"), "as the last hour"),
        (timed("<integer name=\"end_year\" value=\"2025\"/>"), "not after the first day"),
        (
            timed("<integer name=\"start_month\" value=\"0\"/>"),
            "found start_month = 0, expected 1 to 12",
        ),
        (timed("<float name=\"shutter_close\" value=\"0\"/>"), "not after shutter_open"),
        ("<emitter type=\"laser\"/>".into(), "timed_sunsky"),
        ("<emitter type=\"ies\"/>".into(), "missing <string name=\"filename\">"),
        (ies("nowhere.ies"), "nowhere.ies"),
        (ies(&broken.path().display().to_string()), ":2: found \"x\""),
    ];
    for (emitter, want) in cases {
        let message = refusal(&emitter);
        assert!(message.contains(want), "{message} lacks {want}");
    }
}

/// The shutter of the sensor selects the part of the days; a closed one selects its first moment.
#[test]
fn daylight_over_days_is_seen_by_the_time_of_the_shutter() {
    let span = |sensor: &str, emitter: &str| {
        let scene = read(&format!(
            "<emitter type=\"timed_sunsky\">{emitter}</emitter><sensor type=\"perspective\">{sensor}</sensor>"
        ));
        let LightKind::Daylight(Daylight { span: Some(span), limb_darkening: false, .. }) =
            scene.lights[0].kind
        else {
            panic!("{:?}", scene.lights)
        };
        span
    };
    let all = span("", "");
    assert_eq!(
        (all.first, all.days, all.hours, all.part),
        ([2025, 1, 1], 365, [7.0, 19.0], [0.0; 2])
    );
    let of_shutter = |open: f64, close: f64| {
        format!(
            "<float name=\"shutter_open\" value=\"{open}\"/><float name=\"shutter_close\" value=\"{close}\"/>"
        )
    };
    assert_eq!(span(&of_shutter(0.0, 1.0), "").part, [0.0, 1.0]);
    assert_eq!(span(&of_shutter(2.0, 3.0), &of_shutter(1.0, 5.0)).part, [0.25, 0.5]);
    assert_eq!(span(&of_shutter(-2.0, 3.0), &of_shutter(0.0, 2.0)).part, [0.0, 1.0]);
    let dates = "<integer name=\"start_day\" value=\"31\"/><integer name=\"end_year\" value=\"2025\"/>\
                 <integer name=\"end_month\" value=\"3\"/><integer name=\"end_day\" value=\"1\"/>";
    assert_eq!(span("", dates).days, 29);
}
