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
const MAX_CELLS: usize = 1 << 24;

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
    /// One table, of the shares of the rows.
    rows: Cumulative,
    /// Per row, a table of the shares of its cells.
    cells: Cumulative,
}

impl Piecewise2D {
    /// A density proportional to `values`, a grid of `height` rows of `width` cells; cell (i, j)
    /// covers [i/w, (i+1)/w) × [j/h, (j+1)/h).
    ///
    /// Values that are not positive and finite count as zero; `None` where no other is left, the
    /// number of values is not `width` · `height`, or a side has more than 2²⁴ cells.
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

    /// Maps a uniform point to one of this density, and returns both. Cells of zero density are
    /// never hit.
    #[inline]
    pub fn sample(&self, u: [f32; 2]) -> ([f32; 2], f32) {
        let (row, y) = self.rows.choose(0, u[1]);
        let (column, x) = self.cells.choose(row, u[0]);
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

/// Tables of cumulative shares of as many cells each.
///
/// Equal parts of [0, 1), a power of two so that numbers are exact, know where their shares begin:
/// so a search looks at about one of them. [Chen & Asau 1974, "On Generating Random Variates from
/// an Empirical Distribution"]
#[derive(Clone, Debug, PartialEq)]
struct Cumulative {
    /// Cells of a table.
    cells: usize,
    /// Per table, `cells` + 1 numbers from 0 to 1.
    shares: Vec<f32>,
    /// Parts of a table.
    parts: usize,
    /// Per table and for the beginnings and the end of its parts, how many shares are not above.
    starts: Vec<u32>,
}

impl Cumulative {
    /// Without tables yet, of which there will be `tables`.
    fn new(cells: usize, tables: usize) -> Self {
        let parts = cells.next_power_of_two();
        Self {
            cells,
            shares: Vec::with_capacity((cells + 1) * tables),
            parts,
            starts: Vec::with_capacity((parts + 1) * tables),
        }
    }

    /// Appends a table of the running shares of `weights`, from 0 to 1, and returns their sum.
    ///
    /// A weight of zero repeats the share before it exactly. All shares are 0 when the sum is.
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

    /// Inverts a table that ends with 1: the cell, and the point of [0, 1) in it.
    #[inline]
    fn choose(&self, table: usize, u: f32) -> (usize, f32) {
        let n = self.cells;
        let shares = &self.shares[table * (n + 1)..(table + 1) * (n + 1)];
        let u = u.min(BELOW_ONE);
        let part = table * (self.parts + 1) + (u * self.parts as f32) as usize;
        let [first, last] = [self.starts[part], self.starts[part + 1]].map(|i| i as usize);
        // The last share that is not above u; the next one is, so the cell is not empty.
        let above = first + shares[first..last].partition_point(|&share| share <= u);
        let i = above.clamp(1, n) - 1;
        (i, point_in(i, [shares[i], shares[i + 1]], u, n))
    }
}

/// The point of [0, 1) in cell `i` of `n`, by the shares at its sides.
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
