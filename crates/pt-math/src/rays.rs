//! Arrays of rays, by rows or by columns.

use crate::{Ray, Vec3};

/// Number of rays of a [`Ray8`].
const EIGHT: usize = 8;

/// Eight rays by columns (structure of arrays).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(32))]
pub struct Ray8 {
    /// Origins: all x, all y, all z.
    pub origin: [[f32; EIGHT]; 3],
    /// Directions: all x, all y, all z.
    pub direction: [[f32; EIGHT]; 3],
    /// [`Ray::t_min`] of each ray.
    pub t_min: [f32; EIGHT],
    /// [`Ray::t_max`] of each ray.
    pub t_max: [f32; EIGHT],
}

impl Ray8 {
    /// Returns ray `i`.
    ///
    /// # Panics
    /// If `i` is 8 or more.
    #[inline]
    pub fn get(&self, i: usize) -> Ray {
        let vector =
            |columns: &[[f32; EIGHT]; 3]| Vec3::from_array([0, 1, 2].map(|k| columns[k][i]));
        Ray {
            origin: vector(&self.origin),
            direction: vector(&self.direction),
            t_min: self.t_min[i],
            t_max: self.t_max[i],
        }
    }

    /// Replaces ray `i`.
    ///
    /// # Panics
    /// If `i` is 8 or more.
    #[inline]
    pub fn set(&mut self, i: usize, ray: &Ray) {
        for k in 0..3 {
            self.origin[k][i] = ray.origin[k];
            self.direction[k][i] = ray.direction[k];
        }
        self.t_min[i] = ray.t_min;
        self.t_max[i] = ray.t_max;
    }
}

/// Rays by columns.
#[derive(Clone, Debug, Default)]
pub struct RayColumns {
    eights: Vec<Ray8>,
    len: usize,
}

impl RayColumns {
    /// Sets the number of rays; new ones have a zero direction. Returns the blocks of eight rays,
    /// the last of which may be partly unused.
    pub fn resize(&mut self, len: usize) -> &mut [Ray8] {
        self.len = len;
        self.eights.resize(len.div_ceil(EIGHT), Ray8::default());
        &mut self.eights
    }

    /// Keeps the first `len` rays.
    pub fn truncate(&mut self, len: usize) {
        self.resize(len.min(self.len));
    }
}

impl FromIterator<Ray> for RayColumns {
    fn from_iter<I: IntoIterator<Item = Ray>>(rays: I) -> Self {
        let mut columns = Self::default();
        for ray in rays {
            let i = columns.len;
            columns.resize(i + 1)[i / EIGHT].set(i % EIGHT, &ray);
        }
        columns
    }
}

/// Rays in either layout.
#[derive(Clone, Copy, Debug)]
pub enum Rays<'a> {
    /// By rows (array of structures).
    Rows(&'a [Ray]),
    /// By columns: blocks of eight rays, and the total number of rays.
    Columns(&'a [Ray8], usize),
}

impl<'a> Rays<'a> {
    /// Number of rays.
    #[inline]
    pub fn len(self) -> usize {
        match self {
            Self::Rows(rays) => rays.len(),
            Self::Columns(_, len) => len,
        }
    }

    /// Returns true if there are no rays.
    #[inline]
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Returns ray `i`.
    ///
    /// # Panics
    /// If `i` is out of range.
    #[inline]
    pub fn get(self, i: usize) -> Ray {
        match self {
            Self::Rows(rays) => rays[i],
            Self::Columns(eights, _) => eights[i / EIGHT].get(i % EIGHT),
        }
    }

    /// All rays, in order.
    #[inline]
    pub fn iter(self) -> impl ExactSizeIterator<Item = Ray> + 'a {
        (0..self.len()).map(move |i| self.get(i))
    }

    /// Splits after the first `n` rays, where `n` is a multiple of eight or the number of rays.
    ///
    /// # Panics
    /// If `n` is out of range, or neither of these.
    #[inline]
    pub fn split_at(self, n: usize) -> (Self, Self) {
        assert!(n.is_multiple_of(EIGHT) || n == self.len(), "{n} of {} rays", self.len());
        match self {
            Self::Rows(rays) => {
                let (first, rest) = rays.split_at(n);
                (Self::Rows(first), Self::Rows(rest))
            }
            Self::Columns(eights, len) => {
                let (first, rest) = eights.split_at(n.div_ceil(EIGHT));
                (Self::Columns(first, n), Self::Columns(rest, len - n))
            }
        }
    }
}

impl<'a> From<&'a [Ray]> for Rays<'a> {
    fn from(rays: &'a [Ray]) -> Self {
        Self::Rows(rays)
    }
}

impl<'a, const N: usize> From<&'a [Ray; N]> for Rays<'a> {
    fn from(rays: &'a [Ray; N]) -> Self {
        Self::Rows(rays)
    }
}

impl<'a> From<&'a Vec<Ray>> for Rays<'a> {
    fn from(rays: &'a Vec<Ray>) -> Self {
        Self::Rows(rays)
    }
}

impl<'a> From<&'a RayColumns> for Rays<'a> {
    fn from(rays: &'a RayColumns) -> Self {
        Self::Columns(&rays.eights, rays.len)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_rays_in_order() {
        for n in [0, 1, 7, 8, 9, 100] {
            let ray = |i| Ray::to(Vec3::new(i as f32, 1.0, 2.0), Vec3::splat(3.0 - i as f32), 9.0);
            let rows: Vec<_> = (0..n).map(ray).collect();
            let columns: RayColumns = rows.iter().copied().collect();
            let (rows, columns) = (Rays::from(&rows), Rays::from(&columns));
            assert_eq!(columns.len(), n);
            assert_eq!(columns.is_empty(), n == 0);
            assert!(columns.iter().eq(rows.iter()));
            for first in (0..n).step_by(8).chain([n]) {
                for rays in [columns, rows] {
                    let (part, rest) = rays.split_at(first);
                    assert_eq!((part.len(), rest.len()), (first, n - first));
                    assert!(part.iter().chain(rest.iter()).eq(rows.iter()));
                }
            }
        }
    }
}
