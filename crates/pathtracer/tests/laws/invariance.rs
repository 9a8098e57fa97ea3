//! Equivalent descriptions of the same scene.

use std::sync::Arc;

use pathtracer::{Film, Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::Black;
use pt_scene::{Geometry, LightKind, Mesh, shapes};

use crate::measure::{Luminances, assert_agree, render, settings};
use crate::scenes::{Builder, camera, cornell, facing, looking, matte, size};

fn film(scene: &Scene, seed: u32) -> Film {
    let settings = Settings { max_depth: 4, seed, ..settings(4096) };
    render(scene, size([10, 8]), settings).film().clone()
}

/// The unit of length does not matter; a power of two does not even change the rounding.
#[test]
fn units_of_length_change_nothing() {
    let with = |metres_per_unit| film(&Scene { metres_per_unit, ..cornell() }, 0);
    assert!(with(1.0) == with(0.25));
    assert_agree(&with(1.0), &with(0.0254), 1e-4, "metres and inches");
}

pub(crate) fn moved(mut scene: Scene, by: DAffine3) -> Scene {
    for object in &mut scene.objects {
        object.to_world = by * object.to_world;
    }
    for camera in &mut scene.cameras {
        camera.to_world = by * camera.to_world;
    }
    for light in &mut scene.lights {
        light.to_world = by * light.to_world;
    }
    scene
}

/// Scene and camera translated, rotated and scaled together give the same image; the environment of
/// the scene is constant.
#[test]
fn a_scene_may_stand_anywhere() {
    let turn = DAffine3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 2.0);
    let by = DAffine3::from_translation(DVec3::new(30.0, -20.0, 50.0)) * turn;
    let by = by * DAffine3::from_scale(DVec3::splat(1.7));
    assert_agree(&film(&cornell(), 0), &film(&moved(cornell(), by), 1), 1e-4, "moved");
}

/// A mesh with a mirroring transform emits on the same side.
#[test]
fn mirrored_meshes_keep_their_front() {
    let scene = |mesh: Mesh, mirror: f64| {
        let place = facing(DVec3::Y, DVec3::NEG_Y, 0.5)
            * DAffine3::from_scale(DVec3::new(mirror, 1.0, 1.0));
        Builder::default()
            .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), matte([0.5; 3]))
            .emissive_mesh(mesh, place, Black.into(), 3.0)
            .seen_by(camera(DVec3::new(0.0, 1.5, 4.0), DVec3::ZERO, [50.0, 40.0]))
    };
    let plain = film(&scene(shapes::rectangle(), 1.0), 0);
    let mirrored = film(&scene(shapes::rectangle(), -1.0), 1);
    assert_agree(&plain, &mirrored, 1e-4, "mirrored");
    let context = plain.pixels().filter(|p| p.luminance().0 > 0.05).count();
    assert!(context >= 10, "{context} pixels are lit");
}

/// A light node in the place of an emissive mesh describes the same light, which counts once.
#[test]
fn light_is_not_counted_twice() {
    let middle = DVec3::new(0.0, 1.5, 0.0);
    let scene = || {
        Builder::default()
            .quad(facing(DVec3::ZERO, DVec3::Y, 2.0), matte([0.5; 3]))
            .emissive_quad(facing(middle, DVec3::NEG_Y, 0.5), 3.0)
    };
    let view = || camera(DVec3::new(0.0, 1.5, 4.0), DVec3::ZERO, [50.0, 40.0]);
    let once = film(&scene().seen_by(view()), 0);
    let node = looking(middle, DVec3::ZERO);
    for kind in [LightKind::Area { radiance: [3.0; 3] }, LightKind::Point { intensity: [3.0; 3] }] {
        let twice = scene().light(kind, node).seen_by(view());
        let session =
            render(&twice, size([10, 8]), Settings { max_depth: 4, seed: 1, ..settings(4096) });
        assert!(
            session.notes().iter().any(|n| n.contains("represents the emissive surface")),
            "{:?}",
            session.notes()
        );
        assert_agree(&once, session.film(), 1e-4, "with a node");
    }
}

/// A sphere, and the ellipsoid of triangles into which a stretched sphere is converted.
#[test]
fn a_hardly_stretched_sphere_is_a_sphere() {
    let scene = |stretch: f64| {
        let mut scene = Builder::default()
            .quad(facing(DVec3::NEG_Y, DVec3::Y, 4.0), matte([0.5; 3]))
            .sphere(DVec3::ZERO, 0.8, matte([0.7; 3]))
            .emissive_sphere(DVec3::new(-1.5, 0.5, 0.0), 0.4, 4.0)
            .seen_by(camera(DVec3::new(0.0, 1.0, 6.0), DVec3::ZERO, [40.0, 32.0]));
        for object in &mut scene.objects {
            if let Geometry::Sphere { .. } = object.geometry {
                object.to_world *= DAffine3::from_scale(DVec3::new(stretch, 1.0, 1.0));
            }
        }
        scene
    };
    let (round, stretched) = (film(&scene(1.0), 0), film(&scene(1.000_2), 1));
    let (a, b) = (Luminances::of(&round).whole(), Luminances::of(&stretched).whole());
    // 128 sectors by 64 rings lack less than 0.1 % of the surface; the rest is noise.
    let allowed = 0.001 * a.0 + 4.0 * a.1.hypot(b.1);
    assert!((a.0 - b.0).abs() < allowed, "{a:?} {b:?}");
}

/// One mesh of two parts, and two objects of one part each.
#[test]
fn parts_are_objects() {
    let mut two_faced = shapes::rectangle();
    two_faced.submeshes = vec![
        pt_scene::Submesh { triangles: 0..1, slot: 0 },
        pt_scene::Submesh { triangles: 1..2, slot: 1 },
    ];
    let place = facing(DVec3::ZERO, DVec3::Z, 1.0);
    let view = || camera(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, [40.0, 32.0]);
    let builder = || {
        let b = Builder::default().quad(place, matte([0.2, 0.8, 0.4]));
        b.quad(place, matte([0.9, 0.1, 0.3])).sky(1.0)
    };
    let mut whole = builder().seen_by(view());
    let mut split = whole.clone();
    whole.objects.to_mut().truncate(1);
    whole.objects[0].geometry = Geometry::Mesh(Arc::new(two_faced));
    whole.objects[0].materials = vec![Some(0), Some(1)];
    for (i, object) in split.objects.iter_mut().enumerate() {
        let mut mesh = shapes::rectangle();
        mesh.triangles = vec![mesh.triangles[i]].into();
        mesh.uvs = None;
        mesh.submeshes.clear();
        object.geometry = Geometry::Mesh(Arc::new(mesh));
    }
    assert_agree(&film(&whole, 0), &film(&split, 0), 1e-4, "parts and objects");
}
