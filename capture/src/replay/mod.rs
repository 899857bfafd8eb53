//! `replay:`: a recording as a camera.
//!
//! `replay:FILE#STREAM?rate=1&loop=true&start_s=2.5`. FILE is an MCAP file or a ROS 1 bag, STREAM a stream's name or
//! topic (may be left out if there is only one). `rate` is the pace (1 = real time, `max` = as fast as frames are asked
//! for). Cameras of the same file share one [`Playback`]: they stay in step, and pausing or seeking moves all.
//!
//! A frame comes when the clock has reached its log time. None is skipped: who asks late gets frames late, and without
//! waiting until they have caught up.
//!
//! Frames have the stamps, sequence, exposure and gain they were recorded with, in the first pass exactly. In the n-th
//! pass of a loop, and after seeking backwards, capture and arrival stamps are later by n times
//! [`Playback::duration`], the same for all cameras, and sequence numbers go on counting: neither ever turns back.

mod camera;
mod options;
mod playback;
mod registry;

pub use camera::ReplayCamera;
pub use options::{Rate, ReplayOptions, ReplaySource};
pub use playback::Playback;

use crate::camera::{Camera, CaptureError};
use crate::recording::{Reader, RecordingError};

/// Nanoseconds between frames if there are too few to tell.
const DEFAULT_INTERVAL_NS: u64 = 33_333_333;

/// Frames that are looked at to find the rate.
const PROBED_FRAMES: usize = 10;

/// Opens what follows `replay:` in the name of a source.
///
/// # Errors
/// As [`ReplayCamera::open`].
pub fn open(rest: &str) -> Result<Box<dyn Camera>, CaptureError> {
    Ok(Box::new(ReplayCamera::open(&format!("replay:{rest}"))?))
}

/// Mean time between the first frames of the first stream that has any; the reader is then at its start again.
fn interval_ns(reader: &mut Reader) -> Result<u64, RecordingError> {
    let mut times = Vec::new();
    let mut stream = None;
    reader.seek(crate::Timestamp::default());
    for _ in 0..10 * PROBED_FRAMES {
        match reader.next_frame() {
            Ok(Some(frame)) if *stream.get_or_insert(frame.stream) == frame.stream => {
                times.push(frame.logged.as_ns())
            }
            Ok(Some(_)) | Err(RecordingError::Damaged { .. } | RecordingError::Unsupported { .. }) => {}
            Ok(None) => break,
            Err(error) => return Err(error),
        }
        if times.len() > PROBED_FRAMES {
            break;
        }
    }
    reader.seek(crate::Timestamp::default());
    let span = times.first().zip(times.last()).map_or(0, |(first, last)| last.saturating_sub(*first));
    let intervals = times.len().saturating_sub(1) as u64;
    Ok(span.checked_div(intervals).filter(|&interval| interval > 0).unwrap_or(DEFAULT_INTERVAL_NS))
}
