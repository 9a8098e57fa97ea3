//! Vectors of several samples at once.
//!
//! A loop over all [`LANES`] whose body is a formula without branches and calls, inlined, becomes
//! vector instructions, and has the same bits as the formula for one sample: so each formula is
//! written once, for plain numbers. Choices are made by `if` of two values that are both known.

use crate::Vec3;
use crate::sampler::{LANES, Lanes};

/// A vector for each lane, coordinate by coordinate.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Vec3Lanes {
    x: Lanes<f32>,
    y: Lanes<f32>,
    z: Lanes<f32>,
}

impl Vec3Lanes {
    /// Zero in each lane.
    pub const ZERO: Self = Self { x: [0.0; LANES], y: [0.0; LANES], z: [0.0; LANES] };

    /// Returns the vector of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x[lane], self.y[lane], self.z[lane])
    }

    /// Changes the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        (self.x[lane], self.y[lane], self.z[lane]) = (v.x, v.y, v.z);
    }
}
