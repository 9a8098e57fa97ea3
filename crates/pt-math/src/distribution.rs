//! Sampling of tabulated distributions.

/// Samples an index with a probability proportional to its weight, in constant time. [Walker 1977;
/// construction: Vose 1991]
#[derive(Clone, Debug, PartialEq)]
pub struct AliasTable {
    slots: Vec<AliasSlot>,
}

/// One of n equal parts of [0, 1), divided between its own index and one other.
#[derive(Clone, Copy, Debug, PartialEq)]
struct AliasSlot {
    /// Fraction of the slot that belongs to its own index.
    own: f32,
    /// Index to which the rest belongs.
    alias: u32,
    /// Probability of the slot's own index.
    probability: f32,
}

impl AliasTable {
    /// Creates a table for these weights. Weights that are not positive and finite count as zero;
    /// `None` if no other is left, or for more than 2²⁴ weights (a slot would be narrower than the
    /// spacing of the random numbers).
    pub fn new(weights: &[f32]) -> Option<Self> {
        if weights.len() > MAX_CELLS {
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
            .map(|&w| AliasSlot {
                own: 0.0,
                alias: likeliest.0 as u32,
                probability: probability(w),
            })
            .collect();
        share_slots(&mut slots);
        Some(Self { slots })
    }

    /// Samples with `u` in [0, 1): returns the index, its probability, and the remapped random
    /// number, uniform in [0, 1) and independent of the index (with log₂ n bits less than `u`).
    ///
    /// An index of zero probability is never sampled.
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

    /// Returns the probability of index `i`; 0 beyond the end.
    #[inline]
    pub fn probability(&self, i: usize) -> f32 {
        self.slots.get(i).map_or(0.0, |s| s.probability)
    }
}

/// The largest `f32` below 1.
const BELOW_ONE: f32 = 1.0 - f32::EPSILON / 2.0;

/// Maximum number of cells: an `f32` represents no larger integers without gaps.
const MAX_CELLS: usize = 1 << 24;

/// Returns a weight as `f64`, or 0 if it is not positive and finite.
fn usable(w: f32) -> f64 {
    if w > 0.0 && w.is_finite() { f64::from(w) } else { 0.0 }
}

/// Vose's algorithm: each slot that its own index cannot fill is filled up by an index with more
/// than a slot.
///
/// Slots left over by rounding belong wholly to their own index, or to their alias if their own
/// index has no probability.
fn share_slots(slots: &mut [AliasSlot]) {
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

/// Density on [0, 1)² that is constant on each cell of a grid. [Pharr, Jakob & Humphreys,
/// Physically Based Rendering, 4th ed., §A.5.2]
///
/// A row is sampled by its marginal probability, then a cell by its conditional probability.
#[derive(Clone, Debug, PartialEq)]
pub struct Piecewise2D {
    width: usize,
    height: usize,
    /// Density of each cell, row by row.
    density: Vec<f32>,
    /// Cumulative distribution of the rows: one table.
    rows: Cumulative,
    /// Cumulative distributions of the cells of each row: one table per row.
    cells: Cumulative,
}

impl Piecewise2D {
    /// Creates a density proportional to `values`, a grid of `height` rows of `width` cells; cell
    /// (i, j) covers [i/w, (i+1)/w) × [j/h, (j+1)/h).
    ///
    /// Values that are not positive and finite count as zero; `None` if no other is left, if the
    /// number of values is not `width` · `height`, or if a side has more than 2²⁴ cells.
    pub fn new(values: &[f32], width: usize, height: usize) -> Option<Self> {
        let size_fits = width.checked_mul(height) == Some(values.len());
        if !size_fits || values.is_empty() || width.max(height) > MAX_CELLS {
            return None;
        }
        let mut cells = Cumulative::new(width, height);
        let sums: Vec<f64> = values
            .chunks_exact(width)
            .map(|row| cells.push(row.iter().map(|&v| usable(v))))
            .collect();
        let mut rows = Cumulative::new(height, 1);
        let total = rows.push(sums.iter().copied());
        if total <= 0.0 {
            return None;
        }
        let mean = total / values.len() as f64;
        let density = values.iter().map(|&v| (usable(v) / mean) as f32).collect();
        Some(Self { width, height, density, rows, cells })
    }

    /// Maps a uniform point to one of this density, and returns the point and its density. Cells of
    /// zero density are never sampled.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (row, y) = self.rows.choose(0, u[1]);
        let (column, x) = self.cells.choose(row, u[0]);
        ([x, y], self.density[row * self.width + column])
    }

    /// Density of each cell, row by row.
    pub fn densities(&self) -> &[f32] {
        &self.density
    }

    /// Density at a point of [0, 1)².
    #[inline]
    pub fn pdf(&self, p: [f32; 2]) -> f32 {
        self.density[cell(p[1], self.height) * self.width + cell(p[0], self.width)]
    }
}

/// Index of the cell of [0, 1) that contains `x`, of `n` cells.
#[inline]
fn cell(x: f32, n: usize) -> usize {
    ((x * n as f32) as usize).min(n - 1)
}

/// Cumulative distributions with the same number of cells.
///
/// [0, 1) is divided into equal parts, a power of two so that their ends are exact. For each part,
/// the first cell is stored, so a search examines about one cell. [Chen & Asau 1974, "On Generating
/// Random Variates from an Empirical Distribution"]
#[derive(Clone, Debug, PartialEq)]
struct Cumulative {
    /// Number of cells of a table.
    cells: usize,
    /// Cumulative probabilities of each table: `cells` + 1 numbers from 0 to 1.
    shares: Vec<f32>,
    /// Number of parts of a table.
    parts: usize,
    /// Number of entries of `shares` that are not above the bounds of the parts, for each table and
    /// bound.
    starts: Vec<u32>,
}

impl Cumulative {
    /// Creates an empty set with capacity for `tables` tables.
    fn new(cells: usize, tables: usize) -> Self {
        let parts = cells.next_power_of_two();
        Self {
            cells,
            shares: Vec::with_capacity((cells + 1) * tables),
            parts,
            starts: Vec::with_capacity((parts + 1) * tables),
        }
    }

    /// Appends the cumulative distribution of `weights`, from 0 to 1, and returns their sum.
    ///
    /// A weight of zero repeats the entry before it exactly. All entries are 0 if the sum is.
    fn push(&mut self, weights: impl Iterator<Item = f64> + Clone) -> f64 {
        let total: f64 = weights.clone().fold(0.0, |sum, w| sum + w);
        let scale = |sum: f64| if total > 0.0 { (sum / total) as f32 } else { 0.0 };
        let first = self.shares.len();
        self.shares.push(0.0);
        let mut sum = 0.0;
        self.shares.extend(weights.map(|w| {
            sum += w;
            scale(sum)
        }));
        let shares = &self.shares[first..];
        let mut below = 0;
        self.starts.extend((0..=self.parts).map(|part| {
            let start = part as f32 / self.parts as f32;
            below += shares[below..].iter().take_while(|&&share| share <= start).count();
            below as u32
        }));
        total
    }

    /// Inverts a table that ends with 1: returns the cell, and the point of [0, 1) in it.
    #[inline]
    fn choose(&self, table: usize, u: f32) -> (usize, f32) {
        let n = self.cells;
        let shares = &self.shares[table * (n + 1)..(table + 1) * (n + 1)];
        let u = u.min(BELOW_ONE);
        let part = table * (self.parts + 1) + (u * self.parts as f32) as usize;
        let [first, last] = [self.starts[part], self.starts[part + 1]].map(|i| i as usize);
        // The last entry that is not above u; the next one is, so the cell is not empty.
        let above = first + shares[first..last].partition_point(|&share| share <= u);
        let i = above.clamp(1, n) - 1;
        (i, point_in(i, [shares[i], shares[i + 1]], u, n))
    }
}

/// Returns the point of [0, 1) in cell `i` of `n`, given the cumulative probabilities at its ends.
#[inline]
fn point_in(i: usize, [low, high]: [f32; 2], u: f32, n: usize) -> f32 {
    let mut x = (i as f32 + (u - low) / (high - low)) / n as f32;
    // Rounding may have left the cell by an ulp.
    while cell(x, n) < i {
        x = x.next_up();
    }
    while cell(x, n) > i || x >= 1.0 {
        x = x.next_down();
    }
    x
}
