//! The records of an MCAP file.

use std::collections::BTreeMap;
use std::ops::Range;

use crate::recording::wire::Wire;

/// First and last bytes of every MCAP file.
pub(crate) const MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Bytes of a record before its content: opcode and length.
pub(super) const PREFIX_BYTES: u64 = 9;

/// Bytes of a chunk's content up to the name of its compression.
pub(super) const CHUNK_FIXED_BYTES: u64 = 8 + 8 + 8 + 4;

/// Longest content of a chunk record before its data, with any compression name this reader knows.
pub(super) const CHUNK_HEADER_BYTES: u64 = CHUNK_FIXED_BYTES + 4 + 4 + 8;

pub(super) mod op {
    pub(crate) const HEADER: u8 = 0x01;
    pub(crate) const FOOTER: u8 = 0x02;
    pub(crate) const SCHEMA: u8 = 0x03;
    pub(crate) const CHANNEL: u8 = 0x04;
    pub(crate) const MESSAGE: u8 = 0x05;
    pub(crate) const CHUNK: u8 = 0x06;
    pub(crate) const MESSAGE_INDEX: u8 = 0x07;
    pub(crate) const CHUNK_INDEX: u8 = 0x08;
    pub(crate) const ATTACHMENT: u8 = 0x09;
    pub(crate) const ATTACHMENT_INDEX: u8 = 0x0A;
    pub(crate) const STATISTICS: u8 = 0x0B;
    pub(crate) const METADATA: u8 = 0x0C;
    pub(crate) const METADATA_INDEX: u8 = 0x0D;
    pub(crate) const DATA_END: u8 = 0x0F;
    /// Opcodes from here on are private to applications.
    pub(crate) const PRIVATE: u8 = 0x80;
}

/// Opcode and length of the record that begins at `bytes`.
pub(super) fn prefix(bytes: &[u8]) -> Option<(u8, u64)> {
    let mut wire = Wire::new(bytes);
    Some((wire.u8()?, wire.u64()?))
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct SchemaRecord {
    pub(super) id: u16,
    pub(super) name: String,
}

impl SchemaRecord {
    pub(super) fn parse(content: &[u8]) -> Option<Self> {
        let mut wire = Wire::new(content);
        Some(Self { id: wire.u16()?, name: wire.text()?.to_owned() })
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ChannelRecord {
    pub(super) id: u16,
    pub(super) schema_id: u16,
    pub(super) topic: String,
    pub(super) encoding: String,
    pub(super) metadata: BTreeMap<String, String>,
}

impl ChannelRecord {
    pub(super) fn parse(content: &[u8]) -> Option<Self> {
        let mut wire = Wire::new(content);
        Some(Self {
            id: wire.u16()?,
            schema_id: wire.u16()?,
            topic: wire.text()?.to_owned(),
            encoding: wire.text()?.to_owned(),
            metadata: text_map(&mut wire)?,
        })
    }
}

/// A message record's header; its data follows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct MessageRecord {
    pub(super) channel: u16,
    pub(super) sequence: u32,
    pub(super) log_time_ns: u64,
    pub(super) data: Range<usize>,
}

impl MessageRecord {
    pub(super) fn parse(content: &[u8]) -> Option<Self> {
        let mut wire = Wire::new(content);
        let (channel, sequence, log_time_ns) = (wire.u16()?, wire.u32()?, wire.u64()?);
        let _publish_time_ns = wire.u64()?;
        Some(Self { channel, sequence, log_time_ns, data: wire.position()..content.len() })
    }
}

/// A chunk record's header; its packed data follows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ChunkRecord {
    pub(super) start_ns: u64,
    pub(super) end_ns: u64,
    pub(super) unpacked_bytes: u64,
    /// 0 if there is none.
    pub(super) unpacked_crc: u32,
    pub(super) compression: String,
    pub(super) packed_bytes: u64,
    /// Bytes of this header.
    pub(super) header_bytes: u64,
}

impl ChunkRecord {
    /// `content` may end behind the header.
    pub(super) fn parse(content: &[u8]) -> Option<Self> {
        let mut wire = Wire::new(content);
        Some(Self {
            start_ns: wire.u64()?,
            end_ns: wire.u64()?,
            unpacked_bytes: wire.u64()?,
            unpacked_crc: wire.u32()?,
            compression: wire.text()?.to_owned(),
            packed_bytes: wire.u64()?,
            header_bytes: wire.position() as u64,
        })
    }
}

#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct ChunkIndexRecord {
    pub(super) start_ns: u64,
    pub(super) end_ns: u64,
    pub(super) offset: u64,
    pub(super) length: u64,
}

impl ChunkIndexRecord {
    pub(super) fn parse(content: &[u8]) -> Option<Self> {
        let mut wire = Wire::new(content);
        Some(Self { start_ns: wire.u64()?, end_ns: wire.u64()?, offset: wire.u64()?, length: wire.u64()? })
    }
}

/// The channel whose messages a message index lists.
pub(super) fn message_index_channel(content: &[u8]) -> Option<u16> {
    Wire::new(content).u16()
}

/// Offset and length of the record that an attachment index or a metadata index points to.
pub(super) fn index_target(content: &[u8]) -> Option<(u64, u64)> {
    let mut wire = Wire::new(content);
    Some((wire.u64()?, wire.u64()?))
}

/// Number of messages and of chunks from a statistics record.
pub(super) fn statistics(content: &[u8]) -> Option<(u64, u32)> {
    let mut wire = Wire::new(content);
    let messages = wire.u64()?;
    wire.take(2 + 4 + 4 + 4)?;
    Some((messages, wire.u32()?))
}

/// The writing program from a header record.
pub(super) fn library(content: &[u8]) -> Option<String> {
    let mut wire = Wire::new(content);
    let _profile = wire.text()?;
    Some(wire.text()?.to_owned())
}

/// Name and entries of a metadata record.
pub(super) fn metadata(content: &[u8]) -> Option<(String, BTreeMap<String, String>)> {
    let mut wire = Wire::new(content);
    Some((wire.text()?.to_owned(), text_map(&mut wire)?))
}

/// An attachment: its name, media type, where its data lies in `content`, and whether its checksum is right.
pub(super) fn attachment(content: &[u8]) -> Option<(String, String, Range<usize>, bool)> {
    let mut wire = Wire::new(content);
    let _times = wire.take(16)?;
    let (name, media_type) = (wire.text()?.to_owned(), wire.text()?.to_owned());
    let len = usize::try_from(wire.u64()?).ok()?;
    let data = wire.take_range(len)?;
    let stored = wire.u32()?;
    let sound = stored == 0 || stored == crc32fast::hash(content.get(..data.end)?);
    Some((name, media_type, data, sound))
}

fn text_map(wire: &mut Wire) -> Option<BTreeMap<String, String>> {
    let mut entries = Wire::new(wire.block()?);
    let mut map = BTreeMap::new();
    while !entries.is_empty() {
        map.insert(entries.text()?.to_owned(), entries.text()?.to_owned());
    }
    Some(map)
}
