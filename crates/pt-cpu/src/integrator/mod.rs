//! Integrators: what light camera rays carry. They are chosen once per render, so they are an
//! open table.
//!
//! To add one: write its file, add its line to [`INTEGRATORS`].

mod accumulator;
pub(crate) mod alpha;
mod ao;
mod cs184;
mod direct;
mod estimator;
mod light_group_integrator;
mod normals;
mod observer;
mod path;
mod path_queue;
mod reference;
mod reuse;
mod shading;
mod split;
mod transparency;
mod volpath;
mod wavefront;

use pt_core::film::ExactSum;
use pt_core::settings::DirectLight;
use pt_core::{RenderScene, Settings};
use pt_math::sampler::SamplerBlocks;
use pt_math::{RayColumns, Spectrum};

use crate::Tracer;
use crate::trace::Trace;
use cs184::Cs184;
pub(crate) use light_group_integrator::LightGroupIntegrator;
use observer::{PathObserver, PathRecorder};
use path::Path;
use wavefront::Wavefront;

/// Camera rays of a batch, with a sampler and, in animated scenes, a time for each.
#[derive(Clone, Debug)]
pub struct CameraRays {
    /// Camera rays; their directions have unit length.
    pub rays: RayColumns,
    /// The samples' numbers.
    pub samplers: SamplerBlocks,
    /// Their times, shares of that for which the shutter is open; none if nothing moves.
    pub times: Vec<f32>,
    /// Groups of camera rays that reuse paths, in order; empty without path reuse.
    pub groups: Vec<ReuseGroup>,
}

impl CameraRays {
    /// The time of a sample, which all of its path has.
    #[inline]
    pub fn time(&self, start: usize) -> f32 {
        self.times.get(start).copied().unwrap_or(0.0)
    }
}

/// Starts of the pixels of a square, with the same samples of each, one pixel behind the other.
#[derive(Clone, Copy, Debug)]
pub struct ReuseGroup {
    /// Pixels.
    pub pixels: u32,
    /// Samples of each.
    pub samples: u32,
}

/// The largest [`Settings::reuse`].
pub const MAX_REUSE: u32 = 4;

/// The largest [`Settings::split`].
pub const MAX_SPLIT: u32 = 64;

/// The light that camera rays carry: a pure function of scene, settings and start.
///
/// An integrator belongs to one thread of a render. What it holds from call to call is memory to
/// work in, on which no result depends; nor does the radiance of a start depend on other starts
/// than those of its [`ReuseGroup`].
pub trait Integrator {
    /// Radiance along the ray of each start, in order, in place of what `radiance` held. Dimensions
    /// below [`CAMERA_DIMENSIONS`] are taken by the camera.
    fn radiance(
        &mut self,
        tracer: &mut Tracer,
        camera_rays: &CameraRays,
        radiance: &mut Vec<Spectrum>,
    );

    /// Luminance that was cut off from contributions since this was asked for last.
    fn take_clamped(&mut self) -> ExactSum {
        ExactSum::default()
    }

    /// Of each start of the last call the share of its ray that nothing scattered or stopped, and
    /// behind which no background is seen: what coverage leaves of 1. None if the settings do
    /// not ask for coverage.
    fn transparency(&self) -> &[f32] {
        &[]
    }

    /// Of each start of the last call in turn the light of each group of lights; none if it does
    /// not tell them apart.
    fn light_group_radiance(&self) -> &[Spectrum] {
        &[]
    }
}

/// An integrator that writes down how its samples come about; the samples are the same.
pub trait TracedIntegrator: Integrator {
    /// Takes the traces of the samples of the last call, in order.
    fn take_traces(&mut self) -> Vec<Trace>;
}

/// Everything that the command line and the manual need to know about an integrator.
pub struct Registration {
    /// Its name for users.
    pub name: &'static str,
    /// One line for the help.
    pub help: &'static str,
    /// Features that it supports.
    pub features: &'static [Feature],
    /// Makes one for a thread that renders this scene with these settings.
    pub new: New,
    /// Makes one that records, if its samples are sums of what single paths found.
    pub new_traced: Option<NewTraced>,
}

impl Registration {
    /// Returns true if it does this.
    pub fn supports(&self, what: Feature) -> bool {
        self.features.contains(&what)
    }
}

/// Features of integrators that some have and others lack.
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
    /// A largest distance of occluders: [`Settings::ao_distance`].
    OcclusionDistance,
}

/// Makes an integrator.
pub type New = for<'a> fn(&'a RenderScene, &'a Settings) -> Box<dyn Integrator + 'a>;

/// Makes an integrator that records.
pub type NewTraced = for<'a> fn(&'a RenderScene, &'a Settings) -> Box<dyn TracedIntegrator + 'a>;

/// All integrators.
pub static INTEGRATORS: &[Registration] = &[
    Registration {
        name: "path",
        help: "light that was scattered up to --max-depth times",
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
        new: |scene, set| Box::new(volpath::VolPath::<()>::new(scene, set)),
        new_traced: Some(|scene, set| Box::new(volpath::VolPath::<PathRecorder>::new(scene, set))),
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
        help: "ambient occlusion: how much of the sky is seen, or is free up to --ao-distance",
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
    Registration {
        name: "cs184",
        help: "light as the program of the university course computes it",
        features: &[Feature::HemisphereSampling],
        new: |scene, set| Box::new(cs184_paths::<()>(scene, set)),
        new_traced: Some(|scene, set| Box::new(cs184_paths::<PathRecorder>(scene, set))),
    },
];

fn paths<'a, W: PathObserver>(scene: &'a RenderScene, set: &'a Settings) -> Wavefront<'a, Path, W> {
    Wavefront::new(Path { max_depth: u32::MAX }, scene, set)
}

fn direct_paths<'a, W: PathObserver>(
    scene: &'a RenderScene,
    set: &'a Settings,
) -> Wavefront<'a, Path, W> {
    Wavefront::new(Path { max_depth: 1 }, scene, set)
}

fn cs184_paths<'a, W: PathObserver>(
    scene: &'a RenderScene,
    set: &'a Settings,
) -> Wavefront<'a, Cs184, W> {
    Wavefront::new(Cs184, scene, set)
}

/// The names of those that can write down how their samples come about.
pub(crate) fn traced_names() -> String {
    let known = INTEGRATORS.iter().filter(|known| known.new_traced.is_some());
    known.map(|known| known.name).collect::<Vec<_>>().join(", ")
}

/// The integrator of this name.
pub fn by_name(name: &str) -> Option<&'static Registration> {
    INTEGRATORS.iter().find(|r| r.name == name)
}

/// The names of the integrators with a feature, in the order of [`INTEGRATORS`].
pub fn names_with(feature: Feature) -> Vec<&'static str> {
    INTEGRATORS.iter().filter(|known| known.supports(feature)).map(|known| known.name).collect()
}

/// Returns true if a scene that is rendered with these settings may be compiled with
/// [`pt_core::CompileOptions::compensated`]. Beside more light samples than one, that takes from
/// dark directions more than it gives to bright ones.
pub fn uses_mis_compensation(settings: &Settings) -> bool {
    let weighs = by_name(&settings.integrator)
        .is_some_and(|integrator| integrator.supports(Feature::SkyMis));
    weighs && settings.direct == DirectLight::Mis && settings.light_samples == 1
}

/// Dimensions of the sampler that the camera takes: image and lens.
pub const CAMERA_DIMENSIONS: u32 = 4;

/// The dimension of the sampler that says when a sample is taken: where no bounce comes, and before
/// those of holes.
pub const TIME_DIMENSION: u32 = (1 << 31) - 2;
