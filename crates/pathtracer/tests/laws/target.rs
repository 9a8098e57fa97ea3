//! Error targets: renders reach them, and are unbiased.

use pathtracer::{Aov, Film, HalfBuffer, Samples, Scene, Settings, Target, aov, default_scene};
use pt_testing::{Estimates, z_test};

use crate::adaptive;
use crate::measure::render;
use crate::scenes::{size, under_a_sky};

const SIZE: [u32; 2] = [32, 24];

/// Settings for a noisy image without a visible lamp.
fn base() -> Settings {
    Settings { max_depth: 4, ..Settings::default() }
}

fn film(scene: &Scene, settings: Settings) -> Film {
    render(scene, size(SIZE), settings).film().clone()
}

fn to_target(error: f64, seed: u32) -> Settings {
    let target = Some(Target { error: Some(error), ..Target::NONE });
    Settings { target, spp: 1 << 16, seed, ..base() }
}

/// Displayed values of an image.
fn shown(film: &Film) -> Vec<f64> {
    film.pixels().flat_map(|pixel| pixel.mean()).map(|v| v.clamp(0.0, 1.0)).collect()
}

/// Relative root mean square error of the displayed image.
fn error(film: &Film, truth: &[f64]) -> f64 {
    let squares = shown(film).into_iter().zip(truth).map(|(a, b)| (a - b).powi(2));
    (squares.sum::<f64>() / truth.iter().map(|v| v * v).sum::<f64>()).sqrt()
}

/// The short form of `cargo xtask soak --only target`.
#[test]
fn images_are_as_good_as_was_asked_for() {
    const SEEDS: u32 = 10;
    let (mut good, mut inside, mut all, mut fewer) = (0, 0, 0, 0);
    for (name, scene, target) in [
        ("a Cornell box", default_scene(), 0.2),
        ("a floor below a lamp", adaptive::scene(), 0.005),
        ("sky", under_a_sky(), 0.03),
    ] {
        let truth = Settings { spp: 8192, seed: 1000, ..base() };
        let truth = shown(&film(&scene, truth));
        let mut samples = 0.0;
        for seed in 0..SEEDS {
            let settings = to_target(target, seed);
            let film = film(&scene, settings.clone());
            let look =
                settings.target.and_then(|target| target.evaluate(&film, 1)).expect("two halves");
            assert!(look.is_met(), "{name}: {look:?}");
            let error = error(&film, &truth);
            good += u32::from(error <= target);
            inside += u32::from((look.measured.lower..=look.measured.upper).contains(&error));
            samples += film.samples() as f64 / f64::from(SIZE[0] * SIZE[1] * SEEDS);
            all += 1;
        }
        let of_uniform = |seed| {
            let target = Target { error: Some(target), uniform: true, ..Target::NONE };
            let settings = Settings { target: Some(target), ..to_target(1.0, seed) };
            film(&scene, settings).samples() as f64 / f64::from(SIZE[0] * SIZE[1])
        };
        let even = (0..3).map(of_uniform).sum::<f64>() / 3.0;
        println!("{name}: {samples:.0} samples, {:.2} of {even:.0}", samples / even);
        fewer += u32::from(samples <= 0.7 * even);
    }
    println!("{good} of {all} good, {inside} inside, fewer samples in {fewer}");
    assert!(f64::from(good) >= 0.95 * f64::from(all), "{good} of {all}");
    assert!(f64::from(inside) >= 0.95 * f64::from(all), "{inside} of {all}");
    // Half of the image of the floor is black; with so few pixels and samples, adaptive sampling
    // gains little in images with noise everywhere.
    assert!(fewer >= 1, "{fewer}");
}

/// In every square, the errors of the pixels are below the target with the requested confidence.
#[test]
fn pixels_are_as_good_as_was_asked_for() {
    let scene = default_scene();
    let truth = Settings { spp: 8192, seed: 1000, ..base() };
    let truth = shown(&film(&scene, truth));
    for noise in [0.1, 0.05] {
        let target = Some(Target { noise: Some(noise), ..Target::NONE });
        let film = film(&scene, Settings { target, spp: 1 << 16, ..base() });
        let good =
            shown(&film).iter().zip(&truth).filter(|(a, b)| (*a - *b).abs() <= noise).count();
        assert!(good as f64 >= 0.95 * truth.len() as f64, "{noise}: {good} of {}", truth.len());
    }
}

/// The mean of many images with few samples, whose allocation depends on these samples, is that of
/// images without adaptive allocation: also with pixels made noisy by rare bright paths.
#[test]
fn no_pixel_is_biased() {
    const RENDERS: u32 = 150;
    let scene = default_scene();
    let of = |settings: &dyn Fn(u32) -> Settings| {
        let pixels = (SIZE[0] * SIZE[1]) as usize;
        let mut sums = vec![(0.0f64, 0.0f64); pixels + 1];
        let mut samples = 0;
        for seed in 0..RENDERS {
            let film = film(&scene, settings(seed));
            samples += film.samples();
            let values = film.pixels().map(|pixel| pixel.luminance().0);
            let values: Vec<f64> = values.collect();
            let whole = values.iter().sum::<f64>() / pixels as f64;
            for (sum, value) in sums.iter_mut().zip(values.into_iter().chain([whole])) {
                *sum = (sum.0 + value, sum.1 + value * value);
            }
        }
        let n = f64::from(RENDERS);
        let mean: Vec<f32> = sums.iter().map(|(sum, _)| (sum / n) as f32).collect();
        let variance =
            |&(sum, squares): &(f64, f64)| ((squares / n - (sum / n).powi(2)) / (n - 1.0)) as f32;
        (mean, sums.iter().map(variance).collect::<Vec<_>>(), samples)
    };
    let (mean, variance, samples) = of(&|seed| to_target(0.4, seed));
    let spp = 2 * (samples / u64::from(RENDERS * SIZE[0] * SIZE[1])) as u32;
    let (want, of_want, _) = of(&|seed| Settings { spp, seed: 10_000 + seed, ..base() });
    let estimates = Estimates { mean: &mean, variance: &variance };
    z_test(estimates, Estimates { mean: &want, variance: &of_want }, 1e-3)
        .unwrap_or_else(|e| panic!("{spp} spp: {e}"));
}

/// The image is the mean of its half buffers, which differ.
#[test]
fn an_image_is_the_mean_of_its_halves() {
    let aovs = vec![Aov::HalfA, Aov::HalfB, Aov::Samples];
    let film = film(&default_scene(), Settings { spp: 5, aovs, ..base() });
    let channels = aov::channels(&film);
    let real = |name: &str| {
        let channel = channels.iter().find(|c| c.name == name).expect("it is kept");
        let Samples::Real(values) = &channel.samples else { panic!("no numbers") };
        values.clone()
    };
    for (c, name) in ["R", "G", "B"].into_iter().enumerate() {
        let (a, b) = (real(&format!("half_a.{name}")), real(&format!("half_b.{name}")));
        assert!(a != b);
        for (pixel, (a, b)) in film.pixels().zip(a.into_iter().zip(b)) {
            let mean = 0.5 * (f64::from(a) + f64::from(b));
            assert!((pixel.mean()[c] - mean).abs() <= 1e-6 * mean.abs(), "{name}");
        }
    }
    let counts = HalfBuffer::BOTH.map(|half| film.counts_of(half).max());
    assert_eq!(counts, [Some(3), Some(2)]);
    assert_eq!(film.uniform_spp(), Some(5));
}
