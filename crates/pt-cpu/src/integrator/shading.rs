//! Shading points of paths.

use pt_core::bsdf::Bsdf;
use pt_core::interaction::SurfacePoint;
use pt_core::light::LightSampleContext;
use pt_math::Spectrum;

use super::path_queue::PathState;

/// A path at a surface.
pub(super) struct ShadingPoint<'a> {
    pub(super) point: SurfacePoint,
    pub(super) bsdf: Bsdf<'a>,
    /// Throughput up to the point; this and the next four as in [`super::path_queue::PathState`].
    pub(super) beta: Spectrum,
    pub(super) eta_scale: f32,
    pub(super) camera_transmittance: f32,
    pub(super) start: u32,
    pub(super) target: u32,
    /// Radiance of the path that other paths may take.
    pub(super) shared: Option<SharedRadiance>,
}

impl ShadingPoint<'_> {
    /// Accumulates the radiance of the path separately from now on, without the throughput up to
    /// here, which stays in `eta_scale` for Russian roulette.
    pub(super) fn share(&mut self, shared: SharedRadiance) {
        if let SharedRadiance::Diffuse(target) = shared {
            self.eta_scale *= self.beta.max_channel();
            self.beta = Spectrum::ONE;
            self.target = target;
        }
        self.shared = Some(shared);
    }

    /// State of the path at the point, before its next direction is sampled.
    #[inline(always)]
    pub(super) fn path_state(&self) -> PathState {
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
    pub(super) fn light_sample_context(&self) -> LightSampleContext {
        self.bsdf.light_sample_context(self.point.p)
    }
}

/// Storage of the radiance that other paths may take.
#[derive(Clone, Copy)]
pub(super) enum SharedRadiance {
    /// In one partial sum, since it is the same in all directions.
    Diffuse(u32),
    /// As incident samples of the reuse tile.
    Glossy,
}
