//! Where a body was in the near past, for sensors whose frames come at other times.
//!
//! Between two poses the body is taken to have moved along the cubic Hermite curve through them, in the twist from the one
//! to the other, with slopes from their outer neighbours (Catmull–Rom, for unequal spacing). Its error falls with the
//! third power of the spacing, that of the steady twist between the two (linear interpolation) with the second. Where a
//! neighbour is missing the slope of the pair is taken.

use std::collections::VecDeque;

use coshade_capture::Timestamp;
use nalgebra::{Isometry3, Matrix6, Vector6};

use crate::lie;

/// A pose at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StampedPose {
    /// When.
    pub stamp: Timestamp,
    /// Body to camera frame.
    pub camera_from_body: Isometry3<f64>,
    /// Covariance of a twist on the left (see [`crate::lie`]).
    pub covariance: Matrix6<f64>,
}

/// Settings of a [`PoseHistory`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HistorySettings {
    /// Poses that are kept; at least 2.
    pub capacity: usize,
    /// Between poses farther apart nothing is interpolated. Higher values: placed more often, and worse.
    pub longest_gap_s: f64,
    /// Nothing is predicted farther than this after the last pose.
    pub horizon_s: f64,
    /// What an unforeseen acceleration may be, one standard deviation, rad/s².
    pub turn_acceleration_rad_s2: f64,
    /// The same of shifts, m/s².
    pub shift_acceleration_m_s2: f64,
}

impl Default for HistorySettings {
    fn default() -> Self {
        Self {
            capacity: 64,
            longest_gap_s: 0.25,
            horizon_s: 0.25,
            turn_acceleration_rad_s2: 5.0,
            shift_acceleration_m_s2: 3.0,
        }
    }
}

/// Why a pose was not kept; the history has not changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum HistoryError {
    /// It is not later than the last one.
    #[error("pose at {} ns is not later than the last one at {} ns", stamp.as_ns(), last.as_ns())]
    Order {
        /// Of the refused pose.
        stamp: Timestamp,
        /// Of the last pose kept.
        last: Timestamp,
    },
    /// Pose or covariance are not finite.
    #[error("pose and covariance at {} ns must be finite", stamp.as_ns())]
    NotFinite {
        /// Of the refused pose.
        stamp: Timestamp,
    },
}

/// The last poses of one body, in the order of time.
#[derive(Clone, Debug)]
pub struct PoseHistory {
    settings: HistorySettings,
    /// Oldest first.
    poses: VecDeque<StampedPose>,
}

impl PoseHistory {
    /// An empty history.
    pub fn new(settings: HistorySettings) -> Self {
        let settings = HistorySettings { capacity: settings.capacity.max(2), ..settings };
        Self { settings, poses: VecDeque::new() }
    }

    /// Adds the newest pose; the oldest is dropped when the history is full.
    ///
    /// # Errors
    /// The pose is not later than the last one, or not finite.
    pub fn push(&mut self, pose: StampedPose) -> Result<(), HistoryError> {
        let StampedPose { stamp, camera_from_body, covariance } = pose;
        let twist = lie::log(&camera_from_body);
        if !twist.iter().chain(covariance.iter()).all(|number| number.is_finite()) {
            return Err(HistoryError::NotFinite { stamp });
        }
        if let Some(last) = self.latest().filter(|last| last.stamp >= stamp) {
            return Err(HistoryError::Order { stamp, last: last.stamp });
        }
        if self.poses.len() >= self.settings.capacity {
            self.poses.pop_front();
        }
        self.poses.push_back(pose);
        Ok(())
    }

    /// Forgets everything: after the stream began anew.
    pub fn clear(&mut self) {
        self.poses.clear();
    }

    /// The last pose.
    pub fn latest(&self) -> Option<&StampedPose> {
        self.poses.back()
    }

    /// All poses, oldest first.
    pub fn iter(&self) -> impl Iterator<Item = &StampedPose> {
        self.poses.iter()
    }

    /// The pose at a moment within the history: a kept one, or interpolated. `None` outside of the history and in gaps.
    pub fn at(&self, stamp: Timestamp) -> Option<StampedPose> {
        let after = self.poses.partition_point(|pose| pose.stamp < stamp);
        let next = self.poses.get(after)?;
        if next.stamp == stamp {
            return Some(*next);
        }
        let before = after.checked_sub(1)?;
        let last = self.poses.get(before)?;
        if elapsed_s(last, next) > self.settings.longest_gap_s {
            return None;
        }
        let outer_last = before.checked_sub(1).and_then(|i| self.poses.get(i));
        Some(self.between(outer_last, last, next, self.poses.get(after + 1), stamp))
    }

    /// The pose at a moment after the last pose, if the body goes on as it did between the last two; at a moment within
    /// the history the same as [`Self::at`]. `None` beyond the horizon, and where there are no two poses to go on from.
    ///
    /// The covariance is that of the line through the two poses, plus that of the accelerations of the settings.
    pub fn predict(&self, stamp: Timestamp) -> Option<StampedPose> {
        let last = self.latest()?;
        let ahead_s = stamp.signed_ns_since(last.stamp) as f64 * 1e-9;
        if ahead_s <= 0.0 {
            return self.at(stamp);
        }
        let before = self.poses.len().checked_sub(2).and_then(|i| self.poses.get(i))?;
        let step_s = elapsed_s(before, last);
        if ahead_s > self.settings.horizon_s || step_s > self.settings.longest_gap_s {
            return None;
        }
        let share = ahead_s / step_s;
        let step = lie::log(&(last.camera_from_body * before.camera_from_body.inverse()));
        // Of a velocity taken between the two: it lags by half a step, and errs on from there.
        let drift_s2 = 0.5 * ahead_s * (ahead_s + step_s);
        let turn = (self.settings.turn_acceleration_rad_s2 * drift_s2).powi(2);
        let shift = (self.settings.shift_acceleration_m_s2 * drift_s2).powi(2);
        Some(StampedPose {
            stamp,
            camera_from_body: lie::exp(&(step * share)) * last.camera_from_body,
            covariance: last.covariance * (1.0 + share).powi(2)
                + before.covariance * share.powi(2)
                + Matrix6::from_diagonal(&Vector6::new(turn, turn, turn, shift, shift, shift)),
        })
    }

    /// Hermite curve from `last` to `next`, as twists on the left of `last`.
    fn between(
        &self,
        outer_last: Option<&StampedPose>,
        last: &StampedPose,
        next: &StampedPose,
        outer_next: Option<&StampedPose>,
        stamp: Timestamp,
    ) -> StampedPose {
        let span_s = elapsed_s(last, next);
        let u = stamp.signed_ns_since(last.stamp) as f64 * 1e-9 / span_s;
        let place = |pose: &StampedPose| lie::log(&(pose.camera_from_body * last.camera_from_body.inverse()));
        let chord = place(next);
        let start_slope = self.neighbour(outer_last, last).map_or(chord, |outer| {
            let outer_s = elapsed_s(outer, last);
            slope(&(-place(outer) / outer_s), outer_s, &(chord / span_s), span_s) * span_s
        });
        let end_slope = self.neighbour(outer_next, next).map_or(chord, |outer| {
            let outer_s = elapsed_s(next, outer);
            slope(&(chord / span_s), span_s, &((place(outer) - chord) / outer_s), outer_s) * span_s
        });
        let twist = chord * (u * u * (3.0 - 2.0 * u))
            + start_slope * (u * (1.0 - u) * (1.0 - u))
            + end_slope * (u * u * (u - 1.0));
        StampedPose {
            stamp,
            camera_from_body: lie::exp(&twist) * last.camera_from_body,
            covariance: last.covariance * (1.0 - u) + next.covariance * u,
        }
    }

    /// The neighbour, unless a gap lies between.
    fn neighbour<'a>(&self, outer: Option<&'a StampedPose>, inner: &StampedPose) -> Option<&'a StampedPose> {
        outer.filter(|outer| elapsed_s(outer, inner).abs() <= self.settings.longest_gap_s)
    }
}

/// Slope in the middle point of the parabola through three points, from the velocities before and after.
fn slope(before: &Vector6<f64>, before_s: f64, after: &Vector6<f64>, after_s: f64) -> Vector6<f64> {
    (before * after_s + after * before_s) / (before_s + after_s)
}

fn elapsed_s(from: &StampedPose, to: &StampedPose) -> f64 {
    to.stamp.signed_ns_since(from.stamp) as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    /// A hand that swings, with bends in all directions.
    fn truth(time_s: f64) -> Isometry3<f64> {
        let wave = |hz: f64, phase: f64| (std::f64::consts::TAU * hz * time_s + phase).sin();
        let twist = Vector6::new(0.3, 0.2, 0.1, 0.1, 0.05, 0.02).component_mul(&Vector6::new(
            wave(1.0, 0.0),
            wave(0.7, 1.0),
            wave(1.3, 2.0),
            wave(0.9, 3.0),
            wave(1.1, 4.0),
            wave(0.5, 5.0),
        ));
        lie::exp(&twist) * Isometry3::translation(0.1, -0.2, 0.8)
    }

    fn stamped(ns: u64, pose: Isometry3<f64>) -> StampedPose {
        StampedPose {
            stamp: Timestamp::from_ns(ns),
            camera_from_body: pose,
            covariance: Matrix6::identity() * 1e-6,
        }
    }

    fn history(stamps_ms: &[u64]) -> PoseHistory {
        let mut history = PoseHistory::new(HistorySettings::default());
        for &ms in stamps_ms {
            history.push(stamped(ms * MS, truth(ms as f64 * 1e-3))).unwrap();
        }
        history
    }

    fn distance(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
        lie::log(&(a * b.inverse())).norm()
    }

    /// Largest errors inside, of `at` and of the steady twist.
    fn interpolation_errors(stamps_ms: &[u64]) -> (f64, f64) {
        let history = history(stamps_ms);
        let (mut cubic, mut linear) = (0.0_f64, 0.0_f64);
        for pair in stamps_ms[1..stamps_ms.len() - 1].windows(2) {
            let (from, to) = (truth(pair[0] as f64 * 1e-3), truth(pair[1] as f64 * 1e-3));
            for eighth in 1..8 {
                let ns = pair[0] * MS + (pair[1] - pair[0]) * MS * eighth / 8;
                let pose = truth(ns as f64 * 1e-9);
                let at = history.at(Timestamp::from_ns(ns)).unwrap();
                let steady = lie::exp(&(lie::log(&(to * from.inverse())) * (eighth as f64 / 8.0))) * from;
                cubic = cubic.max(distance(&at.camera_from_body, &pose));
                linear = linear.max(distance(&steady, &pose));
            }
        }
        (cubic, linear)
    }

    #[test]
    fn errors_fall_with_the_orders_promised() {
        let every = |ms: u64| (0..60).map(|i| i * ms).collect::<Vec<_>>();
        let (cubic_32, linear_32) = interpolation_errors(&every(32));
        let (cubic_16, linear_16) = interpolation_errors(&every(16));
        // Halved spacing: 2³ and 2²; up to the next order, and where the samples happen to lie.
        assert!((6.5..10.0).contains(&(cubic_32 / cubic_16)), "{cubic_32:e} {cubic_16:e}");
        assert!((3.0..5.0).contains(&(linear_32 / linear_16)), "{linear_32:e} {linear_16:e}");
        assert!(cubic_32 < 0.1 * linear_32, "{cubic_32:e} {linear_32:e}");
        let unequal: Vec<u64> = (0..60).map(|i| i * 32 + [0, 11, 3, 17][i as usize % 4]).collect();
        let (cubic, linear) = interpolation_errors(&unequal);
        assert!(cubic < 0.2 * linear, "{cubic:e} {linear:e}");
    }

    #[test]
    fn a_steady_twist_is_exact() {
        let twist = Vector6::new(0.5, -1.0, 2.0, 0.3, 0.1, -0.2);
        let pose = |s: f64| lie::exp(&(twist * s)) * Isometry3::translation(0.1, 0.2, 0.9);
        let mut history = PoseHistory::new(HistorySettings::default());
        for ms in [100, 133, 150, 200, 240] {
            history.push(stamped(ms * MS, pose(ms as f64 * 1e-3))).unwrap();
        }
        for ms in [100, 101, 120, 149, 177, 230, 240, 260, 400] {
            let predicted = history.predict(Timestamp::from_ns(ms * MS)).unwrap();
            assert!(distance(&predicted.camera_from_body, &pose(ms as f64 * 1e-3)) < 1e-12, "{ms}");
        }
    }

    #[test]
    fn outside_and_in_gaps_there_is_nothing() {
        let history = history(&[100, 133, 600, 633]);
        let at = |ms: u64| history.at(Timestamp::from_ns(ms * MS));
        assert!(at(99).is_none() && at(134).is_none() && at(599).is_none() && at(634).is_none());
        assert!(at(100).is_some() && at(110).is_some() && at(133).is_some() && at(620).is_some());
        assert!(history.predict(Timestamp::from_ns(400 * MS)).is_none());
        assert!(history.predict(Timestamp::from_ns(883 * MS)).is_some());
        assert!(history.predict(Timestamp::from_ns(884 * MS)).is_none());
        assert!(history.predict(Timestamp::from_ns(u64::MAX)).is_none());
        assert!(self::history(&[100]).predict(Timestamp::from_ns(110 * MS)).is_none());
        assert!(self::history(&[]).at(Timestamp::from_ns(110 * MS)).is_none());
    }

    #[test]
    fn what_is_out_of_order_or_not_finite_is_refused() {
        let mut history = history(&[100, 133]);
        for ms in [133, 120, 0] {
            let refused = history.push(stamped(ms * MS, Isometry3::identity())).unwrap_err();
            assert!(matches!(refused, HistoryError::Order { .. }), "{refused}");
        }
        let nan = stamped(200 * MS, Isometry3::translation(f64::NAN, 0.0, 0.0));
        assert!(matches!(history.push(nan), Err(HistoryError::NotFinite { .. })));
        let mut endless = stamped(200 * MS, Isometry3::identity());
        endless.covariance[(2, 3)] = f64::INFINITY;
        assert!(matches!(history.push(endless), Err(HistoryError::NotFinite { .. })));
        assert_eq!(history.iter().count(), 2);
    }

    #[test]
    fn the_oldest_makes_room() {
        let stamps: Vec<u64> = (0..200).map(|i| i * 10).collect();
        let history = history(&stamps);
        assert_eq!(history.iter().count(), HistorySettings::default().capacity);
        assert_eq!(history.latest().unwrap().stamp, Timestamp::from_ns(1990 * MS));
        assert!(history.at(Timestamp::from_ns(100 * MS)).is_none());
    }

    #[test]
    fn predictions_grow_less_certain() {
        let history = history(&[100, 133]);
        let traces: Vec<f64> = [133, 140, 166, 250, 380]
            .map(|ms| history.predict(Timestamp::from_ns(ms * MS)).unwrap().covariance.trace())
            .into();
        assert!(traces.is_sorted_by(|a, b| a < b), "{traces:?}");
    }
}
