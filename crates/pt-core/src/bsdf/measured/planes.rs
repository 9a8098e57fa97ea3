//! Bilinear functions on the unit square, blended between tables.

use std::ops::{Add, Mul};

use pt_math::Vec2;

/// The tables for a viewing direction, and their weights, which sum to 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct TableWeights {
    planes: [(usize, f32); 4],
    count: usize,
}

impl TableWeights {
    /// The first table, for functions with only one.
    pub(super) const ONE: Self = Self::only(0);

    /// A single table.
    pub(super) const fn only(plane: usize) -> Self {
        Self { planes: [(plane, 1.0); 4], count: 1 }
    }

    /// Blends tables that are ordered by the angle `phi`, then `theta`; angles are clamped to the
    /// range.
    pub(super) fn new(phi: &[f32], theta: &[f32], [at_phi, at_theta]: [f32; 2]) -> Self {
        let ((first_row, row), (first, t)) = (between(phi, at_phi), between(theta, at_theta));
        let mut blend = Self { planes: [(0, 0.0); 4], count: 0 };
        for (i, weight) in [(first_row, 1.0 - row), (first_row + 1, row)] {
            for (j, share) in [(first, 1.0 - t), (first + 1, t)] {
                if weight * share > 0.0 {
                    blend.planes[blend.count] = (i * theta.len() + j, weight * share);
                    blend.count += 1;
                }
            }
        }
        blend
    }

    /// Blended value at place `index` of tables that are `stride` values apart.
    #[inline]
    fn of<T>(&self, values: &[T], stride: usize, index: usize) -> T
    where
        T: Copy + Add<Output = T> + Mul<f32, Output = T>,
    {
        let at = |(plane, weight): (usize, f32)| values[plane * stride + index] * weight;
        let first = at(self.planes[0]);
        self.planes[1..self.count].iter().fold(first, |sum, &plane| sum + at(plane))
    }
}

/// Index of the last of increasing numbers that is not above `x`, and the fraction of the way from
/// it to the next.
fn between(numbers: &[f32], x: f32) -> (usize, f32) {
    let i = numbers.partition_point(|n| *n <= x).saturating_sub(1);
    match numbers.get(i + 1) {
        Some(next) => (i, ((x - numbers[i]) / (next - numbers[i])).clamp(0.0, 1.0)),
        None => (i, 0.0),
    }
}

/// Tables of values on the unit square, with points on the edges.
#[derive(Debug)]
pub(super) struct UnitSquareTables<T> {
    pub(super) columns: usize,
    pub(super) rows: usize,
    pub(super) values: Vec<T>,
}

impl From<&pt_scene::measured::Planes> for UnitSquareTables<f32> {
    fn from(of: &pt_scene::measured::Planes) -> Self {
        Self { columns: of.columns, rows: of.rows, values: of.values.clone() }
    }
}

/// Position of a point between four others.
#[derive(Clone, Copy)]
struct TableCell {
    column: usize,
    row: usize,
    /// Offset from the lower corner, in cells.
    s: f32,
    t: f32,
}

impl<T> UnitSquareTables<T>
where
    T: Copy + Add<Output = T> + Mul<f32, Output = T>,
{
    fn cell(&self, p: Vec2) -> TableCell {
        let within = |x: f32, count: usize| {
            let x = x.clamp(0.0, 1.0) * (count - 1) as f32;
            let i = (x as usize).min(count - 2);
            (i, x - i as f32)
        };
        let ((column, s), (row, t)) = (within(p.x, self.columns), within(p.y, self.rows));
        TableCell { column, row, s, t }
    }

    /// Blended value of a column and row.
    #[inline]
    fn of(&self, blend: &TableWeights, column: usize, row: usize) -> T {
        blend.of(&self.values, self.columns * self.rows, row * self.columns + column)
    }

    /// Value interpolated between two rows.
    #[inline]
    fn between_rows(&self, blend: &TableWeights, column: usize, row: usize, t: f32) -> T {
        self.of(blend, column, row) * (1.0 - t) + self.of(blend, column, row + 1) * t
    }

    /// Value at a point.
    pub(super) fn at(&self, blend: &TableWeights, p: Vec2) -> T {
        let TableCell { column, row, s, t } = self.cell(p);
        let [a, b] = [column, column + 1].map(|column| self.between_rows(blend, column, row, t));
        a * (1.0 - s) + b * s
    }
}

/// A map of the unit square to itself whose density is a blend of tables: first to a row, then to a
/// column in it. [Dupuy & Jakob 2018, §4; the inversion of linear densities: Devroye 1986, §II.2]
#[derive(Debug)]
pub(super) struct Warp {
    /// The density, whose mean is 1 in every table.
    density: UnitSquareTables<f32>,
    /// Integral of the density in a row, up to a column.
    along: UnitSquareTables<f32>,
    /// Integral of the density up to a row.
    across: UnitSquareTables<f32>,
}

impl Warp {
    /// Creates the map from densities, which are normalized for each table; a table of zeros is
    /// uniform.
    pub(super) fn new(
        &pt_scene::measured::Planes { columns, rows, ref values }: &pt_scene::measured::Planes,
    ) -> Self {
        let count = values.len();
        let mut density = Vec::with_capacity(count);
        let mut along = Vec::with_capacity(count);
        let mut across = Vec::with_capacity(count / columns);
        for plane in values.chunks_exact(columns * rows) {
            let integral = integral(plane, columns, rows);
            let normalized: Vec<f32> = if integral > 0.0 {
                plane.iter().map(|x| (f64::from(*x) / integral) as f32).collect()
            } else {
                vec![1.0; plane.len()]
            };
            let mut totals = Vec::with_capacity(rows);
            for row in normalized.chunks_exact(columns) {
                along.extend(integrals(row));
                totals.extend(along.last());
            }
            across.extend(integrals(&totals));
            density.extend(normalized);
        }
        Self {
            density: UnitSquareTables { columns, rows, values: density },
            along: UnitSquareTables { columns, rows, values: along },
            across: UnitSquareTables { columns: rows, rows: 1, values: across },
        }
    }

    /// Density at a point.
    pub(super) fn pdf(&self, blend: &TableWeights, p: Vec2) -> f32 {
        self.density.at(blend, p)
    }

    /// Maps a point.
    pub(super) fn sample(&self, blend: &TableWeights, u: Vec2) -> Vec2 {
        let UnitSquareTables { columns, rows, .. } = self.density;
        let last = columns - 1;
        let (row, rest) = search(rows, u.y, |row| self.across.of(blend, row, 0));
        let totals = [row, row + 1].map(|row| self.along.of(blend, last, row));
        let t = solve(totals, rest);
        let target = u.x * (totals[0] * (1.0 - t) + totals[1] * t);
        let up_to = |column| self.along.between_rows(blend, column, row, t);
        let (column, rest) = search(columns, target, up_to);
        let ends = [column, column + 1].map(|i| self.density.between_rows(blend, i, row, t));
        let s = solve(ends, rest);
        Vec2::new((column as f32 + s) / last as f32, (row as f32 + t) / (rows - 1) as f32)
    }

    /// Inverse of the map, and the density at its argument.
    pub(super) fn invert(&self, blend: &TableWeights, p: Vec2) -> (Vec2, f32) {
        let UnitSquareTables { columns, rows, .. } = self.density;
        let last = columns - 1;
        let TableCell { column, row, s, t } = self.density.cell(p);
        let totals = [row, row + 1].map(|row| self.along.of(blend, last, row));
        let v = self.across.of(blend, row, 0) + part(totals, t) / (rows - 1) as f32;
        let ends = [column, column + 1].map(|i| self.density.between_rows(blend, i, row, t));
        let up_to = self.along.between_rows(blend, column, row, t) + part(ends, s) / last as f32;
        let total = totals[0] * (1.0 - t) + totals[1] * t;
        let u = if total > 0.0 { up_to / total } else { 0.0 };
        (Vec2::new(u, v), ends[0] * (1.0 - s) + ends[1] * s)
    }
}

/// Integral over the unit square.
fn integral(plane: &[f32], columns: usize, rows: usize) -> f64 {
    let weight = |i: usize, count: usize| if i == 0 || i == count - 1 { 0.5 } else { 1.0 };
    let of_row = |row: &[f32]| -> f64 {
        row.iter().enumerate().map(|(i, x)| f64::from(*x) * weight(i, columns)).sum()
    };
    let sum: f64 =
        plane.chunks_exact(columns).enumerate().map(|(j, row)| of_row(row) * weight(j, rows)).sum();
    sum / ((columns - 1) * (rows - 1)) as f64
}

/// Integrals of a piecewise linear function, given by numbers at equidistant points from 0 to 1, up
/// to each of them.
fn integrals(numbers: &[f32]) -> Vec<f32> {
    let step = 0.5 / (numbers.len() - 1) as f64;
    let mut sum = 0.0;
    let rest = numbers.windows(2).map(|two| {
        sum += (f64::from(two[0]) + f64::from(two[1])) * step;
        sum as f32
    });
    std::iter::once(0.0).chain(rest).collect()
}

/// Finds the pair of `count` increasing numbers between which `x` is; returns the index of the
/// first, and the distance from it in units of 1 / (count − 1).
fn search(count: usize, x: f32, number: impl Fn(usize) -> f32) -> (usize, f32) {
    let (mut first, mut end) = (0, count - 1);
    while end - first > 1 {
        let middle = usize::midpoint(first, end);
        if number(middle) <= x { first = middle } else { end = middle }
    }
    (first, (x - number(first)) * (count - 1) as f32)
}

/// ∫ from 0 to t of the linear function from a at 0 to b at 1.
fn part([a, b]: [f32; 2], t: f32) -> f32 {
    t * (a + 0.5 * t * (b - a))
}

/// The t in [0, 1] of an integral; 0 if the function is 0.
fn solve([a, b]: [f32; 2], integral: f32) -> f32 {
    let root = (a * a + 2.0 * integral * (b - a)).max(0.0).sqrt();
    // Equals (√… − a) / (b − a), without cancellation.
    if a + root > 0.0 { (2.0 * integral / (a + root)).clamp(0.0, 1.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use pt_testing::{Chi2, Random, chi2_square};

    use super::*;

    /// Six tables of random numbers, with some zeros.
    fn warp(random: &mut Random) -> Warp {
        let (columns, rows) = (5, 4);
        let number = |_| if random.below(5) == 0 { 0.0 } else { random.unit() };
        let values = (0..6 * columns * rows).map(number).collect();
        Warp::new(&pt_scene::measured::Planes { columns, rows, values })
    }

    fn blend(random: &mut Random) -> TableWeights {
        let angles = [random.between(-1.5, 1.5), random.between(-0.5, 3.0)];
        TableWeights::new(&[-1.0, 1.0], &[0.0, 1.0, 2.0], angles)
    }

    #[test]
    fn blends_are_linear_and_end_where_angles_do() {
        let weights = |angles| {
            let blend = TableWeights::new(&[-1.0, 1.0], &[0.0, 1.0, 2.0], angles);
            let mut weights = [0.0; 6];
            for (plane, weight) in &blend.planes[..blend.count] {
                weights[*plane] = *weight;
            }
            weights
        };
        assert_eq!(weights([0.0, 0.25]), [0.375, 0.125, 0.0, 0.375, 0.125, 0.0]);
        assert_eq!(weights([-1.0, 2.0]), [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(weights([7.0, 7.0]), [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
        assert_eq!(weights([-7.0, -7.0]), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn points_are_mapped_there_and_back() {
        let mut random = Random::new(1);
        for _ in 0..20 {
            let warp = warp(&mut random);
            for _ in 0..1000 {
                let blend = blend(&mut random);
                let u = Vec2::from(random.unit_2d());
                let p = warp.sample(&blend, u);
                let (again, pdf) = warp.invert(&blend, p);
                assert!((pdf - warp.pdf(&blend, p)).abs() <= 1e-5 * pdf, "{p}: {pdf}");
                // At low density, small errors of a point are large errors of its preimage.
                if pdf > 0.02 {
                    assert!((again - u).length() < 1e-4, "{u} {p} {again}: {pdf}");
                }
            }
        }
    }

    #[test]
    fn points_follow_the_density() {
        const WARPS: usize = 8;
        let mut random = Random::new(2);
        for _ in 0..WARPS {
            let warp = warp(&mut random);
            let blend = blend(&mut random);
            chi2_square(
                |u| Some(warp.sample(&blend, Vec2::from(u)).to_array()),
                |p| warp.pdf(&blend, Vec2::from(p)),
                &Chi2::new("warp of planes").one_of(WARPS),
            )
            .unwrap();
        }
    }
}
