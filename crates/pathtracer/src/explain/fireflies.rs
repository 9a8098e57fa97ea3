//! Fireflies: samples that are far brighter than the others of their pixel, and their causes.

use super::{
    Brightest, Contribution, LightSource, Sample, SampledLight, ScatterEvent, Trace, Vertex,
    luminance_of,
};

/// Fireflies of a pixel.
///
/// A sample is a firefly if it is more than [`Fireflies::TIMES`] as bright as the mean of all
/// others, and if its squared deviation is more than [`Fireflies::SHARE`] of the sum of all squared
/// deviations from the mean. Fewer than [`Fireflies::MIN_SAMPLES`] samples contain none.
#[derive(Clone, Debug)]
pub struct Fireflies {
    /// Mean luminance of all other samples.
    pub ordinary: f64,
    /// Fraction of the mean of the pixel due to all fireflies.
    pub share_of_mean: f64,
    /// Fraction of the sum of the squared deviations due to all fireflies.
    pub share_of_variance: f64,
    /// All fireflies, in descending order of luminance.
    pub all: Vec<Firefly>,
}

impl Fireflies {
    /// Minimum luminance of a firefly, relative to the mean of the others.
    pub const TIMES: f64 = 10.0;
    /// Minimum fraction of the sum of the squared deviations.
    pub const SHARE: f64 = 0.05;
    /// Minimum number of samples of a pixel.
    pub const MIN_SAMPLES: usize = 8;
}

/// A sample that is far brighter than others.
#[derive(Clone, Debug)]
pub struct Firefly {
    /// The sample.
    pub sample: Sample,
    /// Luminance of the sample.
    pub luminance: f64,
    /// Fraction of the sum of the squared deviations from the mean.
    pub share_of_variance: f64,
    /// Index of the largest contribution.
    pub contribution: usize,
    /// Fraction of the luminance of the sample due to this contribution.
    pub share_of_sample: f64,
    /// Cause of the brightness of this contribution.
    pub cause: Cause,
}

/// Cause of the brightness of a contribution. `times` is the ratio of the largest outlier among its
/// factors to the mean of this factor over the other contributions to the pixel that were found in
/// the same way: by light samples or by hits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The light itself is visible, directly or in mirrors, in a part of the pixel.
    SeenLight,
    /// The light reaches a surface by specular reflection or transmission, and the surface is not
    /// specular: no light sample finds such light, only paths that happen to scatter towards it.
    Caustic {
        /// Index of the vertex where the light arrives.
        vertex: usize,
    },
    /// The light is not sampled: only paths that happen to scatter towards it find it or, with
    /// hemisphere sampling, only directions that happen to point to it.
    Unsampled,
    /// Throughput up to the last vertex.
    Throughput {
        /// Index of the vertex at which the throughput grew most.
        vertex: usize,
        /// Growth at this vertex: luminance of the weight of the direction over the probability of
        /// Russian roulette.
        weight: f64,
        /// Ratio to the mean of others; see [`Cause`].
        times: f64,
    },
    /// Radiance of the light, or irradiance of a light without extent.
    Radiance {
        /// Ratio to the mean of others; see [`Cause`].
        times: f64,
    },
    /// The small probability with which one of many lights was chosen.
    Choice {
        /// Probability of choosing the light.
        probability: f32,
        /// Ratio to the mean of others; see [`Cause`].
        times: f64,
    },
    /// The small density of the direction towards the light: it is near, or seldom sampled.
    Density {
        /// Ratio to the mean of others; see [`Cause`].
        times: f64,
    },
    /// Scattering towards the light at the last vertex, by a narrow lobe.
    Scattering {
        /// Ratio to the mean of others; see [`Cause`].
        times: f64,
    },
    /// No single factor is an outlier: the product of several is large.
    Several,
}

/// Minimum ratio of an outlier to the mean of the others.
const OUTSTANDING: f64 = 3.0;

/// Maximum number of fireflies: more samples cannot each have a twentieth of the variance.
const MAX: usize = 20;

/// Factors of a contribution: throughput, radiance, choice, density, scattering.
type Factors = [f64; 5];

/// Candidates for fireflies, and mean factors of contributions.
pub(super) struct Suspects {
    brightest: Brightest<(Sample, f64)>,
    /// Number of contributions and sums of their factors, for emission hit by rays and for light
    /// samples.
    usual: [(usize, Factors); 2],
}

impl Suspects {
    pub(super) fn new() -> Self {
        Self { brightest: Brightest::new(MAX), usual: [(0, [0.0; 5]); 2] }
    }

    pub(super) fn see(&mut self, sample: Sample, luminance: f64) {
        for contribution in &sample.trace.contributions {
            let Some(factors) = factors(&sample.trace, contribution) else { continue };
            let (count, sums) = &mut self.usual[usize::from(contribution.source.is_sampled())];
            *count += 1;
            sums.iter_mut().zip(factors).for_each(|(sum, factor)| *sum += factor);
        }
        self.brightest.offer(luminance, || (sample, luminance));
    }

    /// Returns the fireflies; `luminances` are those of all samples.
    pub(super) fn finish(self, luminances: &[f64]) -> Fireflies {
        let Self { brightest, usual } = self;
        let rule = FireflyRule::new(luminances);
        let fireflies = brightest.into_sorted().into_iter();
        let fireflies = fireflies.filter(|&(_, luminance)| rule.is_firefly(luminance));
        let with_share = |(sample, luminance)| Firefly {
            share_of_variance: rule.share_of_variance(luminance),
            ..firefly(sample, luminance, &usual)
        };
        let all: Vec<_> = fireflies.map(with_share).collect();
        let light: f64 = all.iter().map(|firefly| firefly.luminance).sum();
        let others = luminances.len() - all.len();
        Fireflies {
            ordinary: (rule.total - light) / others.max(1) as f64,
            share_of_mean: if rule.total > 0.0 { light / rule.total } else { 0.0 },
            share_of_variance: all.iter().map(|firefly| firefly.share_of_variance).sum(),
            all,
        }
    }
}

/// Definition of a firefly; see [`Fireflies`].
struct FireflyRule {
    count: f64,
    total: f64,
    /// Σ(y − ȳ)²
    squares: f64,
}

impl FireflyRule {
    fn new(luminances: &[f64]) -> Self {
        let (count, total) = (luminances.len() as f64, luminances.iter().sum());
        let mean = total / count.max(1.0);
        Self { count, total, squares: luminances.iter().map(|y| (y - mean) * (y - mean)).sum() }
    }

    fn share_of_variance(&self, luminance: f64) -> f64 {
        let deviation = luminance - self.total / self.count.max(1.0);
        if self.squares > 0.0 { deviation * deviation / self.squares } else { 0.0 }
    }

    fn is_firefly(&self, luminance: f64) -> bool {
        let of_others = (self.total - luminance) / (self.count - 1.0).max(1.0);
        self.count >= Fireflies::MIN_SAMPLES as f64
            && luminance > Fireflies::TIMES * of_others
            && self.share_of_variance(luminance) > Fireflies::SHARE
    }
}

/// Describes a firefly, except for its fraction of the variance.
fn firefly(sample: Sample, luminance: f64, usual: &[(usize, Factors); 2]) -> Firefly {
    let brightness = |contribution: &Contribution| luminance_of(&sample, contribution);
    let contributions = sample.trace.contributions.iter().map(brightness).enumerate();
    let brightest = contributions.max_by(|a, b| a.1.total_cmp(&b.1));
    let (contribution, most) = brightest.unwrap_or((0, 0.0));
    let cause = match sample.trace.contributions.get(contribution) {
        Some(bright) => cause(&sample.trace, bright, usual),
        None => Cause::Several,
    };
    let share_of_sample = most / luminance;
    Firefly { sample, luminance, share_of_variance: 0.0, contribution, share_of_sample, cause }
}

fn cause(trace: &Trace, bright: &Contribution, usual: &[(usize, Factors); 2]) -> Cause {
    let events: Vec<_> = trace.events(bright).collect();
    let rough = events.iter().rposition(|&event| event != ScatterEvent::Specular);
    let ends_in_mirrors = events.last() == Some(&ScatterEvent::Specular);
    match (rough, &bright.source) {
        (None, _) => Cause::SeenLight,
        (
            Some(vertex),
            LightSource::Emitter { .. } | LightSource::Sky { .. } | LightSource::Medium { .. },
        ) if ends_in_mirrors => Cause::Caustic { vertex },
        (
            _,
            LightSource::Emitter { is_sampled: false, .. }
            | LightSource::Medium { .. }
            | LightSource::Hemisphere { .. },
        ) => Cause::Unsampled,
        _ => outstanding(trace, bright, usual),
    }
}

/// Cause from the factor with the largest ratio to the mean of the others.
fn outstanding(trace: &Trace, bright: &Contribution, usual: &[(usize, Factors); 2]) -> Cause {
    let (count, sums) = usual[usize::from(bright.source.is_sampled())];
    let Some(factors) = factors(trace, bright).filter(|_| count > 1) else { return Cause::Several };
    let of_others = |i: usize| (sums[i] - factors[i]) / (count - 1) as f64;
    let times: Factors = std::array::from_fn(|i| factors[i] / of_others(i));
    let most = (0..times.len()).max_by(|&a, &b| times[a].total_cmp(&times[b])).unwrap_or(0);
    let times = times[most];
    // For a light sample, the path does not continue at the last vertex.
    let on_the_way = bright.vertices - usize::from(bright.source.is_sampled());
    match most {
        _ if times <= OUTSTANDING => Cause::Several,
        1 => Cause::Radiance { times },
        2 => Cause::Choice { probability: probability(&bright.source), times },
        3 => Cause::Density { times },
        4 if bright.source.is_sampled() => Cause::Scattering { times },
        _ => {
            let (vertex, weight) = steepest(trace, on_the_way);
            Cause::Throughput { vertex, weight, times }
        }
    }
}

/// Index of the vertex among the first `count` at which the throughput grew most, and the growth.
fn steepest(trace: &Trace, count: usize) -> (usize, f64) {
    let growth = |(i, vertex): (usize, &Vertex)| {
        let departure = vertex.scatter?;
        let survival = departure.survival.unwrap_or(1.0);
        Some((i, f64::from(departure.weight.luminance()) / f64::from(survival)))
    };
    let on_the_way = trace.vertices[..count].iter().enumerate().filter_map(growth);
    on_the_way.max_by(|a, b| a.1.total_cmp(&b.1)).unwrap_or((0, 1.0))
}

fn probability(source: &LightSource) -> f32 {
    match source {
        LightSource::Light(SampledLight { chosen: Some(chosen), .. }) => chosen.probability,
        _ => 1.0,
    }
}

/// Factors of a contribution, or `None` if it is black or its factors are not known.
fn factors(trace: &Trace, contribution: &Contribution) -> Option<Factors> {
    let value = f64::from(contribution.value.luminance());
    let last = trace.vertices[..contribution.vertices].last();
    let throughput = last.map_or(1.0, |vertex| f64::from(vertex.throughput.luminance()));
    let choice = 1.0 / f64::from(probability(&contribution.source));
    let (radiance, density) = match contribution.source {
        LightSource::Emitter { radiance, weight, .. }
        | LightSource::Sky { radiance, weight, .. } => (radiance.luminance(), f64::from(weight)),
        LightSource::Medium { radiance, .. } => (radiance.luminance(), 1.0),
        LightSource::Light(SampledLight { radiance, pdf, weight, samples, .. }) => {
            let pdf = pdf.map_or(1.0, |pdf| f64::from(pdf.get()));
            let of_choice = f64::from(weight) / (pdf * f64::from(samples));
            (radiance.luminance(), of_choice / choice)
        }
        LightSource::Hemisphere { .. } => return None,
    };
    let others = throughput * f64::from(radiance) * density * choice;
    (value > 0.0 && others > 0.0)
        .then(|| [throughput, f64::from(radiance), choice, density, value / others])
}

#[cfg(test)]
mod tests {
    use super::super::tests::{sample, vertex};
    use super::*;

    const DIFFUSE: (ScatterEvent, bool) = (ScatterEvent::Diffuse, false);
    const MIRROR: (ScatterEvent, bool) = (ScatterEvent::Specular, true);

    /// Fireflies of 63 samples with the contribution `ordinary` and one with `bright`, all of these
    /// vertices.
    fn fireflies(
        vertices: &[(ScatterEvent, bool)],
        bright: (usize, bool, f32),
        ordinary: (usize, bool, f32),
    ) -> Fireflies {
        let vertices: Vec<_> =
            vertices.iter().map(|&(event, is_delta)| vertex(event, is_delta)).collect();
        let mut suspects = Suspects::new();
        let mut luminances = Vec::new();
        for number in 0..64 {
            let contribution = if number == 40 { bright } else { ordinary };
            let sample = sample(number, &vertices, &[contribution]);
            let luminance = f64::from(sample.radiance.luminance());
            luminances.push(luminance);
            suspects.see(sample, luminance);
        }
        suspects.finish(&luminances)
    }

    #[test]
    fn a_sample_that_is_brighter_than_ten_others_is_a_firefly() {
        let of = |luminance| fireflies(&[DIFFUSE], (1, true, luminance), (1, true, 1.0));
        let found = of(500.0);
        assert_eq!((found.all.len(), found.all[0].sample.number), (1, 40));
        assert!((found.ordinary - 1.0).abs() < 1e-6 && found.share_of_variance > 0.9);
        assert!((found.share_of_mean - 500.0 / 563.0).abs() < 1e-6);
        assert!(of(9.0).all.is_empty());
    }

    #[test]
    fn samples_that_are_alike_are_no_fireflies_nor_are_a_few() {
        let rule = FireflyRule::new(&[0.0; 64]);
        assert!(!rule.is_firefly(0.0));
        let rule = FireflyRule::new(&[0.0, 0.0, 0.0, 9.0]);
        assert!(!rule.is_firefly(9.0));
        let mut some = [0.0; 64];
        some[56..].fill(5.0);
        assert!(!FireflyRule::new(&some).is_firefly(5.0));
    }

    #[test]
    fn causes_follow_from_the_path() {
        let cause =
            |vertices: &[_], bright, ordinary| fireflies(vertices, bright, ordinary).all[0].cause;
        let asked = (1, true, 1.0);
        assert_eq!(
            cause(&[DIFFUSE, MIRROR], (2, false, 900.0), asked),
            Cause::Caustic { vertex: 0 }
        );
        assert_eq!(cause(&[MIRROR, MIRROR], (2, false, 900.0), asked), Cause::SeenLight);
        assert_eq!(cause(&[DIFFUSE], (0, false, 900.0), asked), Cause::SeenLight);
        let scattered = cause(&[DIFFUSE], (1, true, 900.0), asked);
        assert!(matches!(scattered, Cause::Scattering { times } if (times - 900.0).abs() < 1e-3));
    }
}
