//! Observer interface for recording the construction of light paths.

use std::collections::VecDeque;

use pt_core::light::{AnyLight, EscapedRay, LightSampleContext};
use pt_core::scene::RenderScene;
use pt_math::{Ray, Rays, Spectrum, Vec3};

use super::CameraRays;
use super::context::{Context, SurfaceHit};
use super::path_queue::PathState;
use super::scatterer::WeightedLightSample;
use crate::trace::{
    Contribution, LightRef, LightSource, SampledLight, ScatterSample, Trace, Vertex,
};

/// Observer of the samples of a batch, each of which is one path without splitting. Events of a
/// path come in its order; results of light samples come in the order of the samples.
///
/// Renders use `()`, a no-op observer that compiles to nothing.
pub(super) trait PathObserver: Default {
    /// True if events are recorded.
    const ENABLED: bool;
    /// Begins a batch.
    fn on_batch(&mut self, camera_rays: &CameraRays);
    /// A path has reached a vertex.
    fn on_vertex(&mut self, start: u32, vertex: impl FnOnce() -> Vertex);
    /// The path continues from its last vertex.
    fn on_scatter(&mut self, start: u32, scatter: impl FnOnce() -> ScatterSample);
    /// A light is sampled at the last vertex.
    fn on_light_sample(&mut self, start: u32, source: impl FnOnce() -> LightSource);
    /// The path found emission: `value` before and after clamping.
    fn on_emission(
        &mut self,
        start: u32,
        value: [Spectrum; 2],
        source: impl FnOnce() -> LightSource,
    );
    /// Unweighted radiance of each infinite light in the emission that was found last.
    fn on_sky_split(&mut self, start: u32, infinite_lights: impl FnOnce() -> Vec<Spectrum>);
    /// Result of the oldest pending light sample: `value` before and after clamping. `is_last` is
    /// true if no further contribution of this sample follows.
    fn on_light_result(&mut self, start: u32, value: [Spectrum; 2], is_last: bool);
}

impl PathObserver for () {
    const ENABLED: bool = false;
    #[inline(always)]
    fn on_batch(&mut self, _: &CameraRays) {}
    #[inline(always)]
    fn on_vertex(&mut self, _: u32, _: impl FnOnce() -> Vertex) {}
    #[inline(always)]
    fn on_scatter(&mut self, _: u32, _: impl FnOnce() -> ScatterSample) {}
    #[inline(always)]
    fn on_light_sample(&mut self, _: u32, _: impl FnOnce() -> LightSource) {}
    #[inline(always)]
    fn on_emission(&mut self, _: u32, _: [Spectrum; 2], _: impl FnOnce() -> LightSource) {}
    #[inline(always)]
    fn on_sky_split(&mut self, _: u32, _: impl FnOnce() -> Vec<Spectrum>) {}
    #[inline(always)]
    fn on_light_result(&mut self, _: u32, _: [Spectrum; 2], _: bool) {}
}

/// Records all events as [`Trace`]s.
#[derive(Default)]
pub(super) struct PathRecorder {
    traces: Vec<Trace>,
    /// Pending light samples of each path, each with the number of vertices at that time.
    pending: Vec<VecDeque<(usize, LightSource)>>,
}

impl PathRecorder {
    /// Takes the traces of the last batch.
    pub(super) fn take(&mut self) -> Vec<Trace> {
        std::mem::take(&mut self.traces)
    }

    fn add(
        &mut self,
        start: u32,
        vertices: usize,
        source: LightSource,
        [value, kept]: [Spectrum; 2],
    ) {
        let clamped = value.luminance() - kept.luminance();
        let clamped = if value == kept { 0.0 } else { clamped };
        let contribution = Contribution { vertices, source, value: kept, clamped };
        self.traces[start as usize].contributions.push(contribution);
    }
}

impl PathObserver for PathRecorder {
    const ENABLED: bool = true;

    fn on_batch(&mut self, camera_rays: &CameraRays) {
        let trace = |ray: Ray| Trace {
            eye: ray.origin,
            direction: ray.direction,
            vertices: Vec::new(),
            contributions: Vec::new(),
            infinite_lights: Vec::new(),
        };
        self.traces = Rays::from(&camera_rays.rays).iter().map(trace).collect();
        self.pending.clear();
        self.pending.resize(self.traces.len(), VecDeque::new());
    }

    fn on_vertex(&mut self, start: u32, vertex: impl FnOnce() -> Vertex) {
        self.traces[start as usize].vertices.push(vertex());
    }

    fn on_scatter(&mut self, start: u32, scatter: impl FnOnce() -> ScatterSample) {
        if let Some(vertex) = self.traces[start as usize].vertices.last_mut() {
            vertex.scatter = Some(scatter());
        }
    }

    fn on_light_sample(&mut self, start: u32, source: impl FnOnce() -> LightSource) {
        let vertices = self.traces[start as usize].vertices.len();
        self.pending[start as usize].push_back((vertices, source()));
    }

    fn on_emission(
        &mut self,
        start: u32,
        value: [Spectrum; 2],
        source: impl FnOnce() -> LightSource,
    ) {
        let vertices = self.traces[start as usize].vertices.len();
        self.add(start, vertices, source(), value);
    }

    fn on_sky_split(&mut self, start: u32, infinite_lights: impl FnOnce() -> Vec<Spectrum>) {
        self.traces[start as usize].infinite_lights.push(infinite_lights());
    }

    fn on_light_result(&mut self, start: u32, value: [Spectrum; 2], is_last: bool) {
        let asked = &mut self.pending[start as usize];
        let question = if is_last { asked.pop_front() } else { asked.front().copied() };
        if let Some((vertices, source)) = question {
            self.add(start, vertices, source, value);
        }
    }
}

/// Source of emission found by a path on a surface; `weighted` is its radiance times the MIS
/// weight.
pub(super) fn emitter_source(
    cx: Context,
    path: &PathState,
    found: SurfaceHit,
    weighted: Spectrum,
) -> LightSource {
    let SurfaceHit { at, hit, time } = found;
    let radiance = cx.scene.le(at, hit, time);
    let still = cx.scene.surfaces[at.surface].light.is_some();
    LightSource::Emitter {
        p: at.point.p,
        primitive: at.primitive,
        radiance,
        weight: weight_of(weighted, radiance),
        is_sampled: still || cx.scene.animated_light(at, time, path.origin.p).is_some(),
    }
}

/// Source of emission found by a path in the environment; `weighted` is its radiance times the MIS
/// weight.
pub(super) fn sky_source(cx: Context, p: Vec3, direction: Vec3, weighted: Spectrum) -> LightSource {
    let radiance = cx.scene.le_infinite(EscapedRay::new(p, direction), &cx.scene.infinite_lights);
    LightSource::Sky { direction, radiance, weight: weight_of(weighted, radiance) }
}

/// Source of a sample of a light, drawn for a point with two random numbers.
pub(super) fn light_source(
    scene: &RenderScene,
    light: LightRef,
    context: &LightSampleContext,
    u: [f32; 2],
    weighted: &WeightedLightSample,
) -> LightSource {
    let of_scene = match light {
        LightRef::Static(number) => scene.lights.as_slice().get(number),
        LightRef::Animated(_) => None,
    };
    let tree = of_scene.and_then(|light: &AnyLight| light.tree(&scene.light_tables));
    let &WeightedLightSample { sample, n, mis_weight, .. } = weighted;
    LightSource::Light(SampledLight {
        light,
        chosen: tree.and_then(|tree| tree.chosen(context, u)),
        direction: sample.wi,
        distance: sample.distance,
        radiance: sample.radiance,
        pdf: sample.pdf,
        weight: mis_weight,
        samples: n,
    })
}

/// Ratio of the brightest channels.
fn weight_of(part: Spectrum, whole: Spectrum) -> f32 {
    let most = whole.max_channel();
    if most > 0.0 { part.max_channel() / most } else { 0.0 }
}
