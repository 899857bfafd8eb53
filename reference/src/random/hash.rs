//! Integer hashes.

/// Mixes 32 bits (C. Wellons' `lowbias32`, in the version of T. Ettinger with a bias of 0.107).
pub fn hash_u32(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x21f0_aaad);
    x ^= x >> 15;
    x = x.wrapping_mul(0x735a_2d97);
    x ^ (x >> 15)
}

/// Mixes several words; their order matters.
pub fn hash_words(words: &[u32]) -> u32 {
    words
        .iter()
        .fold(0x9e37_79b9, |hash: u32, &word| hash_u32(hash.rotate_left(5) ^ word).wrapping_add(0x9e37_79b9))
}
