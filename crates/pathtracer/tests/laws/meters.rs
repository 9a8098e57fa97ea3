//! Sensors that measure one number instead of an image.

use std::f64::consts::PI;
use std::sync::Arc;

use pathtracer::{Camera, Meter, Quantity, Session};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::Black;
use pt_scene::{Geometry, shapes};

use crate::measure::{assert_uniform, render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

/// All pixels are estimates of the same number.
const SIZE: [u32; 2] = [16, 16];

fn meter(quantity: Quantity, geometry: Geometry, to_world: DAffine3) -> Camera {
    let meter = Some(Meter { quantity, geometry, to_world });
    Camera { meter, ..camera(DVec3::new(0.0, 4.0, 0.0), DVec3::ZERO, [30.0; 2]) }
}

fn quad() -> Geometry {
    Geometry::Mesh(Arc::new(shapes::rectangle()))
}

/// E = π L in an environment of radiance L, with any sample: on the outside of a sphere that is
/// part of the scene, and on a square in front of it that is not.
#[test]
fn an_even_sky_has_the_irradiance_pi() {
    let center = DVec3::new(1.0, 2.0, -3.0);
    let place = DAffine3::from_translation(center);
    let sphere = Geometry::Sphere { radius: 0.5 };
    for (geometry, to_world) in [(sphere, place), (quad(), DAffine3::IDENTITY)] {
        let scene = Builder::default()
            .sphere(center, 0.5, matte([0.5; 3]))
            .sky(2.0)
            .seen_by(meter(Quantity::Irradiance, geometry, to_world));
        let session = render(&scene, size(SIZE), settings(16));
        for [x, y] in session.film().region().pixels() {
            let got = session.film().pixel(x, y).luminance().0;
            assert!((got / (2.0 * PI) - 1.0).abs() < 1e-6, "{got} is not 2π");
        }
    }
}

/// Under the middle of a disk of radius r at height h, E = π L r² / (r² + h²), whatever the unit
/// is.
#[test]
fn a_disk_has_the_irradiance_of_its_cone() {
    let (r, h, radiance) = (0.8, 1.1, 3.0);
    let disk = facing(DVec3::new(0.0, h, 0.0), DVec3::NEG_Y, r);
    let mut scene = Builder::default()
        .emissive_mesh(shapes::disk(), disk, Black.into(), radiance)
        .seen_by(meter(Quantity::Irradiance, quad(), facing(DVec3::ZERO, DVec3::Y, 1e-3)));
    for metres in [1.0, 0.01] {
        scene.metres_per_unit = metres;
        let session = render(&scene, size(SIZE), settings(400));
        let want = PI * f64::from(radiance) * r * r / (r * r + h * h);
        assert_uniform(session.film(), want, 1e-4, "a disk");
    }
}

/// Seen from far away, a sphere of radiance L covers π r² of the area of the target, which is a
/// square of side 4, or the sphere itself.
#[test]
fn parallel_rays_measure_the_mean_over_their_target() {
    let sphere = Geometry::Sphere { radius: 0.5 };
    let at = DVec3::new(0.2, -3.0, 0.1);
    for (geometry, to_world, want) in [
        (quad(), facing(DVec3::ZERO, DVec3::Y, 2.0), 2.0 * PI * 0.25 / 16.0),
        // The rays of all points of a sphere meet it.
        (sphere, DAffine3::from_translation(at), 2.0),
    ] {
        let scene = Builder::default().emissive_sphere(at, 0.5, 2.0).seen_by(meter(
            Quantity::Radiance,
            geometry,
            to_world,
        ));
        let session = render(&scene, size(SIZE), settings(400));
        assert_uniform(session.film(), want, 1e-4, "parallel rays");
    }
}

#[test]
fn meters_that_make_no_sense_are_refused() {
    let flat = DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0));
    let stretched = DAffine3::from_scale(DVec3::new(1.0, 2.0, 1.0));
    let sphere = || Geometry::Sphere { radius: 1.0 };
    let empty = Geometry::Mesh(Arc::default());
    for (geometry, to_world, word) in [
        (quad(), flat, "flattened"),
        (sphere(), stretched, "non-uniformly scaled"),
        (Geometry::Sphere { radius: 0.0 }, DAffine3::IDENTITY, "without area"),
        (empty, DAffine3::IDENTITY, "without area"),
    ] {
        let scene =
            Builder::default().sky(1.0).seen_by(meter(Quantity::Irradiance, geometry, to_world));
        let Err(error) = Session::new(&scene, size(SIZE), settings(1)) else {
            panic!("{word} is not said")
        };
        let message = error.to_string();
        assert!(message.contains(word), "{word}: {message}");
    }
}
