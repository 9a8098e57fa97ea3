//! Microflakes that vary in space.

use pt_math::Vec3;

use super::field::WorldGrid;
use crate::phase::{Microflakes, PhaseFunction};

/// Microflakes given by a grid of six numbers per cell.
#[derive(Clone, Debug)]
pub struct Flakes {
    field: WorldGrid,
    /// Upper bound of the projected area, over all points and directions.
    most: f32,
}

impl Flakes {
    /// Creates microflakes whose matrices are interpolated linearly in a grid; `None` if one is not
    /// positive definite.
    pub fn new(field: WorldGrid) -> Option<Self> {
        let cells = field.grid.values.as_chunks::<6>().0.iter();
        let most = cells.map(|entries| Some(Microflakes::new(*entries)?.greatest_area()));
        let most = most.collect::<Option<Vec<_>>>()?.into_iter().fold(0.0, f32::max);
        Some(Self { field, most })
    }

    /// Microflakes at a point in world space, which is clamped to the grid.
    pub(super) fn at(&self, p: Vec3) -> Microflakes {
        let p = self.field.to_unit(p);
        let entries = std::array::from_fn(|c| self.field.number(p, c));
        // Interpolated definite matrices are definite, except for rounding.
        Microflakes::new(entries).unwrap_or_else(|| self.nearest(p))
    }

    /// Microflakes of the cell that contains a point of the unit cube.
    #[cold]
    fn nearest(&self, p: Vec3) -> Microflakes {
        let cell = |axis: usize| {
            let count = self.field.grid.resolution[axis];
            (p[axis] * count as f32).clamp(0.0, (count - 1) as f32) as usize
        };
        let [nx, ny, _] = self.field.grid.resolution.map(|n| n as usize);
        let cell = (cell(2) * ny + cell(1)) * nx + cell(0);
        let cells = self.field.grid.values.as_chunks().0;
        Microflakes::new(cells[cell]).expect("all cells are definite, which `new` saw to")
    }

    /// Upper bound of the projected area, over all points and directions.
    pub(super) fn most(&self) -> f32 {
        self.most
    }

    /// Projected area in a direction at a point in world space, relative to the upper bound.
    pub(super) fn share(&self, p: Vec3, direction: Vec3) -> f32 {
        self.at(p).area(direction) / self.most
    }
}
