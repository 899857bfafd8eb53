//! When frames are exposed, and what their stamps say.

use std::time::Duration;

use coshade_capture::Timestamp;

use crate::random::{Purpose, Random};

/// The moment on the session's clock that is time 0 of a world: late enough that no stamp falls below the clock's zero.
pub const EPOCH: Timestamp = Timestamp::from_ns(10_000_000_000);

/// Rate and stamps of one sensor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Timing {
    /// Rate.
    pub frames_per_second: f64,
    /// When the first frame is exposed.
    pub phase_s: f64,
    /// What must be added to the sensor's stamps to get the session's clock, as in a rig file.
    pub time_offset_ns: i64,
    /// Standard deviation of stamps (normally distributed; exposures themselves are even).
    pub jitter_s: f64,
    /// From the exposure to the arrival.
    pub delay_s: f64,
    /// Starts the jitter, see [`Random::at`].
    pub seed: u64,
    /// As `seed`.
    pub sensor: u64,
}

impl Timing {
    /// When frame number `frame` is exposed (middle of the exposure of the centre row), seconds of the world.
    pub fn time_s(&self, frame: u64) -> f64 {
        self.phase_s + frame as f64 / self.frames_per_second
    }

    /// Frames that are exposed before `duration_s`.
    pub fn frame_count(&self, duration_s: f64) -> u64 {
        let count = ((duration_s - self.phase_s) * self.frames_per_second).ceil();
        // A cast of a negative number gives 0. Rounding must not add a frame at the very end.
        let count = count as u64;
        if count > 0 && self.time_s(count - 1) >= duration_s { count - 1 } else { count }
    }

    /// The true time of a frame on the session's clock.
    pub fn true_stamp(&self, frame: u64) -> Timestamp {
        at(self.time_s(frame) * 1e9)
    }

    /// What the sensor says: offset, jitter, and the error of a faulty stamp.
    pub fn stamp(&self, frame: u64, error_ns: i64) -> Timestamp {
        let mut random = Random::at(self.seed, self.sensor, Purpose::Stamp, frame, 0);
        let jitter_ns = self.jitter_s * 1e9 * random.normal();
        at(self.time_s(frame) * 1e9 - self.time_offset_ns as f64 + jitter_ns + error_ns as f64)
    }

    /// When the frame arrives, on the session's clock.
    pub fn arrival(&self, frame: u64) -> Timestamp {
        self.true_stamp(frame) + Duration::from_secs_f64(self.delay_s.max(0.0))
    }
}

/// Nanoseconds of the world on the session's clock.
fn at(ns: f64) -> Timestamp {
    // A cast of a negative number gives 0.
    Timestamp::from_ns((EPOCH.as_ns() as f64 + ns).round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: Timing = Timing {
        frames_per_second: 30.0,
        phase_s: 0.01,
        time_offset_ns: -2_500_000,
        jitter_s: 0.0005,
        delay_s: 0.02,
        seed: 3,
        sensor: 4,
    };

    #[test]
    fn stamps_differ_from_the_truth_by_offset_and_jitter() {
        let count = 20_000;
        let errors: Vec<f64> = (0..count)
            .map(|frame| TIMING.stamp(frame, 0).signed_ns_since(TIMING.true_stamp(frame)) as f64)
            .collect();
        let mean = errors.iter().sum::<f64>() / count as f64;
        let sigma = (errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / count as f64).sqrt();
        // Standard errors: σ/√n of the mean, σ/√(2n) of the deviation.
        assert!((mean - 2_500_000.0).abs() < 5.0 * 500_000.0 / (count as f64).sqrt(), "{mean}");
        assert!((sigma / 500_000.0 - 1.0).abs() < 5.0 / (2.0 * count as f64).sqrt(), "{sigma}");
        assert_eq!(TIMING.arrival(5).signed_ns_since(TIMING.true_stamp(5)), 20_000_000);
        assert_eq!(TIMING.stamp(5, 1_000_000).signed_ns_since(TIMING.stamp(5, 0)), 1_000_000);
    }

    #[test]
    fn the_last_frame_is_before_the_end() {
        for fps in [1.0, 29.97, 30.0, 60.0, 90.0] {
            let timing = Timing { frames_per_second: fps, phase_s: 0.0, ..TIMING };
            let count = timing.frame_count(2.0);
            assert!(timing.time_s(count - 1) < 2.0 && timing.time_s(count) >= 2.0 - 1e-9, "{fps}");
        }
        assert_eq!(Timing { phase_s: 3.0, ..TIMING }.frame_count(2.0), 0);
    }
}
