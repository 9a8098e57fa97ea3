//! Random numbers that depend on nothing but what they are for.

/// A sequence of random numbers: that of number `index` of a `purpose`.
pub(super) struct Random {
    state: u64,
}

impl Random {
    pub(super) fn new(purpose: u64, index: usize) -> Self {
        Self { state: mix(mix(purpose).wrapping_add(index as u64)) }
    }

    /// The next number, uniform in [0, 1).
    pub(super) fn uniform(&mut self) -> f32 {
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        (mix(self.state) >> 40) as f32 / (1u32 << 24) as f32
    }

    /// The next number, uniform in [`low`, `high`).
    pub(super) fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.uniform()
    }

    /// Two numbers, uniform in [0, 1).
    pub(super) fn pair(&mut self) -> [f32; 2] {
        [self.uniform(), self.uniform()]
    }
}

/// Mixes all bits of a number. [Steele, Lea & Flood 2014, Fast splittable pseudorandom number
/// generators; constants by Stafford]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
