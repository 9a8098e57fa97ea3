//! Empty space: rays travel from surface to surface.

use pt_bvh::Hit;
use pt_core::bsdf::Bsdf;
use pt_core::interaction::Interaction;
use pt_core::light::LightSample;
use pt_core::material::EvaluatedMaterial;
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum, Vec3};

use super::{Departure, Flight, FlightEnd, Space};
use crate::Tracer;
use crate::integrator::alpha;
use crate::integrator::batch::Batch;
use crate::integrator::context::Context;
use crate::integrator::dimensions::BounceDimensions;
use crate::integrator::estimator::{PathEstimator, add_hit_emission};
use crate::integrator::observer::PathObserver;
use crate::integrator::path_queue::PathState;
use crate::integrator::ray_queue::RayQueue;
use crate::integrator::space::shading::ShadingPoint;
use crate::trace::ScatterSite;

/// Empty space.
#[derive(Default)]
pub(in crate::integrator) struct Vacuum {
    /// Nearest hits of the rays of the last flight.
    hits: Vec<Option<Hit>>,
    /// Occlusion of shadow rays.
    blocked: Vec<bool>,
    /// Transmittance of shadow rays, in scenes with alpha.
    transmittance: Vec<f32>,
}

impl Space for Vacuum {
    type PathState = ();
    type ShadowState = ();
    type Hit = Hit;
    type Interaction = Interaction;
    type Scatterer<'a> = Bsdf<'a>;

    fn dimensions(estimator: &impl PathEstimator, cx: Context) -> BounceDimensions {
        BounceDimensions::new(estimator, cx)
    }

    fn at_camera(_: &RenderScene, _: impl FnOnce() -> RngStream) {}

    #[inline(always)]
    fn counted(bounces: u32, (): &()) -> u32 {
        bounces
    }

    /// Emitters that are hidden from the camera are omitted.
    fn fly<W: PathObserver>(
        &mut self,
        flight: Flight<impl PathEstimator, ()>,
        batch: &mut Batch<W>,
    ) {
        let Flight { estimator, cx, bounces, splitting, queue, .. } = flight;
        let Batch { tracer, camera_rays, accumulator } = batch;
        let (paths, rays) = (&queue.paths, &queue.rays);
        let time = |i: usize| splitting.time(camera_rays, paths, i);
        tracer.intersect(rays, time, &mut self.hits);
        if bounces == 0 && flight.hides_emitters {
            alpha::skip_emitters(tracer, rays, time, &mut self.hits);
        }
        if !cx.scene.has_alpha {
            return;
        }
        accumulator.set_bounces(bounces);
        let shown = cx.settings.shows(bounces);
        let sampler = |i: usize| splitting.sampler(camera_rays, paths[i].start);
        // The emission of a transparent surface does not depend on its opacity.
        alpha::skip_transparent(
            tracer,
            bounces,
            rays,
            &mut self.hits,
            time,
            sampler,
            |i, ray, hit| {
                if shown {
                    add_hit_emission(estimator, cx, &paths[i], ray, hit, time(i), accumulator);
                }
            },
        );
    }

    #[inline(always)]
    fn ends(&self) -> impl Iterator<Item = FlightEnd<Hit>> {
        self.hits.iter().map(|hit| hit.map_or(FlightEnd::Escaped, FlightEnd::Vertex))
    }

    #[inline(always)]
    fn surface_hit(hit: &Hit) -> Option<&Hit> {
        Some(hit)
    }

    #[inline(always)]
    fn may_pass(_: &Settings, _: &Hit) -> bool {
        false
    }

    #[inline(always)]
    fn interaction(scene: &RenderScene, ray: &Ray, hit: &Hit, time: f32) -> Interaction {
        scene.interaction(ray, hit, time)
    }

    #[inline(always)]
    fn scatterer<'a>(
        scene: &'a RenderScene,
        at: &Interaction,
        material: Option<&'a EvaluatedMaterial>,
        _: bool,
    ) -> Bsdf<'a> {
        scene.bsdf(at, material)
    }

    #[inline(always)]
    fn site(at: &Interaction, bsdf: &Bsdf) -> Option<ScatterSite> {
        Some(ScatterSite::of(bsdf, at.primitive))
    }

    #[inline(always)]
    fn leave(
        _: &Departure<Self>,
        _: &PathState,
        _: &mut PathState,
        _: Vec3,
        _: impl FnOnce() -> RngStream,
    ) -> Option<()> {
        Some(())
    }

    #[inline(always)]
    fn shadow_state(
        _: &RenderScene,
        _: &ShadingPoint<Self>,
        _: &LightSample,
        _: impl FnOnce() -> RngStream,
    ) {
    }

    fn trace_shadow_rays(
        &mut self,
        tracer: &mut Tracer,
        _: &Settings,
        time: impl Fn(u32) -> f32,
        RayQueue { rays, payloads }: &mut RayQueue<()>,
        mut add: impl FnMut(u32, Spectrum),
    ) {
        let Self { blocked, transmittance, .. } = self;
        let time = |i: usize| time(payloads[i].target);
        tracer.occluded(&*rays, time, blocked);
        if tracer.scene.has_alpha {
            alpha::shadow_transmittance(tracer, rays, time, blocked, transmittance);
            for (payload, &share) in payloads.iter().zip(&*transmittance) {
                add(payload.target, payload.value * share);
            }
        } else {
            for (payload, &blocked) in payloads.iter().zip(&*blocked) {
                add(payload.target, if blocked { Spectrum::ZERO } else { payload.value });
            }
        }
    }
}
