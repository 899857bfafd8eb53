//! Frames, clocks, mailboxes, and where frames come from and go to.
//!
//! A [`Frame`] is one image as the sensor delivered it: never resampled, its pixels shared and not copied. A
//! [`Camera`] is anything that delivers frames in time: a device, a folder of images, a recording, a simulated sensor.

pub mod camera;
pub mod clock;
pub mod control;
pub mod convert;
pub mod frame;
pub mod images;
pub mod latest;
pub mod pixel_format;
pub mod pool;
pub mod recording;
pub mod registry;
pub mod replay;
mod rosbag;

pub use camera::{Camera, CaptureError, StreamInfo};
pub use clock::Timestamp;
pub use control::{Control, ControlInfo, ControlReport, ControlValue};
pub use convert::{ChromaUpsampling, ConvertError, Converter};
pub use frame::{DepthFrame, Frame, FrameError};
pub use latest::{LatestError, LatestReceiver, LatestSender, latest};
pub use pixel_format::{ColorEncoding, PixelFormat, ResponseMismatch, YuvMatrix, YuvRange};
pub use pool::{FramePool, PixelBuffer, PixelBufferMut};
pub use registry::{SourceRegistry, open};

/// Any path as text, also where it is not UTF-8, which JSON could not hold.
fn lossy_path<S: serde::Serializer>(path: &std::path::Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&path.display())
}
