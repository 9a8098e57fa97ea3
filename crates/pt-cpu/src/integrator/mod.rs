//! Integrators: what light camera rays carry. They are chosen once per render, so they are an
//! open table.
//!
//! To add one: write its file, add its line to [`INTEGRATORS`].

mod ao;
mod course;
mod direct;
mod front;
mod grouped;
pub(crate) mod holes;
mod normals;
mod path;
mod reuse;
mod rules;
mod sums;
mod transparency;
mod volpath;
mod wavefront;
mod ways;
mod witness;

use pt_core::film::ExactSum;
use pt_core::settings::DirectLight;
use pt_core::{RenderScene, Settings};
use pt_math::sampler::SamplerBlocks;
use pt_math::{RayColumns, Spectrum};

use crate::Tracer;
use crate::trace::Trace;
use course::Course;
pub(crate) use grouped::Grouped;
use path::Path;
use wavefront::Wavefront;
use witness::{Recorder, Witness};

/// Where samples start: a ray, a sampler and, where it matters, a time for each.
#[derive(Clone, Debug)]
pub struct Starts {
    /// Camera rays; their directions have unit length.
    pub rays: RayColumns,
    /// The samples' numbers.
    pub samplers: SamplerBlocks,
    /// Their times, shares of that for which the shutter is open; none if nothing moves.
    pub times: Vec<f32>,
    /// Where paths bring their light to each other: the groups in order.
    pub groups: Vec<Group>,
}

impl Starts {
    /// The time of a sample, which all of its path has.
    #[inline]
    pub fn time(&self, start: usize) -> f32 {
        self.times.get(start).copied().unwrap_or(0.0)
    }
}

/// Starts of the pixels of a square, with the same samples of each, one pixel behind the other.
#[derive(Clone, Copy, Debug)]
pub struct Group {
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
/// An integrator belongs to one thread of a render. What it holds from call to call is memory to work in, on
/// which no result depends; nor does the radiance of a start depend on other starts than those of its [`Group`].
pub trait Integrator {
    /// Radiance along the ray of each start, in order, in place of what `radiance` held. Dimensions
    /// below [`CAMERA_DIMENSIONS`] are taken by the camera.
    fn radiance(&mut self, tracer: &mut Tracer, starts: &Starts, radiance: &mut Vec<Spectrum>);

    /// Luminance that was cut off from contributions since this was asked for last.
    fn take_removed(&mut self) -> ExactSum {
        ExactSum::default()
    }

    /// Of each start of the last call the share of its ray that nothing scattered or stopped, and behind which no
    /// background is seen: what coverage leaves of 1. None if the settings do not ask for coverage.
    fn transparencies(&self) -> &[f32] {
        &[]
    }

    /// Of each start of the last call in turn the light of each group of lights; none if it does not tell them apart.
    fn parts(&self) -> &[Spectrum] {
        &[]
    }
}

/// An integrator that writes down how its samples come about; the samples are the same.
pub trait Recording: Integrator {
    /// How those of the last call came about, in order; once.
    fn take_traces(&mut self) -> Vec<Trace>;
}

/// Everything that the command line and the manual need to know about an integrator.
pub struct Registration {
    /// Its name for users.
    pub name: &'static str,
    /// One line for the help.
    pub help: &'static str,
    /// What it does besides.
    pub does: &'static [Does],
    /// Makes one for a thread that renders this scene with these settings.
    pub new: New,
    /// Makes one that records, if its samples are sums of what single paths found.
    pub new_recording: Option<NewRecording>,
}

impl Registration {
    /// Whether it does this.
    pub fn does(&self, what: Does) -> bool {
        self.does.contains(&what)
    }
}

/// What some integrators do and others do not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Does {
    /// Under [`DirectLight::Mis`] it finds all light of the sky by BSDF samples, too, and weighs these
    /// against light samples.
    WeighSky,
    /// It sees media; to the others, what fills space is not there.
    SeeMedia,
    /// Its paths may bring their light to each other: [`Settings::reuse`].
    Reuse,
    /// Its paths may split: [`Settings::split`].
    Split,
}

/// Makes an integrator.
pub type New = for<'a> fn(&'a RenderScene, &'a Settings) -> Box<dyn Integrator + 'a>;

/// Makes an integrator that records.
pub type NewRecording = for<'a> fn(&'a RenderScene, &'a Settings) -> Box<dyn Recording + 'a>;

/// All integrators.
pub static INTEGRATORS: &[Registration] = &[
    Registration {
        name: "path",
        help: "light that was scattered up to --max-depth times",
        does: &[Does::WeighSky, Does::Reuse, Does::Split],
        new: |scene, set| Box::new(paths::<()>(scene, set)),
        new_recording: Some(|scene, set| Box::new(paths::<Recorder>(scene, set))),
    },
    Registration {
        name: "volpath",
        help: "the same, with media between surfaces",
        does: &[Does::WeighSky, Does::SeeMedia],
        new: |scene, set| Box::new(volpath::VolPath::<()>::new(scene, set)),
        new_recording: Some(|scene, set| Box::new(volpath::VolPath::<Recorder>::new(scene, set))),
    },
    Registration {
        name: "direct",
        help: "light that was scattered at most once",
        does: &[Does::WeighSky, Does::Split],
        new: |scene, set| Box::new(direct_paths::<()>(scene, set)),
        new_recording: Some(|scene, set| Box::new(direct_paths::<Recorder>(scene, set))),
    },
    Registration {
        name: "ao",
        help: "ambient occlusion: how much of the sky is seen, or is free up to --ao-distance",
        does: &[],
        new: |scene, set| Box::new(ao::AmbientOcclusion::new(scene, set)),
        new_recording: None,
    },
    Registration {
        name: "normals",
        help: "shading normals as colours: (n + 1) / 2",
        does: &[],
        new: |scene, set| Box::new(normals::Normals::new(scene, set)),
        new_recording: None,
    },
    Registration {
        name: "cs184",
        help: "light as the program of the university course computes it",
        does: &[],
        new: |scene, set| Box::new(course_paths::<()>(scene, set)),
        new_recording: Some(|scene, set| Box::new(course_paths::<Recorder>(scene, set))),
    },
];

fn paths<'a, W: Witness>(scene: &'a RenderScene, set: &'a Settings) -> Wavefront<'a, Path, W> {
    Wavefront::new(Path { depth: u32::MAX }, scene, set)
}

fn direct_paths<'a, W: Witness>(
    scene: &'a RenderScene,
    set: &'a Settings,
) -> Wavefront<'a, Path, W> {
    Wavefront::new(Path { depth: 1 }, scene, set)
}

fn course_paths<'a, W: Witness>(
    scene: &'a RenderScene,
    set: &'a Settings,
) -> Wavefront<'a, Course, W> {
    Wavefront::new(Course, scene, set)
}

/// The names of those that can write down how their samples come about.
pub(crate) fn recorded() -> String {
    let known = INTEGRATORS.iter().filter(|known| known.new_recording.is_some());
    known.map(|known| known.name).collect::<Vec<_>>().join(", ")
}

/// The integrator of this name.
pub fn find(name: &str) -> Option<&'static Registration> {
    INTEGRATORS.iter().find(|r| r.name == name)
}

/// Whether a scene that is rendered with these settings may be compiled with
/// [`pt_core::CompileOptions::compensated`]. Beside more light samples than one, that takes from dark
/// directions more than it gives to bright ones.
pub fn compensates(settings: &Settings) -> bool {
    let weighs =
        find(&settings.integrator).is_some_and(|integrator| integrator.does(Does::WeighSky));
    weighs && settings.direct == DirectLight::Mis && settings.light_samples == 1
}

/// Dimensions of the sampler that the camera takes: image and lens.
pub const CAMERA_DIMENSIONS: u32 = 4;

/// The dimension of the sampler that says when a sample is taken: where no bounce comes, and before
/// those of holes.
pub const TIME_DIMENSION: u32 = (1 << 31) - 2;
