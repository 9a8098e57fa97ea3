//! Shadow rays through media and alpha.

use pt_bvh::Hit;
use pt_core::id::Id;
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum};

use crate::Tracer;
use crate::integrator::CameraRays;
use crate::integrator::batch::Batch;
use crate::integrator::observer::PathObserver;

/// A shadow ray and its contribution.
#[derive(Clone, Copy)]
pub(super) struct ShadowRay {
    /// Ray whose interval is the part that is still to be traversed.
    pub(super) ray: Ray,
    /// Parameter of the light itself.
    pub(super) end: f32,
    pub(super) value: Spectrum,
    /// Medium that contains the current origin.
    pub(super) medium: Option<Id<MediumRecord>>,
    /// Random numbers for media and surfaces along the ray.
    pub(super) stream: RngStream,
    /// Number of the camera ray to which the contribution belongs.
    pub(super) start: u32,
}

/// Pending shadow rays, in the order in which they were queued.
#[derive(Default)]
pub(super) struct ShadowRays {
    queue: Vec<ShadowRay>,
    rays: Vec<Ray>,
    blocked: Vec<bool>,
    under_way: Vec<usize>,
    hits: Vec<Option<Hit>>,
    /// True if rays pass thin glass without deflection.
    through_panes: bool,
}

/// Number of rays from which on the queue is flushed.
const FLUSH_RAYS: usize = 4096;

impl ShadowRay {
    /// Undeflected transmittance of the surface that was hit at a time.
    fn straight_transmittance(&mut self, scene: &RenderScene, hit: &Hit, time: f32) -> Spectrum {
        // The direction of a shadow ray is not normalized.
        let mut at = scene.interaction(&self.ray, hit, time);
        at.wo = at.wo.normalize();
        let choice = self.stream.next_1d();
        let materials = scene.evaluate_material(&at, hit, time, choice, None);
        scene.bsdf(&at, materials.as_ref()).straight()
    }

    /// Multiplies by the transmittance of the medium up to the parameter `t`.
    fn attenuate(&mut self, scene: &RenderScene, t: f32) {
        if let Some(medium) = self.medium {
            let ray = Ray { t_max: t, ..self.ray };
            let share = scene.media.table[medium].transmittance(&ray, &mut self.stream);
            self.value *= share;
        }
    }

    /// Continues behind the surface that was hit at a time; returns true unless the transmittance
    /// is zero.
    fn continue_through(&mut self, scene: &RenderScene, hit: &Hit, time: f32, panes: bool) -> bool {
        let opacity = scene.opacity(&self.ray, hit, time);
        let mut share = Spectrum::splat(1.0 - opacity);
        if panes && opacity > 0.0 {
            share += self.straight_transmittance(scene, hit, time) * opacity;
        }
        if share.is_black() {
            self.value = Spectrum::ZERO;
            return false;
        }
        self.attenuate(scene, hit.t);
        self.value *= share;
        self.medium = scene.medium_after_crossing(&self.ray, hit, time, self.medium);
        self.ray.t_min = hit.t.next_up();
        !self.value.is_black()
    }
}

impl ShadowRays {
    /// Creates an empty queue. Rays pass thin glass without deflection if `panes` is true.
    pub(super) fn new(panes: bool) -> Self {
        Self { through_panes: panes, ..Self::default() }
    }

    pub(super) fn push(&mut self, shadow: ShadowRay) {
        self.queue.push(shadow);
    }

    /// Flushes the queue if it is full.
    pub(super) fn trace_if_full(&mut self, batch: &mut Batch<impl PathObserver>) {
        if self.queue.len() >= FLUSH_RAYS {
            self.trace(batch);
        }
    }

    /// Traces all pending rays, adds their contributions in order, and clears the queue.
    pub(super) fn trace(&mut self, batch: &mut Batch<impl PathObserver>) {
        let Batch { tracer, camera_rays, accumulator } = batch;
        let scene = tracer.scene;
        self.gather(0..self.queue.len());
        let time = |i: usize| camera_rays.time(self.queue[i].start as usize);
        tracer.occluded(&self.rays[..], time, &mut self.blocked);
        self.under_way.clear();
        for (i, (shadow, &blocked)) in self.queue.iter_mut().zip(&self.blocked).enumerate() {
            match blocked {
                false => shadow.attenuate(scene, shadow.end),
                true if scene.has_alpha || self.through_panes => self.under_way.push(i),
                true => shadow.value = Spectrum::ZERO,
            }
        }
        self.pass_alpha(tracer, camera_rays);
        for shadow in self.queue.drain(..) {
            accumulator.add_light_sample(shadow.start, shadow.value, true);
        }
    }

    /// Advances active rays from surface to surface.
    fn pass_alpha(&mut self, tracer: &mut Tracer, camera_rays: &CameraRays) {
        let scene = tracer.scene;
        while !self.under_way.is_empty() {
            let under_way = std::mem::take(&mut self.under_way);
            self.gather(under_way.iter().copied());
            let time = |i: usize| camera_rays.time(self.queue[under_way[i]].start as usize);
            tracer.intersect(&self.rays[..], time, &mut self.hits);
            for (&i, hit) in under_way.iter().zip(&self.hits) {
                let shadow = &mut self.queue[i];
                match hit {
                    None => shadow.attenuate(scene, shadow.end),
                    Some(hit) => {
                        let time = camera_rays.time(shadow.start as usize);
                        if shadow.continue_through(scene, hit, time, self.through_panes) {
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
