//! Owen-scrambled Sobol' points in pairs of dimensions, by hashing. [Burley 2020, "Practical
//! Hash-based Owen Scrambling", JCGT 9(4)]
//!
//! Every dimension or pair of dimensions uses the first one or two dimensions of the Sobol'
//! sequence with scrambles of its own, and takes its points in a shuffled order of its own
//! ("padding"). The shuffle is an Owen scramble of the index, which maps each aligned run of 2ᵏ
//! samples to an aligned run, so such runs stay (0, 2)-nets.
//!
//! A scramble works on numbers whose bits are reversed, so that what it does to a digit depends
//! on the digits before it alone. The first Sobol' dimension reverses the bits of the index;
//! reversed again it is the index itself, and most reversals cancel.

use super::independent::pcg3d;
use super::unit;

/// Owen scrambling of a number whose bits are reversed. [Laine & Karras 2011, "Stratified Sampling
/// for Stochastic Transparency", §3; form and constants: N. Vegdahl, "Building a Better LK Hash",
/// psychopath.io, 2021]
#[inline]
fn scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// The second Sobol' dimension of index `i`, bits reversed.
///
/// Its generator matrix is Pascal's triangle modulo 2, [Sobol' 1967; Kollig & Keller 2002], whose
/// entry in row j and column k is 1 exactly where the bits of j are a subset of those of k
/// (Lucas's theorem). Digit j therefore is the sum of the bits of `i` over the supersets of j,
/// and a sum over supersets is taken one bit of j at a time.
#[inline]
fn second_dimension_reversed(mut i: u32) -> u32 {
    i ^= (i >> 16) & 0x0000_ffff;
    i ^= (i >> 8) & 0x00ff_00ff;
    i ^= (i >> 4) & 0x0f0f_0f0f;
    i ^= (i >> 2) & 0x3333_3333;
    i ^ ((i >> 1) & 0x5555_5555)
}

/// The form in which [`point_1d`] and [`point_2d`] want the number of a sample.
#[inline]
pub(super) fn prepare_index(sample: u32) -> u32 {
    sample.reverse_bits()
}

/// The shuffled index at dimension `d`, and seeds for two scrambles.
#[inline]
fn shuffle(key: u64, reversed_sample: u32, d: u32) -> (u32, [u32; 2]) {
    let [order, x, y] = pcg3d([key as u32, (key >> 32) as u32, d]);
    (scramble_reversed(reversed_sample, order).reverse_bits(), [x, y])
}

/// A sample's number at dimension `d`.
#[inline]
pub(super) fn point_1d(key: u64, reversed_sample: u32, d: u32) -> f32 {
    let (i, [seed, _]) = shuffle(key, reversed_sample, d);
    unit(scramble_reversed(i, seed).reverse_bits())
}

/// A sample's point at dimensions `d` and `d` + 1.
#[inline]
pub(super) fn point_2d(key: u64, reversed_sample: u32, d: u32) -> [f32; 2] {
    let (i, [seed_x, seed_y]) = shuffle(key, reversed_sample, d);
    let x = scramble_reversed(i, seed_x);
    let y = scramble_reversed(second_dimension_reversed(i), seed_y);
    // Both words at once: the reversal swaps them.
    let both = ((u64::from(y) << 32) | u64::from(x)).reverse_bits();
    [unit((both >> 32) as u32), unit(both as u32)]
}

/// [`point_2d`] in a form that computes many at a time.
#[inline(always)]
pub(super) fn lane_2d(key: [u32; 2], reversed_sample: u32, d: u32) -> [f32; 2] {
    let [order, seed_x, seed_y] = pcg3d([key[0], key[1], d]);
    let i = scramble_reversed(reversed_sample, order).reverse_bits();
    let x = scramble_reversed(i, seed_x);
    let y = scramble_reversed(second_dimension_reversed(i), seed_y);
    [unit(x.reverse_bits()), unit(y.reverse_bits())]
}
