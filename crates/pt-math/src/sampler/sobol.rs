//! Owen-scrambled Sobol' points in pairs of dimensions, by hashing. [Burley 2020, "Practical
//! Hash-based Owen Scrambling", JCGT 9(4)]
//!
//! Every dimension or pair of dimensions uses the first one or two dimensions of the Sobol'
//! sequence with its own scrambles, and takes its points in its own shuffled order ("padding"). The
//! shuffle is an Owen scramble of the index, which maps each aligned run of 2ᵏ samples to an
//! aligned run, so such runs remain (0, 2)-nets. Dimension 0 needs no shuffle: it suffices that no
//! two dimensions have the same order.
//!
//! A scramble operates on bit-reversed numbers, so that its effect on a digit depends only on the
//! digits before it. The first Sobol' dimension reverses the bits of the index; reversed again it
//! is the index itself, and most reversals cancel.

use super::independent::{mixed, pcg3d};
use super::unit;

/// Owen scrambling of a bit-reversed number. [Laine & Karras 2011, "Stratified Sampling for
/// Stochastic Transparency", §3; form and constants: N. Vegdahl, "Building a Better LK Hash",
/// psychopath.io, 2021]
#[inline]
fn scramble_reversed(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Second Sobol' dimension of index `i`, bits reversed.
///
/// Its generator matrix is Pascal's triangle modulo 2, [Sobol' 1967; Kollig & Keller 2002], whose
/// entry in row j and column k is 1 exactly where the bits of j are a subset of those of k (Lucas's
/// theorem). Digit j therefore is the sum of the bits of `i` over the supersets of j, which is
/// computed one bit of j at a time.
#[inline]
fn second_dimension_reversed(mut i: u32) -> u32 {
    i ^= (i >> 16) & 0x0000_ffff;
    i ^= (i >> 8) & 0x00ff_00ff;
    i ^= (i >> 4) & 0x0f0f_0f0f;
    i ^= (i >> 2) & 0x3333_3333;
    i ^ ((i >> 1) & 0x5555_5555)
}

/// Seeds at dimension `d`: for the order of the samples, and for two scrambles.
#[inline(always)]
pub(super) fn seeds(key: [u32; 2], d: u32) -> [u32; 3] {
    pcg3d([key[0], key[1], mixed(d)])
}

/// Position of a sample in an order.
#[inline(always)]
pub(super) fn shuffled(order: u32, sample: u32) -> u32 {
    scramble_reversed(sample.reverse_bits(), order).reverse_bits()
}

/// Position of a sample in the order of dimension `d`.
#[inline(always)]
pub(super) fn place(d: u32, order: u32, sample: u32) -> u32 {
    if d == 0 { sample } else { shuffled(order, sample) }
}

/// Number at position `i`.
#[inline(always)]
pub(super) fn number([_, seed, _]: [u32; 3], i: u32) -> f32 {
    unit(scramble_reversed(i, seed).reverse_bits())
}

/// Point at position `i`; its first coordinate is [`number`].
#[inline(always)]
pub(super) fn point([_, seed_x, seed_y]: [u32; 3], i: u32) -> [f32; 2] {
    let x = scramble_reversed(i, seed_x);
    let y = scramble_reversed(second_dimension_reversed(i), seed_y);
    [unit(x.reverse_bits()), unit(y.reverse_bits())]
}
