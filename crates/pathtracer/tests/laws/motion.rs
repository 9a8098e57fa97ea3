//! Motion blur: an image with motion is the mean of static ones, and static objects do not change.

use std::sync::Arc;

use pathtracer::{
    Camera, DirectLight, Film, INTEGRATORS, Image, Projection, Region, Scene, Session, Settings,
    Silent,
};
use pt_cpu::Renderer;
use pt_math::{DAffine3, DQuat, DVec3};
use pt_scene::material::{Black, Glass};
use pt_scene::medium::{
    Grid, GridFilter, Heterogeneous, MediumEmission, MediumProperties, Phase, PlacedGrid, Volume,
};
use pt_scene::texture::{Bitmap, Filter, Pattern, Wrap};
use pt_scene::{Geometry, Key, Medium, Motion, Scalar, Sides, Texture, shapes};

use crate::furnace::ESTIMATORS;
use crate::measure::{Luminances, assert_all_agree, render, settings};
use crate::scenes::{Builder, camera, facing, gloss, inward_cube, matte, metal, size};

const SIZE: [u32; 2] = [12, 10];
/// Times at which the shutter opens and closes.
const SHUTTER: [f64; 2] = [0.25, 1.5];

fn key(time: f64, to_world: DAffine3) -> Key {
    Key { time, to_world }
}

fn motion(keys: &[Key]) -> Motion {
    Motion::new(keys.to_vec()).expect("the keys make sense")
}

/// A floor under a lamp and a dim environment, with a block and a ball that share a motion, and a
/// static ball.
fn scene(moves: &Motion) -> Scene {
    let block = DAffine3::from_translation(DVec3::new(-0.3, 0.45, 0.0))
        * DAffine3::from_scale(DVec3::new(0.5, 0.35, 0.2));
    let view = camera(DVec3::new(0.4, 2.2, 4.0), DVec3::new(0.0, 0.2, 0.0), [46.0, 40.0]);
    let mut scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6, 0.5, 0.4]))
        .emissive_quad(facing(DVec3::new(0.5, 2.5, 0.5), DVec3::NEG_Y, 0.4), 12.0)
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

/// Translation, rotation by more than a right angle, and scaling in one direction.
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

/// The scene with an exposure time of 0.
fn at_once(scene: &Scene, time: f64) -> Scene {
    let mut scene = scene.clone();
    scene.cameras[0].shutter = [time; 2];
    scene
}

/// Mean of static images at the midpoints of equal parts of the exposure time.
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

/// A translating and rotating camera, in perspective with a lens, and orthographic.
#[test]
fn pictures_of_a_moving_camera_are_means_of_still_ones() {
    let fly = |x: f64, angle: f64| {
        DAffine3::from_translation(DVec3::X * x) * DAffine3::from_rotation_y(angle)
    };
    let keys = [key(0.0, fly(-0.3, -0.1)), key(1.0, fly(0.3, 0.05)), key(2.0, fly(0.1, 0.2))];
    let parallel = Projection::Orthographic { half_width: 1.6, half_height: 1.3 };
    for (projection, lens_radius) in [(None, 0.1), (Some(parallel), 0.0)] {
        let mut scene = scene(&motion(&[key(0.0, DAffine3::IDENTITY), key(1.0, fly(0.2, 0.3))]));
        let camera = &mut scene.cameras[0];
        camera.motion = Some(motion(&keys));
        camera.lens_radius = lens_radius;
        camera.focal_distance = 4.0;
        camera.projection = projection.unwrap_or(camera.projection);
        assert_blurred(&scene, &format!("{projection:?}"));
    }
}

/// A floor and a ball under lamps that are translated, rotated and stretched: a quad, another with
/// a texture of two colours, a ball, and a stretched ball where the quads are.
pub(crate) fn under_flying_lamps() -> Scene {
    let fly = |x: f64, stretch: f64| {
        DAffine3::from_translation(DVec3::new(x, 0.0, 0.0))
            * DAffine3::from_rotation_y(0.5 * x)
            * DAffine3::from_scale(DVec3::new(stretch, 1.0, 2.0 - stretch))
    };
    let moving =
        |stretch: f64| Arc::new(motion(&[key(0.0, fly(-1.0, 1.0)), key(2.0, fly(1.0, stretch))]));
    let image =
        Image { width: 2, height: 1, pixels: vec![[4.0, 1.0, 0.5], [0.1, 0.2, 2.0]].into() };
    let (wrap, filter) = (Wrap::CLAMP, Filter::Nearest);
    let bitmap = Bitmap { image: Arc::new(image), wrap, filter };
    let mut scene = Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.6, 0.5, 0.4]))
        .sphere(DVec3::new(1.0, 0.3, 0.4), 0.3, gloss())
        .emissive_quad(facing(DVec3::new(0.0, 1.0, 0.0), DVec3::NEG_Y, 0.5), 3.0)
        .quad(facing(DVec3::new(-0.9, 1.2, 0.3), DVec3::NEG_Y, 0.3), Black.into())
        .emitting(Arc::new(Pattern::Bitmap(bitmap).into()))
        .emissive_sphere(DVec3::new(0.5, 0.7, 0.6), 0.3, 2.0)
        .sky(0.3)
        .seen_by(Camera { shutter: SHUTTER, ..scene(&moving(1.0)).cameras[0].clone() });
    for object in scene.objects.iter_mut().skip(2) {
        let stretch = if matches!(object.geometry, Geometry::Mesh(_)) { 1.6 } else { 1.0 };
        object.motion = Some(moving(stretch));
    }
    scene
}

/// An animated light is visible, and lights the scene, at its position at the time of the sample.
#[test]
fn moving_light_is_the_mean_of_still_light() {
    assert_blurred(&under_flying_lamps(), "light");
}

/// Animated lights are sampled with their densities: estimators of direct light agree, also for a
/// stretched emissive ball, which no other scene has.
#[test]
fn estimators_agree_under_lights_that_move() {
    let mut scene = under_flying_lamps();
    scene.objects[4].motion = scene.objects[2].motion.clone();
    let film = |integrator: &str, direct, light_samples, seed| {
        let integrator = integrator.to_owned();
        let base = settings(8192);
        let settings = Settings { integrator, direct, light_samples, max_depth: 2, seed, ..base };
        let session = render(&scene, size(SIZE), settings);
        assert_eq!(session.scene().animated_lights().len(), 3);
        (format!("{direct:?} {light_samples}"), session.film().clone())
    };
    let films = ESTIMATORS.into_iter().zip(1..).map(|(d, i)| film("path", d, 1 + i % 2, i));
    let volpath = film("volpath", DirectLight::Mis, 1, 9);
    assert_all_agree(&films.chain([volpath]).collect::<Vec<_>>());
}

/// Split paths meet a lamp that crosses a white room where it is at the time of their camera ray.
#[test]
fn split_paths_have_the_time_of_their_camera_ray() {
    let cross = |x: f64| key(1.0 + x, DAffine3::from_translation(DVec3::X * x));
    let view = camera(DVec3::new(0.0, 0.2, 1.9), DVec3::ZERO, [100.0, 90.0]);
    let mut scene = Builder::default()
        .mesh(inward_cube(), DAffine3::from_scale(DVec3::splat(2.0)), matte([0.8; 3]))
        .emissive_sphere(DVec3::ZERO, 0.2, 5.0)
        .seen_by(Camera { shutter: [0.0, 2.0], ..view });
    scene.objects[1].motion = Some(Arc::new(motion(&[cross(-1.0), cross(1.0)])));
    let film = |split, seed| {
        let direct = DirectLight::Light;
        let settings = Settings { direct, split, max_depth: 3, seed, ..settings(4096) };
        (format!("{split} paths"), render(&scene, size(SIZE), settings).film().clone())
    };
    assert_all_agree(&[film(1, 0), film(4, 1)]);
}

/// Transparency, textures of all kinds, and media inside of animated objects.
#[test]
fn moving_glass_with_a_medium_and_a_moving_mask_are_means_of_still_ones() {
    let (_, turning) = motions().swap_remove(1);
    let mut scene = scene(&turning);
    let board = Pattern::Checkerboard([[0.0; 3], [0.9; 3]]);
    let texture: Arc<Texture> = Arc::new(board.into());
    let [ball, block] = [3, 4].map(|i| scene.objects[i].materials[0].expect("it has one") as usize);
    scene.materials[block].opacity = Scalar::Texture(texture);
    scene.materials[ball].surface = Glass {
        reflectance: [1.0; 3].into(),
        transmittance: [1.0; 3].into(),
        ior: 1.3,
        roughness: None,
    }
    .into();
    scene.objects[3].media = Some(Sides { interior: Some(0), exterior: None });
    let matter = MediumProperties::Homogeneous {
        extinction: [3.0, 2.0, 1.0],
        albedo: [0.6; 3],
        emission: [0.0; 3],
    };
    let (name, at) = (String::new(), pt_scene::Span::default());
    scene.media.push(Medium { name, matter, phase: Phase::Isotropic, at });
    for integrator in ["path", "volpath"] {
        let picture = |scene: &Scene, spp, seed| {
            let integrator = integrator.into();
            let settings = Settings { integrator, max_depth: 4, seed, ..settings(spp) };
            Luminances::of(render(scene, size([8, 6]), settings).film())
        };
        let moving = picture(&scene, 16_384, 0);
        let still = |i: u32| {
            let share = (f64::from(i) + 0.5) / 128.0;
            let time = SHUTTER[0] + share * (SHUTTER[1] - SHUTTER[0]);
            picture(&at_once(&scene, time), 128, 1 + i)
        };
        let stills = (1..128).fold(still(0), |sum, i| sum.plus(&still(i))).scaled(1.0 / 128.0);
        moving.compare(&stills, 1e-4).unwrap_or_else(|e| panic!("{integrator}: {e}"));
    }
}

/// With an exposure time of 0, and with two equal keys, a scene has the bits of one without motion.
#[test]
fn what_does_not_move_keeps_its_bits() {
    for (name, motion) in motions() {
        let scene = scene(&motion);
        for time in [SHUTTER[0], 0.8, 5.0] {
            let closed = at_once(&scene, time);
            let mut still = closed.clone();
            for object in still.objects.iter_mut().skip(3) {
                object.motion = None;
                object.to_world = motion.at(time) * object.to_world;
            }
            let kept = film(&still, 16, 3);
            assert!(film(&closed, 16, 3) == kept, "{name} at {time}");
            let alike = Motion::new(vec![key(0.0, motion.at(time)), key(1.0, motion.at(time))]);
            let alike = Arc::new(alike.expect("the keys make sense"));
            let mut resting = scene.clone();
            for object in resting.objects.iter_mut().skip(3) {
                object.motion = Some(Arc::clone(&alike));
            }
            assert!(film(&resting, 16, 3) == kept, "{name} at {time}, twice");
        }
    }
}

/// From inside of a closed emissive mesh that tumbles, only its radiance is visible.
#[test]
fn a_tumbling_room_is_closed() {
    let turn = |angle: f64, size: f64| {
        DAffine3::from_axis_angle(DVec3::new(0.36, 0.8, 0.48), angle)
            * DAffine3::from_scale(DVec3::new(1.0, size, 2.0 - size))
    };
    let keys = [key(0.0, turn(0.0, 1.0)), key(1.0, turn(2.0, 1.5)), key(2.0, turn(-1.0, 0.5))];
    let view = camera(DVec3::new(0.1, 0.2, 0.1), DVec3::NEG_Z, [120.0, 100.0]);
    let mut scene = Builder::default()
        .emissive_mesh(inward_cube(), DAffine3::IDENTITY, Black.into(), 1.0)
        .seen_by(Camera { shutter: [0.0, 2.0], ..view });
    scene.objects[0].motion = Some(Arc::new(motion(&keys)));
    let film = film(&scene, 1024, 0);
    assert!(film.pixels().all(|pixel| (pixel.luminance().0 - 1.0).abs() < 1e-6));
}

/// Batches, threads, tiles and regions, with all integrators.
#[test]
fn motion_blur_has_the_same_bits_everywhere() {
    let (_, turning) = motions().swap_remove(1);
    let mut scene = scene(&turning);
    scene.cameras[0].motion = Some(turning);
    for registration in INTEGRATORS {
        let integrator = registration.name.to_owned();
        let settings = Settings {
            integrator,
            spp: 9,
            max_depth: 4,
            aovs: crate::aovs::all(),
            ..Settings::default()
        };
        let session = Session::new(&scene, size(SIZE), settings.clone()).expect("it makes sense");
        let film = |threads, tile, batch, region| {
            let renderer = Renderer::new(session.scene(), &settings, threads, tile, false);
            let renderer = renderer.expect("it starts").with_batch_size(batch);
            let mut film = Film::with_aovs(region, &settings.aovs);
            renderer.render(&mut film, &Silent);
            film
        };
        let all = session.film().region();
        let reference = film(1, 32, 1024, all);
        for (threads, tile, batch) in [(3, 5, 1), (2, 7, 7), (1, 32, 100)] {
            let other = film(threads, tile, batch, all);
            assert!(other == reference, "{}: {threads} {tile} {batch}", registration.name);
        }
        let part = Region { x: 3, y: 2, width: 5, height: 4 };
        let cropped = film(1, 32, 1024, part);
        for [x, y] in part.pixels() {
            assert!(cropped.pixel(x, y) == reference.pixel(x, y), "{}", registration.name);
        }
    }
}

/// Notes report animated objects; scenes whose motion cannot be represented are rejected.
#[test]
fn motions_are_reported_and_what_cannot_move_is_refused() {
    let (_, flying) = motions().swap_remove(0);
    let open = |scene: &Scene| Session::new(scene, size(SIZE), Settings::default());
    let notes = |scene: &Scene| open(scene).expect("it makes sense").notes().join("; ");
    let moving = scene(&flying);
    assert_eq!(notes(&moving), "shapes that move while the shutter is open, from 0.25 to 1.5 s: 2");
    let closed = notes(&at_once(&moving, 0.5));
    assert!(closed.starts_with("moving objects are shown as at 0.5 s"), "{closed}");
    let refused = |scene: &Scene| open(scene).err().expect("it is refused").to_string();
    for shutter in [[1.0, 0.5], [f64::NAN, 1.0], [0.0, f64::INFINITY]] {
        let mut scene = moving.clone();
        scene.cameras[0].shutter = shutter;
        assert!(refused(&scene).contains("expected finite times"), "{}", refused(&scene));
    }
    let grid = Grid { resolution: [1; 3], channels: 1, values: vec![1.0] };
    let (to_world, filter) = (DAffine3::IDENTITY, GridFilter::Trilinear);
    let extinction = PlacedGrid { grid: Arc::new(grid), to_world, filter };
    let (albedo, emission) = (Volume::Constant([0.5; 3]), MediumEmission::Constant([0.0; 3]));
    let matter = MediumProperties::Heterogeneous(Box::new(Heterogeneous {
        extinction,
        scale: 1.0,
        albedo,
        emission,
    }));
    let (name, at) = (String::new(), pt_scene::Span::default());
    let mut cloudy = moving;
    cloudy.media.push(Medium { name, matter, phase: Phase::Isotropic, at });
    cloudy.objects[4].media = Some(Sides { interior: Some(0), exterior: None });
    assert!(refused(&cloudy).contains("medium inside of a moving shape"), "{}", refused(&cloudy));
    // A static object may have it.
    assert!(open(&at_once(&cloudy, 0.5)).is_ok());
}
