//! Multi-jittered points [Chiu, Shirley & Wang 1994, "Multi-Jittered Sampling", Graphics Gems IV]
//! by hashed permutations. [Kensler 2013, "Correlated Multi-Jittered Sampling", Pixar Technical
//! Memo 13-01]
//!
//! n points are one in each of the cells of a grid of about √n × √n, and at the same time one in
//! each of n equal intervals of either coordinate. The cell of a sample, and its position in the
//! cell, are given by permutations that are computed, so any point can be computed by itself.
//!
//! Kensler's points are shifted by the same permutation in all rows of the grid, which costs a
//! quarter of an order: their error falls as n^−¾. The points here have a permutation for each row
//! and column, and their error falls as n⁻¹.

use super::independent;

/// Permutation of the numbers below `len`. [ibid., listing "permute": rounds of invertible steps on
/// as many bits as `len` has, repeated until the result is below it]
#[inline]
fn permute(mut i: u32, len: u32, seed: u32) -> u32 {
    let mask = u32::MAX.checked_shr((len - 1).leading_zeros()).unwrap_or(0);
    loop {
        i ^= seed;
        i = i.wrapping_mul(0xe170_893d);
        i ^= seed >> 16;
        i ^= (i & mask) >> 4;
        i ^= seed >> 8;
        i = i.wrapping_mul(0x0929_eb3f);
        i ^= seed >> 23;
        i ^= (i & mask) >> 1;
        i = i.wrapping_mul(1 | seed >> 27);
        i = i.wrapping_mul(0x6935_fa69);
        i ^= (i & mask) >> 11;
        i = i.wrapping_mul(0x74dc_b303);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0x9e50_1cc3);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0xc860_a3df);
        i &= mask;
        i ^= i >> 5;
        if i < len {
            let (turned, below) = (u64::from(i) + u64::from(seed % len), u64::from(len));
            return if turned < below { turned } else { turned - below } as u32;
        }
    }
}

/// Width of the grid of n cells. A grid that is not full costs more accuracy than one that is not
/// square.
#[inline(always)]
fn columns(n: u32) -> u32 {
    if n.is_power_of_two() { 1 << (n.ilog2() / 2) } else { n.isqrt() }
}

/// Seed of a row or column.
#[inline(always)]
fn of_line(seed: u32, line: u32) -> u32 {
    (seed ^ line).wrapping_mul(0x9e37_79b1)
}

/// Point of one of `spp` samples at dimension `d`; samples from number `spp` on form further sets
/// of `spp` points.
#[inline]
pub(super) fn point(key: [u32; 2], spp: u32, sample: u32, d: u32) -> [f32; 2] {
    let n = spp.max(1);
    let [seed, seed_x, seed_y] =
        independent::pcg3d([key[0] ^ (sample / n), key[1], independent::mixed(d)]);
    let [jitter_x, jitter_y] = independent::point(key, sample, d);
    let columns = columns(n);
    let rows = n.div_ceil(columns);
    let cell = permute(sample % n, columns * rows, seed);
    let (column, row) = (cell % columns, cell / columns);
    let in_column = permute(row, rows, of_line(seed_x, column));
    let in_row = permute(column, columns, of_line(seed_y, row));
    let x = (column as f32 + (in_column as f32 + jitter_x) / rows as f32) / columns as f32;
    let y = (row as f32 + (in_row as f32 + jitter_y) / columns as f32) / rows as f32;
    [x, y].map(|v| v.min(1.0f32.next_down()))
}

#[cfg(test)]
mod tests {
    use super::permute;

    #[test]
    fn permutations_take_each_number_once() {
        for len in [1, 2, 3, 7, 8, 100, 1000] {
            for seed in [0, 1, 0x9e37_79b9, u32::MAX] {
                let mut all: Vec<_> = (0..len).map(|i| permute(i, len, seed)).collect();
                all.sort_unstable();
                assert!(all.into_iter().eq(0..len), "{len} {seed}");
            }
        }
    }
}
