//! Smooth shadows: a coarse sphere is lit like a sphere.

use std::f64::consts::PI;

use pathtracer::{CompileOptions, Session, Settings};
use pt_core::RenderScene;
use pt_math::{DAffine3, DVec3, Ray, Vec3};
use pt_scene::{Attribute, Mesh};
use pt_testing::Random;

use crate::scenes::{Builder, camera, matte, size};

/// A sphere of 80 triangles: an icosahedron, each face of which is divided into four. Its vertices
/// are on the unit sphere, and so are its normals.
fn sphere() -> Mesh {
    let g = f64::midpoint(1.0, 5f64.sqrt());
    let mut corners = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        let p = DVec3::new(0.0, a, b).normalize();
        corners.extend([p, DVec3::new(p.z, p.x, p.y), DVec3::new(p.y, p.z, p.x)]);
    }
    let edge = 2.0 / (g * g + 1.0).sqrt();
    let is_edge = |a: DVec3, b: DVec3| ((a - b).length() - edge).abs() < 1e-6;
    let mut mesh = Mesh::default();
    let mut add = |corners: [DVec3; 3]| {
        let [a, b, c] = corners;
        let turns = (b - a).cross(c - a).dot(a) > 0.0;
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners.map(|p| p.as_vec3().to_array()));
        let [second, third] = if turns { [1, 2] } else { [2, 1] };
        mesh.triangles.push([first, first + second, first + third]);
    };
    for (i, &a) in corners.iter().enumerate() {
        for (j, &b) in corners.iter().enumerate().skip(i + 1) {
            for &c in &corners[j + 1..] {
                if is_edge(a, b) && is_edge(b, c) && is_edge(c, a) {
                    let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
                    [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
                        .into_iter()
                        .for_each(&mut add);
                }
            }
        }
    }
    assert_eq!(mesh.triangles.len(), 80);
    mesh.normals = Some(Attribute { values: mesh.positions.clone(), indices: None });
    mesh.submeshes = vec![pt_scene::Submesh { triangles: 0..80, slot: 0 }];
    mesh
}

fn session(smooth_shadows: bool, to_world: DAffine3) -> Session {
    let scene = Builder::default()
        .mesh(sphere(), to_world, matte([0.5; 3]))
        .sky(1.0)
        .seen_by(camera(DVec3::Z * 4.0, DVec3::ZERO, [40.0, 40.0]));
    let options = CompileOptions { smooth_shadows, ..size([8, 8]) };
    Session::new(&scene, options, Settings::default()).expect("it compiles")
}

/// Error of the radiance along a ray of a coarse sphere of albedo ½, lit from the direction `l`
/// with unit normal irradiance, compared with the radiance cos θ / 2π of an exact sphere.
fn error(scene: &RenderScene, ray: &Ray, l: Vec3) -> Option<f64> {
    let hit = scene.bvh.intersect(ray)?;
    let at = scene.interaction(ray, &hit, 0.0);
    if at.normal.dot(at.wo) < 2e-3 {
        return None; // turned until it is visible
    }
    let bsdf = scene.bsdf(&at, None);
    let shadow = at.point.spawn(l);
    let context =
        if scene.bvh.occluded(&shadow) { 0.0 } else { f64::from(bsdf.eval(l).luminance()) };
    // Corners are unit vectors, and so the normal is that of the sphere above the point.
    let want = f64::from(at.normal.dot(l)).max(0.0) * 0.5 / PI;
    Some(context - want)
}

#[test]
fn a_coarse_sphere_is_lit_like_a_sphere() {
    for to_world in [DAffine3::IDENTITY, DAffine3::from_scale(DVec3::splat(100.0))] {
        let [flat, smooth] = [false, true].map(|smooth| session(smooth, to_world));
        let mut random = Random::new(3);
        let (mut worst, mut sum, mut count) = (0.0f64, 0.0, 0);
        for _ in 0..20_000 {
            let target = to_world.transform_point3(random.in_cube().as_dvec3() * 0.6);
            let from = to_world.transform_point3(random.direction().as_dvec3() * 5.0);
            let ray = Ray::new(from.as_vec3(), (target - from).normalize().as_vec3());
            let l = random.direction();
            let [a, b] = [&flat, &smooth].map(|s| error(s.scene(), &ray, l));
            let (Some(a), Some(b)) = (a, b) else { continue };
            worst = worst.max(b.abs());
            sum += a.abs();
            count += 1;
        }
        let without = sum / f64::from(count);
        assert!(count > 10_000, "{count}");
        assert!(worst < 1e-6, "{worst}");
        assert!(without > 1e-4, "{without}");
    }
}

#[test]
fn what_is_flat_stays_as_it_is() {
    let scene = || {
        Builder::default()
            .mesh(pt_scene::shapes::cube(), DAffine3::IDENTITY, matte([0.5; 3]))
            .sky(1.0)
            .seen_by(camera(DVec3::new(2.0, 3.0, 4.0), DVec3::ZERO, [40.0, 40.0]))
    };
    let render = |smooth_shadows| {
        let options = CompileOptions { smooth_shadows, ..size([8, 8]) };
        let mut scene = scene();
        for object in &mut scene.objects {
            if let pt_scene::Geometry::Mesh(mesh) = &mut object.geometry {
                std::sync::Arc::make_mut(mesh).normals = None;
            }
        }
        let session = crate::measure::render(&scene, options, crate::measure::settings(16));
        session.image().pixels
    };
    assert_eq!(render(false), render(true));
}
