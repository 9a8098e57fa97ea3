//! Reconstruction filters: an edge has their profile, and their weights do not mislead adaptive
//! sampling.

use pathtracer::{Adaptive, Film, Filter, Scene, Settings};
use pt_math::DVec3;
use pt_testing::{Estimates, z_test};

use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, facing, size};

/// Columns of the image; its left half is emissive.
const WIDTH: u32 = 12;

/// An emissive square whose right edge is in the middle of the image.
fn edge() -> Scene {
    let side = 4.0;
    Builder::default()
        .emissive_quad(facing(DVec3::new(-side, 0.0, -1.0), DVec3::Z, side), 1.0)
        .seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [90.0, 90.0]))
}

fn film(scene: &Scene, settings: Settings) -> Film {
    render(scene, size([WIDTH, WIDTH]), settings).film().clone()
}

/// Integral by the midpoint rule.
fn integral(f: impl Fn(f64) -> f64, from: f64, to: f64) -> f64 {
    const STEPS: u32 = 20_000;
    let step = (to - from) / f64::from(STEPS);
    (0..STEPS).map(|i| f(from + (f64::from(i) + 0.5) * step)).sum::<f64>() * step
}

/// Fraction of the integral of a function over [−radius, radius] that is on the left of `x`.
fn share_left_of(f: impl Fn(f64) -> f64, radius: f64, x: f64) -> f64 {
    integral(&f, -radius, x.clamp(-radius, radius)) / integral(&f, -radius, radius)
}

/// Formulas of the filters, implemented independently.
fn profile(filter: Filter, x: f64) -> f64 {
    use std::f64::consts::PI;
    let sinc = |x: f64| if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
    // [Mitchell & Netravali 1988, eq. 8] with B = C = 1/3, and with B = 0 and C = 1/2.
    let cubic = |near: [f64; 3], far: [f64; 4]| {
        let a = x.abs();
        if a < 1.0 {
            near[0] * a.powi(3) + near[1] * a * a + near[2]
        } else {
            far[0] * a.powi(3) + far[1] * a * a + far[2] * a + far[3]
        }
    };
    match filter {
        Filter::Box => 1.0,
        Filter::TENT => 1.0 - x.abs(),
        Filter::GAUSSIAN => (-2.0 * x * x).exp() - (-8.0f64).exp(),
        Filter::MITCHELL => cubic([7.0, -12.0, 16.0 / 3.0], [-7.0 / 3.0, 12.0, -20.0, 32.0 / 3.0]),
        Filter::CATMULL_ROM => cubic([1.5, -2.5, 1.0], [-0.5, 2.5, -4.0, 2.0]),
        Filter::BLACKMAN_HARRIS => {
            let turn = PI * (x / 1.5 + 1.0);
            0.35875 - 0.48829 * turn.cos() + 0.14128 * (2.0 * turn).cos()
                - 0.01168 * (3.0 * turn).cos()
        }
        Filter::LANCZOS => sinc(x) * sinc(x / 3.0),
        _ => panic!("{filter:?} has no formula here"),
    }
}

/// A weight w = ±c has w² = c², so that a pixel with a fraction P of samples that hit the light has
/// the variance (c² P − μ²)/n. This is the mean of the estimates of the film.
#[test]
fn an_edge_has_the_profile_of_the_filter() {
    const SPP: u32 = 1024;
    let scene = edge();
    for filter in Filter::USUAL {
        let film = film(&scene, Settings { filter, ..settings(SPP) });
        let radius = filter.radius();
        let g = |x: f64| profile(filter, x);
        let size = |x: f64| g(x).abs();
        // ∫|g|/∫g, once for each axis.
        let gain = integral(size, -radius, radius) / integral(g, -radius, radius);
        let [mut mean, mut variance, mut want] = [const { Vec::new() }; 3];
        let mut estimates = [0.0; 2];
        for x in 0..WIDTH {
            let middle = f64::from(WIDTH) / 2.0 - (f64::from(x) + 0.5);
            let [value, share] =
                [share_left_of(g, radius, middle), share_left_of(size, radius, middle)];
            let samples = f64::from(WIDTH * SPP);
            let exact = (gain.powi(4) * share - value * value).max(0.0) / samples;
            let column: Vec<_> = (0..WIDTH).map(|y| film.pixel(x, y).luminance()).collect();
            mean.push((column.iter().map(|p| p.0).sum::<f64>() / f64::from(WIDTH)) as f32);
            variance.push((exact + 1e-10) as f32);
            want.push(value as f32);
            estimates[0] += column.iter().map(|p| p.1 * p.1).sum::<f64>();
            estimates[1] += exact * f64::from(WIDTH * WIDTH);
        }
        let exact = vec![0.0; want.len()];
        z_test(
            Estimates { mean: &mean, variance: &variance },
            Estimates { mean: &want, variance: &exact },
            1e-4,
        )
        .unwrap_or_else(|e| panic!("{filter:?}: {e}"));
        let [film, exact] = estimates;
        assert!((film - exact).abs() <= 0.02 * exact + 1e-9, "{filter:?}: {film} is not {exact}");
        let overshoots = want.iter().any(|v| *v > 1.005);
        let has_lobes = matches!(filter, Filter::MITCHELL | Filter::CATMULL_ROM | Filter::LANCZOS);
        assert_eq!(overshoots, has_lobes, "{filter:?}");
    }
}

/// The box filter is a uniform point of the pixel, whatever other filters need.
#[test]
fn the_box_is_the_default() {
    let scene = edge();
    let boxed = film(&scene, Settings { filter: Filter::Box, ..settings(4) });
    assert!(film(&scene, settings(4)) == boxed);
    assert!(film(&scene, Settings { filter: Filter::TENT, ..settings(4) }) != boxed);
}

/// In a constant image, the variance of a few samples with weights of one sign is 0, although those
/// of the other sign are still to come.
#[test]
fn weights_do_not_end_adaptive_sampling_too_soon() {
    const TOLERANCE: f64 = 0.2;
    let scene =
        Builder::default().sky(1.0).seen_by(camera(DVec3::ZERO, DVec3::NEG_Z, [90.0, 90.0]));
    let adaptive = Some(Adaptive { batch: 4, tolerance: TOLERANCE as f32 });
    for (filter, least) in [(Filter::GAUSSIAN, 4), (Filter::MITCHELL, 50), (Filter::LANCZOS, 20)] {
        let film = film(&scene, Settings { adaptive, filter, ..settings(4096) });
        assert!(film.pixels().all(|p| p.count() >= least && p.count() < 4096), "{filter:?}");
        let mean = film.pixels().map(|p| p.luminance().0).sum::<f64>() / f64::from(WIDTH * WIDTH);
        // Stopping by the samples so far favours samples of one sign, by little compared with the
        // tolerance. Four weights of one sign would be 14 % too bright with the mildest of these
        // filters.
        assert!((mean - 1.0).abs() < 0.25 * TOLERANCE, "{filter:?}: {mean}");
    }
}

#[test]
fn a_filter_that_makes_no_sense_is_refused() {
    let filter = Filter::Tent { radius: -1.0 };
    let scene = edge();
    let settings = Settings { filter, ..settings(1) };
    let mut session = pathtracer::Session::new(&scene, size([2, 2]), settings).expect("a scene");
    let error = session.render(1, 16, &pathtracer::Silent).expect_err("no filter");
    assert!(error.to_string().contains("filter radius of -1"), "{error}");
}
