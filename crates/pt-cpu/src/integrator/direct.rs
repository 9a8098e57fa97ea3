//! Direct light at surface points: rays that ask whether it arrives, and what it brings.

use pt_bvh::Hit;
use pt_core::light::{Light, LightSample, LightVisitor};
use pt_math::sampler::Lanes;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3, warp};

use super::wavefront::{Context, Rules, Surface};
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
    /// What a ray brings, and to the radiance of which start.
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

/// What surface points want to know. A path asks for lights first and for its hemisphere then, and
/// is answered in this order, wherever in between answers are given.
#[derive(Default)]
pub(super) struct Requests {
    /// Samples of one light, one for each surface of a block.
    samples: Vec<Option<LightSample>>,
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
    /// Asks for the direct light at each of a block of surfaces, to be multiplied by the throughput
    /// of its path.
    pub(super) fn ask(
        &mut self,
        rules: &impl Rules,
        cx: Context,
        hemisphere: Option<Hemisphere>,
        surfaces: &[Surface],
        mut pairs: &[[Lanes<f32>; 2]],
    ) {
        for light in cx.scene.lights.as_slice() {
            let n = rules.light_samples(cx.settings, light.is_delta());
            let numbers;
            (numbers, pairs) = pairs.split_at(n as usize);
            let Self { samples, shadows, .. } = self;
            light.visit(LightSampling { rules, cx, surfaces, pairs: numbers, samples, shadows });
        }
        if let Some(hemisphere) = hemisphere {
            self.probe(hemisphere, surfaces, &pairs[..hemisphere.samples as usize]);
        }
    }

    /// Asks for light from random directions, one for each pair.
    fn probe(&mut self, hemisphere: Hemisphere, surfaces: &[Surface], pairs: &[[Lanes<f32>; 2]]) {
        for [x, y] in pairs {
            for (surface, (&x, &y)) in surfaces.iter().zip(x.iter().zip(y)) {
                let Surface { point, bsdf, beta, start, .. } = surface;
                if bsdf.is_delta() {
                    continue;
                }
                let (local, pdf) = hemisphere.direction([x, y]);
                let wi = bsdf.frame().to_world(local);
                let value = *beta * bsdf.eval(wi) / (pdf.get() * pairs.len() as f32);
                if !value.is_black() {
                    self.probes.push(point.spawn(wi), value, *start);
                }
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

/// Asks for the light of one light, one sample for each pair of numbers.
struct LightSampling<'a, R> {
    rules: &'a R,
    cx: Context<'a>,
    surfaces: &'a [Surface<'a>],
    pairs: &'a [[Lanes<f32>; 2]],
    samples: &'a mut Vec<Option<LightSample>>,
    shadows: &'a mut Queue,
}

impl<R: Rules> LightVisitor for LightSampling<'_, R> {
    type Output = ();

    #[inline(always)]
    fn visit<L: Light>(self, light: &L) {
        let Context { scene, settings } = self.cx;
        let n = self.pairs.len() as u32;
        for [x, y] in self.pairs {
            // Two loops for the reason of `Wavefront::meet`.
            let sample = |(surface, (&x, &y)): (&Surface, (&f32, &f32))| {
                light.sample(&scene.light_tables, surface.point.p, [x, y])
            };
            self.samples.clear();
            self.samples.extend(self.surfaces.iter().zip(x.iter().zip(y)).map(sample));
            for (surface, sample) in self.surfaces.iter().zip(&*self.samples) {
                let Surface { point, bsdf, beta, start, .. } = surface;
                let Some(sample) = sample else { continue };
                if bsdf.is_delta() {
                    continue;
                }
                let weight = self.rules.light_weight(settings, bsdf, sample, n);
                let p = sample.pdf.map_or(1.0, Pdf::get) * n as f32;
                let f = bsdf.eval(sample.wi);
                let value = *beta * f * sample.radiance * (weight / p);
                if !value.is_black() {
                    self.shadows.push(point.spawn_to(sample), value, *start);
                }
            }
        }
    }
}
