//! Foxglove's names of pixel layouts.

use crate::pixel_format::PixelFormat;

/// The `encoding` of a `foxglove.RawImage` with these bytes, `None` for MJPG, which is a `foxglove.CompressedImage`.
///
/// All but `32FC3` are shown by Foxglove's viewer as they are; of floating point it knows one channel only. Depth is
/// `16UC1` and linear RGB `32FC3`, as ROS has them; the unit of depth and the order of the channels are in our own
/// message.
pub(super) fn name(format: PixelFormat) -> Option<&'static str> {
    Some(match format {
        PixelFormat::Yuyv => "yuyv",
        PixelFormat::Uyvy => "uyvy",
        PixelFormat::Nv12 => "nv12",
        PixelFormat::Grey => "mono8",
        PixelFormat::Y16 => "mono16",
        PixelFormat::Z16 => "16UC1",
        PixelFormat::Rgb24 => "rgb8",
        PixelFormat::RgbF32 => "32FC3",
        PixelFormat::Mjpg => return None,
    })
}
