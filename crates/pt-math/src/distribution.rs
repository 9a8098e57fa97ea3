//! Sampling from tables.

/// Chooses an index with a probability proportional to its weight, in constant time. [Walker
/// 1977; construction: Vose 1991]
#[derive(Clone, Debug, PartialEq)]
pub struct AliasTable {
    slots: Vec<Slot>,
}

/// One of n equal parts of [0, 1): it is shared by its own index and one other.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Slot {
    /// Share of the slot that belongs to its own index.
    own: f32,
    /// The index that has the rest.
    alias: u32,
    /// Probability of the slot's own index.
    probability: f32,
}

impl AliasTable {
    /// A table for these weights. Weights that are not positive and finite count as zero; `None`
    /// where no other is left, or for more than 2²⁴ weights (a slot would be narrower than the
    /// numbers that choose it).
    pub fn new(weights: &[f32]) -> Option<Self> {
        if weights.len() > MOST_CELLS {
            return None;
        }
        let total: f64 = weights.iter().map(|&w| usable(w)).sum();
        let likeliest = weights
            .iter()
            .copied()
            .map(usable)
            .enumerate()
            .fold((0, 0.0), |best, (i, w)| if w > best.1 { (i, w) } else { best });
        if likeliest.1 <= 0.0 {
            return None;
        }
        let probability = |w: f32| (usable(w) / total) as f32;
        let mut slots: Vec<_> = weights
            .iter()
            .map(|&w| Slot { own: 0.0, alias: likeliest.0 as u32, probability: probability(w) })
            .collect();
        share_slots(&mut slots);
        Some(Self { slots })
    }

    /// Chooses by `u` in [0, 1): the index, its probability, and a number in [0, 1) that is
    /// uniform whatever the index (with log₂ n bits less than `u`).
    ///
    /// An index of zero probability is never chosen.
    #[inline]
    pub fn sample(&self, u: f32) -> (usize, f32, f32) {
        let n = self.slots.len();
        let scaled = u * n as f32;
        let i = (scaled as usize).min(n - 1);
        let slot = self.slots[i];
        let v = (scaled - i as f32).min(BELOW_ONE);
        let (chosen, rest) = if v < slot.own {
            (i, v / slot.own)
        } else {
            (slot.alias as usize, (v - slot.own) / (1.0 - slot.own))
        };
        (chosen, self.slots[chosen].probability, rest.min(BELOW_ONE))
    }

    /// The probability of index `i`; 0 beyond the end.
    #[inline]
    pub fn probability(&self, i: usize) -> f32 {
        self.slots.get(i).map_or(0.0, |s| s.probability)
    }
}

/// The largest `f32` below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// An `f32` counts no further without gaps.
const MOST_CELLS: usize = 1 << 24;

/// A weight as `f64`, or 0 where it is not positive and finite.
fn usable(w: f32) -> f64 {
    if w > 0.0 && w.is_finite() { f64::from(w) } else { 0.0 }
}

/// Vose's algorithm: each slot that its own index cannot fill is filled up by one that has more
/// than a slot.
///
/// What rounding leaves over keeps a whole slot, or the alias it was given where it has no
/// probability.
fn share_slots(slots: &mut [Slot]) {
    let n = slots.len() as f64;
    let mut left: Vec<f64> = slots.iter().map(|s| f64::from(s.probability) * n).collect();
    let (mut small, mut large): (Vec<_>, Vec<_>) = (0..slots.len()).partition(|&i| left[i] < 1.0);
    while let (Some(&s), Some(&l)) = (small.last(), large.last()) {
        small.pop();
        slots[s].own = left[s] as f32;
        slots[s].alias = l as u32;
        left[l] -= 1.0 - left[s];
        if left[l] < 1.0 {
            large.pop();
            small.push(l);
        }
    }
    for i in small.into_iter().chain(large) {
        slots[i].own = if slots[i].probability > 0.0 { 1.0 } else { 0.0 };
    }
}

/// A density on [0, 1)² that is constant on each cell of a grid. [Pharr, Jakob & Humphreys,
/// Physically Based Rendering, 4th ed., §A.5.2]
///
/// A row is chosen by its share of the total, then a cell by its share of the row.
#[derive(Clone, Debug, PartialEq)]
pub struct Piecewise2D {
    width: usize,
    height: usize,
    /// Density of each cell, row by row.
    density: Vec<f32>,
    /// Cumulative shares of the rows: `height` + 1 numbers from 0 to 1.
    rows: Vec<f32>,
    /// Per row, cumulative shares of its cells: `width` + 1 numbers.
    cells: Vec<f32>,
}

impl Piecewise2D {
    /// A density proportional to `values`, a grid of `height` rows of `width` cells; cell (i, j)
    /// covers [i/w, (i+1)/w) × [j/h, (j+1)/h).
    ///
    /// Values that are not positive and finite count as zero; `None` where no other is left, the
    /// number of values is not `width` · `height`, or a side has more than 2²⁴ cells.
    pub fn new(values: &[f32], width: usize, height: usize) -> Option<Self> {
        let size_fits = width.checked_mul(height) == Some(values.len());
        if !size_fits || values.is_empty() || width.max(height) > MOST_CELLS {
            return None;
        }
        let mut cells = Vec::with_capacity((width + 1) * height);
        let sums: Vec<f64> = values
            .chunks_exact(width)
            .map(|row| push_cumulative(&mut cells, row.iter().map(|&v| usable(v))))
            .collect();
        let mut rows = Vec::with_capacity(height + 1);
        let total = push_cumulative(&mut rows, sums.iter().copied());
        if total <= 0.0 {
            return None;
        }
        let mean = total / values.len() as f64;
        let density = values.iter().map(|&v| (usable(v) / mean) as f32).collect();
        Some(Self { width, height, density, rows, cells })
    }

    /// Maps a uniform point to one of this density, and returns both. Cells of zero density are
    /// never hit.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (row, y) = choose(&self.rows, u[1]);
        let stride = self.width + 1;
        let (column, x) = choose(&self.cells[row * stride..(row + 1) * stride], u[0]);
        ([x, y], self.density[row * self.width + column])
    }

    /// The density of each cell, row by row.
    pub fn densities(&self) -> &[f32] {
        &self.density
    }

    /// The density at a point of [0, 1)².
    #[inline]
    pub fn pdf(&self, p: [f32; 2]) -> f32 {
        self.density[cell(p[1], self.height) * self.width + cell(p[0], self.width)]
    }
}

/// The cell of [0, 1) that `x` lies in, when there are `n`.
#[inline]
fn cell(x: f32, n: usize) -> usize {
    ((x * n as f32) as usize).min(n - 1)
}

/// Appends the running shares of `weights`, from 0 to 1, and returns their sum.
///
/// A weight of zero repeats the share before it exactly. All shares are 0 when the sum is.
fn push_cumulative(out: &mut Vec<f32>, weights: impl Iterator<Item = f64> + Clone) -> f64 {
    let total: f64 = weights.clone().fold(0.0, |sum, w| sum + w);
    let scale = |sum: f64| if total > 0.0 { (sum / total) as f32 } else { 0.0 };
    out.push(0.0);
    let mut sum = 0.0;
    out.extend(weights.map(|w| {
        sum += w;
        scale(sum)
    }));
    total
}

/// Inverts a cumulative table that ends with 1: the cell, and the point of [0, 1) in it.
#[inline]
fn choose(cumulative: &[f32], u: f32) -> (usize, f32) {
    let n = cumulative.len() - 1;
    let u = u.min(BELOW_ONE);
    // The last share that is not above u; the next one is, so the cell is not empty.
    let i = cumulative.partition_point(|&c| c <= u).clamp(1, n) - 1;
    let (low, high) = (cumulative[i], cumulative[i + 1]);
    let mut x = (i as f32 + (u - low) / (high - low)) / n as f32;
    // Rounding may have left the cell by an ulp.
    while cell(x, n) < i {
        x = x.next_up();
    }
    while cell(x, n) > i || x >= 1.0 {
        x = x.next_down();
    }
    (i, x)
}
