//! Exact sums.

use pt_math::Spectrum;
use wide::{f64x4, u32x4};

/// A sum of `f32` values as a fixed-point number: exact, hence associative and commutative.
///
/// The least significant bit is 2⁻⁶⁴. Magnitudes up to 2⁴⁸ keep 15 bits of head room, enough for
/// 32,768 samples of the largest value, or 2³¹ samples of 2³².
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Zeroable)]
pub struct ExactSum(i128);

impl ExactSum {
    const FRACTION_BITS: i32 = 64;

    /// The largest magnitude of a single value.
    pub const LIMIT: f32 = (1u64 << 48) as f32;

    /// Adds a finite value of at most [`Self::LIMIT`]; digits below 2⁻⁶⁴ are cut off.
    #[inline]
    pub fn add(&mut self, value: f32) {
        let bits = value.to_bits();
        let exponent = ((bits >> 23) & 0xff) as i32;
        if exponent == 0 {
            return; // zero, or below 2⁻¹²⁶
        }
        let mantissa = i128::from((bits & 0x7f_ffff) | 0x80_0000);
        let shift = exponent - 150 + Self::FRACTION_BITS;
        let magnitude = match shift {
            0.. => mantissa << shift.min(127 - 24),
            -23..0 => mantissa >> -shift,
            _ => 0,
        };
        self.0 = self.0.wrapping_add(if bits >> 31 == 0 { magnitude } else { -magnitude });
    }

    /// Adds a value below 2⁶² in magnitude that is a multiple of 2⁻⁶⁴.
    #[inline]
    pub(super) fn add_multiple(&mut self, value: f64) {
        let bits = value.to_bits();
        let exponent = ((bits >> 52) & 0x7ff) as i32;
        if exponent == 0 {
            return; // zero
        }
        let mantissa = i128::from((bits & 0xf_ffff_ffff_ffff) | 0x10_0000_0000_0000);
        let shift = exponent - 1075 + Self::FRACTION_BITS;
        let magnitude = if shift >= 0 { mantissa << shift } else { mantissa >> -shift };
        self.0 = self.0.wrapping_add(if bits >> 63 == 0 { magnitude } else { -magnitude });
    }

    /// Adds another sum.
    #[inline]
    pub fn merge(&mut self, other: Self) {
        self.0 = self.0.wrapping_add(other.0);
    }

    /// The number of 2⁻⁶⁴, as bytes.
    pub(super) fn to_le_bytes(self) -> [u8; 16] {
        self.0.to_le_bytes()
    }

    pub(super) fn from_le_bytes(bytes: [u8; 16]) -> Self {
        Self(i128::from_le_bytes(bytes))
    }

    /// The sum, rounded once.
    #[inline]
    pub fn value(self) -> f64 {
        self.0 as f64 / 18_446_744_073_709_551_616.0
    }
}

/// Sums kept of a pixel.
pub(super) const CHANNELS: usize = 4;

/// What is summed of a sample: red, green, blue, and the square of the luminance.
#[inline(always)]
pub(super) fn moments(l: Spectrum) -> [f32; CHANNELS] {
    let [r, g, b] = l.to_array();
    let y = l.luminance();
    [r, g, b, (y * y).min(ExactSum::LIMIT)]
}

/// The sums of the samples' [`moments`], if all are numbers that [`ExactSum::add`] takes without
/// cutting off digits, and no sum in `f64` is rounded: all are multiples of the last digit of the
/// least of them that is not 0, and n times the greatest has at most 53 binary digits above that.
#[inline]
pub(super) fn sums(samples: impl ExactSizeIterator<Item = Spectrum>) -> Option<[f64; CHANNELS]> {
    /// The least number without digits below 2⁻⁶⁴.
    const LEAST: f32 = 1.0 / (1u64 << 41) as f32;
    const EXPONENT: u32 = f32::MANTISSA_DIGITS - 1;
    let mut sum = f64x4::ZERO;
    // Magnitudes, whose bits have the same order; one less, so that 0 comes last.
    let mut least = u32x4::splat(u32::MAX);
    let mut greatest = u32x4::ZERO;
    let count = samples.len();
    for l in samples {
        let values = moments(l);
        sum += f64x4::new(values.map(f64::from));
        let size = u32x4::new(values.map(f32::to_bits)) & u32x4::splat(i32::MAX as u32);
        least = least.min(size - u32x4::splat(1));
        greatest = greatest.max(size);
    }
    // Where all are 0, the order is inverted.
    let least = (least + u32x4::splat(1)).to_array();
    let digits = count.max(1).next_power_of_two().ilog2() + f32::MANTISSA_DIGITS;
    let is_exact = |(least, greatest): (u32, u32)| {
        let in_range = least >= LEAST.to_bits() && greatest <= ExactSum::LIMIT.to_bits();
        let range = (greatest >> EXPONENT).wrapping_sub(least >> EXPONENT);
        greatest == 0 || in_range && digits + range <= f64::MANTISSA_DIGITS
    };
    least.into_iter().zip(greatest.to_array()).all(is_exact).then(|| sum.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_exact_in_any_order() {
        let values = [1e9f32, -1e-9, 3.25, -1e9, 1e-12, 0.1, -3.25];
        let sum = |order: &[usize]| {
            let mut s = ExactSum::default();
            for &i in order {
                s.add(values[i]);
            }
            s
        };
        let forward = sum(&[0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(forward, sum(&[6, 5, 4, 3, 2, 1, 0]));
        let want = f64::from(0.1f32) + f64::from(1e-12f32) - f64::from(1e-9f32);
        assert!((forward.value() - want).abs() < 1e-18, "{} {want}", forward.value());
    }

    #[test]
    fn limits_do_not_overflow() {
        let mut s = ExactSum::default();
        for _ in 0..32_767 {
            s.add(ExactSum::LIMIT);
        }
        assert_eq!(s.value(), 32_767.0 * f64::from(ExactSum::LIMIT));
    }

    /// Values that differ by more and more powers of two, so that first all sums, then some, and
    /// then none can be computed in `f64`.
    #[test]
    fn sums_of_many_are_those_of_one_by_one_or_refused() {
        let mut random = pt_testing::Random::new(3);
        let mut seen = [0; 2];
        for spread in (0..60).cycle().take(6000) {
            let mut number = || {
                let power = random.below(2 * spread + 1) as i32 - spread as i32;
                let sign = [-1.0, 0.0, 1.0][random.below(3)];
                sign * (1.0 + random.unit()) * 2f32.powi(power)
            };
            let samples: Vec<_> =
                (0..=spread % 17).map(|_| Spectrum::rgb(number(), number(), number())).collect();
            let fits = |l: &Spectrum| l.0.abs().max_element() <= ExactSum::LIMIT;
            let Some(sums) = sums(samples.iter().copied()) else {
                seen[0] += 1;
                continue;
            };
            seen[1] += 1;
            assert!(samples.iter().all(fits), "{samples:?}");
            for (channel, sum) in sums.into_iter().enumerate() {
                let [mut at_once, mut one_by_one] = [ExactSum::default(); 2];
                at_once.add_multiple(sum);
                for &l in &samples {
                    one_by_one.add(moments(l)[channel]);
                }
                assert_eq!(at_once, one_by_one, "{channel} of {samples:?}");
            }
        }
        assert!(seen.into_iter().all(|n| n > 500), "{seen:?}");
    }

    #[test]
    fn what_is_no_number_is_not_summed() {
        for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, 2.0 * ExactSum::LIMIT, 1e-30] {
            assert_eq!(sums([Spectrum::ONE, Spectrum::rgb(0.0, x, 0.0)].into_iter()), None, "{x}");
        }
        assert_eq!(sums(std::iter::empty()), Some([0.0; CHANNELS]));
    }
}
