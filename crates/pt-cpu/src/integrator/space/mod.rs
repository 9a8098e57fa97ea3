//! Space between surfaces: a vacuum, or participating media.

mod media;
pub(super) mod shading;
mod vacuum;

use pt_bvh::Hit;
use pt_core::interaction::{Interaction, SurfacePoint};
use pt_core::light::LightSample;
use pt_core::material::EvaluatedMaterial;
use pt_core::scene::RenderScene;
use pt_core::settings::Settings;
use pt_math::sampler::RngStream;
use pt_math::{Ray, Spectrum, Vec3};

pub(super) use self::media::Media;
use self::shading::ShadingPoint;
pub(super) use self::vacuum::Vacuum;
use super::batch::Batch;
use super::context::Context;
use super::dimensions::BounceDimensions;
use super::estimator::PathEstimator;
use super::observer::PathObserver;
use super::path_queue::{PathQueue, PathState};
use super::ray_queue::RayQueue;
use super::scatterer::Scatterer;
use super::split::PathSplitting;
use crate::Tracer;
use crate::trace::ScatterSite;

/// Space between surfaces: free flight of paths, scattering between surfaces, and transmittance of
/// shadow rays.
pub(super) trait Space: Default {
    /// State of a path in the space.
    type PathState: Copy;
    /// State of a shadow ray in the space.
    type ShadowState: Copy;
    /// Vertex reached by a ray.
    type Hit: Copy;
    /// Geometry of a vertex.
    type Interaction: VertexInteraction;
    /// Scattering function at a vertex.
    type Scatterer<'a>: Scatterer;

    /// Sampler dimensions of a bounce.
    fn dimensions(estimator: &impl PathEstimator, cx: Context) -> BounceDimensions;

    /// State of a path at the camera; `stream` returns its random numbers.
    fn at_camera(scene: &RenderScene, stream: impl FnOnce() -> RngStream) -> Self::PathState;

    /// Number of interactions of a path that count towards the maximum depth, of `bounces` in all.
    fn counted(bounces: u32, path: &Self::PathState) -> u32;

    /// Moves all paths to their next vertices; adds the emission of media, and of the transparent
    /// surfaces that the paths pass.
    fn fly<W: PathObserver>(
        &mut self,
        flight: Flight<impl PathEstimator, Self::PathState>,
        batch: &mut Batch<W>,
    );

    /// Ends of the last flight, path by path.
    fn ends(&self) -> impl Iterator<Item = FlightEnd<Self::Hit>>;

    /// The surface, if a vertex is on one.
    fn surface_hit(hit: &Self::Hit) -> Option<&Hit>;

    /// Returns true if a path that had its last interaction may pass a vertex undeflected.
    fn may_pass(settings: &Settings, hit: &Self::Hit) -> bool;

    /// Geometry of the vertex that a ray reached at a time.
    fn interaction(scene: &RenderScene, ray: &Ray, hit: &Self::Hit, time: f32)
    -> Self::Interaction;

    /// Scattering function at a vertex. `is_last` is true after the last interaction of a path.
    fn scatterer<'a>(
        scene: &'a RenderScene,
        at: &Self::Interaction,
        material: Option<&'a EvaluatedMaterial>,
        is_last: bool,
    ) -> Self::Scatterer<'a>;

    /// Description of a vertex for observers; `None` if it scatters no light.
    fn site(at: &Self::Interaction, scatterer: &Self::Scatterer<'_>) -> Option<ScatterSite>;

    /// State of a path that leaves a vertex in the direction `wi`. `path` is its state after the
    /// vertex, and `before` the one before it. `None` if the path ends.
    fn leave(
        vertex: &Departure<Self>,
        before: &PathState,
        path: &mut PathState,
        wi: Vec3,
        stream: impl FnOnce() -> RngStream,
    ) -> Option<Self::PathState>;

    /// State of the shadow ray of a light sample at a vertex; `stream` returns its random numbers.
    fn shadow_state(
        scene: &RenderScene,
        vertex: &ShadingPoint<Self>,
        sample: &LightSample,
        stream: impl FnOnce() -> RngStream,
    ) -> Self::ShadowState;

    /// Calls `add` with the target of each shadow ray, in order, and its value times the
    /// transmittance. `time` returns the time of the rays with a target.
    fn trace_shadow_rays(
        &mut self,
        tracer: &mut Tracer,
        settings: &Settings,
        time: impl Fn(u32) -> f32,
        shadow_rays: &mut RayQueue<Self::ShadowState>,
        add: impl FnMut(u32, Spectrum),
    );
}

/// Paths that fly to their next vertices.
pub(super) struct Flight<'f, R, S> {
    pub(super) estimator: &'f R,
    pub(super) cx: Context<'f>,
    pub(super) dimensions: BounceDimensions,
    /// Number of interactions before.
    pub(super) bounces: u32,
    /// Maximum number of interactions that count.
    pub(super) max_depth: u32,
    /// True if emitters are hidden from the camera.
    pub(super) hides_emitters: bool,
    pub(super) splitting: PathSplitting,
    pub(super) queue: &'f mut PathQueue<S>,
}

/// End of the flight of a path.
#[derive(Clone, Copy)]
pub(super) enum FlightEnd<H> {
    /// The path reached a vertex.
    Vertex(H),
    /// The path left the scene.
    Escaped,
    /// The throughput is zero.
    Absorbed,
}

/// A vertex that a path leaves.
pub(super) struct Departure<'d, 'v, S: Space> {
    pub(super) cx: Context<'d>,
    pub(super) vertex: &'d ShadingPoint<'v, S>,
    /// True after the last interaction of the path.
    pub(super) is_last: bool,
}

/// Geometry of a vertex.
pub(super) trait VertexInteraction: Copy {
    /// The surface, if the vertex is on one.
    fn surface(&self) -> Option<&Interaction>;

    /// Origin of the rays from the vertex.
    fn point(&self) -> SurfacePoint;

    /// Length of the ray that reached the vertex.
    fn distance(&self) -> f32;

    /// Returns true if the vertex is not on a curved surface.
    fn is_flat(&self, scene: &RenderScene) -> bool;
}

impl VertexInteraction for Interaction {
    #[inline(always)]
    fn surface(&self) -> Option<&Interaction> {
        Some(self)
    }

    #[inline(always)]
    fn point(&self) -> SurfacePoint {
        self.point
    }

    #[inline(always)]
    fn distance(&self) -> f32 {
        self.distance
    }

    #[inline(always)]
    fn is_flat(&self, scene: &RenderScene) -> bool {
        scene.is_flat(self.primitive)
    }
}
