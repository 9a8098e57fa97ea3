//! Media that emit light, and clouds.

use pt_math::DVec3;
use pt_scene::medium::{BlackBody, MediumEmission, MediumProperties};

use crate::{read, refusal};

fn matter(text: &str) -> MediumProperties {
    let mut scene = read("", &format!("MakeNamedMedium \"m\" {text}"));
    assert_eq!(scene.warnings, []);
    scene.media.to_mut().swap_remove(0).matter
}

fn emission(text: &str) -> MediumEmission {
    match matter(text) {
        MediumProperties::Homogeneous { emission, .. } => MediumEmission::Constant(emission),
        MediumProperties::Heterogeneous(matter) => matter.emission,
        MediumProperties::Cloud(_) => panic!("clouds do not emit"),
    }
}

/// As for lights, spectra have luminance 1, and colours are unchanged; both spellings of the scale
/// are accepted.
#[test]
fn media_emit_as_described() {
    let even = |more: &str| emission(&format!("\"string type\" \"homogeneous\" {more}"));
    assert_eq!(even(""), MediumEmission::Constant([0.0; 3]));
    assert_eq!(
        even("\"rgb Le\" [1 2 3] \"float Lescale\" 2"),
        MediumEmission::Constant([2.0, 4.0, 6.0])
    );
    assert_eq!(
        even("\"rgb Le\" [1 2 3] \"float LeScale\" 3"),
        MediumEmission::Constant([3.0, 6.0, 9.0])
    );
    let MediumEmission::Constant([r, g, b]) = even("\"blackbody Le\" 3000") else { panic!() };
    assert!((0.2126 * r + 0.7152 * g + 0.0722 * b - 1.0).abs() < 1e-3 && r > g && g > b);
    let exposed = read(
        "Film \"rgb\" \"float iso\" 300",
        "MakeNamedMedium \"m\" \"string type\" \"homogeneous\" \"rgb Le\" [1 2 3]",
    );
    let MediumProperties::Homogeneous { emission, .. } = exposed.media[0].matter else { panic!() };
    assert_eq!(emission, [3.0, 6.0, 9.0]);
}

#[test]
fn cells_of_grids_emit_as_described() {
    let grid = |more: &str| {
        emission(&format!(
            "\"string type\" \"uniformgrid\" \"integer nx\" 2 \"float density\" [1 2] {more}"
        ))
    };
    assert_eq!(grid("\"rgb Le\" [1 2 3]"), MediumEmission::Constant([1.0, 2.0, 3.0]));
    assert_eq!(
        grid("\"rgb Le\" [1 2 3] \"float Lescale\" 2"),
        MediumEmission::Constant([2.0, 4.0, 6.0])
    );
    let MediumEmission::Grid(placed) =
        grid("\"rgb Le\" [1 2 3] \"float Lescale\" [1 .5] \"point3 p1\" [2 1 1]")
    else {
        panic!("no grid")
    };
    assert_eq!(placed.grid.values, [1.0, 2.0, 3.0, 0.5, 1.0, 1.5]);
    assert_eq!(placed.to_world.transform_point3(DVec3::ONE), DVec3::new(2.0, 1.0, 1.0));
    let heat = grid(
        "\"float temperature\" [3 20] \"float temperatureoffset\" 5 \"float temperaturescale\" 100 \"float Lescale\" 2",
    );
    let MediumEmission::BlackBody(BlackBody { temperature, scale }) = heat else {
        panic!("no heat")
    };
    assert_eq!(temperature.grid.values, [0.0, 1500.0]);
    assert_eq!(scale, 2.0 * 106.856_895);
    let same = grid("\"float temperature\" [900 950] \"float Lescale\" [2 2]");
    assert!(matches!(same, MediumEmission::BlackBody(heat) if heat.scale == scale));
    let colors = |more: &str| {
        emission(&format!("\"string type\" \"rgbgrid\" \"rgb sigma_a\" [1 1 1] {more}"))
    };
    let MediumEmission::Grid(placed) = colors("\"rgb Le\" [1 2 3] \"float Lescale\" 2") else {
        panic!()
    };
    let white = |share: f32| share * 106.856_895;
    assert_eq!(placed.grid.values, [2.0, 4.0, 6.0].map(white));
    assert_eq!(colors("\"rgb Le\" [0 0 0]"), MediumEmission::Constant([0.0; 3]));
}

/// The cloud of the published scenes, with other parameters at their defaults.
#[test]
fn clouds_have_their_numbers() {
    let MediumProperties::Cloud(cloud) = matter(
        "\"string type\" \"cloud\" \"rgb sigma_s\" [3 3 3] \"rgb sigma_a\" [1 1 1] \"float density\" 2",
    ) else {
        panic!("no cloud")
    };
    assert_eq!((cloud.extinction, cloud.albedo), ([4.0; 3], [0.75; 3]));
    assert_eq!((cloud.density, cloud.wispiness, cloud.frequency), (2.0, 1.0, 5.0));
    assert_eq!((cloud.low, cloud.high), ([0.0; 3], [1.0; 3]));
}

#[test]
fn emission_of_media_without_it_is_refused() {
    let cases = [
        (
            "\"uniformgrid\" \"float density\" 1 \"rgb Le\" [1 1 1] \"float temperature\" 900",
            "found Le and temperature",
        ),
        (
            "\"uniformgrid\" \"float density\" 1 \"rgb Le\" [1 1 1] \"float Lescale\" [1 2]",
            "numbers",
        ),
        ("\"uniformgrid\" \"float density\" 1 \"float temperature\" [1 2]", "temperatures"),
        ("\"rgbgrid\" \"rgb sigma_s\" [1 1 1] \"rgb Le\" [1 1 1]", "missing sigma_a"),
        ("\"homogeneous\" \"rgb Le\" [1 1 1] \"float Lescale\" -1", "at least 0"),
        ("\"cloud\" \"float frequency\" 0", "frequency"),
        ("\"cloud\" \"float density\" -1", "density"),
    ];
    for (text, why) in cases {
        let message = refusal(&format!("MakeNamedMedium \"m\" \"string type\" {text}"));
        assert!(message.contains(why), "{message}");
    }
}
