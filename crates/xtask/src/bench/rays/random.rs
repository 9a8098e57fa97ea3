//! Random numbers that depend only on their purpose and index.

use pt_testing::Random;

/// Random numbers of item `index` of a `purpose`.
pub(super) fn random(purpose: u64, index: usize) -> Random {
    Random::new((purpose << 40) + index as u64)
}
