//! Lights that are invisible to rays.

use std::sync::Arc;

use pathtracer::{CompileOptions, Film, Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::Mirror;
use pt_scene::texture::{Bitmap, Filter, Pattern, Wrap};
use pt_scene::{Color, Key, Motion, Texture};

use crate::furnace::ESTIMATORS;
use crate::measure::{assert_all_agree, render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

/// A floor and a ball under `count` emissive squares and spheres, every other pair with a texture;
/// none is in view.
fn lit_by(count: u32) -> Scene {
    let mut builder = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), matte([0.6; 3]))
        .sphere(DVec3::new(0.3, 0.3, 0.1), 0.3, matte([0.7, 0.3, 0.2]));
    let image =
        pathtracer::Image { width: 2, height: 1, pixels: vec![[2.0; 3], [0.2, 1.0, 0.5]].into() };
    let bitmap = Bitmap { image: Arc::new(image), wrap: Wrap::default(), filter: Filter::Nearest };
    let texture = Arc::new(Texture::from(Pattern::Bitmap(bitmap)));
    for i in 0..count {
        let angle = f64::from(i) * 2.4;
        let at = DVec3::new(1.2 * angle.cos(), 1.5 + 0.1 * f64::from(i % 3), 1.2 * angle.sin());
        builder = match i % 2 {
            0 => builder.emissive_quad(facing(at, -at.normalize(), 0.3), 3.0),
            _ => builder.emissive_sphere(at, 0.15, 4.0),
        };
        if i % 4 > 1 {
            builder = builder.emitting(Arc::clone(&texture));
        }
    }
    builder.seen_by(camera(DVec3::new(0.0, 1.0, 3.0), DVec3::new(0.0, 0.1, 0.0), [30.0, 24.0]))
}

/// Makes the lights of a scene invisible.
pub(crate) fn hidden(mut scene: Scene) -> Scene {
    let emits = |color: &Color| *color != [0.0; 3].into();
    for material in scene.materials.iter_mut().filter(|material| emits(&material.emission)) {
        material.hidden_emission = true;
    }
    scene
}

fn film(scene: &Scene, settings: Settings) -> Film {
    render(scene, size([10, 8]), settings).film().clone()
}

/// Asserts that invisible lights outside of the view light like visible ones: with every estimator,
/// with few lights and with a light tree.
fn assert_nobody_can_tell(scene: &Scene) {
    let base = Settings { max_depth: 3, ..settings(1024) };
    let volumetric = Settings { integrator: "volpath".into(), ..base.clone() };
    let of = |settings: &Settings, direct| Settings { direct, ..settings.clone() };
    let ways = ESTIMATORS.map(|direct| (format!("path {direct:?}"), of(&base, direct)));
    let others = [
        ("volpath", of(&volumetric, ESTIMATORS[0])),
        ("volpath -l 3", Settings { light_samples: 3, ..of(&volumetric, ESTIMATORS[1]) }),
    ];
    let others = others.map(|(name, settings)| (name.to_owned(), settings));
    let mut films = vec![("seen".to_owned(), film(scene, base.clone()))];
    let hidden = hidden(scene.clone());
    for ((name, settings), seed) in ways.into_iter().chain(others).zip(1..) {
        films.push((name, film(&hidden, Settings { seed, ..settings })));
    }
    assert_all_agree(&films);
}

#[test]
fn few_lights_that_nobody_sees_light_as_those_in_view() {
    assert_nobody_can_tell(&lit_by(4));
}

#[test]
fn many_lights_that_nobody_sees_light_as_those_in_view() {
    assert_nobody_can_tell(&lit_by(20));
}

/// One light moves, the other does not.
#[test]
fn moving_lights_that_nobody_sees_light_as_those_in_view() {
    let mut scene = lit_by(2);
    let moved = |time: f64| Key { time, to_world: DAffine3::from_translation(DVec3::X * time) };
    let motion = Motion::new(vec![moved(0.0), moved(0.5)]).expect("a motion");
    scene.objects[2].motion = Some(Arc::new(motion));
    scene.cameras[0].shutter = [0.0, 0.5];
    assert_nobody_can_tell(&scene);
}

/// Path reuse supports invisible lights.
#[test]
fn paths_share_the_light_of_what_nobody_sees() {
    let base = Settings { max_depth: 3, ..settings(1024) };
    let of = |scene: &Scene, settings: Settings| film(scene, settings);
    let scene = hidden(lit_by(4));
    let reuse = Settings { reuse: 2, seed: 1, ..base.clone() };
    let films = [("alone".to_owned(), of(&scene, base)), ("shared".to_owned(), of(&scene, reuse))];
    assert_all_agree(&films);
}

/// A mirror under an invisible lamp, and the lamp itself, are black; surfaces behind the lamp are
/// visible if its opacity is 0.
#[test]
fn nothing_is_seen_of_hidden_lights() {
    let mirror = || Mirror { reflectance: [1.0; 3].into() }.into();
    let lamp = facing(DVec3::Y * 2.0, DVec3::NEG_Y, 1.0);
    let room = || {
        let floor = Builder::default().quad(facing(DVec3::ZERO, DVec3::Y, 3.0), mirror());
        floor.emissive_quad(lamp, 5.0)
    };
    let down = camera(DVec3::new(0.0, 1.0, 0.3), DVec3::ZERO, [20.0, 16.0]);
    let up = camera(DVec3::new(0.0, 1.0, 0.3), DVec3::Y * 2.0, [20.0, 16.0]);
    for integrator in ["path", "volpath"] {
        let settings = || Settings { integrator: integrator.into(), ..settings(4) };
        for eye in [&down, &up] {
            let seen = |scene: &Scene| {
                let film = film(scene, settings());
                film.pixels().map(|pixel| pixel.luminance().0).fold(0.0, f64::max)
            };
            let lamp = seen(&room().seen_by(eye.clone()));
            assert!((lamp - 5.0).abs() < 1e-6, "{integrator}: {lamp}");
            assert_eq!(seen(&hidden(room().seen_by(eye.clone()))), 0.0, "{integrator}");
            let mut clear = hidden(room().sky(1.0).seen_by(eye.clone()));
            clear.materials[1].opacity = 0.0.into();
            let film = film(&clear, settings());
            assert!(
                film.pixels().all(|pixel| (pixel.luminance().0 - 1.0).abs() < 1e-6),
                "{integrator}"
            );
        }
    }
}

/// An invisible lamp with an emission texture keeps its light, as one of many and alone.
#[test]
fn a_tree_and_single_lights_agree() {
    let scene = hidden(lit_by(12));
    let settings = |seed| Settings { max_depth: 1, seed, ..settings(2048) };
    let of = |most: usize, seed: u32| {
        let options = CompileOptions { most_single_lights: Some(most), ..size([10, 8]) };
        render(&scene, options, settings(seed)).film().clone()
    };
    assert_all_agree(&[("single".to_owned(), of(100, 1)), ("tree".to_owned(), of(0, 2))]);
}
