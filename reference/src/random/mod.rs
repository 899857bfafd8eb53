//! Sample points that depend on nothing but their address: pixel, sample index, dimension.
//!
//! B. Burley, *Practical Hash-based Owen Scrambling*, Journal of Computer Graphics Techniques 9(4), 2020: the two
//! first Sobol dimensions, Owen-scrambled by a hash, and *padded*: each further pair of dimensions is the same
//! sequence, scrambled and shuffled anew. So the number of dimensions is unlimited, each pair is stratified over the
//! samples of a pixel at every power of two, and two renderings that ask for the same address get the same number,
//! whatever the number of threads (common random numbers).

mod hash;
mod owen;

use glam::Vec2;

pub use hash::{hash_u32, hash_words};
pub use owen::{owen_scramble, sobol_2d};

/// Hands out the numbers of one sample of one pixel, dimension after dimension.
///
/// Dimensions are counted in pairs: [`Sampler::next_1d`] and [`Sampler::next_2d`] use up one pair each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sampler {
    seed: u32,
    sample: u32,
    pair: u32,
}

impl Sampler {
    /// For sample number `sample` of pixel (x, y). Another `seed` is an independent picture.
    pub fn new(pixel: [u32; 2], sample: u32, seed: u32) -> Self {
        Self { seed: hash_words(&[seed, pixel[0], pixel[1]]), sample, pair: 0 }
    }

    /// For element number `sample` of a sequence that belongs to no pixel, such as photons.
    pub fn of_sequence(sample: u32, seed: u32) -> Self {
        Self { seed: hash_words(&[seed, 0x5eed]), sample, pair: 0 }
    }

    /// Goes on at a pair of dimensions. Giving every path vertex a fixed range of its own keeps the numbers of later
    /// vertices the same when an earlier one used fewer.
    pub fn jump_to(&mut self, pair: u32) {
        self.pair = pair;
    }

    /// The pair of dimensions that comes next.
    pub fn pair(&self) -> u32 {
        self.pair
    }

    /// A number in [0, 1).
    pub fn next_1d(&mut self) -> f32 {
        self.next_2d().x
    }

    /// A point in [0, 1)².
    pub fn next_2d(&mut self) -> Vec2 {
        let seed = hash_words(&[self.seed, self.pair]);
        self.pair = self.pair.wrapping_add(1);
        let [x, y] = sobol_2d(self.sample, seed);
        Vec2::new(unit_float(x), unit_float(y))
    }

    /// 32 random bits that belong to the next pair of dimensions, for [`crate::accel::Ray::seed`].
    pub fn next_bits(&mut self) -> u32 {
        let seed = hash_words(&[self.seed, self.pair, self.sample]);
        self.pair = self.pair.wrapping_add(1);
        seed
    }
}

/// The upper 24 bits as a number in [0, 1): f32 holds each exactly, and never rounds up to 1.
pub fn unit_float(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1_u32 << 24) as f32)
}

#[cfg(test)]
mod tests;
