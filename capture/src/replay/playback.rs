//! The clock that all cameras of one recording share.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use super::options::{RATES, Rate, ReplayOptions};
use crate::clock::{self, Timestamp};
use crate::recording::{Reader, RecordingError};

/// The playing of one recording: all its cameras go by this clock. A clone controls the same playing.
///
/// Time is counted on a line that never turns back: each pass over the recording takes one period of it, and going
/// backwards begins the next pass.
#[derive(Clone)]
pub struct Playback {
    shared: Arc<Shared>,
}

pub(super) struct Shared {
    path: PathBuf,
    /// Log time of the first image.
    first_ns: u64,
    /// Length of one pass: from the first image to the last and one mean interval, so that the loop has no stutter.
    period_ns: u64,
    state: Mutex<State>,
    changed: Condvar,
}

#[derive(Clone, Copy, Debug)]
struct State {
    rate: Rate,
    playing: bool,
    looping: bool,
    /// Time on the line at `since`.
    line_ns: u64,
    /// When `line_ns` was right; `None` while the clock stands still: paused, or nothing has been asked for yet.
    since: Option<Timestamp>,
    /// Changes with every seek: cameras then go to `line_ns`.
    epoch: u64,
    /// Where the epoch began.
    epoch_line_ns: u64,
}

/// What a camera should do about a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// Deliver it now.
    Due,
    /// Wait and ask again; not at all within the time given.
    Later,
    /// Somebody has moved to another place: begin there.
    Moved,
}

/// Where an epoch begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Start {
    pub(super) epoch: u64,
    pub(super) line_ns: u64,
}

impl Playback {
    /// Opens a recording for playing; its cameras are opened with [`camera`](Self::camera).
    ///
    /// # Errors
    /// As [`Reader::open`], and [`RecordingError::Stream`] if there are no images.
    pub fn open(path: impl AsRef<Path>, options: ReplayOptions) -> Result<Self, RecordingError> {
        let mut reader = Reader::open(path)?;
        let Some((first, last)) = reader.span()? else {
            let problem = "has no images that can be read".to_owned();
            return Err(RecordingError::Stream {
                path: reader.path().to_owned(),
                problem,
                streams: Vec::new(),
            });
        };
        let span_ns = last.as_ns().saturating_sub(first.as_ns());
        let interval_ns = super::interval_ns(&mut reader)?;
        let start_ns = u64::try_from(options.start.as_nanos()).unwrap_or(u64::MAX).min(span_ns);
        let state = State {
            rate: options.rate,
            playing: true,
            looping: options.looping,
            line_ns: start_ns,
            since: None,
            epoch: 0,
            epoch_line_ns: start_ns,
        };
        let shared = Shared {
            path: reader.path().to_owned(),
            first_ns: first.as_ns(),
            period_ns: span_ns.saturating_add(interval_ns).max(1),
            state: Mutex::new(state),
            changed: Condvar::new(),
        };
        Ok(Self { shared: Arc::new(shared) })
    }

    /// The recording.
    pub fn path(&self) -> &Path {
        &self.shared.path
    }

    /// Goes on after [`pause`](Self::pause).
    pub fn play(&self) {
        self.change(|state, _| state.playing = true);
    }

    /// Stops the clock: cameras give no more frames until [`play`](Self::play).
    pub fn pause(&self) {
        self.change(|state, _| state.playing = false);
    }

    /// Whether the playing is not paused.
    pub fn is_playing(&self) -> bool {
        self.shared.lock().playing
    }

    /// Sets the pace; a number outside of 0.001 to 1000 is taken for the nearest of those, NaN is ignored.
    pub fn set_rate(&self, rate: Rate) {
        let rate = match rate {
            Rate::Times(times) if times.is_nan() => return,
            Rate::Times(times) => Rate::Times(times.clamp(*RATES.start(), *RATES.end())),
            Rate::Max => Rate::Max,
        };
        self.change(|state, _| state.rate = rate);
    }

    /// The pace.
    pub fn rate(&self) -> Rate {
        self.shared.lock().rate
    }

    /// Whether to begin again after the last frame.
    pub fn set_looping(&self, looping: bool) {
        self.change(|state, _| state.looping = looping);
    }

    /// Whether it begins again after the last frame.
    pub fn is_looping(&self) -> bool {
        self.shared.lock().looping
    }

    /// Goes to a place, counted from the first image; beyond the end is the end. All cameras follow, also those that
    /// have reached the end.
    pub fn seek(&self, to: Duration) {
        self.change(|state, shared| {
            let to_ns = u64::try_from(to.as_nanos()).unwrap_or(u64::MAX).min(shared.period_ns - 1);
            let pass = state.line_ns / shared.period_ns;
            let line_ns = pass * shared.period_ns + to_ns;
            // Backwards is the next pass, so that stamps never turn back.
            let backwards = line_ns < state.line_ns;
            state.line_ns = if backwards { line_ns.saturating_add(shared.period_ns) } else { line_ns };
            state.epoch += 1;
            state.epoch_line_ns = state.line_ns;
        });
    }

    /// Where the playing is, counted from the first image.
    pub fn position(&self) -> Duration {
        let state = self.shared.lock();
        Duration::from_nanos(state.line_now(clock::now()) % self.shared.period_ns)
    }

    /// Length of the recording, from the first image to one interval behind the last.
    pub fn duration(&self) -> Duration {
        Duration::from_nanos(self.shared.period_ns)
    }

    fn change(&self, change: impl FnOnce(&mut State, &Shared)) {
        let mut state = self.shared.lock();
        state.stop(clock::now());
        change(&mut state, &self.shared);
        drop(state);
        self.shared.changed.notify_all();
    }

    pub(super) fn shared(&self) -> &Arc<Shared> {
        &self.shared
    }

    pub(super) fn from_shared(shared: Arc<Shared>) -> Self {
        Self { shared }
    }
}

impl State {
    fn line_now(&self, now: Timestamp) -> u64 {
        let (Some(since), Rate::Times(times)) = (self.since, self.rate) else { return self.line_ns };
        let elapsed_ns = now.saturating_since(since).as_nanos() as f64 * times;
        self.line_ns.saturating_add(elapsed_ns as u64)
    }

    /// Stops the clock where it is; the next frame that is asked for starts it again.
    fn stop(&mut self, now: Timestamp) {
        self.line_ns = self.line_now(now);
        self.since = None;
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        // The state is plain numbers: a thread that panicked while holding it left it usable.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn first_ns(&self) -> u64 {
        self.first_ns
    }

    pub(super) fn period_ns(&self) -> u64 {
        self.period_ns
    }

    pub(super) fn looping(&self) -> bool {
        self.lock().looping
    }

    /// Where a camera begins that is opened, or that was told [`Verdict::Moved`].
    ///
    /// A camera that joins a playing under way begins where the clock is; without a pace, where the others began.
    pub(super) fn start(&self) -> Start {
        let state = self.lock();
        let line_ns = match (state.rate, state.since) {
            (Rate::Times(_), Some(_)) => state.line_now(clock::now()),
            _ => state.epoch_line_ns,
        };
        Start { epoch: state.epoch, line_ns }
    }

    /// Waits until the frame at `line_ns` is due, at most until `deadline`. `u64::MAX` is never due: a camera waits so
    /// at its end.
    pub(super) fn wait(&self, epoch: u64, line_ns: u64, deadline: Timestamp) -> Verdict {
        let mut state = self.lock();
        loop {
            if state.epoch != epoch {
                return Verdict::Moved;
            }
            let now = clock::now();
            let wait = match (state.playing && line_ns != u64::MAX, state.rate) {
                (false, _) => deadline.saturating_since(now),
                (true, Rate::Max) => {
                    state.line_ns = state.line_ns.max(line_ns);
                    return Verdict::Due;
                }
                (true, Rate::Times(times)) => {
                    state.since.get_or_insert(now);
                    let ahead_ns = line_ns.saturating_sub(state.line_now(now));
                    if ahead_ns == 0 {
                        return Verdict::Due;
                    }
                    // Rounded up: waking before the frame is due would only mean waiting again.
                    let wait = Duration::from_nanos((ahead_ns as f64 / times).ceil().max(1.0) as u64);
                    wait.min(deadline.saturating_since(now))
                }
            };
            if now >= deadline {
                return Verdict::Later;
            }
            state = self.changed.wait_timeout(state, wait).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}
