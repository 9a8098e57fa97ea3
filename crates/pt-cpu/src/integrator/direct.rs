//! Direct light at surface points: rays that ask whether it arrives, and what it brings.

use pt_bvh::Hit;
use pt_core::bsdf::Bsdf;
use pt_core::light::AnyLight;
use pt_core::scene::Interaction;
use pt_core::settings::Settings;
use pt_math::{Pdf, Ray, Spectrum, warp};

use super::wavefront::{Context, Draws, Rules};
use crate::Tracer;

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

/// Number of samples of a light: one is enough if all its light comes from one direction.
#[inline(always)]
pub(super) fn light_samples(light: &AnyLight, settings: &Settings) -> u32 {
    if light.is_delta() { 1 } else { settings.light_samples }
}

/// What a ray brings, and to the radiance of which start.
pub(super) type Load = (Spectrum, u32);

/// Rays and what each brings.
#[derive(Default)]
struct Queue {
    rays: Vec<Ray>,
    loads: Vec<Load>,
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

/// What surface points want to know. A path asks for lights first and for its hemisphere then, and
/// is answered in this order, wherever in between answers are given.
#[derive(Default)]
pub(super) struct Requests {
    /// Bring f · |cos| · L / p if nothing is in their way.
    shadows: Queue,
    blocked: Vec<bool>,
    /// Bring f · |cos| / p times what they find.
    probes: Queue,
    hits: Vec<Option<Hit>>,
}

/// Rays beyond which requests are answered before there are more: enough for full batches, few
/// enough for the cache.
const MANY: usize = 4096;

impl Requests {
    /// Asks for the light of all lights that are sampled, to be multiplied by `beta`.
    #[inline(always)]
    pub(super) fn lights(
        &mut self,
        rules: &impl Rules,
        Context { scene, settings }: Context,
        (at, bsdf): (&Interaction, &Bsdf),
        draws: &mut Draws,
        (beta, start): Load,
    ) {
        for light in scene.lights.as_slice() {
            if !rules.samples_light(settings, light) {
                continue;
            }
            let n = light_samples(light, settings);
            for _ in 0..n {
                let u = draws.next_2d();
                let Some(sample) = light.sample(&scene.light_tables, at.p, u) else { continue };
                let weight = rules.light_weight(settings, bsdf, &sample, n);
                let p = sample.pdf.map_or(1.0, Pdf::get) * n as f32;
                let value = beta * bsdf.eval(sample.wi) * sample.radiance * (weight / p);
                if !value.is_black() {
                    self.shadows.push(at.spawn_to(&sample), value, start);
                }
            }
        }
    }

    /// Asks for light from random directions, to be multiplied by `beta`.
    #[inline(always)]
    pub(super) fn probes(
        &mut self,
        hemisphere: Hemisphere,
        (at, bsdf): (&Interaction, &Bsdf),
        draws: &mut Draws,
        (beta, start): Load,
    ) {
        for _ in 0..hemisphere.samples {
            let u = draws.next_2d();
            let (local, pdf) = if hemisphere.cosine {
                let w = warp::cosine_hemisphere(u);
                (w, warp::cosine_hemisphere_pdf(w.z))
            } else {
                let w = warp::uniform_hemisphere(u);
                (w, warp::uniform_hemisphere_pdf(w.z))
            };
            let wi = bsdf.frame().to_world(local);
            let value = beta * bsdf.eval(wi) / (pdf.get() * hemisphere.samples as f32);
            if !value.is_black() {
                self.probes.push(at.spawn(wi), value, start);
            }
        }
    }

    /// Whether it is time to answer them.
    pub(super) fn are_many(&self) -> bool {
        self.shadows.rays.len().max(self.probes.rays.len()) >= MANY
    }

    /// Adds to each start what its rays bring, in the order in which they were asked for, and
    /// forgets them.
    pub(super) fn answer(
        &mut self,
        tracer: &mut Tracer,
        hemisphere: Option<Hemisphere>,
        radiance: &mut [Spectrum],
    ) {
        tracer.occluded(&self.shadows.rays, &mut self.blocked);
        for (&(value, start), &blocked) in self.shadows.loads.iter().zip(&self.blocked) {
            radiance[start as usize] += if blocked { Spectrum::ZERO } else { value };
        }
        self.shadows.clear();
        let Some(hemisphere) = hemisphere else { return };
        tracer.intersect(&self.probes.rays, &mut self.hits);
        let scene = tracer.scene;
        for ((&(value, start), hit), ray) in
            self.probes.loads.iter().zip(&self.hits).zip(&self.probes.rays)
        {
            let l = match hit {
                Some(hit) => scene.emitted(&scene.interaction(ray, hit)),
                None if hemisphere.sky => scene.sky(ray.direction),
                None => Spectrum::ZERO,
            };
            radiance[start as usize] += value * l;
        }
        self.probes.clear();
    }
}
