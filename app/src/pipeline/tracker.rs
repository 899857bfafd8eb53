//! The thread `tracker`: brightness of a frame → tracking.

use anyhow::{Context as _, bail};
use coshade_capture::{Converter, Frame, LatestError, Timestamp, clock};
use coshade_tracker::{Luma, Tracker, Tracking};

use super::event::{Reporter, Severity};
use super::handover::{Inlet, Outlet};
use super::source::Arrival;
use super::supervise::guarded;
use super::{POLL, Shared};

/// Panics on so many frames in a row are no matter of a single frame.
const MAX_PANICS_IN_A_ROW: u32 = 3;

/// What finds tags and poses in images, one after the other.
pub trait Track: Send {
    /// What it finds.
    type Tracking: Send;

    /// What is in `image`, the middle of whose exposure was `captured`.
    fn track(&mut self, image: &Luma<'_>, captured: Timestamp) -> Self::Tracking;
}

impl Track for Tracker {
    type Tracking = Tracking;

    fn track(&mut self, image: &Luma<'_>, captured: Timestamp) -> Tracking {
        Self::track(self, image, captured)
    }
}

/// A frame and what was found in that very frame.
#[derive(Clone, Debug)]
pub struct TrackedFrame<T> {
    /// The frame as the camera delivered it.
    pub frame: Frame,
    /// What was found.
    pub tracking: T,
    /// When this process had the frame.
    pub taken: Timestamp,
    /// When its tracking was done.
    pub tracked: Timestamp,
}

/// The thread's work: ends behind the last frame, after `max_frames`, when stopped, or when nobody takes tracked frames any more. `build` makes a
/// new tracker after a panic.
///
/// # Errors
/// The tracker panics on every frame, or cannot be made again.
pub fn run<K: Track>(
    mut frames: Inlet<Arrival>,
    out: Outlet<TrackedFrame<K::Tracking>>,
    tracker: K,
    mut build: impl FnMut() -> anyhow::Result<K>,
    max_frames: Option<u64>,
    shared: &Shared,
) -> anyhow::Result<()> {
    let mut reporter = shared.events.reporter("tracker");
    let mut tracker = tracker;
    let mut brightness = Brightness::default();
    let mut panics = 0;
    let more = || max_frames.is_none_or(|max| shared.counters.tracked.get() < max);
    while !shared.stopped() && more() {
        let arrival = match frames.receive(POLL) {
            Ok(arrival) => arrival,
            Err(LatestError::Timeout) => continue,
            Err(LatestError::Closed) => break,
        };
        shared.counters.overwritten.set(frames.overwritten());
        let begun = clock::now();
        let Some(image) = brightness.of(&arrival.frame, shared, &mut reporter) else { continue };
        let (sequence, captured) = (arrival.frame.sequence, arrival.frame.captured);
        match guarded(|| tracker.track(&image, captured)) {
            Ok(tracking) => {
                panics = 0;
                let tracked = TrackedFrame::new(arrival, tracking, begun, shared);
                if !out.send(tracked, shared) {
                    break;
                }
            }
            Err(panic) => {
                panics += 1;
                shared.counters.restarts.count();
                reporter.report(
                    Severity::Error,
                    format!("the tracker has panicked on frame {sequence}: {panic}"),
                );
                if panics == MAX_PANICS_IN_A_ROW {
                    bail!(
                        "the tracker has panicked on {panics} frames in a row, the last time with: {panic}"
                    );
                }
                tracker = build().context("the tracker cannot be started again")?;
            }
        }
        shared.counters.tracker_cpu.update();
    }
    shared.counters.overwritten.set(frames.overwritten());
    Ok(())
}

impl<T> TrackedFrame<T> {
    fn new(arrival: Arrival, tracking: T, begun: Timestamp, shared: &Shared) -> Self {
        let tracked = clock::now();
        let Arrival { frame, at, is_live } = arrival;
        // The stamps of files are of another clock.
        let capture_latency = is_live.then(|| tracked.saturating_since(frame.captured));
        shared.counters.note(tracked.saturating_since(at), capture_latency, tracked.saturating_since(begun));
        shared.counters.tracked.count();
        Self { frame, tracking, taken: at, tracked }
    }
}

/// The brightness of frames, in memory that is used again and again.
#[derive(Default)]
struct Brightness {
    converter: Converter,
    codes: Vec<u8>,
}

impl Brightness {
    /// The frame's own plane where it has one, else a conversion; `None`, which is counted, if the frame is damaged.
    fn of<'a>(&'a mut self, frame: &'a Frame, shared: &Shared, reporter: &mut Reporter) -> Option<Luma<'a>> {
        if let Some(own) = Luma::of_frame(frame) {
            return Some(own);
        }
        self.codes.resize(frame.pixel_count(), 0);
        let converted = self.converter.grey(frame, &mut self.codes).map_err(|error| error.to_string());
        let image = converted.and_then(|()| {
            Luma::new(&self.codes, frame.width_px, frame.height_px, frame.width_px)
                .map_err(|error| error.to_string())
        });
        image
            .inspect_err(|error| {
                shared.counters.damaged.count();
                let message = format!("frame {} is damaged: {error}", frame.sequence);
                reporter.report_often(Severity::Warning, "damaged", message);
            })
            .ok()
    }
}
