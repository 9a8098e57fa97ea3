//! How to render.

use std::fmt;

use pt_math::sampler::{SamplerConfig, SamplerKind};
use pt_scene::Filter;
pub use pt_scene::Hidden;

use crate::film::{Aov, Film, Region};

/// How direct light is estimated at each surface point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectLight {
    /// Light sampling and BSDF sampling, weighted by the power heuristic. [Veach 1997, §9.2]
    #[default]
    Mis,
    /// Light sampling only.
    Light,
    /// Directions uniform over the hemisphere; lights that only sampling finds are sampled.
    UniformHemisphere,
    /// Directions with the density of the cosine; likewise.
    CosineHemisphere,
}

/// When a path may end early.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Roulette {
    /// By the path's throughput, so that all paths that go on carry about the same.
    #[default]
    Throughput,
    /// With a fixed probability of going on, in (0, 1].
    Fixed(f32),
}

/// Stop sampling a pixel when 1.96 σ/√n ≤ tolerance · μ of its luminance, checked whenever n is a
/// multiple of `batch`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// Samples between checks, ≥ 1.
    pub batch: u32,
    /// Half width of the 95 % confidence interval, relative to the mean.
    pub tolerance: f32,
}

/// When an image is good enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// The relative root mean square error of the displayed image
    /// ([`ErrorEstimate`](crate::film::ErrorEstimate)), above 0.
    pub error: Option<f64>,
    /// What a share `confidence` of pixels may be off, as a share of white, in every square of 8 ×
    /// 8 pixels; above 0.
    pub noise: Option<f64>,
    /// True if all pixels have the same samples, wherever they help.
    pub uniform: bool,
    /// The share of renders of which the error is as small as this, from ½ to below 1.
    pub confidence: f64,
    /// The least light that the screen shows as white, above 0: more makes no difference.
    pub white: f64,
}

impl Target {
    /// One that asks for nothing.
    pub const NONE: Self =
        Self { error: None, noise: None, uniform: false, confidence: 0.95, white: 1.0 };
}

/// As in "error 0.01, confidence 0.95, white 1".
impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { error, noise, uniform, confidence, white } = self;
        error.map_or(Ok(()), |error| write!(f, "error {error}, "))?;
        noise.map_or(Ok(()), |noise| write!(f, "noise {noise}, "))?;
        if *uniform {
            f.write_str("uniform, ")?;
        }
        write!(f, "confidence {confidence}, white {white}")
    }
}

/// The greatest luminance of a contribution to a sample, by how often its light was scattered: of
/// what one light sample brings, or one surface or the sky that a ray finds. Rare bright
/// contributions make noise; to cut them off makes the image darker than it should be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clamp {
    /// Of light scattered at most once; infinite is no limit.
    pub direct: f32,
    /// Of light scattered at least twice; likewise.
    pub indirect: f32,
}

impl Clamp {
    /// No limit.
    pub const NONE: Self = Self { direct: f32::INFINITY, indirect: f32::INFINITY };

    /// The limit of light scattered `bounces` times.
    #[inline(always)]
    pub fn limit(self, bounces: u32) -> f32 {
        if bounces < 2 { self.direct } else { self.indirect }
    }
}

/// Everything but the scene that an image depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Samples per pixel; the maximum when adaptive, or with a target.
    pub spp: u32,
    /// Samples of a pixel for which random numbers are laid out, if that is not `spp`: see
    /// [`SamplerConfig::spp`].
    pub layout: Option<u32>,
    /// Samples of each light that has an extent, at each surface point; from 1 up to 65,536 make
    /// sense.
    pub light_samples: u32,
    /// Largest number of interactions of a path, with surfaces or media: 0 is emission only, 1
    /// direct light.
    pub max_depth: u32,
    /// True if that counts no interaction of the integrator `volpath` from which light goes
    /// straight on, as through thin glass; as in Mitsuba's.
    pub straight_is_free: bool,
    /// Only light that was scattered at least this often …
    pub min_bounce: u32,
    /// … and at most this often is shown.
    pub max_bounce: u32,
    /// Name of the integrator.
    pub integrator: String,
    /// Distance in metres beyond which nothing occludes, for the integrator `ao`.
    pub ao_distance: f32,
    /// Estimator of direct light.
    pub direct: DirectLight,
    /// When paths end.
    pub roulette: Roulette,
    /// Contributions beyond it are cut off, by path tracers but the course's.
    pub clamp: Clamp,
    /// Side of the squares of pixels, by their columns and rows, whose paths bring their light to
    /// each other; 1 is none.
    pub reuse: u32,
    /// Ways on which a path goes on from the first surface where it scatters, each with its share
    /// of what it carries: a power of two up to 64.
    pub split: u32,
    /// Adaptive sampling.
    pub adaptive: Option<Adaptive>,
    /// When the image is good enough, if not by its samples.
    pub target: Option<Target>,
    /// The kind of random numbers.
    pub sampler: SamplerKind,
    /// Seed of the random numbers.
    pub seed: u32,
    /// Where around its centre a pixel looks.
    pub filter: Filter,
    /// The pixels to render; `None` is all of the image.
    pub region: Option<Region>,
    /// AOVs to keep.
    pub aovs: Vec<Aov>,
    /// What is not seen directly, though it lights.
    pub hidden: Hidden,
    /// Which lights make up which part of the light, if it is to be kept in parts.
    pub light_groups: Option<LightGroups>,
}

/// Groups of lights, by the names of the lights in the scene. Those that are in no group are
/// together in one more.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    /// The groups.
    pub named: Vec<LightGroup>,
    /// True if each light that is in none of them is a group of its own.
    pub each: bool,
}

/// Lights that belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightGroup {
    /// Its name, of letters, digits and `_`.
    pub name: String,
    /// The names of its lights.
    pub lights: Vec<String>,
}

impl Settings {
    /// Where random numbers come from.
    pub fn points(&self) -> SamplerConfig {
        let spp = if self.in_halves() { self.spp.div_ceil(2) } else { self.spp };
        SamplerConfig { kind: self.sampler, seed: self.seed, spp: self.layout.unwrap_or(spp) }
    }

    /// Returns true if samples are taken in two halves that know nothing of each other.
    pub fn in_halves(&self) -> bool {
        self.target.is_some() || self.aovs.iter().any(|aov| aov.is_of_half())
    }

    /// A film without samples, for these pixels.
    pub fn film(&self, region: Region) -> Film {
        let film = Film::with_aovs(region, &self.aovs);
        if self.in_halves() { film.with_half_buffers() } else { film }
    }

    /// Returns true if the film keeps coverage.
    pub fn keeps_alpha(&self) -> bool {
        self.aovs.contains(&Aov::Alpha)
    }

    /// Returns true if light scattered `bounces` times is shown.
    #[inline]
    pub fn shows(&self, bounces: u32) -> bool {
        (self.min_bounce..=self.max_bounce).contains(&bounces)
    }
}

impl Default for Settings {
    /// A clean image of an ordinary scene in little time.
    fn default() -> Self {
        Self {
            spp: 64,
            layout: None,
            light_samples: 1,
            max_depth: 16,
            straight_is_free: false,
            min_bounce: 0,
            max_bounce: u32::MAX,
            integrator: "path".into(),
            ao_distance: f32::INFINITY,
            direct: DirectLight::default(),
            roulette: Roulette::default(),
            clamp: Clamp::NONE,
            reuse: 1,
            split: 1,
            adaptive: None,
            target: None,
            sampler: SamplerKind::default(),
            seed: 0,
            filter: Filter::default(),
            region: None,
            aovs: Vec::new(),
            hidden: Hidden::Nothing,
            light_groups: None,
        }
    }
}
