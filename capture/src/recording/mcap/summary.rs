//! The index at the end of a finished MCAP file.

use super::record::{self, ChannelRecord, ChunkIndexRecord, MAGIC, PREFIX_BYTES, SchemaRecord, op};
use crate::recording::container::Source;
use crate::recording::error::RecordingError;
use crate::recording::wire::Wire;

/// Largest index that is read: that of weeks of recording.
const MAX_SUMMARY_BYTES: u64 = 256 << 20;

const FOOTER_BYTES: u64 = PREFIX_BYTES + 8 + 8 + 4;

/// What the index says.
#[derive(Debug, Default)]
pub(super) struct Summary {
    pub(super) schemas: Vec<SchemaRecord>,
    pub(super) channels: Vec<ChannelRecord>,
    pub(super) chunks: Vec<ChunkIndexRecord>,
    /// Offset and length of attachment and metadata records.
    pub(super) others: Vec<(u64, u64)>,
}

/// Reads the index. `Ok(Err(reason))` if there is none that can be used.
pub(super) fn read(source: &mut Source) -> Result<Result<Summary, String>, RecordingError> {
    let tail_bytes = FOOTER_BYTES + MAGIC.len() as u64;
    let Some(footer_start) = source.len().checked_sub(tail_bytes).filter(|&at| at >= MAGIC.len() as u64)
    else {
        return Ok(Err("the file ends before its index".into()));
    };
    let mut tail = Vec::new();
    source.read(footer_start, tail_bytes, &mut tail)?;
    if !tail.ends_with(MAGIC) {
        return Ok(Err("the file ends before its index".into()));
    }
    let Some((summary_start, stored_crc)) = footer(&tail) else {
        return Ok(Err("its footer is damaged".into()));
    };
    if summary_start == 0 {
        return Ok(Err("it was written without an index".into()));
    }
    let Some(summary_bytes) = footer_start.checked_sub(summary_start).filter(|&len| len <= MAX_SUMMARY_BYTES)
    else {
        return Ok(Err("its footer points outside the file".into()));
    };
    let mut bytes = Vec::new();
    source.read(summary_start, summary_bytes + FOOTER_BYTES - 4, &mut bytes)?;
    if stored_crc != 0 && crc32fast::hash(&bytes) != stored_crc {
        return Ok(Err("the checksum (CRC) of its index is wrong".into()));
    }
    bytes.truncate(usize::try_from(summary_bytes).unwrap_or(0));
    let Some(summary) = parse(&bytes) else {
        return Ok(Err("its index is damaged".into()));
    };
    Ok(if is_usable(&summary, summary_start) {
        Ok(summary.found)
    } else {
        Err("its index is incomplete".into())
    })
}

fn footer(tail: &[u8]) -> Option<(u64, u32)> {
    let mut wire = Wire::new(tail);
    if (wire.u8()?, wire.u64()?) != (op::FOOTER, 20) {
        return None;
    }
    let summary_start = wire.u64()?;
    let _offsets_start = wire.u64()?;
    Some((summary_start, wire.u32()?))
}

#[derive(Default)]
struct Parsed {
    found: Summary,
    /// Messages and chunks, if the statistics are there.
    counts: Option<(u64, u32)>,
}

fn parse(bytes: &[u8]) -> Option<Parsed> {
    let mut parsed = Parsed::default();
    let mut wire = Wire::new(bytes);
    while !wire.is_empty() {
        let (opcode, len) = (wire.u8()?, wire.u64()?);
        let content = wire.take(usize::try_from(len).ok()?)?;
        let found = &mut parsed.found;
        match opcode {
            op::SCHEMA => found.schemas.push(SchemaRecord::parse(content)?),
            op::CHANNEL => found.channels.push(ChannelRecord::parse(content)?),
            op::CHUNK_INDEX => found.chunks.push(ChunkIndexRecord::parse(content)?),
            op::ATTACHMENT_INDEX | op::METADATA_INDEX => found.others.push(record::index_target(content)?),
            op::STATISTICS => parsed.counts = Some(record::statistics(content)?),
            _ => {}
        }
    }
    Some(parsed)
}

/// Whether the index covers all messages: writers may leave out parts of it.
fn is_usable(parsed: &Parsed, summary_start: u64) -> bool {
    let Summary { channels, chunks, .. } = &parsed.found;
    let inside = |chunk: &ChunkIndexRecord| {
        chunk.offset >= MAGIC.len() as u64
            && chunk.offset.checked_add(chunk.length).is_some_and(|end| end <= summary_start)
    };
    let complete = parsed.counts.is_some_and(|(messages, chunk_count)| {
        chunk_count as usize == chunks.len() && (messages == 0 || (chunk_count > 0 && !channels.is_empty()))
    });
    complete && chunks.iter().all(inside)
}
