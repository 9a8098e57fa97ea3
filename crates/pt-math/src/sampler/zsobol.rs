//! Sobol' points whose error is blue noise across pixels. [Ahmed & Wonka 2020, "Screen-Space
//! Blue-Noise Diffusion of Monte Carlo Sampling Error via Hierarchical Ordering of Pixels"; the
//! form with one sequence: Pharr, Jakob & Humphreys, Physically Based Rendering, 4th ed., §8.7]
//!
//! The pixels of a square of 2ᵗ × 2ᵗ take consecutive runs of 2ᵏ points of one scrambled sequence,
//! in the order of the Z-curve. So the points of a pixel are a (0, 2)-net, and those of each
//! aligned square of pixels are one as well: an excess in one pixel is compensated by its
//! neighbours, and the error consists of high frequencies, which the eye averages.
//!
//! Every dimension or pair of dimensions shuffles the order, as in [`sobol`](super::sobol), here of
//! all points of the square: an Owen scramble of the index permutes the quarters of each square.
//! Quarters that are neighbours in the order would be horizontal neighbours in all dimensions; so
//! horizontal, vertical and diagonal neighbours alternate by dimension.

use super::independent::pcg4d;
use super::sobol::shuffled;

/// Binary logarithm of the largest side of a square: larger ones make no visible difference.
const LOG2_SIDE: u32 = 8;

/// Binary logarithm of the number of points of a pixel's run.
#[inline(always)]
pub(super) fn log2_run(spp: u32) -> u32 {
    32 - spp.saturating_sub(1).leading_zeros()
}

/// Binary logarithm of the side of the squares: an index has 32 bits.
#[inline(always)]
fn log2_side(log2_run: u32) -> u32 {
    LOG2_SIDE.min((32 - log2_run) / 2)
}

/// Identifier of a sequence: the square of a pixel, and the number of the run that contains a
/// sample.
#[inline(always)]
pub(super) fn square(log2_run: u32, [x, y]: [u32; 2], sample: u32) -> [u32; 3] {
    let side = log2_side(log2_run);
    [x >> side, y >> side, sample.checked_shr(log2_run).unwrap_or(0)]
}

/// Key of a sequence.
#[inline(always)]
pub(super) fn key(seed: u32, [x, y, run]: [u32; 3]) -> [u32; 2] {
    let [k0, k1, ..] = pcg4d([x, y, seed, run]);
    [k0, k1]
}

/// Index of a sample in the sequence of its square.
#[inline(always)]
pub(super) fn index(log2_run: u32, [x, y]: [u32; 2], sample: u32) -> u32 {
    let inside = (1 << log2_side(log2_run)) - 1;
    let pixel = spread(x & inside) | spread(y & inside) << 1;
    let low = u32::MAX.checked_shr(32 - log2_run).unwrap_or(0);
    pixel.checked_shl(log2_run).unwrap_or(0) | sample & low
}

/// Moves bit i to position 2i, for 8 bits.
#[inline(always)]
fn spread(mut bits: u32) -> u32 {
    bits = (bits | bits << 4) & 0x0f0f;
    bits = (bits | bits << 2) & 0x3333;
    (bits | bits << 1) & 0x5555
}

/// Position of an index in the order of dimension `d`.
#[inline(always)]
pub(super) fn place(log2_run: u32, d: u32, order: u32, index: u32) -> u32 {
    shuffled(order, turned(log2_run, d, index))
}

/// Reorders the quarters of squares, so that the neighbours in the order are those of dimension
/// `d`.
#[inline(always)]
fn turned(log2_run: u32, d: u32, index: u32) -> u32 {
    let columns = 0x5555_5555u32.checked_shl(log2_run).unwrap_or(0);
    let (x, y) = (index & columns, (index >> 1) & columns);
    // Of the two bits of a quarter, the upper one separates pairs of neighbours.
    let (low, high) = match d / 2 % 3 {
        0 => return index,
        1 => (y, x),
        _ => (x, x ^ y),
    };
    let samples = !u32::MAX.checked_shl(log2_run).unwrap_or(0);
    low | high << 1 | index & samples
}
