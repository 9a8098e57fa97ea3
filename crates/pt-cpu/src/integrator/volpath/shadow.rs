//! What gets through to lights.

use pt_bvh::Hit;
use pt_core::id::Id;
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_math::sampler::Stream;
use pt_math::{Ray, Spectrum};

use crate::Tracer;
use crate::integrator::Starts;
use crate::integrator::sums::Sums;
use crate::integrator::witness::Witness;

/// A ray towards a light, and what it brings.
#[derive(Clone, Copy)]
pub(super) struct Shadow {
    /// Its interval is what it has not been through yet.
    pub(super) ray: Ray,
    /// The parameter of the light itself.
    pub(super) end: f32,
    pub(super) value: Spectrum,
    /// The medium that it is in.
    pub(super) medium: Option<Id<MediumRecord>>,
    /// Numbers for what is on its way.
    pub(super) stream: Stream,
    /// To the radiance of which start it belongs.
    pub(super) start: u32,
}

/// Rays that were not followed yet, in the order in which they were asked for.
#[derive(Default)]
pub(super) struct Shadows {
    queue: Vec<Shadow>,
    rays: Vec<Ray>,
    blocked: Vec<bool>,
    under_way: Vec<usize>,
    hits: Vec<Option<Hit>>,
    /// Whether they go straight through thin glass.
    panes: bool,
}

/// Rays beyond which they are followed before there are more.
const MANY: usize = 4096;

impl Shadow {
    /// The share of light that goes straight through the surface that was hit at a time.
    fn straight(&mut self, scene: &RenderScene, hit: &Hit, time: f32) -> Spectrum {
        // The direction of a shadow ray is as long as its way.
        let mut at = scene.interaction(&self.ray, hit, time);
        at.wo = at.wo.normalize();
        let choice = self.stream.next_1d();
        let resolved = scene.resolve(&at, hit, time, choice, None);
        scene.bsdf(&at, resolved.as_ref()).straight()
    }

    /// Takes away what the medium does up to the parameter `t`.
    fn pass(&mut self, scene: &RenderScene, t: f32) {
        if let Some(medium) = self.medium {
            let ray = Ray { t_max: t, ..self.ray };
            let share = scene.media.table[medium].transmittance(&ray, &mut self.stream);
            self.value *= share;
        }
    }

    /// Goes on behind what was hit at a time, if something gets through; says whether it does.
    fn go_through(&mut self, scene: &RenderScene, hit: &Hit, time: f32, panes: bool) -> bool {
        let opacity = scene.opacity(&self.ray, hit, time);
        let mut share = Spectrum::splat(1.0 - opacity);
        if panes && opacity > 0.0 {
            share += self.straight(scene, hit, time) * opacity;
        }
        if share.is_black() {
            self.value = Spectrum::ZERO;
            return false;
        }
        self.pass(scene, hit.t);
        self.value *= share;
        self.medium = scene.medium_beyond(&self.ray, hit, time, self.medium);
        self.ray.t_min = hit.t.next_up();
        !self.value.is_black()
    }
}

impl Shadows {
    /// Rays that go straight through thin glass if `panes` is true.
    pub(super) fn new(panes: bool) -> Self {
        Self { panes, ..Self::default() }
    }

    pub(super) fn push(&mut self, shadow: Shadow) {
        self.queue.push(shadow);
    }

    /// Follows them if they are many.
    pub(super) fn answer_many(
        &mut self,
        tracer: &mut Tracer,
        starts: &Starts,
        sums: &mut Sums<impl Witness>,
    ) {
        if self.queue.len() >= MANY {
            self.answer(tracer, starts, sums);
        }
    }

    /// Adds to each start what its rays bring, in the order in which they were asked for, and forgets
    /// them.
    pub(super) fn answer(
        &mut self,
        tracer: &mut Tracer,
        starts: &Starts,
        sums: &mut Sums<impl Witness>,
    ) {
        let scene = tracer.scene;
        self.gather(0..self.queue.len());
        let time = |i: usize| starts.time(self.queue[i].start as usize);
        tracer.occluded(&self.rays[..], time, &mut self.blocked);
        self.under_way.clear();
        for (i, (shadow, &blocked)) in self.queue.iter_mut().zip(&self.blocked).enumerate() {
            match blocked {
                false => shadow.pass(scene, shadow.end),
                true if scene.has_holes || self.panes => self.under_way.push(i),
                true => shadow.value = Spectrum::ZERO,
            }
        }
        self.go_through_holes(tracer, starts);
        for shadow in self.queue.drain(..) {
            sums.answer(shadow.start, shadow.value, true);
        }
    }

    /// Follows those under way from surface to surface.
    fn go_through_holes(&mut self, tracer: &mut Tracer, starts: &Starts) {
        let scene = tracer.scene;
        while !self.under_way.is_empty() {
            let under_way = std::mem::take(&mut self.under_way);
            self.gather(under_way.iter().copied());
            let time = |i: usize| starts.time(self.queue[under_way[i]].start as usize);
            tracer.intersect(&self.rays[..], time, &mut self.hits);
            for (&i, hit) in under_way.iter().zip(&self.hits) {
                let shadow = &mut self.queue[i];
                match hit {
                    None => shadow.pass(scene, shadow.end),
                    Some(hit) => {
                        let time = starts.time(shadow.start as usize);
                        if shadow.go_through(scene, hit, time, self.panes) {
                            self.under_way.push(i);
                        }
                    }
                }
            }
        }
    }

    fn gather(&mut self, which: impl Iterator<Item = usize>) {
        self.rays.clear();
        self.rays.extend(which.map(|i| self.queue[i].ray));
    }
}
