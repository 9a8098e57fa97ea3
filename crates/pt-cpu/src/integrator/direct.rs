//! Direct light at surface points: rays that ask whether it arrives, and what it brings.

use pt_bvh::Hit;
use pt_core::light::{Light, LightSample, LightVisitor};
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::Lanes;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3, warp};

use super::reuse::{Gift, Reuse};
use super::rules::Rules;
use super::sums::Sums;
use super::wavefront::{Numbers, Surface};
use super::witness::{self, Witness};
use super::{Starts, holes};
use crate::Tracer;
use crate::trace::{LightNumber, Source};

/// How light is looked for in random directions of the hemisphere.
#[derive(Clone, Copy)]
pub(super) struct Hemisphere {
    /// Directions per surface point.
    pub(super) samples: u32,
    /// Whether their density is that of the cosine; else it is uniform.
    pub(super) cosine: bool,
    /// Whether light of the sky counts.
    pub(super) sky: bool,
}

impl Hemisphere {
    /// A direction in the frame of the surface, and its density.
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

/// Rays and what each brings.
#[derive(Default)]
struct Queue {
    rays: Vec<Ray>,
    /// What a ray brings, and to which of the sums; where something moves, that is its start.
    loads: Vec<(Spectrum, u32)>,
}

impl Queue {
    #[inline(always)]
    fn push(&mut self, ray: Ray, value: Spectrum, start: u32) {
        self.rays.push(ray);
        self.loads.push((value, start));
    }

    fn clear(&mut self) {
        self.rays.clear();
        self.loads.clear();
    }
}

/// A block of surfaces that ask for their direct light.
pub(super) struct Asking<'a, R> {
    pub(super) rules: &'a R,
    pub(super) settings: &'a Settings,
    pub(super) surfaces: &'a [Surface<'a>],
    pub(super) numbers: &'a Numbers,
}

/// What surface points want to know. A path asks for lights first and for its hemisphere then, and
/// is answered in this order, wherever in between answers are given.
pub(super) struct Requests {
    hemisphere: Option<Hemisphere>,
    /// Samples of one light, one for each surface of a block.
    samples: Vec<Option<LightSample>>,
    /// Bring f · |cos| · L / p if nothing is in their way.
    shadows: Queue,
    blocked: Vec<bool>,
    /// What share gets through, where surfaces have holes.
    shares: Vec<f32>,
    /// Bring f · |cos| / p times what they find.
    probes: Queue,
    hits: Vec<Option<Hit>>,
}

/// Rays beyond which requests are answered before there are more: enough for full batches, few
/// enough for the cache.
const MANY: usize = 4096;

impl Requests {
    pub(super) fn new(hemisphere: Option<Hemisphere>) -> Self {
        Self {
            hemisphere,
            samples: Vec::new(),
            shadows: Queue::default(),
            blocked: Vec::new(),
            shares: Vec::new(),
            probes: Queue::default(),
            hits: Vec::new(),
        }
    }

    /// Asks for the direct light at each of a block of surfaces, to be multiplied by the throughput
    /// of its path; answers what becomes too much.
    pub(super) fn ask(
        &mut self,
        asking: &Asking<impl Rules>,
        tracer: &mut Tracer,
        starts: &Starts,
        sums: &mut Sums<impl Witness>,
        mut reuse: Option<&mut Reuse>,
    ) {
        let scene = tracer.scene;
        let mut pair = 0u32;
        for (number, light) in scene.lights.as_slice().iter().enumerate() {
            let n = asking.rules.light_samples(asking.settings, light);
            for _ in 0..n {
                let numbers = asking.numbers.pair(pair);
                pair = pair.wrapping_add(1);
                let reuse = reuse.as_deref_mut();
                let (numbers, requests) = (&numbers, &mut *self);
                let number = LightNumber::Still(number);
                let sampling =
                    LightSampling { asking, scene, number, numbers, n, requests, reuse, sums };
                light.visit(sampling);
                self.answer_many(tracer, starts, sums);
            }
        }
        for (number, light) in scene.moving_lights().iter().enumerate() {
            let n = asking.rules.light_samples(asking.settings, &light.light);
            for _ in 0..n {
                let numbers = &asking.numbers.pair(pair);
                pair = pair.wrapping_add(1);
                let (requests, reuse) = (&mut *self, reuse.as_deref_mut());
                let number = LightNumber::Moving(number);
                let sampling =
                    LightSampling { asking, scene, number, numbers, n, requests, reuse, sums };
                let sample = |(surface, u): (&Surface, [f32; 2])| {
                    let time = starts.time(surface.start as usize);
                    scene.sample_moving(light, time, surface.point.p, u)
                };
                let points = sampling.points();
                sampling.requests.samples.clear();
                sampling.requests.samples.extend(points.map(sample));
                sampling.ask(light.light.is_hidden());
                self.answer_many(tracer, starts, sums);
            }
        }
        let Some(hemisphere) = self.hemisphere else { return };
        for _ in 0..hemisphere.samples {
            self.probe(hemisphere, asking.surfaces, &asking.numbers.pair(pair), &mut sums.witness);
            pair = pair.wrapping_add(1);
            self.answer_many(tracer, starts, sums);
        }
    }

    /// Asks for light from one random direction at each surface.
    fn probe(
        &mut self,
        hemisphere: Hemisphere,
        surfaces: &[Surface],
        [x, y]: &[Lanes<f32>; 2],
        witness: &mut impl Witness,
    ) {
        for (surface, (&x, &y)) in surfaces.iter().zip(x.iter().zip(y)) {
            let Surface { point, bsdf, beta, start, target, .. } = surface;
            if bsdf.is_delta() {
                continue;
            }
            let (local, pdf) = hemisphere.direction([x, y]);
            let wi = bsdf.frame().to_world(local);
            let value = *beta * bsdf.eval(wi) / (pdf.get() * hemisphere.samples as f32);
            if !value.is_black() {
                let samples = hemisphere.samples;
                witness.asks(*start, || Source::Hemisphere { direction: wi, pdf, samples });
                self.probes.push(point.spawn(wi), value, *target);
            }
        }
    }

    /// Answers them if they are many.
    fn answer_many(&mut self, tracer: &mut Tracer, starts: &Starts, sums: &mut Sums<impl Witness>) {
        if self.shadows.rays.len().max(self.probes.rays.len()) >= MANY {
            self.answer(tracer, starts, sums);
        }
    }

    /// Adds to each start what its rays bring, in the order in which they were asked for, and
    /// forgets them.
    pub(super) fn answer(
        &mut self,
        tracer: &mut Tracer,
        starts: &Starts,
        sums: &mut Sums<impl Witness>,
    ) {
        let scene = tracer.scene;
        let Self { shadows, blocked, .. } = self;
        let time = |i: usize| starts.time(shadows.loads[i].1 as usize);
        tracer.occluded(&shadows.rays, time, blocked);
        if scene.has_holes {
            let Self { shadows, blocked, shares, .. } = self;
            let time = |i: usize| starts.time(shadows.loads[i].1 as usize);
            holes::transmittances(tracer, &shadows.rays, time, blocked, shares);
            for (&(value, start), &share) in shadows.loads.iter().zip(&*shares) {
                sums.answer(start, value * share, true);
            }
        } else {
            for (&(value, start), &blocked) in self.shadows.loads.iter().zip(&self.blocked) {
                sums.answer(start, if blocked { Spectrum::ZERO } else { value }, true);
            }
        }
        self.shadows.clear();
        let Some(hemisphere) = self.hemisphere else { return };
        let Self { probes: Queue { rays, loads }, hits, .. } = self;
        tracer.intersect(&*rays, |i| starts.time(loads[i].1 as usize), hits);
        if scene.has_holes {
            let of: Vec<u32> = loads.iter().map(|&(_, start)| start).collect();
            let time = |i: usize| starts.time(of[i] as usize);
            holes::go_on(tracer, rays, time, hits, |i, _, ray, hit, opacity| {
                let (value, start) = &mut loads[i];
                let light = *value * emitted(scene, ray, hit, time(i));
                *value *= 1.0 - opacity;
                let goes_on = !value.is_black();
                sums.answer(*start, light, false);
                goes_on
            });
        }
        for ((&(value, start), hit), ray) in
            self.probes.loads.iter().zip(&self.hits).zip(&self.probes.rays)
        {
            let l = match hit {
                Some(hit) => emitted(scene, ray, hit, starts.time(start as usize)),
                None if hemisphere.sky => scene.sky(ray.origin, ray.direction, &scene.skies),
                None => Spectrum::ZERO,
            };
            sums.answer(start, value * l, true);
        }
        self.probes.clear();
    }
}

/// What a surface that a ray hits at a time emits towards it.
fn emitted(scene: &RenderScene, ray: &Ray, hit: &Hit, time: f32) -> Spectrum {
    scene.emitted(&scene.interaction(ray, hit, time), hit, time)
}

/// Asks for one of `n` samples of a light at each surface.
struct LightSampling<'a, 's, R, W> {
    asking: &'a Asking<'a, R>,
    scene: &'a RenderScene,
    number: LightNumber,
    numbers: &'a [Lanes<f32>; 2],
    n: u32,
    requests: &'a mut Requests,
    reuse: Option<&'a mut Reuse>,
    sums: &'a mut Sums<'s, W>,
}

impl<R: Rules, W: Witness> LightVisitor for LightSampling<'_, '_, R, W> {
    type Output = ();

    #[inline(always)]
    fn visit<L: Light>(self, light: &L) {
        let points = self.points().map(|(surface, u)| (surface.lit(), u));
        let samples = &mut self.requests.samples;
        samples.clear();
        light.sample_each(&self.scene.light_tables, points, samples);
        self.ask(L::HIDDEN);
    }
}

impl<'a, R: Rules, W: Witness> LightSampling<'a, '_, R, W> {
    /// The surfaces, each with its numbers.
    #[inline(always)]
    fn points(&self) -> impl Iterator<Item = (&'a Surface<'a>, [f32; 2])> + use<'a, R, W> {
        let [x, y] = self.numbers;
        self.asking.surfaces.iter().zip(x.iter().zip(y)).map(|(s, (&x, &y))| (s, [x, y]))
    }

    /// Asks for the samples that were drawn, in a loop of its own for the reason of `Wavefront::surfaces`; those of a light
    /// that is hidden, which rays do not find, bring all of it.
    #[inline(always)]
    fn ask(mut self, is_hidden: bool) {
        let Asking { rules, settings, surfaces, .. } = *self.asking;
        let Requests { samples, shadows, .. } = self.requests;
        for (lane, (surface, sample)) in surfaces.iter().zip(&*samples).enumerate() {
            let Surface { point, bsdf, beta, target, .. } = surface;
            let Some(sample) = sample else { continue };
            if bsdf.is_delta() {
                continue;
            }
            let weight =
                if is_hidden { 1.0 } else { rules.light_weight(settings, bsdf, sample, self.n) };
            let p = sample.pdf.map_or(1.0, Pdf::get) * self.n as f32;
            let f = bsdf.eval(sample.wi);
            let value = *beta * f * sample.radiance * (weight / p);
            if value.is_black() {
                continue;
            }
            let (value, target) = match (surface.gift, &mut self.reuse) {
                (Some(Gift::Glossy), Some(reuse)) => {
                    let part = reuse.arrive(surface.start, sample.wi, self.sums);
                    (sample.radiance * (weight / p), part)
                }
                _ => (value, *target),
            };
            self.sums.witness.asks(surface.start, || {
                let u = self.numbers.each_ref().map(|numbers| numbers[lane]);
                let lit = (&surface.lit(), u);
                witness::light(self.scene, self.number, lit, sample, (weight, self.n))
            });
            shadows.push(point.spawn_to(sample), value, target);
        }
    }
}
