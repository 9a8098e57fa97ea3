//! Grids in world space.

use std::sync::Arc;

use pt_math::{FloatExt, Mat3, Spectrum, Vec3};
use pt_scene::medium::{Grid, GridFilter};

/// A grid in world space.
#[derive(Clone, Debug)]
pub struct WorldGrid {
    /// The grid.
    pub grid: Arc<Grid>,
    /// World-space corner of the cube that the grid fills, at its first cell.
    pub corner: Vec3,
    /// Transform from world-space offsets to the corner to the unit cube.
    pub to_unit: Mat3,
    /// Interpolation between cell centres.
    pub filter: GridFilter,
}

impl WorldGrid {
    /// The two cells between which a point of the unit cube lies along an axis, and the
    /// interpolation parameter.
    #[inline]
    fn neighbours(&self, axis: usize, x: f32) -> ([usize; 2], f32) {
        let count = self.grid.resolution[axis];
        let most = (count - 1) as f32;
        let x = x * count as f32;
        match self.filter {
            GridFilter::Nearest => ([x.clamp(0.0, most) as usize; 2], 0.0),
            GridFilter::Trilinear => {
                let x = (x - 0.5).clamp(0.0, most);
                let first = x as usize;
                ([first, (first + 1).min(count as usize - 1)], x - first as f32)
            }
        }
    }

    /// Channel `c` at a point, which is clamped to the unit cube.
    #[inline]
    pub(super) fn number(&self, p: Vec3, c: usize) -> f32 {
        let [nx, ny, _] = self.grid.resolution.map(|n| n as usize);
        let ([x0, x1], fx) = self.neighbours(0, p.x);
        let (ys, fy) = self.neighbours(1, p.y);
        let (zs, fz) = self.neighbours(2, p.z);
        let channels = self.grid.channels as usize;
        let row = |y: usize, z: usize| {
            let at = |x: usize| self.grid.values[((z * ny + y) * nx + x) * channels + c];
            at(x0).lerp(at(x1), fx)
        };
        let plane = |z: usize| row(ys[0], z).lerp(row(ys[1], z), fy);
        plane(zs[0]).lerp(plane(zs[1]), fz)
    }

    /// Three channels at a point of the unit cube.
    #[inline]
    pub(super) fn channels(&self, p: Vec3) -> Spectrum {
        Spectrum::rgb(self.number(p, 0), self.number(p, 1), self.number(p, 2))
    }

    /// A grid whose coordinates are those of the unit cube.
    pub fn on_unit_cube(grid: Arc<Grid>, filter: GridFilter) -> Self {
        Self { grid, corner: Vec3::ZERO, to_unit: Mat3::IDENTITY, filter }
    }

    /// Derivatives along the axes of the unit cube, ignoring discontinuities.
    pub(crate) fn slopes(&self, p: Vec3) -> [Spectrum; 3] {
        if self.filter == GridFilter::Nearest {
            return [Spectrum::ZERO; 3];
        }
        std::array::from_fn(|axis| {
            let count = self.grid.resolution[axis] as f32;
            let ([first, second], _) = self.neighbours(axis, p[axis]);
            let middle = |i: usize| {
                let mut at = p;
                at[axis] = (i as f32 + 0.5) / count;
                self.color(at)
            };
            // Constant beyond the centres of the outermost cells.
            let is_between = (0.5..=count - 0.5).contains(&(p[axis] * count));
            let grown = if is_between { middle(second) - middle(first) } else { Spectrum::ZERO };
            grown * count
        })
    }

    /// Transforms a point from world space to the unit cube.
    pub(super) fn to_unit(&self, p: Vec3) -> Vec3 {
        self.to_unit * (p - self.corner)
    }

    /// Transforms a point from world space to the unit cube; `None` if it is outside.
    pub(super) fn within(&self, p: Vec3) -> Option<Vec3> {
        let p = self.to_unit(p);
        (p.min_element() >= 0.0 && p.max_element() <= 1.0).then_some(p)
    }

    /// Value at a point of the unit cube; a single channel is used for all.
    pub(crate) fn color(&self, p: Vec3) -> Spectrum {
        if self.grid.channels == 3 { self.channels(p) } else { Spectrum::splat(self.number(p, 0)) }
    }
}
