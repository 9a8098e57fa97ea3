//! Paths that advance together, bounce by bounce, so that rays are asked for many at a time.
//!
//! ```text
//! for each bounce:
//!     nearest hits of all rays                   one batch, more for those that go through holes
//!     sky; which paths scatter                   arrive
//!     block by block:                            scatter
//!         numbers of the sampler                     draw
//!         surface points, and their emission         meet
//!         materials that vary                        resolve, surfaces
//!         direct light: shadow rays                  Requests
//!         BSDF samples, roulette: next rays          leave
//!     what the shadow rays bring                 one batch, Requests::answer
//! ```
//!
//! Paths share nothing but the memory they stand in, and all sums of a path are in the order of
//! its bounces and of its light samples. So its radiance does not depend on the other paths, but on those of
//! its group where these bring their light to each other ([`super::reuse`]).

use arrayvec::ArrayVec;
use pt_bvh::Hit;
use pt_core::bsdf::Bsdf;
use pt_core::film::ExactSum;
use pt_core::light::{AnyLight, Lit};
use pt_core::material::Resolved;
use pt_core::scene::{Interaction, RenderScene, SurfacePoint};
use pt_core::settings::{Clamp, Settings};
use pt_math::sampler::{LANES, Lanes, Sampler, Samplers};
use pt_math::{Ray, Rays, Spectrum, Vec3};

use super::direct::{Asking, Requests};
use super::front::{Front, State};
use super::holes;
use super::reuse::{Gift, Reuse, Seen};
use super::rules::{Context, Found, Rules};
use super::sums::Sums;
use super::transparency::Transparency;
use super::ways::Ways;
use super::witness::{self, Recorder, Witness};
use super::{CAMERA_DIMENSIONS, Integrator, Recording, Starts};
use crate::Tracer;
use crate::trace::{Departure, Trace};

/// A path at a surface.
pub(super) struct Surface<'a> {
    pub(super) point: SurfacePoint,
    pub(super) bsdf: Bsdf<'a>,
    /// See [`State`].
    pub(super) beta: Spectrum,
    squeeze: f32,
    clear: f32,
    pub(super) start: u32,
    pub(super) target: u32,
    /// What becomes of its light where others may have it.
    pub(super) gift: Option<Gift>,
}

impl Surface<'_> {
    /// Its light, which others may have, is added up apart from now on, and without what the path carried here;
    /// Russian roulette still knows that.
    pub(super) fn give(&mut self, gift: Gift) {
        if let Gift::Matte(target) = gift {
            self.squeeze *= self.beta.max_channel();
            self.beta = Spectrum::ONE;
            self.target = target;
        }
        self.gift = Some(gift);
    }

    /// What lights are told of it.
    #[inline(always)]
    pub(super) fn lit(&self) -> Lit {
        self.bsdf.lit(self.point.p)
    }
}

/// The numbers of a block of paths at one bounce.
pub(super) struct Numbers {
    samplers: Samplers,
    /// The dimension of the first.
    first: u32,
}

impl Numbers {
    /// Pair number `i`.
    #[inline]
    pub(super) fn pair(&self, i: u32) -> [Lanes<f32>; 2] {
        self.samplers.points(self.first.wrapping_add(i.wrapping_mul(2)))
    }

    /// The last pair of a bounce with so many dimensions.
    fn last(&self, dimensions: u32) -> [Lanes<f32>; 2] {
        self.samplers.points(self.first.wrapping_add(dimensions.wrapping_sub(2)))
    }

    /// Pair number `i`, for the BSDF, and the one behind it, for roulette and what the BSDF chooses.
    fn pairs(&self, i: u32) -> [[Lanes<f32>; 2]; 2] {
        [self.pair(i), self.pair(i.wrapping_add(1))]
    }
}

/// The driver of all path tracers.
pub(super) struct Wavefront<'a, R, W = ()> {
    rules: R,
    cx: Context<'a>,
    /// Largest number of surface interactions.
    depth: u32,
    /// Dimensions of the sampler per bounce: a pair per light sample, a pair for the BSDF, one
    /// for roulette, and one for materials if some of them choose.
    dimensions: u32,
    /// Whether some do.
    choose: bool,
    /// Pairs of them that direct light takes.
    light_pairs: u32,
    /// Paths under way.
    front: Front,
    /// Those behind the surface where paths split; empty but there.
    split: Front,
    /// Ways that each start has by now.
    ways: Ways,
    hits: Vec<Option<Hit>>,
    /// Which of the paths have come to a surface where they scatter, and where on it.
    scattering: Vec<(u32, Hit)>,
    /// A block of these, and what their materials are if they vary.
    interactions: Vec<Interaction>,
    resolved: Vec<Option<Resolved>>,
    requests: Requests,
    reuse: Option<Reuse>,
    transparency: Transparency,
    /// See [`Integrator::take_removed`].
    removed: ExactSum,
    witness: W,
}

impl<R: Rules, W: Witness> Integrator for Wavefront<'_, R, W> {
    fn radiance(&mut self, tracer: &mut Tracer, starts: &Starts, radiance: &mut Vec<Spectrum>) {
        self.begin(starts);
        radiance.clear();
        let n = starts.samplers.len();
        radiance.resize(n, Spectrum::ZERO);
        let clamp = if self.rules.clamps() { self.cx.settings.clamp } else { Clamp::NONE };
        let mut removed = ExactSum::default();
        let mut witness = std::mem::take(&mut self.witness);
        witness.begins(starts);
        let mut sums = Sums::new(radiance, clamp, &mut removed, witness);
        for bounces in 0.. {
            let time = |i: usize| self.ways.time(starts, &self.front.paths, i);
            tracer.intersect(&self.front.rays, time, &mut self.hits);
            sums.scattered(bounces);
            if bounces == 0 && self.transparency.hides_emitters() {
                holes::pass_emitters(tracer, &self.front.rays, |i| starts.time(i), &mut self.hits);
            }
            if tracer.scene.has_holes {
                self.go_through_holes(bounces, tracer, starts, &mut sums);
            }
            self.arrive(bounces, starts, &mut sums);
            if self.scattering.is_empty() {
                break;
            }
            self.scatter(bounces, tracer, starts, &mut sums);
            self.requests.answer(tracer, starts, &mut sums);
        }
        if let Some(reuse) = &mut self.reuse {
            sums.scattered(2);
            reuse.share(tracer, starts, &mut sums);
        }
        self.witness = sums.witness;
        radiance.truncate(n);
        self.removed.merge(removed);
    }

    fn take_removed(&mut self) -> ExactSum {
        std::mem::take(&mut self.removed)
    }

    fn transparencies(&self) -> &[f32] {
        self.transparency.shares()
    }
}

impl<R: Rules> Recording for Wavefront<'_, R, Recorder> {
    fn take_traces(&mut self) -> Vec<Trace> {
        self.witness.take()
    }
}

impl<'a, R: Rules, W: Witness> Wavefront<'a, R, W> {
    pub(super) fn new(rules: R, scene: &'a RenderScene, settings: &'a Settings) -> Self {
        let cx = Context { scene, settings };
        let lights = scene.lights.as_slice();
        let moving = scene.moving_lights().len() as u32;
        let count = |is: fn(&AnyLight) -> bool| lights.iter().filter(|l| is(l)).count() as u32;
        let (delta, hidden) = (count(AnyLight::is_delta), count(AnyLight::is_hidden));
        let seen = lights.len() as u32 - delta - hidden + moving;
        let hemisphere = rules.hemisphere(cx);
        let all = lights.iter().chain(scene.moving_lights().iter().map(|moving| &moving.light));
        let samples = all.map(|light| rules.light_samples(settings, light));
        let light_pairs = samples.fold(0, u32::wrapping_add);
        // Beyond 2³², dimensions begin anew.
        let choose = scene.materials.choose();
        let others = delta + 2 + u32::from(choose);
        let extended = seen.max(1) + hidden;
        let pairs = extended.wrapping_mul(settings.light_samples).wrapping_add(others);
        Self {
            cx,
            depth: rules.depth(settings),
            dimensions: pairs.wrapping_mul(2),
            choose,
            light_pairs: light_pairs.wrapping_add(hemisphere.map_or(0, |h| h.samples)),
            rules,
            front: Front::default(),
            split: Front::default(),
            ways: Ways::ONE,
            hits: Vec::new(),
            scattering: Vec::new(),
            interactions: Vec::new(),
            resolved: Vec::new(),
            requests: Requests::new(hemisphere),
            reuse: (settings.reuse > 1).then(|| Reuse::new(hemisphere.is_none())),
            transparency: Transparency::new(scene, settings),
            removed: ExactSum::default(),
            witness: W::default(),
        }
    }

    fn begin(&mut self, starts: &Starts) {
        let first = State {
            beta: Spectrum::splat(self.cx.scene.importance()),
            squeeze: 1.0,
            origin: Lit::in_space(Vec3::ZERO),
            arrival: None,
            clear: self.transparency.begin(starts.samplers.len()),
            start: 0,
            target: 0,
        };
        if let Some(reuse) = &mut self.reuse {
            reuse.begin(starts.samplers.len());
        }
        self.ways = Ways::ONE;
        self.front.rays.clear();
        self.front.rays.extend(Rays::from(&starts.rays).iter());
        let path = |(start, ray): (u32, &Ray)| State {
            start,
            target: start,
            origin: Lit::in_space(ray.origin),
            ..first
        };
        self.front.paths.clear();
        self.front.paths.extend((0..).zip(&self.front.rays).map(path));
        self.front.cones.clear();
        let scene = self.cx.scene;
        if scene.uses_footprints() {
            let cone = |(i, ray): (usize, &Ray)| scene.camera_cone(ray.direction, starts.time(i));
            self.front.cones.extend(self.front.rays.iter().enumerate().map(cone));
        }
    }

    /// Adds the light that rays find where their paths end, and says which paths scatter.
    fn arrive(&mut self, bounces: u32, starts: &Starts, sums: &mut Sums<W>) {
        let scene = self.cx.scene;
        let shown = self.cx.settings.shows(bounces);
        self.scattering.clear();
        for (i, hit) in self.hits.iter().enumerate() {
            match hit {
                Some(hit) if bounces < self.depth => self.scattering.push((i as u32, *hit)),
                Some(hit) if shown && scene.glows(hit) => {
                    let (path, time) =
                        (&self.front.paths[i], self.ways.time(starts, &self.front.paths, i));
                    let at = &scene.interaction(&self.front.rays[i], hit, time);
                    find(&self.rules, self.cx, path, Found { at, hit, time }, sums);
                }
                None => {
                    let (path, d) = (&self.front.paths[i], self.front.rays[i].direction);
                    if self.transparency.leaves(path, self.ways) && shown {
                        escape(&self.rules, self.cx, path, (d, bounces), sums);
                    }
                }
                Some(_) => {}
            }
        }
    }

    /// Asks for the direct light at each surface, and sends the paths that live on their way.
    fn scatter(&mut self, bounces: u32, tracer: &mut Tracer, starts: &Starts, sums: &mut Sums<W>) {
        let Context { settings, .. } = self.cx;
        let lit = settings.shows(bounces + 1);
        let light_pairs = if lit { self.light_pairs } else { 0 };
        let scattering = std::mem::take(&mut self.scattering);
        let mut resolved = std::mem::take(&mut self.resolved);
        let mut living = 0;
        let splits = bounces == 0 && settings.split > 1;
        if splits {
            self.split.make_room(scattering.len() * settings.split as usize, &self.front);
        }
        for block in scattering.chunks(LANES) {
            let numbers = self.draw(block, bounces, |start| self.ways.sampler(starts, start));
            sums.scattered(bounces);
            self.meet(block, starts, settings.shows(bounces), sums);
            self.resolve(block, starts, &numbers, &mut resolved);
            let mut surfaces = self.surfaces(block, &resolved);
            witness::tell(&surfaces, &self.interactions, &mut sums.witness);
            self.meet_others(block, bounces, &resolved, &mut surfaces, sums);
            sums.scattered(bounces + 1);
            if lit {
                let asking =
                    Asking { rules: &self.rules, settings, surfaces: &surfaces, numbers: &numbers };
                self.requests.ask(&asking, tracer, starts, sums, self.reuse.as_mut());
            }
            if splits {
                living =
                    self.leave_by_all_ways(block, &surfaces, [light_pairs, living], starts, sums);
            } else {
                let pairs = [light_pairs, living];
                living = self.leave(block, &surfaces, bounces + 1, pairs, &numbers, sums);
            }
        }
        if splits {
            std::mem::swap(&mut self.front, &mut self.split);
            self.split.paths.clear();
            self.ways = Ways::new(settings.split);
        }
        self.front.truncate(living);
        self.scattering = scattering;
        self.resolved = resolved;
    }

    /// Lets rays that met holes go on, and adds what glows there; the emission of a surface does not
    /// depend on how much of it is there.
    fn go_through_holes(
        &mut self,
        bounces: u32,
        tracer: &mut Tracer,
        starts: &Starts,
        sums: &mut Sums<W>,
    ) {
        let Self { rules, cx, front, hits, ways, .. } = self;
        let scene = cx.scene;
        let shown = cx.settings.shows(bounces);
        let (paths, rays) = (&front.paths, &front.rays);
        let time = |i: usize| ways.time(starts, paths, i);
        let sampler = |i: usize| ways.sampler(starts, paths[i].start);
        holes::wander(tracer, bounces, rays, hits, (time, sampler), |i, ray, hit| {
            if shown && scene.glows(hit) {
                let time = time(i);
                let at = &scene.interaction(ray, hit, time);
                find(rules, *cx, &paths[i], Found { at, hit, time }, sums);
            }
        });
    }

    /// The surface points to which a block of paths has come; adds their emission, if it is shown.
    fn meet(&mut self, block: &[(u32, Hit)], starts: &Starts, shown: bool, sums: &mut Sums<W>) {
        let scene = self.cx.scene;
        let time = |i: u32| self.ways.time(starts, &self.front.paths, i as usize);
        let at = |&(i, ref hit): &(u32, Hit)| {
            scene.interaction(&self.front.rays[i as usize], hit, time(i))
        };
        self.interactions.clear();
        self.interactions.extend(block.iter().map(at));
        for (at, (i, hit)) in self.interactions.iter().zip(block) {
            if shown && !scene.surfaces[at.surface].emission.is_black() {
                let found = Found { at, hit, time: time(*i) };
                find(&self.rules, self.cx, &self.front.paths[*i as usize], found, sums);
            }
        }
    }

    /// What the materials of a block are that vary; nothing if none does.
    fn resolve(
        &self,
        block: &[(u32, Hit)],
        starts: &Starts,
        numbers: &Numbers,
        resolved: &mut Vec<Option<Resolved>>,
    ) {
        let scene = self.cx.scene;
        resolved.clear();
        if scene.materials.table.as_slice().is_empty() {
            return;
        }
        let choices = if self.choose { numbers.last(self.dimensions)[0] } else { [0.0; LANES] };
        let points = self.interactions.iter().zip(block).zip(choices);
        let width = |i: u32, at: &Interaction| {
            self.front.cones.get(i as usize).map(|cone| cone.width_at(at.distance))
        };
        let time = |i: u32| self.ways.time(starts, &self.front.paths, i as usize);
        resolved.extend(points.map(|((at, (i, hit)), choice)| {
            scene.resolve(at, hit, time(*i), choice, width(*i, at))
        }));
    }

    /// How a block scatters.
    ///
    /// In a loop of its own, which is short enough for the next paths to run while one waits: one loop
    /// with the surface points costs 4 % of a render.
    fn surfaces<'s>(
        &self,
        block: &[(u32, Hit)],
        resolved: &'s [Option<Resolved>],
    ) -> ArrayVec<Surface<'s>, LANES>
    where
        'a: 's,
    {
        let scene = self.cx.scene;
        let mut surfaces = ArrayVec::new();
        for (lane, (at, &(i, _))) in self.interactions.iter().zip(block).enumerate() {
            let State { beta, squeeze, clear, start, target, .. } = self.front.paths[i as usize];
            let bsdf = scene.bsdf(at, resolved.get(lane).and_then(Option::as_ref));
            surfaces.push(Surface {
                point: at.point,
                bsdf,
                beta,
                squeeze,
                clear,
                start,
                target,
                gift: None,
            });
        }
        surfaces
    }

    /// Where paths bring their light to each other: what others may need of these surfaces.
    fn meet_others(
        &mut self,
        block: &[(u32, Hit)],
        bounces: u32,
        resolved: &[Option<Resolved>],
        surfaces: &mut [Surface],
        sums: &mut Sums<W>,
    ) {
        let Some(reuse) = &mut self.reuse else { return };
        if bounces > 1 {
            return;
        }
        for (lane, surface) in surfaces.iter_mut().enumerate() {
            let resolved = resolved.get(lane).copied().flatten();
            let seen = Seen { at: self.interactions[lane], resolved };
            if bounces == 0 {
                reuse.take(surface.start, &seen);
            } else {
                reuse.give(&self.front.paths[block[lane].0 as usize], &seen, surface, sums);
            }
        }
    }

    /// The numbers of the block's paths: for direct light, for the BSDF, for roulette, for materials.
    #[inline(always)]
    fn draw(
        &self,
        block: &[(u32, Hit)],
        bounces: u32,
        sampler: impl Fn(u32) -> Sampler,
    ) -> Numbers {
        let sampler = |&(i, _): &(u32, Hit)| sampler(self.front.paths[i as usize].start);
        let first = bounces.wrapping_mul(self.dimensions).wrapping_add(CAMERA_DIMENSIONS);
        Numbers { samplers: Samplers::new(block.iter().map(sampler)), first }
    }

    /// [`Wavefront::leave`] behind the first surface, once for each way, with numbers of its own.
    #[inline(never)]
    fn leave_by_all_ways(
        &mut self,
        block: &[(u32, Hit)],
        surfaces: &[Surface],
        [light_pairs, mut living]: [u32; 2],
        starts: &Starts,
        sums: &mut Sums<W>,
    ) -> u32 {
        let ways = Ways::new(self.cx.settings.split);
        let n = ways.count() as f32;
        for way in 0..ways.count() {
            let sampler = |start| ways.sampler(starts, ways.number(start, way));
            let numbers = self.draw(block, 0, sampler);
            let first = living as usize;
            living = self.leave(block, surfaces, 1, [light_pairs, living], &numbers, sums);
            for path in &mut self.split.paths[first..living as usize] {
                path.start = ways.number(path.start, way);
                path.beta *= 1.0 / n;
                path.clear *= 1.0 / n;
                // Roulette knows what the path carried before.
                path.squeeze *= n;
            }
        }
        living
    }

    /// Continues the block's paths after interaction number `bounces`: those that live, with their
    /// rays, are stored from `living` on, in `split` if there is room. Returns where the next may be stored.
    fn leave(
        &mut self,
        block: &[(u32, Hit)],
        surfaces: &[Surface],
        bounces: u32,
        [light_pairs, mut living]: [u32; 2],
        numbers: &Numbers,
        sums: &mut Sums<W>,
    ) -> u32 {
        let behind_lights = numbers.pairs(light_pairs);
        // Where only the BSDF finds directions, no numbers are taken for lights.
        let any_delta = light_pairs > 0 && surfaces.iter().any(|s| s.bsdf.is_delta());
        let alone = if any_delta { numbers.pairs(0) } else { behind_lights };
        for (lane, surface) in surfaces.iter().enumerate() {
            let [[x, y], [z, w]] = if surface.bsdf.is_delta() { &alone } else { &behind_lights };
            let u = [x, y, w].map(|n| n[lane]);
            let next = self.next(surface, bounces, (u, z[lane]), &mut sums.witness);
            if let Some((mut path, ray)) = next {
                if let (Some(Gift::Glossy), Some(reuse)) = (surface.gift, &mut self.reuse) {
                    reuse.leave(&mut path, ray.direction, sums);
                }
                let cone = self.front.cones.get(block[lane].0 as usize).map(|cone| {
                    let at = &self.interactions[lane];
                    let is_flat = self.cx.scene.is_flat(at.primitive);
                    cone.scattered(at.distance, path.arrival, is_flat)
                });
                let behind =
                    if self.split.paths.is_empty() { &mut self.front } else { &mut self.split };
                behind.put(living as usize, path, ray, cone);
                living += 1;
            }
        }
        living
    }

    /// The path behind a surface, if it goes on, by numbers for the BSDF and one for roulette.
    #[inline(always)]
    fn next(
        &self,
        surface: &Surface,
        bounces: u32,
        (u, v): ([f32; 3], f32),
        witness: &mut W,
    ) -> Option<(State, Ray)> {
        let settings = self.cx.settings;
        let scattered = surface.bsdf.sample(u)?;
        let mut next = State {
            beta: surface.beta * scattered.weight,
            squeeze: surface.squeeze * scattered.squeeze,
            origin: surface.lit(),
            arrival: scattered.pdf,
            clear: clear_behind(surface.clear, &surface.bsdf, scattered.wi),
            start: surface.start,
            target: surface.target,
        };
        let finds_nothing = bounces >= self.depth && !self.rules.finds(settings, next.arrival);
        if next.beta.is_black() || finds_nothing {
            return None;
        }
        let survival = self.rules.survival(settings, &next, bounces);
        if let Some(q) = survival {
            if v >= q {
                return None;
            }
            next.beta *= 1.0 / q;
            next.clear *= 1.0 / q;
        }
        witness.leaves(surface.start, || Departure::new(&scattered, survival));
        Some((next, surface.point.spawn(scattered.wi)))
    }
}

/// How clear the way of a path is behind a surface that it leaves towards `wi`.
#[inline(always)]
pub(super) fn clear_behind(clear: f32, bsdf: &Bsdf, wi: Vec3) -> f32 {
    if clear != 0.0 && bsdf.lets_through(wi) { clear } else { 0.0 }
}

/// Adds the emission of a surface to the light of the path that found it.
#[inline(always)]
pub(super) fn find(
    rules: &impl Rules,
    cx: Context,
    path: &State,
    found: Found,
    sums: &mut Sums<impl Witness>,
) {
    let l = rules.emitted(cx, path, found);
    sums.find(path.target, path.beta * l, || witness::emitter(cx, path, found, l));
}

/// Adds what the sky brings to a path that left the scene in direction `d`.
#[inline(always)]
pub(super) fn escape<W: Witness>(
    rules: &impl Rules,
    cx: Context,
    path: &State,
    (d, bounces): (Vec3, u32),
    sums: &mut Sums<W>,
) {
    let scene = cx.scene;
    let l = rules.sky(cx, path, d, bounces, &scene.skies);
    sums.find(path.target, path.beta * l, || witness::sky(cx, path.origin.p, d, l));
    if W::LISTENS && scene.skies.len() > 1 {
        let of_each = |sky| rules.sky(cx, path, d, bounces, std::slice::from_ref(sky));
        sums.witness.tells_apart(path.target, || scene.skies.iter().map(of_each).collect());
    }
}
