//! The path tracer for scenes with media.
//!
//! ```text
//! for each bounce:
//!     from surface to surface, through holes, until paths are scattered     travel
//!     light that they find; which paths go on                              arrive
//!     path by path: direct light, and the next direction                   scatter
//!     what gets through to the lights                                      shadows
//! ```
//!
//! As in `wavefront.rs`, paths share nothing but the memory they stand in.

mod shadow;
mod travel;
mod vertex;

use pt_core::film::ExactSum;
use pt_core::footprint::Cone;
use pt_core::id::Id;
use pt_core::light::{Light, LightSample, LightVisitor, Lit};
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_core::settings::{DirectLight, Settings};
use pt_math::sampler::{Sampler, Stream};
use pt_math::{Pdf, Ray, Rays, Spectrum};

use super::front::State;
use super::path::{Path, sampled_weight};
use super::rules::{Context, Found, Rules};
use super::sums::Sums;
use super::transparency::Transparency;
use super::wavefront::{escape, find};
use super::ways::Ways;
use super::witness::{self, Recorder, Witness};
use super::{CAMERA_DIMENSIONS, Integrator, Recording, Starts};
use crate::Tracer;
use crate::trace::{Departure, LightNumber, Trace};
use shadow::{Shadow, Shadows};
use travel::{Event, Travel};
use vertex::Vertex;

/// Volumetric path tracing: [`Path`], where paths are scattered by media as well, with direct light
/// there too. [Kajiya & Von Herzen 1984; Novák et al. 2018, "Monte Carlo methods for volumetric light
/// transport simulation", §5 and §7.1]
///
/// An interaction is one with a surface or with a medium. The phase function takes the place of the
/// BSDF. Where light goes straight on for free, such interactions are not counted, and follow the last one
/// that is. Estimators of direct light by hemispheres, which media do not have, are that of
/// [`DirectLight::Mis`].
pub(super) struct VolPath<'a, W = ()> {
    scene: &'a RenderScene,
    settings: Settings,
    rules: Path,
    /// Largest number of interactions.
    depth: u32,
    /// Which numbers of the sampler are for what.
    layout: Layout,
    /// Whether some materials choose.
    choose: bool,
    paths: Vec<Walker>,
    events: Vec<Event>,
    travel: Travel,
    shadows: Shadows,
    transparency: Transparency,
    /// See [`Integrator::take_removed`].
    removed: ExactSum,
    witness: W,
}

/// A path under way.
#[derive(Clone, Copy)]
struct Walker {
    state: State,
    /// Its interval is what the path has not been through yet.
    ray: Ray,
    /// That of the ray, if some texture asks for it.
    cone: Cone,
    /// What it is in.
    medium: Option<Id<MediumRecord>>,
    /// How many of its interactions are not counted.
    free: u32,
    /// Numbers for what happens an unknown number of times until it is scattered.
    stream: Stream,
}

/// Dimensions of the sampler per bounce: a pair for distances in media, one per light sample, one for
/// the direction, one for roulette and what the BSDF chooses, and one for materials.
#[derive(Clone, Copy)]
struct Layout {
    /// Pairs that direct light takes.
    light_pairs: u32,
}

impl Layout {
    const OTHERS: u32 = 4;

    /// The pair number `pair` of a bounce.
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

    /// Three numbers for the direction, and one for roulette.
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

/// Numbers of the streams of a bounce: that of the path itself, and those of its light samples.
fn stream(sampler: Sampler, bounces: u32, light_sample: Option<u32>) -> Stream {
    sampler.stream([bounces, light_sample.map_or(0, |number| number.wrapping_add(1))])
}

impl<W: Witness> Integrator for VolPath<'_, W> {
    fn radiance(&mut self, tracer: &mut Tracer, starts: &Starts, radiance: &mut Vec<Spectrum>) {
        self.begin(starts);
        radiance.clear();
        radiance.resize(starts.samplers.len(), Spectrum::ZERO);
        let mut removed = ExactSum::default();
        let mut witness = std::mem::take(&mut self.witness);
        witness.begins(starts);
        let mut sums = Sums::new(radiance, self.settings.clamp, &mut removed, witness);
        for bounces in 0.. {
            sums.scattered(bounces);
            self.travel(bounces, tracer, starts, &mut sums);
            self.arrive(bounces, starts, &mut sums);
            if self.paths.is_empty() {
                break;
            }
            self.scatter(bounces, tracer, starts, &mut sums);
            sums.scattered(bounces + 1);
            self.shadows.answer(tracer, starts, &mut sums);
        }
        self.witness = sums.witness;
        self.removed.merge(removed);
    }

    fn take_removed(&mut self) -> ExactSum {
        std::mem::take(&mut self.removed)
    }

    fn transparencies(&self) -> &[f32] {
        self.transparency.shares()
    }
}

impl Recording for VolPath<'_, Recorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.witness.take()
    }
}

impl<'a, W: Witness> VolPath<'a, W> {
    pub(super) fn new(scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let direct = match settings.direct {
            DirectLight::Light => DirectLight::Light,
            _ => DirectLight::Mis,
        };
        let settings = Settings { direct, ..settings.clone() };
        let rules = Path { depth: u32::MAX };
        let transparency = Transparency::new(scene, &settings);
        let moving = scene.moving_lights().iter().map(|moving| &moving.light);
        let lights = scene.lights.as_slice().iter().chain(moving);
        let samples = lights.map(|light| rules.light_samples(&settings, light));
        let light_pairs = samples.fold(0, u32::wrapping_add);
        let shadows = Shadows::new(settings.straight_is_free);
        Self {
            scene,
            depth: rules.depth(&settings),
            layout: Layout { light_pairs },
            choose: scene.materials.choose(),
            settings,
            rules,
            paths: Vec::new(),
            events: Vec::new(),
            travel: Travel::default(),
            shadows,
            transparency,
            removed: ExactSum::default(),
            witness: W::default(),
        }
    }

    fn context(&self) -> Context<'_> {
        Context { scene: self.scene, settings: &self.settings }
    }

    fn begin(&mut self, starts: &Starts) {
        self.paths.clear();
        let clear = self.transparency.begin(starts.samplers.len());
        let scene = self.scene;
        let uses_footprints = scene.uses_footprints();
        let cone = |start: u32, ray: &Ray| {
            if !uses_footprints {
                return Cone::default();
            }
            scene.camera_cone(ray.direction, starts.time(start as usize))
        };
        let path = |(start, ray): (u32, Ray)| Walker {
            cone: cone(start, &ray),
            state: State {
                beta: Spectrum::splat(scene.importance()),
                squeeze: 1.0,
                origin: Lit::in_space(ray.origin),
                arrival: None,
                clear,
                start,
                target: start,
            },
            ray,
            medium: scene.media.camera,
            free: 0,
            stream: stream(starts.samplers.get(start as usize), 0, None),
        };
        self.paths.extend((0..).zip(Rays::from(&starts.rays).iter()).map(path));
    }

    /// Adds the light that paths find where they end; leaves those that are scattered.
    fn arrive(&mut self, bounces: u32, starts: &Starts, sums: &mut Sums<W>) {
        let cx = Context { scene: self.scene, settings: &self.settings };
        let Self { rules, paths, events, scene, transparency, depth, .. } = self;
        let goes_on = cx.settings.straight_is_free;
        let mut going = 0;
        for i in 0..paths.len() {
            let Walker { state, ray, free, .. } = &paths[i];
            let counted = bounces - free;
            let (shown, last) = (cx.settings.shows(counted), counted >= *depth);
            let is_out = matches!(events[i], Event::Escaped);
            let sees_sky = is_out && transparency.leaves(state, Ways::ONE);
            match &events[i] {
                Event::Escaped if shown && sees_sky => {
                    escape(rules, cx, state, (ray.direction, bounces), sums);
                }
                Event::Surface(hit) if shown && scene.glows(hit) => {
                    let time = starts.time(state.start as usize);
                    let at = &scene.interaction(ray, hit, time);
                    find(rules, cx, state, Found { at, hit, time }, sums);
                }
                _ => {}
            }
            let is_scattered = match events[i] {
                Event::Surface(_) => !last || goes_on,
                Event::Scattered { .. } => !last,
                Event::Escaped | Event::Absorbed => false,
            };
            if is_scattered {
                (paths[going], events[going]) = (paths[i], events[i]);
                going += 1;
            }
        }
        paths.truncate(going);
        events.truncate(going);
    }

    /// Asks for the direct light at each place where a path is scattered, and sends the paths that live
    /// on their way.
    fn scatter(&mut self, bounces: u32, tracer: &mut Tracer, starts: &Starts, sums: &mut Sums<W>) {
        let scene = self.scene;
        let mut living = 0;
        for i in 0..self.paths.len() {
            let (path, event) = (self.paths[i], self.events[i]);
            let counted = bounces - path.free;
            let lit = self.settings.shows(counted + 1);
            let sampler = starts.samplers.get(path.state.start as usize);
            let choice = if self.choose { self.layout.material(sampler, bounces) } else { 0.0 };
            let mut resolved = None;
            let time = starts.time(path.state.start as usize);
            let vertex = Vertex::new(scene, &path, &event, time, choice, &mut resolved);
            let Some(vertex) = vertex else { continue };
            // After the last interaction that is counted, light may go straight on.
            let last = counted >= self.depth;
            if last && !vertex.is_straight() {
                continue;
            }
            sums.witness.comes(path.state.start, || vertex.told(path.state.beta));
            if lit && !vertex.is_delta() {
                self.ask(&vertex, &path, (sampler, bounces), time, &mut sums.witness);
                sums.scattered(bounces + 1);
                self.shadows.answer_many(tracer, starts, sums);
            }
            let next = self.next(&vertex, &path, sampler, bounces + 1, &mut sums.witness);
            if let Some(next) = next.filter(|next| !last || next.free > path.free) {
                self.paths[living] = next;
                living += 1;
            }
        }
        self.paths.truncate(living);
    }

    /// Asks for samples of each light.
    fn ask(
        &mut self,
        vertex: &Vertex,
        path: &Walker,
        (sampler, bounces): (Sampler, u32),
        time: f32,
        witness: &mut W,
    ) {
        let mut number = 0;
        for (light_number, light) in self.scene.lights.as_slice().iter().enumerate() {
            let n = self.rules.light_samples(&self.settings, light);
            for _ in 0..n {
                let u = self.layout.light(sampler, bounces, number);
                let stream = stream(sampler, bounces, Some(number));
                let light_number = LightNumber::Still(light_number);
                let asking = LightSampling {
                    integrator: self,
                    vertex,
                    path,
                    light_number,
                    u,
                    n,
                    stream,
                    witness,
                };
                if let Some(shadow) = light.visit(asking) {
                    self.shadows.push(shadow);
                }
                number = number.wrapping_add(1);
            }
        }
        for (light_number, light) in self.scene.moving_lights().iter().enumerate() {
            let n = self.rules.light_samples(&self.settings, &light.light);
            for _ in 0..n {
                let u = self.layout.light(sampler, bounces, number);
                let stream = stream(sampler, bounces, Some(number));
                let light_number = LightNumber::Moving(light_number);
                let asking = LightSampling {
                    integrator: self,
                    vertex,
                    path,
                    light_number,
                    u,
                    n,
                    stream,
                    witness,
                };
                let sample = self.scene.sample_moving(light, time, vertex.point().p, u);
                if let Some(shadow) =
                    sample.and_then(|sample| asking.shadow(&sample, light.light.is_hidden()))
                {
                    self.shadows.push(shadow);
                }
                number = number.wrapping_add(1);
            }
        }
    }

    /// The path behind interaction number `bounces`, if it goes on.
    fn next(
        &self,
        vertex: &Vertex,
        path: &Walker,
        sampler: Sampler,
        bounces: u32,
        witness: &mut W,
    ) -> Option<Walker> {
        let (u, roulette) = self.layout.direction(sampler, bounces - 1);
        let scattered = vertex.sample(u)?;
        let is_free = self.settings.straight_is_free && vertex.goes_straight(scattered.wi);
        // What goes straight on for free may be found by the light samples of the place before.
        let (origin, arrival) = if is_free {
            (path.state.origin, path.state.arrival)
        } else {
            (vertex.lit(), scattered.pdf)
        };
        let mut state = State {
            beta: path.state.beta * scattered.weight,
            squeeze: path.state.squeeze * scattered.squeeze,
            origin,
            arrival,
            clear: vertex.clear_behind(path.state.clear, scattered.wi),
            ..path.state
        };
        if state.beta.is_black() {
            return None;
        }
        let survival = if vertex.is_in_medium() {
            Path::survival_in_medium(&self.settings, &state, bounces)
        } else {
            self.rules.survival(&self.settings, &state, bounces)
        };
        if let Some(q) = survival {
            if roulette >= q {
                return None;
            }
            state.beta *= 1.0 / q;
            state.clear *= 1.0 / q;
        }
        witness.leaves(state.start, || Departure::new(&scattered, survival));
        Some(Walker {
            free: path.free + u32::from(is_free),
            state,
            ray: vertex.point().spawn(scattered.wi),
            cone: vertex.cone(self.scene, path.cone, scattered.pdf),
            medium: vertex.medium_towards(self.scene, scattered.wi),
            stream: stream(sampler, bounces, None),
        })
    }
}

/// One of `n` samples of a light: the ray that asks whether it gets through, with what it brings.
struct LightSampling<'s, 'a, W> {
    integrator: &'s VolPath<'a, W>,
    vertex: &'s Vertex<'s>,
    path: &'s Walker,
    light_number: LightNumber,
    u: [f32; 2],
    n: u32,
    stream: Stream,
    witness: &'s mut W,
}

impl<W: Witness> LightVisitor for LightSampling<'_, '_, W> {
    type Output = Option<Shadow>;

    fn visit<L: Light>(self, light: &L) -> Self::Output {
        let tables = &self.integrator.scene.light_tables;
        let sample = light.sample(tables, &self.vertex.lit(), self.u)?;
        self.shadow(&sample, L::HIDDEN)
    }
}

impl<W: Witness> LightSampling<'_, '_, W> {
    /// The ray of a sample; `None` if it brings nothing. That of a light that is hidden, which rays do not find, brings all
    /// of it.
    fn shadow(self, sample: &LightSample, is_hidden: bool) -> Option<Shadow> {
        let Self { integrator, vertex, path, light_number, u, n, stream, witness } = self;
        let Context { scene, settings } = integrator.context();
        let point = vertex.point();
        let weight =
            if is_hidden { 1.0 } else { sampled_weight(settings, sample, n, |wi| vertex.pdf(wi)) };
        let p = sample.pdf.map_or(1.0, Pdf::get) * n as f32;
        let f = vertex.eval(sample.wi);
        let value = path.state.beta * f * sample.radiance * (weight / p);
        if value.is_black() {
            return None;
        }
        // The ray ends a little before the light, up to which the medium is.
        let end = if sample.end.is_some() { 1.0 } else { f32::INFINITY };
        let medium = vertex.medium_towards(scene, sample.wi);
        let (ray, start) = (point.spawn_to(sample), path.state.start);
        witness.asks(start, || {
            witness::light(scene, light_number, (&vertex.lit(), u), sample, (weight, n))
        });
        Some(Shadow { ray, end, value, medium, stream, start })
    }
}
