//! Direct lighting at surface points: light samples with shadow rays, and hemisphere samples.

use pt_bvh::Hit;
use pt_core::light::{Light, LightSample, LightSampleContext, LightTables, LightVisitor};
use pt_core::scene::RenderScene;
use pt_math::sampler::Lanes;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3, warp};

use super::accumulator::RadianceAccumulator;
use super::batch::Batch;
use super::context::Context;
use super::dimensions::BlockSamples;
use super::estimator::{Hemisphere, PathEstimator};
use super::light_sampling::{SceneLight, for_each_light_sample};
use super::observer::{self, PathObserver};
use super::reuse::Reuse;
use super::shading::{ShadingPoint, SharedRadiance};
use super::{CameraRays, alpha};
use crate::Tracer;
use crate::trace::LightSource;

impl Hemisphere {
    /// Samples a direction in the frame of the surface; returns it and its density.
    #[inline(always)]
    fn direction(self, u: [f32; 2]) -> (Vec3, Pdf<SolidAngle>) {
        if self.cosine {
            let w = warp::cosine_hemisphere(u);
            (w, warp::cosine_hemisphere_pdf(w.z))
        } else {
            let w = warp::uniform_hemisphere(u);
            (w, warp::uniform_hemisphere_pdf(w.z))
        }
    }
}

/// Contribution of a ray.
#[derive(Clone, Copy)]
struct Payload {
    value: Spectrum,
    /// Index of its sum; in animated scenes that is its camera ray.
    target: u32,
}

/// Rays with their contributions.
#[derive(Default)]
struct RayQueue {
    rays: Vec<Ray>,
    payloads: Vec<Payload>,
}

impl RayQueue {
    #[inline(always)]
    fn push(&mut self, ray: Ray, value: Spectrum, target: u32) {
        self.rays.push(ray);
        self.payloads.push(Payload { value, target });
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.payloads.clear();
    }
}

/// A block of shading points for which direct light is sampled.
pub(super) struct ShadingBlock<'a, R> {
    pub(super) estimator: &'a R,
    pub(super) cx: Context<'a>,
    pub(super) surfaces: &'a [ShadingPoint<'a>],
    pub(super) samples: &'a BlockSamples,
}

/// Pending direct-lighting rays. Each path queues its light samples before its hemisphere samples;
/// results are returned in that order, even if the queue is flushed in between.
pub(super) struct DirectLighting {
    hemisphere: Option<Hemisphere>,
    /// Samples of one light, one per shading point of a block.
    light_samples: Vec<Option<LightSample>>,
    /// Contribute f · |cos| · L / p if unoccluded.
    shadow_rays: RayQueue,
    blocked: Vec<bool>,
    /// Transmittance of each shadow ray, in scenes with alpha.
    transmittance: Vec<f32>,
    /// Contribute f · |cos| / p times the emission that they find.
    bsdf_rays: RayQueue,
    hits: Vec<Option<Hit>>,
}

/// Number of rays from which on the queue is flushed: enough for full batches, few enough for the
/// cache.
const FLUSH_RAYS: usize = 4096;

impl DirectLighting {
    pub(super) fn new(hemisphere: Option<Hemisphere>) -> Self {
        Self {
            hemisphere,
            light_samples: Vec::new(),
            shadow_rays: RayQueue::default(),
            blocked: Vec::new(),
            transmittance: Vec::new(),
            bsdf_rays: RayQueue::default(),
            hits: Vec::new(),
        }
    }

    /// Samples direct light at each shading point of a block, weighted by the throughput of its
    /// path; flushes the queue when it is full.
    pub(super) fn sample_lights(
        &mut self,
        block: &ShadingBlock<impl PathEstimator>,
        batch: &mut Batch<impl PathObserver>,
        mut reuse: Option<&mut Reuse>,
    ) {
        let light_pairs = for_each_light_sample(block.cx, block.estimator, |light, n, number| {
            let numbers = &block.samples.pair(number);
            self.sample_light(block, light, numbers, batch);
            let sampling = LightSampling { light, n, numbers };
            self.push_shadow_rays(block, &sampling, reuse.as_deref_mut(), &mut batch.accumulator);
            self.trace_if_full(batch);
        });
        let Some(hemisphere) = self.hemisphere else { return };
        for number in 0..hemisphere.samples {
            let numbers = block.samples.pair(light_pairs.wrapping_add(number));
            let observer = &mut batch.accumulator.observer;
            self.sample_hemisphere(hemisphere, block.surfaces, &numbers, observer);
            self.trace_if_full(batch);
        }
    }

    /// Samples a light at each shading point.
    #[inline(always)]
    fn sample_light(
        &mut self,
        block: &ShadingBlock<impl PathEstimator>,
        light: SceneLight,
        [x, y]: &[Lanes<f32>; 2],
        batch: &Batch<impl PathObserver>,
    ) {
        let (scene, samples) = (block.cx.scene, &mut self.light_samples);
        let numbers = x.iter().zip(y).map(|(&x, &y)| [x, y]);
        let points = block.surfaces.iter().zip(numbers);
        samples.clear();
        match light {
            SceneLight::Static { light, .. } => {
                let points = points.map(|(surface, u)| (surface.light_sample_context(), u));
                light.visit(SampleEach { tables: &scene.light_tables, points, samples });
            }
            SceneLight::Animated { light, .. } => samples.extend(points.map(|(surface, u)| {
                let time = batch.camera_rays.time(surface.start as usize);
                scene.sample_animated_light(light, time, surface.point.p, u)
            })),
        }
    }

    /// Queues the shadow rays of the samples of a light, in a separate loop for the reason given at
    /// `Wavefront::shading_points`.
    #[inline(always)]
    fn push_shadow_rays<W: PathObserver>(
        &mut self,
        block: &ShadingBlock<impl PathEstimator>,
        sampling: &LightSampling,
        mut reuse: Option<&mut Reuse>,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let ShadingBlock { estimator, cx, surfaces, .. } = *block;
        let &LightSampling { light, n, numbers } = sampling;
        let is_invisible = light.kind().is_invisible();
        for (lane, (surface, sample)) in surfaces.iter().zip(&self.light_samples).enumerate() {
            let ShadingPoint { point, bsdf, beta, target, .. } = surface;
            let Some(sample) = sample else { continue };
            if bsdf.is_delta() {
                continue;
            }
            let weighted = estimator.weighted(cx.settings, bsdf, sample, n, is_invisible);
            let value = weighted.contribution(*beta, bsdf);
            if value.is_black() {
                continue;
            }
            let (value, target) = match (surface.shared, &mut reuse) {
                (Some(SharedRadiance::Glossy), Some(reuse)) => {
                    let part = reuse.add_incident_sample(surface.start, sample.wi, accumulator);
                    (sample.radiance * weighted.weight(), part)
                }
                _ => (value, *target),
            };
            accumulator.observer.on_light_sample(surface.start, || {
                let u = numbers.each_ref().map(|numbers| numbers[lane]);
                let context = surface.light_sample_context();
                observer::light_source(cx.scene, light.reference(), &context, u, &weighted)
            });
            self.shadow_rays.push(point.spawn_to(sample), value, target);
        }
    }

    /// Samples one direction of the hemisphere at each shading point.
    fn sample_hemisphere(
        &mut self,
        hemisphere: Hemisphere,
        surfaces: &[ShadingPoint],
        [x, y]: &[Lanes<f32>; 2],
        observer: &mut impl PathObserver,
    ) {
        for (surface, (&x, &y)) in surfaces.iter().zip(x.iter().zip(y)) {
            let ShadingPoint { point, bsdf, beta, start, target, .. } = surface;
            if bsdf.is_delta() {
                continue;
            }
            let (local, pdf) = hemisphere.direction([x, y]);
            let wi = bsdf.frame().to_world(local);
            let value = *beta * bsdf.eval(wi) / (pdf.get() * hemisphere.samples as f32);
            if !value.is_black() {
                let samples = hemisphere.samples;
                observer.on_light_sample(*start, || LightSource::Hemisphere {
                    direction: wi,
                    pdf,
                    samples,
                });
                self.bsdf_rays.push(point.spawn(wi), value, *target);
            }
        }
    }

    /// Flushes the queue if it is full.
    fn trace_if_full(&mut self, batch: &mut Batch<impl PathObserver>) {
        if self.shadow_rays.rays.len().max(self.bsdf_rays.rays.len()) >= FLUSH_RAYS {
            self.trace(batch);
        }
    }

    /// Traces all pending rays, adds their contributions in order, and clears the queue.
    pub(super) fn trace(&mut self, batch: &mut Batch<impl PathObserver>) {
        self.trace_shadow_rays(batch);
        if let Some(hemisphere) = self.hemisphere {
            self.trace_bsdf_rays(hemisphere, batch);
        }
    }

    fn trace_shadow_rays(&mut self, batch: &mut Batch<impl PathObserver>) {
        let Batch { tracer, camera_rays, accumulator } = batch;
        let Self { shadow_rays: RayQueue { rays, payloads }, blocked, transmittance, .. } = self;
        let time = |i: usize| camera_rays.time(payloads[i].target as usize);
        tracer.occluded(&*rays, time, blocked);
        if tracer.scene.has_alpha {
            alpha::shadow_transmittance(tracer, rays, time, blocked, transmittance);
            for (&Payload { value, target }, &share) in payloads.iter().zip(&*transmittance) {
                accumulator.add_light_sample(target, value * share, true);
            }
        } else {
            for (&Payload { value, target }, &blocked) in payloads.iter().zip(&*blocked) {
                let value = if blocked { Spectrum::ZERO } else { value };
                accumulator.add_light_sample(target, value, true);
            }
        }
        self.shadow_rays.clear();
    }

    fn trace_bsdf_rays(&mut self, hemisphere: Hemisphere, batch: &mut Batch<impl PathObserver>) {
        let Batch { tracer, camera_rays, accumulator } = batch;
        let scene = tracer.scene;
        let Self { bsdf_rays: RayQueue { rays, payloads }, hits, .. } = self;
        tracer.intersect(&*rays, |i| camera_rays.time(payloads[i].target as usize), hits);
        if scene.has_alpha {
            add_passed_emission(tracer, camera_rays, rays, payloads, hits, accumulator);
        }
        for ((&Payload { value, target }, hit), ray) in payloads.iter().zip(&*hits).zip(&*rays) {
            let l = match hit {
                Some(hit) => emitted(scene, ray, hit, camera_rays.time(target as usize)),
                None if hemisphere.sky => scene.le_infinite(ray.into(), &scene.infinite_lights),
                None => Spectrum::ZERO,
            };
            accumulator.add_light_sample(target, value * l, true);
        }
        self.bsdf_rays.clear();
    }
}

/// Continues rays through transparent surfaces, adds the emission of these, and multiplies the
/// payloads by the transmittance.
fn add_passed_emission(
    tracer: &mut Tracer,
    camera_rays: &CameraRays,
    rays: &[Ray],
    payloads: &mut [Payload],
    hits: &mut [Option<Hit>],
    accumulator: &mut RadianceAccumulator<impl PathObserver>,
) {
    let scene = tracer.scene;
    let targets: Vec<u32> = payloads.iter().map(|payload| payload.target).collect();
    let time = |i: usize| camera_rays.time(targets[i] as usize);
    alpha::continue_through(tracer, rays, time, hits, |i, _, ray, hit, opacity| {
        let Payload { value, target } = &mut payloads[i];
        let light = *value * emitted(scene, ray, hit, time(i));
        *value *= 1.0 - opacity;
        let goes_on = !value.is_black();
        accumulator.add_light_sample(*target, light, false);
        goes_on
    });
}

/// Radiance emitted by a surface towards a ray that hits it.
fn emitted(scene: &RenderScene, ray: &Ray, hit: &Hit, time: f32) -> Spectrum {
    scene.le(&scene.interaction(ray, hit, time), hit, time)
}

/// One of `n` samples of a light at each shading point of a block, and its random numbers.
struct LightSampling<'a> {
    light: SceneLight<'a>,
    n: u32,
    numbers: &'a [Lanes<f32>; 2],
}

/// Samples a light for many points.
struct SampleEach<'a, P> {
    tables: &'a LightTables,
    points: P,
    samples: &'a mut Vec<Option<LightSample>>,
}

impl<P: Iterator<Item = (LightSampleContext, [f32; 2])>> LightVisitor for SampleEach<'_, P> {
    type Output = ();

    #[inline(always)]
    fn visit<L: Light>(self, light: &L) {
        light.sample_each(self.tables, self.points, self.samples);
    }
}
