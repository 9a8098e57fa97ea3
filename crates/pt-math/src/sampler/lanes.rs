//! Random numbers of several samples at once.

use std::ops::Range;

use super::{
    Sampler, SamplerConfig, SamplerKind, in_half, independent, pixel_key, sobol, stratified, zsobol,
};

/// Number of samples that are processed together.
pub const LANES: usize = 16;

/// One value for each of several samples.
pub type Lanes<T> = [T; LANES];

/// Several samples, of one render and of any of its pixels, at the same dimensions. Their numbers
/// are computed together, at a fraction of the cost of computing them one by one.
///
/// Paths that advance together bounce by bounce are at the same dimensions.
pub struct Samplers {
    set: SamplerConfig,
    /// See [`SamplerConfig::locate`].
    key: [Lanes<u32>; 2],
    index: Lanes<u32>,
}

impl Samplers {
    /// Points at dimensions `d` and `d` + 1: all first coordinates, then all second ones, with the
    /// same bits as [`Sampler::next_2d`]. The first coordinate is also the result of
    /// [`Sampler::next_1d`] at `d`.
    #[inline]
    pub fn points(&self, d: u32) -> [Lanes<f32>; 2] {
        points(self.set, self.key.each_ref(), &self.index, d)
    }
}

/// Points of samples at dimension `d`.
#[inline]
fn points(
    set: SamplerConfig,
    keys: [&Lanes<u32>; 2],
    index: &Lanes<u32>,
    d: u32,
) -> [Lanes<f32>; 2] {
    let key = |i| [keys[0][i], keys[1][i]];
    match set.kind {
        // A constant dimension saves work.
        SamplerKind::Sobol if d == 0 => sobol_points(0, keys, index, |_, i| i),
        SamplerKind::Sobol => sobol_points(d, keys, index, sobol::shuffled),
        SamplerKind::ZSobol => {
            let log2_run = zsobol::log2_run(set.spp);
            sobol_points(d, keys, index, |order, i| zsobol::place(log2_run, d, order, i))
        }
        SamplerKind::Stratified => each(|i| stratified::point(key(i), set.spp, index[i], d)),
        SamplerKind::Independent => each(|i| independent::point(key(i), index[i], d)),
    }
}

/// Points of Sobol' sequences; `place` computes the position of an index in the order with a given
/// seed.
#[inline(always)]
fn sobol_points(
    d: u32,
    keys: [&Lanes<u32>; 2],
    index: &Lanes<u32>,
    place: impl Fn(u32, u32) -> u32,
) -> [Lanes<f32>; 2] {
    let [keys0, keys1] = keys;
    if is_uniform(keys0) && is_uniform(keys1) {
        let seeds = sobol::seeds([keys0[0], keys1[0]], d);
        return each(|i| sobol::point(seeds, place(seeds[0], index[i])));
    }
    let [mut order, mut seed_x, mut seed_y] = [[0; LANES]; 3];
    for i in 0..LANES {
        [order[i], seed_x[i], seed_y[i]] = sobol::seeds([keys0[i], keys1[i]], d);
    }
    each(|i| sobol::point([order[i], seed_x[i], seed_y[i]], place(order[i], index[i])))
}

/// Returns true if all words are equal, like the key words within one pixel.
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

/// Samplers of many samples of one render, in blocks of [`LANES`].
#[derive(Clone, Debug)]
pub struct SamplerBlocks {
    set: SamplerConfig,
    len: usize,
    /// Column and row of the pixel of each sample. This and the other vectors have at least `LANES`
    /// undefined entries beyond the last sampler.
    pixel: [Vec<u32>; 2],
    key: [Vec<u32>; 2],
    index: Vec<u32>,
}

impl SamplerBlocks {
    /// Creates an empty list.
    pub fn new(set: SamplerConfig) -> Self {
        let [pixel, key] = [[Vec::new(), Vec::new()], [Vec::new(), Vec::new()]];
        Self { set, len: 0, pixel, key, index: Vec::new() }
    }

    /// Number of samplers.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Returns true if there are no samplers.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Replaces all samplers by those of `runs`: for each pixel, consecutive samples.
    #[inline]
    pub fn refill(&mut self, runs: impl Iterator<Item = ([u32; 2], Range<u32>)> + Clone) {
        self.len = runs.clone().map(|(_, samples)| samples.len()).sum();
        let size = self.len.next_multiple_of(LANES) + LANES;
        let [xs, ys] = &mut self.pixel;
        let mut columns = [xs, ys, &mut self.index];
        columns.iter_mut().chain(&mut self.key.each_mut()).for_each(|c| c.resize(size, 0));
        set_runs(columns.map(|column| &mut column[..]), runs);
        for block in 0..self.len.div_ceil(LANES) {
            self.locate(block);
        }
    }

    /// Computes keys, and replaces sample numbers by indices, in place: vector loads would stall on
    /// words that were gathered elsewhere.
    #[inline(always)]
    fn locate(&mut self, block: usize) {
        let SamplerConfig { kind, seed, spp } = self.set;
        let [xs, ys] = self.pixel.each_ref().map(|column| lanes(column, block));
        let keys = self.key.each_mut().map(|column| lanes_mut(column, block));
        let index = lanes_mut(&mut self.index, block);
        let mut ys = *ys;
        for (y, index) in ys.iter_mut().zip(&mut *index) {
            ([_, *y], *index) = in_half([0, *y], *index);
        }
        if kind != SamplerKind::ZSobol {
            set_keys([xs, &ys], keys, |pixel| pixel_key(seed, pixel));
            return;
        }
        let log2_run = zsobol::log2_run(spp);
        let [mut columns, mut rows, mut runs] = [[0; LANES]; 3];
        for i in 0..LANES {
            let pixel = [xs[i], ys[i]];
            [columns[i], rows[i], runs[i]] = zsobol::square(log2_run, pixel, index[i]);
            index[i] = zsobol::index(log2_run, pixel, index[i]);
        }
        set_keys([&columns, &rows, &runs], keys, |square| zsobol::key(seed, square));
    }

    /// Sampler `i`, at dimension 0.
    ///
    /// # Panics
    /// If `i` is out of range.
    #[inline]
    pub fn get(&self, i: usize) -> Sampler {
        let key = self.key.each_ref().map(|words| words[i]);
        Sampler { set: self.set, dimension: 0, key, index: self.index[i] }
    }

    /// [`Samplers`] of up to [`LANES`] parts of samples, as [`Sampler::split`] returns them: part
    /// number `n` is part n mod 2ᵏ of sampler n / 2ᵏ (k = `log2_parts`). Lanes beyond the last part
    /// are undefined.
    ///
    /// # Panics
    /// If the sampler of a part is out of range.
    #[inline(always)]
    pub fn parts(&self, log2_parts: u32, parts: impl Iterator<Item = u32>) -> Samplers {
        let set = self.set.split(log2_parts);
        let mut lanes = Samplers { set, key: [[0; LANES]; 2], index: [0; LANES] };
        let mask = (1 << log2_parts) - 1;
        let [key0, key1] = self.key.each_ref().map(|words| &words[..self.len]);
        let index = &self.index[..self.len];
        for (lane, part) in parts.take(LANES).enumerate() {
            let i = (part >> log2_parts) as usize;
            lanes.key[0][lane] = key0[i];
            lanes.key[1][lane] = key1[i];
            lanes.index[lane] = index[i] << log2_parts | part & mask;
        }
        lanes
    }

    /// Columns and rows of the pixels of a block.
    ///
    /// # Panics
    /// If the block is out of range.
    #[inline]
    pub fn pixels(&self, block: usize) -> [&Lanes<u32>; 2] {
        self.pixel.each_ref().map(|column| lanes(column, block))
    }

    /// [`Samplers::points`] of a block.
    ///
    /// # Panics
    /// If the block is out of range.
    #[inline]
    pub fn points(&self, block: usize, d: u32) -> [Lanes<f32>; 2] {
        let key = self.key.each_ref().map(|column| lanes(column, block));
        points(self.set, key, lanes(&self.index, block), d)
    }
}

#[inline(always)]
fn lanes(column: &[u32], block: usize) -> &Lanes<u32> {
    &column.as_chunks().0[block]
}

#[inline(always)]
fn lanes_mut(column: &mut [u32], block: usize) -> &mut Lanes<u32> {
    &mut column.as_chunks_mut().0[block]
}

/// Computes keys of columns that are mostly the same in all lanes.
#[inline(always)]
fn set_keys<const N: usize>(
    columns: [&Lanes<u32>; N],
    [keys0, keys1]: [&mut Lanes<u32>; 2],
    key: impl Fn([u32; N]) -> [u32; 2],
) {
    if columns.iter().all(|column| is_uniform(column)) {
        let [k0, k1] = key(columns.map(|column| column[0]));
        keys0.fill(k0);
        keys1.fill(k1);
    } else {
        for (lane, (k0, k1)) in keys0.iter_mut().zip(keys1).enumerate() {
            [*k0, *k1] = key(columns.map(|column| column[lane]));
        }
    }
}

/// Writes columns, rows and sample numbers, in whole blocks at any position: values beyond the end
/// of a run are overwritten by the next one.
#[inline(always)]
fn set_runs(columns: [&mut [u32]; 3], runs: impl Iterator<Item = ([u32; 2], Range<u32>)>) {
    let [xs, ys, sample] = columns;
    let numbers: Lanes<u32> = std::array::from_fn(|i| i as u32);
    let mut place = 0;
    for ([x, y], samples) in runs {
        let end = place + samples.len();
        for (at, first) in (place..end).step_by(LANES).zip(samples.step_by(LANES)) {
            xs[at..at + LANES].copy_from_slice(&[x; LANES]);
            ys[at..at + LANES].copy_from_slice(&[y; LANES]);
            sample[at..at + LANES].copy_from_slice(&numbers.map(|n| first.wrapping_add(n)));
        }
        place = end;
    }
}
