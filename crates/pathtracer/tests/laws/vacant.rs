//! Detection of pixels that show only a constant background, before any sample is taken.

use std::sync::Arc;

use pathtracer::{Camera, Projection, Region, Scene, Session, Settings, Silent, Target};
use pt_core::RenderScene;
use pt_math::{DAffine3, DVec3, Vec3};
use pt_scene::{Filter, Key, Mesh, Motion, shapes};
use pt_testing::Random;

use crate::invariance::moved;
use crate::media;
use crate::scenes::{Builder, camera, facing, matte, size, under_a_sky};

const SIZE: [u32; 2] = [70, 50];

/// Number of rays that test the area of a pixel.
const RAYS: f32 = 400.0;

/// Settings whose error target is met at its first evaluation.
fn settings(filter: Filter) -> Settings {
    let target = Some(Target { error: Some(10.0), ..Target::NONE });
    Settings { target, filter, max_depth: 1, ..Settings::default() }
}

/// Renders a region, and returns true for each vacant pixel; empty if there is none.
fn vacant(scene: &Scene, filter: Filter, region: Region) -> (Session, Vec<bool>) {
    let mut session = Session::new(scene, size(SIZE), settings(filter)).expect("it makes sense");
    session.restrict(region).expect("it is inside");
    session.render(0, 16, &Silent).expect("the settings make sense");
    let vacant = session.film().plan().expect("there is a target").vacant.clone();
    (session, vacant)
}

/// Triangles of all sizes, some of them needles, in a ball around the origin.
fn shards(count: u32) -> Mesh {
    let mut random = Random::new(5);
    let mut vector = |size: f32| {
        let mut unit = || 2.0 * random.unit() - 1.0;
        size * Vec3::new(unit(), unit(), unit())
    };
    let corners = (0..count).flat_map(|i| {
        let (center, size) = (vector(1.0), 0.5 / (1 + i % 37) as f32);
        let along = vector(size);
        let across = vector(if i % 3 == 0 { 1e-4 } else { size });
        [center, center + along, center + across].map(|p| p.to_array())
    });
    let positions = corners.collect();
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { positions, triangles, ..Mesh::default() }
}

/// Shards, balls and a block over a floor that ends behind the camera.
fn scene() -> Builder {
    let block = DAffine3::from_translation(DVec3::new(-1.8, 0.6, 0.4))
        * DAffine3::from_rotation_y(0.5)
        * DAffine3::from_scale(DVec3::new(0.3, 0.8, 0.2));
    let gray = || matte([0.5; 3]);
    Builder::default()
        .quad(facing(DVec3::new(0.0, -1.0, 0.0), DVec3::new(0.1, 1.0, 0.0), 9.0), gray())
        .mesh(shards(60), DAffine3::from_translation(DVec3::new(0.3, 0.9, 0.0)), gray())
        .mesh(shapes::cube(), block, gray())
        .sphere(DVec3::new(1.9, 1.3, -0.5), 0.4, gray())
        .sphere(DVec3::new(-1.2, 1.9, -3.0), 0.05, gray())
        .sky(0.4)
}

fn view() -> Camera {
    camera(DVec3::new(0.2, 0.9, 6.0), DVec3::new(0.0, 0.9, 0.0), [42.0, 31.0])
}

/// The scene with an animated block, which is an instance.
fn in_motion() -> Scene {
    let key = |time, x| Key { time, to_world: DAffine3::from_translation(DVec3::new(x, 1.5, 0.0)) };
    let motion = Motion::new(vec![key(0.0, -1.0), key(1.0, 0.6)]).expect("the keys make sense");
    let mut scene = scene().seen_by(Camera { shutter: [0.0, 1.0], ..view() });
    scene.objects[2].motion = Some(Arc::new(motion));
    scene
}

/// Returns true if a ray through a random point of the image around the middle of a pixel, at most
/// as far from it as the filter reaches, hits anything.
fn hits(scene: &RenderScene, [x, y]: [u32; 2], radius: f32, random: &mut Random) -> bool {
    let mut near = |i: u32| i as f32 + 0.5 + radius * (2.0 * random.unit() - 1.0);
    let at = [near(x), near(y)];
    let ray = scene.camera.ray(at, [random.unit(), random.unit()]);
    let time = random.unit();
    let placed = scene.instances.as_ref();
    scene.bvh.occluded(&ray) || placed.is_some_and(|placed| placed.occluded(&ray, time))
}

/// Random rays miss objects that are visible only in a corner of a square, or from a part of the
/// lens, so that they overestimate the number of vacant pixels.
#[test]
fn rays_of_vacant_pixels_hit_nothing_and_those_of_most_others_do() {
    let gaussian = Filter::Gaussian { stddev: 0.5, radius: 2.0 };
    let lens = Camera { lens_radius: 0.06, focal_distance: 5.0, ..view() };
    let parallel = Camera {
        projection: Projection::Orthographic { half_width: 2.6, half_height: 1.9 },
        ..view()
    };
    let low = camera(DVec3::new(1.0, -0.7, 4.0), DVec3::new(0.0, 0.9, 0.0), [100.0, 80.0]);
    // 70 km away, where rounding is as large as pixels; and with the scene 12 km away from the
    // origin of the world.
    let telescope = camera(DVec3::new(0.0, 0.9, 7e4), DVec3::new(0.0, 0.9, 0.0), [4e-3, 3e-3]);
    let away = DAffine3::from_translation(DVec3::new(1e4, -7e3, 2e3));
    let far = |camera: &Camera| moved(scene().seen_by(camera.clone()), away);
    let all = Region::full(SIZE);
    let part = Region { x: 21, y: 9, width: 33, height: 29 };
    for (name, scene, filter, region, least) in [
        ("a pinhole", scene().seen_by(view()), Filter::Box, all, 0.9),
        ("a wide filter", scene().seen_by(view()), gaussian, all, 0.9),
        ("a part", scene().seen_by(view()), Filter::Box, part, 0.9),
        ("a lens", scene().seen_by(lens.clone()), Filter::Box, all, 0.7),
        ("parallel rays", scene().seen_by(parallel.clone()), Filter::Box, all, 0.9),
        ("a telescope", scene().seen_by(telescope), Filter::Box, all, 0.6),
        ("parallel rays far away", far(&parallel), Filter::Box, all, 0.8),
        ("a lens far away", far(&lens), Filter::Box, all, 0.6),
        ("a camera near the floor", scene().seen_by(low), Filter::Box, all, 0.9),
        ("motion", in_motion(), Filter::Box, all, 0.9),
    ] {
        let (session, vacant) = vacant(&scene, filter, region);
        let mut random = Random::new(7);
        let (mut free, mut found) = (0, 0);
        let rows = (region.y..region.y + region.height)
            .flat_map(|y| (region.x..region.x + region.width).map(move |x| [x, y]));
        for (pixel, vacant) in rows.zip(&vacant) {
            let radius = filter.radius() as f32;
            let mut rays = 0..(RAYS * (2.0 * radius).powi(2)) as u32;
            let is_hit = rays.any(|_| hits(session.scene(), pixel, radius, &mut random));
            assert!(!(is_hit && *vacant), "{name}: {pixel:?} sees something");
            free += u32::from(!is_hit);
            found += u32::from(*vacant);
        }
        println!("{name}: {found} of {free}");
        assert!(f64::from(found) >= least * f64::from(free), "{name}: {found} of {free}");
        assert!(free > 300, "{name}: {free} see nothing");
    }
}

#[test]
fn vacant_pixels_have_four_samples_and_what_the_sky_has() {
    let (session, vacant) = vacant(&scene().seen_by(view()), Filter::Box, Region::full(SIZE));
    assert!(vacant.contains(&true) && vacant.contains(&false));
    for (pixel, is_vacant) in session.film().pixels().zip(vacant) {
        if is_vacant {
            assert_eq!((pixel.count(), pixel.mean()), (4, [f64::from(0.4f32); 3]));
            assert!(pixel.luminance().1 < 1e-4, "no more than rounding");
        } else {
            assert!(pixel.count() >= 16, "{}", pixel.count());
        }
    }
}

/// An environment map, fog around the camera, filters with negative weights, and uniform sampling.
#[test]
fn no_pixel_is_vacant_where_samples_may_differ() {
    let all = Region::full(SIZE);
    let clear = scene().seen_by(view());
    let around = Camera { projection: Projection::Panorama, ..view() };
    for (name, scene, filter) in [
        ("a map", under_a_sky(), Filter::Box),
        ("fog", media::fog(), Filter::Box),
        ("signs", clear.clone(), Filter::MITCHELL),
        ("a panorama", scene().seen_by(around), Filter::Box),
    ] {
        assert!(vacant(&scene, filter, all).1.is_empty(), "{name}");
    }
    let target = Some(Target { error: Some(10.0), uniform: true, ..Target::NONE });
    let settings = Settings { target, ..settings(Filter::Box) };
    let mut session = Session::new(&clear, size(SIZE), settings).expect("it makes sense");
    session.render(0, 16, &Silent).expect("the settings make sense");
    let counts: Vec<u32> = session.film().pixels().map(|pixel| pixel.count()).collect();
    assert!(counts.iter().all(|count| count == &counts[0]));
}
