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
use pt_core::light::{Light, LightSample, LightVisitor};
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::{RngStream, Sampler};
use pt_math::{Pdf, Ray, Rays, Spectrum};
use shadow_ray::{ShadowRay, ShadowRays};
use vertex::Vertex;

use super::accumulator::RadianceAccumulator;
use super::context::{Context, SurfaceHit};
use super::estimator::{PathEstimator, add_emission, add_sky};
use super::observer::{self, PathObserver, PathRecorder};
use super::path::{Path, light_mis_weight, without_hemisphere_sampling};
use super::path_queue::PathState;
use super::split::PathSplitting;
use super::transparency::Transparency;
use super::{CAMERA_DIMENSIONS, CameraRays, Integrator, TracedIntegrator};
use crate::Tracer;
use crate::trace::{LightRef, ScatterSample, Trace};

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
    /// Assignment of sampler dimensions.
    layout: Layout,
    /// True if some materials are stochastic.
    stochastic_materials: bool,
    paths: Vec<VolPathState>,
    events: Vec<PathEvent>,
    medium_step: MediumStep,
    shadow_rays: ShadowRays,
    transparency: Transparency,
    /// See [`Integrator::take_clamped`].
    clamped: ExactSum,
    observer: W,
}

/// Active path.
#[derive(Clone, Copy)]
struct VolPathState {
    state: PathState,
    /// Ray whose interval is the part that is still to be traversed.
    ray: Ray,
    /// Cone of the ray, if some texture needs footprints.
    cone: Cone,
    /// Medium around the path.
    medium: Option<Id<MediumRecord>>,
    /// Number of interactions that do not count.
    free: u32,
    /// Random numbers for an unknown number of events until the path is scattered.
    stream: RngStream,
}

/// Sampler dimensions per bounce: a pair for distances in media, one per light sample, one for the
/// direction, one for Russian roulette and the choice of a BSDF component, and one for materials.
#[derive(Clone, Copy)]
struct Layout {
    /// Number of pairs for direct light.
    light_pairs: u32,
}

impl Layout {
    const OTHERS: u32 = 4;

    /// Returns pair number `pair` of a bounce.
    fn pair(self, sampler: Sampler, bounces: u32, pair: u32) -> [f32; 2] {
        let pairs = self.light_pairs.wrapping_add(Self::OTHERS);
        let pair = bounces.wrapping_mul(pairs).wrapping_add(pair);
        let dimension = pair.wrapping_mul(2).wrapping_add(CAMERA_DIMENSIONS);
        sampler.at_dimension(dimension).next_2d()
    }

    fn distance(self, sampler: Sampler, bounces: u32) -> [f32; 2] {
        self.pair(sampler, bounces, 0)
    }

    fn light(self, sampler: Sampler, bounces: u32, number: u32) -> [f32; 2] {
        self.pair(sampler, bounces, number.wrapping_add(1))
    }

    /// Returns three numbers for the direction, and one for Russian roulette.
    fn direction(self, sampler: Sampler, bounces: u32) -> ([f32; 3], f32) {
        let first = self.light_pairs.wrapping_add(1);
        let [x, y] = self.pair(sampler, bounces, first);
        let [roulette, choice] = self.pair(sampler, bounces, first.wrapping_add(1));
        ([x, y, choice], roulette)
    }

    fn material(self, sampler: Sampler, bounces: u32) -> f32 {
        self.pair(sampler, bounces, self.light_pairs.wrapping_add(3))[0]
    }
}

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
        self.generate_camera_paths(camera_rays);
        radiance.clear();
        radiance.resize(camera_rays.samplers.len(), Spectrum::ZERO);
        let mut clamped = ExactSum::default();
        let mut observer = std::mem::take(&mut self.observer);
        observer.on_batch(camera_rays);
        let mut accumulator =
            RadianceAccumulator::new(radiance, self.settings.clamp, &mut clamped, observer);
        for bounces in 0.. {
            accumulator.set_bounces(bounces);
            self.sample_medium(bounces, tracer, camera_rays, &mut accumulator);
            self.add_emission_and_sky(bounces, camera_rays, &mut accumulator);
            if self.paths.is_empty() {
                break;
            }
            self.scatter_paths(bounces, tracer, camera_rays, &mut accumulator);
            accumulator.set_bounces(bounces + 1);
            self.shadow_rays.trace(tracer, camera_rays, &mut accumulator);
        }
        self.observer = accumulator.observer;
        self.clamped.merge(clamped);
    }

    fn take_clamped(&mut self) -> ExactSum {
        std::mem::take(&mut self.clamped)
    }

    fn transparency(&self) -> &[f32] {
        self.transparency.values()
    }
}

impl TracedIntegrator for VolPath<'_, PathRecorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.observer.take()
    }
}

impl<'a, W: PathObserver> VolPath<'a, W> {
    pub(super) fn new(scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let settings = without_hemisphere_sampling(settings);
        let estimator = Path { max_depth: u32::MAX };
        let transparency = Transparency::new(scene, &settings);
        let moving = scene.animated_lights().iter().map(|moving| &moving.light);
        let lights = scene.lights.as_slice().iter().chain(moving);
        let samples = lights.map(|light| estimator.light_samples(&settings, light));
        let light_pairs = samples.fold(0, u32::wrapping_add);
        let shadow_rays = ShadowRays::new(settings.straight_is_free);
        Self {
            scene,
            max_depth: estimator.max_depth(&settings),
            layout: Layout { light_pairs },
            stochastic_materials: scene.materials.is_stochastic(),
            settings,
            estimator,
            paths: Vec::new(),
            events: Vec::new(),
            medium_step: MediumStep::default(),
            shadow_rays,
            transparency,
            clamped: ExactSum::default(),
            observer: W::default(),
        }
    }

    fn context(&self) -> Context<'_> {
        Context { scene: self.scene, settings: &self.settings }
    }

    fn generate_camera_paths(&mut self, camera_rays: &CameraRays) {
        self.paths.clear();
        let camera_transmittance = self.transparency.begin(camera_rays.samplers.len());
        let scene = self.scene;
        let uses_footprints = scene.uses_footprints();
        let cone = |start: u32, ray: &Ray| {
            if !uses_footprints {
                return Cone::default();
            }
            scene.camera_cone(ray.direction, camera_rays.time(start as usize))
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
    fn add_emission_and_sky(
        &mut self,
        bounces: u32,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let cx = Context { scene: self.scene, settings: &self.settings };
        let Self { estimator, paths, events, scene, transparency, max_depth: depth, .. } = self;
        let goes_on = cx.settings.straight_is_free;
        let mut going = 0;
        for i in 0..paths.len() {
            let VolPathState { state, ray, free, .. } = &paths[i];
            let counted = bounces - free;
            let (shown, last) = (cx.settings.shows(counted), counted >= *depth);
            let is_out = matches!(events[i], PathEvent::Escaped);
            let sees_sky = is_out && transparency.on_escape(state, PathSplitting::NONE);
            match &events[i] {
                PathEvent::Escaped if shown && sees_sky => {
                    add_sky(estimator, cx, state, (ray.direction, bounces), accumulator);
                }
                PathEvent::Surface(hit) if shown && scene.is_emissive(hit) => {
                    let time = camera_rays.time(state.start as usize);
                    let at = &scene.interaction(ray, hit, time);
                    add_emission(estimator, cx, state, SurfaceHit { at, hit, time }, accumulator);
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

    /// Samples direct light at each vertex, and continues the surviving paths.
    fn scatter_paths(
        &mut self,
        bounces: u32,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<W>,
    ) {
        let scene = self.scene;
        let mut live = 0;
        for i in 0..self.paths.len() {
            let (path, event) = (self.paths[i], self.events[i]);
            let counted = bounces - path.free;
            let context = self.settings.shows(counted + 1);
            let sampler = camera_rays.samplers.get(path.state.start as usize);
            let choice = if self.stochastic_materials {
                self.layout.material(sampler, bounces)
            } else {
                0.0
            };
            let mut materials = None;
            let time = camera_rays.time(path.state.start as usize);
            let vertex = Vertex::new(scene, &path, &event, time, choice, &mut materials);
            let Some(vertex) = vertex else { continue };
            // After the last interaction that counts, light may continue undeflected.
            let last = counted >= self.max_depth;
            if last && !vertex.is_straight() {
                continue;
            }
            accumulator.observer.on_vertex(path.state.start, || vertex.recorded(path.state.beta));
            if context && !vertex.is_delta() {
                self.sample_lights(
                    &vertex,
                    &path,
                    (sampler, bounces),
                    time,
                    &mut accumulator.observer,
                );
                accumulator.set_bounces(bounces + 1);
                self.shadow_rays.trace_if_full(tracer, camera_rays, accumulator);
            }
            let next = self.sample_direction(
                &vertex,
                &path,
                sampler,
                bounces + 1,
                &mut accumulator.observer,
            );
            if let Some(next) = next.filter(|next| !last || next.free > path.free) {
                self.paths[live] = next;
                live += 1;
            }
        }
        self.paths.truncate(live);
    }

    /// Queues the shadow rays of samples of each light.
    fn sample_lights(
        &mut self,
        vertex: &Vertex,
        path: &VolPathState,
        (sampler, bounces): (Sampler, u32),
        time: f32,
        observer: &mut W,
    ) {
        let mut number = 0;
        for (light_number, light) in self.scene.lights.as_slice().iter().enumerate() {
            let n = self.estimator.light_samples(&self.settings, light);
            for _ in 0..n {
                let u = self.layout.light(sampler, bounces, number);
                let stream = stream(sampler, bounces, Some(number));
                let light_number = LightRef::Static(light_number);
                let shading_block = LightSampling {
                    integrator: self,
                    vertex,
                    path,
                    light_number,
                    u,
                    n,
                    stream,
                    observer,
                };
                if let Some(shadow) = light.visit(shading_block) {
                    self.shadow_rays.push(shadow);
                }
                number = number.wrapping_add(1);
            }
        }
        for (light_number, light) in self.scene.animated_lights().iter().enumerate() {
            let n = self.estimator.light_samples(&self.settings, &light.light);
            for _ in 0..n {
                let u = self.layout.light(sampler, bounces, number);
                let stream = stream(sampler, bounces, Some(number));
                let light_number = LightRef::Animated(light_number);
                let shading_block = LightSampling {
                    integrator: self,
                    vertex,
                    path,
                    light_number,
                    u,
                    n,
                    stream,
                    observer,
                };
                let sample = self.scene.sample_animated_light(light, time, vertex.point().p, u);
                if let Some(shadow) = sample
                    .and_then(|sample| shading_block.shadow(&sample, light.light.is_invisible()))
                {
                    self.shadow_rays.push(shadow);
                }
                number = number.wrapping_add(1);
            }
        }
    }

    /// Samples the direction of the path after interaction number `bounces`; `None` if it ends.
    fn sample_direction(
        &self,
        vertex: &Vertex,
        path: &VolPathState,
        sampler: Sampler,
        bounces: u32,
        observer: &mut W,
    ) -> Option<VolPathState> {
        let (u, roulette) = self.layout.direction(sampler, bounces - 1);
        let scattered = vertex.sample(u)?;
        let is_free = self.settings.straight_is_free && vertex.goes_straight(scattered.wi);
        // Light behind an undeflected, uncounted interaction may be found by the light samples of
        // the vertex before.
        let (origin, bsdf_pdf) = if is_free {
            (path.state.origin, path.state.bsdf_pdf)
        } else {
            (vertex.context(), scattered.pdf)
        };
        let mut state = PathState {
            beta: path.state.beta * scattered.weight,
            eta_scale: path.state.eta_scale * scattered.eta_scale,
            origin,
            bsdf_pdf,
            camera_transmittance: vertex
                .clear_behind(path.state.camera_transmittance, scattered.wi),
            ..path.state
        };
        if state.beta.is_black() {
            return None;
        }
        let survival = if vertex.is_in_medium() {
            Path::rr_survival_in_medium(&self.settings, &state, bounces)
        } else {
            self.estimator.rr_survival_probability(&self.settings, &state, bounces)
        };
        if let Some(q) = survival {
            if roulette >= q {
                return None;
            }
            state.beta *= 1.0 / q;
            state.camera_transmittance *= 1.0 / q;
        }
        observer.on_scatter(state.start, || ScatterSample::new(&scattered, survival));
        Some(VolPathState {
            free: path.free + u32::from(is_free),
            state,
            ray: vertex.point().spawn(scattered.wi),
            cone: vertex.cone(self.scene, path.cone, scattered.pdf),
            medium: vertex.medium_towards(self.scene, scattered.wi),
            stream: stream(sampler, bounces, None),
        })
    }
}

/// One of `n` samples of a light: its shadow ray and contribution.
struct LightSampling<'s, 'a, W> {
    integrator: &'s VolPath<'a, W>,
    vertex: &'s Vertex<'s>,
    path: &'s VolPathState,
    light_number: LightRef,
    u: [f32; 2],
    n: u32,
    stream: RngStream,
    observer: &'s mut W,
}

impl<W: PathObserver> LightVisitor for LightSampling<'_, '_, W> {
    type Output = Option<ShadowRay>;

    fn visit<L: Light>(self, light: &L) -> Self::Output {
        let tables = &self.integrator.scene.light_tables;
        let sample = light.sample(tables, &self.vertex.context(), self.u)?;
        self.shadow(&sample, L::INVISIBLE)
    }
}

impl<W: PathObserver> LightSampling<'_, '_, W> {
    /// Shadow ray of a sample; `None` if its contribution is zero. Samples of invisible lights,
    /// which rays do not find, have MIS weight 1.
    fn shadow(self, sample: &LightSample, is_invisible: bool) -> Option<ShadowRay> {
        let Self { integrator, vertex, path, light_number, u, n, stream, observer } = self;
        let Context { scene, settings } = integrator.context();
        let point = vertex.point();
        let weight = if is_invisible {
            1.0
        } else {
            light_mis_weight(settings, sample, n, |wi| vertex.pdf(wi))
        };
        let p = sample.pdf.map_or(1.0, Pdf::get) * n as f32;
        let f = vertex.eval(sample.wi);
        let value = path.state.beta * f * sample.radiance * (weight / p);
        if value.is_black() {
            return None;
        }
        // The ray ends slightly before the light, but the medium extends to the light.
        let end = if sample.end.is_some() { 1.0 } else { f32::INFINITY };
        let medium = vertex.medium_towards(scene, sample.wi);
        let (ray, start) = (point.spawn_to(sample), path.state.start);
        observer.on_light_sample(start, || {
            observer::light_source(scene, light_number, (&vertex.context(), u), sample, (weight, n))
        });
        Some(ShadowRay { ray, end, value, medium, stream, start })
    }
}
