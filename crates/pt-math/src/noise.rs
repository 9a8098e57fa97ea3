//! Gradient noise, and sums of its octaves. [Perlin 2002, "Improving Noise"; the four duplicated
//! gradients are those of pbrt-v4]

use std::ops::{Add, Mul};

use crate::{FloatExt, Vec3};

/// Permutation of the numbers from 0 to 255 by which gradients are chosen, as published with the
/// reference implementation.
const ORDER: [u8; 256] = [
    151, 160, 137, 91, 90, 15, 131, 13, 201, 95, 96, 53, 194, 233, 7, 225, 140, 36, 103, 30, 69,
    142, 8, 99, 37, 240, 21, 10, 23, 190, 6, 148, 247, 120, 234, 75, 0, 26, 197, 62, 94, 252, 219,
    203, 117, 35, 11, 32, 57, 177, 33, 88, 237, 149, 56, 87, 174, 20, 125, 136, 171, 168, 68, 175,
    74, 165, 71, 134, 139, 48, 27, 166, 77, 146, 158, 231, 83, 111, 229, 122, 60, 211, 133, 230,
    220, 105, 92, 41, 55, 46, 245, 40, 244, 102, 143, 54, 65, 25, 63, 161, 1, 216, 80, 73, 209, 76,
    132, 187, 208, 89, 18, 169, 200, 196, 135, 130, 116, 188, 159, 86, 164, 100, 109, 198, 173,
    186, 3, 64, 52, 217, 226, 250, 124, 123, 5, 202, 38, 147, 118, 126, 255, 82, 85, 212, 207, 206,
    59, 227, 47, 16, 58, 17, 182, 189, 28, 42, 223, 183, 170, 213, 119, 248, 152, 2, 44, 154, 163,
    70, 221, 153, 101, 155, 167, 43, 172, 9, 129, 22, 39, 253, 19, 98, 108, 110, 79, 113, 224, 232,
    178, 185, 112, 104, 218, 246, 97, 228, 251, 34, 242, 193, 238, 210, 144, 12, 191, 179, 162,
    241, 81, 51, 145, 235, 249, 14, 239, 107, 49, 192, 214, 31, 181, 199, 106, 157, 184, 84, 204,
    176, 115, 121, 50, 45, 127, 4, 150, 254, 138, 236, 205, 93, 222, 114, 67, 29, 24, 72, 243, 141,
    128, 195, 78, 66, 215, 61, 156, 180,
];

/// Smooth noise of mean 0 in [−1.04, 1.04]. It is 0 at integer coordinates, and repeats after 256
/// along each axis. Coordinates must be below 2³¹; from 2²³ on all are integers.
///
/// ```
/// use pt_math::{Vec3, noise};
/// assert_eq!(noise::perlin(Vec3::new(3.0, -2.0, 7.0)), 0.0);
/// ```
pub fn perlin(p: Vec3) -> f32 {
    let floor = p.floor();
    let [x, y, z] = floor.to_array().map(|x| x as i32 as u8);
    let d = p - floor;
    let corner = |i: u8, j: u8, k: u8| {
        let offset = Vec3::new(f32::from(i), f32::from(j), f32::from(k));
        gradient(x.wrapping_add(i), y.wrapping_add(j), z.wrapping_add(k)).dot(d - offset)
    };
    let w = d * d * d * (d * (d * 6.0 - 15.0) + 10.0);
    let along_x = |j: u8, k: u8| corner(0, j, k).lerp(corner(1, j, k), w.x);
    let along_y = |k: u8| along_x(0, k).lerp(along_x(1, k), w.y);
    along_y(0).lerp(along_y(1), w.z)
}

/// Value of a function in space, and its gradient.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ValueAndGradient {
    /// Value of the function.
    pub value: f32,
    /// Gradient of the function.
    pub slope: Vec3,
}

impl Add for ValueAndGradient {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: self.slope + other.slope }
    }
}

impl Mul<f32> for ValueAndGradient {
    type Output = Self;

    fn mul(self, factor: f32) -> Self {
        Self { value: self.value * factor, slope: self.slope * factor }
    }
}

/// [`perlin`] with its gradient.
pub fn perlin_sloped(p: Vec3) -> ValueAndGradient {
    let floor = p.floor();
    let [x, y, z] = floor.to_array().map(|x| x as i32 as u8);
    let d = p - floor;
    let corner = |i: u8, j: u8, k: u8| {
        let offset = Vec3::new(f32::from(i), f32::from(j), f32::from(k));
        let slope = gradient(x.wrapping_add(i), y.wrapping_add(j), z.wrapping_add(k));
        ValueAndGradient { value: slope.dot(d - offset), slope }
    };
    let w = d * d * d * (d * (d * 6.0 - 15.0) + 10.0);
    let dw = d * d * (d * (d - 2.0) + 1.0) * 30.0;
    // The derivative of a + w (b − a) has the additional term w′ (b − a).
    let between = |a: ValueAndGradient, b: ValueAndGradient, axis: usize| {
        let mut slope = a.slope.lerp(b.slope, w[axis]);
        slope[axis] += dw[axis] * (b.value - a.value);
        ValueAndGradient { value: a.value.lerp(b.value, w[axis]), slope }
    };
    let along_x = |j: u8, k: u8| between(corner(0, j, k), corner(1, j, k), 0);
    let along_y = |k: u8| between(along_x(0, k), along_x(1, k), 1);
    between(along_y(0), along_y(1), 2)
}

/// Summand of octaves: a value, or a value with its gradient.
pub trait NoiseValue: Copy + Default + Add<Output = Self> + Mul<f32, Output = Self> {
    /// [`perlin`] at `p`, or 0 if `p` is not finite; gradients are with respect to `p`.
    fn at(p: Vec3) -> Self;
    /// Constant function of this value.
    fn even(value: f32) -> Self;
    /// Absolute value of the function.
    #[must_use]
    fn abs(self) -> Self;
    /// Same value with the gradient scaled by `factor`: the chain rule for a scaled argument.
    #[must_use]
    fn stretched(self, factor: f32) -> Self;
}

impl NoiseValue for f32 {
    #[inline]
    fn at(p: Vec3) -> Self {
        if p.is_finite() { perlin(p) } else { 0.0 }
    }

    fn even(value: f32) -> Self {
        value
    }

    fn abs(self) -> Self {
        self.abs()
    }

    fn stretched(self, _: f32) -> Self {
        self
    }
}

impl NoiseValue for ValueAndGradient {
    #[inline]
    fn at(p: Vec3) -> Self {
        if p.is_finite() { perlin_sloped(p) } else { Self::default() }
    }

    fn even(value: f32) -> Self {
        Self { value, slope: Vec3::ZERO }
    }

    fn abs(self) -> Self {
        if self.value < 0.0 { self * -1.0 } else { self }
    }

    fn stretched(self, factor: f32) -> Self {
        Self { value: self.value, slope: self.slope * factor }
    }
}

/// Ratio of the frequencies of successive octaves: not quite 2, so that the zeros of their lattices
/// do not coincide.
const LACUNARITY: f32 = 1.99;

/// Approximate mean of |[`perlin`]|.
pub const MEAN_MAGNITUDE: f32 = 0.2;

/// Number of octaves and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Octaves {
    /// Total number of octaves.
    pub count: u32,
    /// Ratio of the weights of successive octaves.
    pub roughness: f32,
    /// Number of octaves that are evaluated; the last one may have a fractional weight.
    pub seen: f32,
}

impl Octaves {
    /// All of `count` octaves.
    pub fn new(count: u32, roughness: f32) -> Self {
        Self { count, roughness, seen: count as f32 }
    }

    /// Omits octaves finer than twice `width`, which would alias. [Pharr, Jakob & Humphreys,
    /// "Physically Based Rendering", 3rd ed., §10.6.3]
    #[must_use]
    pub fn seen_within(self, width: f32) -> Self {
        if width > 0.0 {
            let seen = (-1.0 - libm::log2f(width)).clamp(0.0, self.count as f32);
            Self { seen, ..self }
        } else {
            self
        }
    }

    /// Each octave with its frequency, its weight, and the fraction of it that is evaluated.
    fn each(self) -> impl Iterator<Item = (f32, f32, f32)> {
        let start = (1.0, 1.0);
        let roughness = self.roughness;
        let steps = std::iter::successors(Some(start), move |(frequency, worth)| {
            Some((frequency * LACUNARITY, worth * roughness))
        });
        let share = move |i: u32| {
            let t = ((self.seen - i as f32 - 0.3) / 0.4).clamp(0.0, 1.0);
            if self.seen - i as f32 >= 1.0 { 1.0 } else { t * t * (3.0 - 2.0 * t) }
        };
        (0..self.count).zip(steps).map(move |(i, (frequency, worth))| (frequency, worth, share(i)))
    }

    /// Fractional Brownian motion, Σ rⁱ noise(1.99ⁱ p) for the roughness r.
    pub fn fbm<T: NoiseValue>(self, p: Vec3) -> T {
        let seen = self.each().take_while(|(.., share)| *share > 0.0);
        seen.fold(T::default(), |sum, (frequency, worth, share)| {
            sum + T::at(p * frequency).stretched(frequency) * (worth * share)
        })
    }

    /// Turbulence, Σ rⁱ |noise(1.99ⁱ p)|; omitted octaves are replaced by [`MEAN_MAGNITUDE`].
    pub fn turbulence<T: NoiseValue>(self, p: Vec3) -> T {
        self.each().fold(T::default(), |sum, (frequency, worth, share)| {
            let unseen = sum + T::even(MEAN_MAGNITUDE * worth * (1.0 - share));
            if share == 0.0 {
                return unseen;
            }
            unseen + T::at(p * frequency).abs().stretched(frequency) * (worth * share)
        })
    }
}

/// Gradient at a corner of the lattice: from the centre of a cube to the midpoint of an edge.
fn gradient(x: u8, y: u8, z: u8) -> Vec3 {
    const TABLE: [[f32; 3]; 16] = [
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
        [1.0, -1.0, 0.0],
        [-1.0, -1.0, 0.0],
        [1.0, 0.0, 1.0],
        [-1.0, 0.0, 1.0],
        [1.0, 0.0, -1.0],
        [-1.0, 0.0, -1.0],
        [0.0, 1.0, 1.0],
        [0.0, -1.0, 1.0],
        [0.0, 1.0, -1.0],
        [0.0, -1.0, -1.0],
        [1.0, 1.0, 0.0],
        [-1.0, 1.0, 0.0],
        [0.0, 1.0, -1.0],
        [0.0, -1.0, -1.0],
    ];
    let at = |i: u8| ORDER[usize::from(i)];
    let chosen = at(at(at(x).wrapping_add(y)).wrapping_add(z));
    Vec3::from_array(TABLE[usize::from(chosen & 15)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_order_has_each_number_once() {
        let mut sorted = ORDER;
        sorted.sort_unstable();
        assert!(sorted.iter().enumerate().all(|(i, n)| i == usize::from(*n)));
    }

    /// Values that follow from the definition: half way between two corners the weights are ½, and
    /// each gradient is an edge of a cube.
    #[test]
    fn noise_is_what_gradients_make_it() {
        let p = Vec3::new(0.5, 0.0, 0.0);
        let want = 0.5 * (gradient(0, 0, 0).x * 0.5 - gradient(1, 0, 0).x * 0.5);
        assert_eq!(perlin(p), want);
        for [x, y, z] in [[0, 0, 0], [255, 7, 13], [4, 200, 31]] {
            let edge = gradient(x, y, z).to_array();
            let zeros = edge.iter().filter(|c| **c == 0.0).count();
            assert!(zeros == 1 && edge.iter().all(|c| c.abs() <= 1.0), "{edge:?}");
        }
    }

    /// Noise is continuous, within its bounds, of mean 0, and periodic with 256.
    #[test]
    fn noise_is_smooth_and_even() {
        const COUNT: i32 = 40;
        let (mut sum, mut most) = (0.0_f64, 0.0_f32);
        for i in 0..COUNT * COUNT * COUNT {
            let at = [i % COUNT, i / COUNT % COUNT, i / COUNT / COUNT];
            let p = Vec3::from_array(at.map(|c| c as f32 * 0.37 - 7.3));
            let n = perlin(p);
            sum += f64::from(n);
            most = most.max(n.abs());
            let step = perlin(p + Vec3::splat(1e-3)) - n;
            assert!(step.abs() < 8e-3, "{p}: {step}");
            let repeated = perlin(p + Vec3::new(256.0, -256.0, 512.0));
            assert!((repeated - n).abs() < 2e-3, "{p}: {n} {repeated}");
        }
        assert!(most <= 1.04 && most > 0.7, "{most}");
        assert!((sum / f64::from(COUNT.pow(3))).abs() < 0.01, "{sum}");
    }

    fn some_points() -> impl Iterator<Item = Vec3> {
        (0..500).map(|i| {
            let i = i as f32;
            Vec3::new(0.0371 * i - 9.0, 7.3 - 0.0733 * i, 0.0219 * i + 3.3)
        })
    }

    /// Tests the noise, fBm and turbulence.
    #[test]
    fn slopes_are_differences() {
        let octaves = Octaves::new(3, 0.6);
        let check =
            |f: &dyn Fn(Vec3) -> f32, sloped: &dyn Fn(Vec3) -> ValueAndGradient, kinks: bool| {
                let mut bad = 0;
                for p in some_points() {
                    let ValueAndGradient { value, slope } = sloped(p);
                    assert_eq!(value, f(p), "{p}");
                    let step = 2e-3;
                    let difference =
                        Vec3::AXES.map(|a| (f(p + a * step) - f(p - a * step)) / (2.0 * step));
                    bad += u32::from((Vec3::from(difference) - slope).length() > 0.03);
                }
                // There is no gradient at a change of sign.
                assert!(bad <= if kinks { 30 } else { 0 }, "{bad}");
            };
        check(&perlin, &perlin_sloped, false);
        check(&|p| octaves.fbm(p), &|p| octaves.fbm(p), false);
        check(&|p| octaves.turbulence(p), &|p| octaves.turbulence(p), true);
    }

    /// With all octaves evaluated, the sums are those of the definition.
    #[test]
    fn octaves_are_summed_by_their_worth() {
        let p = Vec3::new(0.3, -4.7, 12.1);
        let terms: Vec<f32> = (0..3).map(|i| perlin(p * [1.0, 1.99, 1.99 * 1.99][i])).collect();
        let octaves = Octaves::new(3, 0.5);
        let fbm: f32 = octaves.fbm(p);
        assert!((fbm - (terms[0] + 0.5 * terms[1] + 0.25 * terms[2])).abs() < 1e-6);
        let turbulence: f32 = octaves.turbulence(p);
        let want = terms[0].abs() + 0.5 * terms[1].abs() + 0.25 * terms[2].abs();
        assert!((turbulence - want).abs() < 1e-6);
        assert_eq!(Octaves::new(0, 0.5).fbm::<f32>(p), 0.0);
    }

    /// From a width of ½ on, only means remain; between, the sums are continuous.
    #[test]
    fn what_is_seen_fades_with_the_width() {
        let octaves = Octaves::new(6, 0.5);
        assert_eq!(octaves.seen_within(0.0), octaves);
        assert_eq!(octaves.seen_within(f32::INFINITY).seen, 0.0);
        for p in some_points().take(20) {
            assert_eq!(octaves.seen_within(0.5).fbm::<f32>(p), 0.0);
            let mean = (0..6).map(|i| MEAN_MAGNITUDE * 0.5_f32.powi(i)).sum::<f32>();
            assert!((octaves.seen_within(0.5).turbulence::<f32>(p) - mean).abs() < 1e-6);
            let mut last = [octaves.fbm::<f32>(p), octaves.turbulence::<f32>(p)];
            for i in 0..1000 {
                let seen = octaves.seen_within(2e-3 * 1.01_f32.powi(i));
                let here = [seen.fbm::<f32>(p), seen.turbulence::<f32>(p)];
                assert!((0..2).all(|k| (here[k] - last[k]).abs() < 0.06), "{p} {i}");
                last = here;
            }
        }
    }

    /// Tests extreme arguments, and a fractional last octave.
    #[test]
    fn sums_are_finite_and_bounded_everywhere() {
        let hostile =
            [0.0, -0.0, 1e-40, 0.5, -3.7, 1e9, -3e9, 1e30, f32::MAX, f32::INFINITY, f32::NAN];
        for x in hostile {
            for y in hostile {
                for seen in [32.0, 3.5, 0.0] {
                    let octaves = Octaves { seen, ..Octaves::new(32, 0.5) };
                    for p in [Vec3::new(x, y, 0.3), Vec3::new(0.7, x, y), Vec3::splat(x)] {
                        let fbm: ValueAndGradient = octaves.fbm(p);
                        let turbulence: ValueAndGradient = octaves.turbulence(p);
                        assert!(fbm.value.abs() <= 2.1 && fbm.slope.is_finite(), "{p}");
                        assert!((0.0..=2.1).contains(&turbulence.value), "{p}");
                        assert!(turbulence.slope.is_finite(), "{p}");
                    }
                }
            }
        }
    }

    /// Uses 100,000 points; the standard error is below 0.001.
    #[test]
    fn the_mean_magnitude_is_about_what_it_is_said_to_be() {
        const COUNT: u32 = 100_000;
        let at = |i: u32| Vec3::new(0.618_034, 0.754_878, 0.569_84) * (i as f32 * 0.01);
        let sum: f64 = (0..COUNT).map(|i| f64::from(perlin(at(i) + at(i * 7 % COUNT)).abs())).sum();
        let mean = sum / f64::from(COUNT);
        assert!((mean - f64::from(MEAN_MAGNITUDE)).abs() < 0.03, "{mean}");
    }
}
