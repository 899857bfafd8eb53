//! Counters, latency, CPU time.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use serde::Serialize;

use super::supervise::thread_cpu;

/// What a pipeline has done.
#[derive(Clone, Debug, Serialize)]
pub struct Metrics {
    /// Wall clock since the start.
    pub elapsed_s: f64,
    /// How the camera is now.
    pub camera: CameraState,
    /// Frames that the camera delivered, without damaged ones.
    pub frames_in: u64,
    /// Frames that were tracked.
    pub tracked: u64,
    /// Tracked frames a second of wall clock.
    pub tracked_per_s: f64,
    /// Frames overwritten before the tracker took them.
    pub overwritten: u64,
    /// Tracked frames overwritten before anybody took them.
    pub unread: u64,
    /// Frames missing by their numbers.
    pub missing: u64,
    /// Frames that could not be read or converted, or are of another size.
    pub damaged: u64,
    /// Times that the camera delivered nothing for long.
    pub stalls: u64,
    /// Times that the camera was lost.
    pub lost: u64,
    /// Panics of a thread's work that were survived: the camera was opened, or the tracker built, anew.
    pub restarts: u64,
    /// Events that found no room.
    pub events_dropped: u64,
    /// From the moment a frame was there to the end of its tracking.
    pub latency_ms: Option<Spread>,
    /// From the middle of a frame's exposure to the end of its tracking; live cameras only.
    pub capture_latency_ms: Option<Spread>,
    /// Wall clock of the tracking alone.
    pub track_ms: Option<Spread>,
    /// CPU time of the thread `camera`.
    pub camera_cpu_s: Option<f64>,
    /// CPU time of the thread `tracker`, without threads of the detector's own.
    pub tracker_cpu_s: Option<f64>,
}

/// How a camera is. Unless it is delivering, the last frame is stale.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
#[repr(u8)]
pub enum CameraState {
    /// Frames come, or are about to.
    #[default]
    Delivering,
    /// There, but nothing comes.
    Stalled,
    /// Gone; it is opened again if the pipeline is told to.
    Lost,
    /// Behind its last frame.
    Ended,
}

/// Of many lengths of time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Spread {
    /// Half are shorter.
    pub median: f64,
    /// 95 of 100 are shorter.
    pub p95: f64,
    /// The longest.
    pub max: f64,
}

/// The live counterpart of [`Metrics`].
#[derive(Default)]
pub struct Counters {
    camera: AtomicU8,
    /// See [`Metrics::frames_in`].
    pub frames_in: Counter,
    /// See [`Metrics::tracked`].
    pub tracked: Counter,
    /// See [`Metrics::overwritten`].
    pub overwritten: Counter,
    /// See [`Metrics::missing`].
    pub missing: Counter,
    /// See [`Metrics::damaged`].
    pub damaged: Counter,
    /// See [`Metrics::stalls`].
    pub stalls: Counter,
    /// See [`Metrics::lost`].
    pub lost: Counter,
    /// See [`Metrics::restarts`].
    pub restarts: Counter,
    /// See [`Metrics::camera_cpu_s`].
    pub camera_cpu: CpuTime,
    /// See [`Metrics::tracker_cpu_s`].
    pub tracker_cpu: CpuTime,
    times: Mutex<Times>,
}

#[derive(Default)]
struct Times {
    latency: Durations,
    capture_latency: Durations,
    track: Durations,
}

impl Counters {
    /// See [`Metrics::camera`].
    pub fn set_camera(&self, state: CameraState) {
        self.camera.store(state as u8, Ordering::Relaxed);
    }

    /// See [`Metrics::camera`].
    pub fn camera(&self) -> CameraState {
        use CameraState::{Delivering, Ended, Lost, Stalled};
        let state = self.camera.load(Ordering::Relaxed);
        [Stalled, Lost, Ended].into_iter().find(|known| *known as u8 == state).unwrap_or(Delivering)
    }

    /// Notes how long a frame took.
    pub fn note(&self, latency: Duration, capture_latency: Option<Duration>, track: Duration) {
        let mut times = self.times();
        times.latency.add(latency);
        times.track.add(track);
        if let Some(capture_latency) = capture_latency {
            times.capture_latency.add(capture_latency);
        }
    }

    fn times(&self) -> MutexGuard<'_, Times> {
        // Nothing that holds the lock can leave it half changed in a way that matters.
        self.times.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// All of it now.
    pub fn metrics(&self, unread: u64, events_dropped: u64, elapsed: Duration) -> Metrics {
        let times = self.times();
        let (elapsed_s, tracked) = (elapsed.as_secs_f64(), self.tracked.get());
        Metrics {
            elapsed_s,
            camera: self.camera(),
            frames_in: self.frames_in.get(),
            tracked,
            tracked_per_s: if elapsed_s > 0.0 { tracked as f64 / elapsed_s } else { 0.0 },
            overwritten: self.overwritten.get(),
            unread,
            missing: self.missing.get(),
            damaged: self.damaged.get(),
            stalls: self.stalls.get(),
            lost: self.lost.get(),
            restarts: self.restarts.get(),
            events_dropped,
            latency_ms: times.latency.spread_ms(),
            capture_latency_ms: times.capture_latency.spread_ms(),
            track_ms: times.track.spread_ms(),
            camera_cpu_s: self.camera_cpu.get_s(),
            tracker_cpu_s: self.tracker_cpu.get_s(),
        }
    }
}

/// Counts up.
#[derive(Default)]
pub struct Counter(AtomicU64);

impl Counter {
    /// One more.
    pub fn count(&self) {
        self.add(1);
    }

    /// Several more.
    pub fn add(&self, more: u64) {
        self.0.fetch_add(more, Ordering::Relaxed);
    }

    /// Takes over a count kept elsewhere.
    pub fn set(&self, count: u64) {
        self.0.store(count, Ordering::Relaxed);
    }

    /// So many.
    pub fn get(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// CPU time of one thread, 0 while unknown.
#[derive(Default)]
pub struct CpuTime(AtomicU64);

impl CpuTime {
    /// To be called on that thread now and then.
    pub fn update(&self) {
        if let Some(spent) = thread_cpu() {
            self.0.store(u64::try_from(spent.as_nanos()).unwrap_or(u64::MAX), Ordering::Relaxed);
        }
    }

    fn get_s(&self) -> Option<f64> {
        match self.0.load(Ordering::Relaxed) {
            0 => None,
            ns => Some(ns as f64 * 1e-9),
        }
    }
}

/// Many lengths of time in bounded memory: how many fell into each class of 2 % width, from a microsecond on.
struct Durations {
    classes: [u32; CLASSES],
    count: u64,
    max: Duration,
}

const CLASSES: usize = 1024;
const CLASS_RATIO: f64 = 1.02;
const SHORTEST_S: f64 = 1e-6;

impl Default for Durations {
    fn default() -> Self {
        Self { classes: [0; CLASSES], count: 0, max: Duration::ZERO }
    }
}

impl Durations {
    fn add(&mut self, duration: Duration) {
        let class = (duration.as_secs_f64() / SHORTEST_S).max(1.0).ln() / CLASS_RATIO.ln();
        // The last class, from 600 s on, takes all that is longer.
        if let Some(class) = self.classes.get_mut((class as usize).min(CLASSES - 1)) {
            *class = class.saturating_add(1);
        }
        self.count += 1;
        self.max = self.max.max(duration);
    }

    fn spread_ms(&self) -> Option<Spread> {
        let max = self.max.as_secs_f64() * 1e3;
        let quantile = |share| self.quantile_s(share).map(|s| (s * 1e3).min(max));
        Some(Spread { median: quantile(0.5)?, p95: quantile(0.95)?, max })
    }

    /// The middle of the class that holds the quantile: within 1 %.
    fn quantile_s(&self, share: f64) -> Option<f64> {
        let rank = ((self.count as f64 * share).ceil() as u64).max(1);
        let mut below = 0;
        let class = self.classes.iter().position(|&count| {
            below += u64::from(count);
            below >= rank
        })?;
        Some(SHORTEST_S * CLASS_RATIO.powf(class as f64 + 0.5))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_right_to_one_percent() {
        let mut durations = Durations::default();
        assert_eq!(durations.spread_ms(), None);
        // 1 ms … 1000 ms in an order that is not sorted (7 and 1000 have no common divisor).
        for step in 0..1000 {
            durations.add(Duration::from_millis(1 + step * 7 % 1000));
        }
        let spread = durations.spread_ms().unwrap();
        assert!((spread.median / 500.0 - 1.0).abs() < 0.011, "{spread:?}");
        assert!((spread.p95 / 950.0 - 1.0).abs() < 0.011, "{spread:?}");
        assert_eq!(spread.max, 1000.0);
    }

    #[test]
    fn absurd_times_are_counted_too() {
        let mut durations = Durations::default();
        durations.add(Duration::ZERO);
        assert_eq!(durations.spread_ms().unwrap(), Spread { median: 0.0, p95: 0.0, max: 0.0 });
        durations.add(Duration::MAX);
        assert!(durations.spread_ms().unwrap().p95.is_finite());
    }
}
