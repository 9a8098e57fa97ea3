//! Recorded paths of samples: their vertices and contributions.

use pt_core::bsdf::{Bsdf, BsdfSample};
use pt_core::film::InvalidReason;
use pt_core::light::tree::Chosen;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

/// A sample of a pixel.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Its number.
    pub number: u32,
    /// Path of the sample.
    pub trace: Trace,
    /// Weight of the reconstruction filter: 1, unless the filter has negative weights.
    pub weight: f32,
    /// Value added to the film: the sum of the contributions in their order, times the weight.
    pub radiance: Spectrum,
    /// Reason for which the film rejects it, if it does; it then counts as black.
    pub fault: Option<InvalidReason>,
}

/// All that a path met.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Origin of the camera ray, in metres in the world.
    pub eye: Vec3,
    /// The unit direction of the camera ray.
    pub direction: Vec3,
    /// The places where the path was scattered, from the eye on.
    pub vertices: Vec<Vertex>,
    /// All that was added to the sample, in this order.
    pub contributions: Vec<Contribution>,
    /// With several infinite lights: for each contribution of the environment in turn, the
    /// unweighted radiance of each light.
    pub infinite_lights: Vec<Vec<Spectrum>>,
}

/// A place where a path was scattered.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Position, in metres in the world.
    pub p: Vec3,
    /// The surface or medium there.
    pub site: ScatterSite,
    /// Throughput up to there.
    pub throughput: Spectrum,
    /// The sampled direction, if the path continued.
    pub scatter: Option<ScatterSample>,
}

/// Surface or medium that scatters a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScatterSite {
    /// A surface.
    Surface {
        /// The primitive, as in [`pt_bvh::Hit`].
        primitive: u32,
        /// The lobe.
        lobe: &'static str,
        /// What it does to light that it does not send into single directions;
        /// [`ScatterEvent::Specular`] if there is none.
        scatters: ScatterEvent,
    },
    /// A point in a medium.
    Medium {
        /// Its phase function.
        phase: &'static str,
    },
}

/// Direction in which a path continued from a vertex.
#[derive(Clone, Copy, Debug)]
pub struct ScatterSample {
    /// The unit direction.
    pub direction: Vec3,
    /// The density with which it was drawn; `None` where it was the only one of its kind (a Dirac
    /// delta).
    pub pdf: Option<Pdf<SolidAngle>>,
    /// f · |cos| / p, without Russian roulette.
    pub weight: Spectrum,
    /// The probability with which Russian roulette let the path go on, if it was asked.
    pub survival: Option<f32>,
}

/// Something that was added to a sample.
#[derive(Clone, Copy, Debug)]
pub struct Contribution {
    /// At how many of the path's vertices the light was scattered on its way to the eye.
    pub vertices: usize,
    /// Technique and light.
    pub source: LightSource,
    /// Contribution; 0 if occluded.
    pub value: Spectrum,
    /// Luminance removed by clamping.
    pub clamped: f32,
}

/// Technique by which light was found.
#[derive(Clone, Copy, Debug)]
pub enum LightSource {
    /// The path met a surface that glows.
    Emitter {
        /// Where, in metres in the world.
        p: Vec3,
        /// The primitive, as in [`pt_bvh::Hit`].
        primitive: u32,
        /// Radiance emitted towards the path.
        radiance: Spectrum,
        /// The weight against light sampling.
        weight: f32,
        /// True if light sampling might have found it as well.
        is_sampled: bool,
    },
    /// The path left the scene.
    Sky {
        /// Where to, as a unit direction.
        direction: Vec3,
        /// What comes from there.
        radiance: Spectrum,
        /// The weight against light sampling; the mean of several skies.
        weight: f32,
    },
    /// The path went through a medium that emits light, which light sampling never finds.
    Medium {
        /// Its place in [`pt_core::RenderScene::media`].
        medium: u32,
        /// Where to, as a unit direction.
        direction: Vec3,
        /// What comes from there, or an estimate of it.
        radiance: Spectrum,
    },
    /// A light was sampled.
    Light(SampledLight),
    /// Light was looked for in a random direction of the hemisphere.
    Hemisphere {
        /// The unit direction.
        direction: Vec3,
        /// Its density.
        pdf: Pdf<SolidAngle>,
        /// One of so many directions.
        samples: u32,
    },
}

/// A sample of a light.
#[derive(Clone, Copy, Debug)]
pub struct SampledLight {
    /// The light.
    pub light: LightRef,
    /// Which of many it stands for.
    pub chosen: Option<Chosen>,
    /// The unit direction towards it.
    pub direction: Vec3,
    /// The distance to it in metres; infinite for lights that are not in the scene.
    pub distance: f32,
    /// Radiance; for a light that has only one direction, irradiance across that.
    pub radiance: Spectrum,
    /// Density of the direction; `None` if there is only one.
    pub pdf: Option<Pdf<SolidAngle>>,
    /// The weight against BSDF sampling.
    pub weight: f32,
    /// One of so many samples of it.
    pub samples: u32,
}

/// Which light it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightRef {
    /// Its place in [`pt_core::RenderScene::lights`].
    Static(usize),
    /// Its place in [`pt_core::RenderScene::animated_lights`].
    Animated(usize),
}

/// Scattering event of a path expression. [Heckbert 1990, "Adaptive Radiosity Textures for
/// Bidirectional Ray Tracing", §2; `G` and `V` as in Open Shading Language]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ScatterEvent {
    /// `D`: scattered diffusely.
    Diffuse,
    /// `G`: scattered by a rough surface, more into some directions than into others.
    Glossy,
    /// `S`: reflected or refracted into a single direction.
    Specular,
    /// `V`: scattered in a medium.
    Volume,
}

impl ScatterSite {
    /// A primitive that scatters like this.
    pub(crate) fn of(bsdf: &Bsdf, primitive: u32) -> Self {
        let scatters = match bsdf.is_diffuse() {
            _ if bsdf.is_delta() => ScatterEvent::Specular,
            true => ScatterEvent::Diffuse,
            false => ScatterEvent::Glossy,
        };
        Self::Surface { primitive, lobe: bsdf.lobe_name(), scatters }
    }
}

impl ScatterSample {
    /// By this sample, past Russian roulette.
    pub(crate) fn new(sample: &BsdfSample, survival: Option<f32>) -> Self {
        let &BsdfSample { wi, weight, pdf, .. } = sample;
        Self { direction: wi, pdf, weight, survival }
    }
}

impl Vertex {
    /// What happened there to light that the path found by a ray that left it, or, if `is_sampled`,
    /// to light that was looked for in directions of which the material knows nothing.
    ///
    /// A material that is both diffuse and rough, and does not tell the two apart, is glossy.
    pub fn event(&self, is_sampled: bool) -> ScatterEvent {
        let is_delta = !is_sampled && self.scatter.is_some_and(|scatter| scatter.pdf.is_none());
        match self.site {
            ScatterSite::Medium { .. } => ScatterEvent::Volume,
            ScatterSite::Surface { .. } if is_delta => ScatterEvent::Specular,
            ScatterSite::Surface { scatters, .. } => scatters,
        }
    }
}

impl LightSource {
    /// Returns true if the light was asked for, and not found by a ray of the path.
    pub fn is_sampled(&self) -> bool {
        matches!(self, Self::Light(_) | Self::Hemisphere { .. })
    }

    /// The weight of multiple importance sampling, where there is one.
    pub fn weight(&self) -> Option<f32> {
        match self {
            Self::Emitter { weight, .. }
            | Self::Sky { weight, .. }
            | Self::Light(SampledLight { weight, .. }) => Some(*weight),
            Self::Medium { .. } | Self::Hemisphere { .. } => None,
        }
    }
}

impl Trace {
    /// What happened to the light of a contribution on its way, from the eye on.
    pub fn events(
        &self,
        contribution: &Contribution,
    ) -> impl DoubleEndedIterator<Item = ScatterEvent> {
        let (count, is_sampled) = (contribution.vertices, contribution.source.is_sampled());
        let of_path = self.vertices[..count].iter().enumerate();
        of_path.map(move |(i, vertex)| vertex.event(is_sampled && i + 1 == count))
    }
}
