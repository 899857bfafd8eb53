//! A simulated sensor as a camera: frames in their order, with waits, losses and controls.

use std::time::Duration;

use coshade_capture::clock::now;
use coshade_capture::{
    Camera, CaptureError, Control, ControlInfo, ControlReport, ControlValue, Frame, PixelFormat, StreamInfo,
    Timestamp,
};
use coshade_lens::calibration::Calibration;

use crate::controls::{Controls, Refusal};
use crate::device::SimSensor;
use crate::sensor::Exposure;

/// How fast frames come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pace {
    /// As in the world. Who asks late gets the next frame late: none is skipped.
    #[default]
    RealTime,
    /// As fast as they are asked for, with the same stamps. Only stalls are waited for, in the world's time.
    Fast,
}

/// Delivers the frames of a [`SimSensor`] as a device would.
///
/// A frame whose picture was not prepared (see [`SimSensor::prepare`]) is traced when it is asked for, which takes as long as
/// the tracer does.
pub struct SimCamera {
    name: String,
    stream: StreamInfo,
    sensor: SimSensor,
    pace: Pace,
    controls: Option<Controls>,
    next: u64,
    /// The moment on the process's clock that is time 0 of the world.
    started: Option<Timestamp>,
    /// How far a stall was waited for, in the world's time.
    waited_to_s: f64,
}

impl SimCamera {
    /// `name` is for messages.
    pub fn new(name: impl Into<String>, sensor: SimSensor, pace: Pace) -> Self {
        let stream = sensor.stream();
        let is_image = stream.format != PixelFormat::Z16;
        let controls = is_image.then(|| Controls::new(sensor.spec(), sensor.faults()));
        Self { name: name.into(), stream, sensor, pace, controls, next: 0, started: None, waited_to_s: 0.0 }
    }

    /// The sensor, which knows the truth.
    pub fn sensor(&self) -> &SimSensor {
        &self.sensor
    }

    /// What truly holds for a frame, given the controls set so far.
    pub fn exposure(&self, frame: u64) -> Exposure {
        let time_s = self.sensor.timing().time_s(frame);
        self.controls.as_ref().map_or_else(Exposure::default, |controls| controls.exposure(frame, time_s))
    }

    fn lost(&self, reason: &str) -> CaptureError {
        CaptureError::Lost { source_name: self.name.clone(), reason: reason.to_owned() }
    }

    /// Waits for time `time_s` of the world; `false` if that is later than `timeout` allows.
    fn wait_until(&mut self, time_s: f64, timeout: Duration) -> bool {
        let time_s = time_s.max(0.0);
        let started = *self.started.get_or_insert_with(now);
        let due = started + Duration::from_secs_f64(time_s);
        let wait = due.saturating_since(now());
        std::thread::sleep(wait.min(timeout));
        if wait > timeout {
            return false;
        }
        // A reader that was late does not get the frames it missed in a burst.
        self.started = Some(started + now().saturating_since(due));
        true
    }

    /// Lets a stall pass in the world's time; `false` if it lasts longer than `timeout`.
    fn pass_stall(&mut self, time_s: f64, timeout: Duration) -> bool {
        let Some(end_s) = self.sensor.faults().stall_end_s(time_s) else { return true };
        let waited_to_s = self.waited_to_s.max(time_s);
        let left_s = end_s - waited_to_s;
        let passes = left_s <= timeout.as_secs_f64();
        self.waited_to_s = if passes { end_s } else { waited_to_s + timeout.as_secs_f64() };
        passes
    }
}

impl Camera for SimCamera {
    fn name(&self) -> &str {
        &self.name
    }

    fn stream(&self) -> &StreamInfo {
        &self.stream
    }

    fn calibration(&self) -> Option<&Calibration> {
        Some(self.sensor.calibration())
    }

    fn is_live(&self) -> bool {
        false
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CaptureError> {
        let timed_out = || CaptureError::Timeout { source_name: self.name.clone(), timeout };
        let timed_out = timed_out();
        while self.next < self.sensor.frame_count() {
            let frame = self.next;
            let time_s = self.sensor.timing().time_s(frame);
            let faults = self.sensor.faults().of_frame(frame, time_s);
            if faults.vanished {
                return Err(self.lost("the device has vanished"));
            }
            if self.pace == Pace::Fast && faults.stalled && !self.pass_stall(time_s, timeout) {
                return Err(timed_out);
            }
            if !faults.is_delivered() {
                self.next += 1;
                continue;
            }
            let delay_s = self.sensor.timing().delay_s;
            if self.pace == Pace::RealTime && !self.wait_until(time_s + delay_s, timeout) {
                return Err(timed_out);
            }
            self.next += 1;
            let made = self.sensor.frame(frame, &self.exposure(frame));
            let mut made = made.map_err(|error| CaptureError::Damaged {
                source_name: self.name.clone(),
                sequence: frame,
                reason: error.to_string(),
            })?;
            if self.pace == Pace::RealTime {
                made.arrived = now();
            }
            return Ok(made);
        }
        Err(CaptureError::EndOfStream { source_name: self.name.clone() })
    }

    fn controls(&self) -> Vec<ControlInfo> {
        self.controls.as_ref().map_or_else(Vec::new, Controls::infos)
    }

    fn control(&mut self, control: Control) -> Result<ControlValue, CaptureError> {
        let shown = self.controls.as_ref().and_then(|controls| controls.shown(control));
        shown.ok_or_else(|| CaptureError::NoSuchControl { source_name: self.name.clone(), control })
    }

    fn set_control(&mut self, control: Control, value: ControlValue) -> Result<ControlReport, CaptureError> {
        let next = self.next;
        let outcome = self
            .controls
            .as_mut()
            .map_or(Err(Refusal::NoSuchControl), |controls| controls.set(control, value, next));
        let source_name = self.name.clone();
        match outcome {
            Ok(actual) => Ok(ControlReport {
                control,
                requested: value,
                actual,
                latency_frames: Some(self.sensor.spec().control_latency_frames),
            }),
            Err(Refusal::NoSuchControl) => Err(CaptureError::NoSuchControl { source_name, control }),
            Err(Refusal::Refused(reason)) => {
                Err(CaptureError::ControlRefused { source_name, control, value, reason })
            }
        }
    }
}
