//! Of two surfaces close to each other, the nearer one is visible from any distance.

use pathtracer::{Scene, Session, Settings};
use pt_bvh::Hit;
use pt_cpu::Tracer;
use pt_math::{DAffine3, DVec3, Ray};
use pt_scene::{Mesh, shapes};

use crate::scenes::{Builder, camera, facing, matte, size};

const DISTANCES: [f64; 6] = [1e1, 1e2, 1e3, 1e4, 1e5, 1e6];
/// Angles in degrees between the view and the axis of the shapes.
const TILTS: [f64; 3] = [0.0, 20.0, 50.0];
const GAP: f64 = 1e-3;

/// Rays of a camera at a distance, through a square of four units around the origin, each with its
/// hit: number of the object, and shading normal.
fn seen(scene: Builder, distance: f64, tilt: f64) -> Vec<(Ray, Option<(u32, DVec3)>)> {
    let (sin, cos) = tilt.to_radians().sin_cos();
    let fov = 2.0 * (2.0 / distance).atan().to_degrees();
    let from = DVec3::new(0.6 * sin, cos, 0.8 * sin) * distance;
    let scene: Scene = scene.sky(1.0).seen_by(camera(from, DVec3::ZERO, [fov; 2]));
    let session = Session::new(&scene, size([64, 64]), Settings::default()).expect("it compiles");
    let scene = session.scene();
    let pixels = (0..64 * 64).map(|i| [(i % 64) as f32 + 0.5, (i / 64) as f32 + 0.5]);
    let rays: Vec<Ray> = pixels.map(|at| scene.camera.ray(at, [0.5; 2])).collect();
    let mut hits = Vec::new();
    Tracer::new(scene, false).intersect(&rays, |_| 0.0, &mut hits);
    let found = |(ray, hit): (Ray, &Option<Hit>)| {
        let of = |hit: &Hit| {
            let at = scene.interaction(&ray, hit, 0.0);
            assert!((f64::from(at.distance) / distance - 1.0).abs() < 5.0 / distance);
            (scene.object(hit.primitive), at.normal.as_dvec3())
        };
        (ray, hit.as_ref().map(of))
    };
    rays.iter().copied().zip(&hits).map(found).collect()
}

#[test]
fn flat_shapes_closely_above_a_floor_are_seen() {
    for (shape, mesh) in [("disk", shapes::disk()), ("rectangle", shapes::rectangle())] {
        for (distance, tilt) in DISTANCES.iter().flat_map(|d| TILTS.map(|t| (*d, t))) {
            let scene = Builder::default()
                .quad(facing(DVec3::ZERO, DVec3::Y, 5.0), matte([0.5; 3]))
                .mesh(mesh.clone(), facing(DVec3::Y * GAP, DVec3::Y, 1.0), matte([0.5; 3]));
            let mut counts = [0; 2];
            for (ray, found) in seen(scene, distance, tilt) {
                let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
                let p = o + d * ((GAP - o.y) / d.y);
                // Distance from the middle, in units of the radius of the disk or half of the side.
                let off = if shape == "disk" { p.length() } else { p.x.abs().max(p.z.abs()) };
                // The rim, which is that of a polygon, is not tested here.
                if (off - 1.0).abs() < 0.02 {
                    continue;
                }
                let want = u32::from(off < 1.0);
                let got = found.map(|(object, _)| object);
                assert_eq!(got, Some(want), "{shape} at {distance}, {tilt} degrees: {p}");
                counts[want as usize] += 1;
            }
            assert!(counts[0] > 400 && counts[1] > 400, "{counts:?}");
        }
    }
}

/// Only the outer one of a shape and its slightly larger copy is visible.
#[test]
fn shapes_hide_what_is_closely_inside() {
    let inner = DAffine3::from_scale(DVec3::splat(1.0 - GAP));
    // Around the axis x, with ends that are not in view.
    let lying = DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2)
        * DAffine3::from_translation(DVec3::Z * -9.0)
        * DAffine3::from_scale(DVec3::new(1.0, 1.0, 18.0));
    let meshes: [(&str, Mesh, DAffine3); 3] = [
        ("cube", shapes::cube(), DAffine3::IDENTITY),
        ("cylinder", shapes::cylinder(), lying),
        ("mesh of a sphere", shapes::sphere(), DAffine3::IDENTITY),
    ];
    for (distance, tilt) in DISTANCES.iter().flat_map(|d| TILTS.map(|t| (*d, t))) {
        for (shape, mesh, to_world) in &meshes {
            let scene = Builder::default()
                .mesh(mesh.clone(), inner * *to_world, matte([0.5; 3]))
                .mesh(mesh.clone(), *to_world, matte([0.5; 3]));
            let objects = seen(scene, distance, tilt).into_iter().filter_map(|(_, found)| found);
            let hidden = objects.filter(|(object, _)| *object == 0).count();
            assert!(hidden == 0, "{shape} at {distance}, {tilt} degrees: {hidden}");
        }
        let scene = Builder::default().sphere(DVec3::ZERO, 1.0 - GAP, matte([0.5; 3])).sphere(
            DVec3::ZERO,
            1.0,
            matte([0.5; 3]),
        );
        let mut count = 0;
        for (ray, found) in seen(scene, distance, tilt) {
            let Some((object, normal)) = found else { continue };
            let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3().normalize());
            let b = o.dot(d);
            // The radius 1 is exact in single precision.
            let power = 1.0 - (o - d * b).length_squared();
            if power < 1e-2 {
                continue;
            }
            let want = o - d * (b + power.sqrt());
            assert_eq!(object, 1, "sphere at {distance}, {tilt} degrees");
            assert!((normal - want).length() < 1e-6, "{normal} {want} at {distance}");
            count += 1;
        }
        assert!(count > 600, "{count}");
    }
}
