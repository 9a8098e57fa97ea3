//! Panoramas, orthographic cameras, and shifted films.

use std::f64::consts::{PI, TAU};

use pathtracer::{Aperture, Camera, CompileOptions, Projection, Region, Settings};
use pt_math::{DAffine3, DVec3};

use crate::measure::{assert_agree, assert_uniform, render, settings};
use crate::scenes::{Builder, camera, cornell, facing, looking, size};

fn panorama(from: DVec3, to: DVec3) -> Camera {
    Camera { projection: Projection::Panorama, ..camera(from, to, [90.0, 90.0]) }
}

#[test]
fn a_panorama_of_a_white_sky_is_white() {
    let view = panorama(DVec3::new(1.0, 2.0, 3.0), DVec3::ZERO);
    let film = render(&Builder::default().sky(1.0).seen_by(view), size([20, 10]), settings(4));
    assert_uniform(film.film(), 1.0, 1e-4, "white");
}

/// A small emissive sphere covers a solid angle of 2π(1 − cos θ), sin θ = radius/distance, around
/// the pixel at longitude and latitude of its direction; pixels cover 2π/w by π/h times the cosine
/// of their latitude.
#[test]
fn a_panorama_shows_a_small_light_where_it_is() {
    const SIZE: [u32; 2] = [60, 30];
    let eye = DVec3::new(0.3, -1.0, 2.0);
    for (longitude, latitude) in [(0.3, 0.2), (2.5, -0.7), (-1.9, 1.1), (3.1, 0.0)] {
        // Seen along +x with +y up: to the right is +z.
        let level = DVec3::new(f64::cos(longitude), 0.0, f64::sin(longitude)) * f64::cos(latitude);
        let direction = level + DVec3::Y * f64::sin(latitude);
        let (distance, radius) = (5.0, 0.3);
        let scene = Builder::default()
            .emissive_sphere(eye + direction * distance, radius, 1.0)
            .seen_by(panorama(eye, eye + DVec3::X));
        let session = render(&scene, size(SIZE), settings(512));
        let [w, h] = SIZE.map(f64::from);
        let (mut light, mut sum) = (0.0, DVec3::ZERO);
        for [x, y] in session.film().region().pixels() {
            let longitude = ((f64::from(x) + 0.5) / w - 0.5) * TAU;
            let latitude = (0.5 - (f64::from(y) + 0.5) / h) * PI;
            let area = TAU / w * (PI / h) * latitude.cos();
            let value = area * session.film().pixel(x, y).luminance().0;
            let level = DVec3::new(longitude.cos(), 0.0, longitude.sin()) * latitude.cos();
            sum += (level + DVec3::Y * latitude.sin()) * value;
            light += value;
        }
        let cos = (1.0f64 - (radius / distance) * (radius / distance)).sqrt();
        let want = TAU * (1.0 - cos);
        assert!((light / want - 1.0).abs() < 0.05, "{light} is not {want}");
        assert!((sum / light).distance(direction) < 0.01, "{} is not {direction}", sum / light);
    }
}

/// With parallel rays a sphere is a disk of its own size, however far away it is.
#[test]
fn parallel_rays_see_sizes_and_no_distances() {
    const SIZE: u32 = 40;
    let node = looking(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO);
    let view = |scale: f64| Camera {
        projection: Projection::Orthographic { half_width: 1.0 / scale, half_height: 1.0 / scale },
        to_world: node * DAffine3::from_scale(DVec3::splat(scale)),
        ..camera(DVec3::ZERO, DVec3::Z, [1.0, 1.0])
    };
    for (z, scale) in [(0.0, 1.0), (-50.0, 1.0), (2.0, 0.5)] {
        let center = DVec3::new(0.3, -0.2, z);
        let scene = Builder::default().emissive_sphere(center, 0.5, 1.0).seen_by(view(scale));
        let session = render(&scene, size([SIZE; 2]), settings(256));
        let (mut area, mut middle) = (0.0, [0.0; 2]);
        for pixel in session.film().region().pixels() {
            let value = session.film().pixel(pixel[0], pixel[1]).luminance().0;
            let at = pixel.map(|i| (f64::from(i) + 0.5) / f64::from(SIZE) * 2.0 - 1.0);
            (0..2).for_each(|i| middle[i] += at[i] * value);
            area += value;
        }
        let middle = middle.map(|sum| sum / area);
        area *= (2.0 / f64::from(SIZE)).powi(2);
        assert!((area / (PI * 0.25) - 1.0).abs() < 5e-3, "{z}: {area}");
        assert!((middle[0] - 0.3).abs() < 3e-3 && (middle[1] - 0.2).abs() < 3e-3, "{middle:?}");
    }
}

/// A region in the corner of an image with three times the field of view is the image of a film
/// that is shifted there.
#[test]
fn a_moved_film_shows_a_part_of_a_wider_one() {
    const SMALL: u32 = 16;
    let eye = DVec3::new(0.0, 0.0, 3.0);
    let half = 0.25f64;
    let fov = |half: f64| 2.0 * half.atan().to_degrees();
    let scene = |camera: Camera| pathtracer::Scene { cameras: vec![camera], ..cornell() };
    let narrow = camera(eye, DVec3::ZERO, [fov(half); 2]);
    // One width to the right, one height up.
    let moved = Camera { principal_point_offset: [1.0, -1.0], ..narrow };
    let moved = render(&scene(moved), size([SMALL; 2]), settings(256));
    let wide = camera(eye, DVec3::ZERO, [fov(3.0 * half); 2]);
    let region = Region { x: 2 * SMALL, y: 0, width: SMALL, height: SMALL };
    let seed = 1;
    let part = Settings { region: Some(region), seed, ..settings(256) };
    let part = render(&scene(wide), size([3 * SMALL; 2]), part);
    assert_eq!(part.film().region(), region);
    // Pixels of both films are in the same order.
    assert_agree(moved.film(), part.film(), 1e-4, "a moved film");
}

#[test]
fn what_makes_no_sense_is_refused() {
    let view = || camera(DVec3::Z, DVec3::ZERO, [40.0, 40.0]);
    let aperture = |blades, rotation| Camera {
        lens_radius: 0.1,
        aperture: Some(Aperture { blades, rotation }),
        ..view()
    };
    let flat = |half_width, half_height| Camera {
        projection: Projection::Orthographic { half_width, half_height },
        ..view()
    };
    let lens = CompileOptions { lens_radius: Some(0.5), ..size([4, 4]) };
    let none = || size([4, 4]);
    for (camera, options, message) in [
        (aperture(2, 0.0), none(), "number of aperture blades, expected 3 to 1000"),
        (aperture(2000, 0.0), none(), "number of aperture blades"),
        (aperture(5, f64::NAN), none(), "rotation of the aperture, expected a finite number"),
        (flat(0.0, 1.0), none(), "empty view, expected a width and a height above 0"),
        (flat(1.0, f64::INFINITY), none(), "empty view"),
        (flat(1.0, 1.0), lens, "lens of a camera that is not perspective"),
        (Camera { principal_point_offset: [f64::NAN, 0.0], ..view() }, none(), "film offset"),
    ] {
        let scene = Builder::default()
            .emissive_quad(facing(DVec3::ZERO, DVec3::Z, 1.0), 1.0)
            .seen_by(camera);
        let Err(error) = pathtracer::Session::new(&scene, options, settings(1)) else {
            panic!("{message} is not said")
        };
        assert!(error.to_string().contains(message), "{error}");
    }
}
