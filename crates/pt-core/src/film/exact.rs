//! Exact sums of floating-point numbers in fixed point.

/// Sum of floating-point numbers as a fixed-point number of `WORDS` words of 64 bits, least
/// significant first, in two's complement, with the unit 2^−`FRACTION`. It is exact, and so
/// associative and commutative.
#[derive(Clone, Copy, Debug, PartialEq, Eq, bytemuck::Zeroable)]
pub struct FixedPoint<const WORDS: usize, const FRACTION: i32>([u64; WORDS]);

/// Sum of `f32` values of magnitude up to 2⁴⁸, in units of 2⁻⁶⁴, in [−2¹²⁷, 2¹²⁷): fewer than 2⁷⁹
/// values cannot overflow it. A pixel has fewer than 2³² samples, and an image that fits in memory
/// has fewer than 2⁷⁹.
pub type ExactSum = FixedPoint<3, 64>;

/// Sum of squares of such values, in units of 2⁻¹²⁷, below 2¹²⁸: the samples of a pixel cannot
/// overflow it.
pub(super) type SquareSum = FixedPoint<4, 127>;

impl ExactSum {
    /// The largest magnitude of a single value.
    pub const LIMIT: f32 = (1u64 << 48) as f32;
}

impl<const WORDS: usize, const FRACTION: i32> Default for FixedPoint<WORDS, FRACTION> {
    fn default() -> Self {
        Self([0; WORDS])
    }
}

impl<const WORDS: usize, const FRACTION: i32> FixedPoint<WORDS, FRACTION> {
    /// Adds a finite value; bits below the unit are truncated.
    #[inline]
    pub fn add(&mut self, value: f32) {
        self.add_f64(f64::from(value));
    }

    /// Adds a finite `f64` value; bits below the unit are truncated.
    #[inline]
    pub(super) fn add_f64(&mut self, value: f64) {
        let bits = value.to_bits();
        let exponent = ((bits >> 52) & 0x7ff) as i32;
        if exponent == 0 {
            return; // zero, or below 2⁻¹⁰²²
        }
        let mantissa = (bits & 0xf_ffff_ffff_ffff) | 0x10_0000_0000_0000;
        let shift = exponent - 1075 + FRACTION;
        let (mantissa, shift) = match u32::try_from(shift) {
            Ok(shift) => (mantissa, shift),
            Err(_) => (mantissa.checked_shr(shift.unsigned_abs()).unwrap_or(0), 0),
        };
        let shifted = u128::from(mantissa) << (shift % 64);
        self.add_words(
            (shift / 64) as usize,
            [shifted as u64, (shifted >> 64) as u64],
            bits >> 63 != 0,
        );
    }

    /// Adds two words at word index `first`, or subtracts them.
    #[inline]
    fn add_words(&mut self, first: usize, words: [u64; 2], is_negative: bool) {
        let mut carry = false;
        for (i, own) in self.0.iter_mut().enumerate() {
            let word = match i.wrapping_sub(first) {
                0 => words[0],
                1 => words[1],
                _ => 0,
            };
            (*own, carry) = if is_negative {
                own.borrowing_sub(word, carry)
            } else {
                own.carrying_add(word, carry)
            };
        }
    }

    /// Adds another sum.
    #[inline]
    pub fn merge(&mut self, other: Self) {
        let mut carry = false;
        for (own, word) in self.0.iter_mut().zip(other.0) {
            (*own, carry) = own.carrying_add(word, carry);
        }
    }

    pub(super) fn words(self) -> [u64; WORDS] {
        self.0
    }

    pub(super) fn from_words(words: [u64; WORDS]) -> Self {
        Self(words)
    }

    /// Returns the sum, rounded once.
    #[inline]
    pub fn value(self) -> f64 {
        let is_negative = self.0[WORDS - 1] >> 63 != 0;
        let mut magnitude = Self::default();
        if is_negative {
            let mut carry = true;
            for (word, own) in magnitude.0.iter_mut().zip(self.0) {
                (*word, carry) = (!own).carrying_add(0, carry);
            }
        } else {
            magnitude = self;
        }
        let Some(top) = magnitude.0.iter().rposition(|word| *word != 0) else { return 0.0 };
        let zeros = magnitude.0[top].leading_zeros();
        let below = if top > 0 { magnitude.0[top - 1] } else { 0 };
        let two = u128::from(magnitude.0[top]) << 64 | u128::from(below);
        // The leading 64 bits; the last one is sticky and represents all bits that follow.
        let digits = two << zeros;
        let rest =
            (digits as u64) != 0 || magnitude.0[..top.saturating_sub(1)].iter().any(|w| *w != 0);
        let digits = (digits >> 64) as u64 | u64::from(rest);
        let value = libm::ldexp(digits as f64, 64 * top as i32 - zeros as i32 - FRACTION);
        if is_negative { -value } else { value }
    }
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

    /// Returns 2^`doublings` times `value`, by adding a sum to itself.
    fn doubled<const W: usize, const F: i32>(value: f32, doublings: u32) -> FixedPoint<W, F> {
        let mut sum = FixedPoint::default();
        sum.add(value);
        for _ in 0..doublings {
            sum.merge(sum);
        }
        sum
    }

    /// For all powers of two that samples can have, of both signs, and for the number of samples of
    /// a pixel (2³²) and of the largest image (2⁷⁹ − 1 at most; here 2⁷⁸): the sum is the product.
    #[test]
    fn no_magnitude_sign_or_count_wraps_a_sum() {
        for power in -64..=48 {
            for sign in [1.0, -1.0] {
                let value = sign * 2f32.powi(power);
                for doublings in [0, 1, 31, 32, 33, 62, 63, 64, 65, 78] {
                    let wanted = f64::from(sign) * 2f64.powi(power + doublings as i32);
                    let sum: ExactSum = doubled(value, doublings);
                    assert_eq!(sum.value(), wanted, "2^{doublings} times {value}");
                    let mut none = sum;
                    none.merge(doubled(-value, doublings));
                    assert_eq!(
                        none,
                        ExactSum::default(),
                        "2^{doublings} times {value}, and less it"
                    );
                }
            }
        }
        for power in -127..=96 {
            let value = f64::powi(2.0, power);
            let mut sum = SquareSum::default();
            sum.add_f64(value);
            for doublings in 0..32 {
                assert_eq!(
                    sum.value(),
                    value * f64::from(1u32 << doublings),
                    "{power} {doublings}"
                );
                sum.merge(sum);
            }
            assert_eq!(sum.value() == value * 2f64.powi(32), power < 96, "{power}");
        }
    }

    /// For numbers below 2¹²⁷ the sums are those of `i128`, whose conversion to `f64` rounds once.
    #[test]
    fn values_are_rounded_once_to_the_nearest() {
        let mut random = pt_testing::Random::new(5);
        let mut word = || (0..4).fold(0, |word: u64, _| word << 16 | random.below(1 << 16) as u64);
        for length in (1..=127).cycle().take(20_000) {
            let bits = (u128::from(word()) << 64 | u128::from(word())) >> (128 - length);
            let number = bits as i128 * if word() & 1 == 0 { 1 } else { -1 };
            let sign = (number >> 127) as u64;
            let sum = FixedPoint::<3, 0>::from_words([number as u64, (number >> 64) as u64, sign]);
            assert_eq!(sum.value(), number as f64, "{number}");
        }
    }
}
