//! What goes wrong with a sensor, when, and how: listed, so that a test knows the truth.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::random::{Purpose, Random};

/// A thing that goes wrong with a sensor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum FaultSpec {
    /// Frames that are lost on their way; their numbers are missing.
    Drop {
        /// Which.
        #[serde(flatten)]
        which: Which,
    },
    /// The device delivers nothing for a while.
    Stall {
        /// When it stops, seconds of the world.
        #[schemars(range(min = 0.0))]
        from_s: f64,
        /// For how long.
        #[schemars(extend("exclusiveMinimum" = 0))]
        for_s: f64,
    },
    /// The device is gone from then on.
    Vanish {
        /// When, seconds of the world.
        #[schemars(range(min = 0.0))]
        at_s: f64,
    },
    /// A control is accepted and stays as it was; reading it back shows so.
    Ignore {
        /// Which control.
        control: ControlName,
    },
    /// A control is accepted and reads back as set, but nothing changes.
    Pretend {
        /// Which control.
        control: ControlName,
    },
    /// Automatic exposure that never settles. The sensor then has the control, switched on: exposure swings as
    /// exp(amplitude · sin(2π t / period)) until it is switched off.
    Pump {
        /// Of the exposure's logarithm. Higher: stronger.
        #[schemars(range(min = 0.0, max = 3.0))]
        amplitude: f64,
        /// Of one swing.
        #[schemars(range(min = 0.001))]
        period_s: f64,
    },
    /// Frames with a wrong time stamp.
    WrongStamp {
        /// Which.
        #[serde(flatten)]
        which: Which,
        /// How much too late (or too early, below 0) the stamp is.
        #[schemars(range(min = -3600.0, max = 3600.0))]
        by_s: f64,
    },
}

/// Frames that a fault befalls: those listed, and a share of all.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Which {
    /// Numbers of frames, from 0.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub frames: Vec<u64>,
    /// Share of all frames, chosen by the world's seed.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub share: f64,
}

/// A control of a simulated camera.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ControlName {
    /// Exposure time.
    Exposure,
    /// Gain.
    Gain,
    /// White balance.
    WhiteBalance,
    /// The switch of automatic exposure.
    AutoExposure,
}

/// How a control fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ControlFault {
    /// Stays as it was, and says so.
    Ignores,
    /// Says that it changed, and did not.
    Pretends,
}

/// What befalls one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct FrameFaults {
    /// Lost on its way.
    pub dropped: bool,
    /// Never made, because the device stalled.
    pub stalled: bool,
    /// Not there any more.
    pub vanished: bool,
    /// Error of its stamp, nanoseconds; positive is too late.
    pub stamp_error_ns: i64,
}

impl FrameFaults {
    /// True if the frame reaches its reader.
    pub fn is_delivered(&self) -> bool {
        !(self.dropped || self.stalled || self.vanished)
    }
}

/// All that goes wrong with one sensor.
#[derive(Clone, Debug)]
pub struct Faults {
    specs: Vec<FaultSpec>,
    seed: u64,
    sensor: u64,
}

impl Faults {
    /// `seed` and `sensor` choose frames, see [`Random::at`].
    pub fn new(specs: Vec<FaultSpec>, seed: u64, sensor: u64) -> Self {
        Self { specs, seed, sensor }
    }

    /// As they were described.
    pub fn specs(&self) -> &[FaultSpec] {
        &self.specs
    }

    /// What befalls frame number `frame`, exposed at `time_s`.
    pub fn of_frame(&self, frame: u64, time_s: f64) -> FrameFaults {
        let mut faults = FrameFaults::default();
        for (index, spec) in self.specs.iter().enumerate() {
            match spec {
                FaultSpec::Drop { which } => faults.dropped |= self.befalls(index, which, frame),
                FaultSpec::Stall { from_s, for_s } => {
                    faults.stalled |= (*from_s..from_s + for_s).contains(&time_s);
                }
                FaultSpec::Vanish { at_s } => faults.vanished |= time_s >= *at_s,
                FaultSpec::WrongStamp { which, by_s } if self.befalls(index, which, frame) => {
                    faults.stamp_error_ns = faults.stamp_error_ns.saturating_add((by_s * 1e9).round() as i64);
                }
                _ => {}
            }
        }
        faults
    }

    /// When the stall ends that a time falls into.
    pub fn stall_end_s(&self, time_s: f64) -> Option<f64> {
        let ends = self.specs.iter().filter_map(|spec| match spec {
            FaultSpec::Stall { from_s, for_s } if (*from_s..from_s + for_s).contains(&time_s) => {
                Some(from_s + for_s)
            }
            _ => None,
        });
        ends.reduce(f64::max)
    }

    /// How a control fails, `None` if it works.
    pub fn of_control(&self, control: ControlName) -> Option<ControlFault> {
        self.specs.iter().find_map(|spec| match spec {
            FaultSpec::Ignore { control: faulty } if *faulty == control => Some(ControlFault::Ignores),
            FaultSpec::Pretend { control: faulty } if *faulty == control => Some(ControlFault::Pretends),
            _ => None,
        })
    }

    /// Factor on the exposure while it is automatic; `None` if the sensor has no automatic exposure.
    pub fn pump(&self, time_s: f64) -> Option<f64> {
        self.specs.iter().find_map(|spec| match spec {
            FaultSpec::Pump { amplitude, period_s } => {
                Some((amplitude * (std::f64::consts::TAU * time_s / period_s).sin()).exp())
            }
            _ => None,
        })
    }

    fn befalls(&self, index: usize, which: &Which, frame: u64) -> bool {
        let mut random = Random::at(self.seed, self.sensor, Purpose::Fault, frame, index as u64);
        which.frames.contains(&frame) || random.uniform() < which.share
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_of_the_frames_is_dropped_and_listed_ones_always() {
        let drop = |frames, share| FaultSpec::Drop { which: Which { frames, share } };
        let faults = Faults::new(vec![drop(vec![7, 9], 0.0), drop(vec![], 0.1)], 1, 2);
        let dropped = (0..20_000).filter(|&frame| faults.of_frame(frame, 0.0).dropped).count() as f64;
        // Two listed ones of 20000 are within the 5 standard errors of the share.
        assert!((dropped - 2000.0).abs() < 5.0 * (20_000.0_f64 * 0.1 * 0.9).sqrt(), "{dropped}");
        let listed = Faults::new(vec![drop(vec![7, 9], 0.0)], 1, 2);
        let all: Vec<u64> = (0..100).filter(|&frame| listed.of_frame(frame, 0.0).dropped).collect();
        assert_eq!(all, [7, 9]);
    }

    #[test]
    fn stalls_end_and_vanished_devices_stay_away() {
        let specs = vec![FaultSpec::Stall { from_s: 1.0, for_s: 0.5 }, FaultSpec::Vanish { at_s: 2.0 }];
        let faults = Faults::new(specs, 0, 0);
        assert!(faults.of_frame(0, 0.99).is_delivered() && faults.of_frame(0, 1.5).is_delivered());
        assert!(faults.of_frame(0, 1.0).stalled && faults.of_frame(0, 2.0).vanished);
        assert_eq!(faults.stall_end_s(1.2), Some(1.5));
        assert_eq!(faults.stall_end_s(1.6), None);
    }

    #[test]
    fn pumping_swings_around_one() {
        let faults = Faults::new(vec![FaultSpec::Pump { amplitude: 0.2, period_s: 4.0 }], 0, 0);
        assert!((faults.pump(1.0).unwrap() - 0.2_f64.exp()).abs() < 1e-12);
        assert!((faults.pump(3.0).unwrap() * faults.pump(1.0).unwrap() - 1.0).abs() < 1e-12);
        assert_eq!(Faults::new(vec![], 0, 0).pump(1.0), None);
    }
}
