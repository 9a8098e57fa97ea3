//! Render settings.

use std::fmt;
use std::ops::RangeInclusive;

use pt_math::sampler::{SamplerConfig, SamplerKind};
use pt_scene::Filter;
pub use pt_scene::Hidden;

use crate::film::{Aov, Film, Region};

/// Estimator of direct light at surface points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DirectLight {
    /// Light sampling and BSDF sampling, weighted by the power heuristic. [Veach 1997, §9.2]
    #[default]
    Mis,
    /// Light sampling only.
    Light,
    /// Uniform hemisphere sampling; lights that only light sampling finds are sampled as well.
    UniformHemisphere,
    /// Cosine-weighted hemisphere sampling; lights that only light sampling finds are sampled as
    /// well.
    CosineHemisphere,
}

/// Russian roulette.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Roulette {
    /// Survival probability from the path's throughput, so that all surviving paths carry about the
    /// same.
    #[default]
    Throughput,
    /// Fixed survival probability, in (0, 1].
    Fixed(f32),
}

/// Adaptive sampling: a pixel is finished when 1.96 σ/√n ≤ tolerance · μ of its luminance, checked
/// whenever n is a multiple of `batch`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adaptive {
    /// Number of samples between checks, ≥ 1.
    pub batch: u32,
    /// Half width of the 95 % confidence interval, relative to the mean.
    pub tolerance: f32,
}

/// Error target: condition under which an image is finished.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Largest relative root mean square error of the displayed image
    /// ([`ErrorEstimate`](crate::film::ErrorEstimate)), above 0.
    pub error: Option<f64>,
    /// Largest error, relative to white, that a fraction `confidence` of the pixels may have in
    /// every block of 8 × 8; above 0.
    pub noise: Option<f64>,
    /// True if all pixels have the same number of samples, instead of more where they help most.
    pub uniform: bool,
    /// Fraction of renders that meet the target, in [½, 1).
    pub confidence: f64,
    /// Radiance that is displayed as white, above 0. Brighter values look the same.
    pub white: f64,
}

impl Target {
    /// Target without conditions.
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

/// Largest luminance of a contribution to a sample, by the number of times its light was scattered.
/// A contribution is that of one light sample, or of one emitter or infinite light that a ray hits.
/// Rare bright contributions cause noise (fireflies); clamping them darkens the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clamp {
    /// Limit for light scattered at most once; infinite means no limit.
    pub direct: f32,
    /// Limit for light scattered at least twice; infinite means no limit.
    pub indirect: f32,
}

impl Clamp {
    /// No limit.
    pub const NONE: Self = Self { direct: f32::INFINITY, indirect: f32::INFINITY };

    /// Returns the limit for light scattered `bounces` times.
    #[inline(always)]
    pub fn limit(self, bounces: u32) -> f32 {
        if bounces < 2 { self.direct } else { self.indirect }
    }
}

/// All that an image depends on besides the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of samples per pixel; the maximum with adaptive sampling or an error target.
    pub spp: u32,
    /// Number of samples per pixel for which the sampler is configured, if not `spp`: see
    /// [`SamplerConfig::spp`].
    pub layout: Option<u32>,
    /// Number of samples of each light with an extent at each surface point, from 1 to 65,536.
    pub light_samples: u32,
    /// Maximum number of interactions of a path with surfaces or media: 0 is emission only, 1
    /// direct light.
    pub max_depth: u32,
    /// True if `max_depth` does not count interactions that let light pass undeflected, such as
    /// with thin glass. For the integrator `volpath`, as in Mitsuba's.
    pub straight_is_free: bool,
    /// Only light that was scattered at least this often is shown.
    pub min_bounce: u32,
    /// Only light that was scattered at most this often is shown.
    pub max_bounce: u32,
    /// Name of the integrator.
    pub integrator: String,
    /// Distance in metres beyond which nothing occludes, for the integrator `ao`.
    pub ao_distance: f32,
    /// Estimator of direct light.
    pub direct: DirectLight,
    /// Russian roulette.
    pub roulette: Roulette,
    /// Limits of contributions, applied by all path tracers except the course's.
    pub clamp: Clamp,
    /// Side of the squares of pixels that reuse each other's paths, in pixels; 1 disables path
    /// reuse.
    pub reuse: u32,
    /// Number of paths into which a path is split at the first surface that scatters it, each with
    /// an equal fraction of its throughput: a power of two up to 64.
    pub split: u32,
    /// Adaptive sampling.
    pub adaptive: Option<Adaptive>,
    /// Error target that ends the render, if any, instead of the number of samples.
    pub target: Option<Target>,
    /// Kind of sampler.
    pub sampler: SamplerKind,
    /// Seed of the sampler.
    pub seed: u32,
    /// Pixel reconstruction filter.
    pub filter: Filter,
    /// Pixels to render; `None` for the whole image.
    pub region: Option<Region>,
    /// AOVs to keep.
    pub aovs: Vec<Aov>,
    /// Lights that are hidden from the camera, although they illuminate the scene.
    pub hidden: Hidden,
    /// Light groups whose contributions are kept separately, if any.
    pub light_groups: Option<LightGroups>,
}

/// Light groups, by the names of the lights in the scene. Lights in no group form one more group.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LightGroups {
    /// The groups.
    pub named: Vec<LightGroup>,
    /// True if each light in no group is a group of its own.
    pub each: bool,
}

/// A light group.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightGroup {
    /// Name of the group, of letters, digits and `_`.
    pub name: String,
    /// Names of its lights.
    pub lights: Vec<String>,
}

impl Settings {
    /// Returns the configuration of the sampler.
    pub fn points(&self) -> SamplerConfig {
        let spp = if self.in_halves() { self.spp.div_ceil(2) } else { self.spp };
        SamplerConfig { kind: self.sampler, seed: self.seed, spp: self.layout.unwrap_or(spp) }
    }

    /// Returns true if samples are taken in two independent half buffers.
    pub fn in_halves(&self) -> bool {
        self.target.is_some() || self.aovs.iter().any(|aov| aov.is_of_half())
    }

    /// Creates a film without samples for these pixels.
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
        self.shown_bounces().contains(&bounces)
    }

    /// Numbers of scattering events of the light that is shown.
    #[inline]
    pub fn shown_bounces(&self) -> RangeInclusive<u32> {
        self.min_bounce..=self.max_bounce
    }
}

impl Default for Settings {
    /// Defaults for a clean image of an ordinary scene in little time.
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
