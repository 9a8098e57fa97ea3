//! Conversion between values and the levels of 8-bit images, which take a quarter of the memory.

use std::sync::LazyLock;

/// Linear values of sRGB levels; [`LEVELS`] has those of linear levels.
pub(crate) static SRGB: LazyLock<ByteLevels> =
    LazyLock::new(|| ByteLevels::new(pt_math::color::linear_from_srgb));
pub(crate) static LEVELS: LazyLock<ByteLevels> = LazyLock::new(|| ByteLevels::new(|v| v));

/// Values of 256 levels, increasing from 0 to 1.
pub(crate) struct ByteLevels {
    pub(crate) values: [f32; 256],
    /// The only candidate level of a value, indexed by the upper bits of the value.
    candidates: Vec<u8>,
}

impl ByteLevels {
    /// Number of lower bits that are not needed to distinguish levels: the exponent and 8 bits of
    /// the mantissa suffice.
    const SHIFT: u32 = 15;

    fn new(decode: impl Fn(f32) -> f32) -> Self {
        let values = std::array::from_fn(|i| decode(i as f32 / 255.0));
        let mut candidates = vec![0; Self::key(1.0) + 1];
        for (level, value) in (0..=255).zip(values) {
            candidates[Self::key(value)] = level;
        }
        Self { values, candidates }
    }

    fn key(value: f32) -> usize {
        (value.to_bits() >> Self::SHIFT) as usize
    }

    #[inline]
    pub(crate) fn light(&self, level: u8) -> f32 {
        self.values[usize::from(level)]
    }

    /// Returns the level with exactly this value, or `None` if there is none.
    #[inline]
    fn level(&self, value: f32) -> Option<u8> {
        // −0 is 0.
        let level = *self.candidates.get(Self::key(value + 0.0))?;
        (self.light(level) == value).then_some(level)
    }

    /// Returns the levels of all values, or `None` if one of them is no level.
    pub(crate) fn coded(&self, values: &[[f32; 3]]) -> Option<Vec<[u8; 3]>> {
        let levels = |&[r, g, b]: &[f32; 3]| Some([self.level(r)?, self.level(g)?, self.level(b)?]);
        values.iter().map(levels).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_are_found_by_their_values_and_others_are_none() {
        for levels in [&*SRGB, &*LEVELS] {
            for (level, value) in (0..=255).zip(levels.values) {
                assert_eq!(levels.level(value), Some(level));
                assert_eq!(levels.level(value.next_up()), None);
                assert_eq!(levels.level(value.next_down()), None);
            }
            assert_eq!(levels.level(-0.0), Some(0));
            for other in [-1.0, 2.0, f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
                assert_eq!(levels.level(other), None);
            }
        }
        assert_eq!(SRGB.coded(&[[0.0, 1.0, 0.0], [0.0, 0.3, 0.0]]), None);
    }
}
