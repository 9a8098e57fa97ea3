//! Shadow rays through media and alpha.

use pt_bvh::Hit;
use pt_core::id::Id;
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum};

use crate::Tracer;
use crate::integrator::CameraRays;
use crate::integrator::accumulator::RadianceAccumulator;
use crate::integrator::observer::PathObserver;

/// A shadow ray and its contribution.
#[derive(Clone, Copy)]
pub(super) struct ShadowRay {
    /// Its interval is what it has not been through yet.
    pub(super) ray: Ray,
    /// The parameter of the light itself.
    pub(super) end: f32,
    pub(super) value: Spectrum,
    /// The medium that it is in.
    pub(super) medium: Option<Id<MediumRecord>>,
    /// Numbers for what is on its way.
    pub(super) stream: RngStream,
    /// To the radiance of which start it belongs.
    pub(super) start: u32,
}

/// Rays that were not followed yet, in the order in which they were asked for.
#[derive(Default)]
pub(super) struct ShadowRays {
    queue: Vec<ShadowRay>,
    rays: Vec<Ray>,
    blocked: Vec<bool>,
    under_way: Vec<usize>,
    hits: Vec<Option<Hit>>,
    /// True if they go straight through thin glass.
    through_panes: bool,
}

/// Rays beyond which they are followed before there are more.
const FLUSH_RAYS: usize = 4096;

impl ShadowRay {
    /// The share of light that goes straight through the surface that was hit at a time.
    fn straight_transmittance(&mut self, scene: &RenderScene, hit: &Hit, time: f32) -> Spectrum {
        // The direction of a shadow ray is as long as its way.
        let mut at = scene.interaction(&self.ray, hit, time);
        at.wo = at.wo.normalize();
        let choice = self.stream.next_1d();
        let materials = scene.evaluate_material(&at, hit, time, choice, None);
        scene.bsdf(&at, materials.as_ref()).straight()
    }

    /// Takes away what the medium does up to the parameter `t`.
    fn attenuate(&mut self, scene: &RenderScene, t: f32) {
        if let Some(medium) = self.medium {
            let ray = Ray { t_max: t, ..self.ray };
            let share = scene.media.table[medium].transmittance(&ray, &mut self.stream);
            self.value *= share;
        }
    }

    /// Goes on behind what was hit at a time, if something gets through; says whether it does.
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
    /// Rays that go straight through thin glass if `through_panes` is true.
    pub(super) fn new(panes: bool) -> Self {
        Self { through_panes: panes, ..Self::default() }
    }

    pub(super) fn push(&mut self, shadow: ShadowRay) {
        self.queue.push(shadow);
    }

    /// Follows them if they are many.
    pub(super) fn trace_if_full(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
        if self.queue.len() >= FLUSH_RAYS {
            self.trace(tracer, camera_rays, accumulator);
        }
    }

    /// Adds to each start what its rays bring, in the order in which they were asked for, and
    /// forgets them.
    pub(super) fn trace(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        accumulator: &mut RadianceAccumulator<impl PathObserver>,
    ) {
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

    /// Follows those under way from surface to surface.
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
