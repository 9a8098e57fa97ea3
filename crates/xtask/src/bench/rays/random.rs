//! Random numbers that depend on nothing but what they are for.

use pt_testing::Random;

/// The numbers of number `index` of a `purpose`.
pub(super) fn random(purpose: u64, index: usize) -> Random {
    Random::new((purpose << 40) + index as u64)
}
