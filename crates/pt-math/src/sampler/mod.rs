//! Points for Monte Carlo integration.
//!
//! A [`Sampler`] has no random state: each number is a function of (point set, pixel, sample,
//! dimension), so images do not depend on the order of pixels or samples.

mod independent;
mod lanes;
mod rng_stream;
mod sobol;
mod stratified;
mod zsobol;

pub use lanes::{LANES, Lanes, SamplerBlocks, Samplers};
pub use rng_stream::RngStream;

/// Kind of point set.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' points, pair by pair: less noise from the same number of samples.
    #[default]
    Sobol,
    /// Owen-scrambled Sobol' points of one sequence for many pixels, so that the error is blue
    /// noise across them.
    ZSobol,
    /// Correlated multi-jittered points: one in each cell of a grid.
    Stratified,
    /// Independent uniform numbers.
    Independent,
}

impl SamplerKind {
    /// Each kind with its user-visible name.
    pub const NAMES: [(&'static str, Self); 4] = [
        ("sobol", Self::Sobol),
        ("zsobol", Self::ZSobol),
        ("stratified", Self::Stratified),
        ("independent", Self::Independent),
    ];

    /// Returns the kind with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|&(_, kind)| kind)
    }

    /// Returns true if the points depend on the number of samples, see [`SamplerConfig::spp`].
    pub fn depends_on_spp(self) -> bool {
        matches!(self, Self::ZSobol | Self::Stratified)
    }

    /// User-visible name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::ZSobol => "zsobol",
            Self::Stratified => "stratified",
            Self::Independent => "independent",
        }
    }
}

/// Number of the first sample of the second half. Samples from this number on correspond to those
/// from 0 on, in another point set with independent scrambles. So means of the two halves are
/// independent of each other, even for point sets whose points complement each other.
pub const HALF_B_OFFSET: u32 = 1 << 31;

/// Returns a pixel that differs between the two halves, and the number of a sample in its half. No
/// pixel has so large a row.
#[inline(always)]
fn in_half([x, y]: [u32; 2], sample: u32) -> ([u32; 2], u32) {
    ([x, y | sample & HALF_B_OFFSET], sample & !HALF_B_OFFSET)
}

/// Point set of a render.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct SamplerConfig {
    /// Kind of points.
    pub kind: SamplerKind,
    /// Seed that distinguishes sets of the same kind.
    pub seed: u32,
    /// Samples per pixel for which the points are arranged: the points of [`SamplerKind::ZSobol`]
    /// (which rounds it up to a power of two) and [`SamplerKind::Stratified`] depend on it. Samples
    /// beyond are as good, but do not complement the ones before.
    pub spp: u32,
}

impl SamplerConfig {
    /// Point set of the 2ᵏ parts of all samples; see [`Sampler::split`].
    #[inline(always)]
    fn split(self, log2_parts: u32) -> Self {
        let spp = u64::from(self.spp) << log2_parts;
        Self { spp: u32::try_from(spp).unwrap_or(u32::MAX), ..self }
    }

    /// Key and index of a sample of a pixel, from which its numbers are computed.
    #[inline(always)]
    fn locate(self, pixel: [u32; 2], sample: u32) -> ([u32; 2], u32) {
        let (pixel, sample) = in_half(pixel, sample);
        if self.kind == SamplerKind::ZSobol {
            let log2_run = zsobol::log2_run(self.spp);
            let key = zsobol::key(self.seed, zsobol::square(log2_run, pixel, sample));
            return (key, zsobol::index(log2_run, pixel, sample));
        }
        (pixel_key(self.seed, pixel), sample)
    }
}

/// Random numbers of one sample of one pixel, dimension after dimension.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    set: SamplerConfig,
    /// Next dimension.
    dimension: u32,
    /// See [`SamplerConfig::locate`].
    key: [u32; 2],
    index: u32,
}

impl Sampler {
    /// Creates the sampler of sample number `sample` of a pixel, at dimension 0.
    #[inline]
    pub fn new(set: SamplerConfig, pixel: [u32; 2], sample: u32) -> Self {
        let (key, index) = set.locate(pixel, sample);
        Self { set, dimension: 0, key, index }
    }

    /// The same sample at another dimension, so that the numbers of a bounce do not depend on the
    /// number of dimensions used by the bounces before it.
    #[inline]
    pub fn at_dimension(self, dimension: u32) -> Self {
        Self { dimension, ..self }
    }

    /// Sampler of one of the 2ᵏ parts of the sample (k = `log2_parts`). The parts of all samples
    /// are the points of a set that is arranged for that many samples, and those of one sample are
    /// adjacent in it.
    #[inline]
    pub fn split(self, log2_parts: u32, part: u32) -> Self {
        let set = self.set.split(log2_parts);
        Self { set, index: self.index << log2_parts | part, ..self }
    }

    /// Next dimension.
    #[inline]
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    /// Unbounded stream of independent numbers, a different one for each pair `number` and
    /// reproducible: for algorithms whose consumption is unknown in advance.
    #[inline]
    pub fn stream(&self, number: [u32; 2]) -> RngStream {
        RngStream::new(self.key, self.index, number)
    }

    /// Returns a number in [0, 1); uses one dimension.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let d = self.dimension;
        self.dimension = d.wrapping_add(1);
        match self.set.kind {
            SamplerKind::Sobol | SamplerKind::ZSobol => {
                let seeds = sobol::seeds(self.key, d);
                sobol::number(seeds, self.place(d, seeds[0]))
            }
            SamplerKind::Stratified | SamplerKind::Independent => self.point(d)[0],
        }
    }

    /// Returns a point in [0, 1)²; uses two dimensions.
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        let d = self.dimension;
        self.dimension = d.wrapping_add(2);
        self.point(d)
    }

    /// Point at dimension `d`.
    #[inline]
    fn point(&self, d: u32) -> [f32; 2] {
        match self.set.kind {
            SamplerKind::Sobol | SamplerKind::ZSobol => {
                let seeds = sobol::seeds(self.key, d);
                sobol::point(seeds, self.place(d, seeds[0]))
            }
            SamplerKind::Stratified => stratified::point(self.key, self.set.spp, self.index, d),
            SamplerKind::Independent => independent::point(self.key, self.index, d),
        }
    }

    /// Position of a Sobol' point in the order of dimension `d`.
    #[inline(always)]
    fn place(&self, d: u32, order: u32) -> u32 {
        match self.set.kind {
            SamplerKind::ZSobol => {
                zsobol::place(zsobol::log2_run(self.set.spp), d, order, self.index)
            }
            _ => sobol::place(d, order, self.index),
        }
    }
}

/// Hash of seed and pixel.
#[inline(always)]
fn pixel_key(seed: u32, [x, y]: [u32; 2]) -> [u32; 2] {
    let [k0, k1, _] = independent::pcg3d([x, y, seed]);
    [k0, k1]
}

/// The upper 24 bits as a number in [0, 1): at most 1 − 2⁻²⁴.
#[inline]
fn unit(bits: u32) -> f32 {
    const SCALE: f32 = 1.0 / 16_777_216.0;
    (bits >> 8) as f32 * SCALE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_bits_set_stay_below_one() {
        assert_eq!(unit(u32::MAX), 1.0f32.next_down());
        assert_eq!(unit(0), 0.0);
    }
}
