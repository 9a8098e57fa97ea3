//! Paths under way, with their rays.

use pt_core::RenderScene;
use pt_core::footprint::Cone;
use pt_core::light::LightSampleContext;
use pt_math::{Pdf, Ray, SolidAngle, Spectrum};

/// Density of the last BSDF sample; `None` if it was specular, so that light sampling could not
/// have found its direction.
pub(super) type BsdfPdf = Option<Pdf<SolidAngle>>;

/// State of a path, apart from its ray.
#[derive(Clone, Copy)]
pub(super) struct PathState {
    /// Throughput: the product of the weights so far.
    pub(super) beta: Spectrum,
    /// The product of [`pt_core::bsdf::BsdfSample::eta_scale`].
    pub(super) eta_scale: f32,
    /// The surface point, or the point of the lens, that the ray left.
    pub(super) origin: LightSampleContext,
    /// Density with which its direction was sampled there.
    pub(super) bsdf_pdf: BsdfPdf,
    /// Which start it is of; once paths have split, that times their ways, and which way it is.
    pub(super) start: u32,
    /// How clear its way from the camera is, as [`super::transparency`] says.
    pub(super) camera_transmittance: f32,
    /// Where its light goes: see [`super::accumulator::RadianceAccumulator`].
    pub(super) target: u32,
}

impl PathState {
    /// The state of camera ray number `start`, before it hits anything.
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

/// Paths under way and their rays, in the order of their starts.
#[derive(Default)]
pub(super) struct PathQueue {
    pub(super) paths: Vec<PathState>,
    pub(super) rays: Vec<Ray>,
    /// Their cones, if some texture asks for them.
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
