//! Points for Monte Carlo integration.
//!
//! A [`Sampler`] holds no random state: each number is a function of (point set, pixel, sample,
//! dimension), so images do not depend on the order in which pixels or samples are taken.

mod independent;
mod lanes;
mod rng_stream;
mod sobol;
mod stratified;
mod zsobol;

pub use lanes::{LANES, Lanes, SamplerBlocks, Samplers};
pub use rng_stream::RngStream;

/// The kinds of point sets.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' points, pair by pair: less noise from the same number of samples.
    #[default]
    Sobol,
    /// The same in one sequence for many pixels, so that the error is blue noise across them.
    ZSobol,
    /// Correlated multi-jittered points: one in each cell of a grid.
    Stratified,
    /// Independent uniform numbers.
    Independent,
}

impl SamplerKind {
    /// Each kind with its name for users.
    pub const NAMES: [(&'static str, Self); 4] = [
        ("sobol", Self::Sobol),
        ("zsobol", Self::ZSobol),
        ("stratified", Self::Stratified),
        ("independent", Self::Independent),
    ];

    /// The kind of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|&(_, kind)| kind)
    }

    /// Returns true if its points depend on the number of samples, see [`SamplerConfig::spp`].
    pub fn depends_on_spp(self) -> bool {
        matches!(self, Self::ZSobol | Self::Stratified)
    }

    /// Its name for users.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::ZSobol => "zsobol",
            Self::Stratified => "stratified",
            Self::Independent => "independent",
        }
    }
}

/// The number of the first sample of a second half: a sample of this number and one behind it are,
/// in a point set of their own with scramblings of their own, what those from 0 on are in the
/// first. So means of the two halves are independent of each other, also where points of one are
/// laid out to complete each other.
pub const HALF_B_OFFSET: u32 = 1 << 31;

/// A pixel that is told apart in the two halves, and the number of a sample in its half. No pixel
/// has so large a row.
#[inline(always)]
fn in_half([x, y]: [u32; 2], sample: u32) -> ([u32; 2], u32) {
    ([x, y | sample & HALF_B_OFFSET], sample & !HALF_B_OFFSET)
}

/// The points of a render.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub struct SamplerConfig {
    /// Their kind.
    pub kind: SamplerKind,
    /// What tells sets of the same kind apart.
    pub seed: u32,
    /// Samples of a pixel for which the points are laid out: the numbers of
    /// [`SamplerKind::ZSobol`] (which rounds it up to a power of two) and
    /// [`SamplerKind::Stratified`] depend on it. Samples beyond are as good, but do not
    /// complete the ones before.
    pub spp: u32,
}

impl SamplerConfig {
    /// Key and index of a sample of a pixel, by which its numbers are computed.
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

/// The numbers of one sample of one pixel, dimension after dimension.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    set: SamplerConfig,
    /// The dimension that comes next.
    dimension: u32,
    /// See [`SamplerConfig::locate`].
    key: [u32; 2],
    index: u32,
}

impl Sampler {
    /// The numbers of sample number `sample` of a pixel, from dimension 0.
    #[inline]
    pub fn new(set: SamplerConfig, pixel: [u32; 2], sample: u32) -> Self {
        let (key, index) = set.locate(pixel, sample);
        Self { set, dimension: 0, key, index }
    }

    /// The same sample from another dimension, so that the numbers of a bounce do not depend on
    /// how many the bounces before it took.
    #[inline]
    pub fn at_dimension(self, dimension: u32) -> Self {
        Self { dimension, ..self }
    }

    /// The numbers of a part of the sample: of its 2ᵏ parts (k = `log2_parts`) the one with this
    /// number. The parts of all samples are the points of a set that is laid out for as many,
    /// and those of one sample are next to each other in it.
    #[inline]
    pub fn split(self, log2_parts: u32, part: u32) -> Self {
        let spp = u64::from(self.set.spp) << log2_parts;
        let set = SamplerConfig { spp: u32::try_from(spp).unwrap_or(u32::MAX), ..self.set };
        Self { set, index: self.index << log2_parts | part, ..self }
    }

    /// The dimension that comes next.
    #[inline]
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    /// Independent numbers without end, others for each pair `number`, and the same for each of
    /// them: for what takes more than anybody can tell ahead.
    #[inline]
    pub fn stream(&self, number: [u32; 2]) -> RngStream {
        RngStream::new(self.key, self.index, number)
    }

    /// A number in [0, 1); takes one dimension.
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

    /// A point in [0, 1)²; takes two dimensions.
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        let d = self.dimension;
        self.dimension = d.wrapping_add(2);
        self.point(d)
    }

    /// The point at dimension `d`.
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

    /// The place of a Sobol' point in the order of dimension `d`.
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
