//! Records in a thread of its own, so that a slow disk never holds up a camera.

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use coshade_lens::calibration::Calibration;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender};

use super::error::RecordingError;
use super::transform::RecordedTransform;
use super::writer::{RecordingOptions, RecordingWriter, StreamCounts, StreamId};
use crate::clock;
use crate::frame::Frame;

/// Longest wait of the recorder's thread for something to do.
const IDLE: Duration = Duration::from_millis(100);

/// Longest wait for the recorder's thread to answer.
const ANSWER: Duration = Duration::from_secs(10);

enum Command {
    Stream {
        name: String,
        calibration: Option<Box<Calibration>>,
        rate: Option<f64>,
        reply: Sender<StreamReply>,
    },
    Frame {
        stream: StreamId,
        frame: Frame,
        dropped_before: u64,
    },
    Transform(RecordedTransform),
}

type StreamReply = Result<StreamId, RecordingError>;
type Finished = Result<Vec<StreamCounts>, RecordingError>;

/// What the thread and its owner share.
#[derive(Default)]
struct Shared {
    /// Frames dropped, by stream.
    dropped: Mutex<Vec<Arc<AtomicU64>>>,
    written: AtomicU64,
    error: Mutex<Option<RecordingError>>,
}

/// A recording under way.
///
/// Frames wait in a queue of fixed length while they are written; each waiting frame keeps its buffer from the camera's
/// pool, so that should be larger than the queue. Dropping the recorder finishes the file, as [`finish`](Self::finish).
pub struct Recorder {
    path: PathBuf,
    commands: Option<Sender<Command>>,
    thread: Option<JoinHandle<Finished>>,
    shared: Arc<Shared>,
}

impl Recorder {
    /// Begins a recording in the file `path`, with a queue of `queue_frames` (at least one).
    ///
    /// # Errors
    /// As [`RecordingWriter::create`], or [`RecordingError::Create`] if there can be no thread.
    pub fn create(
        path: impl AsRef<Path>,
        options: RecordingOptions,
        queue_frames: usize,
    ) -> Result<Self, RecordingError> {
        let path = path.as_ref().to_owned();
        let writer = RecordingWriter::create(&path, options)?;
        let (commands, received) = crossbeam_channel::bounded(queue_frames.max(1));
        let shared = Arc::new(Shared::default());
        let of_thread = Arc::clone(&shared);
        let thread = thread::Builder::new()
            .name("recorder".into())
            .spawn(move || work(writer, &received, &of_thread))
            .map_err(|source| RecordingError::Create { path: path.clone(), source })?;
        Ok(Self { path, commands: Some(commands), thread: Some(thread), shared })
    }

    /// Adds a stream; see [`RecordingWriter::add_stream`]. Waits until it is written.
    ///
    /// # Errors
    /// As [`RecordingWriter::add_stream`]; [`RecordingError::Ended`] after an error that was reported.
    pub fn add_stream(
        &self,
        name: &str,
        calibration: Option<&Calibration>,
        frames_per_second: Option<f64>,
    ) -> Result<StreamId, RecordingError> {
        let (reply, answer) = crossbeam_channel::bounded(1);
        let calibration = calibration.cloned().map(Box::new);
        let command = Command::Stream { name: name.to_owned(), calibration, rate: frames_per_second, reply };
        let ended = || RecordingError::Ended { path: self.path.clone() };
        let commands = self.commands.as_ref().ok_or_else(ended)?;
        commands.send_timeout(command, ANSWER).map_err(|_| ended())?;
        let stream = answer.recv_timeout(ANSWER).map_err(|_| self.take_error().unwrap_or_else(ended))??;
        Ok(stream)
    }

    /// Gives a frame to the recorder; false if it had to be dropped, because the queue is full or the recording has
    /// ended. Never waits.
    pub fn try_record(&self, stream: StreamId, frame: Frame) -> bool {
        let Some(commands) = &self.commands else { return false };
        let command = Command::Frame { stream, frame, dropped_before: self.dropped(stream) };
        let taken = commands.try_send(command).is_ok();
        if !taken {
            self.shared.count_dropped(stream);
        }
        taken
    }

    /// As [`try_record`](Self::try_record), but waits up to `timeout` for a place in the queue: for sources that
    /// deliver as fast as they are asked, so that none of their frames is lost to a slow disk.
    pub fn record_within(&self, stream: StreamId, frame: Frame, timeout: Duration) -> bool {
        let Some(commands) = &self.commands else { return false };
        let command = Command::Frame { stream, frame, dropped_before: self.dropped(stream) };
        let taken = commands.send_timeout(command, timeout).is_ok();
        if !taken {
            self.shared.count_dropped(stream);
        }
        taken
    }

    /// Gives a pose to the recorder; false if it had to be dropped. Never waits.
    pub fn try_record_transform(&self, transform: RecordedTransform) -> bool {
        self.commands
            .as_ref()
            .is_some_and(|commands| commands.try_send(Command::Transform(transform)).is_ok())
    }

    /// Frames in the file or on the way to it.
    pub fn written(&self) -> u64 {
        self.shared.written.load(Ordering::Relaxed)
    }

    /// Frames of a stream that had to be dropped.
    pub fn dropped(&self, stream: StreamId) -> u64 {
        self.shared.counter(stream).map_or(0, |counter| counter.load(Ordering::Relaxed))
    }

    /// The error that ended the recording, once.
    pub fn take_error(&self) -> Option<RecordingError> {
        self.shared.error.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// Writes what is queued, then the index, and closes the file.
    ///
    /// # Errors
    /// The error that ended the recording if [`take_error`](Self::take_error) has not given it, else
    /// [`RecordingError::Ended`]; [`RecordingError::Write`] if the index cannot be written.
    pub fn finish(mut self) -> Result<Vec<StreamCounts>, RecordingError> {
        self.join()
    }

    fn join(&mut self) -> Finished {
        self.commands = None;
        let ended = || RecordingError::Ended { path: self.path.clone() };
        let thread = self.thread.take().ok_or_else(ended)?;
        let result = thread.join().unwrap_or_else(|_| {
            let reason = "the recorder's thread has failed".to_owned();
            Err(RecordingError::Write { path: self.path.clone(), reason })
        });
        match self.take_error() {
            Some(error) => Err(error),
            None => result,
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        if self.thread.is_some()
            && let Err(error) = self.join()
        {
            tracing::error!("{error}");
        }
    }
}

impl Shared {
    fn counter(&self, stream: StreamId) -> Option<Arc<AtomicU64>> {
        self.dropped.lock().unwrap_or_else(PoisonError::into_inner).get(stream.0).cloned()
    }

    fn count_dropped(&self, stream: StreamId) {
        if let Some(counter) = self.counter(stream) {
            counter.fetch_add(1, Ordering::Relaxed);
        }
    }

    fn dropped_by_stream(&self) -> Vec<u64> {
        let counters = self.dropped.lock().unwrap_or_else(PoisonError::into_inner);
        counters.iter().map(|counter| counter.load(Ordering::Relaxed)).collect()
    }
}

/// The recorder's thread: until the owner hangs up, or an error ends the recording.
fn work(mut writer: RecordingWriter, commands: &Receiver<Command>, shared: &Shared) -> Finished {
    let path = writer.path().to_owned();
    loop {
        let wait = writer.due().map_or(IDLE, |due| due.saturating_since(clock::now()).min(IDLE));
        let result = match commands.recv_timeout(wait) {
            Ok(command) => obey(&mut writer, command, shared),
            Err(RecvTimeoutError::Timeout) => writer.flush_if_due(),
            Err(RecvTimeoutError::Disconnected) => return writer.finish(&shared.dropped_by_stream()),
        };
        if let Err(error) = result {
            *shared.error.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            return Err(RecordingError::Ended { path });
        }
    }
}

fn obey(writer: &mut RecordingWriter, command: Command, shared: &Shared) -> Result<(), RecordingError> {
    match command {
        Command::Stream { name, calibration, rate, reply } => {
            let added = writer.add_stream(&name, calibration.as_deref(), rate);
            if added.is_ok() {
                shared.dropped.lock().unwrap_or_else(PoisonError::into_inner).push(Arc::default());
            }
            match added {
                Err(error @ RecordingError::Write { .. }) => Err(error),
                answer => {
                    // The caller may have given up waiting; then nobody wants the answer.
                    let _ = reply.try_send(answer);
                    Ok(())
                }
            }
        }
        Command::Frame { stream, frame, dropped_before } => {
            match writer.write(stream, &frame, dropped_before) {
                Err(error @ RecordingError::Frame { .. }) => {
                    tracing::warn!("{error}");
                    shared.count_dropped(stream);
                    Ok(())
                }
                Err(error) => Err(error),
                Ok(()) => {
                    shared.written.fetch_add(1, Ordering::Relaxed);
                    Ok(())
                }
            }
        }
        Command::Transform(transform) => writer.write_transform(&transform),
    }
}
