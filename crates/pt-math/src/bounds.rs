//! Axis-aligned boxes.

use glam::Vec3;

/// Axis-aligned box; empty if a coordinate of `min` is above that of `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct Bounds3 {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

impl Bounds3 {
    /// Empty box, the neutral element of the union.
    pub const EMPTY: Self =
        Self { min: Vec3::splat(f32::INFINITY), max: Vec3::splat(f32::NEG_INFINITY) };

    /// Box that contains one point.
    #[inline]
    pub const fn point(p: Vec3) -> Self {
        Self { min: p, max: p }
    }

    /// Returns true if the box is empty.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.min.cmpgt(self.max).any()
    }

    /// Extends the box to contain a point.
    #[inline]
    pub fn grow(&mut self, p: Vec3) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// Smallest box around both.
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// max − min.
    #[inline]
    pub fn diagonal(&self) -> Vec3 {
        self.max - self.min
    }

    /// Center of the box.
    #[inline]
    pub fn center(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Half the surface area, as used by the surface area heuristic; 0 if empty.
    #[inline]
    pub fn half_area(&self) -> f32 {
        let d = self.diagonal().max(Vec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }
}

impl FromIterator<Vec3> for Bounds3 {
    fn from_iter<I: IntoIterator<Item = Vec3>>(points: I) -> Self {
        points.into_iter().fold(Self::EMPTY, |mut b, p| {
            b.grow(p);
            b
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn union_with_nothing_changes_nothing() {
        let b: Bounds3 = [Vec3::ZERO, Vec3::new(1.0, 2.0, 3.0)].into_iter().collect();
        assert_eq!(b.union(Bounds3::EMPTY), b);
        assert_eq!(b.half_area(), 11.0);
        assert!(Bounds3::EMPTY.is_empty() && !b.is_empty());
        assert_eq!(Bounds3::EMPTY.half_area(), 0.0);
    }
}
