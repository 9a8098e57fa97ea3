//! Tests of error targets.

use pt_math::Spectrum;
use pt_testing::Random;

use super::*;
use crate::film::{HalfBuffer, Region};

const TARGET: Target = Target { error: Some(0.01), ..Target::NONE };
const MAX: u32 = 500;

/// Creates a film of this size, in which each pixel has the number of samples of its plan. `light`
/// maps the index of a pixel and a random number in [0, 1) to a sample. With the same seed and more
/// samples, the film contains the same samples and more.
fn film(size: [u32; 2], plan: SamplePlan, seed: u64, light: impl Fn(usize, f32) -> f32) -> Film {
    let mut film = Film::new(Region::full(size)).with_half_buffers();
    for (number, half) in (0..).zip(HalfBuffer::BOTH) {
        let half = film.half_mut(half);
        let first = half.first();
        for tile in &mut half.tiles(u32::MAX, [0; 2]) {
            for pixel in tile.region().pixels() {
                let i = (pixel[1] * size[0] + pixel[0]) as usize;
                let mut random = Random::new((seed << 32) + 2 * i as u64 + number);
                let samples: Vec<_> = (0..plan.wanted(i).min(MAX))
                    .map(|_| Spectrum::splat(light(i, random.unit())))
                    .collect();
                tile.add(pixel, first, &samples, None);
            }
        }
    }
    film.set_plan(plan);
    film
}

fn even(goal: u32) -> SamplePlan {
    SamplePlan { goal, least: goal, ..SamplePlan::default() }
}

/// The samples of all pixels are 0 or 0.6 with equal probability: the error of an image of 2n
/// samples is 1/√(2n). It is in the interval as often as the confidence requires.
#[test]
fn the_error_of_an_image_is_in_the_interval_that_is_reported() {
    let mut inside = 0;
    for seed in 0..400 {
        let film = film([30, 20], even(8), seed, |_, u| 0.6 * f32::from(u8::from(u < 0.5)));
        let evaluation = TARGET.evaluate(&film, 1).expect("there are samples");
        let square = |pixel: crate::film::PixelSums| (pixel.mean()[0] - 0.3).powi(2);
        let error = (film.pixels().map(square).sum::<f64>() / 600.0).sqrt() / 0.3;
        assert!((evaluation.measured.error - 0.25).abs() < 0.06, "{evaluation:?}");
        inside +=
            u32::from((evaluation.measured.lower..=evaluation.measured.upper).contains(&error));
    }
    assert!(inside >= 385, "{inside} of 400 are inside");
}

/// Samples far beyond white change nothing that is displayed. If one half is beyond white and the
/// other is not, the whole difference counts.
#[test]
fn what_is_beyond_white_is_white() {
    let bright = film([4, 4], even(8), 1, |_, u| 5.0 + u);
    let evaluation = TARGET.evaluate(&bright, 1).expect("there are samples");
    assert_eq!((evaluation.measured.error, evaluation.is_met()), (0.0, true));
    let mut one_half = Film::new(Region::full([1, 1])).with_half_buffers();
    for (half, light) in HalfBuffer::BOTH.into_iter().zip([20.0, 0.5]) {
        let half = one_half.half_mut(half);
        half.tiles(1, [0; 2])[0].add([0, 0], 0, &[Spectrum::splat(light)], None);
    }
    assert_eq!(one_half.square_errors(1.0), Some(vec![3.0 * 0.25]));
    assert_eq!(one_half.square_errors(100.0).map(|e| e[0] < 0.04), Some(true));
}

#[test]
fn a_pixel_has_no_say_in_its_own_samples() {
    for reuse in [1, 2, 4] {
        let densities = |own: f32| {
            let light = |i: usize, u: f32| if i == 21 * 40 + 17 { own * u } else { 0.3 * u };
            let film = film([40, 30], even(8), 9, light);
            TARGET.densities(&film, &even(8), reuse).expect("there are samples")
        };
        let (quiet, loud) = (densities(0.1), densities(0.9));
        let share = |d: f32| f64::from(d) - MIN_DENSITY;
        let relative = |d: &[f32], i: usize| share(d[i]) / share(d[0]);
        let has_changed = |i: usize| (relative(&quiet, i) / relative(&loud, i) - 1.0).abs() > 1e-5;
        let changed: Vec<_> = (0..quiet.len()).filter(|&i| has_changed(i)).collect();
        assert!(!changed.is_empty());
        for i in changed {
            let off = (i / 40).abs_diff(21).max((i % 40).abs_diff(17));
            assert!(
                off >= reuse as usize && off < NEIGHBOR_RADIUS + reuse as usize,
                "{reuse}: {i}"
            );
        }
    }
}

/// A quarter of the image has ten times the noise of the rest: its densities are 10 to the power
/// [`DENSITY_EXPONENT`] times as large, reduced by [`MIN_DENSITY`].
#[test]
fn samples_go_where_the_noise_is() {
    let noisy = |i: usize| i % 40 < 10;
    let light = |i: usize, u: f32| 0.5 + (u - 0.5) * if noisy(i) { 0.8 } else { 0.08 };
    let film = film([40, 32], even(16), 2, light);
    let target = Target { error: Some(0.03), ..TARGET };
    let evaluation = target.evaluate(&film, 1).expect("there are samples");
    let plan = target.next_plan(&film, &evaluation, 1, MAX).expect("there is more to do");
    let densities = plan.densities.clone().expect("pixels are distinguished");
    let mean = |is: bool| {
        let pixels = (0..40 * 32).filter(|&i| noisy(i) == is && !(6..14).contains(&(i % 40)));
        let (sum, n) = pixels.fold((0.0, 0.0), |(sum, n), i| (sum + densities[i], n + 1.0));
        sum / n
    };
    assert!(mean(true) > 5.0 * mean(false), "{plan:?}");
    assert!((0..40 * 32).all(|i| plan.wanted(i) >= 16));
}

/// The left half of the image is dark and vacant: densities of the rest are as if it did not exist,
/// a pixel surrounded by vacant ones has the average density, and vacant pixels have two samples in
/// each half.
#[test]
fn vacant_pixels_are_no_neighbours() {
    const ALONE: usize = 15 * 40 + 6;
    let is_vacant = |i: usize| i % 40 < 20 && i != ALONE;
    let light = |i: usize, u: f32| if is_vacant(i) { 0.0 } else { u };
    let vacant: Vec<bool> = (0..40 * 30).map(is_vacant).collect();
    let all = film([40, 30], even(16), 4, light);
    let densities = |vacant| {
        let plan = SamplePlan { vacant, ..even(16) };
        TARGET.densities(&all, &plan, 1).expect("there are samples")
    };
    let (with, without) = (densities(vacant.clone()), densities(Vec::new()));
    let edge = |densities: &[f32]| -> f32 {
        (0..30).map(|y| densities[y * 40 + 20] / densities[y * 40 + 32]).sum::<f32>() / 30.0
    };
    assert!((edge(&with) - 1.0).abs() < 0.1, "{}", edge(&with));
    assert!(edge(&without) < 0.75, "{}", edge(&without));
    assert_eq!(with[ALONE], 1.0);
    let target = Target { error: Some(0.03), ..TARGET };
    let film = film([40, 30], SamplePlan { vacant, ..even(16) }, 4, light);
    let evaluation = target.evaluate(&film, 1).expect("there are samples");
    let next = target.next_plan(&film, &evaluation, 1, MAX).expect("there is more to do");
    assert!(next.densities.is_some());
    for i in 0..40 * 30 {
        assert_eq!(next.wanted(i) == 2, is_vacant(i), "{i}: {}", next.wanted(i));
    }
}

/// Rounds of a render with independent samples: they end, and the last evaluation has met the
/// target.
#[test]
fn rounds_come_to_an_end() {
    let light = |i: usize, u: f32| 0.4 + (u - 0.5) * (i % 7) as f32 * 0.1;
    let of = |error, noise| Target { error, noise, ..TARGET };
    for target in [of(Some(0.02), None), of(None, Some(0.03)), of(Some(0.03), Some(0.05))] {
        let mut plan = target.first_plan(&Film::new(Region::full([24, 16])), MAX, Vec::new());
        for round in 0.. {
            assert!(round < 30, "{target}: no end");
            let film = film([24, 16], plan, 3, light);
            let evaluation = target.evaluate(&film, 1).expect("there are samples");
            let Some(next) =
                (!evaluation.is_met()).then(|| target.next_plan(&film, &evaluation, 1, MAX))
            else {
                assert!(target.error.is_none_or(|error| evaluation.measured.error <= error));
                assert!(target.noise.is_none_or(|noise| evaluation.noise <= noise));
                break;
            };
            plan = next.expect("more is allowed");
        }
    }
}

/// A column of pixels shows a lamp, and one sample in twenty of another pixel its reflection,
/// without which the error is one and a half times the allowed one. Renders hardly ever end before
/// the reflection is found.
#[test]
fn what_a_single_pixel_hides_is_found_before_a_render_ends() {
    const HIDES: usize = 9 * 24 + 7;
    let light = |i: usize, u: f32| match i {
        HIDES => 4.0 * f32::from(u8::from(u < 0.05)),
        _ if i.is_multiple_of(24) => 4.0,
        _ => 0.3 + (u - 0.5) * 0.05,
    };
    let shown = |i: usize| match i {
        HIDES => 0.2,
        _ if i.is_multiple_of(24) => 1.0,
        _ => 0.3,
    };
    let target = Target { error: Some(0.02), ..TARGET };
    let (mut ended, mut budget) = (0, 0);
    for seed in 0..60 {
        let mut plan = target.first_plan(&Film::new(Region::full([24, 16])), MAX, Vec::new());
        let film = loop {
            let film = film([24, 16], plan, seed, light);
            let evaluation = target.evaluate(&film, 1).expect("there are samples");
            if evaluation.is_met() {
                break Some(film);
            }
            match target.next_plan(&film, &evaluation, 1, MAX) {
                Some(next) => plan = next,
                None => break None,
            }
        };
        let Some(film) = film else { continue };
        let off = |(i, pixel): (usize, PixelSums)| (pixel.mean()[0].min(1.0) - shown(i)).powi(2);
        let error = film.pixels().enumerate().map(off).sum::<f64>();
        let all = (0..24 * 16).map(|i| shown(i) * shown(i)).sum::<f64>();
        ended += 1;
        budget += u32::from((error / all).sqrt() > 0.02);
    }
    assert!(ended >= 50 && budget <= 3, "{ended} of 60 ended, {budget} of these wrongly");
}

#[test]
fn no_pixel_has_more_samples_than_it_may() {
    let mut plan = TARGET.first_plan(&Film::new(Region::full([24, 16])), MAX, Vec::new());
    let mut rounds = 0;
    loop {
        let film = film([24, 16], plan.clone(), 6, |_, u| u);
        let evaluation = TARGET.evaluate(&film, 1).expect("there are samples");
        assert!(!evaluation.is_met());
        match TARGET.next_plan(&film, &evaluation, 1, MAX) {
            Some(next) => plan = next,
            None => break,
        }
        rounds += 1;
        assert!(rounds < 60, "{plan:?}");
    }
    assert!((0..24 * 16).all(|i| plan.wanted(i) >= MAX), "{plan:?}");
}

#[test]
fn sums_around_are_those_of_a_plain_loop() {
    let mut random = Random::new(8);
    for (width, height) in [(1, 1), (7, 3), (3, 9), (12, 10)] {
        let values: Vec<f64> = (0..width * height).map(|_| f64::from(random.unit())).collect();
        for reach in [0, 1, 4] {
            let near = |i: usize, j: usize| {
                (i / width).abs_diff(j / width) <= reach && (i % width).abs_diff(j % width) <= reach
            };
            for (i, sum) in sums_around(&values, width, reach).into_iter().enumerate() {
                let plain: f64 = (0..values.len()).filter(|&j| near(i, j)).map(|j| values[j]).sum();
                assert!((sum - plain).abs() < 1e-12, "{width} {height} {reach} {i}");
            }
        }
    }
}
