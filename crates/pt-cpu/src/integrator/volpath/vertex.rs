//! Vertices of paths: surfaces and points of media.

use std::borrow::Cow;

use pt_core::bsdf::{Bsdf, BsdfSample};
use pt_core::footprint::Cone;
use pt_core::id::{Id, SurfaceId};
use pt_core::interaction::SurfacePoint;
use pt_core::light::{LightSample, LightSampleContext};
use pt_core::material::EvaluatedMaterial;
use pt_core::medium::MediumRecord;
use pt_core::phase::AnyPhase;
use pt_core::scene::RenderScene;
use pt_math::sampler::RngStream;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::VolPathState;
use super::medium_step::PathEvent;
use super::shadow_ray::ShadowRay;
use crate::integrator::scatterer::Scatterer;
use crate::trace::ScatterSite;

/// Vertex at which a path is scattered.
pub(super) struct Vertex<'a> {
    /// Path up to the vertex.
    pub(super) path: &'a VolPathState,
    pub(super) point: SurfacePoint,
    pub(super) time: f32,
    /// Length of the ray, for the footprint.
    distance: f32,
    kind: Kind<'a>,
}

enum Kind<'a> {
    Surface {
        bsdf: Bsdf<'a>,
        surface: SurfaceId,
        primitive: u32,
    },
    /// Point in a medium, with the direction `wo` towards the previous vertex.
    Medium {
        phase: Cow<'a, AnyPhase>,
        wo: Vec3,
    },
}

impl<'a> Vertex<'a> {
    /// Creates the vertex for the event of a path, at its time; `choice` selects among the
    /// components of stochastic materials, and `material` stores an evaluated material that
    /// varies. `None` if the path is not scattered.
    #[inline(always)]
    pub(super) fn new(
        scene: &'a RenderScene,
        path: &'a VolPathState,
        event: &PathEvent,
        time: f32,
        choice: f32,
        material: &'a mut Option<EvaluatedMaterial>,
    ) -> Option<Self> {
        let &VolPathState { ref ray, cone, medium, .. } = path;
        match event {
            PathEvent::Surface(hit) => {
                let at = scene.interaction(ray, hit, time);
                let width = cone.map(|cone| cone.width_at(at.distance));
                *material = scene.evaluate_material(&at, hit, time, choice, width);
                let bsdf = scene.bsdf(&at, material.as_ref());
                let kind = Kind::Surface { bsdf, surface: at.surface, primitive: at.primitive };
                Some(Self { path, point: at.point, time, distance: at.distance, kind })
            }
            PathEvent::Scattered { t } => {
                let p = ray.at(*t);
                let phase = scene.media.table[medium?].phase_at(p);
                let kind = Kind::Medium { phase, wo: -ray.direction };
                Some(Self { path, point: SurfacePoint::in_space(p), time, distance: *t, kind })
            }
            PathEvent::Escaped | PathEvent::Absorbed => None,
        }
    }

    /// The vertex as observers record it.
    pub(super) fn recorded(&self) -> crate::trace::Vertex {
        let site = match &self.kind {
            Kind::Surface { bsdf, primitive, .. } => ScatterSite::of(bsdf, *primitive),
            Kind::Medium { phase, .. } => ScatterSite::Medium { phase: phase.name() },
        };
        let throughput = self.path.state.beta;
        crate::trace::Vertex { p: self.point.p, site, throughput, scatter: None }
    }

    /// Context of light samples.
    pub(super) fn context(&self) -> LightSampleContext {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.light_sample_context(self.point.p),
            Kind::Medium { .. } => LightSampleContext::in_space(self.point.p),
        }
    }

    /// Shadow ray of a light sample with this unoccluded contribution.
    #[inline(always)]
    pub(super) fn shadow_ray(
        &self,
        scene: &RenderScene,
        sample: &LightSample,
        value: Spectrum,
        stream: RngStream,
    ) -> ShadowRay {
        ShadowRay {
            ray: self.point.spawn_to(sample),
            // The ray ends slightly before the light, but the medium extends to the light.
            end: if sample.end.is_some() { 1.0 } else { f32::INFINITY },
            value,
            medium: self.medium_towards(scene, sample.wi),
            stream,
            start: self.path.state.start,
        }
    }

    /// Cone of a ray whose direction was sampled with the density `pdf`.
    #[inline(always)]
    pub(super) fn cone(&self, scene: &RenderScene, pdf: Option<Pdf<SolidAngle>>) -> Option<Cone> {
        let is_flat = match self.kind {
            Kind::Surface { primitive, .. } => scene.is_flat(primitive),
            Kind::Medium { .. } => true,
        };
        self.path.cone.map(|cone| cone.scattered(self.distance, pdf, is_flat))
    }

    /// See [`Bsdf::is_straight`].
    pub(super) fn is_straight(&self) -> bool {
        matches!(&self.kind, Kind::Surface { bsdf, .. } if bsdf.is_straight())
    }

    /// Medium of a ray that leaves in the direction `wi`.
    pub(super) fn medium_towards(&self, scene: &RenderScene, wi: Vec3) -> Option<Id<MediumRecord>> {
        match &self.kind {
            Kind::Surface { surface, .. } => {
                let outwards = wi.dot(self.point.normal) > 0.0;
                scene.media.medium_after_crossing(*surface, outwards, self.path.medium)
            }
            Kind::Medium { .. } => self.path.medium,
        }
    }
}

impl Scatterer for Vertex<'_> {
    fn is_in_medium(&self) -> bool {
        matches!(self.kind, Kind::Medium { .. })
    }

    fn is_delta(&self) -> bool {
        matches!(&self.kind, Kind::Surface { bsdf, .. } if bsdf.is_delta())
    }

    fn lets_through(&self, wi: Vec3) -> bool {
        matches!(&self.kind, Kind::Surface { bsdf, .. } if bsdf.lets_through(wi))
    }

    fn eval(&self, wi: Vec3) -> Spectrum {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.eval(wi),
            Kind::Medium { phase, wo } => Spectrum::splat(phase.pdf(*wo, wi).get()),
        }
    }

    fn pdf(&self, wi: Vec3) -> Pdf<SolidAngle> {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.pdf(wi),
            Kind::Medium { phase, wo } => phase.pdf(*wo, wi),
        }
    }

    #[inline(always)]
    fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.sample(u),
            Kind::Medium { phase, wo } => {
                let wi = phase.sample(*wo, [u[0], u[1]]);
                let pdf = phase.pdf(*wo, wi);
                pdf.is_positive().then(|| BsdfSample::new(wi, Spectrum::ONE, Some(pdf)))
            }
        }
    }
}
