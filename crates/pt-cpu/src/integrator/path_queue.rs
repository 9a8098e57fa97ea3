//! Active paths with their rays.

use pt_core::RenderScene;
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
    /// State of camera ray number `start`, before it hits anything.
    pub(super) fn at_camera(
        scene: &RenderScene,
        ray: &Ray,
        start: u32,
        camera_transmittance: f32,
    ) -> Self {
        Self {
            beta: Spectrum::splat(scene.importance()),
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
#[derive(Default)]
pub(super) struct PathQueue {
    pub(super) paths: Vec<PathState>,
    pub(super) rays: Vec<Ray>,
    /// Ray cones, if some texture needs footprints.
    pub(super) cones: Vec<Cone>,
}

impl PathQueue {
    /// Stores a path, its ray and, with footprints, its cone at an index.
    #[inline(always)]
    pub(super) fn put(&mut self, place: usize, path: PathState, ray: Ray, cone: Option<Cone>) {
        self.paths[place] = path;
        self.rays[place] = ray;
        if let Some(cone) = cone {
            self.cones[place] = cone;
        }
    }

    /// Resizes to `len` paths, with copies of the first path of `like`.
    pub(super) fn resize_like(&mut self, len: usize, like: &Self) {
        let Self { paths, rays, cones } = like;
        self.paths.resize(len, paths[0]);
        self.rays.resize(len, rays[0]);
        if let Some(&cone) = cones.first() {
            self.cones.resize(len, cone);
        }
    }

    pub(super) fn truncate(&mut self, len: u32) {
        self.paths.truncate(len as usize);
        self.rays.truncate(len as usize);
    }
}
