//! Points for Monte Carlo integration.
//!
//! A [`Sampler`] holds no random state: each number is a function of (seed, pixel, sample,
//! dimension), so images do not depend on the order in which pixels or samples are taken.

mod independent;
mod lanes;
mod sobol;

pub use lanes::{LANES, Lanes, SamplerBlocks, Samplers};

/// The kinds of point sets.
#[derive(Clone, Copy, Default, PartialEq, Eq, Debug)]
pub enum SamplerKind {
    /// Owen-scrambled Sobol' points, pair by pair: less noise from the same number of samples.
    #[default]
    Sobol,
    /// Independent uniform numbers.
    Independent,
}

impl SamplerKind {
    /// Each kind with its name for users.
    pub const NAMES: [(&'static str, Self); 2] =
        [("sobol", Self::Sobol), ("independent", Self::Independent)];

    /// The kind of this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| *n == name).map(|&(_, kind)| kind)
    }

    /// Its name for users.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sobol => "sobol",
            Self::Independent => "independent",
        }
    }
}

/// The numbers of one sample of one pixel, dimension after dimension.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    kind: SamplerKind,
    /// The dimension that comes next.
    dimension: u32,
    /// Hash of seed and pixel.
    key: [u32; 2],
    sample: u32,
}

impl Sampler {
    /// The numbers of sample number `sample` of a pixel, from dimension 0.
    #[inline]
    pub fn new(kind: SamplerKind, seed: u32, pixel: [u32; 2], sample: u32) -> Self {
        Self { kind, dimension: 0, key: pixel_key(seed, pixel), sample }
    }

    /// The numbers of another sample of the same pixel, from dimension 0: cheaper than
    /// [`Self::new`], and the same.
    #[inline]
    pub fn with_sample(self, sample: u32) -> Self {
        Self { dimension: 0, sample, ..self }
    }

    /// The same sample from another dimension, so that the numbers of a bounce do not depend on
    /// how many the bounces before it took.
    #[inline]
    pub fn at_dimension(self, dimension: u32) -> Self {
        Self { dimension, ..self }
    }

    /// The dimension that comes next.
    #[inline]
    pub fn dimension(&self) -> u32 {
        self.dimension
    }

    /// A number in [0, 1); takes one dimension.
    #[inline]
    pub fn next_1d(&mut self) -> f32 {
        let d = self.dimension;
        self.dimension = d.wrapping_add(1);
        match self.kind {
            SamplerKind::Sobol => sobol::number(d, sobol::seeds(self.key, d), self.sample),
            SamplerKind::Independent => independent::point(self.key, self.sample, d)[0],
        }
    }

    /// A point in [0, 1)²; takes two dimensions.
    #[inline]
    pub fn next_2d(&mut self) -> [f32; 2] {
        let d = self.dimension;
        self.dimension = d.wrapping_add(2);
        match self.kind {
            SamplerKind::Sobol => sobol::point(d, sobol::seeds(self.key, d), self.sample),
            SamplerKind::Independent => independent::point(self.key, self.sample, d),
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
