//! Numbers of several samples at once: one formula for a single number and for lanes of numbers.
//!
//! A function of [`Real`] numbers computes one value with `f32`, and a value for each of [`LANES`]
//! samples with [`F32Lanes`], with the same bits. Operations of lanes are loops over arrays, which
//! the compiler turns into vector instructions; they have no branches, so that choices are made by
//! [`Real::select`].

use std::ops::{Add, BitAnd, Div, Mul, Neg, Sub};

use crate::sampler::{LANES, Lanes};
use crate::{Vec3, trig};

/// A number, or a number for each lane.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Result of comparisons.
    type Mask: Mask;

    /// Returns the same number in each lane.
    fn splat(x: f32) -> Self;
    /// Returns a function of the number; one without branches becomes vector instructions.
    fn map(self, f: impl Fn(f32) -> f32) -> Self;
    /// Returns a function of two numbers.
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self;
    /// Returns two functions of a number.
    fn map_pair(self, f: impl Fn(f32) -> (f32, f32)) -> (Self, Self);
    /// self < other
    fn lt(self, other: Self) -> Self::Mask;
    /// self ≤ other
    fn le(self, other: Self) -> Self::Mask;
    /// Returns `a` where the mask is set, and `b` elsewhere.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;

    /// Square root.
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.map(f32::sqrt)
    }
    /// Absolute value.
    #[inline(always)]
    fn abs(self) -> Self {
        self.map(f32::abs)
    }
    /// The greater of two numbers; `other` if either is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    /// The smaller of two numbers; `other` if either is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    /// See [`trig::sin_cos_tau`].
    #[inline(always)]
    fn sin_cos_tau(self) -> (Self, Self) {
        self.map_pair(trig::sin_cos_tau)
    }
    /// See [`trig::atan2`]; `self` is y.
    #[inline(always)]
    fn atan2(self, x: Self) -> Self {
        self.zip(x, trig::atan2)
    }
}

/// A truth value, or one for each lane.
pub trait Mask: Copy + BitAnd<Output = Self> {
    /// Returns true if it is true in any lane.
    fn any(self) -> bool;
    /// Returns true if it is true in all lanes.
    fn all(self) -> bool;
}

impl Real for f32 {
    type Mask = bool;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        x
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        f(self)
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        f(self, other)
    }
    #[inline(always)]
    fn map_pair(self, f: impl Fn(f32) -> (f32, f32)) -> (Self, Self) {
        f(self)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
}

impl Mask for bool {
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
    #[inline(always)]
    fn all(self) -> bool {
        self
    }
}

/// A number for each lane.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(align(64))]
pub struct F32Lanes(pub Lanes<f32>);

/// A truth value for each lane, as all bits or none.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct MaskLanes(Lanes<u32>);

impl MaskLanes {
    /// Returns true if it is true in a lane.
    #[inline(always)]
    pub fn get(self, lane: usize) -> bool {
        self.0[lane] != 0
    }
}

/// Computes a value for each lane.
#[inline(always)]
fn each<T: Copy + Default>(f: impl Fn(usize) -> T) -> Lanes<T> {
    let mut values = [T::default(); LANES];
    for (lane, value) in values.iter_mut().enumerate() {
        *value = f(lane);
    }
    values
}

#[inline(always)]
fn mask(is_true: bool) -> u32 {
    u32::from(is_true).wrapping_neg()
}

macro_rules! operators {
    ($($name:ident $function:ident $operator:tt),*) => {$(
        impl $name for F32Lanes {
            type Output = Self;
            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(each(|i| self.0[i] $operator other.0[i]))
            }
        }
    )*};
}
operators!(Add add +, Sub sub -, Mul mul *, Div div /);

impl Neg for F32Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl Real for F32Lanes {
    type Mask = MaskLanes;

    #[inline(always)]
    fn splat(x: f32) -> Self {
        Self([x; LANES])
    }
    #[inline(always)]
    fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(each(|i| f(self.0[i])))
    }
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Self(each(|i| f(self.0[i], other.0[i])))
    }
    #[inline(always)]
    fn map_pair(self, f: impl Fn(f32) -> (f32, f32)) -> (Self, Self) {
        let (mut a, mut b) = (Self::default(), Self::default());
        for i in 0..LANES {
            (a.0[i], b.0[i]) = f(self.0[i]);
        }
        (a, b)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> MaskLanes {
        MaskLanes(each(|i| mask(self.0[i] < other.0[i])))
    }
    #[inline(always)]
    fn le(self, other: Self) -> MaskLanes {
        MaskLanes(each(|i| mask(self.0[i] <= other.0[i])))
    }
    #[inline(always)]
    fn select(mask: MaskLanes, a: Self, b: Self) -> Self {
        let pick = |i: usize| (a.0[i].to_bits() & mask.0[i]) | (b.0[i].to_bits() & !mask.0[i]);
        Self(each(|i| f32::from_bits(pick(i))))
    }
}

impl BitAnd for MaskLanes {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(each(|i| self.0[i] & other.0[i]))
    }
}

impl Mask for MaskLanes {
    #[inline(always)]
    fn any(self) -> bool {
        self.0.iter().fold(0, |all, m| all | m) != 0
    }
    #[inline(always)]
    fn all(self) -> bool {
        self.0.iter().fold(!0, |all, m| all & m) != 0
    }
}

/// A vector of real numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Real3<R> {
    /// Coordinates.
    pub x: R,
    /// See `x`.
    pub y: R,
    /// See `x`.
    pub z: R,
}

impl<R: Real> Real3<R> {
    /// Creates a vector.
    #[inline(always)]
    pub fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }
    /// a · b
    #[inline(always)]
    pub fn dot(self, b: Self) -> R {
        self.x * b.x + self.y * b.y + self.z * b.z
    }
    /// a × b
    #[inline(always)]
    pub fn cross(self, b: Self) -> Self {
        Self {
            x: self.y * b.z - b.y * self.z,
            y: self.z * b.x - b.z * self.x,
            z: self.x * b.y - b.x * self.y,
        }
    }
    /// |a|²
    #[inline(always)]
    pub fn length_squared(self) -> R {
        self.dot(self)
    }
    /// |a|
    #[inline(always)]
    pub fn length(self) -> R {
        self.length_squared().sqrt()
    }
    /// The absolute value of each coordinate.
    #[inline(always)]
    pub fn abs(self) -> Self {
        Self { x: self.x.abs(), y: self.y.abs(), z: self.z.abs() }
    }
}

macro_rules! vector_operators {
    ($($name:ident $function:ident $operator:tt),*; $($by:ident $scale:ident $scaled:tt),*) => {
        $(impl<R: Real> $name for Real3<R> {
            type Output = Self;
            #[inline(always)]
            fn $function(self, b: Self) -> Self {
                Self { x: self.x $operator b.x, y: self.y $operator b.y, z: self.z $operator b.z }
            }
        })*
        $(impl<R: Real> $by<R> for Real3<R> {
            type Output = Self;
            #[inline(always)]
            fn $scale(self, s: R) -> Self {
                Self { x: self.x $scaled s, y: self.y $scaled s, z: self.z $scaled s }
            }
        })*
    };
}
vector_operators!(Add add +, Sub sub -; Mul mul *, Div div /);

impl From<Vec3> for Real3<f32> {
    #[inline(always)]
    fn from(v: Vec3) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl From<Real3<f32>> for Vec3 {
    #[inline(always)]
    fn from(v: Real3<f32>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl Real3<F32Lanes> {
    /// Returns the vector of a lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Vec3 {
        Vec3::new(self.x.0[lane], self.y.0[lane], self.z.0[lane])
    }
    /// Changes the vector of a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, v: Vec3) {
        [self.x.0[lane], self.y.0[lane], self.z.0[lane]] = v.to_array();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ordinary numbers, and those at which comparisons and functions go another way.
    const NUMBERS: Lanes<f32> = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        0.3,
        -2.5,
        1e-30,
        1e30,
        f32::MIN_POSITIVE,
        f32::MAX,
        f32::INFINITY,
        f32::NEG_INFINITY,
        f32::NAN,
        0.999_999,
        7.0,
        -0.125,
    ];

    /// Any function of real numbers.
    fn function<R: Real>(a: R, b: R) -> [R; 12] {
        let v = Real3::new(a, b, R::splat(0.5));
        let w = Real3::new(b - a, a * b, R::splat(2.0));
        let (sin, cos) = a.abs().min(R::splat(1.0)).sin_cos_tau();
        let chosen = R::select(a.lt(b) & b.le(R::splat(1.0)), a, b);
        let Real3 { x, y, z } = (v.cross(w) + v * a - w / b).abs();
        [x, y, z, sin, cos, R::atan2(a, b), chosen, a.max(b), a.min(b), a.sqrt(), -a, v.dot(w)]
    }

    #[test]
    fn lanes_have_the_bits_of_single_numbers() {
        for turn in 0..LANES {
            let mut others = NUMBERS;
            others.rotate_left(turn);
            let together = function(F32Lanes(NUMBERS), F32Lanes(others));
            for lane in 0..LANES {
                let alone = function(NUMBERS[lane], others[lane]);
                for (a, b) in alone.into_iter().zip(together) {
                    let (a, b) = (a, b.0[lane]);
                    assert!(a.to_bits() == b.to_bits() || a.is_nan() && b.is_nan(), "{a} {b}");
                }
            }
        }
    }

    #[test]
    fn masks_know_some_from_all() {
        let less = |x: f32| F32Lanes(NUMBERS).lt(F32Lanes::splat(x));
        assert!(less(0.0).any() && !less(0.0).all() && !less(f32::NEG_INFINITY).any());
        assert!(F32Lanes::splat(1.0).le(F32Lanes::splat(1.0)).all());
        assert!(less(0.0).get(3) && !less(0.0).get(2));
    }
}
