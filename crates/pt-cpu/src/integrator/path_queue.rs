//! Active paths with their rays.

use pt_core::footprint::Cone;
use pt_core::light::LightSampleContext;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum};

/// Density of the last BSDF sample; `None` if it was specular, so that light sampling could not
/// have sampled its direction.
pub(super) type BsdfPdf = Option<Pdf<SolidAngle>>;

/// State of a path, apart from its ray.
#[derive(Clone, Copy)]
pub(super) struct PathState {
    /// Throughput: the product of the weights so far.
    pub(super) beta: Spectrum,
    /// Product of [`pt_core::bsdf::BsdfSample::eta_scale`].
    pub(super) eta_scale: f32,
    /// Surface point, or point of the lens, from which the ray starts.
    pub(super) origin: LightSampleContext,
    /// Density with which the direction of the ray was sampled there.
    pub(super) bsdf_pdf: BsdfPdf,
    /// Number of the camera ray; after path splitting, the path index of
    /// [`super::split::PathSplitting`].
    pub(super) start: u32,
    /// Transmittance from the camera to the path; see [`super::transparency`].
    pub(super) camera_transmittance: f32,
    /// Index of the sum for its contributions: see [`super::accumulator::RadianceAccumulator`].
    pub(super) target: u32,
}

impl PathState {
    /// State of camera ray number `start`, before it hits anything; `importance` is that of the
    /// scene.
    pub(super) fn at_camera(
        importance: f32,
        ray: &Ray,
        start: u32,
        camera_transmittance: f32,
    ) -> Self {
        Self {
            beta: Spectrum::splat(importance),
            eta_scale: 1.0,
            origin: LightSampleContext::in_space(ray.origin),
            bsdf_pdf: None,
            start,
            camera_transmittance,
            target: start,
        }
    }
}

/// Active paths and their rays, in the order of their camera rays.
pub(super) struct PathQueue<S> {
    pub(super) paths: Vec<PathState>,
    pub(super) rays: Vec<Ray>,
    /// States of the paths in the space between surfaces.
    pub(super) space: Vec<S>,
    /// Ray cones, if some texture needs footprints.
    pub(super) cones: Option<Vec<Cone>>,
}

impl<S> PathQueue<S> {
    pub(super) fn new(uses_footprints: bool) -> Self {
        Self {
            paths: Vec::new(),
            rays: Vec::new(),
            space: Vec::new(),
            cones: uses_footprints.then(Vec::new),
        }
    }

    pub(super) fn clear(&mut self) {
        self.paths.clear();
        self.rays.clear();
        self.space.clear();
        if let Some(cones) = &mut self.cones {
            cones.clear();
        }
    }

    /// Adds a path with its ray and, with footprints, its cone.
    #[inline(always)]
    pub(super) fn push(
        &mut self,
        path: PathState,
        ray: Ray,
        space: S,
        cone: impl FnOnce() -> Option<Cone>,
    ) {
        self.paths.push(path);
        self.rays.push(ray);
        self.space.push(space);
        if let Some(cones) = &mut self.cones {
            cones.extend(cone());
        }
    }

    /// Ray cone of path number `i`, with footprints.
    #[inline(always)]
    pub(super) fn cone(&self, i: usize) -> Option<&Cone> {
        self.cones.as_ref().map(|cones| &cones[i])
    }
}
