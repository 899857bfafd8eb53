//! Overlay error after the filter over that before, by motion. Beside it the 1€ filter (Casiez, Roussel, Vogel, CHI 2012).

#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a table printer of simulated numbers")]

#[path = "../tests/filter/simulation.rs"]
mod simulation;

use coshade_capture::Timestamp;
use coshade_tracker::filter::{FilterSettings, PoseFilter};
use coshade_tracker::lie;
use nalgebra::Isometry3;
use simulation::{Motion, Run, corners_px, errors};

/// The noise scale is known by then.
const SETTLED: usize = 100;

fn main() {
    println!(
        "{:44} {:>6} {:>6} {:>6} {:>6} {:>6}",
        "motion", "true", "noise/3", "noise*3", "10 /s", "1 euro"
    );
    for px_per_frame in [0.0, 0.001, 0.003, 0.01, 0.02, 0.03, 0.05, 0.1, 0.2, 0.5, 1.0, 3.0, 10.0, 30.0] {
        print(Motion::Steady { px_per_frame });
    }
    for px_per_frame in [0.01, 0.1, 1.0, 10.0] {
        print(Motion::Turning { px_per_frame });
    }
    for px_per_frame in [0.01, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0] {
        print(Motion::StopAndGo { px_per_frame });
    }
    for px in [0.1, 0.3, 1.0, 10.0] {
        print(Motion::Steps { px });
    }
    for hz in [0.1, 0.3, 1.0, 2.0, 4.0, 8.0, 12.0] {
        for amplitude_px in [0.05, 0.1, 0.2, 0.5, 2.0] {
            print(Motion::Shake { hz, amplitude_px });
        }
    }
    for hz in [0.3, 1.0, 2.0, 4.0, 8.0, 12.0] {
        for amplitude_px in [0.05, 0.1, 0.2, 0.5, 2.0] {
            print(Motion::Tremor { hz, amplitude_px });
        }
    }
}

fn print(motion: Motion) {
    let run = Run::default();
    let james_stein = |run: Run| {
        let mut filter = PoseFilter::new(FilterSettings::default());
        errors(motion, &run, SETTLED, &mut |stamp, pose, covariance| {
            filter.filter(stamp, pose, covariance).unwrap()
        })
        .ratio()
    };
    let mut euro = OneEuro::default();
    println!(
        "{:44} {:6.3} {:6.3} {:6.3} {:6.3} {:6.3}",
        format!("{motion:?}"),
        james_stein(run),
        james_stein(Run { noise_scale: 1.0 / 3.0, ..run }),
        james_stein(Run { noise_scale: 3.0, ..run }),
        james_stein(Run { frames_per_s: 10.0, ..run }),
        errors(motion, &run, SETTLED, &mut |stamp, pose, _| euro.filter(stamp, pose)).ratio(),
    );
}

/// The 1€ filter on the group of rigid motions, its speed in px/s of the corners: 1 Hz at rest, 0.05 Hz more per px/s.
#[derive(Default)]
struct OneEuro {
    last: Option<(Timestamp, Isometry3<f64>, f64)>,
}

impl OneEuro {
    fn filter(&mut self, stamp: Timestamp, pose: &Isometry3<f64>) -> Isometry3<f64> {
        let (filtered, speed) = match &self.last {
            None => (*pose, 0.0),
            Some((before, filtered, speed)) => {
                let step_s = stamp.signed_ns_since(*before) as f64 * 1e-9;
                let share = |cutoff_hz: f64| 1.0 / (1.0 + 1.0 / (std::f64::consts::TAU * cutoff_hz * step_s));
                let now = (corners_px(pose) - corners_px(filtered)).norm() / 2.0 / step_s;
                let speed = speed + (now - speed) * share(1.0);
                let step = lie::log(&(pose * filtered.inverse())) * share(1.0 + 0.05 * speed);
                (lie::exp(&step) * filtered, speed)
            }
        };
        self.last = Some((stamp, filtered, speed));
        filtered
    }
}
