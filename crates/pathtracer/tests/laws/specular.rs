//! Radiance seen in mirrors and through glass is given by Fresnel's equations.

use pathtracer::{Scene, Settings};
use pt_math::{DAffine3, DVec3};
use pt_scene::material::{Conductor, Glass, Mirror};
use pt_scene::{Surface, shapes};
use pt_testing::sidak;

use crate::furnace::ESTIMATORS;
use crate::measure::{assert_uniform, render, settings};
use crate::scenes::{Builder, camera, facing, size};

const RADIANCE: f32 = 2.5;

/// A mirror on the floor, seen at an angle of incidence with tan θ = 2, that reflects an emissive
/// wall.
fn wall_in_a(mirror: Surface) -> Scene {
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 1.0), mirror)
        .emissive_quad(facing(DVec3::new(0.0, 1.5, -3.0), DVec3::Z, 1.0), RADIANCE)
        .seen_by(camera(DVec3::new(0.0, 1.0, 2.0), DVec3::ZERO, [1.0, 1.0]))
}

fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// Fresnel reflectance of a conductor by complex arithmetic: rₛ = (c − w)/(c + w) and
/// rₚ = (n²c − w)/(n²c + w), with n = η + ik and w² = n² − sin²θ.
fn conductor(cos: f64, eta: f64, k: f64) -> f64 {
    let n2 = (eta * eta - k * k, 2.0 * eta * k);
    let (re, im) = (n2.0 - (1.0 - cos * cos), n2.1);
    let length = re.hypot(im);
    let w = ((0.5 * (length + re)).sqrt(), (0.5 * (length - re)).sqrt());
    let ratio = |a: (f64, f64)| {
        let square = |x: f64, y: f64| x * x + y * y;
        square(a.0 - w.0, a.1 - w.1) / square(a.0 + w.0, a.1 + w.1)
    };
    0.5 * (ratio((cos, 0.0)) + ratio((n2.0 * cos, n2.1 * cos)))
}

#[test]
fn a_light_in_a_mirror_has_its_radiance() {
    let reflectance = [0.9, 0.5, 0.25];
    let want = f64::from(RADIANCE) * luminance(reflectance.map(f64::from));
    let scene = wall_in_a(Mirror { reflectance: reflectance.into() }.into());
    for direct in ESTIMATORS {
        for integrator in ["path", "direct", "cs184"] {
            let integrator = integrator.to_owned();
            let settings = Settings { direct, integrator, max_depth: 1, ..settings(4) };
            let what = format!("{direct:?}, {}", settings.integrator);
            assert_uniform(render(&scene, size([4, 4]), settings).film(), want, 1e-4, &what);
        }
    }
    let unseen = Settings { max_depth: 0, ..settings(4) };
    assert_uniform(render(&scene, size([4, 4]), unseen).film(), 0.0, 1e-4, "no interaction");
}

#[test]
fn a_light_in_a_metal_has_its_radiance_times_fresnel() {
    let (eta, k) = ([0.143, 0.375, 1.442], [3.983, 2.386, 1.603]);
    let gold =
        Conductor { eta, k, reflectance: [1.0; 3].into(), roughness: None, two_sided: false };
    let cos = 1.0 / 5f64.sqrt();
    let share = [0, 1, 2].map(|c| conductor(cos, f64::from(eta[c]), f64::from(k[c])));
    let want = f64::from(RADIANCE) * luminance(share);
    let film = render(&wall_in_a(gold.into()), size([1, 1]), settings(256));
    let (got, _) = film.film().pixel(0, 0).luminance();
    // The pixel is a degree wide; the reflectance varies by far less than 0.1 % over that.
    assert!((got / want - 1.0).abs() < 1e-3, "{got} {want}");
}

/// A pane transmits (1 − R)/(1 + R) of the light: including multiple reflections inside.
#[test]
fn a_light_behind_a_pane_is_dimmed_by_both_surfaces() {
    for ior in [1.5f32, 2.4] {
        let glass = Glass {
            reflectance: [1.0; 3].into(),
            transmittance: [1.0; 3].into(),
            ior,
            roughness: None,
        };
        let pane = DAffine3::from_scale(DVec3::new(5.0, 5.0, 0.1));
        let scene = Builder::default()
            .mesh(shapes::cube(), pane, glass.into())
            .emissive_quad(facing(DVec3::new(0.0, 0.0, -2.0), DVec3::Z, 4.0), RADIANCE)
            .seen_by(camera(DVec3::new(0.0, 0.0, 2.0), DVec3::ZERO, [1.0, 1.0]));
        let r = ((f64::from(ior) - 1.0) / (f64::from(ior) + 1.0)).powi(2);
        let want = f64::from(RADIANCE) * (1.0 - r) / (1.0 + r);
        for direct in ESTIMATORS {
            let settings = Settings { direct, max_depth: 500, ..settings(8192) };
            let film = render(&scene, size([3, 3]), settings);
            let what = format!("index {ior}, {direct:?}");
            assert_uniform(film.film(), want, sidak(1e-4, 8), &what);
        }
    }
}
