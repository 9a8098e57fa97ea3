//! Front and back of a mesh with interpolated normals: by the geometric or by the shading normal.

use std::f64::consts::PI;

use pt_math::{DAffine3, DVec3};
use pt_scene::{Attribute, LightKind, shapes};

use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, looking, matte, size};

/// Mean radiance of a white wall in the plane z = 0 with the shading normal `n`, seen from `eye`
/// and lit from `light` so that a surface facing the light has radiance 1.
fn shown(n: DVec3, eye: DVec3, light: DVec3, sides_by_shading_normal: bool) -> f64 {
    let mut wall = shapes::rectangle();
    wall.normals =
        Some(Attribute { values: vec![n.as_vec3().to_array(); 4].into(), indices: None });
    let mut scene = Builder::default()
        .mesh(wall, DAffine3::IDENTITY, matte([1.0; 3]))
        .light(LightKind::Directional { irradiance: [PI as f32; 3] }, looking(light, DVec3::ZERO))
        .seen_by(camera(eye * 4.0, DVec3::ZERO, [2.0, 1.6]));
    scene.settings.sides_by_shading_normal = sides_by_shading_normal;
    let film = render(&scene, size([6, 6]), settings(4)).film().clone();
    film.pixels().map(|pixel| pixel.luminance().0).sum::<f64>() / 36.0
}

/// Light from below the wall, but in front of its shading normal, is rejected, unless the shading
/// normal alone decides, as in Mitsuba 3.9.1. For a viewer behind the shading normal, the normal is
/// bent towards the viewer, or the wall is black.
#[test]
fn normals_alone_decide_if_asked_to() {
    let n = DVec3::new(0.8, 0.0, 0.6);
    let below = DVec3::new(0.8, 0.0, -0.6);
    let front = DVec3::Z;
    for (light, consistent, alone) in [(below, 0.0, n.dot(below)), (n, 1.0, 1.0)] {
        for (sides, want) in [(false, consistent), (true, alone)] {
            let got = shown(n, front, light, sides);
            assert!((got - want).abs() < 1e-4, "{light}, {sides}: {got} for {want}");
        }
    }
    let averted = DVec3::new(-0.8, 0.0, 0.6);
    let behind = averted.dot(n) < 0.0;
    assert!(behind, "{averted}");
    let seen = shown(n, averted, n, false);
    assert!(seen > 0.3, "{seen}");
    // The wall is white on both sides: alone, the normal shows its back, which the light does not
    // reach.
    assert!(shown(n, averted, n, true).abs() < 1e-6);
}
