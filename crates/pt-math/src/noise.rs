//! Gradient noise. [Perlin 2002, "Improving Noise"; the four gradients that are there twice are those of pbrt-v4]

use crate::{FloatExt, Vec3};

/// The order of the numbers from 0 to 255 by which gradients are chosen, as published with the reference implementation.
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

/// Smooth noise of mean 0 between −1.04 and 1.04, which is 0 where all coordinates are whole numbers, and repeats after 256 along each axis.
/// Coordinates must be below 2³¹; from 2²³ on all are whole numbers.
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

/// The gradient at a corner of the lattice: from the middle of a cube to that of an edge.
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

    /// Values that follow from the definition: half way between two corners the weights are ½, and each gradient is an edge of a cube.
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

    /// Without jumps, within its bounds, of mean 0, and the same 256 further on.
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
}
