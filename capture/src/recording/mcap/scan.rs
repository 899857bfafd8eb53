//! Finds the records of an MCAP file without its index: after a crash, or in spite of damage.

use std::collections::BTreeSet;

use super::file::McapFile;
use super::record::{self, CHUNK_HEADER_BYTES, ChunkRecord, MessageRecord, PREFIX_BYTES, op};
use crate::recording::compression::Packing;
use crate::recording::container::{Block, BlockKind, Damage, Loaded, Source};
use crate::recording::error::RecordingError;

/// Messages outside of chunks are read in runs of about this many bytes.
const PLAIN_RUN_BYTES: u64 = 4 << 20;

/// Largest single record outside of chunks that is read.
const MAX_RECORD_BYTES: u64 = 256 << 20;

const WINDOW_BYTES: u64 = 1 << 20;

/// Walks over all records from the first one.
pub(super) fn scan(file: &mut McapFile) -> Result<(), RecordingError> {
    let mut at = record::MAGIC.len() as u64;
    let mut buffer = Vec::new();
    let mut walk = Walk::default();
    while at < file.source.len() {
        file.source.read(at, PREFIX_BYTES + CHUNK_HEADER_BYTES, &mut buffer)?;
        let step = match record::prefix(&buffer) {
            Some((opcode, len)) if is_known(opcode) => walk.record(file, at, opcode, len, &buffer)?,
            Some((opcode, _)) => Step::Lost(format!("there is no record of type {opcode:#04x}")),
            None => Step::Lost("the file ends within a record".into()),
        };
        match step {
            Step::To(next) => at = next,
            Step::End => {
                walk.learn(file)?;
                return Ok(());
            }
            Step::Lost(what) => {
                walk.distrust_index();
                at = recover(file, at, what)?;
            }
        }
    }
    walk.distrust_index();
    walk.learn(file)?;
    let what = "the file ends here: the recording was not finished".to_owned();
    if file.damage.last().is_none_or(|damage| damage.offset + damage.lost_bytes < at) {
        file.damage.push(Damage { offset: at, lost_bytes: 0, what });
    }
    Ok(())
}

fn is_known(opcode: u8) -> bool {
    (op::HEADER..=op::DATA_END).contains(&opcode) || opcode >= op::PRIVATE
}

enum Step {
    To(u64),
    End,
    Lost(String),
}

/// What is known between one record and the next.
#[derive(Default)]
struct Walk {
    /// The latest chunk, while it is not known whether its channels are.
    chunk: Option<usize>,
    indexed_channels: BTreeSet<u16>,
}

impl Walk {
    fn record(
        &mut self,
        file: &mut McapFile,
        at: u64,
        opcode: u8,
        len: u64,
        head: &[u8],
    ) -> Result<Step, RecordingError> {
        let end = at.checked_add(PREFIX_BYTES).and_then(|start| start.checked_add(len));
        let Some(end) = end.filter(|&end| end <= file.source.len()) else {
            return Ok(Step::Lost("the file ends within a record".into()));
        };
        if opcode == op::CHUNK {
            self.learn(file)?;
            return Ok(match ChunkRecord::parse(content(head)) {
                Some(chunk) if chunk.header_bytes.checked_add(chunk.packed_bytes) == Some(len) => {
                    let Block { offset, length, .. } =
                        push_chunk(file, at, end - at, &chunk, BlockKind::Chunk);
                    self.chunk = Some(file.blocks.len() - 1);
                    Step::To(offset + length)
                }
                _ => Step::Lost("a chunk's header contradicts itself".into()),
            });
        }
        if opcode == op::MESSAGE_INDEX {
            self.indexed_channels.extend(record::message_index_channel(content(head)));
            return Ok(Step::To(end));
        }
        if matches!(opcode, op::DATA_END | op::FOOTER) {
            return Ok(Step::End);
        }
        if matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return plain(file, at, end, opcode, head);
        }
        file.other_record(at, end - at)?;
        Ok(Step::To(end))
    }

    /// The latest chunk may have more channels than the index records that were read say.
    fn distrust_index(&mut self) {
        self.indexed_channels.clear();
    }

    /// Channels are defined within chunks: loads the latest chunk if it may define one.
    fn learn(&mut self, file: &mut McapFile) -> Result<(), RecordingError> {
        let Some(chunk) = self.chunk.take() else { return Ok(()) };
        let indexed = std::mem::take(&mut self.indexed_channels);
        let known =
            !indexed.is_empty() && indexed.iter().all(|&id| file.channels.contains_key(&u32::from(id)));
        if known { Ok(()) } else { learn_channels(file, chunk) }
    }
}

/// Loads a block for its channels only; damage in it shows when its messages are read.
fn learn_channels(file: &mut McapFile, block: usize) -> Result<(), RecordingError> {
    let mut loaded = std::mem::take(&mut file.scratch);
    let result = file.load_block(block, &mut loaded);
    file.scratch = loaded;
    match result {
        Err(RecordingError::Damaged { .. }) | Ok(()) => Ok(()),
        Err(error) => Err(error),
    }
}

fn content(head: &[u8]) -> &[u8] {
    head.get(PREFIX_BYTES as usize..).unwrap_or(&[])
}

fn push_chunk(file: &mut McapFile, offset: u64, length: u64, chunk: &ChunkRecord, kind: BlockKind) -> Block {
    let block = Block { offset, length, start_ns: chunk.start_ns, end_ns: chunk.end_ns, kind };
    file.blocks.push(block.clone());
    block
}

/// A schema, channel or message outside of chunks.
fn plain(file: &mut McapFile, at: u64, end: u64, opcode: u8, head: &[u8]) -> Result<Step, RecordingError> {
    if end - at > MAX_RECORD_BYTES {
        return Ok(Step::Lost(format!(
            "a record of {} bytes is refused, the limit is {MAX_RECORD_BYTES}",
            end - at
        )));
    }
    if opcode != op::MESSAGE {
        file.other_record(at, end - at)?;
        return Ok(Step::To(end));
    }
    let Some(message) = MessageRecord::parse(content(head)) else {
        return Ok(Step::Lost("a message's header is too short".into()));
    };
    let time = message.log_time_ns;
    match file.blocks.last_mut() {
        Some(run)
            if run.kind == BlockKind::Plain
                && run.offset + run.length == at
                && run.length < PLAIN_RUN_BYTES =>
        {
            run.length += end - at;
            run.start_ns = run.start_ns.min(time);
            run.end_ns = run.end_ns.max(time);
        }
        _ => {
            let (length, kind) = (end - at, BlockKind::Plain);
            file.blocks.push(Block { offset: at, length, start_ns: time, end_ns: time, kind });
        }
    }
    Ok(Step::To(end))
}

/// After lost framing: finds the next chunk, or takes what follows for the cut end of the file. Gives where to go on.
fn recover(file: &mut McapFile, at: u64, what: String) -> Result<u64, RecordingError> {
    if let Some(next) = next_chunk(&mut file.source, at + 1)? {
        file.damage.push(Damage { offset: at, lost_bytes: next - at, what });
        return Ok(next);
    }
    let end = file.source.len();
    let mut head = Vec::new();
    file.source.read(at, PREFIX_BYTES + CHUNK_HEADER_BYTES, &mut head)?;
    let cut_chunk = record::prefix(&head).filter(|&(opcode, _)| opcode == op::CHUNK);
    let chunk = cut_chunk.and_then(|(_, len)| plausible(len, content(&head)));
    let mut lost_bytes = end - at;
    if let Some(chunk) = chunk {
        push_chunk(file, at, end - at, &chunk, BlockKind::CutChunk);
        let block = file.blocks.len() - 1;
        learn_channels(file, block)?;
        // What could be unpacked of the chunk is not lost.
        let unpacked = file.scratch.messages.last().map_or(0, |message| message.data.end as u64);
        let share = unpacked as f64 / chunk.unpacked_bytes.max(1) as f64;
        lost_bytes = (lost_bytes as f64 * (1.0 - share.min(1.0))).round() as u64;
    }
    let what = format!("{what}; what follows was not completely written, or is damaged");
    file.damage.push(Damage { offset: at, lost_bytes, what });
    Ok(end)
}

/// The next place that can only be a chunk.
fn next_chunk(source: &mut Source, from: u64) -> Result<Option<u64>, RecordingError> {
    let mut window = Vec::new();
    let mut start = from;
    let overlap = PREFIX_BYTES + CHUNK_HEADER_BYTES;
    while start < source.len() {
        source.read(start, WINDOW_BYTES + overlap, &mut window)?;
        for (index, _) in window.iter().enumerate().filter(|&(_, &byte)| byte == op::CHUNK) {
            let rest = window.get(index..).unwrap_or(&[]);
            let at = start + index as u64;
            if index as u64 >= WINDOW_BYTES {
                break;
            }
            if is_chunk(rest, source.len() - at) {
                return Ok(Some(at));
            }
        }
        start += WINDOW_BYTES;
    }
    Ok(None)
}

fn is_chunk(bytes: &[u8], available: u64) -> bool {
    let Some((op::CHUNK, len)) = record::prefix(bytes) else { return false };
    len.checked_add(PREFIX_BYTES).is_some_and(|len| len <= available)
        && plausible(len, content(bytes)).is_some()
}

/// A chunk's header, if its sizes and times fit each other: 20 bytes that damage does not bring about.
fn plausible(record_len: u64, head: &[u8]) -> Option<ChunkRecord> {
    let chunk = ChunkRecord::parse(head)?;
    let fits = chunk.header_bytes.checked_add(chunk.packed_bytes) == Some(record_len)
        && chunk.start_ns <= chunk.end_ns
        && Packing::from_name(&chunk.compression).is_some();
    fits.then_some(chunk)
}

impl McapFile {
    /// Takes in a record that is neither a message nor a chunk.
    pub(super) fn other_record(&mut self, at: u64, length: u64) -> Result<(), RecordingError> {
        if length > MAX_RECORD_BYTES {
            let what = format!("a record of {length} bytes is refused, the limit is {MAX_RECORD_BYTES}");
            self.damage.push(Damage { offset: at, lost_bytes: length, what });
            return Ok(());
        }
        let mut bytes = std::mem::take(&mut self.scratch).bytes;
        self.source.read(at, length, &mut bytes)?;
        if !self.take_record(&bytes) {
            let what = "a record is damaged".to_owned();
            self.damage.push(Damage { offset: at, lost_bytes: length, what });
        }
        self.scratch = Loaded { bytes, ..Loaded::default() };
        Ok(())
    }
}
