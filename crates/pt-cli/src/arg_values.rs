//! Values of options that are one of several words.

use clap::ValueEnum;
use pathtracer::image::{Compression, Precision, ToneCurve};
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
pub(crate) enum BvhBuilder {
    /// Surface area heuristic
    Sah,
    /// Split at the mean centroid along the longest axis, as in the course
    Mean,
    /// No tree
    None,
}

impl From<BvhBuilder> for Builder {
    fn from(b: BvhBuilder) -> Self {
        match b {
            BvhBuilder::Sah => Self::Sah,
            BvhBuilder::Mean => Self::Mean,
            BvhBuilder::None => Self::None,
        }
    }
}

/// Build qualities of the hierarchy.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum BvhQuality {
    /// Fast build, slower traversal
    Fast,
    /// Spatial splits where there are many long thin triangles
    Balanced,
    /// More split candidates and finer spatial splits
    High,
}

impl From<BvhQuality> for pathtracer::Quality {
    fn from(q: BvhQuality) -> Self {
        match q {
            BvhQuality::Fast => Self::Fast,
            BvhQuality::Balanced => Self::Balanced,
            BvhQuality::High => Self::High,
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
    /// Metadata that are equal in all renders of an image, so that its files are identical
    Stable,
    /// Nothing
    None,
}

/// Sample generators.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum SampleGenerator {
    /// Owen-scrambled Sobol' points
    Sobol,
    /// Sobol' points in Morton order: blue-noise error distribution
    Zsobol,
    /// Correlated multi-jittered points
    Stratified,
    /// Independent random numbers
    Independent,
}

impl From<SampleGenerator> for SamplerKind {
    fn from(s: SampleGenerator) -> Self {
        match s {
            SampleGenerator::Sobol => Self::Sobol,
            SampleGenerator::Zsobol => Self::ZSobol,
            SampleGenerator::Stratified => Self::Stratified,
            SampleGenerator::Independent => Self::Independent,
        }
    }
}

/// Reconstruction filters.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum PixelFilter {
    /// Uniform weight over the pixel
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

impl From<PixelFilter> for pathtracer::Filter {
    fn from(f: PixelFilter) -> Self {
        match f {
            PixelFilter::Box => Self::Box,
            PixelFilter::Tent => Self::TENT,
            PixelFilter::Gaussian => Self::GAUSSIAN,
            PixelFilter::Mitchell => Self::MITCHELL,
            PixelFilter::BlackmanHarris => Self::BLACKMAN_HARRIS,
            PixelFilter::CatmullRom => Self::CATMULL_ROM,
            PixelFilter::Lanczos => Self::LANCZOS,
        }
    }
}

/// Tone curves.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum Tonemap {
    /// No curve, clipped at white
    Linear,
    /// The curve of film of Hable (2010) in each channel
    Filmic,
    /// AgX of Sobotka, without a look
    Agx,
    /// ACES as fitted by Hill; darker than the others
    Aces,
    /// Khronos PBR Neutral: colours up to 0.8 stay
    PbrNeutral,
}

impl From<Tonemap> for ToneCurve {
    fn from(t: Tonemap) -> Self {
        match t {
            Tonemap::Linear => Self::Linear,
            Tonemap::Filmic => Self::Filmic,
            Tonemap::Agx => Self::Agx,
            Tonemap::Aces => Self::Aces,
            Tonemap::PbrNeutral => Self::PbrNeutral,
        }
    }
}

/// Pixel types of an OpenEXR file.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum ExrType {
    /// 16 bits, up to 65504, for colours, albedo and normals; 32 for the rest
    Half,
    /// 32 bits
    Float,
}

impl From<ExrType> for Precision {
    fn from(t: ExrType) -> Self {
        match t {
            ExrType::Half => Self::Half,
            ExrType::Float => Self::Float,
        }
    }
}

/// Compressions of an OpenEXR file.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub(crate) enum ExrCompression {
    /// No compression
    None,
    /// Runs of equal bytes
    Rle,
    /// Deflate, line by line
    Zips,
    /// Deflate, 16 lines at a time
    Zip,
    /// Wavelets, for noisy images
    Piz,
    /// Deflate; keeps 24 of 32 bits
    Pxr24,
    /// Blocks of 4 x 4 halves, with losses; float is kept as it is
    B44,
    /// As b44, with smaller blocks in flat areas
    B44a,
}

impl From<ExrCompression> for Compression {
    fn from(c: ExrCompression) -> Self {
        match c {
            ExrCompression::None => Self::None,
            ExrCompression::Rle => Self::Rle,
            ExrCompression::Zips => Self::Zips,
            ExrCompression::Zip => Self::Zip,
            ExrCompression::Piz => Self::Piz,
            ExrCompression::Pxr24 => Self::Pxr24,
            ExrCompression::B44 => Self::B44,
            ExrCompression::B44a => Self::B44a,
        }
    }
}

/// Values of a switch.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq)]
pub(crate) enum Switch {
    /// Yes
    On,
    /// No, even if the file asks for it
    Off,
}
