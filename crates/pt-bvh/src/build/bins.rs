//! Planes between bins of centroids. [Wald 2007, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies"]

use rayon::prelude::*;
use wide::f32x4;

use super::sah::{NODE_COST, RelativeArea, Search, leaf_cost};
use super::{CHUNK, Extent, Item, partition};

/// Looks at the planes between so many bins per axis, a power of two.
pub(super) struct Binned<const BINS: usize>;

impl<const BINS: usize> Search for Binned<BINS> {
    type Split = Split;

    /// `None` when all centroids coincide.
    fn best(items: &mut [Item], extent: Extent, centroids: Extent) -> Option<(f32, Split)> {
        let bins = Bins::<BINS>::new(centroids);
        let histogram = if items.len() <= CHUNK {
            Histogram::of(items, bins)
        } else {
            let partial = items.par_chunks(CHUNK).map(|c| Histogram::of(c, bins));
            partial.reduce(|| Histogram::EMPTY, |a, b| a.merge(&b))
        };
        let areas = RelativeArea::of(extent);
        (0..3)
            .filter_map(|axis| sweep(&histogram, axis, areas))
            .reduce(|best, s| if s.cost < best.cost { s } else { best })
            .map(|best| (best.cost, best))
    }

    fn part(items: &mut [Item], split: Split, centroids: Extent) -> usize {
        let bins = Bins::<BINS>::new(centroids);
        partition(items, |i| bins.index(i.centroid())[split.axis] < split.bin)
    }
}

/// A plane between two bins.
#[derive(Clone, Copy)]
pub(super) struct Split {
    cost: f32,
    axis: usize,
    /// Items in lower bins go left.
    bin: i32,
}

/// How centroids map to bins.
#[derive(Clone, Copy)]
struct Bins<const BINS: usize> {
    base: f32x4,
    scale: f32x4,
}

impl<const BINS: usize> Bins<BINS> {
    fn new(centroids: Extent) -> Self {
        let low = centroids.bounds().min;
        let scale = centroids.diagonal().map(|d| {
            let scale = BINS as f32 * (1.0 - 1e-5) / d;
            // An axis without extent has one bin only.
            if scale.is_finite() { scale } else { 0.0 }
        });
        let four = |[x, y, z]: [f32; 3]| f32x4::new([x, y, z, 0.0]);
        Self { base: four(low.to_array()), scale: four(scale) }
    }

    /// The bin per axis.
    #[inline]
    fn index(&self, centroid: f32x4) -> [i32; 4] {
        let last = f32x4::splat((BINS - 1) as f32);
        let place = ((centroid - self.base) * self.scale).fast_max(f32x4::ZERO).fast_min(last);
        place.fast_trunc_int().to_array()
    }
}

/// What falls into each bin, for the three axes.
struct Histogram<const BINS: usize> {
    extents: [[Extent; BINS]; 3],
    counts: [[u32; BINS]; 3],
}

impl<const BINS: usize> Histogram<BINS> {
    const EMPTY: Self = Self { extents: [[Extent::EMPTY; BINS]; 3], counts: [[0; BINS]; 3] };

    fn of(items: &[Item], bins: Bins<BINS>) -> Self {
        let mut h = Self::EMPTY;
        for item in items {
            let index = bins.index(item.centroid());
            let extent = item.extent();
            for (axis, &bin) in index.iter().enumerate().take(3) {
                let bin = bin as usize & (BINS - 1);
                h.extents[axis][bin] = h.extents[axis][bin].union(extent);
                h.counts[axis][bin] += 1;
            }
        }
        h
    }

    fn merge(mut self, other: &Self) -> Self {
        for axis in 0..3 {
            for bin in 0..BINS {
                self.extents[axis][bin] = self.extents[axis][bin].union(other.extents[axis][bin]);
                self.counts[axis][bin] += other.counts[axis][bin];
            }
        }
        self
    }
}

/// The cheapest plane across one axis.
fn sweep<const BINS: usize>(
    histogram: &Histogram<BINS>,
    axis: usize,
    areas: RelativeArea,
) -> Option<Split> {
    let (extents, counts) = (&histogram.extents[axis], &histogram.counts[axis]);
    let mut right_cost = [0.0; BINS];
    let (mut extent, mut count) = (Extent::EMPTY, 0);
    for bin in (1..BINS).rev() {
        extent = extent.union(extents[bin]);
        count += counts[bin];
        right_cost[bin] = if count == 0 { f32::NAN } else { areas.get(extent) * leaf_cost(count) };
    }
    let mut best: Option<Split> = None;
    (extent, count) = (Extent::EMPTY, 0);
    for bin in 1..BINS {
        extent = extent.union(extents[bin - 1]);
        count += counts[bin - 1];
        let cost = NODE_COST + areas.get(extent) * leaf_cost(count) + right_cost[bin];
        let valid = count > 0 && !right_cost[bin].is_nan();
        if valid && best.is_none_or(|b| cost < b.cost) {
            best = Some(Split { cost, axis, bin: bin as i32 });
        }
    }
    best
}
