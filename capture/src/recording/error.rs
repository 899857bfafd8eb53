//! What can go wrong with a recording, with the file, the place in it, and what to do.

use std::io;
use std::path::PathBuf;

use crate::frame::FrameError;

/// Why a recording could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The file exists and was not to be replaced.
    #[error("{}: exists already; choose another name, or allow it to be replaced", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// The file could not be created.
    #[error("{}: cannot be created: {source}; check that the folder exists and can be written to", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// Writing failed. What was written up to then can be read.
    #[error(
        "{}: writing failed: {reason}; the recording ends here, what it holds so far can be read. Free space on the \
         disk or record to another one",
        path.display()
    )]
    Write {
        /// The file.
        path: PathBuf,
        /// What the system said.
        reason: String,
    },
    /// The file could not be opened or read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The file is neither an MCAP nor a ROS 1 bag.
    #[error("{}: no recording: {found}; expected an MCAP file or a ROS 1 bag (version 2.0)", path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// What it is instead.
        found: String,
    },
    /// A part of the file is damaged; what lies behind it can still be read.
    #[error("{}: damaged at byte {offset}: {what}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where in the file.
        offset: u64,
        /// What is wrong there.
        what: String,
    },
    /// An image is stored in a way that is not supported.
    #[error("{}: topic {topic}: {what}", path.display())]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// The topic of the image.
        topic: String,
        /// What is not supported, and what is.
        what: String,
    },
    /// The stream asked for is not there, or none was asked for and there are several.
    #[error("{}: {problem}; it holds: {}", path.display(), if streams.is_empty() { "no images".to_owned() } else { streams.join(", ") })]
    Stream {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        problem: String,
        /// The streams there are.
        streams: Vec<String>,
    },
    /// A stream's name cannot be part of a topic and a source string.
    #[error("stream name {name:?}: {problem}")]
    Name {
        /// The name.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A frame that contradicts itself was to be recorded.
    #[error("stream {stream}: frame {sequence} is not recorded: {source}")]
    Frame {
        /// The stream.
        stream: String,
        /// The frame's number.
        sequence: u64,
        /// What is wrong with it.
        source: FrameError,
    },
    /// The recording ended before: because of an error that was reported then, or because it was finished.
    #[error("{}: the recording has ended", path.display())]
    Ended {
        /// The file.
        path: PathBuf,
    },
}
