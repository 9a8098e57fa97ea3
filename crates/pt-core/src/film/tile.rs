//! Part of a film to which one thread adds samples.

use pt_math::Spectrum;

use super::groups::{self, GroupSums};
use super::sums::moments_of;
use super::{
    Aov, ExactSum, FirstHit, IdCount, IdCoverage, InvalidReason, InvalidSample, InvalidSamples,
    Moments, PixelSums, RadianceSums, Region, aov,
};

/// Pixels of a [`Film`](super::Film), borrowed exclusively.
#[derive(Debug)]
pub struct Tile<'a> {
    region: Region,
    /// See [`Film::first`](super::Film::first).
    first: u32,
    aovs: &'a [Aov],
    rows: Vec<TileRow<'a>>,
    invalid_samples: InvalidSamples,
    removed: ExactSum,
}

#[derive(Debug)]
struct TileRow<'a> {
    counts: &'a mut [u32],
    sums: &'a mut [RadianceSums],
    /// Sums of all quantities, pixel by pixel.
    aov_sums: &'a mut [ExactSum],
    /// Ids of all quantities that count ids, pixel by pixel.
    ids: &'a mut [IdCoverage],
    /// Radiance of all light groups, pixel by pixel.
    group_sums: &'a mut [GroupSums],
}

impl<'a> Tile<'a> {
    /// Creates a tile without rows.
    pub(super) fn new(region: Region, first: u32, aovs: &'a [Aov]) -> Self {
        let rows = Vec::with_capacity(region.height as usize);
        let (invalid_samples, removed) = (InvalidSamples::default(), ExactSum::default());
        Self { region, first, aovs, rows, invalid_samples, removed }
    }

    /// Adds the next row.
    pub(super) fn push_row(
        &mut self,
        counts: &'a mut [u32],
        sums: &'a mut [RadianceSums],
        aov_sums: &'a mut [ExactSum],
        ids: &'a mut [IdCoverage],
        group_sums: &'a mut [GroupSums],
    ) {
        self.rows.push(TileRow { counts, sums, aov_sums, ids, group_sums });
    }

    /// Pixels of the tile.
    pub fn region(&self) -> Region {
        self.region
    }

    /// Rejected samples.
    pub fn invalid_samples(&self) -> &InvalidSamples {
        &self.invalid_samples
    }

    /// Luminance removed by clamping.
    pub fn clamped_energy(&self) -> ExactSum {
        self.removed
    }

    /// Adds luminance removed by clamping.
    #[inline]
    pub fn add_clamped(&mut self, luminance: ExactSum) {
        self.removed.merge(luminance);
    }

    /// Returns the row of a pixel in the tile, and its index in the row.
    #[inline]
    fn place(&self, [x, y]: [u32; 2]) -> (usize, usize) {
        ((y - self.region.y) as usize, (x - self.region.x) as usize)
    }

    /// Returns the index of the next sample of a pixel, which must be inside of the region.
    #[inline]
    pub fn next_sample(&self, pixel: [u32; 2]) -> u32 {
        let (row, column) = self.place(pixel);
        self.first + self.rows[row].counts[column]
    }

    /// Returns the sums of a pixel, which must be inside of the region.
    pub fn pixel(&self, pixel: [u32; 2]) -> PixelSums {
        let (row, column) = self.place(pixel);
        let TileRow { counts, sums, .. } = &self.rows[row];
        PixelSums::new(Moments { sums: sums[column], count: counts[column] }, None)
    }

    /// Adds consecutive samples of a pixel, beginning with sample `first`. `weights` are the filter
    /// weights, 1 if `None`. An invalid sample (see [`InvalidReason`]) counts as black and is
    /// reported in [`Self::invalid_samples`].
    #[inline]
    pub fn add(
        &mut self,
        pixel: [u32; 2],
        first: u32,
        samples: &[Spectrum],
        weights: Option<&[f32]>,
    ) {
        let (row, column) = self.place(pixel);
        let row = &mut self.rows[row];
        row.counts[column] += samples.len() as u32;
        let bits = all_bits(samples);
        if bits & !SIGN == 0 {
            return; // as where nothing is seen
        }
        let moments = match weights {
            _ if bits & SIGN != 0 => None, // perhaps negative
            None => moments_of(samples.iter().copied()),
            Some(_) if samples.iter().any(|l| l.0.max_element() > ExactSum::LIMIT) => None,
            Some(weights) => moments_of(samples.iter().zip(weights).map(|(&l, &w)| l * w)),
        };
        if let Some(moments) = moments {
            row.sums[column].add_moments(moments);
        } else {
            self.add_one_by_one(pixel, first, samples, weights);
        }
    }

    /// Adds samples some of which are invalid, or which differ too much to be summed in `f64`.
    #[cold]
    fn add_one_by_one(
        &mut self,
        pixel: [u32; 2],
        first: u32,
        samples: &[Spectrum],
        weights: Option<&[f32]>,
    ) {
        let (row, column) = self.place(pixel);
        for (i, &light) in samples.iter().enumerate() {
            let weight = weights.map_or(1.0, |weights| weights[i]);
            if let Some(reason) = InvalidReason::of(light, weight) {
                self.reject(pixel, first + i as u32, reason);
                continue;
            }
            self.rows[row].sums[column].add(light * weight);
        }
    }

    /// Adds the radiance of light groups of the samples passed to [`Self::add`]. `parts` contains
    /// the radiance of each group, sample by sample. Films without light groups ignore it.
    pub fn add_light_groups(
        &mut self,
        pixel: [u32; 2],
        samples: &[Spectrum],
        parts: &[Spectrum],
        weights: Option<&[f32]>,
    ) {
        let (row, column) = self.place(pixel);
        let TileRow { counts, group_sums, .. } = &mut self.rows[row];
        let groups = group_sums.len() / counts.len();
        if groups > 0 {
            groups::add(&mut group_sums[column * groups..][..groups], samples, parts, weights);
        }
    }

    /// Records a rejected sample, and counts it in the AOV if the film keeps that.
    fn reject(&mut self, pixel: [u32; 2], sample: u32, reason: InvalidReason) {
        let [x, y] = pixel;
        self.invalid_samples.add(InvalidSample { y, x, sample, reason });
        let (row, column) = self.place(pixel);
        let per_pixel = aov::sums_per_pixel(self.aovs);
        let sums = &mut self.rows[row].aov_sums[column * per_pixel..][..per_pixel];
        aov::refuse(self.aovs, sums);
    }

    /// Returns true if the film keeps coverage.
    pub fn keeps_alpha(&self) -> bool {
        self.aovs.contains(&Aov::Alpha)
    }

    /// Adds the coverage of the samples passed to [`Self::add`]: 1 minus each transparency, times
    /// its filter weight, which is 1 if `weights` is `None`.
    ///
    /// # Panics
    /// If the film does not keep coverage.
    pub fn add_coverage(
        &mut self,
        pixel: [u32; 2],
        transparencies: &[f32],
        weights: Option<&[f32]>,
    ) {
        let (row, column) = self.place(pixel);
        let place = aov::sum_index(self.aovs, Aov::Alpha).expect("a film that keeps the coverage");
        let per_pixel = aov::sums_per_pixel(self.aovs);
        let sum = &mut self.rows[row].aov_sums[column * per_pixel + place];
        for (i, transparency) in transparencies.iter().enumerate() {
            sum.add((1.0 - transparency) * weights.map_or(1.0, |weights| weights[i]));
        }
    }

    /// Returns the coverage of a pixel, which must be inside of the region, and its standard error,
    /// or `None` if the film does not keep coverage. The error is that of binary samples:
    /// σ² = n/(n − 1) α (1 − α), an upper bound for all samples in [0, 1] [Bhatia & Davis 2000].
    pub fn alpha(&self, pixel: [u32; 2]) -> Option<(f64, f64)> {
        let place = aov::sum_index(self.aovs, Aov::Alpha)?;
        let (row, column) = self.place(pixel);
        let TileRow { counts, aov_sums, .. } = &self.rows[row];
        let n = f64::from(counts[column]);
        let sum = aov_sums[column * aov::sums_per_pixel(self.aovs) + place].value();
        let alpha = (sum / n.max(1.0)).clamp(0.0, 1.0);
        Some((alpha, (alpha * (1.0 - alpha) / (n - 1.0).max(1.0)).sqrt()))
    }

    /// Returns true if the film needs the first surfaces of samples.
    pub fn needs_first_hits(&self) -> bool {
        aov::keeps_surfaces(self.aovs)
    }

    /// Adds the first surface of sample number `sample` of a pixel; once for each sample that hits
    /// one. Invalid values count as 0 and are reported in [`Self::invalid_samples`].
    pub fn add_aovs(&mut self, pixel: [u32; 2], sample: u32, hit: &FirstHit) {
        let (row, column) = self.place(pixel);
        let per_pixel = aov::sums_per_pixel(self.aovs);
        let TileRow { aov_sums, ids, .. } = &mut self.rows[row];
        if !ids.is_empty() {
            let first = column * aov::ids(self.aovs).count();
            for (number, ids) in aov::ids(self.aovs).zip(&mut ids[first..]) {
                ids.add(IdCount { number: number(hit), samples: 1 });
            }
        }
        let sums = &mut aov_sums[column * per_pixel..][..per_pixel];
        if !aov::add(self.aovs, sums, sample, hit) {
            self.reject(pixel, sample, InvalidReason::Surface);
        }
    }
}

const SIGN: u32 = 1 << 31;

/// Returns the bitwise OR of all channels.
#[inline(always)]
fn all_bits(samples: &[Spectrum]) -> u32 {
    let bits = |l: &Spectrum| l.to_array().map(f32::to_bits).into_iter().fold(0, |all, b| all | b);
    samples.iter().fold(0, |all, l| all | bits(l))
}
