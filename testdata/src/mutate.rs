//! Damaged files, made again bit for bit on every run: the fuzz corpus of the file formats.
//!
//! A corpus is a seed file and a number: mutation `n` of a seed never changes, so a failing input is named by two
//! words in a test's message. `cargo run -p coshade-testdata --example corpus -- SEED FOLDER` writes a seed's
//! mutations out as files, for a fuzzer to start from.

/// The first `count` mutations of `seed`, each with its number.
pub fn mutations(seed: &[u8], count: u64) -> impl Iterator<Item = (u64, Vec<u8>)> + '_ {
    (0..count).map(move |n| (n, mutation(seed, n)))
}

/// Mutation number `n` of `seed`: one to four of the damages that break parsers.
pub fn mutation(seed: &[u8], n: u64) -> Vec<u8> {
    let mut random = SplitMix(n.wrapping_add(1));
    let mut bytes = seed.to_vec();
    for _ in 0..=random.below(4) {
        damage(&mut bytes, &mut random);
    }
    bytes
}

fn damage(bytes: &mut Vec<u8>, random: &mut SplitMix) {
    if bytes.is_empty() {
        bytes.push(random.byte());
        return;
    }
    let at = random.below(bytes.len());
    match random.below(8) {
        0 => bytes[at] ^= 1 << random.below(8),
        1 => bytes[at] = random.byte(),
        2 => bytes.truncate(at),
        3 => overwrite(bytes, at, &random.extreme_number()),
        4 => {
            let end = at + random.below((bytes.len() - at).min(64)) + 1;
            bytes.drain(at..end);
        }
        5 => {
            let end = at + random.below((bytes.len() - at).min(64)) + 1;
            let copy = bytes[at..end].to_vec();
            bytes.splice(at..at, copy);
        }
        6 => {
            let noise: Vec<u8> = (0..=random.below(16)).map(|_| random.byte()).collect();
            overwrite(bytes, at, &noise);
        }
        _ => {
            let other = random.below(bytes.len());
            bytes.swap(at, other);
        }
    }
}

fn overwrite(bytes: &mut [u8], at: usize, with: &[u8]) {
    for (byte, &new) in bytes[at..].iter_mut().zip(with) {
        *byte = new;
    }
}

/// Steele, Lea, Flood: Fast splittable pseudorandom number generators (2014).
struct SplitMix(u64);

impl SplitMix {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    fn byte(&mut self) -> u8 {
        self.next() as u8
    }

    /// A number at the edge of its range, as parsers of lengths, counts and floats fear it, in either byte order.
    fn extreme_number(&mut self) -> Vec<u8> {
        const EXTREMES: [u32; 8] =
            [0, 1, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 0x7FC0_0000, 0x7F80_0000, 0x0001_0000];
        let number = EXTREMES[self.below(EXTREMES.len())];
        match self.below(4) {
            0 => number.to_le_bytes().to_vec(),
            1 => number.to_be_bytes().to_vec(),
            2 => u64::from(number).wrapping_mul(0x1_0000_0001).to_le_bytes().to_vec(),
            _ => b"-1e999"[..=self.below(6).min(5)].to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mutations_are_the_same_on_every_run_and_differ_from_each_other() {
        let seed = b"a file of some length, long enough to be damaged in many ways";
        let all: Vec<_> = mutations(seed, 200).map(|(_, bytes)| bytes).collect();
        assert_eq!(all, mutations(seed, 200).map(|(_, bytes)| bytes).collect::<Vec<_>>());
        let distinct: std::collections::HashSet<_> =
            all.iter().filter(|bytes| bytes[..] != seed[..]).collect();
        assert!(distinct.len() > 190, "{} distinct", distinct.len());
    }

    #[test]
    fn an_empty_seed_mutates_too() {
        assert_eq!(mutations(b"", 10).count(), 10);
    }
}
