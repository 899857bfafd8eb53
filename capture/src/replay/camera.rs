//! One stream of a recording as a camera.

use std::path::Path;
use std::time::Duration;

use coshade_lens::calibration::Calibration;

use super::options::ReplaySource;
use super::playback::{Playback, Start, Verdict};
use super::registry;
use crate::camera::{Camera, CaptureError, StreamInfo};
use crate::clock::{self, Timestamp};
use crate::control::{Control, ControlInfo, ControlReport, ControlValue};
use crate::frame::Frame;
use crate::recording::{Reader, RecordedFrame, RecordingError};

/// A stream of a recording, delivered as a camera would.
pub struct ReplayCamera {
    name: String,
    playback: Playback,
    reader: Reader,
    info: StreamInfo,
    calibration: Option<Calibration>,
    start: Start,
    /// Which pass over the recording the reader is in.
    pass: u64,
    /// Read, not yet delivered.
    next: Option<RecordedFrame>,
    /// Exposure and gain of the last frame, or of the first before that.
    exposure: Option<Duration>,
    gain: Option<f32>,
    /// Added to sequence numbers.
    sequence_offset: u64,
    last_sequence: Option<u64>,
    /// Whether the next frame is the first of a pass.
    begins_pass: bool,
}

impl ReplayCamera {
    /// Opens `replay:FILE#STREAM?OPTIONS`. Sources that name the same file share one [`Playback`].
    ///
    /// # Errors
    /// [`CaptureError::Lost`] with the file and what to do: a bad source string, no such file, no such stream (the
    /// message lists those there are), a stream of an unsupported kind.
    pub fn open(source: &str) -> Result<Self, CaptureError> {
        let lost = |reason: String| CaptureError::Lost { source_name: source.to_owned(), reason };
        let parts = ReplaySource::parse(source).map_err(lost)?;
        let playback = registry::playback(&parts.path, parts.options).map_err(lost)?;
        Self::new(source, playback, parts.stream.as_deref()).map_err(|error| lost(error.to_string()))
    }

    fn new(name: &str, playback: Playback, stream: Option<&str>) -> Result<Self, RecordingError> {
        let mut reader = Reader::open(playback.path())?;
        let stream = reader.stream(stream)?;
        let calibration = reader.calibration(stream)?;
        reader.select(&[stream]);
        let (first, frames_per_second) = probe(&mut reader, stream)?;
        let info = StreamInfo {
            format: first.format,
            color: first.color,
            width_px: first.width_px,
            height_px: first.height_px,
            frames_per_second,
            depth_unit_m: first.depth_unit_m,
        };
        let mut camera = Self {
            name: name.to_owned(),
            start: playback.shared().start(),
            playback,
            reader,
            info,
            calibration,
            pass: 0,
            next: None,
            exposure: first.exposure,
            gain: first.gain,
            sequence_offset: 0,
            last_sequence: None,
            begins_pass: true,
        };
        camera.go_to_start();
        Ok(camera)
    }

    /// The clock that this camera goes by.
    pub fn playback(&self) -> &Playback {
        &self.playback
    }

    fn go_to_start(&mut self) {
        let shared = self.playback.shared();
        self.pass = self.start.line_ns / shared.period_ns();
        let from_ns = shared.first_ns().saturating_add(self.start.line_ns % shared.period_ns());
        self.reader.seek(Timestamp::from_ns(from_ns));
        self.next = None;
        self.begins_pass = true;
    }

    /// Reads ahead by one frame; false at the end of a recording that does not loop.
    fn read_ahead(&mut self) -> Result<bool, CaptureError> {
        // An empty pass must not be looked for again and again.
        for _ in 0..2 {
            if self.next.is_some() {
                return Ok(true);
            }
            self.next = self.reader.next_frame().map_err(|error| self.capture_error(error))?;
            if self.next.is_none() {
                if !self.playback.shared().looping() {
                    return Ok(false);
                }
                self.pass += 1;
                self.reader.seek(Timestamp::default());
                self.begins_pass = true;
            }
        }
        Ok(self.next.is_some())
    }

    fn capture_error(&self, error: RecordingError) -> CaptureError {
        let source_name = self.name.clone();
        let sequence = self.last_sequence.map_or(0, |last| last.saturating_add(1));
        match error {
            RecordingError::Damaged { .. } | RecordingError::Unsupported { .. } => {
                CaptureError::Damaged { source_name, sequence, reason: error.to_string() }
            }
            _ => CaptureError::Lost { source_name, reason: error.to_string() },
        }
    }

    /// Where the frame that was read ahead is on the clock's line.
    fn line_ns(&self) -> u64 {
        let shared = self.playback.shared();
        let logged_ns = self.next.as_ref().map_or(u64::MAX, |next| next.logged.as_ns());
        let in_pass_ns = logged_ns.saturating_sub(shared.first_ns());
        self.offset_ns().saturating_add(in_pass_ns).min(u64::MAX - 1)
    }

    fn offset_ns(&self) -> u64 {
        self.pass.saturating_mul(self.playback.shared().period_ns())
    }

    fn deliver(&mut self, mut frame: Frame) -> Frame {
        let offset = Duration::from_nanos(self.offset_ns());
        frame.captured = frame.captured + offset;
        frame.arrived = frame.arrived + offset;
        if std::mem::take(&mut self.begins_pass)
            && let Some(last) = self.last_sequence
            && frame.sequence.saturating_add(self.sequence_offset) <= last
        {
            self.sequence_offset = last.saturating_add(1).saturating_sub(frame.sequence);
        }
        frame.sequence = frame.sequence.saturating_add(self.sequence_offset);
        self.last_sequence = Some(frame.sequence);
        (self.exposure, self.gain) = (frame.exposure, frame.gain);
        frame
    }

    fn recorded(&self, control: Control) -> Option<ControlValue> {
        match control {
            Control::Exposure => self.exposure.map(ControlValue::Time),
            Control::Gain => self.gain.map(|gain| ControlValue::Factor(gain.into())),
            _ => None,
        }
    }
}

/// The first frame of a stream, and its rate: as recorded, else as measured.
fn probe(reader: &mut Reader, stream: usize) -> Result<(Frame, Option<f64>), RecordingError> {
    let nominal = reader.streams().get(stream).and_then(|stream| stream.frames_per_second);
    let interval_s = super::interval_ns(reader)? as f64 * 1e-9;
    let mut problem = None;
    loop {
        match reader.next_frame() {
            Ok(Some(first)) => return Ok((first.frame, nominal.or(Some(1.0 / interval_s)))),
            Ok(None) => break,
            Err(error @ (RecordingError::Damaged { .. } | RecordingError::Unsupported { .. })) => {
                problem.get_or_insert(error);
            }
            Err(error) => return Err(error),
        }
    }
    let streams = reader.streams().iter().map(|stream| stream.name.clone()).collect();
    let path = reader.path().to_owned();
    Err(problem.unwrap_or(RecordingError::Stream {
        path,
        problem: "the stream has no frames".to_owned(),
        streams,
    }))
}

impl Playback {
    /// Opens the stream `name` of this recording as a camera; without a name the only one.
    ///
    /// # Errors
    /// As [`ReplayCamera::open`].
    pub fn camera(&self, stream: Option<&str>) -> Result<ReplayCamera, CaptureError> {
        let name = source_name(self.path(), stream);
        let lost = |error: RecordingError| CaptureError::Lost {
            source_name: name.clone(),
            reason: error.to_string(),
        };
        ReplayCamera::new(&name, self.clone(), stream).map_err(lost)
    }
}

fn source_name(path: &Path, stream: Option<&str>) -> String {
    let stream = stream.map_or_else(String::new, |stream| format!("#{stream}"));
    format!("replay:{}{stream}", path.display())
}

impl Camera for ReplayCamera {
    fn name(&self) -> &str {
        &self.name
    }

    fn stream(&self) -> &StreamInfo {
        &self.info
    }

    fn calibration(&self) -> Option<&Calibration> {
        self.calibration.as_ref()
    }

    fn is_live(&self) -> bool {
        false
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CaptureError> {
        let deadline = clock::now() + timeout;
        loop {
            let ready = self.read_ahead()?;
            // At the end somebody may still go back: that is looked for, not waited for.
            let (line_ns, until) =
                if ready { (self.line_ns(), deadline) } else { (u64::MAX, Timestamp::default()) };
            match self.playback.shared().wait(self.start.epoch, line_ns, until) {
                Verdict::Moved => {
                    self.start = self.playback.shared().start();
                    self.go_to_start();
                }
                Verdict::Later if ready => {
                    return Err(CaptureError::Timeout { source_name: self.name.clone(), timeout });
                }
                Verdict::Later => return Err(CaptureError::EndOfStream { source_name: self.name.clone() }),
                Verdict::Due => {
                    if let Some(next) = self.next.take() {
                        return Ok(self.deliver(next.frame));
                    }
                }
            }
        }
    }

    fn controls(&self) -> Vec<ControlInfo> {
        let recorded = [Control::Exposure, Control::Gain].map(|control| (control, self.recorded(control)));
        let info = |(control, value): (Control, Option<ControlValue>)| {
            let value = value?;
            let (min, max, default) = (value, value, value);
            Some(ControlInfo {
                control,
                min,
                max,
                step: None,
                default,
                latency_frames: None,
                read_only: true,
            })
        };
        recorded.into_iter().filter_map(info).collect()
    }

    fn control(&mut self, control: Control) -> Result<ControlValue, CaptureError> {
        let missing = || CaptureError::NoSuchControl { source_name: self.name.clone(), control };
        self.recorded(control).ok_or_else(missing)
    }

    fn set_control(&mut self, control: Control, value: ControlValue) -> Result<ControlReport, CaptureError> {
        self.control(control)?;
        let reason = "it is a recording: what was recorded cannot be changed".to_owned();
        Err(CaptureError::ControlRefused { source_name: self.name.clone(), control, value, reason })
    }
}
