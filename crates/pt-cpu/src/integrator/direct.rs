//! Direct lighting at the vertices of paths: light samples with shadow rays, and hemisphere
//! samples.

use pt_bvh::Hit;
use pt_core::bsdf::Bsdf;
use pt_core::light::{Light, LightSample, LightSampleContext, LightTables, LightVisitor};
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::Lanes;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3, warp};

use super::accumulator::RadianceAccumulator;
use super::alpha;
use super::batch::Batch;
use super::context::Context;
use super::dimensions::{BlockSamples, bounce_stream};
use super::estimator::{Hemisphere, PathEstimator};
use super::light_sampling::{SceneLight, for_each_light_sample};
use super::observer::{self, PathObserver};
use super::ray_queue::{Payload, RayQueue};
use super::reuse::Reuse;
use super::scatterer::Scatterer;
use super::space::Space;
use super::space::shading::{ShadingPoint, SharedRadiance};
use super::split::PathSplitting;
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

/// A block of shading points for which direct light is sampled.
pub(super) struct ShadingBlock<'a, 'v, R, S: Space> {
    pub(super) estimator: &'a R,
    pub(super) cx: Context<'a>,
    /// Number of interactions before.
    pub(super) bounces: u32,
    pub(super) splitting: PathSplitting,
    pub(super) vertices: &'a [ShadingPoint<'v, S>],
    pub(super) samples: &'a BlockSamples,
}

impl<R, S: Space> ShadingBlock<'_, '_, R, S> {
    /// Returns a test for vertices whose scattered light is part of the image. It has a copy of the
    /// settings, which a loop can keep in registers.
    #[inline(always)]
    fn lit_test(&self) -> impl Fn(&ShadingPoint<'_, S>) -> bool + use<R, S> {
        let (shown, bounces) = (self.cx.settings.shown_bounces(), self.bounces);
        move |vertex| shown.contains(&(S::counted(bounces, &vertex.space) + 1))
    }
}

/// Pending direct-lighting rays. Each path queues its light samples before its hemisphere samples;
/// results are returned in that order, even if the queue is flushed in between.
pub(super) struct DirectLighting<S> {
    hemisphere: Option<Hemisphere>,
    /// Samples of one light, one per shading point of a block.
    light_samples: Vec<Option<LightSample>>,
    /// Contribute f · |cos| · L / p times the transmittance.
    shadow_rays: RayQueue<S>,
    /// Contribute f · |cos| / p times the emission that they find.
    bsdf_rays: RayQueue<()>,
    hits: Vec<Option<Hit>>,
}

impl<S: Copy> DirectLighting<S> {
    pub(super) fn new(hemisphere: Option<Hemisphere>) -> Self {
        Self {
            hemisphere,
            light_samples: Vec::new(),
            shadow_rays: RayQueue::new(),
            bsdf_rays: RayQueue::new(),
            hits: Vec::new(),
        }
    }

    /// Samples direct light at each shading point of a block, weighted by the throughput of its
    /// path; flushes the queue when it is full.
    pub(super) fn sample_lights<P: Space<ShadowState = S>>(
        &mut self,
        block: &ShadingBlock<impl PathEstimator, P>,
        space: &mut P,
        batch: &mut Batch<impl PathObserver>,
        mut reuse: Option<&mut Reuse>,
    ) {
        if !block.vertices.iter().any(block.lit_test()) {
            return;
        }
        let light_pairs = for_each_light_sample(block.cx, block.estimator, |light, n, number| {
            let numbers = &block.samples.light_pair(number);
            self.sample_light(block, light, numbers, batch);
            let sampling = LightSampling { light, n, number, numbers };
            self.push_shadow_rays(block, &sampling, reuse.as_deref_mut(), batch);
            self.trace_if_full(block.cx.settings, space, batch);
        });
        let Some(hemisphere) = self.hemisphere else { return };
        for number in 0..hemisphere.samples {
            let numbers = block.samples.light_pair(light_pairs.wrapping_add(number));
            let observer = &mut batch.accumulator.observer;
            self.sample_hemisphere(hemisphere, block.vertices, &numbers, observer);
            self.trace_if_full(block.cx.settings, space, batch);
        }
    }

    /// Samples a light at each shading point.
    #[inline(always)]
    fn sample_light(
        &mut self,
        block: &ShadingBlock<impl PathEstimator, impl Space>,
        light: SceneLight,
        [x, y]: &[Lanes<f32>; 2],
        batch: &Batch<impl PathObserver>,
    ) {
        let (scene, samples) = (block.cx.scene, &mut self.light_samples);
        let numbers = x.iter().zip(y).map(|(&x, &y)| [x, y]);
        let points = block.vertices.iter().zip(numbers);
        samples.clear();
        match light {
            SceneLight::Static { light, .. } => {
                let points = points.map(|(vertex, u)| (vertex.light_sample_context(), u));
                light.visit(SampleEach { tables: &scene.light_tables, points, samples });
            }
            SceneLight::Animated { light, .. } => samples.extend(points.map(|(vertex, u)| {
                let camera_ray = block.splitting.camera_ray(vertex.start);
                let time = batch.camera_rays.time(camera_ray);
                scene.sample_animated_light(light, time, vertex.point.p, u)
            })),
        }
    }

    /// Queues the shadow rays of the samples of a light, in a separate loop for the reason given at
    /// `Wavefront::shading_points`; not inlined, so that the loop has all registers.
    #[inline(never)]
    fn push_shadow_rays<P: Space<ShadowState = S>>(
        &mut self,
        block: &ShadingBlock<impl PathEstimator, P>,
        sampling: &LightSampling,
        mut reuse: Option<&mut Reuse>,
        batch: &mut Batch<impl PathObserver>,
    ) {
        let is_lit = block.lit_test();
        let ShadingBlock { estimator, cx, bounces, splitting, vertices, .. } = *block;
        let &LightSampling { light, n, number, numbers } = sampling;
        let Batch { camera_rays, accumulator, .. } = batch;
        let is_invisible = light.kind().is_invisible();
        let samples = &self.light_samples;
        let together = Bsdf::eval_and_pdf_each(
            vertices.iter().map(|vertex| vertex.scatterer.bsdf()),
            |lane| samples[lane].as_ref().map(|sample| sample.wi),
        );
        for (lane, (vertex, sample)) in vertices.iter().zip(samples).enumerate() {
            let ShadingPoint { point, scatterer, beta, start, target, .. } = vertex;
            let Some(sample) = sample else { continue };
            if scatterer.is_delta() || !is_lit(vertex) {
                continue;
            }
            let value = together[lane].unwrap_or_else(|| scatterer.eval_and_pdf(sample.wi));
            let weighted = estimator.weighted(cx.settings, value, sample, n, is_invisible);
            let value = weighted.contribution(*beta);
            if value.is_black() {
                continue;
            }
            let (value, target) = match (vertex.shared, &mut reuse) {
                (Some(SharedRadiance::Glossy), Some(reuse)) => {
                    let part = reuse.add_incident_sample(*start, sample.wi, accumulator);
                    (sample.radiance * weighted.weight(), part)
                }
                _ => (value, *target),
            };
            accumulator.observer.on_light_sample(*start, || {
                let u = numbers.each_ref().map(|numbers| numbers[lane]);
                let context = vertex.light_sample_context();
                observer::light_source(cx.scene, light.reference(), &context, u, &weighted)
            });
            let stream =
                || bounce_stream(splitting.sampler(camera_rays, *start), bounces, Some(number));
            let state = P::shadow_state(cx.scene, vertex, sample, stream);
            self.shadow_rays.push(point.spawn_to(sample), Payload { value, target, state });
        }
    }

    /// Samples one direction of the hemisphere at each shading point.
    fn sample_hemisphere(
        &mut self,
        hemisphere: Hemisphere,
        vertices: &[ShadingPoint<impl Space>],
        [x, y]: &[Lanes<f32>; 2],
        observer: &mut impl PathObserver,
    ) {
        for (vertex, (&x, &y)) in vertices.iter().zip(x.iter().zip(y)) {
            let ShadingPoint { point, scatterer, beta, start, target, .. } = vertex;
            let Some(bsdf) = scatterer.bsdf().filter(|bsdf| !bsdf.is_delta()) else { continue };
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
                let payload = Payload { value, target: *target, state: () };
                self.bsdf_rays.push(point.spawn(wi), payload);
            }
        }
    }

    /// Flushes the queue if it is full.
    fn trace_if_full(
        &mut self,
        settings: &Settings,
        space: &mut impl Space<ShadowState = S>,
        batch: &mut Batch<impl PathObserver>,
    ) {
        if self.shadow_rays.is_full() || self.bsdf_rays.is_full() {
            self.trace(settings, space, batch);
        }
    }

    /// Traces all pending rays, adds their contributions in order, and clears the queue.
    pub(super) fn trace(
        &mut self,
        settings: &Settings,
        space: &mut impl Space<ShadowState = S>,
        batch: &mut Batch<impl PathObserver>,
    ) {
        let time = batch.times_of_sums();
        let Batch { tracer, accumulator, .. } = batch;
        space.trace_shadow_rays(tracer, settings, time, &mut self.shadow_rays, |target, value| {
            accumulator.add_light_sample(target, value, true);
        });
        self.shadow_rays.clear();
        if let Some(hemisphere) = self.hemisphere {
            self.trace_bsdf_rays(hemisphere, batch);
        }
    }

    fn trace_bsdf_rays(&mut self, hemisphere: Hemisphere, batch: &mut Batch<impl PathObserver>) {
        let time = batch.times_of_sums();
        let Batch { tracer, accumulator, .. } = batch;
        let scene = tracer.scene;
        let Self { bsdf_rays: RayQueue { rays, payloads }, hits, .. } = self;
        tracer.intersect(&*rays, |i| time(payloads[i].target), hits);
        if scene.has_alpha {
            add_passed_emission(tracer, time, rays, payloads, hits, accumulator);
        }
        for ((&Payload { value, target, .. }, hit), ray) in payloads.iter().zip(&*hits).zip(&*rays)
        {
            let l = match hit {
                Some(hit) => emitted(scene, ray, hit, time(target)),
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
    time: impl Fn(u32) -> f32,
    rays: &[Ray],
    payloads: &mut [Payload<()>],
    hits: &mut [Option<Hit>],
    accumulator: &mut RadianceAccumulator<impl PathObserver>,
) {
    let scene = tracer.scene;
    let targets: Vec<u32> = payloads.iter().map(|payload| payload.target).collect();
    let time = |i: usize| time(targets[i]);
    alpha::continue_through(tracer, rays, time, hits, |i, _, ray, hit, opacity| {
        let Payload { value, target, .. } = &mut payloads[i];
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
    /// Number of the sample among those of all lights.
    number: u32,
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
