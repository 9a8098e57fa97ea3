//! Motion blur: a moving picture is the mean of still ones, and what does not move is what it was.

use std::sync::Arc;

use pathtracer::{Camera, Film, INTEGRATORS, Scene, Session, Settings, Silent};
use pt_cpu::Renderer;
use pt_math::{DAffine3, DQuat, DVec3};
use pt_scene::{Geometry, Key, LightKind, Motion, shapes};

use crate::measure::{Luminances, render, settings};
use crate::scenes::{Builder, camera, cornell, facing, gloss, matte, metal, size};

const SIZE: [u32; 2] = [12, 10];
/// When the shutter opens and closes.
const SHUTTER: [f64; 2] = [0.25, 1.5];

fn key(time: f64, to_world: DAffine3) -> Key {
    Key { time, to_world }
}

fn motion(keys: &[Key]) -> Motion {
    Motion::new(keys.to_vec()).expect("the keys make sense")
}

/// A floor under a lamp and a dim sky, with a block that a motion moves, a ball that goes with it, and
/// one that stands still.
fn scene(moves: &Motion) -> Scene {
    let block = DAffine3::from_translation(DVec3::new(-0.3, 0.45, 0.0))
        * DAffine3::from_scale(DVec3::new(0.5, 0.35, 0.2));
    let view = camera(DVec3::new(0.4, 2.2, 4.0), DVec3::new(0.0, 0.2, 0.0), [46.0, 40.0]);
    let mut scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6, 0.5, 0.4]))
        .glowing_quad(facing(DVec3::new(0.5, 2.5, 0.5), DVec3::NEG_Y, 0.4), 12.0)
        .sphere(DVec3::new(1.0, 0.3, 0.4), 0.3, gloss())
        .sphere(DVec3::new(0.5, 0.5, 0.1), 0.3, metal())
        .mesh(shapes::cube(), block, matte([0.2, 0.6, 0.3]))
        .sky(0.3)
        .seen_by(Camera { shutter: SHUTTER, ..view });
    let moves = Arc::new(moves.clone());
    for object in scene.objects.iter_mut().skip(3) {
        object.motion = Some(Arc::clone(&moves));
    }
    scene
}

/// Flying, turning by more than a right angle, and growing in one direction.
fn motions() -> Vec<(&'static str, Motion)> {
    let fly = |x: f64, y: f64| DAffine3::from_translation(DVec3::new(x, y, 0.2 * x));
    let turn = |angle: f64| {
        let axis = DVec3::new(0.36, 0.8, 0.48);
        DAffine3::from_rotation_translation(DQuat::from_axis_angle(axis, angle), DVec3::Y * 0.4)
    };
    let grow = |x: f64| DAffine3::from_scale(DVec3::new(x, 1.0, 1.3 - 0.3 * x));
    vec![
        (
            "flying",
            motion(&[key(0.0, fly(-0.8, 0.0)), key(1.0, fly(0.5, 0.4)), key(2.0, fly(0.5, -0.1))]),
        ),
        ("turning", motion(&[key(0.0, turn(-1.0)), key(1.2, turn(1.4))])),
        ("growing", motion(&[key(0.5, grow(0.4)), key(1.5, grow(1.9))])),
    ]
}

fn film(scene: &Scene, spp: u32, seed: u32) -> Film {
    let settings = Settings { max_depth: 3, seed, ..settings(spp) };
    render(scene, size(SIZE), settings).film().clone()
}

/// The scene with the shutter open for no time.
fn at_once(scene: &Scene, time: f64) -> Scene {
    let mut scene = scene.clone();
    scene.cameras[0].shutter = [time; 2];
    scene
}

/// The mean of still pictures in the middles of equal parts of the time for which the shutter is open.
fn mean_of_stills(scene: &Scene, parts: u32, spp: u32) -> Luminances {
    let [open, close] = scene.cameras[0].shutter;
    let still = |i: u32| {
        let share = (f64::from(i) + 0.5) / f64::from(parts);
        Luminances::of(&film(&at_once(scene, open + share * (close - open)), spp, 1000 + i))
    };
    let sum = (1..parts).fold(still(0), |sum, i| sum.plus(&still(i)));
    sum.scaled(1.0 / parts as f32)
}

fn assert_blurred(scene: &Scene, what: &str) {
    let moving = Luminances::of(&film(scene, 16_384, 0));
    let stills = mean_of_stills(scene, 256, 64);
    moving.compare(&stills, 1e-4).unwrap_or_else(|e| panic!("{what}: {e}"));
    let first = Luminances::of(&film(&at_once(scene, SHUTTER[0]), 1024, 7));
    assert!(moving.compare(&first, 1e-4).is_err(), "{what}: nothing moves");
}

#[test]
fn moving_pictures_are_means_of_still_ones() {
    for (name, motion) in motions() {
        assert_blurred(&scene(&motion), name);
    }
}
