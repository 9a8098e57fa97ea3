//! MurmurHash3 for 32 bits (`MurmurHash3_x86_32`). [Appleby, "SMHasher", which is in the public
//! domain]

/// Returns the hash of bytes with a seed.
///
/// Words of four bytes, little endian, are mixed in one after the other, then the remaining bytes,
/// at most three, and then the length.
pub(super) fn hash(bytes: &[u8], seed: u32) -> u32 {
    let (words, rest) = bytes.as_chunks();
    let mix = |hash: u32, &word: &[u8; 4]| {
        let hash = (hash ^ scrambled(u32::from_le_bytes(word))).rotate_left(13);
        hash.wrapping_mul(5).wrapping_add(0xe654_6b64)
    };
    let hash = words.iter().fold(seed, mix);
    let last = rest.iter().rev().fold(0, |last, &byte| last << 8 | u32::from(byte));
    avalanche(hash ^ scrambled(last) ^ bytes.len() as u32)
}

/// Scrambles a word before it is mixed in; 0 stays 0.
fn scrambled(word: u32) -> u32 {
    word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593)
}

/// Final mix, after which each bit of the input affects all bits of the hash.
fn avalanche(mut hash: u32) -> u32 {
    hash ^= hash >> 16;
    hash = hash.wrapping_mul(0x85eb_ca6b);
    hash ^= hash >> 13;
    hash = hash.wrapping_mul(0xc2b2_ae35);
    hash ^ hash >> 16
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hashes of the keys 0, 01, 0102, … (bytes in a row) of up to 255 bytes with the seeds 256
    /// down to 1, hashed in their turn: the check of the reference implementation. [Appleby,
    /// SMHasher, `VerificationTest`]
    #[test]
    fn the_hash_passes_the_check_of_its_author() {
        let keys: Vec<u8> = (0..=255).collect();
        let hashes = (0..256).flat_map(|n: u32| hash(&keys[..n as usize], 256 - n).to_le_bytes());
        assert_eq!(hash(&hashes.collect::<Vec<_>>(), 0), 0xb0f5_7ee3);
    }

    /// The manifests in the specification of Cryptomatte, and lengths of all remainders.
    #[test]
    fn names_have_the_hashes_that_others_give_them() {
        for (name, want) in [
            ("", 0),
            ("bunny", 0x1385_1a76),
            ("default", 0x42c9_679f),
            ("bunny_porcelain_mat", 0xb24b_26d4),
            ("crypto_object", 0xf834_d0a6),
            ("flowerB.flowerB_petal16.:3106", 0x7fae_176b),
        ] {
            assert_eq!(hash(name.as_bytes(), 0), want, "{name}");
        }
    }
}
