//! Values of options that are one of several words.

use clap::ValueEnum;
use pathtracer::{Builder, DirectLight, SamplerKind};

/// Estimators of direct light.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Direct {
    /// Multiple importance sampling of lights and BSDF
    Mis,
    /// Light sampling
    Light,
    /// Uniform hemisphere sampling
    Hemisphere,
    /// Cosine-weighted hemisphere sampling
    Cosine,
}

impl From<Direct> for DirectLight {
    fn from(d: Direct) -> Self {
        match d {
            Direct::Mis => Self::Mis,
            Direct::Light => Self::Light,
            Direct::Hemisphere => Self::UniformHemisphere,
            Direct::Cosine => Self::CosineHemisphere,
        }
    }
}

/// Components of the light, selected by the number of interactions.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum Show {
    /// Emission seen directly
    Emission,
    /// Emission, and light scattered once
    Direct,
    /// Light scattered at least twice
    Indirect,
    /// All light
    Global,
}

impl Show {
    /// Minimum and maximum number of interactions.
    pub(crate) fn bounces(self) -> (u32, u32) {
        match self {
            Self::Emission => (0, 0),
            Self::Direct => (0, 1),
            Self::Indirect => (2, u32::MAX),
            Self::Global => (0, u32::MAX),
        }
    }
}

/// Builders of the hierarchy.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Bvh {
    /// Surface area heuristic
    Sah,
    /// Split at the mean centroid along the longest axis, as in the course
    Mean,
    /// No tree
    None,
}

impl From<Bvh> for Builder {
    fn from(b: Bvh) -> Self {
        match b {
            Bvh::Sah => Self::Sah,
            Bvh::Mean => Self::Mean,
            Bvh::None => Self::None,
        }
    }
}

/// Build qualities of the hierarchy.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Quality {
    /// Fast build, slower traversal
    Fast,
    /// Spatial splits where there are many long thin triangles
    Balanced,
    /// More split candidates and finer spatial splits
    High,
}

impl From<Quality> for pathtracer::Quality {
    fn from(q: Quality) -> Self {
        match q {
            Quality::Fast => Self::Fast,
            Quality::Balanced => Self::Balanced,
            Quality::High => Self::High,
        }
    }
}

/// Bits per channel of a PNG file.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum PngBits {
    /// 256 levels
    #[value(name = "8")]
    Eight,
    /// 65,536 levels
    #[value(name = "16")]
    Sixteen,
}

/// Kinds of progress display.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum ProgressKind {
    /// Bar on a terminal, lines elsewhere
    Auto,
    /// Progress bar
    Bar,
    /// A line every ten seconds
    Lines,
    /// An object of JSON twice a second
    Json,
    /// Nothing
    None,
}

/// Amount of metadata written into an image.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum ReceiptKind {
    /// All metadata
    Full,
    /// Metadata that are the same in all renders of an image, so that its files are equal
    Stable,
    /// Nothing
    None,
}

/// Sample generators.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Sampler {
    /// Owen-scrambled Sobol' points
    Sobol,
    /// Sobol' points in Morton order: blue-noise error distribution
    Zsobol,
    /// Correlated multi-jittered points
    Stratified,
    /// Independent random numbers
    Independent,
}

impl From<Sampler> for SamplerKind {
    fn from(s: Sampler) -> Self {
        match s {
            Sampler::Sobol => Self::Sobol,
            Sampler::Zsobol => Self::ZSobol,
            Sampler::Stratified => Self::Stratified,
            Sampler::Independent => Self::Independent,
        }
    }
}

/// Reconstruction filters.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Filter {
    /// The pixel's square alike
    Box,
    /// A pyramid, 2 pixels wide
    Tent,
    /// A Gaussian of standard deviation 0.5 that ends at 2 pixels
    Gaussian,
    /// The cubic of Mitchell and Netravali with B = C = 1/3
    Mitchell,
    /// The 4-term window, 3 pixels wide
    BlackmanHarris,
    /// The interpolating cubic
    CatmullRom,
    /// A sinc with 3 lobes
    Lanczos,
}

impl From<Filter> for pathtracer::Filter {
    fn from(f: Filter) -> Self {
        match f {
            Filter::Box => Self::Box,
            Filter::Tent => Self::TENT,
            Filter::Gaussian => Self::GAUSSIAN,
            Filter::Mitchell => Self::MITCHELL,
            Filter::BlackmanHarris => Self::BLACKMAN_HARRIS,
            Filter::CatmullRom => Self::CATMULL_ROM,
            Filter::Lanczos => Self::LANCZOS,
        }
    }
}
