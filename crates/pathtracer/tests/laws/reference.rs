//! The reference path tracer, which follows one path at a time, gives the bits of `path`.

use std::path::Path;

use pathtracer::{Clamp, DirectLight, Film, Session, Settings, Silent};

use crate::scenes::size;

/// Scenes that together have lights of all kinds, alpha, media boundaries, layered and stochastic
/// materials, textures with footprints, hair, instances and motion.
const SCENES: [&str; 12] = [
    "cornell.dae",
    "alpha/mask.xml",
    "course/mirror_and_glass.dae",
    "gltf/materials.gltf",
    "gltf/textures.gltf",
    "mitsuba/blends.xml",
    "mitsuba/many_lights.xml",
    "mitsuba/sunsky_noon.xml",
    "mitsuba/textured_lights.xml",
    "pbrt/hair.pbrt",
    "pbrt/lights.pbrt",
    "pbrt/motion.pbrt",
];

fn film(name: &str, integrator: &str, settings: &Settings) -> Film {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenes")).join(name);
    let scene = pt_formats::load(&file).unwrap_or_else(|error| panic!("{error}"));
    let settings = Settings { integrator: integrator.to_owned(), ..settings.clone() };
    let mut session = Session::new(&scene, size([24, 18]), settings).expect("the scene compiles");
    session.render(1, 8, &Silent).expect("it renders");
    session.film().clone()
}

fn assert_same(name: &str, settings: &Settings) {
    let [reference, path] = ["reference", "path"].map(|one| film(name, one, settings));
    assert!(path.pixels().any(|pixel| pixel.mean() != [0.0; 3]), "{name}: the image is black");
    assert!(reference == path, "{name}: the films of reference and path differ");
}

#[test]
fn twelve_scenes_have_the_bits_of_path() {
    let settings = Settings { spp: 4, ..Settings::default() };
    for name in SCENES {
        assert_same(name, &settings);
    }
}

#[test]
fn settings_have_the_bits_of_path() {
    let usual = Settings { spp: 4, ..Settings::default() };
    let clamp = Clamp { direct: 1.0, indirect: 0.2 };
    let all = [
        Settings { direct: DirectLight::Light, ..usual.clone() },
        Settings { light_samples: 3, ..usual.clone() },
        Settings { max_depth: 1, ..usual.clone() },
        Settings { clamp, ..usual },
    ];
    for settings in all {
        for name in ["cornell.dae", "pbrt/lights.pbrt", "alpha/mask.xml"] {
            assert_same(name, &settings);
        }
    }
}
