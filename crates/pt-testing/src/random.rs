//! Deterministic random input for tests.

use pt_math::Vec3;

/// Stream of random numbers: SplitMix64. [Steele, Lea & Flood 2014, "Fast Splittable Pseudorandom
/// Number Generators", figure 17; output function: variant 13 of Stafford]
///
/// Independent of the samplers of the renderer, so that it does not share their errors.
#[derive(Clone, Debug)]
pub struct Random(u64);

impl Random {
    /// Creates the stream of a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Returns 64 random bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a uniform number in [0, 1).
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 * (1.0 / 16_777_216.0)
    }

    /// Returns a uniform point in [0, 1)².
    pub fn unit_2d(&mut self) -> [f32; 2] {
        [self.unit(), self.unit()]
    }

    /// Returns a uniform number in [a, b).
    pub fn between(&mut self, a: f32, b: f32) -> f32 {
        a + (b - a) * self.unit()
    }

    /// Returns a uniform integer in 0 … n − 1; `n` must not be 0.
    pub fn below(&mut self, n: usize) -> usize {
        ((u128::from(self.bits()) * n as u128) >> 64) as usize
    }

    /// Returns a vector with coordinates uniform in [−1, 1).
    pub fn in_cube(&mut self) -> Vec3 {
        Vec3::new(self.between(-1.0, 1.0), self.between(-1.0, 1.0), self.between(-1.0, 1.0))
    }

    /// Returns a unit vector, uniform on the sphere, by rejection: the first vector of the cube
    /// that is neither outside of the ball nor too short to normalise accurately.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = self.in_cube();
            let length2 = v.length_squared();
            if (1e-4..=1.0).contains(&length2) {
                return v / length2.sqrt();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_moments_of_the_uniform_distribution() {
        let mut random = Random::new(1);
        let n = 1 << 16;
        let (mut sum, mut squares, mut direction) = (0.0, 0.0, Vec3::ZERO);
        for _ in 0..n {
            let x = f64::from(random.unit());
            assert!((0.0..1.0).contains(&x) && random.below(3) < 3);
            sum += x;
            squares += x * x;
            direction += random.direction();
        }
        let n = f64::from(n);
        // Five standard errors: the variances of x, x² and a coordinate are 1/12, 4/45, 1/3.
        assert!((sum / n - 0.5).abs() < 5.0 * (1.0 / 12.0 / n).sqrt());
        assert!((squares / n - 1.0 / 3.0).abs() < 5.0 * (4.0 / 45.0 / n).sqrt());
        let bound = 5.0 * (n / 3.0).sqrt() as f32;
        assert!(direction.abs().max_element() < bound, "{direction}");
    }

    #[test]
    fn the_first_numbers_are_those_of_the_reference_implementation() {
        // Output of the public reference code for seed 1234567.
        let mut random = Random::new(1_234_567);
        assert_eq!(random.bits(), 6_457_827_717_110_365_317);
        assert_eq!(random.bits(), 3_203_168_211_198_807_973);
    }
}
