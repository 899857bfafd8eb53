//! How noisy poses are, against what the solver says.
//!
//! From second differences of successive poses, which do not see steady motion. What they see of unsteady motion lies in
//! few of the six directions (a shake of the hand moves the picture up and aside); noise lies in all. So the scale is
//! taken from the three smallest eigenvalues of the differences' scatter.

use nalgebra::{Matrix6, Vector6};

use super::Point;

/// Differences that the scatter remembers.
const MEMORY: f64 = 100.0;
/// What the solver's own word weighs at the start, in differences.
const PRIOR: f64 = 4.0;
/// The mean of the three smallest eigenvalues, of white noise of variance 1 (found by simulation; `the_noise_scale_is_found`
/// tests it).
const SMALLEST_OF_WHITE: f64 = 0.74;
/// One difference counts as this many mean squares at most.
const CLIP: f64 = 4.0;
/// Solvers are not wrong by more than this factor on the variance.
const BOUND: f64 = 100.0;

#[derive(Clone, Debug)]
pub(super) struct NoiseScale {
    scatter: Matrix6<f64>,
    count: f64,
    variance: f64,
}

impl Default for NoiseScale {
    fn default() -> Self {
        Self { scatter: Matrix6::identity(), count: PRIOR, variance: 1.0 }
    }
}

impl NoiseScale {
    /// Factor on the solver's covariances.
    pub(super) fn variance(&self) -> f64 {
        self.variance
    }

    /// Takes in the newest of whitened points (newest first).
    pub(super) fn update(&mut self, points: &[Point]) {
        let [last, middle, first, ..] = points else { return };
        let share = (middle.time_s - first.time_s) / (last.time_s - first.time_s);
        let difference = middle.place - first.place * (1.0 - share) - last.place * share;
        let variance =
            1.0 / middle.weight + (1.0 - share).powi(2) / first.weight + share * share / last.weight;
        self.add(&(difference / variance.sqrt()));
    }

    fn add(&mut self, difference: &Vector6<f64>) {
        let square = difference.norm_squared();
        if !square.is_finite() {
            return;
        }
        let clip = (CLIP * 6.0 * self.variance / square.max(f64::MIN_POSITIVE)).min(1.0);
        self.count = (self.count + 1.0).min(MEMORY);
        self.scatter += (difference * difference.transpose() * clip - self.scatter) / self.count;
        let mut eigenvalues = self.scatter.symmetric_eigenvalues();
        eigenvalues.as_mut_slice().sort_by(f64::total_cmp);
        let smallest = eigenvalues.fixed_rows::<3>(0).mean();
        // Few differences know little; the spread of the eigenvalues is then the prior's, which is none.
        let expected = 1.0 + (SMALLEST_OF_WHITE - 1.0) * ((self.count - PRIOR) / 20.0).min(1.0);
        self.variance = (smallest / expected).clamp(1.0 / BOUND, BOUND);
    }
}
