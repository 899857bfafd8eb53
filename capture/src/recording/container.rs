//! What MCAP files and ROS bags have in common: channels, and blocks of messages that are loaded one at a time.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::error::RecordingError;

/// A part of a file that cannot be read.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Damage {
    /// Where it begins, in bytes from the start of the file.
    pub offset: u64,
    /// How many bytes of the file are lost with it; 0 if none of its messages are.
    pub lost_bytes: u64,
    /// What is wrong.
    pub what: String,
}

/// How the messages of a channel are serialized.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Encoding {
    Protobuf,
    Ros1,
    Cdr,
    Other(String),
}

impl Encoding {
    pub(crate) fn from_name(name: &str) -> Self {
        match name {
            "protobuf" => Self::Protobuf,
            "ros1" => Self::Ros1,
            "cdr" => Self::Cdr,
            other => Self::Other(other.to_owned()),
        }
    }
}

/// A topic with the type of its messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Channel {
    pub(crate) topic: String,
    pub(crate) schema: String,
    pub(crate) encoding: Encoding,
    pub(crate) metadata: BTreeMap<String, String>,
}

/// A stretch of the file with messages.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Block {
    /// Of the record (or first record) in the file.
    pub(crate) offset: u64,
    /// Including the record's own header.
    pub(crate) length: u64,
    pub(crate) start_ns: u64,
    pub(crate) end_ns: u64,
    pub(crate) kind: BlockKind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum BlockKind {
    /// A chunk record.
    Chunk,
    /// A chunk record that the file ends within.
    CutChunk,
    /// Message records that are in no chunk.
    Plain,
}

/// Where a message lies in the loaded block.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Message {
    pub(crate) channel: u32,
    pub(crate) sequence: u32,
    pub(crate) log_time_ns: u64,
    pub(crate) data: Range<usize>,
}

/// The unpacked bytes of one block and its messages; used again for the next block.
#[derive(Debug, Default)]
pub(crate) struct Loaded {
    pub(crate) bytes: Vec<u8>,
    pub(crate) packed: Vec<u8>,
    pub(crate) messages: Vec<Message>,
}

impl Loaded {
    pub(crate) fn data(&self, message: &Message) -> &[u8] {
        self.bytes.get(message.data.clone()).unwrap_or(&[])
    }
}

/// A file of messages, opened: its structure is known, its messages are not in memory.
pub(crate) trait Container: Send {
    fn path(&self) -> &Path;
    fn kind(&self) -> &'static str;
    /// The program that wrote the file, empty if it does not say.
    fn library(&self) -> &str;
    /// Whether the file's own index was there and used.
    fn indexed(&self) -> bool;
    fn size_bytes(&self) -> u64;
    fn channels(&self) -> &BTreeMap<u32, Channel>;
    fn blocks(&self) -> &[Block];
    /// Damage found on opening.
    fn damage(&self) -> &[Damage];
    /// Named maps of text, in the order of the file.
    fn metadata(&self) -> &[(String, BTreeMap<String, String>)];
    /// Attached files.
    fn attachments(&self) -> &[Attachment];
    /// Reads the messages of a block.
    ///
    /// # Errors
    /// [`RecordingError::Read`], or [`RecordingError::Damaged`] with nothing loaded. Of a block that is cut, what is
    /// before the cut is loaded without an error, for the cut is in [`damage`](Self::damage) already.
    fn load(&mut self, block: usize, into: &mut Loaded) -> Result<(), RecordingError>;
}

/// A file within the recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Attachment {
    pub(crate) name: String,
    pub(crate) media_type: String,
    pub(crate) data: Vec<u8>,
}

/// A file that is read in pieces whose lengths are checked against it.
#[derive(Debug)]
pub(crate) struct Source {
    path: PathBuf,
    file: File,
    len: u64,
}

impl Source {
    pub(crate) fn open(path: &Path) -> Result<Self, RecordingError> {
        let read_error = |source| RecordingError::Read { path: path.to_owned(), source };
        // Opening a pipe would wait for somebody to write into it, so its kind is looked at first.
        if !std::fs::metadata(path).map_err(read_error)?.is_file() {
            let found = "it is no regular file".to_owned();
            return Err(RecordingError::Format { path: path.to_owned(), found });
        }
        let file = File::open(path).map_err(read_error)?;
        let len = file.metadata().map_err(read_error)?.len();
        Ok(Self { path: path.to_owned(), file, len })
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    pub(crate) fn len(&self) -> u64 {
        self.len
    }

    /// Reads up to `len` bytes from `offset` into `into` (cleared first); fewer only at the end of the file.
    pub(crate) fn read(&mut self, offset: u64, len: u64, into: &mut Vec<u8>) -> Result<(), RecordingError> {
        into.clear();
        let len = len.min(self.len.saturating_sub(offset));
        self.try_read(offset, len, into)
            .map_err(|source| RecordingError::Read { path: self.path.clone(), source })
    }

    fn try_read(&mut self, offset: u64, len: u64, into: &mut Vec<u8>) -> io::Result<()> {
        self.file.seek(SeekFrom::Start(offset))?;
        into.reserve(usize::try_from(len).unwrap_or(0));
        (&mut self.file).take(len).read_to_end(into)?;
        if (into.len() as u64) < len {
            return Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the file has become shorter"));
        }
        Ok(())
    }

    pub(crate) fn damaged(&self, offset: u64, what: impl Into<String>) -> RecordingError {
        RecordingError::Damaged { path: self.path.clone(), offset, what: what.into() }
    }
}
