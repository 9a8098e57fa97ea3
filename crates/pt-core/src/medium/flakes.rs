//! Microflakes that are turned otherwise at each place.

use pt_math::Vec3;

use super::grid::Field;
use crate::phase::{Microflakes, PhaseFunction};

/// Flakes by a grid of six numbers.
#[derive(Clone, Debug)]
pub struct Flakes {
    field: Field,
    /// No less than their area from any side anywhere.
    most: f32,
}

impl Flakes {
    /// Flakes whose matrices are those of a grid, and linear between; `None` if one is not positive
    /// definite.
    pub fn new(field: Field) -> Option<Self> {
        let cells = field.grid.values.as_chunks::<6>().0.iter();
        let most = cells.map(|entries| Some(Microflakes::new(*entries)?.greatest_area()));
        let most = most.collect::<Option<Vec<_>>>()?.into_iter().fold(0.0, f32::max);
        Some(Self { field, most })
    }

    /// The flakes at a point of the world; beyond the grid they are as at its walls.
    pub(super) fn at(&self, p: Vec3) -> Microflakes {
        let p = self.field.to_unit(p);
        let entries = std::array::from_fn(|c| self.field.number(p, c));
        // Between definite matrices all are definite, but for rounding.
        Microflakes::new(entries).unwrap_or_else(|| self.nearest(p))
    }

    /// The flakes of the cell that a point of the unit cube is in.
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

    /// See [`Self::new`].
    pub(super) fn most(&self) -> f32 {
        self.most
    }

    /// The area of the flakes at a point of the world in a direction, as a share of the most.
    pub(super) fn share(&self, p: Vec3, direction: Vec3) -> f32 {
        self.at(p).area(direction) / self.most
    }
}
