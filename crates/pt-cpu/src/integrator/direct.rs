//! Direct lighting at surface points: light samples with shadow rays, and hemisphere samples.

use pt_bvh::Hit;
use pt_core::light::{Light, LightSample, LightVisitor};
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::Lanes;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3, warp};

use super::accumulator::RadianceAccumulator;
use super::dimensions::BlockSamples;
use super::estimator::PathEstimator;
use super::observer::{self, PathObserver};
use super::reuse::Reuse;
use super::shading::{ShadingPoint, SharedRadiance};
use super::{CameraRays, alpha};
use crate::Tracer;
use crate::integrator::estimator::Hemisphere;
use crate::trace::{LightRef, LightSource};

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

/// Rays with their contributions.
#[derive(Default)]
struct RayQueue {
    rays: Vec<Ray>,
    /// Contribution of each ray, and the index of its sum; in animated scenes that is its camera
    /// ray.
    payloads: Vec<(Spectrum, u32)>,
}

impl RayQueue {
    #[inline(always)]
    fn push(&mut self, ray: Ray, value: Spectrum, start: u32) {
        self.rays.push(ray);
        self.payloads.push((value, start));
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.payloads.clear();
    }
}

/// A block of shading points for which direct light is sampled.
pub(super) struct ShadingBlock<'a, R> {
    pub(super) estimator: &'a R,
    pub(super) settings: &'a Settings,
    pub(super) surfaces: &'a [ShadingPoint<'a>],
    pub(super) numbers: &'a BlockSamples,
}

/// Pending direct-lighting rays. Each path queues its light samples before its hemisphere samples;
/// results are returned in that order, even if the queue is flushed in between.
pub(super) struct DirectLighting {
    hemisphere: Option<Hemisphere>,
    /// Samples of one light, one per shading point of a block.
    samples: Vec<Option<LightSample>>,
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
            samples: Vec::new(),
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
        shading_block: &ShadingBlock<impl PathEstimator>,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
        mut reuse: Option<&mut Reuse>,
    ) {
        let scene = tracer.scene;
        let mut pair = 0u32;
        for (number, light) in scene.lights.as_slice().iter().enumerate() {
            let n = shading_block.estimator.light_samples(shading_block.settings, light);
            for _ in 0..n {
                let numbers = shading_block.numbers.pair(pair);
                pair = pair.wrapping_add(1);
                let reuse = reuse.as_deref_mut();
                let (numbers, direct_lighting) = (&numbers, &mut *self);
                let number = LightRef::Static(number);
                let sampling = LightSampling {
                    shading_block,
                    scene,
                    number,
                    numbers,
                    n,
                    direct_lighting,
                    reuse,
                    accumulator,
                };
                light.visit(sampling);
                self.trace_if_full(tracer, camera_rays, accumulator);
            }
        }
        for (number, light) in scene.animated_lights().iter().enumerate() {
            let n = shading_block.estimator.light_samples(shading_block.settings, &light.light);
            for _ in 0..n {
                let numbers = &shading_block.numbers.pair(pair);
                pair = pair.wrapping_add(1);
                let (direct_lighting, reuse) = (&mut *self, reuse.as_deref_mut());
                let number = LightRef::Animated(number);
                let sampling = LightSampling {
                    shading_block,
                    scene,
                    number,
                    numbers,
                    n,
                    direct_lighting,
                    reuse,
                    accumulator,
                };
                let sample = |(surface, u): (&ShadingPoint, [f32; 2])| {
                    let time = camera_rays.time(surface.start as usize);
                    scene.sample_animated_light(light, time, surface.point.p, u)
                };
                let points = sampling.points();
                sampling.direct_lighting.samples.clear();
                sampling.direct_lighting.samples.extend(points.map(sample));
                sampling.push_shadow_rays(light.light.is_invisible());
                self.trace_if_full(tracer, camera_rays, accumulator);
            }
        }
        let Some(hemisphere) = self.hemisphere else { return };
        for _ in 0..hemisphere.samples {
            self.sample_hemisphere(
                hemisphere,
                shading_block.surfaces,
                &shading_block.numbers.pair(pair),
                &mut accumulator.observer,
            );
            pair = pair.wrapping_add(1);
            self.trace_if_full(tracer, camera_rays, accumulator);
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
    fn trace_if_full(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        if self.shadow_rays.rays.len().max(self.bsdf_rays.rays.len()) >= FLUSH_RAYS {
            self.trace(tracer, camera_rays, accumulator);
        }
    }

    /// Traces all pending rays, adds their contributions in order, and clears the queue.
    pub(super) fn trace(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        let scene = tracer.scene;
        let Self { shadow_rays, blocked, .. } = self;
        let time = |i: usize| camera_rays.time(shadow_rays.payloads[i].1 as usize);
        tracer.occluded(&shadow_rays.rays, time, blocked);
        if scene.has_alpha {
            let Self { shadow_rays, blocked, transmittance, .. } = self;
            let time = |i: usize| camera_rays.time(shadow_rays.payloads[i].1 as usize);
            alpha::shadow_transmittance(tracer, &shadow_rays.rays, time, blocked, transmittance);
            for (&(value, start), &share) in shadow_rays.payloads.iter().zip(&*transmittance) {
                accumulator.add_light_sample(start, value * share, true);
            }
        } else {
            for (&(value, start), &blocked) in self.shadow_rays.payloads.iter().zip(&self.blocked) {
                accumulator.add_light_sample(
                    start,
                    if blocked { Spectrum::ZERO } else { value },
                    true,
                );
            }
        }
        self.shadow_rays.clear();
        let Some(hemisphere) = self.hemisphere else { return };
        let Self { bsdf_rays: RayQueue { rays, payloads }, hits, .. } = self;
        tracer.intersect(&*rays, |i| camera_rays.time(payloads[i].1 as usize), hits);
        if scene.has_alpha {
            let of: Vec<u32> = payloads.iter().map(|&(_, start)| start).collect();
            let time = |i: usize| camera_rays.time(of[i] as usize);
            alpha::continue_through(tracer, rays, time, hits, |i, _, ray, hit, opacity| {
                let (value, start) = &mut payloads[i];
                let light = *value * emitted(scene, ray, hit, time(i));
                *value *= 1.0 - opacity;
                let goes_on = !value.is_black();
                accumulator.add_light_sample(*start, light, false);
                goes_on
            });
        }
        for ((&(value, start), hit), ray) in
            self.bsdf_rays.payloads.iter().zip(&self.hits).zip(&self.bsdf_rays.rays)
        {
            let l = match hit {
                Some(hit) => emitted(scene, ray, hit, camera_rays.time(start as usize)),
                None if hemisphere.sky => scene.le_infinite(ray.into(), &scene.infinite_lights),
                None => Spectrum::ZERO,
            };
            accumulator.add_light_sample(start, value * l, true);
        }
        self.bsdf_rays.clear();
    }
}

/// Radiance emitted by a surface towards a ray that hits it.
fn emitted(scene: &RenderScene, ray: &Ray, hit: &Hit, time: f32) -> Spectrum {
    scene.le(&scene.interaction(ray, hit, time), hit, time)
}

/// Takes one of `n` samples of a light at each shading point.
struct LightSampling<'a, 's, R, W> {
    shading_block: &'a ShadingBlock<'a, R>,
    scene: &'a RenderScene,
    number: LightRef,
    numbers: &'a [Lanes<f32>; 2],
    n: u32,
    direct_lighting: &'a mut DirectLighting,
    reuse: Option<&'a mut Reuse>,
    accumulator: &'a mut RadianceAccumulator<'s, W>,
}

impl<R: PathEstimator, W: PathObserver> LightVisitor for LightSampling<'_, '_, R, W> {
    type Output = ();

    #[inline(always)]
    fn visit<L: Light>(self, light: &L) {
        let points = self.points().map(|(surface, u)| (surface.light_sample_context(), u));
        let samples = &mut self.direct_lighting.samples;
        samples.clear();
        light.sample_each(&self.scene.light_tables, points, samples);
        self.push_shadow_rays(L::INVISIBLE);
    }
}

impl<'a, R: PathEstimator, W: PathObserver> LightSampling<'a, '_, R, W> {
    /// Shading points, each with two random numbers.
    #[inline(always)]
    fn points(&self) -> impl Iterator<Item = (&'a ShadingPoint<'a>, [f32; 2])> + use<'a, R, W> {
        let [x, y] = self.numbers;
        self.shading_block.surfaces.iter().zip(x.iter().zip(y)).map(|(s, (&x, &y))| (s, [x, y]))
    }

    /// Queues the shadow rays of the samples, in a separate loop for the reason given at
    /// `Wavefront::shading_points`. Samples of invisible lights, which rays do not find, have MIS
    /// weight 1.
    #[inline(always)]
    fn push_shadow_rays(mut self, is_invisible: bool) {
        let ShadingBlock { estimator, settings, surfaces, .. } = *self.shading_block;
        let DirectLighting { samples, shadow_rays, .. } = self.direct_lighting;
        for (lane, (surface, sample)) in surfaces.iter().zip(&*samples).enumerate() {
            let ShadingPoint { point, bsdf, beta, target, .. } = surface;
            let Some(sample) = sample else { continue };
            if bsdf.is_delta() {
                continue;
            }
            let weight = if is_invisible {
                1.0
            } else {
                estimator.light_weight(settings, bsdf, sample, self.n)
            };
            let p = sample.pdf.map_or(1.0, Pdf::get) * self.n as f32;
            let f = bsdf.eval(sample.wi);
            let value = *beta * f * sample.radiance * (weight / p);
            if value.is_black() {
                continue;
            }
            let (value, target) = match (surface.shared, &mut self.reuse) {
                (Some(SharedRadiance::Glossy), Some(reuse)) => {
                    let part =
                        reuse.add_incident_sample(surface.start, sample.wi, self.accumulator);
                    (sample.radiance * (weight / p), part)
                }
                _ => (value, *target),
            };
            self.accumulator.observer.on_light_sample(surface.start, || {
                let u = self.numbers.each_ref().map(|numbers| numbers[lane]);
                let context = (&surface.light_sample_context(), u);
                observer::light_source(self.scene, self.number, context, sample, (weight, self.n))
            });
            shadow_rays.push(point.spawn_to(sample), value, target);
        }
    }
}
