//! Owen-scrambled Sobol points by hashing (Burley 2020, §3 and §4).

use super::hash::hash_u32;

/// Scrambles the bits of `x` as a base-2 Owen scrambling would: each bit is flipped by a hash of `seed` and all
/// higher bits. The mixing constants are N. Vegdahl's (2021), which replace Laine and Karras' of Burley's listing 2.
pub fn owen_scramble(x: u32, seed: u32) -> u32 {
    laine_karras(x.reverse_bits(), seed).reverse_bits()
}

/// Each output bit depends on input bits at or below its own place only.
fn laine_karras(mut x: u32, seed: u32) -> u32 {
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^ x.wrapping_mul(0x53a2_2864)
}

/// Point `index` of the scrambled and shuffled sequence of a seed, as fixed-point numbers of 32 bits.
pub fn sobol_2d(index: u32, seed: u32) -> [u32; 2] {
    let shuffled = owen_scramble(index, hash_u32(seed));
    let x = shuffled.reverse_bits();
    let y = sobol_second_dimension(shuffled);
    [owen_scramble(x, hash_u32(seed ^ 0x68bc_21eb)), owen_scramble(y, hash_u32(seed ^ 0x02e5_be93))]
}

/// The second Sobol dimension, of the polynomial x + 1: the bits, highest first, times Pascal's triangle modulo 2. Its halves
/// are triangles again, [[P, P], [0, P]], so five steps do.
fn sobol_second_dimension(index: u32) -> u32 {
    let mut point = index.reverse_bits();
    for (shift, lower) in
        [(16, 0x0000_ffff), (8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)]
    {
        point ^= (point & lower) << shift;
    }
    point
}

#[cfg(test)]
mod tests {
    use super::sobol_second_dimension;

    /// Direction numbers v₁ = ½, vₖ₊₁ = vₖ ⊕ vₖ/2; the points are linear in the bits of the index.
    #[test]
    fn the_second_dimension_has_its_direction_numbers() {
        let mut direction = 1_u32 << 31;
        for bit in 0..32 {
            assert_eq!(sobol_second_dimension(1 << bit), direction);
            direction ^= direction >> 1;
        }
        let bits = (0..32).filter(|bit| 0x9b0c_21f7_u32 >> bit & 1 == 1);
        let sum = bits.fold(0, |sum, bit| sum ^ sobol_second_dimension(1 << bit));
        assert_eq!(sobol_second_dimension(0x9b0c_21f7), sum);
    }
}
