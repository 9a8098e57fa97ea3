//! Recorded paths of samples: their vertices and contributions.

use pt_core::bsdf::{Bsdf, BsdfSample};
use pt_core::film::InvalidReason;
use pt_core::light::tree::Chosen;
use pt_math::{Pdf, SolidAngle, Spectrum, Vec3};

/// A sample of a pixel.
#[derive(Clone, Debug)]
pub struct Sample {
    /// Number of the sample.
    pub number: u32,
    /// Path of the sample.
    pub trace: Trace,
    /// Weight of the reconstruction filter: 1, unless the filter has negative weights.
    pub weight: f32,
    /// Value added to the film: the sum of the contributions in their order, times the weight.
    pub radiance: Spectrum,
    /// Reason for which the film rejects the sample, if it does; it then counts as black.
    pub fault: Option<InvalidReason>,
}

/// Recorded path.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Origin of the camera ray, in metres in the world.
    pub eye: Vec3,
    /// Unit direction of the camera ray.
    pub direction: Vec3,
    /// Vertices at which the path was scattered, from the camera on.
    pub vertices: Vec<Vertex>,
    /// All contributions to the sample, in this order.
    pub contributions: Vec<Contribution>,
    /// With several infinite lights: for each contribution of the environment in turn, the
    /// unweighted radiance of each light.
    pub infinite_lights: Vec<Vec<Spectrum>>,
}

/// Vertex at which a path was scattered.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Position, in metres in the world.
    pub p: Vec3,
    /// Surface or medium at the vertex.
    pub site: ScatterSite,
    /// Throughput up to the vertex.
    pub throughput: Spectrum,
    /// The sampled direction, if the path continued.
    pub scatter: Option<ScatterSample>,
}

/// Surface or medium that scatters a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScatterSite {
    /// A surface.
    Surface {
        /// Number of the primitive, as in [`pt_bvh::Hit`].
        primitive: u32,
        /// Name of the lobe.
        lobe: &'static str,
        /// Event for light that is not scattered into single directions; [`ScatterEvent::Specular`]
        /// if there is none.
        scatters: ScatterEvent,
    },
    /// A point in a medium.
    Medium {
        /// Name of the phase function.
        phase: &'static str,
    },
}

/// Direction in which a path continued from a vertex.
#[derive(Clone, Copy, Debug)]
pub struct ScatterSample {
    /// Unit direction.
    pub direction: Vec3,
    /// Density with which the direction was sampled; `None` for a Dirac delta.
    pub pdf: Option<Pdf<SolidAngle>>,
    /// f · |cos| / p, without Russian roulette.
    pub weight: Spectrum,
    /// Probability with which Russian roulette continued the path, if it was applied.
    pub survival: Option<f32>,
}

/// Contribution to a sample.
#[derive(Clone, Copy, Debug)]
pub struct Contribution {
    /// Number of the path's vertices at which the light was scattered on its way to the camera.
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
    /// The path hit an emissive surface.
    Emitter {
        /// Position, in metres in the world.
        p: Vec3,
        /// Number of the primitive, as in [`pt_bvh::Hit`].
        primitive: u32,
        /// Radiance emitted towards the path.
        radiance: Spectrum,
        /// MIS weight against light sampling.
        weight: f32,
        /// True if light sampling might have found the emission as well.
        is_sampled: bool,
    },
    /// The path left the scene.
    Sky {
        /// Unit direction of the path.
        direction: Vec3,
        /// Radiance arriving from there.
        radiance: Spectrum,
        /// MIS weight against light sampling; with several infinite lights their mean.
        weight: f32,
    },
    /// The path crossed a medium that emits light, which light sampling never finds.
    Medium {
        /// Index in [`pt_core::RenderScene::media`].
        medium: u32,
        /// Unit direction of the path.
        direction: Vec3,
        /// Radiance arriving from there, or an estimate of it.
        radiance: Spectrum,
    },
    /// A light was sampled.
    Light(SampledLight),
    /// A direction of the hemisphere was sampled for direct light.
    Hemisphere {
        /// Unit direction.
        direction: Vec3,
        /// Density of the direction.
        pdf: Pdf<SolidAngle>,
        /// Number of directions sampled.
        samples: u32,
    },
}

/// A sample of a light.
#[derive(Clone, Copy, Debug)]
pub struct SampledLight {
    /// Sampled light.
    pub light: LightRef,
    /// Light chosen among the many of a light tree.
    pub chosen: Option<Chosen>,
    /// Unit direction towards the light.
    pub direction: Vec3,
    /// Distance to the light in metres; infinite for infinite lights.
    pub distance: f32,
    /// Radiance; for a light with a single direction, irradiance on a surface across it.
    pub radiance: Spectrum,
    /// Density of the direction; `None` for a single direction.
    pub pdf: Option<Pdf<SolidAngle>>,
    /// MIS weight against BSDF sampling.
    pub weight: f32,
    /// Number of samples of the light.
    pub samples: u32,
}

/// Reference to a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LightRef {
    /// Index in [`pt_core::RenderScene::lights`].
    Static(usize),
    /// Index in [`pt_core::RenderScene::animated_lights`].
    Animated(usize),
}

/// Scattering event of a path expression. [Heckbert 1990, "Adaptive Radiosity Textures for
/// Bidirectional Ray Tracing", §2; `G` and `V` as in Open Shading Language]
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ScatterEvent {
    /// `D`: scattered diffusely.
    Diffuse,
    /// `G`: scattered by a rough surface, anisotropically.
    Glossy,
    /// `S`: reflected or refracted into a single direction.
    Specular,
    /// `V`: scattered in a medium.
    Volume,
}

impl ScatterSite {
    /// Site of a primitive with this BSDF.
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
    /// Records a BSDF sample and the survival probability of Russian roulette.
    pub(crate) fn new(sample: &BsdfSample, survival: Option<f32>) -> Self {
        let &BsdfSample { wi, weight, pdf, .. } = sample;
        Self { direction: wi, pdf, weight, survival }
    }
}

impl Vertex {
    /// Scattering event of light that the path found by a ray from the vertex, or, if `is_sampled`,
    /// of light that was sampled in directions independent of the material.
    ///
    /// A material with both diffuse and rough scattering that does not separate the two is glossy.
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
    /// Returns true if the light was sampled, and not found by a ray of the path.
    pub fn is_sampled(&self) -> bool {
        matches!(self, Self::Light(_) | Self::Hemisphere { .. })
    }

    /// MIS weight, if multiple importance sampling applies.
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
    /// Scattering events of a contribution, from the camera on.
    pub fn events(
        &self,
        contribution: &Contribution,
    ) -> impl DoubleEndedIterator<Item = ScatterEvent> {
        let (count, is_sampled) = (contribution.vertices, contribution.source.is_sampled());
        let of_path = self.vertices[..count].iter().enumerate();
        of_path.map(move |(i, vertex)| vertex.event(is_sampled && i + 1 == count))
    }
}
