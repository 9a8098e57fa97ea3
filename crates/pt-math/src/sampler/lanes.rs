//! The numbers of several samples, side by side.

use super::{Sampler, SamplerKind, independent, sobol};

/// Number of samples side by side.
pub const LANES: usize = 16;

/// One number for each of several samples.
pub type Lanes<T> = [T; LANES];

/// Several samples, of one render and of any of its pixels, at the same dimensions: their numbers
/// are computed in one go, which costs a fraction of one after the other.
///
/// A path that is followed bounce by bounce with others is at the same dimensions as they are.
pub struct Samplers {
    kind: SamplerKind,
    key: [Lanes<u32>; 2],
    sample: Lanes<u32>,
}

impl Samplers {
    /// Side by side in this order; lanes beyond the last one hold numbers that mean nothing.
    #[inline]
    pub fn new(samplers: impl IntoIterator<Item = Sampler>) -> Self {
        let mut lanes =
            Self { kind: SamplerKind::default(), key: [[0; LANES]; 2], sample: [0; LANES] };
        for (lane, s) in samplers.into_iter().take(LANES).enumerate() {
            lanes.kind = s.kind;
            lanes.key[0][lane] = s.key as u32;
            lanes.key[1][lane] = (s.key >> 32) as u32;
            lanes.sample[lane] = s.sample;
        }
        lanes
    }

    /// The points at dimensions `d` and `d` + 1: all first coordinates, then all second ones, the
    /// bits that [`Sampler::next_2d`] gives there. The first coordinate is also what
    /// [`Sampler::next_1d`] gives at `d`.
    #[inline]
    pub fn points(&self, d: u32) -> [Lanes<f32>; 2] {
        match self.kind {
            SamplerKind::Sobol => self.each(|key, sample| sobol::lane_2d(key, sample, d)),
            SamplerKind::Independent => self.each(|key, sample| independent::lane(key, sample, d)),
        }
    }

    #[inline(always)]
    fn each(&self, point: impl Fn([u32; 2], u32) -> [f32; 2]) -> [Lanes<f32>; 2] {
        let [mut xs, mut ys] = [[0.0; LANES]; 2];
        for (i, (x, y)) in xs.iter_mut().zip(&mut ys).enumerate() {
            [*x, *y] = point([self.key[0][i], self.key[1][i]], self.sample[i]);
        }
        [xs, ys]
    }
}
