//! Writes a recording: frames, calibrations, poses, and what is known of the session.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use coshade_lens::calibration::Calibration;
use foxglove::Encode;
use foxglove::bytes::Bytes;
use foxglove::messages::{CameraCalibration, CompressedImage, FrameTransform, RawImage};
use mcap::records::{MessageHeader, Metadata};
use prost::Message;

use super::error::RecordingError;
use super::frame_info::FrameInfo;
use super::stream::{RATE_KEY, STREAM_KEY, attachment_name};
use super::transform::RecordedTransform;
use super::{calibration, image_encoding};
use crate::clock::{self, Timestamp};
use crate::frame::Frame;
use crate::pixel_format::PixelFormat;

/// Name of the metadata record about the session.
pub(crate) const SESSION_RECORD: &str = "coshade.session";

/// Name of the metadata records at the end, one a stream.
pub(crate) const STREAM_END_RECORD: &str = "coshade.stream_end";

/// How chunks are compressed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Compression {
    /// Not at all: least CPU, largest files.
    None,
    /// Fast: 1.2 ms of CPU for a 640 × 480 depth frame, which shrinks to 0.39 of its size; uncompressed colour to 0.54
    /// (both of a RealSense D435). MJPG does not shrink, and costs little.
    #[default]
    Lz4,
    /// Smaller: 0.26 and 0.43 of the size for 1.4 times the CPU of lz4.
    Zstd,
}

/// How a recording is written.
#[derive(Clone, Debug)]
pub struct RecordingOptions {
    /// Replace a file that exists.
    pub overwrite: bool,
    /// How chunks are compressed.
    pub compression: Compression,
    /// A chunk is written to the file when it holds so many bytes. Higher values: fewer, larger writes.
    pub chunk_bytes: usize,
    /// A chunk is written to the file at the latest after this time. A crash loses no more than this.
    pub chunk_time: Duration,
    /// The text of the session file, kept in the recording.
    pub session: Option<String>,
}

impl Default for RecordingOptions {
    fn default() -> Self {
        Self {
            overwrite: false,
            compression: Compression::default(),
            chunk_bytes: 4 << 20,
            chunk_time: Duration::from_millis(250),
            session: None,
        }
    }
}

/// A stream of a recording that is being written.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StreamId(pub(super) usize);

/// What was recorded of one stream.
#[derive(Clone, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct StreamCounts {
    /// The stream's name.
    pub name: String,
    /// Frames in the file.
    pub written: u64,
    /// Frames the recorder had to drop.
    pub dropped: u64,
}

struct Stream {
    counts: StreamCounts,
    metadata: BTreeMap<String, String>,
    info_channel: u16,
    raw_channel: Option<u16>,
    jpeg_channel: Option<u16>,
    /// Messages of this stream: MCAP's own numbers, which pair an image with its description.
    messages: u32,
}

/// Writes a recording, in the caller's thread. See [`Recorder`](super::Recorder) for one that never blocks.
pub struct RecordingWriter {
    path: PathBuf,
    file: mcap::Writer<BufWriter<File>>,
    options: RecordingOptions,
    streams: Vec<Stream>,
    transform_channel: Option<u16>,
    transforms: u32,
    scratch: Vec<u8>,
    chunk_opened: Option<Timestamp>,
    chunk_bytes: usize,
}

/// Pixels as `Bytes` wants to own them.
struct Shared(crate::pool::PixelBuffer);

impl AsRef<[u8]> for Shared {
    fn as_ref(&self) -> &[u8] {
        &self.0
    }
}

impl RecordingWriter {
    /// Begins a recording in the file `path` itself, so that a crash leaves what was written.
    ///
    /// # Errors
    /// [`RecordingError::Exists`], [`RecordingError::Create`] or [`RecordingError::Write`].
    pub fn create(path: impl AsRef<Path>, options: RecordingOptions) -> Result<Self, RecordingError> {
        let path = path.as_ref().to_owned();
        let file = create_file(&path, options.overwrite)?;
        let write_error =
            |error: mcap::McapError| RecordingError::Write { path: path.clone(), reason: error.to_string() };
        let compression = match options.compression {
            Compression::None => None,
            Compression::Lz4 => Some(mcap::Compression::Lz4),
            Compression::Zstd => Some(mcap::Compression::Zstd),
        };
        let file = mcap::WriteOptions::new()
            .library(format!("coshade {}", env!("CARGO_PKG_VERSION")))
            .compression(compression)
            .compression_level(1)
            // No threads beside the recorder's own.
            .compression_threads(0)
            // Chunks end between frames, which only we can tell.
            .chunk_size(None)
            // Else chunks get their true length only when they are complete, and a crash leaves a wrong one.
            .disable_seeking(true)
            .create(BufWriter::new(file))
            .map_err(write_error)?;
        let mut writer = Self {
            path,
            file,
            options,
            streams: Vec::new(),
            transform_channel: None,
            transforms: 0,
            scratch: Vec::new(),
            chunk_opened: None,
            chunk_bytes: 0,
        };
        writer.write_session()?;
        Ok(writer)
    }

    fn write_session(&mut self) -> Result<(), RecordingError> {
        let wall_clock = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let mut metadata = BTreeMap::from([
            ("software".to_owned(), format!("coshade {}", env!("CARGO_PKG_VERSION"))),
            // The moment that both clocks were read: recorded stamps are of the session's clock.
            ("start_unix_ns".to_owned(), wall_clock.as_nanos().to_string()),
            ("start_session_ns".to_owned(), clock::now().as_ns().to_string()),
        ]);
        if let Some(session) = self.options.session.clone() {
            metadata.insert("session".to_owned(), session);
        }
        self.metadata(SESSION_RECORD, metadata)?;
        self.flush()
    }

    /// Adds a stream `name`, with its lens and sensor data and its nominal rate where they are known.
    ///
    /// # Errors
    /// [`RecordingError::Name`] for a name that is taken or cannot be part of a topic, or [`RecordingError::Write`].
    pub fn add_stream(
        &mut self,
        name: &str,
        calibration: Option<&Calibration>,
        frames_per_second: Option<f64>,
    ) -> Result<StreamId, RecordingError> {
        check_name(name)?;
        if self.streams.iter().any(|stream| stream.counts.name == name) {
            return Err(RecordingError::Name {
                name: name.to_owned(),
                problem: "there is a stream of this name already",
            });
        }
        let mut metadata = BTreeMap::from([(STREAM_KEY.to_owned(), name.to_owned())]);
        if let Some(rate) = frames_per_second {
            metadata.insert(RATE_KEY.to_owned(), rate.to_string());
        }
        let schema = FrameInfo::schema();
        let info_channel = self.channel(&schema, &format!("/{name}/frame_info"), &metadata)?;
        if let Some(calibration) = calibration {
            self.write_calibration(name, calibration, &metadata)?;
        }
        // A chunk of its own: damage to the first frames must not take the definitions with it.
        self.flush()?;
        let counts = StreamCounts { name: name.to_owned(), ..StreamCounts::default() };
        self.streams.push(Stream {
            counts,
            metadata,
            info_channel,
            raw_channel: None,
            jpeg_channel: None,
            messages: 0,
        });
        Ok(StreamId(self.streams.len() - 1))
    }

    fn write_calibration(
        &mut self,
        name: &str,
        calibration: &Calibration,
        metadata: &BTreeMap<String, String>,
    ) -> Result<(), RecordingError> {
        let now = clock::now();
        let message = calibration::message(name, calibration, now);
        let schema = schema_of::<CameraCalibration>();
        let channel = self.channel(&schema, &format!("/{name}/calibration"), metadata)?;
        self.message(channel, 0, now, &message)?;
        let attachment = mcap::Attachment {
            log_time: now.as_ns(),
            create_time: now.as_ns(),
            name: attachment_name(name),
            media_type: "application/toml".to_owned(),
            data: calibration::toml(calibration)
                .map_err(|reason| self.write_error(&reason))?
                .into_bytes()
                .into(),
        };
        let result = self.file.attach(&attachment);
        result.map_err(|error| self.write_error(&error))
    }

    /// Writes a frame; `dropped_before` counts the frames of the stream that had to be dropped up to now.
    ///
    /// # Errors
    /// [`RecordingError::Frame`] for a frame that contradicts itself (nothing is written), [`RecordingError::Write`].
    pub fn write(
        &mut self,
        stream: StreamId,
        frame: &Frame,
        dropped_before: u64,
    ) -> Result<(), RecordingError> {
        let ended = || RecordingError::Ended { path: self.path.clone() };
        let entry = self.streams.get_mut(stream.0).ok_or_else(ended)?;
        let name = entry.counts.name.clone();
        frame.check().map_err(|source| RecordingError::Frame {
            stream: name.clone(),
            sequence: frame.sequence,
            source,
        })?;
        entry.messages = entry.messages.wrapping_add(1);
        entry.counts.dropped = dropped_before;
        let (sequence, info_channel) = (entry.messages, entry.info_channel);
        let image_channel = self.image_channel(stream, &name, frame.format)?;
        self.message(info_channel, sequence, frame.captured, &FrameInfo::of(frame, dropped_before))?;
        let data = Bytes::from_owner(Shared(frame.pixels.clone()));
        let timestamp = Some(stamp(frame.captured));
        let frame_id = name;
        match image_encoding::name(frame.format) {
            None => {
                let image = CompressedImage { timestamp, frame_id, data, format: "jpeg".into() };
                self.message(image_channel, sequence, frame.captured, &image)?;
            }
            Some(encoding) => {
                let image = RawImage {
                    timestamp,
                    frame_id,
                    width: frame.width_px,
                    height: frame.height_px,
                    encoding: encoding.into(),
                    step: frame.stride_bytes,
                    data,
                };
                self.message(image_channel, sequence, frame.captured, &image)?;
            }
        }
        if let Some(stream) = self.streams.get_mut(stream.0) {
            stream.counts.written += 1;
        }
        self.flush_if_due()
    }

    fn image_channel(
        &mut self,
        stream: StreamId,
        name: &str,
        format: PixelFormat,
    ) -> Result<u16, RecordingError> {
        let ended = || RecordingError::Ended { path: self.path.clone() };
        let entry = self.streams.get(stream.0).ok_or_else(ended)?;
        let jpeg = format == PixelFormat::Mjpg;
        let (own, other) = match jpeg {
            true => (entry.jpeg_channel, entry.raw_channel),
            false => (entry.raw_channel, entry.jpeg_channel),
        };
        if let Some(channel) = own {
            return Ok(channel);
        }
        // A topic has one schema: a stream that changes between raw and JPEG gets a second topic.
        let suffix = match (other, jpeg) {
            (None, _) => "image",
            (Some(_), true) => "image_jpeg",
            (Some(_), false) => "image_raw",
        };
        let schema = if jpeg { schema_of::<CompressedImage>() } else { schema_of::<RawImage>() };
        let metadata = entry.metadata.clone();
        let channel = self.channel(&schema, &format!("/{name}/{suffix}"), &metadata)?;
        if let Some(entry) = self.streams.get_mut(stream.0) {
            *(if jpeg { &mut entry.jpeg_channel } else { &mut entry.raw_channel }) = Some(channel);
        }
        Ok(channel)
    }

    /// Writes a pose on the topic `/tf`.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn write_transform(&mut self, transform: &RecordedTransform) -> Result<(), RecordingError> {
        let channel = match self.transform_channel {
            Some(channel) => channel,
            None => self.channel(&schema_of::<FrameTransform>(), "/tf", &BTreeMap::new())?,
        };
        self.transform_channel = Some(channel);
        self.transforms = self.transforms.wrapping_add(1);
        self.message(channel, self.transforms, transform.stamp, &transform.message())?;
        self.flush_if_due()
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the chunk to the file if it is large or old enough.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn flush_if_due(&mut self) -> Result<(), RecordingError> {
        let Some(opened) = self.chunk_opened else { return Ok(()) };
        let old = clock::now().saturating_since(opened) >= self.options.chunk_time;
        if old || self.chunk_bytes >= self.options.chunk_bytes { self.flush() } else { Ok(()) }
    }

    /// When the chunk that is being filled must be written, `None` if there is none.
    pub(super) fn due(&self) -> Option<Timestamp> {
        self.chunk_opened.map(|opened| opened + self.options.chunk_time)
    }

    /// Writes what there is to the file now.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn flush(&mut self) -> Result<(), RecordingError> {
        self.chunk_opened = None;
        self.chunk_bytes = 0;
        let result = self.file.flush();
        result.map_err(|error| self.write_error(&error))
    }

    /// Writes the counts and the index and closes the file. `dropped`: frames dropped in all, by stream.
    ///
    /// # Errors
    /// [`RecordingError::Write`].
    pub fn finish(mut self, dropped: &[u64]) -> Result<Vec<StreamCounts>, RecordingError> {
        for (stream, &dropped) in self.streams.iter_mut().zip(dropped) {
            stream.counts.dropped = dropped;
        }
        let counts: Vec<_> = self.streams.iter().map(|stream| stream.counts.clone()).collect();
        for StreamCounts { name, written, dropped } in &counts {
            let entries = [
                ("stream", name.clone()),
                ("written", written.to_string()),
                ("dropped", dropped.to_string()),
            ];
            let entries = entries.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
            self.metadata(STREAM_END_RECORD, entries)?;
        }
        let result = self.file.finish();
        result.map_err(|error| self.write_error(&error))?;
        Ok(counts)
    }

    fn channel(
        &mut self,
        schema: &foxglove::Schema,
        topic: &str,
        metadata: &BTreeMap<String, String>,
    ) -> Result<u16, RecordingError> {
        let result = self
            .file
            .add_schema(&schema.name, &schema.encoding, &schema.data)
            .and_then(|id| self.file.add_channel(id, topic, "protobuf", metadata));
        result.map_err(|error| self.write_error(&error))
    }

    fn message(
        &mut self,
        channel_id: u16,
        sequence: u32,
        stamp: Timestamp,
        message: &impl Message,
    ) -> Result<(), RecordingError> {
        self.scratch.clear();
        message.encode(&mut self.scratch).map_err(|error| self.write_error(&error))?;
        let header =
            MessageHeader { channel_id, sequence, log_time: stamp.as_ns(), publish_time: stamp.as_ns() };
        let result = self.file.write_to_known_channel(&header, &self.scratch);
        result.map_err(|error| self.write_error(&error))?;
        self.chunk_bytes += self.scratch.len();
        self.chunk_opened.get_or_insert_with(clock::now);
        Ok(())
    }

    fn metadata(&mut self, name: &str, metadata: BTreeMap<String, String>) -> Result<(), RecordingError> {
        let result = self.file.write_metadata(&Metadata { name: name.to_owned(), metadata });
        result.map_err(|error| self.write_error(&error))
    }

    fn write_error(&self, reason: &dyn std::fmt::Display) -> RecordingError {
        RecordingError::Write { path: self.path.clone(), reason: reason.to_string() }
    }
}

fn create_file(path: &Path, overwrite: bool) -> Result<File, RecordingError> {
    let mut options = OpenOptions::new();
    options.write(true);
    match overwrite {
        true => options.create(true).truncate(true),
        false => options.create_new(true),
    };
    options.open(path).map_err(|source| match source.kind() {
        io::ErrorKind::AlreadyExists => RecordingError::Exists { path: path.to_owned() },
        _ => RecordingError::Create { path: path.to_owned(), source },
    })
}

/// Whether a stream may be called so.
///
/// # Errors
/// [`RecordingError::Name`], which says what is allowed.
pub fn check_name(name: &str) -> Result<(), RecordingError> {
    let allowed = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    // A name of dots only is a folder's, and exports put a stream's images into a folder of its name.
    let only_dots = name.chars().all(|c| c == '.');
    if only_dots || name.len() > 100 || !name.chars().all(allowed) {
        let problem = "use 1 to 100 letters, digits, '_', '-' and '.', not dots alone";
        return Err(RecordingError::Name { name: name.to_owned(), problem });
    }
    Ok(())
}

fn schema_of<T: Encode>() -> foxglove::Schema {
    T::get_schema().unwrap_or_else(|| foxglove::Schema::new("", "", &[][..]))
}

/// A stamp as Foxglove has it: seconds up to the year 2106 of a clock that begins in 1970, then it saturates. The exact
/// value is in [`FrameInfo`].
pub(super) fn stamp(stamp: Timestamp) -> foxglove::messages::Timestamp {
    const NS_PER_S: u64 = 1_000_000_000;
    let seconds = u32::try_from(stamp.as_ns() / NS_PER_S).unwrap_or(u32::MAX);
    foxglove::messages::Timestamp::new(seconds, (stamp.as_ns() % NS_PER_S) as u32)
}
