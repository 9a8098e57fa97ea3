//! Scalar path tracer, one path at a time: the one to read first.
//!
//! [`Wavefront`](super::wavefront::Wavefront) with the same estimator, [`Path`], performs the same
//! steps for many paths at once and gives the same bits. `tests/laws/reference.rs` of `pathtracer`
//! compares the two.

use pt_bvh::Hit;
use pt_core::light::LightSampleContext;
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::Sampler;
use pt_math::{Ray, Rays, Spectrum};

use super::batch::{Batch, ByProducts};
use super::context::Context;
use super::dimensions::BounceDimensions;
use super::estimator::{PathEstimator, add_hit_emission, add_sky};
use super::light_sampling::{LightingVertex, sample_lights};
use super::observer::{PathObserver, PathRecorder};
use super::path::Path;
use super::path_queue::PathState;
use super::scatterer::transmittance_after;
use super::split::PathSplitting;
use super::transparency::Transparency;
use super::{CameraRays, Integrator, TracedIntegrator, alpha};
use crate::Tracer;
use crate::trace::{ScatterSample, ScatterSite, Trace, Vertex};

/// Unidirectional path tracing with multiple importance sampling, as described at [`Path`].
/// Estimators of direct light by hemisphere sampling are replaced by
/// [`DirectLight::Mis`](pt_core::settings::DirectLight::Mis).
pub(super) struct Reference<'a, W = ()> {
    scene: &'a RenderScene,
    settings: &'a Settings,
    estimator: Path,
    max_depth: u32,
    dimensions: BounceDimensions,
    transparency: Transparency,
    by_products: ByProducts<W>,
}

/// Light sample before its visibility test.
struct UnshadowedLight {
    shadow_ray: Ray,
    /// Throughput · f · |cos| · L · MIS weight / pdf.
    contribution: Spectrum,
}

impl<W: PathObserver> Reference<'_, W> {
    /// Adds the radiance along camera ray number `i`: the sum of β Lₑ over the vertices of a path.
    fn trace_path(&mut self, i: usize, camera_transmittance: f32, batch: &mut Batch<W>) {
        let Batch { tracer, camera_rays, accumulator: radiance } = batch;
        let Self { scene, settings, estimator, dimensions, transparency, max_depth, .. } = self;
        let scene = *scene;
        let cx = Context { scene, settings };
        let (sampler, time) = (camera_rays.samplers.get(i), camera_rays.time(i));
        let mut ray = Rays::from(&camera_rays.rays).get(i);
        let mut cone = scene.uses_footprints().then(|| scene.camera_cone(ray.direction, time));
        let mut path =
            PathState::at_camera(scene.importance(), &ray, i as u32, camera_transmittance);
        for bounces in 0.. {
            radiance.set_bounces(bounces);
            let is_shown = settings.shows(bounces);

            // Nearest surface. Alpha lets rays continue, which adds the emission of the surfaces
            // passed.
            let hides_emitters = bounces == 0 && transparency.hides_emitters();
            let (passed, hit) = nearest_hit(tracer, &ray, time, hides_emitters, sampler, bounces);

            // Emission of surfaces and of the environment.
            for hit in passed.iter().chain(&hit) {
                if is_shown {
                    add_hit_emission(estimator, cx, &path, &ray, hit, time, radiance);
                }
            }
            let Some(hit) = hit else {
                if transparency.on_escape(&path, PathSplitting::NONE) && is_shown {
                    add_sky(estimator, cx, &path, ray.direction, bounces, radiance);
                }
                return;
            };
            if bounces >= *max_depth {
                return;
            }

            // Material at the hit.
            let at = scene.interaction(&ray, &hit, time);
            let choice = dimensions.material_choice(sampler, bounces);
            let width = cone.map(|cone| cone.width_at(at.distance));
            let material = scene.evaluate_material(&at, &hit, time, choice, width);
            let bsdf = scene.bsdf(&at, material.as_ref());
            radiance.observer.on_vertex(path.start, || Vertex {
                p: at.point.p,
                site: ScatterSite::of(&bsdf, at.primitive),
                throughput: path.beta,
                scatter: None,
            });

            // Light sampling (next-event estimation).
            radiance.set_bounces(bounces + 1);
            let is_lit = settings.shows(bounces + 1);
            if is_lit && !bsdf.is_delta() {
                let context = LightSampleContext::of_bsdf(at.point.p, &bsdf);
                let vertex = LightingVertex { path: &path, scatterer: &bsdf, context, time };
                let u = |number| dimensions.pair(sampler, bounces, number);
                let mut lights = Vec::new();
                sample_lights(cx, estimator, &vertex, u, &mut radiance.observer, |sample, l, _| {
                    let shadow_ray = at.point.spawn_to(sample);
                    lights.push(UnshadowedLight { shadow_ray, contribution: l });
                });
                for light in lights {
                    let visible = transmittance(tracer, &light.shadow_ray, time);
                    radiance.add_light_sample(path.target, light.contribution * visible, true);
                }
            }

            // BSDF sampling.
            let pair = dimensions.scattering_pair(is_lit, bsdf.is_delta());
            let numbers = dimensions.scattering(sampler, bounces, pair);
            let Some(scattered) = bsdf.sample(numbers.direction) else { return };
            path.beta *= scattered.weight;
            path.eta_scale *= scattered.eta_scale;
            path.origin = LightSampleContext::of_bsdf(at.point.p, &bsdf);
            path.bsdf_pdf = scattered.pdf;
            path.camera_transmittance =
                transmittance_after(path.camera_transmittance, &bsdf, scattered.wi);
            let is_last = bounces + 1 >= *max_depth;
            let counts_emission = estimator.counts_emission(settings, path.bsdf_pdf);
            if path.beta.is_black() || (is_last && !counts_emission) {
                return;
            }

            // Russian roulette.
            let survival = estimator.rr_survival_probability(settings, &bsdf, &path, bounces + 1);
            if let Some(q) = survival {
                if numbers.roulette >= q {
                    return;
                }
                path.beta *= 1.0 / q;
                path.camera_transmittance *= 1.0 / q;
            }
            let scatter = || ScatterSample::new(&scattered, survival);
            radiance.observer.on_scatter(path.start, scatter);
            let is_flat = scene.is_flat(at.primitive);
            cone = cone.map(|cone| cone.scattered(at.distance, path.bsdf_pdf, is_flat));
            ray = at.point.spawn(scattered.wi);
        }
    }
}

/// Surfaces that a ray passes because of their alpha, and the nearest one that it does not pass.
fn nearest_hit(
    tracer: &mut Tracer,
    ray: &Ray,
    time: f32,
    hides_emitters: bool,
    sampler: Sampler,
    bounces: u32,
) -> (Vec<Hit>, Option<Hit>) {
    let rays = std::slice::from_ref(ray);
    let (mut hits, mut passed) = (Vec::new(), Vec::new());
    tracer.intersect(rays, |_| time, &mut hits);
    if hides_emitters {
        alpha::skip_emitters(tracer, rays, |_| time, &mut hits);
    }
    if tracer.scene.has_alpha {
        let passes = |_: usize, _: &Ray, hit: &Hit| passed.push(*hit);
        alpha::skip_transparent(tracer, bounces, rays, &mut hits, |_| time, |_| sampler, passes);
    }
    (passed, hits[0])
}

/// Transmittance along a shadow ray.
fn transmittance(tracer: &mut Tracer, ray: &Ray, time: f32) -> f32 {
    let rays = std::slice::from_ref(ray);
    let (mut blocked, mut transmittance) = (Vec::new(), Vec::new());
    tracer.occluded(rays, |_| time, &mut blocked);
    alpha::shadow_transmittance(tracer, rays, |_| time, &blocked, &mut transmittance);
    transmittance[0]
}

impl<'a, W: PathObserver> Reference<'a, W> {
    pub(super) fn new(scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let estimator = Path::without_hemisphere_sampling(settings);
        Self {
            scene,
            max_depth: estimator.max_depth(settings),
            dimensions: BounceDimensions::new(&estimator, Context { scene, settings }),
            transparency: Transparency::new(scene, settings),
            settings,
            estimator,
            by_products: ByProducts::default(),
        }
    }
}

impl<W: PathObserver> Integrator for Reference<'_, W> {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        let clamp = self.settings.clamp;
        let mut batch =
            self.by_products.begin(tracer, camera_rays, radiance, PathSplitting::NONE, clamp);
        let n = camera_rays.samplers.len();
        let camera_transmittance = self.transparency.begin(n);
        for i in 0..n {
            self.trace_path(i, camera_transmittance, &mut batch);
        }
        self.by_products.end(batch);
    }

    fn take_clamped(&mut self) -> Vec<(u32, f32)> {
        self.by_products.take_clamped()
    }

    fn transparency(&self) -> Option<&[f32]> {
        self.transparency.values()
    }
}

impl TracedIntegrator for Reference<'_, PathRecorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.by_products.take_traces()
    }
}
