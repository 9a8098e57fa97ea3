//! Paths that advance together, bounce by bounce, so that rays are asked for many at a time.
//!
//! ```text
//! for each bounce:
//!     nearest hits of all rays           one batch
//!     emission and sky                   arrive
//!     direct light: shadow rays;
//!     BSDF sample, roulette: next rays   scatter
//!     what the shadow rays bring         one batch, answer
//! ```
//!
//! Paths share nothing but the memory they stand in, and all sums of a path are in the order of
//! its bounces and of its light samples. So its radiance does not depend on the other paths.

use pt_bvh::Hit;
use pt_core::bsdf::Bsdf;
use pt_core::light::{AnyLight, LightSample};
use pt_core::scene::{Interaction, RenderScene};
use pt_core::settings::Settings;
use pt_math::sampler::{LANES, Lanes, Samplers};
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3};

use super::direct::{Hemisphere, Requests, light_samples};
use super::{CAMERA_DIMENSIONS, Integrator, Start};
use crate::Tracer;

/// What is rendered, and how.
#[derive(Clone, Copy)]
pub(super) struct Context<'a> {
    pub(super) scene: &'a RenderScene,
    pub(super) settings: &'a Settings,
}

/// How a ray came to its direction: the density, if light sampling could have found it too.
pub(super) type Arrival = Option<Pdf<SolidAngle>>;

/// A path that is under way, apart from its ray.
#[derive(Clone, Copy)]
pub(super) struct State {
    /// Throughput: the product of the weights so far.
    pub(super) beta: Spectrum,
    /// The product of [`pt_core::bsdf::BsdfSample::squeeze`].
    pub(super) squeeze: f32,
    /// The surface point, or the point of the lens, that the ray left.
    pub(super) origin: Vec3,
    /// How it got its direction there.
    pub(super) arrival: Arrival,
    /// Which start it is of.
    start: u32,
}

/// What distinguishes one path tracer from another.
pub(super) trait Rules {
    /// Largest number of surface interactions.
    fn depth(&self, settings: &Settings) -> u32;

    /// Weighted radiance of the sky towards a ray that left the scene in direction `d`.
    fn sky(&self, cx: Context, path: &State, d: Vec3, bounces: u32) -> Spectrum;

    /// Weighted radiance that a surface emits towards the ray that found it.
    fn emitted(&self, cx: Context, path: &State, at: &Interaction) -> Spectrum;

    /// Whether direct light of this light is found by sampling it.
    fn samples_light(&self, settings: &Settings, light: &AnyLight) -> bool;

    /// Weight of one of `n` samples of a light.
    fn light_weight(&self, settings: &Settings, bsdf: &Bsdf, sample: &LightSample, n: u32) -> f32;

    /// How direct light is looked for in random directions, if it is.
    fn hemisphere(&self, cx: Context) -> Option<Hemisphere>;

    /// Whether light that a ray finds can count, by how the ray came to its direction.
    fn finds(&self, settings: &Settings, arrival: Arrival) -> bool;

    /// Russian roulette: the probability with which a path goes on after `bounces` interactions,
    /// or `None` if it does in any case.
    fn survival(&self, settings: &Settings, path: &State, bounces: u32) -> Option<f32>;
}

/// What does not change from bounce to bounce.
#[derive(Clone, Copy)]
struct Plan<'a> {
    cx: Context<'a>,
    /// Largest number of surface interactions.
    depth: u32,
    /// Dimensions of the sampler per bounce.
    dimensions: u32,
    /// Pairs of them that direct light takes.
    light_pairs: u32,
    hemisphere: Option<Hemisphere>,
}

impl<'a> Plan<'a> {
    fn new(rules: &impl Rules, cx: Context<'a>) -> Self {
        let (lights, settings) = (cx.scene.lights.as_slice(), cx.settings);
        let extended = lights.iter().filter(|l| !l.is_delta()).count() as u32;
        let delta = lights.len() as u32 - extended;
        let hemisphere = rules.hemisphere(cx);
        let sampled = lights.iter().filter(|light| rules.samples_light(settings, light));
        let of_lights: u32 = sampled.map(|light| light_samples(light, settings)).sum();
        Self {
            cx,
            depth: rules.depth(settings),
            // A pair per light sample, a pair for the BSDF, and one for roulette.
            dimensions: 2 * (delta + extended.max(1) * settings.light_samples) + 4,
            light_pairs: of_lights + hemisphere.map_or(0, |h| h.samples),
            hemisphere,
        }
    }
}

/// The numbers of one path at one bounce, pair after pair.
pub(super) struct Draws<'a> {
    pairs: &'a [[Lanes<f32>; 2]],
    lane: usize,
}

impl Draws<'_> {
    /// A point in [0, 1)².
    #[inline(always)]
    pub(super) fn next_2d(&mut self) -> [f32; 2] {
        let [x, y] = &self.pairs[0];
        self.pairs = &self.pairs[1..];
        [x[self.lane % LANES], y[self.lane % LANES]]
    }

    /// A number in [0, 1).
    #[inline(always)]
    fn next_1d(&mut self) -> f32 {
        self.next_2d()[0]
    }
}

/// The driver of all path tracers.
pub(super) struct Wavefront<R> {
    rules: R,
    /// Paths under way and their rays, in the order of their starts.
    paths: Vec<State>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
    /// Which of the paths have come to a surface where they scatter.
    scattering: Vec<u32>,
    /// The numbers of a block of paths at a bounce.
    pairs: Vec<[Lanes<f32>; 2]>,
    requests: Requests,
}

impl<R: Rules> Integrator for Wavefront<R> {
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        settings: &Settings,
        starts: &[Start],
        radiance: &mut Vec<Spectrum>,
    ) {
        let plan = Plan::new(&self.rules, Context { scene: tracer.scene, settings });
        self.begin(starts);
        radiance.clear();
        radiance.resize(starts.len(), Spectrum::ZERO);
        for bounces in 0.. {
            tracer.intersect(&self.rays, &mut self.hits);
            self.arrive(plan, bounces, radiance);
            if self.scattering.is_empty() {
                break;
            }
            self.scatter(tracer, plan, bounces, starts, radiance);
            self.requests.answer(tracer, plan.hemisphere, radiance);
        }
    }
}

impl<R: Rules> Wavefront<R> {
    pub(super) fn new(rules: R) -> Self {
        Self {
            rules,
            paths: Vec::new(),
            rays: Vec::new(),
            hits: Vec::new(),
            scattering: Vec::new(),
            pairs: Vec::new(),
            requests: Requests::default(),
        }
    }

    fn begin(&mut self, starts: &[Start]) {
        self.rays.clear();
        self.rays.extend(starts.iter().map(|s| s.ray));
        self.paths.clear();
        self.paths.extend(starts.iter().zip(0..).map(|(s, start)| State {
            beta: Spectrum::ONE,
            squeeze: 1.0,
            origin: s.ray.origin,
            arrival: None,
            start,
        }));
    }

    /// Adds the light that rays have found, and says which paths scatter.
    fn arrive(&mut self, plan: Plan, bounces: u32, radiance: &mut [Spectrum]) {
        let cx = plan.cx;
        let shown = cx.settings.shows(bounces);
        self.scattering.clear();
        for (i, hit) in self.hits.iter().enumerate() {
            let (path, ray) = (&self.paths[i], &self.rays[i]);
            let Some(hit) = hit else {
                if shown {
                    let l = self.rules.sky(cx, path, ray.direction, bounces);
                    radiance[path.start as usize] += path.beta * l;
                }
                continue;
            };
            if shown && cx.scene.glows(hit) {
                let l = self.rules.emitted(cx, path, &cx.scene.interaction(ray, hit));
                radiance[path.start as usize] += path.beta * l;
            }
            if bounces < plan.depth {
                self.scattering.push(i as u32);
            }
        }
    }

    /// Asks for the direct light at each surface, and sends the paths that live on their way.
    fn scatter(
        &mut self,
        tracer: &mut Tracer,
        plan: Plan,
        bounces: u32,
        starts: &[Start],
        radiance: &mut [Spectrum],
    ) {
        let cx = plan.cx;
        let lit = cx.settings.shows(bounces + 1);
        let dimension = CAMERA_DIMENSIONS + bounces * plan.dimensions;
        let pairs = 2 + if lit { plan.light_pairs } else { 0 };
        let mut living = 0;
        for block in self.scattering.chunks(LANES) {
            let start = |&i: &u32| starts[self.paths[i as usize].start as usize].sampler;
            let samplers = Samplers::new(block.iter().map(start));
            self.pairs.clear();
            self.pairs.extend((0..pairs).map(|pair| samplers.points(dimension + 2 * pair)));
            for (lane, &i) in block.iter().enumerate() {
                let i = i as usize;
                let Some(hit) = &self.hits[i] else { continue };
                let mut path = self.paths[i];
                let at = cx.scene.interaction(&self.rays[i], hit);
                let bsdf = cx.scene.bsdf(&at);
                let surface = (&at, &bsdf);
                let mut draws = Draws { pairs: &self.pairs, lane };
                if lit && !bsdf.is_delta() {
                    let load = (path.beta, path.start);
                    self.requests.lights(&self.rules, cx, surface, &mut draws, load);
                    if let Some(hemisphere) = plan.hemisphere {
                        self.requests.probes(hemisphere, surface, &mut draws, load);
                    }
                }
                let next = next(&self.rules, plan, bounces + 1, surface, &mut draws, &mut path);
                if let Some(ray) = next {
                    self.paths[living] = path;
                    self.rays[living] = ray;
                    living += 1;
                }
            }
            if self.requests.are_many() {
                self.requests.answer(tracer, plan.hemisphere, radiance);
            }
        }
        self.paths.truncate(living);
        self.rays.truncate(living);
    }
}

/// The ray on which a path goes on after its interaction number `bounces`, if it does.
#[inline(always)]
fn next(
    rules: &impl Rules,
    plan: Plan,
    bounces: u32,
    (at, bsdf): (&Interaction, &Bsdf),
    draws: &mut Draws,
    path: &mut State,
) -> Option<Ray> {
    let settings = plan.cx.settings;
    let scattered = bsdf.sample(draws.next_2d())?;
    path.beta *= scattered.weight;
    path.squeeze *= scattered.squeeze;
    path.arrival = scattered.pdf;
    path.origin = at.p;
    let finds_nothing = bounces >= plan.depth && !rules.finds(settings, path.arrival);
    if path.beta.is_black() || finds_nothing {
        return None;
    }
    if let Some(q) = rules.survival(settings, path, bounces) {
        if draws.next_1d() >= q {
            return None;
        }
        path.beta *= 1.0 / q;
    }
    Some(at.spawn(scattered.wi))
}
