//! Recordings: MCAP files (<https://mcap.dev>) with Foxglove's schemas, which its viewer shows as they are.
//!
//! For each stream NAME:
//!
//! | topic | schema | what |
//! | --- | --- | --- |
//! | `/NAME/image` | `foxglove.CompressedImage` or `foxglove.RawImage` | the bytes as they came from the camera: MJPG not decoded, strides kept, depth as `16UC1`, linear RGB as `32FC3` (which the viewer cannot show) |
//! | `/NAME/frame_info` | `coshade.FrameInfo` | all else that is known of the frame; written before the image, with the same log time and sequence |
//! | `/NAME/calibration` | `foxglove.CameraCalibration` | the lens, for viewers |
//! | `/tf` | `foxglove.FrameTransform` | poses |
//!
//! The complete calibration file is the attachment `NAME/calibration.toml`. The metadata record `coshade.session` holds
//! software, session file and the wall clock at the start, `coshade.stream_end` what was written and dropped. Log and
//! publish time are the capture stamp on the session's clock, not the time of day.
//!
//! [`Recorder`] writes in a thread of its own; [`Reader`] reads recordings, also cut and damaged ones, those of other
//! programs, and ROS 1 bags; [`describe`](describe()) says what is in one.

mod calibration;
pub(crate) mod compression;
pub(crate) mod container;
mod describe;
pub(crate) mod error;
mod foreign;
mod frame_info;
mod image_encoding;
mod image_message;
mod intrinsics;
mod mcap;
mod protobuf;
mod reader;
mod recorder;
mod stream;
mod transform;
pub(crate) mod wire;
mod writer;

pub use container::Damage;
pub use describe::{Description, StreamDescription, TopicDescription, describe};
pub use error::RecordingError;
pub use intrinsics::RecordedIntrinsics;
pub use reader::{Reader, RecordedFrame};
pub use recorder::Recorder;
pub use stream::RecordedStream;
pub use transform::RecordedTransform;
pub use writer::{Compression, RecordingOptions, RecordingWriter, StreamCounts, StreamId, check_name};
