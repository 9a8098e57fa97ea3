//! Vertices of paths: surfaces and points of media.

use std::borrow::Cow;

use pt_core::bsdf::{Bsdf, BsdfSample};
use pt_core::footprint::Cone;
use pt_core::id::{Id, SurfaceId};
use pt_core::interaction::SurfacePoint;
use pt_core::light::LightSampleContext;
use pt_core::material::EvaluatedMaterial;
use pt_core::medium::MediumRecord;
use pt_core::phase::AnyPhase;
use pt_core::scene::RenderScene;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use super::VolPathState;
use super::medium_step::PathEvent;
use crate::integrator::estimator::transmittance_after;
use crate::trace::ScatterSite;

/// Vertex at which a path is scattered.
pub(super) struct Vertex<'a> {
    point: SurfacePoint,
    /// Medium through which the path arrived.
    medium: Option<Id<MediumRecord>>,
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
    /// components of stochastic materials, and `materials` stores an evaluated material that
    /// varies. `None` if the path is not scattered.
    #[inline(always)]
    pub(super) fn new(
        scene: &'a RenderScene,
        path: &VolPathState,
        event: &PathEvent,
        time: f32,
        choice: f32,
        materials: &'a mut Option<EvaluatedMaterial>,
    ) -> Option<Self> {
        let &VolPathState { ref ray, cone, medium, .. } = path;
        match event {
            PathEvent::Surface(hit) => {
                let at = scene.interaction(ray, hit, time);
                let width = scene.uses_footprints().then(|| cone.width_at(at.distance));
                *materials = scene.evaluate_material(&at, hit, time, choice, width);
                let bsdf = scene.bsdf(&at, materials.as_ref());
                let kind = Kind::Surface { bsdf, surface: at.surface, primitive: at.primitive };
                Some(Self { point: at.point, medium, distance: at.distance, kind })
            }
            PathEvent::Scattered { t } => {
                let p = ray.at(*t);
                let phase = scene.media.table[medium?].phase_at(p);
                let kind = Kind::Medium { phase, wo: -ray.direction };
                let point = SurfacePoint::in_space(p);
                Some(Self { point, medium, distance: *t, kind })
            }
            PathEvent::Escaped | PathEvent::Absorbed => None,
        }
    }

    pub(super) fn point(&self) -> &SurfacePoint {
        &self.point
    }

    /// The vertex as observers record it.
    pub(super) fn recorded(&self, throughput: Spectrum) -> crate::trace::Vertex {
        let place = match &self.kind {
            Kind::Surface { bsdf, primitive, .. } => ScatterSite::of(bsdf, *primitive),
            Kind::Medium { phase, .. } => ScatterSite::Medium { phase: phase.name() },
        };
        crate::trace::Vertex { p: self.point.p, site: place, throughput, scatter: None }
    }

    /// Context of light samples.
    pub(super) fn context(&self) -> LightSampleContext {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.light_sample_context(self.point.p),
            Kind::Medium { .. } => LightSampleContext::in_space(self.point.p),
        }
    }

    /// Ray cone of the next ray, given that of the previous one.
    pub(super) fn cone(
        &self,
        scene: &RenderScene,
        came: Cone,
        pdf: Option<Pdf<SolidAngle>>,
    ) -> Cone {
        if !scene.uses_footprints() {
            return came;
        }
        let is_flat = match self.kind {
            Kind::Surface { primitive, .. } => scene.is_flat(primitive),
            Kind::Medium { .. } => true,
        };
        came.scattered(self.distance, pdf, is_flat)
    }

    /// Returns true if the vertex is in a medium.
    pub(super) fn is_in_medium(&self) -> bool {
        matches!(self.kind, Kind::Medium { .. })
    }

    /// See [`Bsdf::is_delta`].
    pub(super) fn is_delta(&self) -> bool {
        matches!(&self.kind, Kind::Surface { bsdf, .. } if bsdf.is_delta())
    }

    /// See [`Bsdf::is_straight`].
    pub(super) fn is_straight(&self) -> bool {
        matches!(&self.kind, Kind::Surface { bsdf, .. } if bsdf.is_straight())
    }

    /// See [`Bsdf::lets_through`].
    pub(super) fn goes_straight(&self, wi: Vec3) -> bool {
        matches!(&self.kind, Kind::Surface { bsdf, .. } if bsdf.lets_through(wi))
    }

    /// f(wo, wi) · |cos θi|, or the phase function.
    pub(super) fn eval(&self, wi: Vec3) -> Spectrum {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.eval(wi),
            Kind::Medium { phase, wo } => Spectrum::splat(phase.pdf(*wo, wi).get()),
        }
    }

    /// Density with which [`Self::sample`] returns `wi`.
    pub(super) fn pdf(&self, wi: Vec3) -> Pdf<SolidAngle> {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.pdf(wi),
            Kind::Medium { phase, wo } => phase.pdf(*wo, wi),
        }
    }

    /// Samples a direction; returns it with its weight.
    #[inline(always)]
    pub(super) fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        match &self.kind {
            Kind::Surface { bsdf, .. } => bsdf.sample(u),
            Kind::Medium { phase, wo } => {
                let wi = phase.sample(*wo, [u[0], u[1]]);
                let pdf = phase.pdf(*wo, wi);
                pdf.is_positive().then(|| BsdfSample::new(wi, Spectrum::ONE, Some(pdf)))
            }
        }
    }

    /// Transmittance from the camera of a path that continues in the direction `wi`.
    pub(super) fn clear_behind(&self, camera_transmittance: f32, wi: Vec3) -> f32 {
        match &self.kind {
            Kind::Surface { bsdf, .. } => transmittance_after(camera_transmittance, bsdf, wi),
            Kind::Medium { .. } => 0.0,
        }
    }

    /// Medium of a ray that leaves in the direction `wi`.
    pub(super) fn medium_towards(&self, scene: &RenderScene, wi: Vec3) -> Option<Id<MediumRecord>> {
        match &self.kind {
            Kind::Surface { surface, .. } => {
                let outwards = wi.dot(self.point.normal) > 0.0;
                scene.media.medium_after_crossing(*surface, outwards, self.medium)
            }
            Kind::Medium { .. } => self.medium,
        }
    }
}
