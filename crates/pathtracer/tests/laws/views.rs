//! A session whose camera is replaced is that of the whole scene with this camera.

use pathtracer::{CompileOptions, EnvironmentMap, Region, Scene, Session, Settings, Silent};
use pt_math::DVec3;

use crate::scenes::{camera, load, size, under_a_sky};

const SIZE: [u32; 2] = [16, 12];

/// Scenes with media around the camera, motion, instances, lights of all kinds, or no camera.
const FILES: [&str; 9] = [
    "cornell.dae",
    "gltf/glass.glb",
    "gltf/lights.gltf",
    "json/mist.json",
    "mitsuba/fog.xml",
    "mitsuba/many_lights.xml",
    "mitsuba/orthographic.xml",
    "motion.xml",
    "mitsuba/parts/sheet.obj",
];

fn settings(scene: &Scene) -> Settings {
    let integrator = if scene.media.is_empty() { "path" } else { "volpath" };
    Settings { spp: 2, integrator: integrator.into(), ..Settings::default() }
}

fn new(scene: &Scene, options: CompileOptions) -> Session {
    Session::new(scene, options, settings(scene)).expect("the scene can be compiled")
}

/// Film, settings on which it depends, notes and remedies of a render.
fn assert_same(first: &mut Session, second: &mut Session, name: &str) {
    for session in [&mut *first, second] {
        session.render(2, 8, &Silent).expect("it is rendered");
    }
    assert!(first.film() == second.film(), "{name}");
    assert_eq!(first.identity(), second.identity(), "{name}");
    assert_eq!(first.notes(), second.notes(), "{name}");
    assert_eq!(first.hints(), second.hints(), "{name}");
}

#[test]
fn a_moved_camera_is_that_of_a_new_session() {
    for name in FILES {
        let scene = load(name);
        let mut session = new(&scene, size(SIZE));
        let mut moved = scene.clone();
        let index = scene.used_camera.map_or(0, |used| used as usize);
        match moved.cameras.get_mut(index) {
            Some(camera) => {
                camera.to_world.translation += DVec3::new(0.1, 0.05, -0.02);
                camera.lens_radius = 0.01;
            }
            None => moved.cameras.push(camera(DVec3::splat(3.0), DVec3::ZERO, [30.0, 30.0])),
        }
        let is_set = session.set_camera(&moved, &size(SIZE), settings(&moved));
        assert!(is_set.expect("the camera is valid"), "{name}");
        assert_same(&mut session, &mut new(&moved, size(SIZE)), name);
        // A film of the earlier camera is discarded.
        session.set_camera(&scene, &size(SIZE), settings(&scene)).expect("the camera is valid");
        assert_same(&mut session, &mut new(&scene, size(SIZE)), name);
    }
}

/// The camera of options replaces that of the scene; the environment stays.
#[test]
fn a_camera_of_options_is_that_of_a_new_session() {
    let sky = || EnvironmentMap::new(2, 1, vec![[0.5, 0.7, 1.0], [2.0, 1.0, 0.5]]);
    let scene = under_a_sky();
    let with = |from| CompileOptions {
        camera: Some(camera(from, DVec3::ZERO, [50.0, 40.0])),
        environment: Some(sky()),
        ..size([20, 16])
    };
    let mut session = new(&scene, with(DVec3::splat(4.0)));
    let other = with(DVec3::new(1.0, 2.0, 5.0));
    let ignored = CompileOptions { environment: None, ..with(DVec3::new(1.0, 2.0, 5.0)) };
    assert!(session.set_camera(&scene, &ignored, settings(&scene)).expect("it is valid"));
    assert_same(&mut session, &mut new(&scene, other), "under a sky");
}

/// Positions of moving shapes depend on the shutter.
#[test]
fn a_camera_with_another_shutter_is_not_set() {
    let scene = load("motion.xml");
    let (mut session, mut untouched) = (new(&scene, size(SIZE)), new(&scene, size(SIZE)));
    let mut other = scene.clone();
    other.cameras[0].shutter[1] += 0.1;
    let is_set = session.set_camera(&other, &size(SIZE), settings(&other));
    assert!(!is_set.expect("the camera is valid"));
    assert_same(&mut session, &mut untouched, "motion");
}

/// An invalid camera or region leaves the session as it was.
#[test]
fn an_invalid_camera_is_refused() {
    let scene = under_a_sky();
    let (mut session, mut untouched) = (new(&scene, size(SIZE)), new(&scene, size(SIZE)));
    let mut reversed = scene.clone();
    reversed.cameras[0].shutter = [1.0, 0.0];
    let outside = Some(Region { x: 10, y: 0, width: 7, height: 1 });
    for (other, region) in [(&reversed, None), (&scene, outside)] {
        let settings = Settings { region, ..settings(other) };
        assert!(session.set_camera(other, &size(SIZE), settings).is_err());
    }
    assert_same(&mut session, &mut untouched, "under a sky");
}
