//! Random numbers that depend on nothing but their address: seed, purpose, frame, pixel.
//!
//! So a simulated image is the same whatever the number of threads and whichever frames were asked for before.

/// What numbers are for: streams of different purposes are independent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// Noise of an image sensor.
    ImageNoise,
    /// Noise of a depth sensor.
    DepthNoise,
    /// Jitter of time stamps.
    Stamp,
    /// Faults.
    Fault,
}

/// Numbers of one address, one after the other: SplitMix64 (Steele, Lea, Flood, *Fast splittable pseudorandom number
/// generators*, OOPSLA 2014) started from a hash of the address.
#[derive(Clone, Copy, Debug)]
pub struct Random {
    state: u64,
}

/// 2⁶⁴ divided by the golden ratio.
const GAMMA: u64 = 0x9E37_79B9_7F4A_7C15;
/// Above this mean a Poisson number is drawn from a normal distribution; its skewness is then below 0.13.
const MAX_POISSON_MEAN: f64 = 64.0;

fn mixed(word: u64) -> u64 {
    let word = (word ^ (word >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let word = (word ^ (word >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    word ^ (word >> 31)
}

impl Random {
    /// The numbers of an address. `sensor` tells sensors of one world apart, see [`name_seed`].
    pub fn at(seed: u64, sensor: u64, purpose: Purpose, frame: u64, pixel: u64) -> Self {
        let words = [sensor, purpose as u64, frame, pixel];
        let state = words.iter().fold(mixed(seed.wrapping_add(GAMMA)), |state, word| {
            mixed(state.wrapping_mul(GAMMA) ^ mixed(word.wrapping_add(GAMMA)))
        });
        Self { state }
    }

    fn next(&mut self) -> u64 {
        self.state = self.state.wrapping_add(GAMMA);
        mixed(self.state)
    }

    /// In (0, 1), both ends excluded.
    pub fn uniform(&mut self) -> f64 {
        ((self.next() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    /// Two independent normal numbers of mean 0 and variance 1 (Box, Muller 1958).
    pub fn normal_pair(&mut self) -> [f64; 2] {
        let radius = (-2.0 * self.uniform().ln()).sqrt();
        let (sin, cos) = (std::f64::consts::TAU * self.uniform()).sin_cos();
        [radius * cos, radius * sin]
    }

    /// A normal number of mean 0 and variance 1.
    pub fn normal(&mut self) -> f64 {
        self.normal_pair()[0]
    }

    /// A Poisson number: counts of a process that has `mean` of them on average (Knuth, TAOCP 3.4.1, algorithm Q), a
    /// normal number of the same mean and variance where the mean is large.
    pub fn poisson(&mut self, mean: f64) -> f64 {
        if mean.is_nan() || mean <= 0.0 {
            return 0.0;
        }
        if mean > MAX_POISSON_MEAN {
            return (mean + mean.sqrt() * self.normal()).max(0.0);
        }
        let limit = (-mean).exp();
        let (mut count, mut product) = (0.0, self.uniform());
        while product > limit {
            count += 1.0;
            product *= self.uniform();
        }
        count
    }
}

/// A number for a name, such as that of a sensor (FNV-1a, 64 bit).
pub fn name_seed(name: &str) -> u64 {
    name.bytes()
        .fold(0xCBF2_9CE4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01B3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(numbers: impl Iterator<Item = f64>) -> (f64, f64, f64) {
        let numbers: Vec<f64> = numbers.collect();
        let count = numbers.len() as f64;
        let mean = numbers.iter().sum::<f64>() / count;
        let variance = numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (count - 1.0);
        (mean, variance, count)
    }

    /// Within five standard errors of mean and variance; `kurtosis` is the distribution's (normal: 3).
    fn check(numbers: impl Iterator<Item = f64>, mean: f64, variance: f64, kurtosis: f64) {
        let (found_mean, found_variance, count) = moments(numbers);
        let mean_error = (variance / count).sqrt();
        let variance_error = variance * ((kurtosis - 1.0) / count).sqrt();
        assert!((found_mean - mean).abs() < 5.0 * mean_error, "{found_mean} {mean}");
        assert!((found_variance - variance).abs() < 5.0 * variance_error, "{found_variance} {variance}");
    }

    #[test]
    fn neighbouring_addresses_are_independent() {
        let at = |pixel| Random::at(1, 2, Purpose::ImageNoise, 3, pixel);
        check((0..200_000).map(|pixel| at(pixel).normal()), 0.0, 1.0, 3.0);
        check((0..200_000).map(|pixel| at(pixel).uniform()), 0.5, 1.0 / 12.0, 1.8);
        // The product of independent numbers of mean 0 has mean 0 and variance 1 (and kurtosis 9).
        let product = |other: fn(u64) -> Random| {
            (0..200_000).map(move |pixel| at(pixel).normal() * other(pixel).normal())
        };
        check(product(|pixel| Random::at(1, 2, Purpose::ImageNoise, 3, pixel + 1)), 0.0, 1.0, 9.0);
        check(product(|pixel| Random::at(1, 2, Purpose::ImageNoise, 4, pixel)), 0.0, 1.0, 9.0);
        check(product(|pixel| Random::at(2, 2, Purpose::ImageNoise, 3, pixel)), 0.0, 1.0, 9.0);
        check(product(|pixel| Random::at(1, 2, Purpose::DepthNoise, 3, pixel)), 0.0, 1.0, 9.0);
    }

    #[test]
    fn poisson_numbers_have_their_mean_as_variance() {
        for mean in [0.1, 3.0, 40.0, 63.9, 64.1, 1000.0] {
            let at = |pixel| Random::at(9, 0, Purpose::ImageNoise, 0, pixel);
            check((0..100_000).map(|pixel| at(pixel).poisson(mean)), mean, mean, 3.0 + 1.0 / mean);
        }
        // The share of zeros is e^−mean.
        let zeros = (0..100_000)
            .filter(|&pixel| Random::at(5, 0, Purpose::Fault, 0, pixel).poisson(2.0) == 0.0)
            .count();
        let share = (-2.0_f64).exp();
        let error = (share * (1.0 - share) / 1e5).sqrt();
        assert!((zeros as f64 / 1e5 - share).abs() < 5.0 * error);
        assert_eq!(Random::at(0, 0, Purpose::Fault, 0, 0).poisson(f64::NAN), 0.0);
    }
}
