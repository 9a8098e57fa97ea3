//! Representation of spectra: linear Rec. 709 RGB in `f32`.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

use glam::Vec3;

use crate::color::LUMINANCE;

/// A quantity that depends on wavelength (radiance, reflectance, …), as linear Rec. 709 RGB.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(transparent)]
pub struct Spectrum(pub Vec3);

impl Spectrum {
    /// Zero in every channel.
    pub const ZERO: Self = Self(Vec3::ZERO);
    /// One in every channel.
    pub const ONE: Self = Self(Vec3::ONE);

    /// Creates a spectrum from red, green and blue.
    #[inline]
    pub const fn rgb(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3::new(r, g, b))
    }

    /// Creates a spectrum with the same value in every channel.
    #[inline]
    pub const fn splat(v: f32) -> Self {
        Self(Vec3::splat(v))
    }

    /// Relative luminance, by the weights [`LUMINANCE`].
    #[inline]
    pub fn luminance(self) -> f32 {
        const WEIGHTS: [f32; 3] = [LUMINANCE[0] as f32, LUMINANCE[1] as f32, LUMINANCE[2] as f32];
        WEIGHTS[0] * self.0.x + WEIGHTS[1] * self.0.y + WEIGHTS[2] * self.0.z
    }

    /// Maximum over the channels.
    #[inline]
    pub fn max_channel(self) -> f32 {
        self.0.x.max(self.0.y).max(self.0.z)
    }

    /// Mean over the channels.
    #[inline]
    pub fn mean(self) -> f32 {
        (self.0.x + self.0.y + self.0.z) * (1.0 / 3.0)
    }

    /// Returns true if all channels are zero, of either sign.
    #[inline]
    pub fn is_black(self) -> bool {
        let bits = self.0.to_array().map(f32::to_bits);
        (bits[0] | bits[1] | bits[2]) << 1 == 0
    }

    /// Returns true if no channel is NaN or infinite.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// Applies `f` to each channel.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        Self(Vec3::new(f(self.0.x), f(self.0.y), f(self.0.z)))
    }

    /// Red, green and blue.
    #[inline]
    pub fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }
}

impl From<[f32; 3]> for Spectrum {
    fn from(c: [f32; 3]) -> Self {
        Self(Vec3::from_array(c))
    }
}

impl Add for Spectrum {
    type Output = Self;
    #[inline]
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0)
    }
}

impl Sub for Spectrum {
    type Output = Self;
    #[inline]
    fn sub(self, o: Self) -> Self {
        Self(self.0 - o.0)
    }
}

impl Mul for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0)
    }
}

impl Mul<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn mul(self, s: f32) -> Self {
        Self(self.0 * s)
    }
}

impl Div<f32> for Spectrum {
    type Output = Self;
    #[inline]
    fn div(self, s: f32) -> Self {
        Self(self.0 * (1.0 / s))
    }
}

impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, o: Self) {
        self.0 += o.0;
    }
}

impl MulAssign for Spectrum {
    #[inline]
    fn mul_assign(&mut self, o: Self) {
        self.0 *= o.0;
    }
}

impl MulAssign<f32> for Spectrum {
    #[inline]
    fn mul_assign(&mut self, s: f32) {
        self.0 *= s;
    }
}

impl Sum for Spectrum {
    fn sum<I: Iterator<Item = Self>>(items: I) -> Self {
        items.fold(Self::ZERO, Add::add)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_of_either_sign_is_black_and_nothing_else() {
        let is_black = |channel: f32| {
            let others = [[0.0, -0.0], [-0.0, 0.0]];
            others.map(|[a, b]| {
                [[channel, a, b], [a, channel, b], [a, b, channel]]
                    .map(|channels| Spectrum::from(channels).is_black())
            })
        };
        for channel in [0.0, -0.0] {
            assert_eq!(is_black(channel), [[true; 3]; 2], "{channel}");
        }
        let smallest = f32::from_bits(1);
        for channel in [smallest, -smallest, 1.0, -1.0, f32::INFINITY, f32::NAN] {
            assert_eq!(is_black(channel), [[false; 3]; 2], "{channel}");
        }
    }
}
