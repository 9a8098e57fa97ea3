//! Laws of the samplers.

use std::cell::Cell;

use pt_math::sampler::{HALF_B_OFFSET, LANES, Sampler, SamplerBlocks, SamplerConfig, SamplerKind};
use pt_testing::{Chi2, chi2_square, mean_z_test};

const KINDS: [SamplerKind; 4] =
    [SamplerKind::Sobol, SamplerKind::ZSobol, SamplerKind::Stratified, SamplerKind::Independent];

/// Point set that is arranged for 256 samples.
fn set(kind: SamplerKind, seed: u32) -> SamplerConfig {
    SamplerConfig { kind, seed, spp: 256 }
}

fn point(kind: SamplerKind, seed: u32, pixel: [u32; 2], sample: u32, d: u32) -> [f32; 2] {
    point_of(set(kind, seed), pixel, sample, d)
}

fn point_of(set: SamplerConfig, pixel: [u32; 2], sample: u32, d: u32) -> [f32; 2] {
    Sampler::new(set, pixel, sample).at_dimension(d).next_2d()
}

/// Returns true if the points, a power of two, are one in each of the intervals of every shape 2⁻ᵃ
/// × 2⁻⁽ᵏ⁻ᵃ⁾.
fn is_net(points: &[[f32; 2]]) -> bool {
    let k = points.len().ilog2();
    (0..=k).all(|a| {
        let (nx, ny) = (1usize << a, 1usize << (k - a));
        let mut hit = vec![false; points.len()];
        for [x, y] in points {
            let cell = (x * nx as f32) as usize * ny + (y * ny as f32) as usize;
            hit[cell] = true;
        }
        hit.iter().all(|&h| h)
    })
}

#[test]
fn aligned_runs_of_sobol_points_are_nets() {
    for (seed, pixel, d) in [(0, [0, 0], 0), (7, [13, 1000], 2), (u32::MAX, [3, 4], 133)] {
        for k in 0..=11 {
            for run in [0, 1, 7, 1 << 20] {
                let samples = (run << k)..((run + 1) << k);
                let points: Vec<_> =
                    samples.map(|s| point(SamplerKind::Sobol, seed, pixel, s, d)).collect();
                assert!(is_net(&points), "run {run} of 2^{k}, pixel {pixel:?}, dimension {d}");
            }
        }
    }
    let independent: Vec<_> =
        (0..64).map(|s| point(SamplerKind::Independent, 0, [0, 0], s, 0)).collect();
    assert!(!is_net(&independent), "the test does not distinguish nets from other points");
}

/// For split samples, all parts are a net, and so are those of each sample.
#[test]
fn parts_of_samples_are_nets() {
    for kind in [SamplerKind::Sobol, SamplerKind::ZSobol] {
        let set = SamplerConfig { spp: 8, ..set(kind, 3) };
        for pixel in [[0, 0], [5, 9], [255, 255]] {
            let parts = |sample| {
                let whole = Sampler::new(set, pixel, sample);
                (0..16).map(move |i| whole.split(4, i).at_dimension(6).next_2d())
            };
            for sample in 0..8 {
                assert!(is_net(&parts(sample).collect::<Vec<_>>()), "{kind:?} {pixel:?} {sample}");
            }
            assert!(is_net(&(0..8).flat_map(parts).collect::<Vec<_>>()), "{kind:?} {pixel:?}");
        }
    }
}

/// Splitting into one part changes nothing, and the parts of samples are the samples of a set that
/// is arranged for their number.
#[test]
fn parts_are_samples_of_a_larger_set() {
    for kind in KINDS {
        let (few, many) =
            (SamplerConfig { spp: 8, ..set(kind, 1) }, SamplerConfig { spp: 32, ..set(kind, 1) });
        let numbers = |s: Sampler| [0, 2, 7].map(|d| s.at_dimension(d).next_2d());
        for sample in 0..8 {
            let whole = Sampler::new(few, [3, 4], sample);
            assert_eq!(numbers(whole.split(0, 0)), numbers(whole), "{kind:?}");
            for part in 0..4 {
                let other = Sampler::new(many, [3, 4], 4 * sample + part);
                assert_eq!(numbers(whole.split(2, part)), numbers(other), "{kind:?}");
            }
        }
    }
}

#[test]
fn aligned_runs_of_sobol_numbers_are_stratified() {
    for k in 0..=11 {
        let mut hit = vec![false; 1 << k];
        for sample in 3 << k..4 << k {
            let set = set(SamplerKind::Sobol, 5);
            let mut s = Sampler::new(set, [8, 9], sample).at_dimension(11);
            hit[(s.next_1d() * (1 << k) as f32) as usize] = true;
        }
        assert!(hit.into_iter().all(|h| h), "2^{k}");
    }
}

/// Points of all samples of a rectangle of pixels.
fn points_of_square(
    set: SamplerConfig,
    corner: [u32; 2],
    sides: [u32; 2],
    d: u32,
) -> Vec<[f32; 2]> {
    let pixels =
        (0..sides[0] * sides[1]).map(|i| [corner[0] + i % sides[0], corner[1] + i / sides[0]]);
    pixels.flat_map(|p| (0..set.spp).map(move |s| point_of(set, p, s, d))).collect()
}

#[test]
fn zsobol_points_of_squares_of_pixels_are_nets() {
    for spp in [1, 2, 8, 16] {
        let set = SamplerConfig { spp, ..set(SamplerKind::ZSobol, 3) };
        for side in [1, 2, 4, 8, 16] {
            for corner in [[0, 0], [16, 48], [1024, 1 << 20]] {
                for d in [0, 2, 4, 133] {
                    let points = points_of_square(set, corner, [side; 2], d);
                    assert!(is_net(&points), "{spp} spp, {side}² pixels at {corner:?}, {d}");
                }
            }
        }
    }
    let sobol = SamplerConfig { spp: 16, ..set(SamplerKind::Sobol, 3) };
    assert!(!is_net(&points_of_square(sobol, [0, 0], [2, 2], 0)), "pixels have nothing in common");
}

/// Two pixels form a net with the neighbour to the right, below, or diagonally, by the dimension.
#[test]
fn zsobol_points_favour_no_direction() {
    let set = SamplerConfig { spp: 8, ..set(SamplerKind::ZSobol, 0) };
    let pixel = |p, d| points_of_square(set, p, [1, 1], d);
    for (d, other) in [(0, [1, 0]), (2, [0, 1]), (4, [1, 1]), (6, [1, 0]), (10, [1, 1])] {
        assert!(is_net(&[pixel([0, 0], d), pixel(other, d)].concat()), "dimension {d}");
    }
}

/// Each half is as evenly distributed as a whole, and their errors are uncorrelated.
#[test]
fn halves_are_nets_that_know_nothing_of_each_other() {
    const N: u32 = 16;
    for kind in KINDS {
        let set = SamplerConfig { spp: N, ..set(kind, 2) };
        let points = |pixel, first| (0..N).map(move |i| point_of(set, pixel, first + i, 4));
        let mean = |pixel, first| {
            let light = |[x, y]: [f32; 2]| f64::from(x * x * y + if x > 0.3 { y } else { 0.0 });
            points(pixel, first).map(light).sum::<f64>() / f64::from(N)
        };
        let pixels = (0..6000).map(|i| [i % 300 * 4, i / 300 * 4]);
        let (first, second): (Vec<f64>, Vec<f64>) =
            pixels.map(|p| (mean(p, 0), mean(p, HALF_B_OFFSET))).unzip();
        let average = first.iter().chain(&second).sum::<f64>() / (2.0 * first.len() as f64);
        let products: Vec<_> =
            first.iter().zip(&second).map(|(a, b)| (a - average) * (b - average)).collect();
        mean_z_test(&products, 0.0, 1e-3).unwrap_or_else(|e| panic!("{kind:?}: {e}"));
        if matches!(kind, SamplerKind::Sobol | SamplerKind::ZSobol) {
            assert!(is_net(&points([5, 6], HALF_B_OFFSET).collect::<Vec<_>>()), "{kind:?}");
        }
    }
}

/// A render may take more samples than its points were arranged for.
#[test]
fn samples_beyond_the_layout_are_other_points() {
    for kind in [SamplerKind::ZSobol, SamplerKind::Stratified] {
        let set = SamplerConfig { spp: 16, ..set(kind, 0) };
        let mut points: Vec<_> = (0..160).map(|s| point_of(set, [3, 5], s, 2)).collect();
        for run in points.chunks(16) {
            let mut strata: Vec<_> = run.iter().map(|p| (16.0 * p[1]) as u32).collect();
            strata.sort_unstable();
            assert!(strata.into_iter().eq(0..16), "{kind:?}: {run:?}");
        }
        points.sort_unstable_by(|a, b| a.partial_cmp(b).expect("numbers"));
        points.dedup();
        assert_eq!(points.len(), 160, "{kind:?}");
    }
}

/// No two points are in a cell of the grid, or in an interval of a coordinate as narrow as a cell
/// divided by the other side of the grid: with as many points as cells, all of these are taken.
#[test]
fn stratified_points_are_stratified() {
    for (spp, columns, rows) in [
        (1, 1, 1),
        (2, 1, 2),
        (7, 2, 4),
        (12, 3, 4),
        (16, 4, 4),
        (100, 10, 10),
        (512, 16, 32),
        (55, 7, 8),
    ] {
        for d in [0, 2, 77] {
            let set = SamplerConfig { spp, ..set(SamplerKind::Stratified, 1) };
            let points = points_of_square(set, [4, 9], [1, 1], d);
            let part = |v: f32, parts: u32| (v * parts as f32) as u32;
            let strata: [&dyn Fn([f32; 2]) -> u32; 3] = [
                &|[x, _]| part(x, columns * rows),
                &|[_, y]| part(y, columns * rows),
                &|[x, y]| part(y, rows) * columns + part(x, columns),
            ];
            for (i, stratum) in strata.iter().enumerate() {
                let taken: std::collections::HashSet<_> =
                    points.iter().map(|&p| stratum(p)).collect();
                assert_eq!(taken.len(), spp as usize, "{spp} points, dimension {d}, strata {i}");
            }
        }
    }
}

#[test]
fn blocks_of_samplers_are_the_samplers() {
    for kind in KINDS {
        for spp in [0, 1, 3, 256, 1 << 20, u32::MAX] {
            let set = SamplerConfig { spp, ..set(kind, 4) };
            let first = |i: u32| i + HALF_B_OFFSET * (i % 2);
            let run = |i: u32| ([i * 37, i / 3], first(i)..first(i) + 1 + i * i % 37);
            let runs: Vec<_> = (0..30).map(run).collect();
            let samples = runs.iter().flat_map(|(p, run)| run.clone().map(move |s| (*p, s)));
            let mut blocks = SamplerBlocks::new(set);
            // The previous contents do not matter.
            for _ in 0..2 {
                blocks.refill(runs.iter().cloned());
            }
            for (i, (pixel, sample)) in samples.enumerate() {
                let wanted = Sampler::new(set, pixel, sample);
                for d in [0, 5, 64] {
                    let point = wanted.at_dimension(d).next_2d();
                    assert_eq!(blocks.get(i).at_dimension(d).next_2d(), point, "{set:?}");
                    let [x, y] = blocks.points(i / LANES, d);
                    assert_eq!([x[i % LANES], y[i % LANES]], point, "{set:?}");
                }
            }
        }
    }
}

#[test]
fn numbers_side_by_side_are_those_of_each() {
    for kind in KINDS {
        let of_many_pixels = (0..200).map(|i| ([i, 3 * i], i * i * i));
        let of_one_pixel = (0..40).map(|i| ([7, 2], i * i * i));
        let samples: Vec<_> = of_many_pixels.chain(of_one_pixel).collect();
        let mut blocks = SamplerBlocks::new(set(kind, 9));
        blocks.refill(samples.iter().map(|&(pixel, i)| (pixel, i..i + 1)));
        for (d, log2_parts) in [(0, 0), (4, 0), (77, 0), (u32::MAX - 1, 0), (0, 1), (4, 3)] {
            let part = |&n: &u32| {
                let (pixel, i) = samples[(n >> log2_parts) as usize];
                let sample = Sampler::new(set(kind, 9), pixel, i);
                sample.split(log2_parts, n & ((1 << log2_parts) - 1)).at_dimension(d)
            };
            let all: Vec<_> = (0..(samples.len() as u32) << log2_parts).collect();
            for few in all.chunks(LANES).chain(all.chunks(3)) {
                let [x, y] = blocks.parts(log2_parts, few.iter().copied()).points(d);
                for (lane, s) in few.iter().map(part).enumerate() {
                    assert_eq!([x[lane], y[lane]], s.clone().next_2d());
                    assert_eq!(x[lane], s.clone().next_1d());
                }
            }
        }
    }
}

#[test]
fn numbers_are_functions_of_seed_pixel_sample_and_dimension() {
    for kind in KINDS {
        let mut s = Sampler::new(set(kind, 1), [2, 3], 4);
        assert_eq!(s.dimension(), 0);
        let (a, b, c) = (s.next_1d(), s.next_2d(), s.next_1d());
        assert_eq!(s.dimension(), 4);
        let fresh = |d| Sampler::new(set(kind, 1), [2, 3], 4).at_dimension(d);
        assert_eq!((fresh(3).next_1d(), fresh(1).next_2d(), fresh(0).next_1d()), (c, b, a));
        // Each argument matters.
        let p = point(kind, 1, [2, 3], 4, 0);
        let others = [
            point(kind, 2, [2, 3], 4, 0),
            point(kind, 1, [3, 2], 4, 0),
            point(kind, 1, [2, 4], 4, 0),
            point(kind, 1, [2, 3], 5, 0),
            point(kind, 1, [2, 3], 4, 2),
        ];
        assert!(others.iter().all(|o| *o != p), "{kind:?}");
    }
}

#[test]
fn numbers_lie_below_one() {
    for kind in KINDS {
        for i in 0..1 << 18 {
            let [x, y] = point(kind, 3, [i, i >> 9], i, 0);
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
        }
    }
}

/// Point set indexed by one varying argument.
type Walk = fn(SamplerKind, u32) -> [f32; 2];

/// Point sets of independent uniform points: along pixels, seeds and dimensions.
const WALKS: [(&str, Walk); 5] = [
    ("row of pixels", |kind, i| point(kind, 0, [i, 0], 0, 0)),
    ("column of pixels", |kind, i| point(kind, 0, [0, i], 0, 2)),
    ("square of pixels, later sample", |kind, i| point(kind, 0, [i & 511, i >> 9], 77, 40)),
    ("seeds", |kind, i| point(kind, i, [100, 100], 1, 0)),
    ("dimensions", |kind, i| point(kind, 9, [100, 100], 3, 2 * i)),
];

#[test]
fn points_of_other_pixels_seeds_and_dimensions_are_uniform() {
    for kind in KINDS {
        for (name, walk) in WALKS {
            let next = Cell::new(0);
            let draw = |_| Some(walk(kind, next.replace(next.get() + 1)));
            let title = format!("{kind:?} {name}");
            let config = Chi2 { bins: [64, 64], ..Chi2::new(&title).one_of(10) };
            chi2_square(draw, |_| 1.0, &config).unwrap();
        }
    }
    let next = Cell::new(0);
    let draw =
        |_| Some(point(SamplerKind::Independent, 0, [5, 5], next.replace(next.get() + 1), 0));
    chi2_square(draw, |_| 1.0, &Chi2::new("Independent samples")).unwrap();
}

/// Tests that the products (a − ½)(b − ½) of pairs of independent numbers have mean 0.
fn uncorrelated(name: &str, tests: usize, pair: impl Fn(u32) -> (f32, f32)) {
    let centred = |x: f32| f64::from(x) - 0.5;
    let products: Vec<_> = (0..1 << 16).map(&pair).map(|(a, b)| centred(a) * centred(b)).collect();
    let level = pt_testing::sidak(1e-4, tests);
    if let Err(failure) = mean_z_test(&products, 0.0, level) {
        panic!("{name}: {failure}");
    }
}

#[test]
fn neighbouring_pixels_and_seeds_are_uncorrelated() {
    let near = [(0, [1, 0]), (0, [0, 1]), (0, [1, 1]), (0, [16, 0]), (1, [0, 0]), (1, [1, 0])];
    let far = (20..32).map(|bit| (1 << bit, [0, 0]));
    let steps: Vec<(u32, [u32; 2])> = near.into_iter().chain(far).collect();
    for kind in KINDS {
        for &(seed, [dx, dy]) in &steps {
            // For this sampler, errors of neighbours are anticorrelated on purpose.
            if kind == SamplerKind::ZSobol && seed == 0 {
                continue;
            }
            for sample in [0, 5] {
                let title = format!("{kind:?} seed + {seed}, pixel + ({dx}, {dy})");
                uncorrelated(&title, 8 * steps.len(), |i| {
                    let [x, y] = [2 * (i & 255), 2 * (i >> 8)];
                    let a = point(kind, 0, [x, y], sample, 0)[0];
                    (a, point(kind, seed, [x + dx, y + dy], sample, 0)[0])
                });
            }
        }
    }
}

#[test]
fn dimensions_are_uncorrelated() {
    const DIMENSIONS: u32 = 12;
    let pairs = DIMENSIONS * (DIMENSIONS - 1) / 2;
    for kind in KINDS {
        for a in 0..DIMENSIONS {
            for b in a + 1..DIMENSIONS {
                let number = |i: u32, d: u32| {
                    let sample = Sampler::new(set(kind, 0), [i & 255, i >> 8], 0);
                    sample.at_dimension(d & !1).next_2d()[(d & 1) as usize]
                };
                let title = format!("{kind:?} dimensions {a} and {b}");
                uncorrelated(&title, 2 * pairs as usize, |i| (number(i, a), number(i, b)));
            }
        }
    }
}

#[test]
fn dimension_pairs_of_one_pixel_are_uncorrelated() {
    // Across the samples of one pixel: two pairs that took their points in the same order would
    // agree far too well.
    for kind in KINDS {
        for b in [2, 4, 6] {
            let title = format!("{kind:?} dimensions 0 and {b} of one pixel");
            uncorrelated(&title, 6, |i| {
                (point(kind, 0, [7, 7], i, 0)[0], point(kind, 0, [7, 7], i, b)[0])
            });
        }
    }
}

/// Mean squared error of the estimate of ∫(x − ½)(y − ½) = 0 with 256 points, over pixels.
fn mean_squared_error(kind: SamplerKind, pixels: u32) -> f64 {
    let estimate = |pixel: u32| {
        let value = |s| point(kind, 0, [pixel & 63, pixel >> 6], s, 0);
        let f = |[x, y]: [f32; 2]| (f64::from(x) - 0.5) * (f64::from(y) - 0.5);
        (0..256).map(|s| f(value(s))).sum::<f64>() / 256.0
    };
    (0..pixels).map(|p| estimate(p).powi(2)).sum::<f64>() / f64::from(pixels)
}

/// f = (x − ½)(y − ½) has variance σ² = 1/144 and no part that depends on one coordinate alone, so
/// that stratification of each coordinate gains nothing.
///
/// Independent points: the squared error has mean σ²/n.
///
/// A scrambled (0, m, 2)-net in base 2 removes the part of the variance in Haar functions of levels
/// k₁ + k₂ ≤ m − 2 and multiplies the rest by e at most. [Owen 1997, "Scrambled Net Variance for
/// Integrals of Smooth Functions", theorem 1 and lemma 4] Level k of x − ½ has the fraction ¾·4⁻ᵏ
/// of its variance. The remainder, with m = 8, is 9/16 · Σ_{s ≥ 7} (s + 1)·4⁻ˢ = 9/16 · 4⁻⁷ ·
/// (8·4/3 + 4/9) = 25/4 · 4⁻⁷, and e times that is 1/965 of σ²/n: the error is at least 31 times
/// smaller.
#[test]
fn sobol_points_integrate_better_by_as_much_as_nets_must() {
    const PIXELS: u32 = 4096;
    // The mean of n squares of normal numbers has a relative standard error of √(2/n).
    let slack = 5.0 * (2.0 / f64::from(PIXELS)).sqrt();
    let independent = 1.0 / 144.0 / 256.0;
    let measured = mean_squared_error(SamplerKind::Independent, PIXELS);
    assert!((measured / independent - 1.0).abs() < slack, "{measured}, not {independent}");
    let bound = std::f64::consts::E * 25.0 / 4.0 / 4f64.powi(7) * independent;
    let measured = mean_squared_error(SamplerKind::Sobol, PIXELS);
    assert!(measured < bound * (1.0 + slack), "{measured} is above {bound}");
}

/// Exponent a of the root mean squared error ~ nᵃ of the estimate of ∫ exp(x + y) = (e − 1)² with n
/// points, by least squares of logarithms for n = 2⁴, 2⁵, … 2¹⁴; the mean is over pixels.
fn slope(kind: SamplerKind) -> f64 {
    const PIXELS: u32 = 64;
    let exact = (std::f64::consts::E - 1.0).powi(2);
    let f = |[x, y]: [f32; 2]| (f64::from(x) + f64::from(y)).exp();
    let error = |k: u32| {
        let set = SamplerConfig { spp: 1 << k, ..set(kind, 1) };
        let estimate = |pixel| {
            let values = (0..set.spp).map(|s| f(point_of(set, [pixel, 300], s, 6)));
            values.sum::<f64>() / f64::from(set.spp)
        };
        let squares: f64 = (0..PIXELS).map(|p| (estimate(p) - exact).powi(2)).sum();
        0.5 * (squares / f64::from(PIXELS)).log2()
    };
    let (mut numerator, mut denominator) = (0.0, 0.0);
    for k in 4..=14 {
        let from_middle = f64::from(k) - 9.0;
        numerator += from_middle * error(k);
        denominator += from_middle * from_middle;
    }
    numerator / denominator
}

/// Convergence for a smooth function: n^−½ for independent points. One jittered point in each cell
/// of a grid has the exponent −1 in two dimensions, scrambled nets −3/2 up to logarithms. [Owen
/// 1997]
#[test]
fn errors_fall_as_they_must() {
    let [sobol, zsobol, stratified, independent] = KINDS.map(slope);
    assert!(sobol < -1.3, "Sobol': {sobol}");
    assert!(zsobol < -1.3, "Sobol' in Z-order: {zsobol}");
    assert!(stratified < -0.9, "stratified: {stratified}");
    assert!((independent + 0.5).abs() < 0.1, "independent: {independent}");
}

/// Points of two different dimensions fill the square uniformly.
#[test]
fn any_two_dimensions_are_independent() {
    let near = [(0, 1), (0, 2), (0, 3), (1, 2), (2, 4), (3, 7), (5, 6), (0, 40), (41, 44)];
    // Hashes mix high bits less than low ones.
    let far = (12..32).map(|bit| [(0, 1 << bit), (7, 7 | 1 << bit), (4, 5 | 1 << bit)]);
    let pairs: Vec<(u32, u32)> = near.into_iter().chain(far.flatten()).collect();
    for kind in KINDS {
        for &(a, b) in &pairs {
            let next = Cell::new(0);
            let draw = |_| {
                let i = next.replace(next.get() + 1);
                let sampler = Sampler::new(set(kind, 2), [i / 256 % 32, i / 8192], i % 256);
                let number = |d: u32| sampler.at_dimension(d & !1).next_2d()[(d & 1) as usize];
                Some([number(a), number(b)])
            };
            let title = format!("{kind:?} dimensions {a} and {b} together");
            chi2_square(draw, |_| 1.0, &Chi2::new(&title).one_of(36)).unwrap();
        }
    }
}

#[test]
fn names_and_kinds_belong_together() {
    assert_eq!(SamplerKind::NAMES.map(|(_, kind)| kind), KINDS);
    for (name, kind) in SamplerKind::NAMES {
        assert_eq!((SamplerKind::from_name(name), kind.name()), (Some(kind), name));
    }
    assert_eq!(SamplerKind::from_name("halton"), None);
}

/// Pairs of consecutive numbers of a stream, numbers at one position of many streams, and numbers
/// at one position of one stream of many samples are uniform in the square.
#[test]
fn streams_are_uniform_along_and_across() {
    let sampler = |kind, sample| Sampler::new(set(kind, 1), [sample % 61, 5], sample / 61);
    let of_place = |kind, sample: u32, number: [u32; 2], place: u32| {
        let mut stream = sampler(kind, sample).stream(number);
        for _ in 0..place {
            stream.next_1d();
        }
        stream.next_2d()
    };
    for kind in KINDS {
        let along = Cell::new(sampler(kind, 0).stream([0, 3]));
        let next = |_| {
            let mut stream = along.get();
            let point = stream.next_2d();
            along.set(stream);
            point
        };
        let count = Cell::new(0);
        let counted = || {
            count.set(count.get() + 1);
            count.get() - 1
        };
        let check = |name: &str, point: &dyn Fn([f32; 2]) -> [f32; 2]| {
            let name = format!("{kind:?} {name}");
            let config = Chi2 { bins: [32, 32], ..Chi2::new(&name) }.one_of(4 * KINDS.len());
            chi2_square(|u| Some(point(u)), |_| 1.0, &config).unwrap();
        };
        check("along a stream", &next);
        check("streams of many bounces", &|_| of_place(kind, 0, [counted(), 0], 2));
        check("many streams of a bounce", &|_| of_place(kind, 0, [7, counted()], 1));
        check("streams of many samples", &|_| of_place(kind, counted(), [1, 0], 0));
    }
}

/// A stream is reproducible, and differs from those of other numbers, samples and pixels.
#[test]
fn streams_depend_on_their_number_and_sample_alone() {
    for kind in KINDS {
        let first = |pixel, sample, number| {
            let mut stream = Sampler::new(set(kind, 0), pixel, sample).stream(number);
            [stream.next_2d(), stream.next_2d()]
        };
        let one = first([1, 2], 3, [4, 5]);
        assert_eq!(one, first([1, 2], 3, [4, 5]));
        let other = [
            first([2, 2], 3, [4, 5]),
            first([1, 2], 4, [4, 5]),
            first([1, 2], 3, [5, 5]),
            first([1, 2], 3, [4, 6]),
        ];
        assert!(other.iter().all(|o| *o != one), "{kind:?}");
        let mut sampler = Sampler::new(set(kind, 0), [1, 2], 3).at_dimension(9);
        sampler.next_2d();
        let mut stream = sampler.stream([4, 5]);
        assert_eq!(stream.next_2d(), one[0], "the dimension does not matter");
    }
}
