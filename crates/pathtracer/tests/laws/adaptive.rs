//! Adaptive sampling stops exactly where its formula says.

use pathtracer::{Adaptive, Film, Scene, Settings};
use pt_math::DVec3;

use crate::measure::{render, settings};
use crate::scenes::{Builder, camera, facing, matte, size};

const SPP: u32 = 100;
const SIZE: [u32; 2] = [16, 12];

/// A floor with a light above it and no background: half of the image is black.
pub(crate) fn scene() -> Scene {
    Builder::default()
        .quad(facing(DVec3::ZERO, DVec3::Y, 3.0), matte([0.5, 0.6, 0.7]))
        .emissive_quad(facing(DVec3::new(0.0, 1.0, 0.0), DVec3::NEG_Y, 0.4), 5.0)
        .seen_by(camera(DVec3::new(0.0, 2.0, 7.0), DVec3::new(0.0, 1.3, 0.0), [45.0, 36.0]))
}

fn film(spp: u32, adaptive: Option<Adaptive>) -> Film {
    render(&scene(), size(SIZE), Settings { adaptive, ..settings(spp) }).film().clone()
}

/// Returns true if 1.96 σ/√n ≤ tolerance · μ, with σ² the sample variance of luminance.
fn converged(film: &Film, [x, y]: [u32; 2], tolerance: f32) -> bool {
    let (mean, standard_error) = film.pixel(x, y).luminance();
    1.96 * standard_error <= f64::from(tolerance) * mean
}

/// A pixel has the samples of the first multiple of the batch at which it has converged, bit by
/// bit those of a render of as many samples; or all samples.
#[test]
fn pixels_stop_where_the_formula_says() {
    for (batch, tolerance) in [(8, 0.3), (30, 0.1), (1, 0.5), (64, 0.0)] {
        let adaptive = film(SPP, Some(Adaptive { batch, tolerance }));
        let checks: Vec<u32> = (1..=SPP / batch).map(|k| k * batch).collect();
        let prefixes: Vec<Film> = checks.iter().map(|&n| film(n, None)).collect();
        let all = film(SPP, None);
        let mut early = 0;
        for [x, y] in adaptive.region().pixels() {
            let got = adaptive.pixel(x, y);
            let stop = prefixes.iter().find(|f| converged(f, [x, y], tolerance)).unwrap_or(&all);
            assert!(got == stop.pixel(x, y), "pixel {x}, {y} of {batch} {tolerance}");
            early += u32::from(got.count() < SPP);
        }
        // Both stopping rules occur.
        let pixels = SIZE[0] * SIZE[1];
        assert!(early > pixels / 8, "{batch} {tolerance}: {early} stop early");
        assert!(early < pixels || tolerance > 0.2, "{batch} {tolerance}: {early} stop early");
    }
}

#[test]
fn black_pixels_stop_at_the_first_batch() {
    const BATCH: u32 = 8;
    let film = film(SPP, Some(Adaptive { batch: BATCH, tolerance: 0.0 }));
    let black: Vec<_> = film.pixels().filter(|p| p.mean() == [0.0; 3]).collect();
    assert!(black.len() > 30, "{}", black.len());
    assert!(black.iter().all(|p| p.count() == BATCH));
}
