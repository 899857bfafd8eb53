//! Reads the frames of a recording, in the order they were recorded.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::path::Path;

use prost::Message as _;

use super::container::{Block, Container, Damage, Loaded, Message, Source};
use super::error::RecordingError;
use super::foreign;
use super::frame_info::FrameInfo;
use super::image_message;
use super::mcap::{self, McapFile};
use super::stream::{self, RecordedStream, Role};
use crate::clock::Timestamp;
use crate::frame::Frame;
use crate::pool::{FramePool, PixelBuffer};
use crate::rosbag::{self, BagFile};

/// Pixel buffers of a reader that are used again; frames beyond them get memory of their own.
const POOLED_FRAMES: usize = 8;

/// A frame of a recording.
#[derive(Clone, Debug)]
pub struct RecordedFrame {
    /// Which of [`Reader::streams`].
    pub stream: usize,
    /// When it was logged: the capture stamp for our own recordings. Order and pace of a replay go by it.
    pub logged: Timestamp,
    /// Frames of this stream that the recorder had to drop up to this one.
    pub dropped_before: u64,
    /// The frame.
    pub frame: Frame,
}

/// An opened recording: an MCAP file or a ROS 1 bag.
///
/// One chunk at a time is in memory. A damaged chunk is reported once and skipped.
pub struct Reader {
    container: Box<dyn Container>,
    streams: Vec<RecordedStream>,
    roles: BTreeMap<u32, Role>,
    wanted: Vec<bool>,
    pool: FramePool,
    loaded: Loaded,
    next_block: usize,
    next_message: usize,
    skip_before_ns: u64,
    /// By stream: the description that the next image belongs to.
    pending: Vec<Option<(u64, u32, FrameInfo)>>,
    /// By stream: number of the next image of a stream without numbers.
    numbers: Vec<u64>,
    /// By channel: messages read since the last seek.
    counts: BTreeMap<u32, u64>,
}

impl Reader {
    /// Opens a recording. Structure and index are read, no frames.
    ///
    /// # Errors
    /// [`RecordingError::Read`], or [`RecordingError::Format`] for a file that is no recording. Damage within the file
    /// is no error here: see [`damage`](Self::damage).
    pub fn open(path: impl AsRef<Path>) -> Result<Self, RecordingError> {
        let container = open_container(path.as_ref())?;
        let mut reader = Self {
            container,
            streams: Vec::new(),
            roles: BTreeMap::new(),
            wanted: Vec::new(),
            pool: FramePool::new(POOLED_FRAMES, 0),
            loaded: Loaded::default(),
            next_block: 0,
            next_message: 0,
            skip_before_ns: 0,
            pending: Vec::new(),
            numbers: Vec::new(),
            counts: BTreeMap::new(),
        };
        (reader.streams, reader.roles) = stream::find(reader.container.as_ref());
        reader.wanted = vec![true; reader.streams.len()];
        reader.pending = vec![None; reader.streams.len()];
        reader.numbers = vec![0; reader.streams.len()];
        reader.find_depth_units()?;
        Ok(reader)
    }

    /// The image streams.
    pub fn streams(&self) -> &[RecordedStream] {
        &self.streams
    }

    /// The index of the stream `name` (a name or a topic); without a name that of the only stream.
    ///
    /// # Errors
    /// [`RecordingError::Stream`], which lists the streams there are.
    pub fn stream(&self, name: Option<&str>) -> Result<usize, RecordingError> {
        let problem = match name {
            Some(name) => {
                let is_wanted = |stream: &RecordedStream| {
                    stream.name == name || stream.topic == name || stream.name == name.trim_start_matches('/')
                };
                match self.streams.iter().position(is_wanted) {
                    Some(index) => return Ok(index),
                    None => format!("has no image stream {name:?}"),
                }
            }
            None if self.streams.len() == 1 => return Ok(0),
            None if self.streams.is_empty() => "has no images that can be read".to_owned(),
            None => "has several image streams, name one behind '#'".to_owned(),
        };
        let streams = self.streams.iter().map(|stream| stream.name.clone()).collect();
        Err(RecordingError::Stream { path: self.container.path().to_owned(), problem, streams })
    }

    /// Damage found on opening. Damage within chunks shows when they are read.
    pub fn damage(&self) -> &[Damage] {
        self.container.damage()
    }

    /// The file.
    pub fn path(&self) -> &Path {
        self.container.path()
    }

    pub(super) fn container(&self) -> &dyn Container {
        self.container.as_ref()
    }

    /// Messages read of each channel since the last seek.
    pub(super) fn message_counts(&self) -> &BTreeMap<u32, u64> {
        &self.counts
    }

    /// From now on delivers only frames of these streams.
    pub fn select(&mut self, streams: &[usize]) {
        self.wanted = (0..self.streams.len()).map(|index| streams.contains(&index)).collect();
    }

    /// Goes to the first frame that was logged at `to` or later.
    ///
    /// Images of other programs that have no numbers are numbered from here.
    pub fn seek(&mut self, to: Timestamp) {
        self.skip_before_ns = to.as_ns();
        self.next_block = 0;
        self.forget_block();
        self.pending.fill(None);
        self.numbers.fill(0);
        self.counts.clear();
    }

    fn forget_block(&mut self) {
        self.loaded.messages.clear();
        self.next_message = 0;
    }

    /// The next frame, `None` behind the last one.
    ///
    /// # Errors
    /// [`RecordingError::Damaged`] once for each damaged chunk or frame and [`RecordingError::Unsupported`] once for each
    /// frame of an unknown kind: the next call goes on behind it. [`RecordingError::Read`] if the disk fails.
    pub fn next_frame(&mut self) -> Result<Option<RecordedFrame>, RecordingError> {
        loop {
            let Some((block, message)) = self.next_message()? else { return Ok(None) };
            if let Some(frame) = self.frame_of(block, &message)? {
                return Ok(Some(frame));
            }
        }
    }

    /// The next message of any channel, with the index of its block.
    fn next_message(&mut self) -> Result<Option<(usize, Message)>, RecordingError> {
        loop {
            if let Some(message) = self.loaded.messages.get(self.next_message) {
                self.next_message += 1;
                *self.counts.entry(message.channel).or_default() += 1;
                return Ok(Some((self.next_block - 1, message.clone())));
            }
            let Some(block) = self.container.blocks().get(self.next_block) else { return Ok(None) };
            let skip = block.end_ns < self.skip_before_ns;
            self.next_block += 1;
            self.forget_block();
            if !skip {
                self.container.load(self.next_block - 1, &mut self.loaded)?;
            }
        }
    }

    fn frame_of(&mut self, block: usize, message: &Message) -> Result<Option<RecordedFrame>, RecordingError> {
        let (stream, result) = match self.roles.get(&message.channel) {
            None => return Ok(None),
            Some(Role::Info { stream }) => {
                let stream = *stream;
                let info = FrameInfo::decode(self.loaded.data(message));
                if let (Ok(info), Some(pending)) = (info, self.pending.get_mut(stream)) {
                    *pending = Some((message.log_time_ns, message.sequence, info));
                }
                return Ok(None);
            }
            Some(Role::Image { stream, .. }) => {
                let stream = *stream;
                let pending = self.pending.get_mut(stream).and_then(Option::take);
                let number = self.number(stream);
                let is_wanted = self.wanted.get(stream).copied().unwrap_or(false);
                if !is_wanted || message.log_time_ns < self.skip_before_ns {
                    return Ok(None);
                }
                (stream, self.image(message, pending, number))
            }
        };
        match result {
            Ok((frame, dropped_before)) => {
                let logged = Timestamp::from_ns(message.log_time_ns);
                Ok(Some(RecordedFrame { stream, logged, dropped_before, frame }))
            }
            Err(what) => Err(self.bad_image(block, stream, what)),
        }
    }

    /// Counts the images of a stream.
    fn number(&mut self, stream: usize) -> u64 {
        let Some(next) = self.numbers.get_mut(stream) else { return 0 };
        *next += 1;
        *next - 1
    }

    fn bad_image(&self, block: usize, stream: usize, what: BadImage) -> RecordingError {
        let path = self.container.path().to_owned();
        let topic = self.streams.get(stream).map_or_else(String::new, |stream| stream.topic.clone());
        match what {
            BadImage::Damaged(what) => {
                let offset = self.container.blocks().get(block).map_or(0, |block| block.offset);
                RecordingError::Damaged { path, offset, what: format!("an image of {topic}: {what}") }
            }
            BadImage::Unsupported(what) => RecordingError::Unsupported { path, topic, what },
        }
    }

    fn image(
        &self,
        message: &Message,
        pending: Option<(u64, u32, FrameInfo)>,
        number: u64,
    ) -> Result<(Frame, u64), BadImage> {
        let Some(Role::Image { stream, kind, encoding, foreign }) = self.roles.get(&message.channel) else {
            return Err(BadImage::Damaged("its channel is not known".into()));
        };
        let data = self.loaded.data(message);
        let malformed = || BadImage::Damaged("the message is malformed".into());
        let image = image_message::parse(encoding, *kind, data).ok_or_else(malformed)?;
        if !self.streams.get(*stream).is_some_and(|stream| stream.complete) {
            let pixels = |len: usize, fill: &mut dyn FnMut(&mut [u8])| self.buffer(len, fill);
            let frame = foreign::frame(&image, *kind, *foreign, message.log_time_ns, number, pixels);
            return Ok((frame.map_err(BadImage::Unsupported)?, 0));
        }
        let info = pending
            .filter(|(time, sequence, _)| (*time, *sequence) == (message.log_time_ns, message.sequence));
        let (_, _, info) =
            info.ok_or_else(|| BadImage::Damaged("the description of the frame is missing".into()))?;
        let pixels = self.buffer(image.data.len(), &mut |out| out.copy_from_slice(image.data));
        Ok((info.frame(pixels).map_err(BadImage::Damaged)?, info.dropped_before))
    }

    fn buffer(&self, len: usize, fill: &mut dyn FnMut(&mut [u8])) -> PixelBuffer {
        // A reader must not lose frames because a caller keeps many: beyond the pool there is the heap.
        if self.pool.available() > 0
            && let Some(mut buffer) = self.pool.acquire(len)
        {
            fill(&mut buffer);
            return buffer.freeze();
        }
        let mut bytes = vec![0; len];
        fill(&mut bytes);
        bytes.into()
    }

    /// First and last log time of the images, `None` without any that can be read.
    ///
    /// # Errors
    /// [`RecordingError::Read`] if the disk fails.
    pub fn span(&mut self) -> Result<Option<(Timestamp, Timestamp)>, RecordingError> {
        // Messages stand in the order of their arrival: what was taken first need not be in the first block.
        let (mut first, mut last) = (u64::MAX, None);
        let times = |block: &Block| (block.start_ns, block.end_ns);
        let blocks: Vec<(u64, u64)> = self.container.blocks().iter().map(times).collect();
        for (block, (start_ns, _)) in blocks.iter().enumerate() {
            if *start_ns < first {
                first = self.image_times(block)?.map_or(first, |(earliest, _)| first.min(earliest));
            }
        }
        for (block, (_, end_ns)) in blocks.iter().enumerate().rev() {
            if last.is_none_or(|last| *end_ns > last) {
                last = last.max(self.image_times(block)?.map(|(_, latest)| latest));
            }
        }
        self.seek(Timestamp::default());
        Ok(last.map(|last| (Timestamp::from_ns(first), Timestamp::from_ns(last))))
    }

    /// Smallest and largest log time of an image in a block, `None` if there is none.
    fn image_times(&mut self, block: usize) -> Result<Option<(u64, u64)>, RecordingError> {
        self.load_leniently(block)?;
        let is_image =
            |message: &&Message| matches!(self.roles.get(&message.channel), Some(Role::Image { .. }));
        let times = self.loaded.messages.iter().filter(is_image).map(|message| message.log_time_ns);
        Ok(times.clone().min().zip(times.max()))
    }

    /// Loads a block; of a damaged one nothing.
    fn load_leniently(&mut self, block: usize) -> Result<(), RecordingError> {
        self.forget_block();
        match self.container.load(block, &mut self.loaded) {
            Ok(()) | Err(RecordingError::Damaged { .. }) => Ok(()),
            Err(error) => Err(error),
        }
    }

    /// Calls `visit` with the data of every message of the topics that `is_wanted` says, until it returns false.
    pub(super) fn visit_topics(
        &mut self,
        is_wanted: impl Fn(&str, &str) -> bool,
        mut visit: impl FnMut(&str, Timestamp, &[u8]) -> bool,
    ) -> Result<(), RecordingError> {
        let channels = self.container.channels().clone();
        let wanted = |id: u32| channels.get(&id).filter(|channel| is_wanted(&channel.topic, &channel.schema));
        for block in 0..self.container.blocks().len() {
            self.load_leniently(block)?;
            for message in &self.loaded.messages {
                let Some(channel) = wanted(message.channel) else { continue };
                if !visit(&channel.topic, Timestamp::from_ns(message.log_time_ns), self.loaded.data(message))
                {
                    self.seek(Timestamp::default());
                    return Ok(());
                }
            }
        }
        self.seek(Timestamp::default());
        Ok(())
    }

    /// RealSense bags call depth `mono16` and keep its unit on a topic of its own.
    fn find_depth_units(&mut self) -> Result<(), RecordingError> {
        let topics: Vec<_> = self.streams.iter().map(|stream| unit_topic(&stream.topic)).collect();
        let mut missing = topics.iter().flatten().count();
        if missing == 0 {
            return Ok(());
        }
        let mut units = BTreeMap::new();
        let is_unit = |topic: &str, schema: &str| {
            schema == "std_msgs/Float32" && topics.iter().flatten().any(|unit| unit == topic)
        };
        self.visit_topics(is_unit, |topic, _, data| {
            if let Some(unit) = data.first_chunk().map(|bytes| f64::from(f32::from_le_bytes(*bytes))) {
                missing = missing.saturating_sub(usize::from(units.insert(topic.to_owned(), unit).is_none()));
            }
            missing > 0
        })?;
        for role in self.roles.values_mut() {
            let Role::Image { stream, foreign, .. } = role else { continue };
            let topic = topics.get(*stream).cloned().flatten();
            let unit = topic.map(|topic| units.get(&topic).copied().unwrap_or(foreign::ROS_DEPTH_UNIT_M));
            foreign.depth_unit_m = unit.filter(|unit| unit.is_finite() && *unit > 0.0);
        }
        Ok(())
    }
}

/// `/device_0/sensor_0/Depth_0/image/data` has its unit on `/device_0/sensor_0/option/Depth Units/value`.
fn unit_topic(topic: &str) -> Option<String> {
    let (sensor, rest) = topic.strip_suffix("/image/data")?.rsplit_once('/')?;
    rest.starts_with("Depth_").then(|| format!("{sensor}/option/Depth Units/value"))
}

enum BadImage {
    Damaged(String),
    Unsupported(String),
}

fn open_container(path: &Path) -> Result<Box<dyn Container>, RecordingError> {
    let source = Source::open(path)?;
    let mut magic = [0; 13];
    let read = File::open(path).and_then(|file| file.take(magic.len() as u64).read(&mut magic));
    let len = read.map_err(|source| RecordingError::Read { path: path.to_owned(), source })?;
    let start = magic.get(..len).unwrap_or(&[]);
    if start.starts_with(mcap::MAGIC) {
        return Ok(Box::new(McapFile::open(source)?));
    }
    if start.starts_with(rosbag::MAGIC) {
        return Ok(Box::new(BagFile::open(source)?));
    }
    let found = match start {
        [] => "the file is empty".to_owned(),
        _ if start.starts_with(b"#ROSBAG V") => "a ROS bag of another version".to_owned(),
        _ if mcap::MAGIC.starts_with(start) => format!("it ends after {len} bytes"),
        _ => format!("it begins with {:?}", String::from_utf8_lossy(start)),
    };
    Err(RecordingError::Format { path: path.to_owned(), found })
}
