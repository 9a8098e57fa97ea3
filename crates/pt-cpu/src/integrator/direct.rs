//! Direct light at surface points: rays that ask whether it arrives, and what it brings.

use pt_bvh::Hit;
use pt_core::light::{Light, LightSample, LightVisitor};
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::Lanes;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum, Vec3, warp};

use super::holes;
use super::sums::Sums;
use super::wavefront::{Numbers, Rules, Surface};
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
        scene: &RenderScene,
        tracer: &mut Tracer,
        sums: &mut Sums,
    ) {
        let mut pair = 0u32;
        for light in scene.lights.as_slice() {
            let n = asking.rules.light_samples(asking.settings, light.is_delta());
            for _ in 0..n {
                let numbers = asking.numbers.pair(pair);
                pair = pair.wrapping_add(1);
                light.visit(LightSampling { asking, scene, numbers: &numbers, n, requests: self });
                self.answer_many(tracer, sums);
            }
        }
        let Some(hemisphere) = self.hemisphere else { return };
        for _ in 0..hemisphere.samples {
            self.probe(hemisphere, asking.surfaces, &asking.numbers.pair(pair));
            pair = pair.wrapping_add(1);
            self.answer_many(tracer, sums);
        }
    }

    /// Asks for light from one random direction at each surface.
    fn probe(&mut self, hemisphere: Hemisphere, surfaces: &[Surface], [x, y]: &[Lanes<f32>; 2]) {
        for (surface, (&x, &y)) in surfaces.iter().zip(x.iter().zip(y)) {
            let Surface { point, bsdf, beta, start, .. } = surface;
            if bsdf.is_delta() {
                continue;
            }
            let (local, pdf) = hemisphere.direction([x, y]);
            let wi = bsdf.frame().to_world(local);
            let value = *beta * bsdf.eval(wi) / (pdf.get() * hemisphere.samples as f32);
            if !value.is_black() {
                self.probes.push(point.spawn(wi), value, *start);
            }
        }
    }

    /// Answers them if they are many.
    fn answer_many(&mut self, tracer: &mut Tracer, sums: &mut Sums) {
        if self.shadows.rays.len().max(self.probes.rays.len()) >= MANY {
            self.answer(tracer, sums);
        }
    }

    /// Adds to each start what its rays bring, in the order in which they were asked for, and
    /// forgets them.
    pub(super) fn answer(&mut self, tracer: &mut Tracer, sums: &mut Sums) {
        let scene = tracer.scene;
        tracer.occluded(&self.shadows.rays, &mut self.blocked);
        if scene.has_holes {
            let Self { shadows, blocked, shares, .. } = self;
            holes::transmittances(tracer, &shadows.rays, blocked, shares);
            for (&(value, start), &share) in shadows.loads.iter().zip(&*shares) {
                sums.add(start, value * share);
            }
        } else {
            for (&(value, start), &blocked) in self.shadows.loads.iter().zip(&self.blocked) {
                sums.add(start, if blocked { Spectrum::ZERO } else { value });
            }
        }
        self.shadows.clear();
        let Some(hemisphere) = self.hemisphere else { return };
        tracer.intersect(&self.probes.rays, &mut self.hits);
        if scene.has_holes {
            let Queue { rays, loads } = &mut self.probes;
            holes::go_on(tracer, rays, &mut self.hits, |i, _, ray, hit, opacity| {
                let (value, start) = &mut loads[i];
                sums.add(*start, *value * scene.emitted(&scene.interaction(ray, hit), hit));
                *value *= 1.0 - opacity;
                !value.is_black()
            });
        }
        for ((&(value, start), hit), ray) in
            self.probes.loads.iter().zip(&self.hits).zip(&self.probes.rays)
        {
            let l = match hit {
                Some(hit) => scene.emitted(&scene.interaction(ray, hit), hit),
                None if hemisphere.sky => scene.sky(ray.direction),
                None => Spectrum::ZERO,
            };
            sums.add(start, value * l);
        }
        self.probes.clear();
    }
}

/// Asks for one of `n` samples of a light at each surface.
struct LightSampling<'a, R> {
    asking: &'a Asking<'a, R>,
    scene: &'a RenderScene,
    numbers: &'a [Lanes<f32>; 2],
    n: u32,
    requests: &'a mut Requests,
}

impl<R: Rules> LightVisitor for LightSampling<'_, R> {
    type Output = ();

    #[inline(always)]
    fn visit<L: Light>(self, light: &L) {
        let Asking { rules, settings, surfaces, .. } = *self.asking;
        let Requests { samples, shadows, .. } = self.requests;
        let [x, y] = self.numbers;
        // Two loops for the reason of `Wavefront::meet`.
        let point = |(surface, (&x, &y)): (&Surface, (&f32, &f32))| (surface.lit(), [x, y]);
        let points = surfaces.iter().zip(x.iter().zip(y)).map(point);
        samples.clear();
        light.sample_each(&self.scene.light_tables, points, samples);
        for (surface, sample) in surfaces.iter().zip(&*samples) {
            let Surface { point, bsdf, beta, start, .. } = surface;
            let Some(sample) = sample else { continue };
            if bsdf.is_delta() {
                continue;
            }
            let weight = rules.light_weight(settings, bsdf, sample, self.n);
            let p = sample.pdf.map_or(1.0, Pdf::get) * self.n as f32;
            let f = bsdf.eval(sample.wi);
            let value = *beta * f * sample.radiance * (weight / p);
            if !value.is_black() {
                shadows.push(point.spawn_to(sample), value, *start);
            }
        }
    }
}
