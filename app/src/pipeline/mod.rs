//! From the camera to tracked frames, on threads that are watched over.
//!
//! ```text
//! camera ─handover─▶ tracker ─handover─▶ whoever calls Pipeline::receive
//!    └── events, counters ──┴──▶ status line, log
//! ```
//!
//! | module | what is there |
//! | --- | --- |
//! | [`handover`] | what a slow reader gets: the newest frame, or every frame |
//! | [`source`] | the thread `camera`: takes frames; reports and survives stalls, garbage and unplugging |
//! | [`tracker`] | the thread `tracker`: brightness of a frame → tracking |
//! | [`event`] | what happened, with its time |
//! | [`metrics`] | counters, latency, CPU time |
//! | [`supervise`] | named threads whose panics are caught, and that end in time |
//!
//! **Newest or every frame.** A live camera goes on whether or not its frames are taken, so its frames go through
//! mailboxes that overwrite: the pose that comes out is of the newest frame, never of a queue. A file waits for its
//! reader, so nothing need be lost: its frames are handed from thread to thread, each waiting for the next. [`Handover`]
//! says which; the pipeline is otherwise the same.
//!
//! **What goes wrong.** A camera that vanishes, or whose driver panics, is opened again with growing pauses
//! ([`Retry::UntilStopped`]), or ends the pipeline with an error ([`Retry::Never`]: a file that is read a second time would
//! be measured twice). A stall is reported, waited for, and its end reported. A frame that is no image of the announced
//! size is counted and left out. A panic of the tracker costs that frame; a fresh tracker goes on, unless it panics on
//! several frames in a row, which ends the pipeline with an error. Every wait has an end, so the threads are gone within
//! [`STOP_WITHIN`] of [`Pipeline::finish`]; one that hangs in foreign code is left behind and named.

mod backoff;
pub mod event;
pub mod handover;
pub mod metrics;
pub mod source;
pub mod supervise;
#[cfg(test)]
mod tests;
pub mod tracker;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use coshade_capture::{LatestError, Timestamp, clock};

pub use event::{Event, Severity};
pub use handover::Handover;
pub use metrics::{CameraState, Metrics};
pub use source::{Retry, Source};
pub use tracker::{Track, TrackedFrame};

use handover::Inlet;
use metrics::Counters;
use supervise::Watched;

/// How often a thread that waits looks whether it should end.
const POLL: Duration = Duration::from_millis(50);
/// How long the threads have to end once they are told to.
pub const STOP_WITHIN: Duration = Duration::from_millis(800);

/// How a pipeline runs.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// What a slow reader gets.
    pub handover: Handover,
    /// What becomes of a source that is lost.
    pub retry: Retry,
    /// Track only the frame of this number, and end behind it.
    pub only_frame: Option<u64>,
    /// End after so many tracked frames.
    pub max_frames: Option<u64>,
}

/// What the threads share with the pipeline.
#[derive(Clone)]
pub struct Shared {
    stop: Arc<AtomicBool>,
    counters: Arc<Counters>,
    events: event::Outbox,
}

impl Shared {
    fn stopped(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Waits; `false` if the pipeline was stopped meanwhile.
    fn sleep(&self, time: Duration) -> bool {
        let end = clock::now() + time;
        while !self.stopped() {
            let left = end.saturating_since(clock::now());
            if left.is_zero() {
                return true;
            }
            std::thread::sleep(left.min(POLL));
        }
        false
    }
}

/// A camera and a tracker at work.
pub struct Pipeline<T> {
    tracked: Inlet<TrackedFrame<T>>,
    events: event::Inbox,
    shared: Shared,
    threads: Vec<Watched>,
    begun: Timestamp,
}

/// How a pipeline ended.
#[derive(Debug)]
pub struct Finished {
    /// What it did.
    pub metrics: Metrics,
    /// Events that nobody had taken yet.
    pub events: Vec<Event>,
    /// Why it ended before its time: an error of a thread, with the thread's name.
    pub failures: Vec<anyhow::Error>,
}

impl<T: Send + 'static> Pipeline<T> {
    /// Starts the threads. `build` makes the tracker, and another one after a panic.
    ///
    /// # Errors
    /// What `build` says; no thread.
    pub fn start<K>(
        source: Source,
        mut build: impl FnMut() -> anyhow::Result<K> + Send + 'static,
        options: Options,
    ) -> anyhow::Result<Self>
    where
        K: Track<Tracking = T> + 'static,
    {
        let first = build()?;
        let (outbox, events) = event::channel();
        let shared = Shared {
            stop: Arc::new(AtomicBool::new(false)),
            counters: Arc::new(Counters::default()),
            events: outbox,
        };
        let (frames_out, frames_in) = handover::channel(options.handover);
        let (tracked_out, tracked) = handover::channel(options.handover);
        let begun = clock::now();
        let mut pipeline = Self { tracked, events, shared: shared.clone(), threads: Vec::new(), begun };
        let tracker = {
            let shared = shared.clone();
            move || tracker::run(frames_in, tracked_out, first, build, options.max_frames, &shared)
        };
        // Should the second thread not start, dropping the pipeline ends the first.
        pipeline.threads.push(supervise::spawn("tracker", tracker)?);
        let camera = move || source::run(source, frames_out, options, &shared);
        pipeline.threads.push(supervise::spawn("camera", camera)?);
        Ok(pipeline)
    }

    /// The next tracked frame, waiting at most `timeout`.
    ///
    /// # Errors
    /// [`LatestError::Closed`] once the pipeline has ended and its last frame was taken: see [`finish`](Self::finish).
    pub fn receive(&mut self, timeout: Duration) -> Result<TrackedFrame<T>, LatestError> {
        self.tracked.receive(timeout)
    }

    /// What has happened since the last call.
    pub fn events(&self) -> impl Iterator<Item = Event> + '_ {
        self.events.take()
    }

    /// How the camera is now.
    pub fn camera(&self) -> CameraState {
        self.shared.counters.camera()
    }

    /// What it has done so far.
    pub fn metrics(&self) -> Metrics {
        let unread = self.tracked.overwritten();
        self.shared.counters.metrics(unread, self.events.dropped(), clock::now().saturating_since(self.begun))
    }

    /// Ends the threads, and says how it went. Takes no longer than [`STOP_WITHIN`].
    pub fn finish(mut self) -> Finished {
        self.shared.stop.store(true, Ordering::Relaxed);
        let deadline = clock::now() + STOP_WITHIN;
        let threads = std::mem::take(&mut self.threads);
        let failures = threads.into_iter().filter_map(|thread| thread.join_by(deadline).err()).collect();
        Finished { metrics: self.metrics(), events: self.events().collect(), failures }
    }
}

impl<T> Drop for Pipeline<T> {
    fn drop(&mut self) {
        self.shared.stop.store(true, Ordering::Relaxed);
    }
}
