//! Reconstruction filters by importance sampling. [Ernst, Stamminger & Greiner 2006, "Filter
//! Importance Sampling"; Pharr, Jakob & Humphreys, Physically Based Rendering, 4th ed., §8.8]
//!
//! A pixel with centre c has the value I = ∫ f(x) L(c + x) dx / ∫ f(x) dx. Its samples are drawn
//! around c with the density p(x) = |f(x)| / ∫|f| and have the weight w(x) = sign f(x) · ∫|f| / ∫f,
//! so that E[w(x) L(c + x)] = I. No sample contributes to another pixel: the samples of a pixel are
//! independent of those of its neighbours, and their plain mean is unbiased. Samples of filters
//! without negative values have weight 1.
//!
//! f(x, y) = g(x) g(y): each coordinate is sampled separately, and the weights are multiplied.

use std::f64::consts::PI;

use pt_math::sampler::Lanes;
use pt_scene::Filter;

/// Error for invalid parameters of a filter.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct FilterError(String);

/// Samples positions around the centre of a pixel by a filter.
///
/// g is a table of values at 0 = x₀ < x₁ < … = r, between which it is linear. Zeros where it
/// changes its sign are among the xᵢ.
#[derive(Clone, Debug)]
pub struct FilterSampler {
    /// ∫|g| from 0 to xᵢ, divided by the whole integral.
    cumulative: Vec<f32>,
    /// Intervals from xᵢ to xᵢ₊₁.
    cells: Vec<FilterCell>,
    /// ∫|g| / ∫g, which is at least 1.
    gain: f32,
}

#[derive(Clone, Copy, Debug)]
struct FilterCell {
    /// Start and width, in pixels.
    start: f32,
    width: f32,
    /// Density of |x| at its ends, times its width.
    left: f32,
    right: f32,
    /// Weight of samples in the cell: the gain, with the sign of g.
    weight: f32,
}

/// Number of cells of a table, without those added at sign changes.
const CELLS: u32 = 1024;
/// Expected number of weights of the rarer sign from which on the mean is about normally
/// distributed.
const MIN_EXPECTED: f32 = 10.0;

impl FilterSampler {
    /// Creates the sampler of a filter, or `None` for the box filter: its samples are uniform in
    /// the pixel.
    ///
    /// # Errors
    /// If the parameters of the filter are invalid.
    pub fn new(filter: &Filter) -> Result<Option<Self>, FilterError> {
        filter.check().map_err(FilterError)?;
        if *filter == Filter::Box {
            return Ok(None);
        }
        let knots = knots(filter);
        let areas: Vec<f64> =
            knots.windows(2).map(|k| 0.5 * (k[0].1 + k[1].1) * (k[1].0 - k[0].0)).collect();
        let signed: f64 = areas.iter().sum();
        let absolute: f64 = areas.iter().map(|area| area.abs()).sum();
        let gain = absolute / signed;
        let mut sum = 0.0;
        let shares = areas.iter().map(|area| {
            sum += area.abs();
            (sum / absolute) as f32
        });
        let cumulative = std::iter::once(0.0).chain(shares).collect();
        let cell = |(k, area): (&[(f64, f64)], &f64)| {
            let width = k[1].0 - k[0].0;
            let density = |g: f64| (g.abs() / absolute * width) as f32;
            let weight = if *area < 0.0 { -gain } else { gain } as f32;
            let (left, right) = (density(k[0].1), density(k[1].1));
            FilterCell { start: k[0].0 as f32, width: width as f32, left, right, weight }
        };
        let cells = knots.windows(2).zip(&areas).map(cell).collect();
        Ok(Some(Self { cumulative, cells, gain: gain as f32 }))
    }

    /// Maps a point of [0, 1)² to a position relative to the centre of a pixel, in pixels, and
    /// returns the position with its weight.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let [(x, wx), (y, wy)] = u.map(|u| self.coordinate(u));
        ([x, y], wx * wy)
    }

    /// Replaces points of [0, 1)² by positions relative to the upper left corners of their pixels,
    /// and returns their weights.
    pub fn place(&self, [xs, ys]: &mut [Lanes<f32>; 2]) -> Lanes<f32> {
        std::array::from_fn(|i| {
            let ([x, y], weight) = self.sample([xs[i], ys[i]]);
            (xs[i], ys[i]) = (0.5 + x, 0.5 + y);
            weight
        })
    }

    /// Returns true if all weights are 1.
    pub fn is_positive(&self) -> bool {
        self.gain == 1.0
    }

    /// Returns the number of samples below which their variance is unreliable, since all weights
    /// may have the same sign; 0 if all weights are positive.
    pub fn least_samples(&self) -> u32 {
        if self.is_positive() {
            return 0;
        }
        let one = 0.5 - 0.5 / self.gain;
        let product = 2.0 * one * (1.0 - one);
        (MIN_EXPECTED / product).ceil() as u32
    }

    /// Samples one coordinate by inversion: its magnitude by the cumulative table, with both signs
    /// equally likely. Returns the coordinate and its weight.
    #[inline]
    fn coordinate(&self, u: f32) -> (f32, f32) {
        let v = 2.0 * u - 1.0;
        let share = v.abs();
        // The last entry that is not above `share`. The next one is, so the cell is not empty.
        let i = self.cumulative.partition_point(|&c| c <= share).clamp(1, self.cells.len()) - 1;
        let FilterCell { start, width, left, right, weight } = self.cells[i];
        // Solve left t + (right − left) t²/2 = rest for t.
        let rest = share - self.cumulative[i];
        let root = (left * left + 2.0 * (right - left) * rest).max(0.0).sqrt();
        let t = 2.0 * rest / (left + root).max(f32::MIN_POSITIVE);
        ((start + width * t.min(1.0)).copysign(v), weight)
    }
}

/// Returns the table of g: positions from 0 to the radius with their values.
fn knots(filter: &Filter) -> Vec<(f64, f64)> {
    const MAX_STDDEVS: f64 = 8.0; // beyond, a Gaussian is below 10⁻¹³
    let radius = match *filter {
        Filter::Gaussian { stddev, radius } => radius.min(MAX_STDDEVS * stddev),
        _ => filter.radius(),
    };
    let at = |x: f64| (x, eval(filter, x));
    let mut knots = vec![at(0.0)];
    for i in 1..=CELLS {
        let next = at(radius * f64::from(i) / f64::from(CELLS));
        let (x, g) = knots[knots.len() - 1];
        if g * next.1 < 0.0 {
            knots.push((zero_between(filter, x, next.0), 0.0));
        }
        knots.push(next);
    }
    knots
}

/// Returns the position at which g changes its sign between two positions, by bisection.
fn zero_between(filter: &Filter, mut low: f64, mut high: f64) -> f64 {
    let is_negative = eval(filter, low) < 0.0;
    for _ in 0..f64::MANTISSA_DIGITS {
        let middle = 0.5 * (low + high);
        let half = if (eval(filter, middle) < 0.0) == is_negative { &mut low } else { &mut high };
        *half = middle;
    }
    low
}

/// Returns g at a distance from 0 to the radius, in pixels; not normalised.
fn eval(filter: &Filter, x: f64) -> f64 {
    match *filter {
        Filter::Box => 1.0,
        Filter::Tent { radius } => 1.0 - x / radius,
        Filter::Gaussian { stddev, radius } => {
            let bell = |x: f64| libm::exp(-0.5 * (x / stddev) * (x / stddev));
            bell(x) - bell(radius)
        }
        Filter::Mitchell { b, c } => cubic(b, c, x),
        Filter::BlackmanHarris { radius } => {
            let term = |n: f64| libm::cos(n * PI * x / radius);
            0.358_75 + 0.488_29 * term(1.0) + 0.141_28 * term(2.0) + 0.011_68 * term(3.0)
        }
        Filter::Lanczos { lobes } => sinc(x) * sinc(x / lobes),
    }
}

/// Evaluates the cubic filter of Mitchell & Netravali.
fn cubic(b: f64, c: f64, x: f64) -> f64 {
    let [k3, k2, k1, k0] = if x < 1.0 {
        [12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b]
    } else {
        [-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c]
    };
    (((k3 * x + k2) * x + k1) * x + k0) / 6.0
}

/// sin(πx)/(πx).
fn sinc(x: f64) -> f64 {
    const NEAR_0: f64 = 1e-5; // 1 − (πx)²/6 is then 1 to ten digits
    if x < NEAR_0 { 1.0 } else { libm::sin(PI * x) / (PI * x) }
}

#[cfg(test)]
mod tests {
    use pt_testing::{Chi2, Random, chi2_square, mean_z_test};

    use super::*;

    const FILTERS: [(&str, Filter); 11] = [
        ("tent", Filter::TENT),
        ("narrow tent", Filter::Tent { radius: 0.25 }),
        ("Gaussian", Filter::GAUSSIAN),
        ("cut Gaussian", Filter::Gaussian { stddev: 0.7, radius: 1.2 }),
        ("narrow Gaussian", Filter::Gaussian { stddev: 0.05, radius: 16.0 }),
        ("Mitchell", Filter::MITCHELL),
        ("sharp Mitchell", Filter::Mitchell { b: 0.0, c: 1.0 }),
        ("B-spline", Filter::Mitchell { b: 1.0, c: 0.0 }),
        ("Blackman-Harris", Filter::BLACKMAN_HARRIS),
        ("Catmull-Rom", Filter::CATMULL_ROM),
        ("Lanczos", Filter::LANCZOS),
    ];

    fn sampler(filter: &Filter) -> FilterSampler {
        FilterSampler::new(filter).expect("it makes sense").expect("no box")
    }

    /// ∫ g(x) h(x) dx over both sides, by the midpoint rule.
    fn integral(filter: &Filter, h: impl Fn(f64) -> f64) -> f64 {
        const STEPS: u32 = 400_000;
        let step = filter.radius() / f64::from(STEPS);
        let both = |x: f64| eval(filter, x) * (h(x) + h(-x));
        (0..STEPS).map(|i| both((f64::from(i) + 0.5) * step)).sum::<f64>() * step
    }

    #[test]
    fn positions_follow_the_filter() {
        for (name, filter) in FILTERS {
            let sampler = sampler(&filter);
            let radius = filter.radius() as f32;
            let norm = integral(&filter, |x| eval(&filter, x.abs()).signum()) as f32;
            let density = |x: f32| {
                let x = f64::from((2.0 * x - 1.0).abs() * radius);
                eval(&filter, x).abs() as f32 * 2.0 * radius / norm
            };
            let square = |u| {
                let p =
                    sampler.sample(u).0.map(|x| (0.5 + 0.5 * x / radius).min(1.0f32.next_down()));
                Some(p)
            };
            let config = Chi2::new(name).one_of(FILTERS.len());
            chi2_square(square, |p| density(p[0]) * density(p[1]), &config)
                .unwrap_or_else(|e| panic!("{e}"));
        }
    }

    /// The weights have the sign of the filter, and a magnitude for which the mean is 1.
    #[test]
    fn weights_have_the_filters_sign_and_the_mean_1() {
        const N: u32 = 1 << 16;
        for (name, filter) in FILTERS {
            let sampler = sampler(&filter);
            let gain =
                integral(&filter, |x| eval(&filter, x.abs()).signum()) / integral(&filter, |_| 1.0);
            assert!((f64::from(sampler.gain) - gain).abs() < 1e-4, "{name}: {gain}");
            let mut random = Random::new(5);
            let mut sum = 0.0;
            for i in 0..N {
                // One coordinate stratified, the other random.
                let u = [(i as f32 + random.unit()) / N as f32, random.unit()];
                let ([x, y], weight) = sampler.sample(u);
                let [gx, gy] = [x, y].map(|x| eval(&filter, f64::from(x.abs())));
                let is_clear = gx.abs() > 1e-4 && gy.abs() > 1e-4;
                assert!(!is_clear || weight.signum() == (gx * gy).signum() as f32, "{name} {u:?}");
                assert_eq!(weight.abs(), sampler.gain * sampler.gain, "{name}");
                sum += f64::from(sampler.coordinate(u[0]).1);
            }
            assert!((sum / f64::from(N) - 1.0).abs() < 1e-3, "{name}: {sum}");
        }
    }

    /// ∫∫ f(x, y) cos(ax + by) dx dy / ∫∫ f is the product of two integrals over the line.
    #[test]
    fn the_mean_of_weighted_values_is_the_filtered_value() {
        let (a, b) = (1.3, -0.7);
        let mut random = Random::new(11);
        for (name, filter) in FILTERS {
            let sampler = sampler(&filter);
            let line = |k: f64| integral(&filter, |x| (k * x).cos()) / integral(&filter, |_| 1.0);
            let values: Vec<f64> = (0..200_000)
                .map(|_| {
                    let ([x, y], w) = sampler.sample(random.unit_2d());
                    f64::from(w) * (a * f64::from(x) + b * f64::from(y)).cos()
                })
                .collect();
            mean_z_test(&values, line(a) * line(b), 1e-5).unwrap_or_else(|e| panic!("{name}: {e}"));
        }
    }

    /// Mitsuba 3.9.1, which approximates the Gaussian by a polynomial.
    #[test]
    fn values_are_those_of_mitsuba() {
        for (filter, x, value) in
            [(Filter::GAUSSIAN, 0.5, 0.606_423), (Filter::gaussian(1.0), 1.9, 0.164_071)]
        {
            assert!((eval(&filter, x) - value).abs() < 1e-3, "{filter:?} at {x}");
        }
        for (filter, x, value) in [
            (Filter::MITCHELL, 0.0, 0.888_889),
            (Filter::MITCHELL, 1.5, -0.034_722),
            (Filter::Mitchell { b: 0.5, c: 0.2 }, 1.25, 0.007_031),
            (Filter::CATMULL_ROM, 0.75, 0.226_562),
            (Filter::LANCZOS, 1.25, -0.132_871),
            (Filter::Lanczos { lobes: 2.0 }, 1.9, -0.002_714),
            (Filter::Tent { radius: 2.0 }, 0.5, 0.75),
        ] {
            assert!((eval(&filter, x) - value).abs() < 1e-6, "{filter:?} at {x}");
        }
    }

    /// The coefficients of the window add up to 1, and it is 6·10⁻⁵ at its end.
    #[test]
    fn the_blackman_harris_window_is_that_of_the_paper() {
        let filter = Filter::BlackmanHarris { radius: 2.0 };
        for (x, value) in [(0.0, 1.0), (1.0, 0.358_75 - 0.141_28), (2.0, 6e-5)] {
            assert!((eval(&filter, x) - value).abs() < 1e-12, "{x}");
        }
    }

    #[test]
    fn extreme_numbers_give_finite_points_inside_and_both_sides_alike() {
        for (name, filter) in FILTERS {
            let sampler = sampler(&filter);
            let radius = filter.radius() as f32;
            for u in [0.0, f32::MIN_POSITIVE, 0.25, 0.5f32.next_down(), 0.5, 1.0f32.next_down()] {
                let (x, w) = sampler.coordinate(u);
                assert!(x.abs() <= radius && w.is_finite(), "{name} {u}: {x} {w}");
            }
            for k in 1..100 {
                let v = k as f32 / 256.0;
                assert_eq!(sampler.coordinate(0.5 - v).0, -sampler.coordinate(0.5 + v).0);
            }
        }
    }

    #[test]
    fn filters_with_both_signs_need_samples_until_both_are_seen() {
        for (filter, is_positive) in [
            (Filter::TENT, true),
            (Filter::GAUSSIAN, true),
            (Filter::BLACKMAN_HARRIS, true),
            (Filter::Mitchell { b: 1.0, c: 0.0 }, true),
            (Filter::MITCHELL, false),
            (Filter::LANCZOS, false),
        ] {
            let sampler = sampler(&filter);
            assert_eq!(sampler.is_positive(), is_positive, "{filter:?}");
            let least = sampler.least_samples();
            let mut random = Random::new(2);
            let negative =
                (0..100_000).filter(|_| sampler.sample(random.unit_2d()).1 < 0.0).count();
            assert_eq!(least == 0, is_positive && negative == 0);
            if !is_positive {
                let expected = f64::from(least) * negative as f64 / 1e5;
                assert!((9.0..12.0).contains(&expected), "{filter:?}: {least}, {expected}");
            }
        }
        assert!(FilterSampler::new(&Filter::Box).is_ok_and(|f| f.is_none()));
        let bad = FilterSampler::new(&Filter::Tent { radius: -1.0 });
        assert!(bad.expect_err("no radius").to_string().contains("filter radius of -1"));
    }
}
