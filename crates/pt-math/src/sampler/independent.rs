//! Independent random numbers from hashes of counters.

use super::unit;

/// Multiplier and increment of the 32-bit linear congruential step of PCG hashes. [Jarzynski &
/// Olano 2020, "Hash Functions for GPU Rendering", JCGT 9(3)]
const LCG: (u32, u32) = (1_664_525, 1_013_904_223);

/// Hashes three words to three well-mixed words: pcg3d of Jarzynski & Olano 2020.
#[inline]
pub(super) fn pcg3d(v: [u32; 3]) -> [u32; 3] {
    let [mut x, mut y, mut z] = v.map(|w| w.wrapping_mul(LCG.0).wrapping_add(LCG.1));
    let round = |x: &mut u32, y: &mut u32, z: &mut u32| {
        *x = x.wrapping_add(y.wrapping_mul(*z));
        *y = y.wrapping_add(z.wrapping_mul(*x));
        *z = z.wrapping_add(x.wrapping_mul(*y));
    };
    round(&mut x, &mut y, &mut z);
    [x, y, z] = [x, y, z].map(|w| w ^ (w >> 16));
    round(&mut x, &mut y, &mut z);
    [x, y, z]
}

/// Hashes four words to four well-mixed words: pcg4d of Jarzynski & Olano 2020.
#[inline]
pub(super) fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let mut v = v.map(|w| w.wrapping_mul(LCG.0).wrapping_add(LCG.1));
    let round = |v: &mut [u32; 4]| {
        v[0] = v[0].wrapping_add(v[1].wrapping_mul(v[3]));
        v[1] = v[1].wrapping_add(v[2].wrapping_mul(v[0]));
        v[2] = v[2].wrapping_add(v[0].wrapping_mul(v[1]));
        v[3] = v[3].wrapping_add(v[1].wrapping_mul(v[2]));
    };
    round(&mut v);
    v = v.map(|w| w ^ (w >> 16));
    round(&mut v);
    v
}

/// Prepares a dimension for the hashes, where words that differ only in their highest bits have
/// correlated hashes. Dimensions below 2¹⁶ are unchanged.
#[inline(always)]
pub(super) fn mixed(d: u32) -> u32 {
    d ^ (d >> 16)
}

/// Two random numbers of one sample at dimension `d`.
#[inline(always)]
pub(super) fn point(key: [u32; 2], sample: u32, d: u32) -> [f32; 2] {
    let [x, y, ..] = pcg4d([key[0], key[1], sample, mixed(d)]);
    [unit(x), unit(y)]
}
