//! Analysis of a pixel: its light paths, their contributions, and the causes of its noise.
//!
//! A sample is a pure function of scene, settings, pixel and its number, so that the samples of a
//! pixel can be taken again with an observer that records them. The sum of the recorded
//! contributions of a sample is the sample, to the bit.

mod fireflies;
mod names;
mod path_expressions;

use std::ops::Range;

use fireflies::Suspects;
pub use fireflies::{Cause, Fireflies, Firefly};
pub(crate) use names::title;
pub use names::{NameLookup, SceneItem};
use path_expressions::PathExpressions;
pub use path_expressions::{PathExpression, expression};
use pt_core::film::{HalfBuffer, InvalidSamples};
pub use pt_core::light::tree::Chosen;
use pt_core::settings::Settings;
use pt_core::{Film, Region};
pub use pt_cpu::trace::{
    Contribution, LightRef, LightSource, Sample, SampledLight, ScatterEvent, ScatterSample,
    ScatterSite, Trace, Vertex,
};
use pt_cpu::{RenderError, Renderer};

use crate::{Session, Silent};

/// Analysis of a pixel. Luminances are those of linear Rec. 709.
#[derive(Clone, Debug)]
pub struct Explanation {
    /// Column and row, from the upper left.
    pub pixel: [u32; 2],
    /// Range of the sample numbers.
    pub samples: Range<u32>,
    /// Mean radiance: that of the image, to the bit.
    pub mean: [f64; 3],
    /// Mean luminance.
    pub luminance: f64,
    /// Variance of the luminance of a sample: Σ(y − ȳ)² / (n − 1).
    pub variance: f64,
    /// Invalid samples, which count as black.
    pub rejected: InvalidSamples,
    /// Contributions by light path expression, in descending order of variance.
    pub types: Vec<PathExpression>,
    /// Remaining fraction of the variance, from the covariances of these: Σ 2 cov / variance.
    pub together: f64,
    /// Paths with the largest contributions, in descending order.
    pub brightest: Vec<LightPath>,
    /// Samples that are far brighter than the others.
    pub fireflies: Fireflies,
}

/// A light path from the emitter to the camera.
#[derive(Clone, Debug)]
pub struct LightPath {
    /// Number of the sample that contains the path.
    pub sample: u32,
    /// Luminance that the path contributes to the sample.
    pub luminance: f64,
    /// Vertices of the path, and its single contribution.
    pub trace: Trace,
}

/// Analyses the samples that a render takes of a pixel, from number `first` on, with the `top`
/// brightest paths.
///
/// # Errors
/// If the settings cannot be rendered, or samples are not sums of contributions of single paths.
///
/// # Panics
/// If the pixel is not in the image.
pub fn explain(
    session: &Session,
    pixel: [u32; 2],
    first: u32,
    top: usize,
) -> Result<Explanation, RenderError> {
    explain_while(session, pixel, first, top, || true)
}

/// Analyses the samples of a pixel as [`explain()`] does, as long as `proceed` returns true; after
/// that, the analysis is incomplete.
///
/// # Errors
/// As [`explain()`].
///
/// # Panics
/// If the pixel is not in the image.
pub fn explain_while(
    session: &Session,
    pixel: [u32; 2],
    first: u32,
    top: usize,
    proceed: impl Fn() -> bool,
) -> Result<Explanation, RenderError> {
    assert!(region(pixel).is_inside(session.scene().camera.resolution), "a pixel of the image");
    let renderer = renderer(session)?;
    let samples = first..first + count(&renderer, session.settings(), pixel, first);
    let mut observed = Observed::new(top);
    let film = renderer.replay_while(pixel, samples.clone(), |sample| {
        observed.see(sample);
        proceed()
    })?;
    Ok(observed.explanation(pixel, samples, &film))
}

/// Takes one sample of a pixel again; returns `None` if it cannot be taken.
///
/// # Errors
/// As [`explain()`].
///
/// # Panics
/// If the pixel is not in the image.
pub fn explain_sample(
    session: &Session,
    pixel: [u32; 2],
    number: u32,
) -> Result<Option<Sample>, RenderError> {
    assert!(region(pixel).is_inside(session.scene().camera.resolution), "a pixel of the image");
    let mut found = None;
    renderer(session)?.replay(pixel, number..number + 1, |sample| found = Some(sample))?;
    Ok(found)
}

fn region([x, y]: [u32; 2]) -> Region {
    Region { x, y, width: 1, height: 1 }
}

fn renderer(session: &Session) -> Result<Renderer<'_>, RenderError> {
    Renderer::new(session.scene(), session.settings(), 1, 1, false)
}

/// Number of samples of a pixel that are analysed with an error target, since their number in a
/// render depends on the whole image.
const WITH_TARGET: u32 = 64;

/// Returns the number of samples that a render takes of a pixel, in the first half buffer if there
/// are two. An adaptive render is repeated for this pixel to count them.
fn count(renderer: &Renderer, settings: &Settings, pixel: [u32; 2], first: u32) -> u32 {
    let in_halves = settings.in_halves();
    let most = if in_halves { settings.spp.div_ceil(2) } else { settings.spp };
    if settings.target.is_some() {
        return most.min(WITH_TARGET);
    }
    if settings.adaptive.is_none() {
        return most.saturating_sub(first);
    }
    let film = settings.film(region(pixel));
    let mut film = if in_halves { film } else { film.starting_at(first) };
    renderer.render(&mut film, &Silent);
    film.counts_of(HalfBuffer::First).max().unwrap_or(0)
}

/// Statistics of the samples of a pixel so far.
struct Observed {
    types: PathExpressions,
    /// Luminances of samples.
    luminances: Vec<f64>,
    brightest: Brightest<LightPath>,
    suspects: Suspects,
}

impl Observed {
    fn new(top: usize) -> Self {
        Self {
            types: PathExpressions::default(),
            luminances: Vec::new(),
            brightest: Brightest::new(top),
            suspects: Suspects::new(),
        }
    }

    fn see(&mut self, sample: Sample) {
        if sample.fault.is_some() {
            self.luminances.push(0.0);
            return;
        }
        let luminance = self.types.add(&sample);
        self.luminances.push(luminance);
        for contribution in &sample.trace.contributions {
            let luminance = luminance_of(&sample, contribution);
            self.brightest.offer(luminance, || LightPath {
                sample: sample.number,
                luminance,
                trace: alone(&sample.trace, contribution),
            });
        }
        self.suspects.see(sample, luminance);
    }

    fn explanation(self, pixel: [u32; 2], samples: Range<u32>, film: &Film) -> Explanation {
        let Self { types, luminances, brightest, suspects } = self;
        let n = luminances.len().max(1) as f64;
        let mean = luminances.iter().sum::<f64>() / n;
        let squares: f64 = luminances.iter().map(|y| (y - mean) * (y - mean)).sum();
        let variance = squares / (n - 1.0).max(1.0);
        let types = types.finish(luminances.len(), mean, variance);
        let shares: f64 = types.iter().map(|t| t.share_of_variance).sum();
        Explanation {
            pixel,
            samples,
            mean: film.pixel(pixel[0], pixel[1]).mean(),
            luminance: mean,
            variance,
            rejected: film.invalid_samples().clone(),
            types,
            together: if variance > 0.0 { 1.0 - shares } else { 0.0 },
            brightest: brightest.into_sorted(),
            fireflies: suspects.finish(&luminances),
        }
    }
}

/// Luminance that a contribution adds to its sample, with the weight of the filter.
fn luminance_of(sample: &Sample, contribution: &Contribution) -> f64 {
    f64::from(contribution.value.luminance()) * f64::from(sample.weight)
}

/// Trace with a single contribution and its vertices.
fn alone(trace: &Trace, contribution: &Contribution) -> Trace {
    Trace {
        vertices: trace.vertices[..contribution.vertices].to_vec(),
        contributions: vec![*contribution],
        infinite_lights: Vec::new(),
        ..*trace
    }
}

/// The items with the greatest values above 0 among many; among equals, the earlier one precedes.
struct Brightest<T> {
    most: usize,
    /// Value that others must exceed.
    limit: f64,
    /// Values and items, the greatest among them.
    kept: Vec<(f64, T)>,
}

impl<T> Brightest<T> {
    fn new(most: usize) -> Self {
        Self { most, limit: if most > 0 { 0.0 } else { f64::INFINITY }, kept: Vec::new() }
    }

    fn offer(&mut self, value: f64, thing: impl FnOnce() -> T) {
        if value > self.limit {
            self.kept.push((value, thing()));
            if self.kept.len() >= self.most.saturating_mul(2) {
                self.prune();
            }
        }
    }

    /// Sorts the items, and drops all but the greatest.
    fn prune(&mut self) {
        self.kept.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        self.kept.truncate(self.most);
        if let Some((least, _)) = self.kept.last().filter(|_| self.kept.len() == self.most) {
            self.limit = *least;
        }
    }

    fn into_sorted(mut self) -> Vec<T> {
        self.prune();
        self.kept.into_iter().map(|(_, thing)| thing).collect()
    }
}

#[cfg(test)]
mod tests {
    use pt_math::{Pdf, Spectrum, Vec3};

    use super::*;

    /// Vertex with this scattering event, from which the path continues: by a Dirac delta if
    /// `is_delta`.
    pub(super) fn vertex(scatters: ScatterEvent, is_delta: bool) -> Vertex {
        let pdf = (!is_delta).then_some(Pdf::new(1.0));
        let departure =
            ScatterSample { direction: Vec3::Z, pdf, weight: Spectrum::ONE, survival: None };
        Vertex {
            p: Vec3::ZERO,
            site: ScatterSite::Surface { primitive: 0, lobe: "", scatters },
            throughput: Spectrum::ONE,
            scatter: Some(departure),
        }
    }

    /// Sample with contributions: number of vertices, true for light samples, and luminance.
    pub(super) fn sample(
        number: u32,
        vertices: &[Vertex],
        contributions: &[(usize, bool, f32)],
    ) -> Sample {
        let light = SampledLight {
            light: LightRef::Static(0),
            chosen: None,
            direction: Vec3::Z,
            distance: 1.0,
            radiance: Spectrum::ONE,
            pdf: Some(Pdf::new(1.0)),
            weight: 1.0,
            samples: 1,
        };
        let sky = LightSource::Sky { direction: Vec3::Z, radiance: Spectrum::ONE, weight: 1.0 };
        let contribution = |&(vertices, is_asked, luminance): &(usize, bool, f32)| Contribution {
            vertices,
            source: if is_asked { LightSource::Light(light) } else { sky },
            value: Spectrum::splat(luminance),
            clamped: 0.0,
        };
        let contributions: Vec<_> = contributions.iter().map(contribution).collect();
        let radiance = contributions.iter().map(|c| c.value).sum();
        let (eye, direction, vertices) = (Vec3::ZERO, Vec3::Z, vertices.to_vec());
        let trace = Trace { eye, direction, vertices, contributions, infinite_lights: Vec::new() };
        Sample { number, trace, weight: 1.0, radiance, fault: None }
    }

    #[test]
    fn the_brightest_of_many_are_kept_in_order() {
        let mut brightest = Brightest::new(3);
        for (i, value) in [2.0, 0.0, 5.0, 5.0, 1.0, 3.0, f64::NAN].into_iter().enumerate() {
            brightest.offer(value, || i);
        }
        assert_eq!(brightest.into_sorted(), [2, 3, 5]);
        let random = |i: u32| f64::from(i.wrapping_mul(2_654_435_761) >> 24);
        let mut all: Vec<u32> = (0..1000).filter(|&i| random(i) > 0.0).collect();
        all.sort_by(|&a, &b| random(b).total_cmp(&random(a)));
        for most in [0, 1, 7, usize::MAX] {
            let mut brightest = Brightest::new(most);
            (0..1000).for_each(|i| brightest.offer(random(i), || i));
            assert_eq!(brightest.into_sorted(), all[..most.min(all.len())]);
        }
    }
}
