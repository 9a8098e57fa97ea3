//! Sums of the samples of a pixel.

use pt_math::Spectrum;
use wide::{f64x4, u32x4};

use super::ExactSum;
use super::exact::SquareSum;

/// Sums of red, green and blue, and of the square of the luminance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Zeroable)]
pub(super) struct RadianceSums {
    pub(super) light: [ExactSum; 3],
    pub(super) squares: SquareSum,
}

/// Number of values of a sample that are summed.
const CHANNELS: usize = 4;

impl RadianceSums {
    /// Adds a sample, none of whose channels is beyond [`ExactSum::LIMIT`].
    #[inline]
    pub(super) fn add(&mut self, sample: Spectrum) {
        self.add_moments(moments(sample).map(f64::from));
    }

    /// Adds the result of [`moments_of`].
    #[inline]
    pub(super) fn add_moments(&mut self, [r, g, b, square]: [f64; CHANNELS]) {
        for (sum, value) in self.light.iter_mut().zip([r, g, b]) {
            sum.add_f64(value);
        }
        self.squares.add_f64(square);
    }

    /// Adds the sums of other samples.
    pub(super) fn merge(&mut self, other: &Self) {
        for (own, sum) in self.light.iter_mut().zip(other.light) {
            own.merge(sum);
        }
        self.squares.merge(other.squares);
    }
}

/// Largest square of a luminance: that of [`ExactSum::LIMIT`].
const GREATEST_SQUARE: f32 = ExactSum::LIMIT * ExactSum::LIMIT;

/// Returns the values of a sample that are summed: red, green, blue, and the square of the
/// luminance.
#[inline(always)]
fn moments(l: Spectrum) -> [f32; CHANNELS] {
    let [r, g, b] = l.to_array();
    let y = l.luminance();
    [r, g, b, (y * y).min(GREATEST_SQUARE)]
}

/// Returns the sums of the samples' [`moments`] in `f64`, or `None` unless they are exact.
///
/// They are exact if all values are finite and representable in the sums without truncation, and no
/// addition in `f64` rounds. The latter holds since all values are multiples of the last bit of the
/// smallest one that is not 0, if n times the largest has at most 53 bits above that bit.
#[inline]
pub(super) fn moments_of(
    samples: impl ExactSizeIterator<Item = Spectrum>,
) -> Option<[f64; CHANNELS]> {
    /// Smallest values without bits below 2⁻⁶⁴ and 2⁻¹²⁷.
    const MIN: [f32; CHANNELS] = {
        let light = 1.0 / (1u64 << 41) as f32;
        [light, light, light, 1.0 / (1u128 << 104) as f32]
    };
    const GREATEST: [f32; CHANNELS] =
        [ExactSum::LIMIT, ExactSum::LIMIT, ExactSum::LIMIT, GREATEST_SQUARE];
    const EXPONENT: u32 = f32::MANTISSA_DIGITS - 1;
    let mut sum = f64x4::ZERO;
    // Magnitudes, whose bits have the same order; minus one, so that 0 comes last.
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
    // If all are 0, the order is inverted.
    let least = (least + u32x4::splat(1)).to_array();
    let digits = count.max(1).next_power_of_two().ilog2() + f32::MANTISSA_DIGITS;
    let greatest = greatest.to_array();
    let is_exact = |channel: usize| {
        let (least, greatest) = (least[channel], greatest[channel]);
        let in_range = least >= MIN[channel].to_bits() && greatest <= GREATEST[channel].to_bits();
        let range = (greatest >> EXPONENT).wrapping_sub(least >> EXPONENT);
        greatest == 0 || in_range && digits + range <= f64::MANTISSA_DIGITS
    };
    (0..CHANNELS).all(is_exact).then(|| sum.to_array())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// For values that differ by more and more powers of two, so that first all sums, then some,
    /// and then none can be computed in `f64`.
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
            let Some(sums) = moments_of(samples.iter().copied()) else {
                seen[0] += 1;
                continue;
            };
            seen[1] += 1;
            assert!(samples.iter().all(fits), "{samples:?}");
            let [mut at_once, mut one_by_one] = [RadianceSums::default(); 2];
            at_once.add_moments(sums);
            for &l in &samples {
                one_by_one.add(l);
            }
            assert_eq!(at_once, one_by_one, "{samples:?}");
        }
        assert!(seen.into_iter().all(|n| n > 500), "{seen:?}");
    }

    #[test]
    fn what_is_no_number_is_not_summed() {
        for x in [f32::NAN, f32::INFINITY, -f32::INFINITY, 2.0 * ExactSum::LIMIT, 1e-30] {
            assert_eq!(
                moments_of([Spectrum::ONE, Spectrum::rgb(0.0, x, 0.0)].into_iter()),
                None,
                "{x}"
            );
        }
        assert_eq!(moments_of(std::iter::empty()), Some([0.0; CHANNELS]));
    }
}
