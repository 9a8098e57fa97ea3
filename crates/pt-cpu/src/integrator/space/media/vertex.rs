//! Vertices of paths in media: surfaces, and points between them.

use std::borrow::Cow;

use pt_bvh::Hit;
use pt_core::bsdf::{Bsdf, BsdfSample};
use pt_core::id::{Id, SurfaceId};
use pt_core::interaction::{Interaction, SurfacePoint};
use pt_core::material::EvaluatedMaterial;
use pt_core::medium::MediumRecord;
use pt_core::phase::AnyPhase;
use pt_core::scene::RenderScene;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

use crate::integrator::scatterer::Scatterer;
use crate::integrator::space::VertexInteraction;
use crate::trace::ScatterSite;

/// Vertex reached by a ray.
#[derive(Clone, Copy)]
pub(in crate::integrator) enum MediaHit {
    /// The ray hit a surface.
    Surface(Hit),
    /// The path was scattered in a medium, at the parameter `t` of its ray.
    Medium { t: f32, medium: Id<MediumRecord> },
}

/// Geometry of a vertex.
#[derive(Clone, Copy)]
pub(in crate::integrator) enum MediaInteraction {
    Surface(Interaction),
    Medium {
        p: Vec3,
        /// Direction towards the previous vertex.
        wo: Vec3,
        /// Length of the ray.
        distance: f32,
        medium: Id<MediumRecord>,
    },
}

/// Scattering function at a vertex.
pub(in crate::integrator) enum MediaScatterer<'a> {
    Surface {
        bsdf: Bsdf<'a>,
        surface: SurfaceId,
    },
    Medium {
        phase: Cow<'a, AnyPhase>,
        /// Direction towards the previous vertex.
        wo: Vec3,
    },
    /// Surface at which a path ends without being scattered.
    Absorber,
}

impl VertexInteraction for MediaInteraction {
    fn surface(&self) -> Option<&Interaction> {
        match self {
            Self::Surface(at) => Some(at),
            Self::Medium { .. } => None,
        }
    }

    fn point(&self) -> SurfacePoint {
        match self {
            Self::Surface(at) => at.point,
            Self::Medium { p, .. } => SurfacePoint::in_space(*p),
        }
    }

    fn distance(&self) -> f32 {
        match self {
            Self::Surface(at) => at.distance,
            Self::Medium { distance, .. } => *distance,
        }
    }

    fn is_flat(&self, scene: &RenderScene) -> bool {
        self.surface().is_none_or(|at| scene.is_flat(at.primitive))
    }
}

impl<'a> MediaScatterer<'a> {
    /// Scattering function at a vertex. After the last interaction of a path, only surfaces scatter
    /// that let light through undeflected.
    #[inline(always)]
    pub(super) fn new(
        scene: &'a RenderScene,
        at: &MediaInteraction,
        material: Option<&'a EvaluatedMaterial>,
        is_last: bool,
    ) -> Self {
        match at {
            MediaInteraction::Surface(at) => {
                let bsdf = scene.bsdf(at, material);
                if is_last && !bsdf.is_straight() {
                    return Self::Absorber;
                }
                Self::Surface { bsdf, surface: at.surface }
            }
            MediaInteraction::Medium { p, wo, medium, .. } => {
                Self::Medium { phase: scene.media.table[*medium].phase_at(*p), wo: *wo }
            }
        }
    }

    /// See [`crate::integrator::space::Space::site`].
    pub(super) fn site(&self, at: &MediaInteraction) -> Option<ScatterSite> {
        match (self, at) {
            (Self::Surface { bsdf, .. }, MediaInteraction::Surface(at)) => {
                Some(ScatterSite::of(bsdf, at.primitive))
            }
            (Self::Medium { phase, .. }, _) => Some(ScatterSite::Medium { phase: phase.name() }),
            _ => None,
        }
    }

    /// The surface, if the vertex is on one and scatters light.
    pub(super) fn surface(&self) -> Option<SurfaceId> {
        match self {
            Self::Surface { surface, .. } => Some(*surface),
            Self::Medium { .. } | Self::Absorber => None,
        }
    }
}

impl Scatterer for MediaScatterer<'_> {
    #[inline(always)]
    fn bsdf(&self) -> Option<&Bsdf<'_>> {
        match self {
            Self::Surface { bsdf, .. } => Some(bsdf),
            Self::Medium { .. } | Self::Absorber => None,
        }
    }

    fn is_in_medium(&self) -> bool {
        matches!(self, Self::Medium { .. })
    }

    fn is_delta(&self) -> bool {
        match self {
            Self::Surface { bsdf, .. } => bsdf.is_delta(),
            Self::Medium { .. } => false,
            Self::Absorber => true,
        }
    }

    fn eval_and_pdf(&self, wi: Vec3) -> (Spectrum, Pdf<SolidAngle>) {
        match self {
            Self::Surface { bsdf, .. } => bsdf.eval_and_pdf(wi),
            Self::Medium { phase, wo } => {
                let pdf = phase.pdf(*wo, wi);
                (Spectrum::splat(pdf.get()), pdf)
            }
            Self::Absorber => (Spectrum::ZERO, Pdf::ZERO),
        }
    }

    #[inline(always)]
    fn sample(&self, u: [f32; 3]) -> Option<BsdfSample> {
        match self {
            Self::Surface { bsdf, .. } => bsdf.sample(u),
            Self::Medium { phase, wo } => {
                let wi = phase.sample(*wo, [u[0], u[1]]);
                let pdf = phase.pdf(*wo, wi);
                pdf.is_positive().then(|| BsdfSample::new(wi, Spectrum::ONE, Some(pdf)))
            }
            Self::Absorber => None,
        }
    }
}
