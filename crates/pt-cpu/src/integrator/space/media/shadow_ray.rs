//! Transmittance of shadow rays through media and alpha.

use pt_bvh::Hit;
use pt_core::id::Id;
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum};

use crate::Tracer;
use crate::integrator::ray_queue::{Payload, RayQueue};

/// State of a shadow ray in media.
#[derive(Clone, Copy)]
pub(in crate::integrator) struct MediumShadowRay {
    /// Parameter of the light itself.
    pub(super) end: f32,
    /// Medium that contains the current origin.
    pub(super) medium: Option<Id<MediumRecord>>,
    /// Random numbers for media and surfaces along the ray.
    pub(super) stream: RngStream,
}

/// Buffers of [`Self::attenuate`].
#[derive(Default)]
pub(super) struct ShadowRayBuffers {
    blocked: Vec<bool>,
    under_way: Vec<usize>,
    rays: Vec<Ray>,
    hits: Vec<Option<Hit>>,
}

/// A shadow ray under way; the interval of its ray is the part that is still to be traversed.
struct Traversal<'a> {
    scene: &'a RenderScene,
    ray: &'a mut Ray,
    payload: &'a mut Payload<MediumShadowRay>,
    time: f32,
}

impl ShadowRayBuffers {
    /// Multiplies the values of shadow rays by their transmittance. `time` returns the time of the
    /// rays with a target. Rays pass thin glass without deflection if `through_panes` is true.
    pub(super) fn attenuate(
        &mut self,
        tracer: &mut Tracer,
        through_panes: bool,
        time: impl Fn(u32) -> f32,
        RayQueue { rays, payloads }: &mut RayQueue<MediumShadowRay>,
    ) {
        let scene = tracer.scene;
        tracer.occluded(&*rays, |i| time(payloads[i].target), &mut self.blocked);
        self.under_way.clear();
        for (i, &blocked) in self.blocked.iter().enumerate() {
            if !blocked {
                Traversal::new(scene, rays, payloads, i, &time).attenuate_to_end();
            } else if scene.has_alpha || through_panes {
                self.under_way.push(i);
            } else {
                payloads[i].value = Spectrum::ZERO;
            }
        }
        while !self.under_way.is_empty() {
            self.rays.clear();
            self.rays.extend(self.under_way.iter().map(|&i| rays[i]));
            let target = |k: usize| payloads[self.under_way[k]].target;
            tracer.intersect(&self.rays, |k| time(target(k)), &mut self.hits);
            let mut hits = self.hits.iter();
            self.under_way.retain(|&i| {
                let mut ray = Traversal::new(scene, rays, payloads, i, &time);
                if let Some(hit) = hits.next().copied().flatten() {
                    return ray.continue_through(&hit, through_panes);
                }
                ray.attenuate_to_end();
                false
            });
        }
    }
}

impl<'a> Traversal<'a> {
    fn new(
        scene: &'a RenderScene,
        rays: &'a mut [Ray],
        payloads: &'a mut [Payload<MediumShadowRay>],
        i: usize,
        time: impl Fn(u32) -> f32,
    ) -> Self {
        let payload = &mut payloads[i];
        let time = time(payload.target);
        Self { scene, ray: &mut rays[i], payload, time }
    }

    /// Undeflected transmittance of a surface that was hit.
    fn straight_transmittance(&mut self, hit: &Hit) -> Spectrum {
        let Self { scene, ray, time, .. } = self;
        let (scene, time) = (*scene, *time);
        // The direction of a shadow ray is not normalized.
        let mut at = scene.interaction(ray, hit, time);
        at.wo = at.wo.normalize();
        let choice = self.payload.state.stream.next_1d();
        let materials = scene.evaluate_material(&at, hit, time, choice, None);
        scene.bsdf(&at, materials.as_ref()).straight()
    }

    /// Multiplies by the transmittance of the medium up to the parameter `t`.
    fn attenuate(&mut self, t: f32) {
        let Payload { value, state, .. } = &mut *self.payload;
        if let Some(medium) = state.medium {
            let ray = Ray { t_max: t, ..*self.ray };
            *value *= self.scene.media.table[medium].transmittance(&ray, &mut state.stream);
        }
    }

    /// Multiplies by the transmittance of the medium up to the light.
    fn attenuate_to_end(&mut self) {
        self.attenuate(self.payload.state.end);
    }

    /// Continues behind a surface that was hit; returns true unless the transmittance is zero.
    fn continue_through(&mut self, hit: &Hit, panes: bool) -> bool {
        let (scene, time) = (self.scene, self.time);
        let opacity = scene.opacity(self.ray, hit, time);
        let mut share = Spectrum::splat(1.0 - opacity);
        if panes && opacity > 0.0 {
            share += self.straight_transmittance(hit) * opacity;
        }
        if share.is_black() {
            self.payload.value = Spectrum::ZERO;
            return false;
        }
        self.attenuate(hit.t);
        let Payload { value, state, .. } = &mut *self.payload;
        *value *= share;
        state.medium = scene.medium_after_crossing(self.ray, hit, time, state.medium);
        self.ray.t_min = hit.t.next_up();
        !value.is_black()
    }
}
