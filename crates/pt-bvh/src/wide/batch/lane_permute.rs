//! Branch-free permutation of the lanes of a vector.

use wide::u32x8;

use crate::wide::WIDTH;

/// Number of each lane.
pub(super) const LANES: u32x8 = u32x8::new([0, 1, 2, 3, 4, 5, 6, 7]);

/// For each set of lanes, given by its bits: those lanes, in ascending order, in four bits each
/// from the lowest on.
static MEMBERS: [u32; 1 << WIDTH] = {
    let mut table = [0; 1 << WIDTH];
    let mut set = 0;
    while set < table.len() {
        let (mut lane, mut place) = (0, 0);
        while lane < WIDTH {
            if set >> lane & 1 == 1 {
                table[set] |= (lane as u32) << (4 * place);
                place += 1;
            }
            lane += 1;
        }
        set += 1;
    }
    table
};

/// Lanes of a set of eight, in ascending order, in the lowest three bits; the rest is undefined.
#[inline(always)]
pub(in crate::wide) fn members(set: u32) -> u32x8 {
    let lanes = u32x8::splat(MEMBERS[set as usize % MEMBERS.len()]) >> (LANES << 2);
    // AVX2 shuffles ignore the other bits.
    if cfg!(target_feature = "avx2") { lanes } else { lanes & u32x8::splat(WIDTH as u32 - 1) }
}

/// Stage of a sorting network: each lane is compared with its partner, and the lower-numbered lane
/// of the two gets the greater value.
macro_rules! stage {
    ($x:expr, $partners:expr) => {{
        const PARTNERS: [u32; WIDTH] = $partners;
        const FIRST: u32x8 = {
            let mut mask = [0; WIDTH];
            let mut lane = 0;
            while lane < WIDTH {
                mask[lane] = if PARTNERS[lane] > lane as u32 { u32::MAX } else { 0 };
                lane += 1;
            }
            u32x8::new(mask)
        };
        let other = $x.shuffle(u32x8::new(PARTNERS));
        FIRST.select($x.max(other), $x.min(other))
    }};
}

/// Sorts the values in descending order, by a bitonic network. [Batcher 1968, "Sorting networks and
/// their applications"]
#[inline(always)]
pub(super) fn sort_descending(x: u32x8) -> u32x8 {
    let x = stage!(x, [1, 0, 3, 2, 5, 4, 7, 6]);
    let x = stage!(x, [3, 2, 1, 0, 7, 6, 5, 4]);
    let x = stage!(x, [1, 0, 3, 2, 5, 4, 7, 6]);
    let x = stage!(x, [7, 6, 5, 4, 3, 2, 1, 0]);
    let x = stage!(x, [2, 3, 0, 1, 6, 7, 4, 5]);
    stage!(x, [1, 0, 3, 2, 5, 4, 7, 6])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_sequence_of_zeros_and_ones_is_sorted() {
        // By the zero-one principle, the network then sorts everything. [Knuth, The Art of
        // Computer Programming, vol. 3, §5.3.4, theorem Z]
        for bits in 0..256u32 {
            let x = std::array::from_fn(|lane| bits >> lane & 1);
            let ones = bits.count_ones() as usize;
            let want = std::array::from_fn(|place| u32::from(place < ones));
            assert_eq!(sort_descending(u32x8::new(x)), u32x8::new(want), "{bits:08b}");
        }
    }

    #[test]
    fn members_of_a_set_come_first() {
        for set in 0..256u32 {
            let lanes = members(set).to_array().map(|lane| lane % WIDTH as u32);
            let of_set = (0..8).filter(|lane| set >> lane & 1 == 1);
            assert!(of_set.eq(lanes[..set.count_ones() as usize].iter().copied()), "{set:08b}");
        }
    }
}
