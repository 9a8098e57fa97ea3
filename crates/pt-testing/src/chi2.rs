//! χ² tests of sampling routines against their stated densities.
//!
//! Random points are mapped by the routine and counted in a histogram, and the density is
//! integrated over each bin. Pearson's statistic Σ (observed − expected)² / expected then follows
//! the χ² distribution, with one degree of freedom less than there are bins. [Pearson 1900; the
//! method of Wenzel Jakob's tests in Nori and Mitsuba]

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::fmt::Write as _;
use std::path::PathBuf;

use pt_math::{Frame, Vec3, warp};
use statrs::distribution::{ChiSquared, ContinuousCDF};
use statrs::function::erf::erfc;

use crate::integrate::{Rectangle, integrate};
use crate::{Random, output, sidak};

/// Configuration of a test.
#[derive(Clone, Copy, Debug)]
pub struct Chi2<'a> {
    /// Name of the test, and of the file for the histogram of a failure.
    pub name: &'a str,
    /// Number of samples.
    pub samples: u32,
    /// Number of bins in cos θ and φ, or x and y.
    pub bins: [usize; 2],
    /// Fraction of seeds with which a correct routine fails.
    pub significance: f64,
    /// Number of tests among which `significance` is divided.
    pub tests: usize,
    /// Seed of the random points.
    pub seed: u64,
}

impl<'a> Chi2<'a> {
    /// 200 000 samples in 32 × 64 bins at a level of 10⁻⁴.
    pub fn new(name: &'a str) -> Self {
        Self { name, samples: 200_000, bins: [32, 64], significance: 1e-4, tests: 1, seed: 0 }
    }

    /// The same test as one of `tests` tests with a common significance level.
    pub fn one_of(self, tests: usize) -> Self {
        Self { tests, ..self }
    }
}

/// Failure of a routine to follow its density.
#[derive(Debug)]
pub struct Chi2Failure {
    /// Name of the test.
    pub name: String,
    /// Reason for the failure.
    pub reason: Reason,
    /// Path of the histogram, if it could be written.
    pub histogram: Option<PathBuf>,
}

/// Reason for the failure of a test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// A sample is outside of the domain.
    Outside {
        /// Random point of the sample.
        u: [f32; 2],
    },
    /// The density of a sample is not a positive finite number.
    Impossible {
        /// Random point of the sample.
        u: [f32; 2],
        /// Density of the sample.
        pdf: f64,
    },
    /// The integral of the density exceeds 1, or is NaN.
    Mass {
        /// Integral of the density.
        integral: f64,
    },
    /// The fraction of valid samples differs from the integral of the density.
    Taken {
        /// Fraction of valid samples.
        observed: f64,
        /// Integral of the density.
        expected: f64,
        /// Probability of a difference at least this large.
        p: f64,
        /// Probability below which the test fails.
        level: f64,
    },
    /// The histogram differs from the expected one.
    Distribution {
        /// Pearson's statistic.
        statistic: f64,
        /// Degrees of freedom.
        degrees: usize,
        /// Probability of a statistic at least this large.
        p: f64,
        /// Probability below which the test fails.
        level: f64,
    },
}

impl fmt::Display for Chi2Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: ", self.name)?;
        match self.reason {
            Reason::Outside { u } => write!(f, "the sample of {u:?} is outside of the domain"),
            Reason::Impossible { u, pdf } => write!(f, "the sample of {u:?} has density {pdf}"),
            Reason::Mass { integral } => write!(f, "the density integrates to {integral}"),
            Reason::Taken { observed, expected, p, level } => write!(
                f,
                "a share of {observed} is taken, but {expected} is stated, p = {p:.2e} < {level:.2e}"
            ),
            Reason::Distribution { statistic, degrees, p, level } => write!(
                f,
                "χ² = {statistic:.1} with {degrees} degrees of freedom, p = {p:.2e} < {level:.2e}"
            ),
        }?;
        match &self.histogram {
            Some(path) => write!(f, "; see {}", path.display()),
            None => Ok(()),
        }
    }
}

impl std::error::Error for Chi2Failure {}

/// Tests a routine that maps random points to unit vectors, or to `None` for an invalid sample.
/// `pdf` is its density per steradian; 1 minus its integral is the probability of `None`.
///
/// # Errors
/// If the routine does not follow its density; see [`Reason`].
pub fn chi2_sphere(
    sample: impl Fn([f32; 2]) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
    config: &Chi2<'_>,
) -> Result<(), Chi2Failure> {
    const MAX_LENGTH_ERROR: f64 = 1e-4;
    let place = |u: [f32; 2]| {
        let Some(w) = sample(u) else { return Ok(None) };
        let v = w.as_dvec3();
        let error = (v.length_squared() - 1.0).abs();
        if error.is_nan() || error > MAX_LENGTH_ERROR {
            return Err(Reason::Outside { u });
        }
        let turns = v.y.atan2(v.x) / TAU;
        let turns = if turns < 0.0 { turns + 1.0 } else { turns };
        Ok(Some(([0.5 * v.z + 0.5, turns], f64::from(pdf(w)))))
    };
    let density = |x: f64, y: f64| {
        let z = 2.0 * x - 1.0;
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (sin, cos) = (TAU * y).sin_cos();
        4.0 * PI * f64::from(pdf(Vec3::new((r * cos) as f32, (r * sin) as f32, z as f32)))
    };
    test(place, density, config)
}

/// Variant of [`chi2_sphere`] for densities too narrow for its bins: the bins cover only directions
/// ω of the cone with 1 − ω·`axis` ≤ `one_minus_cos`, and others count as invalid samples. `axis`
/// has unit length.
///
/// # Errors
/// If the routine does not follow its density; see [`Reason`].
pub fn chi2_cone(
    sample: impl Fn([f32; 2]) -> Option<Vec3>,
    pdf: impl Fn(Vec3) -> f32,
    axis: Vec3,
    one_minus_cos: f32,
    config: &Chi2<'_>,
) -> Result<(), Chi2Failure> {
    let frame = Frame::from_normal(axis);
    let place = |u: [f32; 2]| {
        let local = frame.to_local(sample(u)?);
        let p = warp::uniform_cone_invert(local, one_minus_cos);
        let inside = local.z > 0.0 || one_minus_cos > 1.0;
        (inside && p.iter().all(|x| (0.0..1.0).contains(x))).then_some(p)
    };
    // Solid angle of the cone: the reciprocal of the density of its uniform distribution.
    let solid_angle = 1.0 / warp::uniform_cone_pdf(one_minus_cos).get();
    let density = |p| pdf(frame.to_world(warp::uniform_cone(p, one_minus_cos))) * solid_angle;
    chi2_square(place, density, config)
}

/// Tests a routine that maps random points to points of [0, 1)², or to `None` for an invalid
/// sample. `pdf` is its density; 1 minus its integral is the probability of `None`.
///
/// # Errors
/// If the routine does not follow its density; see [`Reason`].
pub fn chi2_square(
    sample: impl Fn([f32; 2]) -> Option<[f32; 2]>,
    pdf: impl Fn([f32; 2]) -> f32,
    config: &Chi2<'_>,
) -> Result<(), Chi2Failure> {
    let place = |u: [f32; 2]| match sample(u) {
        None => Ok(None),
        Some(p) if p.iter().all(|x| (0.0..1.0).contains(x)) => {
            Ok(Some((p.map(f64::from), f64::from(pdf(p)))))
        }
        Some(_) => Err(Reason::Outside { u }),
    };
    test(place, |x, y| f64::from(pdf([x as f32, y as f32])), config)
}

/// Position of a sample in the unit square and its density, or `None` for an invalid sample.
type SquareSample = Result<Option<([f64; 2], f64)>, Reason>;

/// Observed and expected histogram of a routine.
struct Histogram {
    bins: [usize; 2],
    /// Number of samples per bin; the last entry is that of invalid samples.
    observed: Vec<u32>,
    /// Expected number of samples per bin; the last entry is that of invalid samples.
    expected: Vec<f64>,
}

/// Runs both tests on the unit square.
fn test(
    place: impl Fn([f32; 2]) -> SquareSample,
    density: impl Fn(f64, f64) -> f64,
    config: &Chi2<'_>,
) -> Result<(), Chi2Failure> {
    let failure =
        |reason, histogram| Chi2Failure { name: config.name.to_owned(), reason, histogram };
    let observed = observe(place, config).map_err(|reason| failure(reason, None))?;
    let expected = expect(&density, config, QUICK);
    let mut histogram = Histogram { bins: config.bins, observed, expected };
    if judge(&histogram, config).is_ok() {
        return Ok(());
    }
    histogram.expected = expect(&density, config, PRECISE);
    judge(&histogram, config).map_err(|reason| {
        let file = format!("chi2-{}.csv", config.name.replace(|c: char| !c.is_alphanumeric(), "-"));
        failure(reason, output::write(&file, histogram.table().as_bytes()).ok())
    })
}

/// Counts samples per bin.
fn observe(
    place: impl Fn([f32; 2]) -> SquareSample,
    config: &Chi2<'_>,
) -> Result<Vec<u32>, Reason> {
    let [nx, ny] = config.bins;
    let mut counts = vec![0; nx * ny + 1];
    let mut random = Random::new(config.seed);
    for _ in 0..config.samples {
        let u = random.unit_2d();
        let bin = match place(u)? {
            None => nx * ny,
            Some((_, pdf)) if !(pdf > 0.0 && pdf.is_finite()) => {
                return Err(Reason::Impossible { u, pdf });
            }
            Some(([x, y], _)) => {
                let cell = |t: f64, n: usize| ((t * n as f64) as usize).min(n - 1);
                cell(x, nx) * ny + cell(y, ny)
            }
        };
        counts[bin] += 1;
    }
    Ok(counts)
}

/// Precision of the integrals of the density over bins.
#[derive(Clone, Copy)]
struct Quadrature {
    /// Minimum depth of subdivision of a bin, so that a narrow peak is not overlooked.
    min_depth: u32,
    /// Error of a bin in samples.
    tolerance: f64,
}

/// Precision of the first attempt. Its errors, of half a sample in bins with a noise of two or
/// more, make a correct routine fail more often, which is then judged anew by [`PRECISE`]. A wrong
/// one passes only if it deviates as the quadrature does.
const QUICK: Quadrature = Quadrature { min_depth: 1, tolerance: 0.5 };
/// Precision of the second attempt, far below the noise.
const PRECISE: Quadrature = Quadrature { min_depth: 2, tolerance: 0.05 };

/// Integrates the density over the bins.
fn expect(
    density: &impl Fn(f64, f64) -> f64,
    config: &Chi2<'_>,
    quadrature: Quadrature,
) -> Vec<f64> {
    let Quadrature { min_depth, tolerance } = quadrature;
    let [nx, ny] = config.bins;
    let samples = f64::from(config.samples);
    let side = |i: usize, n: usize| [i as f64 / n as f64, (i + 1) as f64 / n as f64];
    let mut expected = Vec::with_capacity(nx * ny + 1);
    for i in 0..nx {
        for j in 0..ny {
            let bin = Rectangle { x: side(i, nx), y: side(j, ny) };
            expected.push(samples * integrate(density, bin, tolerance / samples, min_depth));
        }
    }
    let total: f64 = expected.iter().sum();
    expected.push(samples - total);
    expected
}

/// Tests the fraction of valid samples, and their distribution.
fn judge(histogram: &Histogram, config: &Chi2<'_>) -> Result<(), Reason> {
    let level = sidak(config.significance, 2 * config.tests);
    judge_taken(histogram, config, level)?;
    judge_places(histogram, level)
}

/// Compares the number of valid samples with the integral of the density. This is a separate test,
/// since among a thousand bins only a large error of one is significant.
fn judge_taken(histogram: &Histogram, config: &Chi2<'_>, level: f64) -> Result<(), Reason> {
    const MASS_TOLERANCE: f64 = 1e-3;
    // Relative error of the integral due to rounding and quadrature.
    const MASS_ERROR: f64 = 1e-4;
    let samples = f64::from(config.samples);
    let (Some(observed), Some(expected)) = (histogram.observed.last(), histogram.expected.last())
    else {
        return Ok(());
    };
    let (observed, expected) = (1.0 - f64::from(*observed) / samples, 1.0 - expected / samples);
    if expected.is_nan() || expected > 1.0 + MASS_TOLERANCE {
        return Err(Reason::Mass { integral: expected });
    }
    let variance = (expected * (1.0 - expected)).max(0.0) / samples + MASS_ERROR * MASS_ERROR;
    let p = erfc((observed - expected).abs() / (2.0 * variance).sqrt());
    if p < level { Err(Reason::Taken { observed, expected, p, level }) } else { Ok(()) }
}

/// Pearson's test. Bins with few expected samples are merged in ascending order, since the
/// statistic of a bin follows its distribution only from about five expected samples on.
fn judge_places(histogram: &Histogram, level: f64) -> Result<(), Reason> {
    const MIN_EXPECTED: f64 = 5.0;
    let counts = histogram.expected.iter().zip(&histogram.observed);
    let mut bins: Vec<(f64, f64)> = counts.map(|(&e, &o)| (e.max(0.0), f64::from(o))).collect();
    bins.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut pooled: Vec<(f64, f64)> = Vec::new();
    for (expected, observed) in bins {
        match pooled.last_mut() {
            Some(last) if last.0 < MIN_EXPECTED => {
                last.0 += expected;
                last.1 += observed;
            }
            _ => pooled.push((expected, observed)),
        }
    }
    let degrees = pooled.len() - 1;
    let statistic: f64 = pooled.iter().map(|(e, o)| (o - e) * (o - e) / e).sum();
    // A single bin has no degree of freedom, and no distribution.
    let p = ChiSquared::new(degrees as f64).map_or(1.0, |d| d.sf(statistic));
    if p < level { Err(Reason::Distribution { statistic, degrees, p, level }) } else { Ok(()) }
}

impl Histogram {
    /// Readable table: bin, observed, expected, signed contribution to the statistic.
    fn table(&self) -> String {
        let mut text = String::from("x bin,y bin,observed,expected,signed contribution\n");
        let ny = self.bins[1];
        for (i, (o, e)) in self.observed.iter().zip(&self.expected).enumerate() {
            let difference = f64::from(*o) - e;
            let signed = difference.abs() * difference / e.max(1e-9);
            let bin = if i + 1 == self.observed.len() {
                "not taken,".to_owned()
            } else {
                format!("{},{}", i / ny, i % ny)
            };
            // Writing to a string cannot fail.
            let _ = writeln!(text, "{bin},{o},{e:.3},{signed:.3}");
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_1_PI;

    use super::*;

    fn on_sphere(u: [f32; 2], z: f32) -> Vec3 {
        let r = (1.0 - z * z).max(0.0).sqrt();
        let (s, c) = (std::f32::consts::TAU * u[1]).sin_cos();
        Vec3::new(r * c, r * s, z)
    }

    fn cosine(u: [f32; 2]) -> Vec3 {
        on_sphere(u, (1.0 - u[0]).sqrt())
    }

    fn cosine_pdf(w: Vec3) -> f32 {
        w.z.max(0.0) * FRAC_1_PI
    }

    #[test]
    fn right_routines_pass() {
        chi2_sphere(|u| Some(cosine(u)), cosine_pdf, &Chi2::new("cosine")).unwrap();
        let sphere = |u: [f32; 2]| Some(on_sphere(u, 1.0 - 2.0 * u[0]));
        chi2_sphere(sphere, |_| 0.25 * FRAC_1_PI, &Chi2::new("sphere")).unwrap();
        // x = √u has density 2x.
        let linear = |u: [f32; 2]| Some([u[0].sqrt(), u[1]]);
        chi2_square(linear, |p| 2.0 * p[0], &Chi2::new("linear")).unwrap();
        // Edges that do not coincide with bounds of bins.
        let part = |u: [f32; 2]| Some([0.37 * u[0], 0.1 + 0.45 * u[1]]);
        let inside = |p: [f32; 2]| p[0] < 0.37 && (0.1..0.55).contains(&p[1]);
        let pdf = |p| if inside(p) { 1.0 / (0.37 * 0.45) } else { 0.0 };
        chi2_square(part, pdf, &Chi2::new("part")).unwrap();
    }

    #[test]
    fn cones_zoom_in() {
        let axis = Vec3::new(0.48, -0.6, 0.64);
        let frame = Frame::from_normal(axis);
        // Uniform in a cone of a tenth of a degree, tested in a cone of half the solid angle.
        let c = 1.5e-6;
        let sample = |u| Some(frame.to_world(warp::uniform_cone(u, c)));
        let pdf = |scale: f32| move |_: Vec3| scale * warp::uniform_cone_pdf(c).get();
        let config = Chi2::new("narrow cone");
        chi2_cone(sample, pdf(1.0), axis, 0.5 * c, &config).unwrap();
        assert!(chi2_cone(sample, pdf(0.98), axis, 0.5 * c, &config).is_err());
    }

    #[test]
    fn samples_not_taken_count() {
        let some = |share: f32| move |u: [f32; 2]| (u[0] < share).then_some([u[0] / share, u[1]]);
        chi2_square(some(0.75), |_| 0.75, &Chi2::new("three quarters")).unwrap();
        let wrong = chi2_square(some(0.74), |_| 0.75, &Chi2::new("fewer than stated"));
        assert!(matches!(wrong.unwrap_err().reason, Reason::Taken { .. }));
    }

    #[test]
    fn wrong_routines_fail() {
        let uniform = |w: Vec3| if w.z < 0.0 { 0.0 } else { 0.5 * FRAC_1_PI };
        let failure = chi2_sphere(|u| Some(cosine(u)), uniform, &Chi2::new("cosine for uniform"))
            .unwrap_err();
        assert!(matches!(failure.reason, Reason::Distribution { .. }), "{failure}");
        let table = std::fs::read_to_string(failure.histogram.expect("a histogram")).unwrap();
        assert_eq!(table.lines().count(), 32 * 64 + 2);
        // One percent of the samples is moved to one side.
        let tilted = |u: [f32; 2]| Some([u[0], if u[1] < 0.01 { 0.25 } else { u[1] }]);
        let failure = chi2_square(tilted, |_| 1.0, &Chi2::new("tilted")).unwrap_err();
        assert!(matches!(failure.reason, Reason::Distribution { .. }), "{failure}");
    }

    #[test]
    fn wrong_densities_fail() {
        let reason = |pdf: fn(Vec3) -> f32| {
            chi2_sphere(|u| Some(cosine(u)), pdf, &Chi2::new("wrong density")).unwrap_err().reason
        };
        assert!(matches!(reason(|w| w.z.max(0.0) * 0.35), Reason::Mass { .. }));
        assert!(matches!(reason(|w| w.z.max(0.0) * 0.30), Reason::Taken { .. }));
        assert!(matches!(reason(|w| if w.x > 0.0 { w.z } else { 0.0 }), Reason::Impossible { .. }));
        assert!(matches!(reason(|_| f32::NAN), Reason::Impossible { .. }));
        let long = |u: [f32; 2]| Some(1.01 * cosine(u));
        let failure = chi2_sphere(long, cosine_pdf, &Chi2::new("not unit")).unwrap_err();
        assert!(matches!(failure.reason, Reason::Outside { .. }));
    }

    #[test]
    fn right_routines_fail_as_often_as_the_level_says() {
        let half = |u: [f32; 2]| (u[0] < 0.5).then_some([2.0 * u[0], u[1]]);
        let small = Chi2 { samples: 2000, bins: [4, 8], significance: 0.1, ..Chi2::new("rate") };
        let fails = |seed| chi2_square(half, |_| 0.5, &Chi2 { seed, ..small }).is_err();
        let failures = (0..1000).filter(|&seed| fails(seed)).count() as f64;
        // Binomial with n = 1000 and p = 0.1: five standard deviations of √90.
        assert!((failures - 100.0).abs() < 5.0 * 90f64.sqrt(), "{failures}");
    }
}
