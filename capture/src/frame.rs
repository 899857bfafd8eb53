//! One image as the sensor delivered it.

use std::time::Duration;

use crate::clock::Timestamp;
use crate::pixel_format::{ColorEncoding, PixelFormat};
use crate::pool::PixelBuffer;

/// One image as the sensor delivered it, with what is known of how it was taken.
///
/// Cloning shares the pixels.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Layout of the bytes.
    pub format: PixelFormat,
    /// Colour encoding of Y′CbCr formats.
    pub color: ColorEncoding,
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Bytes from one row to the next (of the Y plane for NV12, whose UV plane has the same); 0 for MJPG.
    pub stride_bytes: u32,
    /// The bytes, shared and pooled.
    pub pixels: PixelBuffer,
    /// Middle of the exposure of the image's centre row, on the session's clock.
    pub captured: Timestamp,
    /// When this process got the frame.
    pub arrived: Timestamp,
    /// Counts up by one a frame as the device numbers them; a gap is a dropped frame.
    pub sequence: u64,
    /// Exposure time, if the device tells.
    pub exposure: Option<Duration>,
    /// Gain factor (1 = none), if the device tells.
    pub gain: Option<f32>,
    /// Metres a count for [`PixelFormat::Z16`], else `None`.
    pub depth_unit_m: Option<f64>,
}

/// A depth image: a [`Frame`] of format Z16 whose unit is known.
#[derive(Clone, Debug)]
pub struct DepthFrame {
    frame: Frame,
    unit_m: f64,
}
