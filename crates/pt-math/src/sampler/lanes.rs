//! The numbers of several samples, side by side.

use std::ops::Range;

use super::{Sampler, SamplerKind, independent, pixel_key, sobol};

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

/// The samplers of many samples of one render, in blocks of [`LANES`].
#[derive(Clone, Debug)]
pub struct SamplerBlocks {
    kind: SamplerKind,
    seed: u32,
    len: usize,
    blocks: Vec<Block>,
}

#[derive(Clone, Copy, Debug)]
struct Block {
    pixel: [Lanes<u32>; 2],
    key: [Lanes<u32>; 2],
    sample: Lanes<u32>,
}

impl SamplerBlocks {
    /// None yet.
    pub fn new(kind: SamplerKind, seed: u32) -> Self {
        Self { kind, seed, len: 0, blocks: Vec::new() }
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Takes the place of all that there were: for each pixel its consecutive samples.
    #[inline]
    pub fn refill(&mut self, runs: impl IntoIterator<Item = ([u32; 2], Range<u32>)>) {
        self.blocks.clear();
        let mut lane = LANES;
        for (pixel, mut samples) in runs {
            while !samples.is_empty() {
                if lane == LANES {
                    self.blocks.push(Block::of_pixel(pixel, samples.start));
                    lane = 0;
                }
                let n = samples.len().min(LANES - lane);
                if lane > 0
                    && let Some(block) = self.blocks.last_mut()
                {
                    block.set(lane..lane + n, pixel, samples.start);
                }
                samples.start += n as u32;
                lane += n;
            }
        }
        self.len = self.blocks.len() * LANES - (LANES - lane);
        for block in &mut self.blocks {
            block.set_keys(self.seed);
        }
    }

    /// Number `i`, at dimension 0.
    ///
    /// # Panics
    /// If there are not so many.
    #[inline]
    pub fn get(&self, i: usize) -> Sampler {
        let (block, lane) = (&self.blocks[i / LANES], i % LANES);
        let key = block.key.map(|words| words[lane]);
        Sampler { kind: self.kind, dimension: 0, key, sample: block.sample[lane] }
    }

    /// Columns and rows of the pixels of a block.
    ///
    /// # Panics
    /// If there are not so many blocks.
    #[inline]
    pub fn pixels(&self, block: usize) -> &[Lanes<u32>; 2] {
        &self.blocks[block].pixel
    }

    /// [`Samplers::points`] of a block.
    ///
    /// # Panics
    /// If there are not so many blocks.
    #[inline]
    pub fn points(&self, block: usize, d: u32) -> [Lanes<f32>; 2] {
        let Block { key, sample, .. } = &self.blocks[block];
        points(self.kind, key.each_ref(), sample, d)
    }
}

impl Block {
    /// Consecutive samples of a pixel, without keys.
    #[inline(always)]
    fn of_pixel([x, y]: [u32; 2], first: u32) -> Self {
        Self {
            pixel: [[x; LANES], [y; LANES]],
            key: [[0; LANES]; 2],
            sample: std::array::from_fn(|i| first.wrapping_add(i as u32)),
        }
    }

    /// The same in some of the lanes.
    #[inline(always)]
    fn set(&mut self, lanes: Range<usize>, [x, y]: [u32; 2], first: u32) {
        self.pixel[0][lanes.clone()].fill(x);
        self.pixel[1][lanes.clone()].fill(y);
        for (sample, n) in self.sample[lanes].iter_mut().zip(first..) {
            *sample = n;
        }
    }

    #[inline]
    fn set_keys(&mut self, seed: u32) {
        let [xs, ys] = &self.pixel;
        if is_uniform(xs) && is_uniform(ys) {
            self.key = pixel_key(seed, [xs[0], ys[0]]).map(|word| [word; LANES]);
            return;
        }
        for lane in 0..LANES {
            let [k0, k1] = pixel_key(seed, [xs[lane], ys[lane]]);
            self.key[0][lane] = k0;
            self.key[1][lane] = k1;
        }
    }
}
