//! Poses without jitter and without lag.
//!
//! A chain of estimates of the newest pose, from the calmest to the measurement itself: the mean of the last 32 poses,
//! straight lines (constant twists) through the last 32 and the last 8 of them, the last one alone. Every estimate is the
//! best one under its own model, and each model contains the one before; so the steps from one to the next are
//! independent, with covariances that are known. Each step is taken after shrinking it by James and Stein's factor
//!
//! > (1 − c/D)₊,  D = |step|² / its variance,
//!
//! in the metric of the solver's covariance. A step that is noise vanishes, one that is motion is taken almost whole.
//! With c up to 2 (d − 2) = 8 in our d = 6 dimensions the shrunk step is never worse in the mean square than the whole
//! one, whatever the motion (Baranchik, *A family of minimax estimators of the mean of a multivariate normal
//! distribution*, Ann. Math. Stat. 41, 1970, theorem 1, of James and Stein 1961). That is why the filter has no lag to
//! trade for calm: where the motion is not a straight line it returns what was measured. Nothing is predicted. The output
//! is a continuous function of the poses, no window is switched.
//!
//! The noise may be larger or smaller than the solver says: its true scale is measured, see `noise`.
//!
//! What is left of the overlay error, measured by `cargo run -p coshade-tracker --example filter`:
//!
//! | motion | filtered / unfiltered | 1€ filter |
//! | --- | --- | --- |
//! | at rest | 0.41 | 0.33 |
//! | steady, 0.01 to 0.5 px/frame | 0.47 to 0.48 | 0.48 to 6.9 |
//! | steady, 10 px/frame, turning round at the picture's edge | 0.70 | 20 |
//! | a second of rest, a second at 1 px/frame | 0.74 | 7.5 |
//! | tremor of 0.2 px, 1 to 12 Hz | 0.73 to 0.99 | 1.6 to 2.4 |
//! | tremor of 2 px, 1 to 12 Hz | 1.00 | 7.8 to 15 |
//! | worst of 93 motions at 30 and 10 frames/s, noise 1/3, 1 and 3 times what is said | 1.004 | |
//!
//! The theorem is about one step with noise of a known size. For the chain, whose biases add, and for a measured size,
//! the last row is what holds.

mod line;
mod noise;

use std::collections::VecDeque;

use coshade_capture::Timestamp;
use nalgebra::{Cholesky, Const, Isometry3, Matrix6, Vector6};

use self::line::Line;
use self::noise::NoiseScale;
use crate::lie;

/// Numbers of newest poses that lines are laid through, longest first.
const WINDOWS: [usize; 2] = [32, 8];

/// Settings of a [`PoseFilter`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSettings {
    /// Off: poses pass unchanged.
    pub enabled: bool,
    /// The c of James and Stein. Higher values: calmer at rest. Above 8 it is no longer certain that motion never loses.
    pub calm: f64,
    /// After a longer time without a pose the filter starts anew. Higher values: calm again sooner after a loss; lower
    /// values: what happened before a loss is forgotten sooner.
    pub longest_gap_s: f64,
}

impl Default for FilterSettings {
    fn default() -> Self {
        Self { enabled: true, calm: 8.0, longest_gap_s: 0.35 }
    }
}

/// Why a pose was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FilterError {
    /// A number of the pose is not finite.
    #[error("a pose to filter must be finite")]
    Pose,
    /// The covariance says nothing.
    #[error("the covariance of a pose to filter must be finite and positive definite")]
    Covariance,
}

/// Removes the jitter of one body's poses. One per body; feed it every frame in which the body was seen.
#[derive(Clone, Debug)]
pub struct PoseFilter {
    settings: FilterSettings,
    /// Newest last.
    samples: VecDeque<Sample>,
    /// The samples as seen from the newest: newest first.
    points: Vec<Point>,
    noise: NoiseScale,
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    stamp: Timestamp,
    camera_from_body: Isometry3<f64>,
    covariance: Matrix6<f64>,
}

/// A sample relative to the newest one, in units of the newest one's noise.
#[derive(Clone, Copy, Debug)]
struct Point {
    /// At most 0.
    time_s: f64,
    /// Whitened twist from the newest pose.
    place: Vector6<f64>,
    /// Inverse variance over that of the newest.
    weight: f64,
}

impl PoseFilter {
    /// A filter that has seen nothing.
    pub fn new(settings: FilterSettings) -> Self {
        Self {
            settings,
            samples: VecDeque::with_capacity(WINDOWS[0] + 1),
            points: Vec::with_capacity(WINDOWS[0]),
            noise: NoiseScale::default(),
        }
    }

    /// Forgets the poses, not how noisy they were: to be called when the body was found again after a loss.
    pub fn reset(&mut self) {
        self.samples.clear();
    }

    /// How much larger the noise is than the solver's covariances say: a factor on the standard deviation.
    pub fn noise_scale(&self) -> f64 {
        self.noise.variance().sqrt()
    }

    /// The pose at `stamp`, from the pose measured at `stamp` and the ones before. `covariance` is that of a twist on the
    /// left (see [`crate::lie`]).
    ///
    /// Stamps that do not increase, and gaps longer than the settings allow, start the filter anew.
    ///
    /// # Errors
    /// Pose or covariance make no sense; the filter has not changed.
    pub fn filter(
        &mut self,
        stamp: Timestamp,
        camera_from_body: &Isometry3<f64>,
        covariance: &Matrix6<f64>,
    ) -> Result<Isometry3<f64>, FilterError> {
        if !is_finite(camera_from_body) {
            return Err(FilterError::Pose);
        }
        let factor = whitener(covariance).ok_or(FilterError::Covariance)?;
        if !self.settings.enabled {
            self.reset();
            return Ok(*camera_from_body);
        }
        if !self.follows(stamp) {
            self.reset();
        }
        if self.samples.len() == WINDOWS[0] {
            self.samples.pop_front();
        }
        self.samples.push_back(Sample {
            stamp,
            camera_from_body: *camera_from_body,
            covariance: *covariance,
        });
        self.whiten(&factor);
        self.noise.update(&self.points);
        let filtered = lie::exp(&(factor.l() * self.shrunk_chain())) * camera_from_body;
        Ok(if is_finite(&filtered) { filtered } else { *camera_from_body })
    }

    fn follows(&self, stamp: Timestamp) -> bool {
        self.samples.back().is_none_or(|last| {
            let gap_s = elapsed_s(last.stamp, stamp);
            gap_s > 0.0 && gap_s <= self.settings.longest_gap_s
        })
    }

    /// Fills `points`.
    fn whiten(&mut self, factor: &Factor) {
        self.points.clear();
        let Some(newest) = self.samples.back() else { return };
        let camera_from_body_inverse = newest.camera_from_body.inverse();
        for sample in self.samples.iter().rev() {
            let mut place = lie::log(&(sample.camera_from_body * camera_from_body_inverse));
            factor.l_dirty().solve_lower_triangular_mut(&mut place);
            let variance = factor.solve(&sample.covariance).trace() / 6.0;
            self.points.push(Point {
                time_s: elapsed_s(newest.stamp, sample.stamp),
                place,
                weight: 1.0 / variance,
            });
        }
    }

    /// The filtered pose, as a whitened twist from the measured one.
    fn shrunk_chain(&self) -> Vector6<f64> {
        let noise = self.noise.variance();
        let calmest = Line::through(&self.points);
        let (mut place, mut variance) = (calmest.mean, calmest.mean_variance);
        let lines =
            WINDOWS.iter().filter_map(|&n| self.points.get(..n.min(self.points.len()))).map(|points| {
                let line = Line::through(points);
                (line.end, line.end_variance)
            });
        for (next, next_variance) in lines.chain([(Vector6::zeros(), 1.0)]) {
            let step_variance = next_variance - variance;
            if step_variance <= 1e-9 {
                continue;
            }
            let step = next - place;
            let limit = self.settings.calm * noise * step_variance;
            let square = step.norm_squared();
            if square > limit {
                place += step * (1.0 - limit / square);
            }
            variance = next_variance;
        }
        place
    }
}

type Factor = Cholesky<f64, Const<6>>;

fn whitener(covariance: &Matrix6<f64>) -> Option<Factor> {
    let finite = covariance.iter().all(|number| number.is_finite());
    finite.then(|| Cholesky::new(*covariance)).flatten()
}

fn is_finite(pose: &Isometry3<f64>) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|number| number.is_finite())
}

/// From one stamp to another; negative if the second is earlier.
fn elapsed_s(from: Timestamp, to: Timestamp) -> f64 {
    to.signed_ns_since(from) as f64 * 1e-9
}
