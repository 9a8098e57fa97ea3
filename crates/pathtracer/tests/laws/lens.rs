//! The thin lens: points in the plane of focus are sharp, and other points become disks.
//!
//! The image is measured at distance 1. A lens of radius R in focus at f blurs a point at distance
//! d to a disk of radius c = R |d − f| / (d f), evenly lit; a small sphere of radius r, without
//! blur a disk of radius s = r/d, becomes the convolution of the two. Its light is that of the
//! sharp disk, π s², and its second moment the sum of both, c²/2 + s²/2.

use pathtracer::{Camera, Film};
use pt_math::DVec3;
use pt_testing::{Estimates, z_test};

use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, size};

const RESOLUTION: u32 = 30;
const LENS: f64 = 0.2;
const FOCUS: f64 = 4.0;
const SPHERE: f64 = 0.05;
/// Relative error of sums over the pixels of an image with a sharp rim.
const GRID_ERROR: f64 = 1e-3;

/// Image of an emissive sphere, from −`half` to `half` at distance 1.
fn image(distance: f64, half: f64) -> Film {
    let fov = 2.0 * half.atan().to_degrees();
    let view = camera(DVec3::ZERO, DVec3::NEG_Z, [fov, fov]);
    let view = Camera { lens_radius: LENS, focal_distance: FOCUS, ..view };
    let sphere = DVec3::new(0.0, 0.0, -distance);
    let scene = Builder::default().emissive_sphere(sphere, SPHERE, 1.0).seen_by(view);
    render(&scene, size([RESOLUTION; 2]), settings(1024)).film().clone()
}

/// Total light and second moment about the middle of an image, with their variances.
fn moments(film: &Film, pixel: f64) -> [(f64, f64); 2] {
    let at = |i: u32| (f64::from(i) + 0.5 - 0.5 * f64::from(RESOLUTION)) * pixel;
    let places = (0..RESOLUTION).flat_map(|y| (0..RESOLUTION).map(move |x| (x, y)));
    let pixels: Vec<_> = places
        .map(|(x, y)| {
            let (mean, error) = film.pixel(x, y).luminance();
            (at(x).powi(2) + at(y).powi(2), mean, error * error)
        })
        .collect();
    let sum = |f: &dyn Fn(&(f64, f64, f64)) -> f64| pixels.iter().map(f).sum::<f64>();
    let (light, variance) = (sum(&|p| p.1), sum(&|p| p.2));
    let moment = sum(&|p| p.0 * p.1) / light;
    let moment_variance = sum(&|p| (p.0 - moment).powi(2) * p.2) / (light * light);
    let area = pixel * pixel;
    // Pixels blur by a square of their size, with second moment area/6. [Sheppard's correction]
    [(light * area, variance * area * area), (moment - area / 6.0, moment_variance)]
}

#[test]
fn points_out_of_focus_become_disks() {
    for distance in [FOCUS, 8.0, 2.5] {
        let c = LENS * (distance - FOCUS).abs() / (distance * FOCUS);
        let s = SPHERE / distance;
        let half = 1.3 * (c + s);
        let pixel = 2.0 * half / f64::from(RESOLUTION);
        let film = image(distance, half);
        let got = moments(&film, pixel);
        let want = [std::f64::consts::PI * s * s, 0.5 * (c * c + s * s)];
        let mean = got.map(|m| m.0 as f32);
        let variance = got.map(|m| m.1 as f32);
        let grid_error = want.map(|w| (GRID_ERROR * w).powi(2) as f32);
        z_test(
            Estimates { mean: &mean, variance: &variance },
            Estimates { mean: &want.map(|w| w as f32), variance: &grid_error },
            1e-4,
        )
        .unwrap_or_else(|e| panic!("at {distance}, light and moment: {e}"));
        assert_dark_outside(&film, pixel, c + s);
    }
}

/// Asserts that no light is outside of the disk, to a pixel; the nearest half of the sphere is a
/// little nearer than its centre.
fn assert_dark_outside(film: &Film, pixel: f64, radius: f64) {
    let middle = 0.5 * f64::from(RESOLUTION);
    for y in 0..RESOLUTION {
        for x in 0..RESOLUTION {
            let (dx, dy) = (f64::from(x) + 0.5 - middle, f64::from(y) + 0.5 - middle);
            if dx.hypot(dy) * pixel > radius * 1.02 + pixel {
                assert_eq!(film.pixel(x, y).mean(), [0.0; 3], "{x}, {y}");
            }
        }
    }
}
