//! Says what is in a recording, for `coshade info`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::container::{Container, Damage};
use super::error::RecordingError;
use super::frame_info::format_name;
use super::intrinsics::RecordedIntrinsics;
use super::reader::{Reader, RecordedFrame};
use super::writer::{SESSION_RECORD, STREAM_END_RECORD};

/// Damage beyond this many places is only counted.
const MAX_DAMAGE_LISTED: usize = 100;

/// What is in a recording.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Description {
    /// The file.
    #[serde(serialize_with = "crate::lossy_path")]
    pub path: PathBuf,
    /// `mcap` or `rosbag`.
    pub container: String,
    /// The program that wrote it, empty if it does not say.
    pub library: String,
    /// Size of the file in bytes.
    pub size_bytes: u64,
    /// Whether the file's own index was used; without it the recording was not finished, or is damaged.
    pub indexed: bool,
    /// Log time of the first image in nanoseconds, `None` without images.
    pub start_ns: Option<u64>,
    /// Log time of the last image in nanoseconds.
    pub end_ns: Option<u64>,
    /// From the first image to the last, in seconds.
    pub duration_s: f64,
    /// The image streams.
    pub streams: Vec<StreamDescription>,
    /// All topics.
    pub topics: Vec<TopicDescription>,
    /// Names of the attached files.
    pub attachments: Vec<String>,
    /// Software, session file and wall clock at the start, if we recorded it.
    pub session: BTreeMap<String, String>,
    /// What cannot be read, in the order it was found; 100 places at most.
    pub damage: Vec<Damage>,
    /// Number of damaged places.
    pub damage_count: u64,
}

/// One image stream of a recording.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct StreamDescription {
    /// Its name, as in `replay:file#name`.
    pub name: String,
    /// The topic of its images.
    pub topic: String,
    /// Type of the messages.
    pub schema: String,
    /// Layout of the pixels, of the first frame; empty if none could be read.
    pub format: String,
    /// Width of the first frame in pixels.
    pub width_px: u32,
    /// Height of the first frame in pixels.
    pub height_px: u32,
    /// Frames that could be read.
    pub frames: u64,
    /// Log time of the first frame in nanoseconds.
    pub start_ns: Option<u64>,
    /// Log time of the last frame in nanoseconds.
    pub end_ns: Option<u64>,
    /// Frames a second as measured: intervals over the time they take. `None` for fewer than two frames.
    pub frames_per_second: Option<f64>,
    /// The longest time between two frames in seconds.
    pub longest_interval_s: f64,
    /// Frames missing by the device's numbers, dropped by camera or recorder.
    pub missing: u64,
    /// Frames that the recorder had to drop, `None` if the recording does not say.
    pub dropped: Option<u64>,
    /// Metres a count of a depth stream.
    pub depth_unit_m: Option<f64>,
    /// Whether a calibration was recorded with it.
    pub calibration: bool,
    /// The lens as recorded for viewers, also by other programs.
    pub intrinsics: Option<RecordedIntrinsics>,
    /// Whether exposure times were recorded.
    pub exposure: bool,
    /// Why frames could not be read, the first reason; `None` if all could.
    pub problem: Option<String>,
    #[serde(skip)]
    last_sequence: Option<u64>,
}

/// One topic of a recording.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct TopicDescription {
    /// The topic.
    pub topic: String,
    /// Type of the messages.
    pub schema: String,
    /// Messages that could be read.
    pub messages: u64,
}

/// Reads a recording from the first byte to the last and says what is in it.
///
/// # Errors
/// As [`Reader::open`]; [`RecordingError::Read`] if the disk fails. Damage is part of the description.
pub fn describe(path: impl AsRef<Path>) -> Result<Description, RecordingError> {
    let mut reader = Reader::open(path)?;
    let mut streams = initial_streams(&reader);
    for (stream, intrinsics) in streams.iter_mut().zip(reader.intrinsics()?) {
        stream.intrinsics = intrinsics;
    }
    let mut damage = reader.damage().to_vec();
    let mut damage_count = damage.len() as u64;
    loop {
        match reader.next_frame() {
            Ok(Some(recorded)) => {
                if let Some(stream) = streams.get_mut(recorded.stream) {
                    stream.count(&recorded);
                }
            }
            Ok(None) => break,
            Err(RecordingError::Unsupported { topic, what, .. }) => {
                let stream = streams.iter_mut().find(|stream| stream.topic == topic);
                stream.map(|stream| stream.problem.get_or_insert(what));
            }
            Err(RecordingError::Damaged { offset, what, .. }) => {
                damage_count += 1;
                if damage.len() < MAX_DAMAGE_LISTED {
                    let lost_bytes = block_length(reader.container(), offset);
                    damage.push(Damage { offset, lost_bytes, what });
                }
            }
            Err(error) => return Err(error),
        }
    }
    let topics = topics(&mut reader);
    Ok(assemble(reader.container(), streams, topics, damage, damage_count))
}

fn initial_streams(reader: &Reader) -> Vec<StreamDescription> {
    let dropped = |name: &str| {
        let ends = reader.container().metadata().iter().filter(|(record, _)| record == STREAM_END_RECORD);
        let own = ends
            .map(|(_, entries)| entries)
            .find(|entries| entries.get("stream").is_some_and(|own| own == name));
        own.and_then(|entries| entries.get("dropped")?.parse().ok())
    };
    let describe = |stream: &super::RecordedStream| StreamDescription {
        name: stream.name.clone(),
        topic: stream.topic.clone(),
        schema: stream.schema.clone(),
        calibration: stream.calibration_toml.is_some(),
        dropped: dropped(&stream.name),
        ..StreamDescription::default()
    };
    reader.streams().iter().map(describe).collect()
}

impl StreamDescription {
    fn count(&mut self, recorded: &RecordedFrame) {
        let RecordedFrame { frame, logged, dropped_before, .. } = recorded;
        if self.frames == 0 {
            self.format = format_name(frame.format).to_owned();
            (self.width_px, self.height_px) = (frame.width_px, frame.height_px);
            self.depth_unit_m = frame.depth_unit_m;
        }
        let now_ns = logged.as_ns();
        if let Some(last_ns) = self.end_ns {
            self.longest_interval_s =
                self.longest_interval_s.max(now_ns.saturating_sub(last_ns) as f64 * 1e-9);
        }
        if let Some(last) = self.last_sequence {
            self.missing += frame.sequence.saturating_sub(last).saturating_sub(1);
        }
        // Without an end record the last frame knows how many were dropped up to it.
        if *dropped_before > 0 {
            self.dropped = Some(self.dropped.unwrap_or(0).max(*dropped_before));
        }
        self.last_sequence = Some(frame.sequence);
        self.frames += 1;
        self.exposure |= frame.exposure.is_some();
        self.start_ns.get_or_insert(now_ns);
        self.end_ns = Some(now_ns);
        let span_s = now_ns.saturating_sub(self.start_ns.unwrap_or(now_ns)) as f64 * 1e-9;
        self.frames_per_second = (span_s > 0.0).then(|| (self.frames - 1) as f64 / span_s);
    }
}

fn block_length(container: &dyn Container, offset: u64) -> u64 {
    container.blocks().iter().find(|block| block.offset == offset).map_or(0, |block| block.length)
}

fn topics(reader: &mut Reader) -> Vec<TopicDescription> {
    let counts = reader.message_counts().clone();
    let describe = |(id, channel): (&u32, &super::container::Channel)| TopicDescription {
        topic: channel.topic.clone(),
        schema: channel.schema.clone(),
        messages: counts.get(id).copied().unwrap_or(0),
    };
    reader.container().channels().iter().map(describe).collect()
}

fn assemble(
    container: &dyn Container,
    streams: Vec<StreamDescription>,
    topics: Vec<TopicDescription>,
    damage: Vec<Damage>,
    damage_count: u64,
) -> Description {
    let start_ns = streams.iter().filter_map(|stream| stream.start_ns).min();
    let end_ns = streams.iter().filter_map(|stream| stream.end_ns).max();
    let span_ns = start_ns.zip(end_ns).map_or(0, |(start, end)| end.saturating_sub(start));
    let session = container.metadata().iter().find(|(name, _)| name == SESSION_RECORD);
    Description {
        path: container.path().to_owned(),
        container: container.kind().to_owned(),
        library: container.library().to_owned(),
        size_bytes: container.size_bytes(),
        indexed: container.indexed(),
        start_ns,
        end_ns,
        duration_s: span_ns as f64 * 1e-9,
        streams,
        topics,
        attachments: container.attachments().iter().map(|file| file.name.clone()).collect(),
        session: session.map(|(_, entries)| entries.clone()).unwrap_or_default(),
        damage,
        damage_count,
    }
}
