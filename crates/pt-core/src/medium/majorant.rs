//! Majorants of a grid, and traversal of them by rays.

use std::ops::ControlFlow;

use pt_math::Ray;
use pt_scene::medium::Grid;

use super::cloud::Cloud;

/// Number of grid cells along an axis per majorant: few enough for a tight bound, and enough for a
/// low cost of traversal.
const CELLS: u32 = 8;
/// Number of majorants of clouds, one above the other.
const SLABS: usize = 64;

/// Majorants of all channels, in equal boxes of the unit cube.
#[derive(Clone, Debug)]
pub(super) struct Majorants {
    /// Number of boxes along each axis.
    resolution: [usize; 3],
    /// Majorant of each box; x runs fastest, then y, then z.
    values: Vec<f32>,
}

impl Majorants {
    pub(super) fn new(grid: &Grid) -> Self {
        let resolution = grid.resolution.map(|n| n.div_ceil(CELLS) as usize);
        let [nx, ny, nz] = resolution;
        let [xs, ys, zs] = [0, 1, 2].map(|axis| ranges(grid.resolution[axis], resolution[axis]));
        let mut values = Vec::with_capacity(nx * ny * nz);
        for z in &zs {
            for y in &ys {
                values.extend(xs.iter().map(|x| most(grid, [x, y, z])));
            }
        }
        Self { resolution, values }
    }

    /// Majorants of clouds, which differ by height only.
    pub(super) fn of_cloud(cloud: &Cloud) -> Self {
        let slab = |i: usize| cloud.most([i, i + 1].map(|i| i as f32 / SLABS as f32));
        Self { resolution: [1, SLABS, 1], values: (0..SLABS).map(slab).collect() }
    }

    /// Visits the boxes along a ray, in order, with the part of the ray's interval in each, and its
    /// majorant; empty boxes are skipped. [Amanatides & Woo 1987, "A Fast Voxel Traversal Algorithm
    /// for Ray Tracing"]
    pub(super) fn walk<B>(
        &self,
        ray: &Ray,
        mut visit: impl FnMut([f32; 2], f32) -> ControlFlow<B>,
    ) -> ControlFlow<B> {
        let Some([mut t, end]) = inside(ray) else { return ControlFlow::Continue(()) };
        let (o, d) = (ray.origin.to_array(), ray.direction.to_array());
        let start = ray.at(t).to_array();
        let most = self.resolution.map(|n| n as f32);
        let mut cell: [usize; 3] =
            std::array::from_fn(|i| (start[i] * most[i]).clamp(0.0, most[i] - 1.0) as usize);
        // Ray parameter at which the ray leaves a box along an axis.
        let exit = |axis: usize, cell: usize| {
            let wall = cell + usize::from(d[axis] > 0.0);
            let t = (wall as f32 / most[axis] - o[axis]) / d[axis];
            if d[axis] == 0.0 { f32::INFINITY } else { t }
        };
        let mut exits: [f32; 3] = std::array::from_fn(|i| exit(i, cell[i]));
        loop {
            let axis = if exits[0] <= exits[1] && exits[0] <= exits[2] {
                0
            } else if exits[1] <= exits[2] {
                1
            } else {
                2
            };
            let next = exits[axis].clamp(t, end);
            let majorant = self.at(cell);
            if next > t && majorant > 0.0 {
                visit([t, next], majorant)?;
            }
            t = next;
            if exits[axis] >= end {
                return ControlFlow::Continue(());
            }
            let forwards = d[axis] > 0.0;
            cell[axis] = match cell[axis].checked_add_signed(if forwards { 1 } else { -1 }) {
                Some(i) if i < self.resolution[axis] => i,
                _ => return ControlFlow::Continue(()),
            };
            exits[axis] = exit(axis, cell[axis]);
        }
    }

    fn at(&self, [x, y, z]: [usize; 3]) -> f32 {
        let [nx, ny, _] = self.resolution;
        self.values[(z * ny + y) * nx + x]
    }
}

/// First and last cell that influence the values in each box of an axis: the cells in it, and one
/// more at both ends for interpolation.
fn ranges(cells: u32, boxes: usize) -> Vec<[usize; 2]> {
    let cells = cells as usize;
    let range = |i: usize| {
        let (first, end) = (i * cells / boxes, ((i + 1) * cells).div_ceil(boxes));
        [first.saturating_sub(1), end.min(cells - 1)]
    };
    (0..boxes).map(range).collect()
}

/// Maximum value of a block of cells, over all channels.
fn most(grid: &Grid, [xs, ys, zs]: [&[usize; 2]; 3]) -> f32 {
    let [nx, ny, _] = grid.resolution.map(|n| n as usize);
    let channels = grid.channels as usize;
    let rows = (zs[0]..=zs[1]).flat_map(|z| (ys[0]..=ys[1]).map(move |y| (z * ny + y) * nx));
    let cells = rows.flat_map(|row| row + xs[0]..=row + xs[1]);
    let numbers = cells.flat_map(|cell| &grid.values[cell * channels..(cell + 1) * channels]);
    numbers.fold(0.0, |most: f32, &number| most.max(number))
}

/// Part of a ray's interval in the unit cube; `None` if it is empty.
fn inside(ray: &Ray) -> Option<[f32; 2]> {
    let (mut from, mut to) = (ray.t_min, ray.t_max);
    for (o, d) in std::iter::zip(ray.origin.to_array(), ray.direction.to_array()) {
        if d == 0.0 {
            if !(0.0..=1.0).contains(&o) {
                return None;
            }
            continue;
        }
        let (a, b) = ((0.0 - o) / d, (1.0 - o) / d);
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    (from < to).then_some([from, to])
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use pt_math::{Mat3, Vec3};
    use pt_scene::medium::GridFilter;
    use pt_testing::Random;

    use super::super::WorldGrid;
    use super::*;

    fn noise(resolution: [u32; 3]) -> Grid {
        let mut random = Random::new(4);
        let count = resolution.iter().product::<u32>();
        let sparse = |x: f32| if x < 0.7 { 0.0 } else { x };
        let values = (0..count).map(|_| sparse(random.unit())).collect();
        Grid { resolution, channels: 1, values }
    }

    /// Each part of a ray in the cube is visited once and in order, or is in an empty box, and no
    /// value there exceeds the majorant.
    #[test]
    fn rays_go_through_all_boxes_in_order() {
        let mut random = Random::new(8);
        for resolution in [[1, 1, 1], [7, 20, 33], [64, 9, 8]] {
            let grid = Grid { values: vec![1.0; noise(resolution).cells()], ..noise(resolution) };
            let majorants = Majorants::new(&grid);
            for i in 0..2000 {
                let origin = random.in_cube() * 2.0;
                let mut direction = random.direction();
                direction[i % 3] *= f32::from(u8::from(i % 5 != 0));
                let ray = Ray::new(origin, direction);
                let mut visited = Vec::new();
                let _ = majorants.walk(&ray, |part, _| {
                    visited.push(part);
                    ControlFlow::<()>::Continue(())
                });
                let Some([from, to]) = inside(&ray) else {
                    assert!(visited.is_empty());
                    continue;
                };
                let length: f32 = visited.iter().map(|[a, b]| b - a).sum();
                assert!((length - (to - from)).abs() < 1e-5, "{ray:?}: {length} of {}", to - from);
                assert!(visited.windows(2).all(|w| w[0][1] == w[1][0]), "{ray:?}: {visited:?}");
            }
        }
    }

    #[test]
    fn bounds_hold() {
        let mut random = Random::new(2);
        for resolution in [[1, 1, 1], [7, 20, 33], [64, 9, 8]] {
            let grid = Arc::new(noise(resolution));
            let majorants = Majorants::new(&grid);
            for filter in [GridFilter::Trilinear, GridFilter::Nearest] {
                let grid = Arc::clone(&grid);
                let (corner, to_unit) = (Vec3::ZERO, Mat3::IDENTITY);
                let field = WorldGrid { grid, corner, to_unit, filter };
                for _ in 0..500 {
                    let origin = random.in_cube() * 0.5 + 0.5;
                    let ray = Ray::new(origin, random.direction());
                    let mut last = 0.0;
                    let _ = majorants.walk(&ray, |[from, to], majorant| {
                        for k in 0..=10 {
                            let t = from + (to - from) * 0.1 * k as f32;
                            let number = field.number(ray.at(t), 0);
                            assert!(number <= majorant * (1.0 + 1e-5), "{number} {majorant}");
                        }
                        assert!(from >= last);
                        // Skipped parts are empty.
                        let between = last + (from - last) * random.unit();
                        assert!(from - last < 1e-5 || field.number(ray.at(between), 0) < 1e-4);
                        last = to;
                        ControlFlow::<()>::Continue(())
                    });
                }
            }
        }
    }
}
