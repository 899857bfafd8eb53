use super::*;

fn fixed_points(count: u32, seed: u32) -> Vec<[u32; 2]> {
    (0..count).map(|index| sobol_2d(index, seed)).collect()
}

/// A (0, 2)-sequence: of 2^m points, each elementary interval of area 2^−m holds exactly one. Owen scrambling and
/// shuffling keep that.
#[test]
fn every_elementary_interval_holds_one_point() {
    for seed in 0..50 {
        for m in [1_u32, 4, 8, 10] {
            let points = fixed_points(1 << m, hash_u32(seed));
            for split in 0..=m {
                let mut seen = vec![false; 1 << m];
                for [x, y] in &points {
                    let column = if split == 0 { 0 } else { x >> (32 - split) };
                    let row = if split == m { 0 } else { y >> (32 - (m - split)) };
                    let cell = (row << split | column) as usize;
                    assert!(!seen[cell], "seed {seed}, 2^{m} points, split {split}");
                    seen[cell] = true;
                }
            }
        }
    }
}

/// Also later blocks of a power of two are stratified: adding samples to a picture keeps it stratified.
#[test]
fn later_blocks_are_stratified_too() {
    for block in 1..8_u32 {
        let mut seen = [false; 64];
        for index in 0..64 {
            let [x, y] = sobol_2d(block * 64 + index, 77);
            let cell = ((x >> 29) << 3 | y >> 29) as usize;
            assert!(!seen[cell]);
            seen[cell] = true;
        }
    }
}

#[test]
fn scrambling_is_a_bijection_that_respects_high_bits() {
    for seed in [0, 1, 0xdead_beef] {
        let mut images: Vec<u32> = (0..1 << 16).map(|x: u32| owen_scramble(x << 16, seed) >> 16).collect();
        images.sort_unstable();
        images.dedup();
        assert_eq!(images.len(), 1 << 16);
        let (a, b) = (owen_scramble(0x1234_5678, seed), owen_scramble(0x1234_0000, seed));
        assert_eq!(a >> 16, b >> 16, "equal high bits stay equal");
    }
}

#[test]
fn an_address_names_one_number() {
    let mut one = Sampler::new([3, 4], 5, 6);
    let mut other = Sampler::new([3, 4], 5, 6);
    other.jump_to(10);
    other.jump_to(0);
    for _ in 0..20 {
        assert_eq!(one.next_2d(), other.next_2d());
    }
    let mut elsewhere = Sampler::new([4, 3], 5, 6);
    assert_ne!(Sampler::new([3, 4], 5, 6).next_2d(), elsewhere.next_2d());
}

/// Different pairs, pixels and seeds are uncorrelated: the sample covariance of N products of uniform numbers has the
/// standard deviation 1/(12√N); stratification only lowers it. 6 deviations over 60 trials: chance below 2e-7.
#[test]
fn padded_pairs_are_uncorrelated() {
    let count = 4096;
    for trial in 0..60 {
        let covariance: f64 = (0..count)
            .map(|sample| {
                let mut sampler = Sampler::new([trial, 0], sample, 1);
                let (a, b) = (sampler.next_2d(), sampler.next_2d());
                let (a, b) = if trial % 2 == 0 { (a.x, b.x) } else { (a.x, b.y) };
                f64::from(a - 0.5) * f64::from(b - 0.5)
            })
            .sum::<f64>()
            / f64::from(count);
        assert!(covariance.abs() < 6.0 / (12.0 * f64::from(count).sqrt()), "{covariance}");
    }
}

/// Owen scrambling integrates smooth functions with an error that falls like N^−3/2, plain random numbers like N^−1/2.
#[test]
fn smooth_integrals_converge_faster_than_monte_carlo() {
    let rms_error = |count: u32| -> f64 {
        let square_sum: f64 = (0..64)
            .map(|pixel| {
                let mean: f64 = (0..count)
                    .map(|sample| {
                        let point = Sampler::new([pixel, 1], sample, 9).next_2d();
                        f64::from(point.x) * f64::from(point.y).powi(2)
                    })
                    .sum::<f64>()
                    / f64::from(count);
                (mean - 1.0 / 6.0).powi(2)
            })
            .sum();
        (square_sum / 64.0).sqrt()
    };
    // From 64 to 4096 samples: 8 times smaller for random numbers, 512 times for N^−3/2; 100 tells them apart.
    let gain = rms_error(64) / rms_error(4096);
    assert!(gain > 100.0, "gain {gain}");
}

#[test]
fn unit_floats_stay_below_one() {
    assert_eq!(unit_float(0), 0.0);
    assert!(unit_float(u32::MAX) < 1.0);
}
