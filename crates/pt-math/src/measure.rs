//! Densities with their measure in the type, so that adding an area density to a solid-angle
//! density is a type error instead of a bright pixel.

use std::marker::PhantomData;

/// Density per steradian.
#[derive(Clone, Copy, Debug)]
pub struct SolidAngle;

/// Density per unit of surface.
#[derive(Clone, Copy, Debug)]
pub struct Area;

/// A probability density with respect to the measure `M`.
#[derive(Clone, Copy, Debug)]
pub struct Pdf<M>(f32, PhantomData<M>);

impl<M> Pdf<M> {
    /// Zero: never sampled.
    pub const ZERO: Self = Self::new(0.0);

    /// Creates a density from its value.
    #[inline]
    pub const fn new(p: f32) -> Self {
        Self(p, PhantomData)
    }

    /// Value of the density.
    #[inline]
    pub const fn get(self) -> f32 {
        self.0
    }

    /// Returns true if the density is positive and finite, as that of any sample is.
    #[inline]
    pub fn is_positive(self) -> bool {
        self.0 > 0.0 && self.0.is_finite()
    }

    /// Density of `n` independent samples taken together, or of one that is taken with probability
    /// `n`.
    #[inline]
    pub fn scaled_by(self, n: f32) -> Self {
        Self::new(self.0 * n)
    }
}

impl Pdf<Area> {
    /// Converts dA to dω: p_ω = p_A · r² / |cos θ'|, with r the distance to the point and θ' the
    /// angle at it. [Veach 1997, eq. 8.10]
    #[inline]
    pub fn to_solid_angle(self, distance_squared: f32, cos_at_point: f32) -> Pdf<SolidAngle> {
        Pdf::new(self.0 * distance_squared / cos_at_point.abs())
    }
}

/// Power heuristic with β = 2: w_f = p_f² / (p_f² + p_g²). [Veach 1997, §9.2.4]
///
/// Computed from the ratio of the two, so that neither square overflows.
///
/// ```compile_fail
/// use pt_math::measure::{power_heuristic, Area, Pdf, SolidAngle};
/// power_heuristic(Pdf::<SolidAngle>::new(1.0), Pdf::<Area>::new(1.0)); // measures differ
/// ```
/// ```
/// use pt_math::measure::{power_heuristic, Area, Pdf, SolidAngle};
/// power_heuristic(Pdf::<SolidAngle>::new(1.0), Pdf::<Area>::new(1.0).to_solid_angle(4.0, 0.5));
/// ```
#[inline]
pub fn power_heuristic<M: Copy>(f: Pdf<M>, g: Pdf<M>) -> f32 {
    if f.0 == 0.0 {
        return 0.0;
    }
    let r = g.0 / f.0;
    1.0 / (1.0 + r * r)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heuristic_weights_sum_to_one() {
        for (a, b) in [(1.0, 1.0), (1e-20, 3e19), (0.25, 7.0), (0.0, 1.0)] {
            let (a, b) = (Pdf::<Area>::new(a), Pdf::new(b));
            assert!((power_heuristic(a, b) + power_heuristic(b, a) - 1.0).abs() < 1e-6);
        }
    }
}
