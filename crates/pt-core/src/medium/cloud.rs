//! Procedural clouds. [pbrt-v4, `CloudMedium`; its noise sums five octaves, at points displaced by
//! two others]

use pt_math::{Mat3, Spectrum, Vec3, noise};

/// Ratio of the frequencies of successive octaves.
const FINER: f32 = 1.99;
/// Step of the finite differences of the noise.
const STEP: f32 = 0.01;

/// Clouds in a box of world space.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// Maximum extinction per metre, relative to that of the greatest channel.
    pub color: Spectrum,
    /// See [`pt_scene::medium::Cloud`].
    pub density: f32,
    /// See [`pt_scene::medium::Cloud`].
    pub wispiness: f32,
    /// See [`pt_scene::medium::Cloud`].
    pub frequency: f32,
    /// Lower corner of the box, in coordinates of the clouds.
    pub low: Vec3,
    /// Size of the box, in coordinates of the clouds.
    pub size: Vec3,
    /// Lower corner of the box in world space.
    pub corner: Vec3,
    /// Transform from world-space offsets to that corner to the unit cube.
    pub to_unit: Mat3,
}

impl Cloud {
    /// Density at a point of the unit cube, from 0 to 1.
    pub(super) fn at(&self, p: Vec3) -> f32 {
        let p = self.low + p * self.size;
        let lumps = self.lumps(p * self.frequency);
        let torn = ((1.0 - p.y) * 4.5 * self.density * lumps).clamp(0.0, 1.0);
        (torn + below(p.y)).min(1.0)
    }

    /// Upper bound of [`Self::at`] between two heights of the unit cube.
    pub(super) fn most(&self, [from, to]: [f32; 2]) -> f32 {
        // Upper bound of the sum of the octaves: each noise value is at most 1.04.
        const LUMPS: f32 = 1.04 * 0.96875;
        let [a, b] = [from, to].map(|y| self.low.y + y * self.size.y);
        let lowest = a.min(b) - 1e-6 * (a.abs() + b.abs());
        // Above y = 1, the factor is negative, and the noise may be negative as well.
        let factor = (1.0 - lowest).abs().max((1.0 - a.max(b)).abs());
        ((factor * 4.5 * self.density * LUMPS).min(1.0) + below(lowest)).min(1.0)
    }

    /// Five octaves of noise, each half as strong as the one before.
    fn lumps(&self, mut p: Vec3) -> f32 {
        if self.wispiness > 0.0 {
            let (mut strength, mut scale) = (0.05 * self.wispiness, 10.0);
            for _ in 0..2 {
                p += slope(p * scale) * strength;
                strength *= 0.5;
                scale *= FINER;
            }
        }
        let (mut sum, mut strength, mut scale) = (0.0, 0.5, 1.0);
        for _ in 0..5 {
            sum += strength * noise::perlin(p * scale);
            strength *= 0.5;
            scale *= FINER;
        }
        sum
    }
}

/// Density added at the bottom of the clouds.
fn below(y: f32) -> f32 {
    2.0 * (0.5 - y).max(0.0)
}

fn slope(p: Vec3) -> Vec3 {
    let here = noise::perlin(p);
    let along = |axis: Vec3| (noise::perlin(p + axis * STEP) - here) / STEP;
    Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z))
}

#[cfg(test)]
mod tests {
    use pt_testing::Random;

    use super::*;

    fn cloud(low: f32, size: f32) -> Cloud {
        Cloud {
            color: Spectrum::ONE,
            density: 2.0,
            wispiness: 1.0,
            frequency: 5.0,
            low: Vec3::splat(low),
            size: Vec3::splat(size),
            corner: Vec3::ZERO,
            to_unit: Mat3::IDENTITY,
        }
    }

    /// Clouds are dense at the bottom and thin at the top, and below the bound for each height.
    #[test]
    fn clouds_get_thinner_with_height() {
        let mut random = Random::new(5);
        let cloud = cloud(0.0, 1.0);
        let mut means = [0.0; 10];
        for (slab, mean) in means.iter_mut().enumerate() {
            let heights = [slab, slab + 1].map(|i| i as f32 * 0.1);
            let most = cloud.most(heights);
            for _ in 0..2000 {
                let y = heights[0] + 0.1 * random.unit();
                let d = cloud.at(Vec3::new(random.unit(), y, random.unit()));
                assert!((0.0..=most).contains(&d), "{d} of {most} at {y}");
                *mean += d / 2000.0;
            }
        }
        assert!(means[..3].iter().all(|mean| *mean > 0.7), "{means:?}");
        assert!(means[5] > means[7] && means[7] > means[9] && means[9] < 0.2, "{means:?}");
        assert_eq!(cloud.most([0.0, 0.2]), 1.0);
    }

    /// Above the clouds, the factor of the noise is negative, and so may be the noise.
    #[test]
    fn bounds_hold_above_and_below_the_clouds() {
        let mut random = Random::new(6);
        let cloud = cloud(-2.0, 5.0);
        for _ in 0..20_000 {
            let p = random.in_cube() * 0.5 + 0.5;
            let heights = [p.y - 0.03 * random.unit(), p.y + 0.03 * random.unit()];
            assert!(cloud.at(p) <= cloud.most(heights), "{p}");
        }
    }
}
