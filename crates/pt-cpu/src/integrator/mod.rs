//! Integrators: estimators of the radiance along camera rays. One is chosen per render by name,
//! from an open table.
//!
//! To add one: write its file, add its line to [`INTEGRATORS`].

mod accumulator;
pub(crate) mod alpha;
mod ao;
mod batch;
mod compat;
mod context;
mod dimensions;
mod direct;
mod estimator;
mod light_group_integrator;
mod light_sampling;
mod lobe_order;
mod normals;
mod observer;
mod path;
mod path_queue;
mod ray_queue;
mod reference;
mod reuse;
mod scatterer;
mod space;
mod split;
mod transparency;
mod wavefront;

pub(crate) use light_group_integrator::LightGroupIntegrator;
use observer::{PathObserver, PathRecorder};
use path::Path;
use pt_core::settings::DirectLight;
use pt_core::{RenderScene, Settings};
use pt_math::sampler::SamplerBlocks;
use pt_math::{RayColumns, Spectrum};
use space::{Media, Vacuum};
use wavefront::Wavefront;

use crate::Tracer;
use crate::trace::Trace;

/// Camera rays of a batch, with a sampler and, in animated scenes, a time for each.
#[derive(Clone, Debug)]
pub struct CameraRays {
    /// Camera rays; their directions have unit length.
    pub rays: RayColumns,
    /// Samplers of the camera rays.
    pub samplers: SamplerBlocks,
    /// Times of the camera rays, as fractions of the shutter interval; `None` in static scenes.
    pub times: Option<Vec<f32>>,
    /// Groups of camera rays that reuse paths, in order; without path reuse, each has one pixel.
    pub groups: Vec<ReuseGroup>,
}

impl CameraRays {
    /// Time of a sample and of its whole path; 0 in static scenes, and beyond the camera rays.
    #[inline]
    pub fn time(&self, start: usize) -> f32 {
        self.times.as_ref().and_then(|times| times.get(start)).copied().unwrap_or(0.0)
    }
}

/// Camera rays of the pixels of a square that reuse paths, with the same samples of each, pixel by
/// pixel.
#[derive(Clone, Copy, Debug)]
pub struct ReuseGroup {
    /// Number of pixels.
    pub pixels: u32,
    /// Number of samples per pixel.
    pub samples: u32,
}

/// Maximum of [`Settings::reuse`].
pub const MAX_REUSE: u32 = 4;

/// Maximum of [`Settings::split`].
pub const MAX_SPLIT: u32 = 64;

/// Estimator of the radiance along camera rays: a pure function of scene, settings and camera ray.
///
/// An integrator belongs to one thread of a render. Its state between calls consists of buffers
/// only, on which no result depends. The radiance of a camera ray does not depend on other camera
/// rays than those of its [`ReuseGroup`].
pub trait Integrator {
    /// Replaces the contents of `radiance` by the radiance along each camera ray, in order.
    /// Dimensions below [`CAMERA_DIMENSIONS`] are used by the camera.
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    );

    /// Returns the luminance that clamping removed in the last call: each time with the number of
    /// the camera ray.
    fn take_clamped(&mut self) -> Vec<(u32, f32)> {
        Vec::new()
    }

    /// For each camera ray of the last call, the fraction of it that was neither scattered nor
    /// absorbed and shows no background: 1 minus the coverage. `None` if the settings do not
    /// require coverage.
    fn transparency(&self) -> Option<&[f32]> {
        None
    }

    /// For each camera ray of the last call in turn, the radiance of each light group; `None` if
    /// the integrator does not separate them.
    fn light_group_radiance(&self) -> Option<&[Spectrum]> {
        None
    }
}

/// Integrator that records the construction of its samples; the samples are the same.
pub trait TracedIntegrator: Integrator {
    /// Takes the traces of the samples of the last call, in order.
    fn take_traces(&mut self) -> Vec<Trace>;
}

/// Entry of an integrator in the table.
pub struct Registration {
    /// User-visible name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Supported features.
    pub features: &'static [Feature],
    /// Creates an integrator for a thread that renders this scene with these settings.
    pub new: New,
    /// Creates an integrator that records paths, if its samples are sums of contributions of single
    /// paths.
    pub new_traced: Option<NewTraced>,
}

impl Registration {
    /// Returns true if the integrator supports a feature.
    pub fn supports(&self, what: Feature) -> bool {
        self.features.contains(&what)
    }
}

/// Optional features of integrators.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feature {
    /// Multiple importance sampling of infinite lights under [`DirectLight::Mis`]: BSDF samples
    /// find all their light, too.
    SkyMis,
    /// Participating media; other integrators ignore them.
    Media,
    /// Path reuse: [`Settings::reuse`].
    Reuse,
    /// Path splitting: [`Settings::split`].
    Split,
    /// Clamping of contributions: [`Settings::clamp`].
    Clamp,
    /// Direct light by directions of the hemisphere: [`DirectLight::UniformHemisphere`] and
    /// [`DirectLight::CosineHemisphere`].
    HemisphereSampling,
    /// Maximum distance of occluders: [`Settings::ao_distance`].
    OcclusionDistance,
}

/// Constructor of an integrator.
pub type New = for<'a> fn(&'a RenderScene, &'a Settings) -> Box<dyn Integrator + 'a>;

/// Constructor of an integrator that records paths.
pub type NewTraced = for<'a> fn(&'a RenderScene, &'a Settings) -> Box<dyn TracedIntegrator + 'a>;

/// Table of all integrators.
pub static INTEGRATORS: &[Registration] = &[
    Registration {
        name: "path",
        help: "light that was scattered up to the maximum depth",
        features: &[
            Feature::SkyMis,
            Feature::Reuse,
            Feature::Split,
            Feature::Clamp,
            Feature::HemisphereSampling,
        ],
        new: |scene, set| Box::new(paths::<()>(scene, set)),
        new_traced: Some(|scene, set| Box::new(paths::<PathRecorder>(scene, set))),
    },
    Registration {
        name: "reference",
        help: "the same by the shortest code, one path at a time: slow, with the bits of path",
        features: &[Feature::SkyMis, Feature::Clamp],
        new: |scene, set| Box::new(reference::Reference::<()>::new(scene, set)),
        new_traced: Some(|scene, set| {
            Box::new(reference::Reference::<PathRecorder>::new(scene, set))
        }),
    },
    Registration {
        name: "volpath",
        help: "as path, with media between surfaces",
        features: &[Feature::SkyMis, Feature::Media, Feature::Clamp],
        new: |scene, set| Box::new(paths_in_media::<()>(scene, set)),
        new_traced: Some(|scene, set| Box::new(paths_in_media::<PathRecorder>(scene, set))),
    },
    Registration {
        name: "direct",
        help: "light that was scattered at most once",
        features: &[Feature::SkyMis, Feature::Split, Feature::Clamp, Feature::HemisphereSampling],
        new: |scene, set| Box::new(direct_paths::<()>(scene, set)),
        new_traced: Some(|scene, set| Box::new(direct_paths::<PathRecorder>(scene, set))),
    },
    Registration {
        name: "ao",
        help: "ambient occlusion: the fraction of the sky that is visible, or free of occluders up to a distance",
        features: &[Feature::OcclusionDistance],
        new: |scene, set| Box::new(ao::AmbientOcclusion::new(scene, set)),
        new_traced: None,
    },
    Registration {
        name: "normals",
        help: "shading normals as colours: (n + 1) / 2",
        features: &[],
        new: |scene, set| Box::new(normals::Normals::new(scene, set)),
        new_traced: None,
    },
    compat::REGISTRATION,
];

/// Driver of paths in a vacuum.
type Surfaces<'a, R, W> = Wavefront<'a, R, Vacuum, W>;

fn paths<'a, W: PathObserver>(scene: &'a RenderScene, set: &'a Settings) -> Surfaces<'a, Path, W> {
    Wavefront::new(Path::new(set), scene, set)
}

fn paths_in_media<'a, W: PathObserver>(
    scene: &'a RenderScene,
    set: &'a Settings,
) -> Wavefront<'a, Path, Media, W> {
    Wavefront::new(Path::without_hemisphere_sampling(set), scene, set)
}

fn direct_paths<'a, W: PathObserver>(
    scene: &'a RenderScene,
    set: &'a Settings,
) -> Surfaces<'a, Path, W> {
    Wavefront::new(Path::once_scattered(set), scene, set)
}

/// Names of the integrators that can record paths.
pub(crate) fn traced_names() -> String {
    let known = INTEGRATORS.iter().filter(|known| known.new_traced.is_some());
    known.map(|known| known.name).collect::<Vec<_>>().join(", ")
}

/// Returns the integrator with this name.
pub fn by_name(name: &str) -> Option<&'static Registration> {
    INTEGRATORS.iter().find(|r| r.name == name)
}

/// Names of the integrators with a feature, in the order of [`INTEGRATORS`].
pub fn names_with(feature: Feature) -> Vec<&'static str> {
    INTEGRATORS.iter().filter(|known| known.supports(feature)).map(|known| known.name).collect()
}

/// Returns true if a scene that is rendered with these settings may be compiled with
/// [`pt_core::CompileOptions::compensated`]. With more than one light sample, compensation would
/// take more from dark directions than it gives to bright ones.
pub fn uses_mis_compensation(settings: &Settings) -> bool {
    let weighs = by_name(&settings.integrator)
        .is_some_and(|integrator| integrator.supports(Feature::SkyMis));
    weighs && settings.direct == DirectLight::Mis && settings.light_samples == 1
}

/// Number of sampler dimensions used by the camera: image and lens.
pub const CAMERA_DIMENSIONS: u32 = 4;

/// Sampler dimension of the time of a sample: beyond those of bounces, and before those of alpha.
pub const TIME_DIMENSION: u32 = (1 << 31) - 2;
