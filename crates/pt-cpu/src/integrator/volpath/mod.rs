//! Path tracer for scenes with media.
//! ```text
//! for each bounce:
//!     steps to the next scattering event, through alpha      sample_medium
//!     emission at the ends of paths                          add_emission_and_sky
//!     path by path: light samples, and the next direction    scatter_paths
//!     shadow rays                                            ShadowRays::trace
//! ```
//!
//! As in [`super::wavefront`], paths have only buffers in common.

mod medium_step;
mod shadow_ray;
mod vertex;

use medium_step::{MediumStep, PathEvent};
use pt_core::film::ExactSum;
use pt_core::footprint::Cone;
use pt_core::id::Id;
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::{RngStream, Sampler};
use pt_math::{Ray, Rays, Spectrum};
use shadow_ray::ShadowRays;
use vertex::Vertex;

use super::batch::{Batch, ByProducts};
use super::context::Context;
use super::dimensions::BounceDimensions;
use super::estimator::{
    PathEstimator, ScatteredPath, add_hit_emission, add_sky, sample_bsdf_and_roulette,
};
use super::light_sampling::{LightingVertex, sample_lights};
use super::observer::{PathObserver, PathRecorder};
use super::path::{Path, without_hemisphere_sampling};
use super::path_queue::PathState;
use super::scatterer::Scatterer;
use super::split::PathSplitting;
use super::transparency::Transparency;
use super::{CameraRays, Integrator, TracedIntegrator};
use crate::Tracer;
use crate::trace::{ScatterSample, Trace};

/// Volumetric path tracing: [`Path`] with scattering in media, and direct light there. [Kajiya &
/// Von Herzen 1984; Novák et al. 2018, "Monte Carlo methods for volumetric light transport
/// simulation", §5 and §7.1]
///
/// An interaction is one with a surface or with a medium. The phase function takes the place of the
/// BSDF. Where `straight_is_free` is set, undeflected transmission does not count as an
/// interaction, and is possible after the last one that counts. Estimators of direct light by
/// hemisphere sampling, which media do not support, are replaced by
/// [`DirectLight::Mis`](pt_core::settings::DirectLight::Mis).
pub(super) struct VolPath<'a, W = ()> {
    scene: &'a RenderScene,
    settings: Settings,
    estimator: Path,
    /// Maximum number of interactions.
    max_depth: u32,
    dimensions: BounceDimensions,
    paths: Vec<VolPathState>,
    events: Vec<PathEvent>,
    medium_step: MediumStep,
    shadow_rays: ShadowRays,
    transparency: Transparency,
    by_products: ByProducts<W>,
}

/// Active path.
#[derive(Clone, Copy)]
struct VolPathState {
    state: PathState,
    /// Ray whose interval is the part that is still to be traversed.
    ray: Ray,
    /// Cone of the ray, if some texture needs footprints.
    cone: Option<Cone>,
    /// Medium around the path.
    medium: Option<Id<MediumRecord>>,
    /// Number of interactions that do not count.
    free: u32,
    /// Random numbers for an unknown number of events until the path is scattered.
    stream: RngStream,
}

/// First pair of sampler dimensions for light samples; the pair before is for distances in media.
const FIRST_LIGHT_PAIR: u32 = 1;

/// Random streams of a bounce: that of the path itself, and those of its light samples.
fn stream(sampler: Sampler, bounces: u32, light_sample: Option<u32>) -> RngStream {
    sampler.stream([bounces, light_sample.map_or(0, |number| number.wrapping_add(1))])
}

impl<W: PathObserver> Integrator for VolPath<'_, W> {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    ) {
        let clamp = self.settings.clamp;
        let mut batch = self.by_products.begin(tracer, camera_rays, radiance, clamp);
        self.generate_camera_paths(camera_rays);
        for bounces in 0.. {
            self.sample_medium(bounces, &mut batch);
            self.add_emission_and_sky(bounces, &mut batch);
            if self.paths.is_empty() {
                break;
            }
            self.scatter_paths(bounces, &mut batch);
            self.shadow_rays.trace(&mut batch);
        }
        self.by_products.end(batch);
    }

    fn take_clamped(&mut self) -> ExactSum {
        self.by_products.take_clamped()
    }

    fn transparency(&self) -> Option<&[f32]> {
        self.transparency.values()
    }
}

impl TracedIntegrator for VolPath<'_, PathRecorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.by_products.take_traces()
    }
}

impl<'a, W: PathObserver> VolPath<'a, W> {
    pub(super) fn new(scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let settings = without_hemisphere_sampling(settings);
        let estimator = Path { max_depth: u32::MAX };
        let transparency = Transparency::new(scene, &settings);
        let cx = Context { scene, settings: &settings };
        let dimensions = BounceDimensions::with_media(&estimator, cx);
        let shadow_rays = ShadowRays::new(settings.straight_is_free);
        Self {
            scene,
            max_depth: estimator.max_depth(&settings),
            dimensions,
            settings,
            estimator,
            paths: Vec::new(),
            events: Vec::new(),
            medium_step: MediumStep::default(),
            shadow_rays,
            transparency,
            by_products: ByProducts::default(),
        }
    }

    fn generate_camera_paths(&mut self, camera_rays: &CameraRays) {
        self.paths.clear();
        let camera_transmittance = self.transparency.begin(camera_rays.samplers.len());
        let scene = self.scene;
        let cone = |start: u32, ray: &Ray| {
            let time = camera_rays.time(start as usize);
            scene.uses_footprints().then(|| scene.camera_cone(ray.direction, time))
        };
        let path = |(start, ray): (u32, Ray)| VolPathState {
            cone: cone(start, &ray),
            state: PathState::at_camera(scene, &ray, start, camera_transmittance),
            ray,
            medium: scene.media.camera,
            free: 0,
            stream: stream(camera_rays.samplers.get(start as usize), 0, None),
        };
        self.paths.extend((0..).zip(Rays::from(&camera_rays.rays).iter()).map(path));
    }

    /// Adds the emission found at the ends of paths; keeps those that are scattered.
    fn add_emission_and_sky(&mut self, bounces: u32, batch: &mut Batch<W>) {
        let Batch { camera_rays, accumulator, .. } = batch;
        let cx = Context { scene: self.scene, settings: &self.settings };
        let Self { estimator, paths, events, transparency, max_depth, .. } = self;
        let goes_on = cx.settings.straight_is_free;
        let mut going = 0;
        for i in 0..paths.len() {
            let VolPathState { state, ray, free, .. } = &paths[i];
            let counted = bounces - free;
            let (shown, last) = (cx.settings.shows(counted), counted >= *max_depth);
            let is_out = matches!(events[i], PathEvent::Escaped);
            let sees_sky = is_out && transparency.on_escape(state, PathSplitting::NONE);
            match &events[i] {
                PathEvent::Escaped if shown && sees_sky => {
                    add_sky(estimator, cx, state, ray.direction, bounces, accumulator);
                }
                PathEvent::Surface(hit) if shown => {
                    let time = camera_rays.time(state.start as usize);
                    add_hit_emission(estimator, cx, state, ray, hit, time, accumulator);
                }
                _ => {}
            }
            let is_scattered = match events[i] {
                PathEvent::Surface(_) => !last || goes_on,
                PathEvent::Scattered { .. } => !last,
                PathEvent::Escaped | PathEvent::Absorbed => false,
            };
            if is_scattered {
                (paths[going], events[going]) = (paths[i], events[i]);
                going += 1;
            }
        }
        paths.truncate(going);
        events.truncate(going);
    }

    /// Samples direct light and the next direction at each vertex; keeps the paths that continue.
    fn scatter_paths(&mut self, bounces: u32, batch: &mut Batch<W>) {
        batch.accumulator.set_bounces(bounces + 1);
        let mut live = 0;
        for i in 0..self.paths.len() {
            let (path, event) = (self.paths[i], self.events[i]);
            let counted = bounces - path.free;
            let start = path.state.start as usize;
            let sampler = batch.camera_rays.samplers.get(start);
            let time = batch.camera_rays.time(start);
            let choice = self.dimensions.material_choice(sampler, bounces);
            let mut material = None;
            let vertex = Vertex::new(self.scene, &path, &event, time, choice, &mut material);
            let Some(vertex) = vertex else { continue };
            // After the last interaction that counts, light may continue undeflected.
            let is_last = counted >= self.max_depth;
            if is_last && !vertex.is_straight() {
                continue;
            }
            let observer = &mut batch.accumulator.observer;
            observer.on_vertex(path.state.start, || vertex.recorded());
            if self.settings.shows(counted + 1) && !vertex.is_delta() {
                self.sample_lights(bounces, &vertex, sampler, observer);
                self.shadow_rays.trace_if_full(batch);
            }
            let observer = &mut batch.accumulator.observer;
            let next = self.sample_bsdf_and_roulette(bounces, &vertex, sampler, observer);
            if let Some(next) = next.filter(|next| !is_last || next.free > path.free) {
                self.paths[live] = next;
                live += 1;
            }
        }
        self.paths.truncate(live);
    }

    /// Queues the shadow rays of samples of each light.
    fn sample_lights(&mut self, bounces: u32, vertex: &Vertex, sampler: Sampler, observer: &mut W) {
        let Self { scene, settings, estimator, dimensions, shadow_rays, .. } = self;
        let (path, context, time) = (&vertex.path.state, vertex.context(), vertex.time);
        let lighting = LightingVertex { path, scatterer: vertex, context, time };
        let cx = Context { scene, settings };
        let pair = |number: u32| number.wrapping_add(FIRST_LIGHT_PAIR);
        let u = |number| dimensions.pair(sampler, bounces, pair(number));
        sample_lights(cx, estimator, &lighting, u, observer, |sample, value, number| {
            let stream = stream(sampler, bounces, Some(number));
            shadow_rays.push(vertex.shadow_ray(scene, sample, value, stream));
        });
    }

    /// Samples the direction in which a path continues, and Russian roulette; `None` if it ends.
    fn sample_bsdf_and_roulette(
        &self,
        bounces: u32,
        vertex: &Vertex,
        sampler: Sampler,
        observer: &mut W,
    ) -> Option<VolPathState> {
        let Self { scene, settings, estimator, dimensions, .. } = self;
        let pair = dimensions.light_pairs.wrapping_add(FIRST_LIGHT_PAIR);
        let numbers = dimensions.scattering(sampler, bounces, pair);
        let before = PathState { origin: vertex.context(), ..vertex.path.state };
        let next =
            sample_bsdf_and_roulette(estimator, settings, vertex, before, numbers, bounces + 1);
        let ScatteredPath { mut state, sample, survival } = next?;
        observer.on_scatter(state.start, || ScatterSample::new(&sample, survival));
        let is_free = settings.straight_is_free && vertex.lets_through(sample.wi);
        if is_free {
            // Light behind an undeflected, uncounted interaction may be found by the light samples
            // of the vertex before.
            state.origin = vertex.path.state.origin;
            state.bsdf_pdf = vertex.path.state.bsdf_pdf;
        }
        Some(VolPathState {
            free: vertex.path.free + u32::from(is_free),
            state,
            ray: vertex.point.spawn(sample.wi),
            cone: vertex.cone(scene, sample.pdf),
            medium: vertex.medium_towards(scene, sample.wi),
            stream: stream(sampler, bounces + 1, None),
        })
    }
}
