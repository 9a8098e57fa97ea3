//! Samples that are far brighter than the others of their pixel, and why they are.

use super::{
    Brightest, Contribution, LightSource, Sample, SampledLight, ScatterEvent, Trace, Vertex,
    luminance_of,
};

/// The fireflies of a pixel.
///
/// A sample is one if it is more than [`Fireflies::TIMES`] as bright as the mean of all others, and
/// if more than [`Fireflies::SHARE`] of the sum of the squared deviations from the mean are its
/// own. Fewer than [`Fireflies::MIN_SAMPLES`] samples have none.
#[derive(Clone, Debug)]
pub struct Fireflies {
    /// The mean luminance of the samples that are none.
    pub ordinary: f64,
    /// The share of the pixel's mean that they have together.
    pub share_of_mean: f64,
    /// The share of the sum of the squared deviations that they have together.
    pub share_of_variance: f64,
    /// All of them, of which the first is the brightest.
    pub all: Vec<Firefly>,
}

impl Fireflies {
    /// Brightness relative to the others.
    pub const TIMES: f64 = 10.0;
    /// How much of the squared deviations.
    pub const SHARE: f64 = 0.05;
    /// How few samples tell nothing.
    pub const MIN_SAMPLES: usize = 8;
}

/// A sample that is far brighter than others.
#[derive(Clone, Debug)]
pub struct Firefly {
    /// The sample.
    pub sample: Sample,
    /// Its luminance.
    pub luminance: f64,
    /// The share of the sum of the squared deviations from the mean that is its own.
    pub share_of_variance: f64,
    /// The place of the contribution that brings most.
    pub contribution: usize,
    /// The share of the sample that it brings.
    pub share_of_sample: f64,
    /// Why that is so bright.
    pub cause: Cause,
}

/// Why a contribution is bright. `times` is how many times as large as the mean of other
/// contributions to the pixel that were found in the same way (asked for, or not) the factor is
/// that stands out most.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cause {
    /// The eye sees the light itself, at once or in mirrors, in a part of the pixel.
    SeenLight,
    /// The light comes by way of mirrors or glass to a surface that is neither: no light sample
    /// finds it there, only paths that happen to go to it.
    Caustic {
        /// The place of the vertex where it arrives.
        vertex: usize,
    },
    /// The light is not sampled: only paths that happen to go to it find it, or, where light is
    /// looked for in directions of the hemisphere, only those that happen to lead to it.
    Unsampled,
    /// Throughput up to the last vertex.
    Throughput {
        /// The place of the vertex at which it grew most.
        vertex: usize,
        /// By how much: the luminance of the weight of the direction, over the probability of
        /// Russian roulette.
        weight: f64,
        /// See above.
        times: f64,
    },
    /// The radiance, or for a light without extent the irradiance.
    Radiance {
        /// See above.
        times: f64,
    },
    /// The small probability with which one of many lights was chosen.
    Choice {
        /// It.
        probability: f32,
        /// See above.
        times: f64,
    },
    /// The small density of the direction towards the light: it is near, or seldom sampled.
    Density {
        /// See above.
        times: f64,
    },
    /// What the material at the last vertex reflects from there: a narrow lobe.
    Scattering {
        /// See above.
        times: f64,
    },
    /// No factor is so large: several are large together.
    Several,
}

/// A factor that is not this many times the mean of others does not stand out.
const OUTSTANDING: f64 = 3.0;

/// More samples cannot have a twentieth of the variance each.
const MAX: usize = 20;

/// What makes a contribution, one factor a place: throughput, radiance, choice, density,
/// scattering.
type Factors = [f64; 5];

/// What might be a firefly, so far, and what is usual.
pub(super) struct Suspects {
    brightest: Brightest<(Sample, f64)>,
    /// Of what was found, and of what was asked for: how many contributions, and the sums of their
    /// factors.
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

    /// Which are fireflies, by the luminances of all samples.
    pub(super) fn finish(self, luminances: &[f64]) -> Fireflies {
        let Self { brightest, usual } = self;
        let rule = Rule::new(luminances);
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

/// See [`Fireflies`].
struct Rule {
    count: f64,
    total: f64,
    /// Σ(y − ȳ)²
    squares: f64,
}

impl Rule {
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

/// What there is to say of a firefly besides its share of the variance.
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

/// The factor that stands out most, if one does.
fn outstanding(trace: &Trace, bright: &Contribution, usual: &[(usize, Factors); 2]) -> Cause {
    let (count, sums) = usual[usize::from(bright.source.is_sampled())];
    let Some(factors) = factors(trace, bright).filter(|_| count > 1) else { return Cause::Several };
    let of_others = |i: usize| (sums[i] - factors[i]) / (count - 1) as f64;
    let times: Factors = std::array::from_fn(|i| factors[i] / of_others(i));
    let most = (0..times.len()).max_by(|&a, &b| times[a].total_cmp(&times[b])).unwrap_or(0);
    let times = times[most];
    // Where light was asked for, the last vertex sent no path to it.
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

/// The vertex among the first `count` at which the throughput grew most, and by how much.
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

/// The factors of a contribution that brings something, if they are known.
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

    /// The fireflies of 63 samples of luminance 1 and one of these vertices and this contribution.
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
        let rule = Rule::new(&[0.0; 64]);
        assert!(!rule.is_firefly(0.0));
        let rule = Rule::new(&[0.0, 0.0, 0.0, 9.0]);
        assert!(!rule.is_firefly(9.0));
        let mut some = [0.0; 64];
        some[56..].fill(5.0);
        assert!(!Rule::new(&some).is_firefly(5.0));
    }

    #[test]
    fn causes_are_told_from_the_way_of_the_light() {
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
