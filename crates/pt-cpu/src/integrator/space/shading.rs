//! Shading points of paths.

use pt_core::interaction::SurfacePoint;
use pt_core::light::LightSampleContext;
use pt_math::Spectrum;

use super::Space;
use crate::integrator::path_queue::PathState;
use crate::integrator::scatterer::Scatterer;

/// A path at a vertex.
pub(in crate::integrator) struct ShadingPoint<'a, S: Space> {
    pub(in crate::integrator) point: SurfacePoint,
    pub(in crate::integrator) scatterer: S::Scatterer<'a>,
    /// State of the path in the space between surfaces.
    pub(in crate::integrator) space: S::PathState,
    /// Throughput up to the point; this and the next four as in [`PathState`].
    pub(in crate::integrator) beta: Spectrum,
    pub(in crate::integrator) eta_scale: f32,
    pub(in crate::integrator) camera_transmittance: f32,
    pub(in crate::integrator) start: u32,
    pub(in crate::integrator) target: u32,
    /// Radiance of the path that other paths may take.
    pub(in crate::integrator) shared: Option<SharedRadiance>,
}

impl<S: Space> ShadingPoint<'_, S> {
    /// Accumulates the radiance of the path separately from now on, without the throughput up to
    /// here, which stays in `eta_scale` for Russian roulette.
    pub(in crate::integrator) fn share(&mut self, shared: SharedRadiance) {
        if let SharedRadiance::Diffuse(target) = shared {
            self.eta_scale *= self.beta.max_channel();
            self.beta = Spectrum::ONE;
            self.target = target;
        }
        self.shared = Some(shared);
    }

    /// State of the path at the point, before its next direction is sampled.
    #[inline(always)]
    pub(in crate::integrator) fn path_state(&self) -> PathState {
        PathState {
            beta: self.beta,
            eta_scale: self.eta_scale,
            origin: self.light_sample_context(),
            bsdf_pdf: None,
            start: self.start,
            camera_transmittance: self.camera_transmittance,
            target: self.target,
        }
    }

    /// Context of light samples at the point.
    #[inline(always)]
    pub(in crate::integrator) fn light_sample_context(&self) -> LightSampleContext {
        self.scatterer.light_sample_context(self.point.p)
    }
}

/// Storage of the radiance that other paths may take.
#[derive(Clone, Copy)]
pub(in crate::integrator) enum SharedRadiance {
    /// In one partial sum, since it is the same in all directions.
    Diffuse(u32),
    /// As incident samples of the reuse tile.
    Glossy,
}
