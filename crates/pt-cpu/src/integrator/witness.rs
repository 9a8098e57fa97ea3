//! Who hears how samples come about.

use std::collections::VecDeque;

use pt_core::light::{AnyLight, LightSample, Lit};
use pt_core::scene::{Interaction, RenderScene};
use pt_math::{Ray, Rays, Spectrum, Vec3};

use super::Starts;
use super::front::State;
use super::rules::{Context, Found};
use super::wavefront::Surface;
use crate::trace::{
    Contribution, Departure, LightNumber, Place, SampledLight, Source, Trace, Vertex,
};

/// Hears what becomes of the samples of a batch, each of which is a path that does not split. Of each it hears in
/// the order of the path; light that was asked for is answered in the order of the questions.
///
/// A render has nobody who hears: `()`, for whom nothing is computed.
pub(super) trait Witness: Default {
    /// Whether it hears anything.
    const LISTENS: bool;
    /// A batch begins.
    fn begins(&mut self, starts: &Starts);
    /// A path has come to where it is scattered.
    fn comes(&mut self, start: u32, vertex: impl FnOnce() -> Vertex);
    /// It goes on from there.
    fn leaves(&mut self, start: u32, departure: impl FnOnce() -> Departure);
    /// It asks for light there.
    fn asks(&mut self, start: u32, source: impl FnOnce() -> Source);
    /// It found light, of which `kept` was added.
    fn finds(&mut self, start: u32, value: [Spectrum; 2], source: impl FnOnce() -> Source);
    /// What it found last is of the sky, to which each of its lights brings so much before the path weighs it.
    fn tells_apart(&mut self, start: u32, skies: impl FnOnce() -> Vec<Spectrum>);
    /// What it asked for first of what was not answered yet brings light, of which `kept` was added; more may
    /// come unless this is the last of it.
    fn gets(&mut self, start: u32, value: [Spectrum; 2], is_last: bool);
}

impl Witness for () {
    const LISTENS: bool = false;
    #[inline(always)]
    fn begins(&mut self, _: &Starts) {}
    #[inline(always)]
    fn comes(&mut self, _: u32, _: impl FnOnce() -> Vertex) {}
    #[inline(always)]
    fn leaves(&mut self, _: u32, _: impl FnOnce() -> Departure) {}
    #[inline(always)]
    fn asks(&mut self, _: u32, _: impl FnOnce() -> Source) {}
    #[inline(always)]
    fn finds(&mut self, _: u32, _: [Spectrum; 2], _: impl FnOnce() -> Source) {}
    #[inline(always)]
    fn tells_apart(&mut self, _: u32, _: impl FnOnce() -> Vec<Spectrum>) {}
    #[inline(always)]
    fn gets(&mut self, _: u32, _: [Spectrum; 2], _: bool) {}
}

/// Writes down all that it hears.
#[derive(Default)]
pub(super) struct Recorder {
    traces: Vec<Trace>,
    /// What each path asked for and was not told yet, with the number of its vertices then.
    asked: Vec<VecDeque<(usize, Source)>>,
}

impl Recorder {
    /// What it wrote down of the last batch, which it forgets.
    pub(super) fn take(&mut self) -> Vec<Trace> {
        std::mem::take(&mut self.traces)
    }

    fn add(&mut self, start: u32, vertices: usize, source: Source, [value, kept]: [Spectrum; 2]) {
        let removed = value.luminance() - kept.luminance();
        let removed = if value == kept { 0.0 } else { removed };
        let contribution = Contribution { vertices, source, value: kept, removed };
        self.traces[start as usize].contributions.push(contribution);
    }
}

impl Witness for Recorder {
    const LISTENS: bool = true;

    fn begins(&mut self, starts: &Starts) {
        let trace = |ray: Ray| Trace {
            eye: ray.origin,
            direction: ray.direction,
            vertices: Vec::new(),
            contributions: Vec::new(),
            skies: Vec::new(),
        };
        self.traces = Rays::from(&starts.rays).iter().map(trace).collect();
        self.asked.clear();
        self.asked.resize(self.traces.len(), VecDeque::new());
    }

    fn comes(&mut self, start: u32, vertex: impl FnOnce() -> Vertex) {
        self.traces[start as usize].vertices.push(vertex());
    }

    fn leaves(&mut self, start: u32, departure: impl FnOnce() -> Departure) {
        if let Some(vertex) = self.traces[start as usize].vertices.last_mut() {
            vertex.departure = Some(departure());
        }
    }

    fn asks(&mut self, start: u32, source: impl FnOnce() -> Source) {
        let vertices = self.traces[start as usize].vertices.len();
        self.asked[start as usize].push_back((vertices, source()));
    }

    fn finds(&mut self, start: u32, value: [Spectrum; 2], source: impl FnOnce() -> Source) {
        let vertices = self.traces[start as usize].vertices.len();
        self.add(start, vertices, source(), value);
    }

    fn tells_apart(&mut self, start: u32, skies: impl FnOnce() -> Vec<Spectrum>) {
        self.traces[start as usize].skies.push(skies());
    }

    fn gets(&mut self, start: u32, value: [Spectrum; 2], is_last: bool) {
        let asked = &mut self.asked[start as usize];
        let question = if is_last { asked.pop_front() } else { asked.front().copied() };
        if let Some((vertices, source)) = question {
            self.add(start, vertices, source, value);
        }
    }
}

/// Tells of surfaces to which paths have come.
#[inline(always)]
pub(super) fn tell<W: Witness>(surfaces: &[Surface], points: &[Interaction], witness: &mut W) {
    if !W::LISTENS {
        return;
    }
    for (surface, at) in surfaces.iter().zip(points) {
        let Surface { point, bsdf, beta, start, .. } = surface;
        witness.comes(*start, || Vertex {
            p: point.p,
            place: Place::of(bsdf, at.primitive),
            throughput: *beta,
            departure: None,
        });
    }
}

/// A surface that glows, which a path found, and whose weighted radiance towards it is this.
pub(super) fn emitter(cx: Context, path: &State, found: Found, weighted: Spectrum) -> Source {
    let Found { at, hit, time } = found;
    let radiance = cx.scene.emitted(at, hit, time);
    let still = cx.scene.surfaces[at.surface].light.is_some();
    Source::Emitter {
        p: at.point.p,
        primitive: at.primitive,
        radiance,
        weight: share(weighted, radiance),
        is_sampled: still || cx.scene.moving_light(at, time, path.origin.p).is_some(),
    }
}

/// The sky in a direction from a point, where its weighted radiance is this.
pub(super) fn sky(cx: Context, p: Vec3, direction: Vec3, weighted: Spectrum) -> Source {
    let radiance = cx.scene.sky(p, direction, &cx.scene.skies);
    Source::Sky { direction, radiance, weight: share(weighted, radiance) }
}

/// One of `n` samples of a light, drawn for a point by two numbers.
pub(super) fn light(
    scene: &RenderScene,
    light: LightNumber,
    (lit, u): (&Lit, [f32; 2]),
    sample: &LightSample,
    (weight, samples): (f32, u32),
) -> Source {
    let of_scene = match light {
        LightNumber::Still(number) => scene.lights.as_slice().get(number),
        LightNumber::Moving(_) => None,
    };
    let tree = of_scene.and_then(|light: &AnyLight| light.tree(&scene.light_tables));
    Source::Light(SampledLight {
        light,
        chosen: tree.and_then(|tree| tree.chosen(lit, u)),
        direction: sample.wi,
        distance: sample.distance,
        radiance: sample.radiance,
        pdf: sample.pdf,
        weight,
        samples,
    })
}

/// What share of the one the other is, by their brightest channels.
fn share(part: Spectrum, whole: Spectrum) -> f32 {
    let most = whole.max_channel();
    if most > 0.0 { part.max_channel() / most } else { 0.0 }
}
