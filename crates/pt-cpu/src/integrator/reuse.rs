//! Light that the paths of neighbouring pixels bring to each other. [Bekaert, Sbert & Halton 2002,
//! "Accelerating Path Tracing by Re-Using Paths", §3]
//!
//! The pixels of a square take their samples together. Each path sees a point xₖ, and from there a point yₖ
//! in the direction that the BSDF drew. The light that arrives at yⱼ is thrown back towards all of them, so
//! that every xₖ takes it, and not only xⱼ:
//!
//! ```text
//! Lₖ = Σⱼ fₖ(yⱼ) Vₖⱼ Gₖⱼ Bⱼₖ / Σₘ pₘ(yⱼ) Vₘⱼ Gₘⱼ        f with the cosine at x, G = cos at y / distance²
//! ```
//!
//! This is the balance heuristic of what the BSDFs of all of them might have drawn. A term costs a shadow ray,
//! where another path costs one at each of its surfaces.
//!
//! Of matte surfaces Bⱼₖ is the same for all. Others keep the light that arrived from each of the directions
//! which were sampled, and throw it back anew; since these directions were sampled for one viewer, only those
//! take it to whom the surface looks much the same ([`Bsdf::spread`]). The sums of a taker are over these.

use arrayvec::ArrayVec;
use pt_core::bsdf::Bsdf;
use pt_core::material::Resolved;
use pt_core::scene::{Interaction, RenderScene};
use pt_math::{Ray, Spectrum, Vec3};

use super::front::State;
use super::holes;
use super::sums::Sums;
use super::wavefront::Surface;
use super::witness::Witness;
use super::{MAX_REUSE, Starts};
use crate::Tracer;

/// Most pixels of a square.
const MAX_PIXELS: usize = (MAX_REUSE * MAX_REUSE) as usize;

/// Rays beyond which givers give before there are more.
const MANY: usize = 2048;

/// A surface where a path saw it.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    pub(super) at: Interaction,
    /// What its material is, if it varies.
    pub(super) resolved: Option<Resolved>,
}

impl Seen {
    fn bsdf<'a>(&'a self, scene: &'a RenderScene) -> Bsdf<'a> {
        scene.bsdf(&self.at, self.resolved.as_ref())
    }
}

/// How light is kept that others may have.
#[derive(Clone, Copy)]
pub(super) enum Gift {
    /// In one sum, this one: it is the same in all directions.
    Matte(u32),
    /// In [`Part`]s.
    Glossy,
}

/// Light that arrived at a glossy surface.
#[derive(Clone, Copy)]
struct Part {
    /// The path.
    giver: u32,
    /// From where it arrived.
    wi: Vec3,
    /// Where it is added up.
    target: u32,
}

/// A second surface of a path, whose light others may have.
#[derive(Clone, Copy)]
struct Giver {
    seen: Seen,
    gift: Gift,
    /// What the path carried there.
    beta: Spectrum,
    /// Density with which its direction was drawn, per area of surface.
    density: f32,
}

/// What one point takes from another.
struct Pair {
    taker: u32,
    /// Direction from the giver.
    w: Vec3,
    /// f G
    value: Spectrum,
    /// p G
    density: f32,
    /// How much gets through.
    share: f32,
}

/// Light that goes from path to path.
#[derive(Default)]
pub(super) struct Reuse {
    /// Whether surfaces that are not matte give, too.
    glossy: bool,
    /// First surfaces, by paths.
    takers: Vec<Option<Seen>>,
    givers: Vec<Option<Giver>>,
    parts: Vec<Part>,
    /// Of some givers, one behind the other: the path that gives, and how many pairs it has.
    queue: Vec<(u32, usize)>,
    pairs: Vec<Pair>,
    /// Rays that ask whether something is in the way, and of which pairs.
    rays: Vec<Ray>,
    asking: Vec<usize>,
    blocked: Vec<bool>,
    shares: Vec<f32>,
}

impl Reuse {
    pub(super) fn new(glossy: bool) -> Self {
        Self { glossy, ..Self::default() }
    }

    /// Forgets what it knew; there are `n` paths now.
    pub(super) fn begin(&mut self, n: usize) {
        self.takers.clear();
        self.takers.resize(n, None);
        self.givers.clear();
        self.givers.resize(n, None);
        self.parts.clear();
    }

    /// A path has come to its first surface.
    pub(super) fn take(&mut self, start: u32, seen: &Seen) {
        self.takers[start as usize] = Some(*seen);
    }

    /// A path has come to its second surface. If others may have its light, that is added up apart.
    pub(super) fn give(
        &mut self,
        path: &State,
        seen: &Seen,
        surface: &mut Surface,
        sums: &mut Sums<impl Witness>,
    ) {
        let at = &seen.at;
        let spread = surface.bsdf.towards(at.wo).map_or(0.0, |bsdf| bsdf.spread());
        let density = path.arrival.map_or(0.0, |pdf| pdf.get() * geometry(at, at.wo, at.distance));
        if !(spread > 0.0 && density > 0.0) {
            return;
        }
        let gift = if spread == f32::INFINITY { Gift::Matte(sums.part()) } else { Gift::Glossy };
        if matches!(gift, Gift::Glossy) && !self.glossy {
            return;
        }
        let giver = Giver { seen: *seen, gift, beta: path.beta, density };
        self.givers[path.start as usize] = Some(giver);
        surface.give(gift);
    }

    /// Light arrives at the glossy second surface of a path: where it is to be added up.
    pub(super) fn arrive(&mut self, giver: u32, wi: Vec3, sums: &mut Sums<impl Witness>) -> u32 {
        let target = sums.part();
        self.parts.push(Part { giver, wi, target });
        target
    }

    /// A path goes on from its glossy second surface: its light is added up by itself, and without what the
    /// path carries; Russian roulette still knows that.
    pub(super) fn leave(&mut self, path: &mut State, wi: Vec3, sums: &mut Sums<impl Witness>) {
        let Some(pdf) = path.arrival else { return };
        path.target = self.arrive(path.start, wi, sums);
        path.squeeze *= path.beta.max_channel() * pdf.get();
        path.beta = Spectrum::splat(1.0 / pdf.get());
    }

    /// Gives everybody what is theirs.
    pub(super) fn share(
        &mut self,
        tracer: &mut Tracer,
        starts: &Starts,
        sums: &mut Sums<impl Witness>,
    ) {
        self.parts.sort_by_key(|part| part.giver);
        let mut first = 0;
        for group in &starts.groups {
            for sample in 0..group.samples {
                let member = |pixel: u32| first + pixel * group.samples + sample;
                self.ask(tracer.scene, (0..group.pixels).map(member), sums);
                if self.rays.len() >= MANY {
                    self.answer(tracer, sums);
                }
            }
            first += group.pixels * group.samples;
        }
        self.answer(tracer, sums);
    }

    /// Whether a giver has anything to give.
    fn has_light(&self, member: u32, giver: &Giver, sums: &Sums<impl Witness>) -> bool {
        match giver.gift {
            Gift::Matte(target) => !sums.of(target).is_black(),
            Gift::Glossy => {
                parts(&self.parts, member).iter().any(|part| !sums.of(part.target).is_black())
            }
        }
    }

    /// Asks for what the members of a square may take from each other.
    fn ask(
        &mut self,
        scene: &RenderScene,
        members: impl Iterator<Item = u32> + Clone,
        sums: &Sums<impl Witness>,
    ) {
        let mut takers = ArrayVec::<_, MAX_PIXELS>::new();
        for member in members.clone() {
            if let Some(seen) = &self.takers[member as usize] {
                takers.push((member, &seen.at, seen.bsdf(scene)));
            }
        }
        for member in members {
            let Some(giver) = &self.givers[member as usize] else { continue };
            if !self.has_light(member, giver, sums) {
                continue;
            }
            let own = giver.seen.bsdf(scene);
            let before = self.pairs.len();
            for (taker, at, bsdf) in &takers {
                let is_own = *taker == member;
                let pair = if is_own {
                    Some(giver.own(member))
                } else {
                    giver.pair(&own, *taker, at, bsdf)
                };
                let Some(pair) = pair else { continue };
                if !is_own || scene.has_holes {
                    self.asking.push(self.pairs.len());
                    self.rays.push(at.point.spawn_at(&giver.seen.at.point, -pair.w));
                }
                self.pairs.push(pair);
            }
            self.queue.push((member, self.pairs.len() - before));
        }
    }

    /// Adds what givers give.
    fn answer(&mut self, tracer: &mut Tracer, sums: &mut Sums<impl Witness>) {
        // Nothing moves.
        let time = |_| 0.0;
        tracer.occluded(&self.rays, time, &mut self.blocked);
        holes::transmittances(tracer, &self.rays, time, &self.blocked, &mut self.shares);
        for (&pair, &share) in self.asking.iter().zip(&self.shares) {
            self.pairs[pair].share = share;
        }
        let mut pairs = &self.pairs[..];
        for &(member, count) in &self.queue {
            let (of_giver, others) = pairs.split_at(count);
            pairs = others;
            let Some(giver) = &self.givers[member as usize] else { continue };
            match giver.gift {
                Gift::Matte(target) => share_matte(sums.of(target), of_giver, sums),
                Gift::Glossy => {
                    let own = giver.seen.bsdf(tracer.scene);
                    share_glossy(&own, parts(&self.parts, member), of_giver, sums);
                }
            }
        }
        self.queue.clear();
        self.pairs.clear();
        self.rays.clear();
        self.asking.clear();
    }
}

impl Giver {
    /// What the path itself takes.
    fn own(&self, member: u32) -> Pair {
        let Self { beta, density, .. } = *self;
        Pair { taker: member, w: self.seen.at.wo, value: beta * density, density, share: 1.0 }
    }

    /// What another may take, if it sees the surface, which is `own` towards the path, from the same side and
    /// scatters its light.
    #[inline(always)]
    fn pair(&self, own: &Bsdf, taker: u32, at: &Interaction, bsdf: &Bsdf) -> Option<Pair> {
        let d = at.point.p - self.seen.at.point.p;
        let distance = d.length();
        let w = d / distance;
        own.towards(w)?;
        let geometry = geometry(&self.seen.at, w, distance);
        let (f, pdf) = bsdf.eval_and_pdf(-w);
        let (value, density) = (f * geometry, pdf.get() * geometry);
        (!value.is_black()).then_some(Pair { taker, w, value, density, share: 1.0 })
    }
}

/// cos / distance² towards a viewer.
fn geometry(at: &Interaction, w: Vec3, distance: f32) -> f32 {
    at.point.normal.dot(w).abs() / (distance * distance)
}

/// The parts of a path's light.
fn parts(sorted: &[Part], giver: u32) -> &[Part] {
    let first = sorted.partition_point(|part| part.giver < giver);
    let count = sorted[first..].iter().take_while(|part| part.giver == giver).count();
    &sorted[first..first + count]
}

/// Gives everybody what is the same towards all.
fn share_matte(light: Spectrum, pairs: &[Pair], sums: &mut Sums<impl Witness>) {
    let density: f32 = pairs.iter().map(|pair| pair.density * pair.share).sum();
    let light = light * (1.0 / density);
    // Where surfaces coincide, even the path's own ray may find something in the way.
    for pair in pairs.iter().filter(|pair| pair.share > 0.0) {
        sums.add(pair.taker, pair.value * pair.share * light);
    }
}

/// Gives everybody what a surface throws back to them.
fn share_glossy(own: &Bsdf, parts: &[Part], pairs: &[Pair], sums: &mut Sums<impl Witness>) {
    let views = pairs.iter().filter_map(|pair| Some((pair, own.towards(pair.w)?)));
    let views: ArrayVec<_, MAX_PIXELS> = views.filter(|(pair, _)| pair.share > 0.0).collect();
    for (taker, bsdf) in views.iter().filter(|(_, bsdf)| own.serves(bsdf)) {
        let might_give = views.iter().filter(|(_, other)| other.serves(bsdf));
        let density: f32 = might_give.map(|(pair, _)| pair.density * pair.share).sum();
        let reflected = |part: &Part| bsdf.eval(part.wi) * sums.of(part.target);
        let light: Spectrum = parts.iter().map(reflected).sum();
        sums.add(taker.taker, taker.value * (taker.share / density) * light);
    }
}
