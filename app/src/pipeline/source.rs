//! The thread `camera`: takes frames; reports and survives stalls, garbage and unplugging.

use std::time::Duration;

use anyhow::{anyhow, bail};
use coshade_capture::{Camera, CaptureError, Frame, StreamInfo, Timestamp, clock};

use super::backoff::Backoff;
use super::event::{Reporter, Severity};
use super::handover::Outlet;
use super::metrics::CameraState;
use super::supervise::guarded;
use super::{Options, POLL, Shared};

/// A stall is so many periods of the camera without a frame …
const STALL_PERIODS: f64 = 5.0;
/// … but no less than this, for the system may be busy …
const SHORTEST_STALL: Duration = Duration::from_millis(250);
/// … and this for a camera without a rate of its own.
const STALL_WITHOUT_RATE: Duration = Duration::from_secs(1);

/// A camera that delivers for so long is well again: the next time it is lost, the pauses start small.
const STEADY: Duration = Duration::from_secs(5);

/// Opens a camera; again and again, if it must.
pub type Opener = Box<dyn FnMut() -> Result<Box<dyn Camera>, CaptureError> + Send>;

/// A camera, and how to open it again.
pub struct Source {
    /// Opened; its size is the one that all frames must have.
    pub camera: Box<dyn Camera>,
    /// Opens it once more.
    pub open: Opener,
}

/// What becomes of a source that is lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Retry {
    /// The pipeline ends with an error.
    Never,
    /// It is opened again, with growing pauses, until that works or the pipeline is stopped.
    UntilStopped,
}

/// A frame, and when this process had it: recordings keep [`Frame::arrived`] as it was.
pub struct Arrival {
    pub frame: Frame,
    pub at: Timestamp,
    pub is_live: bool,
}

/// The thread's work: ends behind the last frame, when stopped, or when nobody takes frames any more.
///
/// # Errors
/// The source is lost and not to be opened again; the frame asked for is not in it.
pub fn run(source: Source, out: Outlet<Arrival>, options: Options, shared: &Shared) -> anyhow::Result<()> {
    let stream = source.camera.stream().clone();
    let mut thread = SourceThread {
        name: source.camera.name().to_owned(),
        camera: Some(source.camera),
        open: source.open,
        quiet: Quiet::new(&stream),
        stream,
        out,
        options,
        shared,
        reporter: shared.events.reporter("camera"),
        backoff: Backoff::default(),
        opened: clock::now(),
        numbers: Numbers::default(),
    };
    while !shared.stopped() {
        if !thread.step()? {
            shared.counters.set_camera(CameraState::Ended);
            return thread.ended();
        }
        shared.counters.camera_cpu.update();
    }
    Ok(())
}

struct SourceThread<'a> {
    name: String,
    /// `None` while it is lost.
    camera: Option<Box<dyn Camera>>,
    open: Opener,
    stream: StreamInfo,
    out: Outlet<Arrival>,
    options: Options,
    shared: &'a Shared,
    reporter: Reporter,
    backoff: Backoff,
    opened: Timestamp,
    quiet: Quiet,
    numbers: Numbers,
}

impl SourceThread<'_> {
    /// One frame, or one attempt at it; `false` at the end.
    fn step(&mut self) -> anyhow::Result<bool> {
        let Some(camera) = &mut self.camera else {
            self.reopen();
            return Ok(true);
        };
        let (is_live, begun) = (camera.is_live(), clock::now());
        match guarded(|| camera.next_frame(POLL)) {
            Ok(Ok(frame)) => return Ok(self.frame(frame, is_live)),
            Ok(Err(CaptureError::EndOfStream { .. })) => return Ok(false),
            // A camera whose time is its own may say that it waited longer than it took here.
            Ok(Err(CaptureError::Timeout { timeout, .. })) => {
                self.timeout(timeout.max(clock::now().saturating_since(begun)));
            }
            Ok(Err(error @ CaptureError::Damaged { .. })) => self.damaged(&error.to_string()),
            Ok(Err(error)) => self.lost(&error.to_string())?,
            Err(panic) => {
                self.shared.counters.restarts.count();
                let name = self.name.clone();
                self.lost(&format!("{name}: its driver has panicked: {panic}"))?;
            }
        }
        Ok(true)
    }

    /// Hands a frame on; `false` if nobody takes it, or it was the only one asked for.
    fn frame(&mut self, frame: Frame, is_live: bool) -> bool {
        let at = clock::now();
        if let Some(quiet) = self.quiet.end() {
            self.shared.counters.set_camera(CameraState::Delivering);
            let message = format!("{}: frames again after {:.2} s", self.name, quiet.as_secs_f64());
            self.reporter.report(Severity::Info, message);
        }
        if let Err(reason) = self.check(&frame) {
            self.damaged(&format!("{}: frame {} is damaged: {reason}", self.name, frame.sequence));
            return true;
        }
        self.shared.counters.frames_in.count();
        self.shared.counters.missing.add(self.numbers.missing_before(frame.sequence));
        match self.options.only_frame {
            Some(only) if frame.sequence < only => true,
            Some(only) => {
                if frame.sequence == only {
                    self.out.send(Arrival { frame, at, is_live }, self.shared);
                }
                false
            }
            None => self.out.send(Arrival { frame, at, is_live }, self.shared),
        }
    }

    /// Whether a frame is what the camera announced.
    fn check(&self, frame: &Frame) -> Result<(), String> {
        let (size, announced) =
            ([frame.width_px, frame.height_px], [self.stream.width_px, self.stream.height_px]);
        if size != announced {
            let ([w, h], [to_w, to_h]) = (size, announced);
            return Err(format!("it has {w} x {h} pixels, where the camera announced {to_w} x {to_h}"));
        }
        frame.check().map_err(|error| error.to_string())
    }

    fn damaged(&mut self, message: &str) {
        self.shared.counters.damaged.count();
        self.reporter.report_often(Severity::Warning, "damaged", message);
    }

    fn timeout(&mut self, waited: Duration) {
        if let Some(quiet) = self.quiet.wait(waited) {
            self.shared.counters.stalls.count();
            self.shared.counters.set_camera(CameraState::Stalled);
            let message = format!("{}: stalled, no frame for {:.2} s", self.name, quiet.as_secs_f64());
            self.reporter.report(Severity::Warning, message);
        }
    }

    fn lost(&mut self, reason: &str) -> anyhow::Result<()> {
        self.camera = None;
        if clock::now().saturating_since(self.opened) >= STEADY {
            self.backoff.reset();
        }
        self.shared.counters.lost.count();
        self.shared.counters.set_camera(CameraState::Lost);
        if self.options.retry == Retry::Never {
            bail!("{reason}");
        }
        self.reporter.report(Severity::Error, format!("{reason}; it is opened again when it is back"));
        // Its return is news, and it is no stall besides.
        self.quiet.reported = true;
        Ok(())
    }

    /// A pause, then one attempt.
    fn reopen(&mut self) {
        let begun = clock::now();
        if !self.shared.sleep(self.backoff.pause()) {
            return;
        }
        let opened = guarded(&mut self.open);
        let _ = self.quiet.wait(clock::now().saturating_since(begun));
        match opened {
            Ok(Ok(camera)) => {
                self.numbers = Numbers::default();
                self.opened = clock::now();
                self.camera = Some(camera);
            }
            Ok(Err(error)) => self.reporter.report_often(Severity::Warning, "open", error),
            Err(panic) => {
                self.shared.counters.restarts.count();
                let message = format!("{}: its driver has panicked: {panic}", self.name);
                self.reporter.report_often(Severity::Error, "open", message);
            }
        }
    }

    /// Behind the last frame.
    fn ended(&self) -> anyhow::Result<()> {
        let Some(only) = self.options.only_frame else { return Ok(()) };
        match self.numbers {
            Numbers { last: Some(last), .. } if last == only => Ok(()),
            Numbers { first: Some(first), last: Some(last), .. } if last > only && first < only => {
                Err(anyhow!("{}: frame {only} is missing: {last} follows", self.name))
            }
            Numbers { first: Some(first), last: Some(last), .. } => {
                Err(anyhow!("{}: no frame {only}: they are numbered {first} to {last}", self.name))
            }
            Numbers { .. } => Err(anyhow!("{}: no frame {only}: there are none at all", self.name)),
        }
    }
}

/// Numbers of frames since the camera was opened.
#[derive(Default)]
struct Numbers {
    first: Option<u64>,
    last: Option<u64>,
}

impl Numbers {
    fn missing_before(&mut self, number: u64) -> u64 {
        self.first.get_or_insert(number);
        let last = self.last.replace(number);
        last.map_or(0, |last| number.saturating_sub(last).saturating_sub(1))
    }
}

/// How long the camera was waited for in vain.
struct Quiet {
    /// From when on it is a stall.
    limit: Duration,
    waited: Duration,
    reported: bool,
}

impl Quiet {
    fn new(stream: &StreamInfo) -> Self {
        let rate = stream.frames_per_second.filter(|rate| *rate > 0.0);
        let limit = rate.and_then(|rate| Duration::try_from_secs_f64(STALL_PERIODS / rate).ok());
        let limit = limit.unwrap_or(STALL_WITHOUT_RATE).max(SHORTEST_STALL);
        Self { limit, waited: Duration::ZERO, reported: false }
    }

    /// Notes a wait; how long it is by now, if that makes it a stall.
    fn wait(&mut self, time: Duration) -> Option<Duration> {
        self.waited = self.waited.saturating_add(time);
        if self.reported || self.waited < self.limit {
            return None;
        }
        self.reported = true;
        Some(self.waited)
    }

    /// A frame has come; how long there was none, if that was reported.
    fn end(&mut self) -> Option<Duration> {
        let waited = std::mem::take(&mut self.waited);
        std::mem::take(&mut self.reported).then_some(waited)
    }
}
