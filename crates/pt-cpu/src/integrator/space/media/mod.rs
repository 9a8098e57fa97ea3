//! Participating media. [Kajiya & Von Herzen 1984; Novák et al. 2018, "Monte Carlo methods for
//! volumetric light transport simulation", §5 and §7.1]
//!
//! An interaction is one with a surface or with a medium, where the phase function takes the place
//! of the BSDF. With [`Settings::straight_is_free`], undeflected transmission does not count as an
//! interaction, and is possible after the last one that counts.

mod flight;
mod shadow_ray;
mod vertex;

use pt_bvh::Hit;
use pt_core::id::Id;
use pt_core::light::LightSample;
use pt_core::material::EvaluatedMaterial;
use pt_core::medium::MediumRecord;
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum, Vec3};

use self::flight::FlightBuffers;
use self::shadow_ray::{MediumShadowRay, ShadowRayBuffers};
use self::vertex::{MediaHit, MediaInteraction, MediaScatterer};
use super::{Departure, Flight, FlightEnd, Space};
use crate::Tracer;
use crate::integrator::batch::Batch;
use crate::integrator::context::Context;
use crate::integrator::dimensions::BounceDimensions;
use crate::integrator::estimator::PathEstimator;
use crate::integrator::observer::PathObserver;
use crate::integrator::path_queue::PathState;
use crate::integrator::ray_queue::RayQueue;
use crate::integrator::scatterer::Scatterer;
use crate::integrator::space::shading::ShadingPoint;
use crate::trace::ScatterSite;

/// Space with participating media.
#[derive(Default)]
pub(in crate::integrator) struct Media {
    flight: FlightBuffers,
    shadow_rays: ShadowRayBuffers,
}

/// State of a path in media.
#[derive(Clone, Copy)]
pub(in crate::integrator) struct PathInMedia {
    /// Medium around the path.
    medium: Option<Id<MediumRecord>>,
    /// Number of interactions that do not count.
    free: u32,
    /// Random numbers for an unknown number of events until the path is scattered.
    stream: RngStream,
}

impl Space for Media {
    type PathState = PathInMedia;
    type ShadowState = MediumShadowRay;
    type Hit = MediaHit;
    type Interaction = MediaInteraction;
    type Scatterer<'a> = MediaScatterer<'a>;

    fn dimensions(estimator: &impl PathEstimator, cx: Context) -> BounceDimensions {
        BounceDimensions::with_media(estimator, cx)
    }

    fn at_camera(scene: &RenderScene, stream: impl FnOnce() -> RngStream) -> PathInMedia {
        PathInMedia { medium: scene.media.camera, free: 0, stream: stream() }
    }

    #[inline(always)]
    fn counted(bounces: u32, path: &PathInMedia) -> u32 {
        bounces - path.free
    }

    fn fly<W: PathObserver>(
        &mut self,
        flight: Flight<impl PathEstimator, PathInMedia>,
        batch: &mut Batch<W>,
    ) {
        self.flight.fly(flight, batch);
    }

    fn ends(&self) -> impl Iterator<Item = FlightEnd<MediaHit>> {
        self.flight.ends()
    }

    fn surface_hit(hit: &MediaHit) -> Option<&Hit> {
        match hit {
            MediaHit::Surface(hit) => Some(hit),
            MediaHit::Medium { .. } => None,
        }
    }

    fn may_pass(settings: &Settings, hit: &MediaHit) -> bool {
        settings.straight_is_free && matches!(hit, MediaHit::Surface(_))
    }

    fn interaction(scene: &RenderScene, ray: &Ray, hit: &MediaHit, time: f32) -> MediaInteraction {
        match *hit {
            MediaHit::Surface(ref hit) => {
                MediaInteraction::Surface(scene.interaction(ray, hit, time))
            }
            MediaHit::Medium { t, medium } => {
                MediaInteraction::Medium { p: ray.at(t), wo: -ray.direction, distance: t, medium }
            }
        }
    }

    fn scatterer<'a>(
        scene: &'a RenderScene,
        at: &MediaInteraction,
        material: Option<&'a EvaluatedMaterial>,
        is_last: bool,
    ) -> MediaScatterer<'a> {
        MediaScatterer::new(scene, at, material, is_last)
    }

    fn site(at: &MediaInteraction, scatterer: &MediaScatterer) -> Option<ScatterSite> {
        scatterer.site(at)
    }

    /// After undeflected transmission that does not count, light may be found by the light samples
    /// of the vertex before.
    fn leave(
        &Departure { cx, vertex, is_last }: &Departure<Self>,
        before: &PathState,
        path: &mut PathState,
        wi: Vec3,
        stream: impl FnOnce() -> RngStream,
    ) -> Option<PathInMedia> {
        let is_free = cx.settings.straight_is_free && vertex.scatterer.lets_through(wi);
        if is_free {
            path.origin = before.origin;
            path.bsdf_pdf = before.bsdf_pdf;
        } else if is_last {
            return None;
        }
        Some(PathInMedia {
            medium: medium_towards(cx.scene, vertex, wi),
            free: vertex.space.free + u32::from(is_free),
            stream: stream(),
        })
    }

    fn shadow_state(
        scene: &RenderScene,
        vertex: &ShadingPoint<Self>,
        sample: &LightSample,
        stream: impl FnOnce() -> RngStream,
    ) -> MediumShadowRay {
        MediumShadowRay {
            // The ray ends slightly before the light, but the medium extends to the light.
            end: if sample.end.is_some() { 1.0 } else { f32::INFINITY },
            medium: medium_towards(scene, vertex, sample.wi),
            stream: stream(),
        }
    }

    fn trace_shadow_rays(
        &mut self,
        tracer: &mut Tracer,
        settings: &Settings,
        time: impl Fn(u32) -> f32,
        shadow_rays: &mut RayQueue<MediumShadowRay>,
        mut add: impl FnMut(u32, Spectrum),
    ) {
        self.shadow_rays.attenuate(tracer, settings.straight_is_free, time, shadow_rays);
        for payload in &shadow_rays.payloads {
            add(payload.target, payload.value);
        }
    }
}

/// Medium of a ray that leaves a vertex in the direction `wi`.
fn medium_towards(
    scene: &RenderScene,
    vertex: &ShadingPoint<Media>,
    wi: Vec3,
) -> Option<Id<MediumRecord>> {
    let medium = vertex.space.medium;
    match vertex.scatterer.surface() {
        Some(surface) => {
            let outwards = wi.dot(vertex.point.normal) > 0.0;
            scene.media.medium_after_crossing(surface, outwards, medium)
        }
        None => medium,
    }
}
