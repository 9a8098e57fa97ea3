//! The numbers of several samples, side by side.

use std::ops::Range;

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
            lanes.key[0][lane] = s.key[0];
            lanes.key[1][lane] = s.key[1];
            lanes.sample[lane] = s.sample;
        }
        lanes
    }

    /// The points at dimensions `d` and `d` + 1: all first coordinates, then all second ones, the
    /// bits that [`Sampler::next_2d`] gives there. The first coordinate is also what
    /// [`Sampler::next_1d`] gives at `d`.
    #[inline]
    pub fn points(&self, d: u32) -> [Lanes<f32>; 2] {
        points(self.kind, self.key.each_ref(), &self.sample, d)
    }
}

/// The points of samples at dimension `d`.
#[inline]
fn points(
    kind: SamplerKind,
    key: [&Lanes<u32>; 2],
    sample: &Lanes<u32>,
    d: u32,
) -> [Lanes<f32>; 2] {
    let lane = |i: usize| ([key[0][i], key[1][i]], sample[i]);
    match kind {
        SamplerKind::Sobol if key.into_iter().all(is_uniform) => {
            let seeds = sobol::seeds([key[0][0], key[1][0]], d);
            each(|i| sobol::point(seeds, sample[i]))
        }
        SamplerKind::Sobol => each(|i| {
            let (key, sample) = lane(i);
            sobol::point(sobol::seeds(key, d), sample)
        }),
        SamplerKind::Independent => each(|i| {
            let (key, sample) = lane(i);
            independent::point(key, sample, d)
        }),
    }
}

/// Whether all words are the same, as those of the key are in one pixel.
#[inline(always)]
fn is_uniform(words: &Lanes<u32>) -> bool {
    words.iter().fold(0, |differences, w| differences | (w ^ words[0])) == 0
}

#[inline(always)]
fn each(point: impl Fn(usize) -> [f32; 2]) -> [Lanes<f32>; 2] {
    let [mut xs, mut ys] = [[0.0; LANES]; 2];
    for (i, (x, y)) in xs.iter_mut().zip(&mut ys).enumerate() {
        [*x, *y] = point(i);
    }
    [xs, ys]
}

/// The samplers of many samples of one render, in columns.
#[derive(Clone, Debug, Default)]
pub struct SamplerColumns {
    kind: SamplerKind,
    key: [Vec<u32>; 2],
    sample: Vec<u32>,
}

impl SamplerColumns {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.sample.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.sample.is_empty()
    }

    /// Forgets all.
    pub fn clear(&mut self) {
        self.key.iter_mut().for_each(Vec::clear);
        self.sample.clear();
    }

    /// Appends consecutive samples of the pixel of a sampler.
    #[inline]
    pub fn extend(&mut self, of_pixel: Sampler, samples: Range<u32>) {
        self.kind = of_pixel.kind;
        self.sample.extend(samples);
        for (column, word) in self.key.iter_mut().zip(of_pixel.key) {
            column.resize(self.sample.len(), word);
        }
    }

    /// Number `i`, at dimension 0.
    ///
    /// # Panics
    /// If there are not so many.
    #[inline]
    pub fn get(&self, i: usize) -> Sampler {
        let key = [self.key[0][i], self.key[1][i]];
        Sampler { kind: self.kind, dimension: 0, key, sample: self.sample[i] }
    }

    /// [`Samplers::points`] of those from number `first` on, in as many lanes as there are.
    ///
    /// # Panics
    /// If there are none.
    #[inline]
    pub fn points(&self, first: usize, d: u32) -> [Lanes<f32>; 2] {
        let [k0, k1] = self.key.each_ref().map(|column| &column[first..]);
        let sample = &self.sample[first..];
        if let (Some(k0), Some(k1), Some(sample)) =
            (k0.first_chunk(), k1.first_chunk(), sample.first_chunk())
        {
            return points(self.kind, [k0, k1], sample, d);
        }
        Samplers::new((first..self.len()).map(|i| self.get(i))).points(d)
    }
}
