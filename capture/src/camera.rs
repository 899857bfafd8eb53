//! The `Camera` trait: one interface for devices, folders, recordings and simulated sensors.

use std::time::Duration;

use coshade_lens::calibration::Calibration;

use crate::control::{Control, ControlInfo, ControlReport, ControlValue};
use crate::frame::Frame;
use crate::pixel_format::{ColorEncoding, PixelFormat};

/// What a camera delivers, known before the first frame.
#[derive(Clone, Debug, PartialEq)]
pub struct StreamInfo {
    /// Layout of the frames' bytes.
    pub format: PixelFormat,
    /// Colour encoding of Y′CbCr formats.
    pub color: ColorEncoding,
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Nominal rate, `None` if the source has no rate of its own.
    pub frames_per_second: Option<f64>,
    /// Metres a count of a depth stream, `None` for images.
    pub depth_unit_m: Option<f64>,
}

/// A source of frames.
///
/// Every call returns in bounded time. A camera is used by one thread; it can be sent to it.
pub trait Camera: Send {
    /// The source as the user named it, for messages.
    fn name(&self) -> &str;

    /// What the frames will be.
    fn stream(&self) -> &StreamInfo;

    /// The lens and sensor data that came with the source (a recording holds them), `None` if it has none.
    fn calibration(&self) -> Option<&Calibration> {
        None
    }

    /// Whether frames come whether or not they are taken, so that a slow reader loses some. False for files, which
    /// wait for their reader.
    fn is_live(&self) -> bool {
        true
    }

    /// The next frame, waiting at most `timeout`.
    ///
    /// # Errors
    /// [`CaptureError::Timeout`] if none came in time, [`CaptureError::EndOfStream`] after the last one,
    /// [`CaptureError::Damaged`] for a frame that could not be read (the next call goes on behind it),
    /// [`CaptureError::Lost`] if the source has vanished.
    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CaptureError>;

    /// The controls this camera has; empty if it has none.
    fn controls(&self) -> Vec<ControlInfo>;

    /// Reads a control back from the device.
    ///
    /// # Errors
    /// [`CaptureError::NoSuchControl`], or [`CaptureError::Lost`].
    fn control(&mut self, control: Control) -> Result<ControlValue, CaptureError>;

    /// Sets a control and reads it back.
    ///
    /// # Errors
    /// [`CaptureError::NoSuchControl`], [`CaptureError::ControlRefused`], or [`CaptureError::Lost`].
    fn set_control(&mut self, control: Control, value: ControlValue) -> Result<ControlReport, CaptureError>;
}

/// Why a camera delivered no frame or did not obey.
#[derive(Debug, thiserror::Error)]
pub enum CaptureError {
    /// No frame came within the time allowed.
    #[error("{source_name}: no frame within {} ms", timeout.as_millis())]
    Timeout {
        /// The source as the user named it.
        source_name: String,
        /// How long was waited.
        timeout: Duration,
    },
    /// The source is over.
    #[error("{source_name}: end of stream")]
    EndOfStream {
        /// The source as the user named it.
        source_name: String,
    },
    /// One frame is unreadable; the ones behind it may be fine.
    #[error("{source_name}: frame {sequence} is damaged: {reason}")]
    Damaged {
        /// The source as the user named it.
        source_name: String,
        /// Which frame.
        sequence: u64,
        /// What is wrong with it.
        reason: String,
    },
    /// The source has vanished or cannot be opened.
    #[error("{source_name}: {reason}")]
    Lost {
        /// The source as the user named it.
        source_name: String,
        /// What happened and what to do.
        reason: String,
    },
    /// The camera does not have this control.
    #[error("{source_name}: has no control {control:?}")]
    NoSuchControl {
        /// The source as the user named it.
        source_name: String,
        /// The control asked for.
        control: Control,
    },
    /// The value is of the wrong kind, out of range, or cannot be set now.
    #[error("{source_name}: {control:?} cannot be set to {value:?}: {reason}")]
    ControlRefused {
        /// The source as the user named it.
        source_name: String,
        /// The control asked for.
        control: Control,
        /// The value asked for.
        value: ControlValue,
        /// Why not, and what would do.
        reason: String,
    },
}
