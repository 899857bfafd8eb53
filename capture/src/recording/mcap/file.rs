//! An opened MCAP file.

use std::collections::BTreeMap;
use std::path::Path;

use super::record::{self, ChannelRecord, ChunkRecord, MAGIC, MessageRecord, PREFIX_BYTES, SchemaRecord, op};
use super::{scan, summary};
use crate::recording::compression::{Packing, unpack};
use crate::recording::container::{
    Attachment, Block, BlockKind, Channel, Container, Damage, Encoding, Loaded, Message, Source,
};
use crate::recording::error::RecordingError;
use crate::recording::wire::Wire;

/// An MCAP file whose chunks and channels are known.
pub(crate) struct McapFile {
    pub(super) source: Source,
    pub(super) library: String,
    pub(super) indexed: bool,
    pub(super) schemas: BTreeMap<u16, String>,
    pub(super) channels: BTreeMap<u32, Channel>,
    pub(super) blocks: Vec<Block>,
    pub(super) damage: Vec<Damage>,
    pub(super) metadata: Vec<(String, BTreeMap<String, String>)>,
    pub(super) attachments: Vec<Attachment>,
    pub(super) scratch: Loaded,
}

impl McapFile {
    /// Opens the file behind `source`, which begins with [`MAGIC`], by its index or else by a scan.
    pub(crate) fn open(source: Source) -> Result<Self, RecordingError> {
        let mut file = Self {
            source,
            library: String::new(),
            indexed: false,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            blocks: Vec::new(),
            damage: Vec::new(),
            metadata: Vec::new(),
            attachments: Vec::new(),
            scratch: Loaded::default(),
        };
        match summary::read(&mut file.source)? {
            Ok(summary) => file.use_summary(summary)?,
            Err(reason) => {
                scan::scan(&mut file)?;
                let offset = file.source.len();
                file.damage.push(Damage {
                    offset,
                    lost_bytes: 0,
                    what: format!("read without an index: {reason}"),
                });
            }
        }
        Ok(file)
    }

    fn use_summary(&mut self, summary: summary::Summary) -> Result<(), RecordingError> {
        self.indexed = true;
        summary.schemas.into_iter().for_each(|schema| self.add_schema(schema));
        summary.channels.into_iter().for_each(|channel| self.add_channel(channel));
        self.blocks = summary
            .chunks
            .into_iter()
            .map(|chunk| Block {
                offset: chunk.offset,
                length: chunk.length,
                start_ns: chunk.start_ns,
                end_ns: chunk.end_ns,
                kind: BlockKind::Chunk,
            })
            .collect();
        self.blocks.sort_by_key(|block| block.offset);
        let mut head = Vec::new();
        self.source.read(MAGIC.len() as u64, PREFIX_BYTES, &mut head)?;
        let header = record::prefix(&head).filter(|&(opcode, len)| opcode == op::HEADER && len < 1 << 20);
        let first = header.map(|(_, len)| (MAGIC.len() as u64, len + PREFIX_BYTES));
        let mut others = summary.others;
        others.sort_unstable();
        first.into_iter().chain(others).try_for_each(|(offset, length)| self.other_record(offset, length))
    }

    fn add_schema(&mut self, schema: SchemaRecord) {
        self.schemas.insert(schema.id, schema.name);
    }

    fn add_channel(&mut self, channel: ChannelRecord) {
        let schema = self.schemas.get(&channel.schema_id).cloned().unwrap_or_default();
        let ChannelRecord { id, topic, encoding, metadata, .. } = channel;
        let encoding = Encoding::from_name(&encoding);
        // The first definition counts: a later one that differs is damage, and messages were read by the first.
        self.channels.entry(u32::from(id)).or_insert(Channel { topic, schema, encoding, metadata });
    }

    /// Takes in one whole record outside of chunks; false if it is damaged.
    pub(super) fn take_record(&mut self, bytes: &[u8]) -> bool {
        let Some((opcode, len)) = record::prefix(bytes) else { return false };
        let content = bytes.get(PREFIX_BYTES as usize..).unwrap_or(&[]);
        if content.len() as u64 != len {
            return false;
        }
        self.take_content(opcode, content).is_some()
    }

    fn take_content(&mut self, opcode: u8, content: &[u8]) -> Option<()> {
        match opcode {
            op::HEADER => self.library = record::library(content)?,
            op::SCHEMA => self.add_schema(SchemaRecord::parse(content)?),
            op::CHANNEL => self.add_channel(ChannelRecord::parse(content)?),
            op::METADATA => self.metadata.push(record::metadata(content)?),
            op::ATTACHMENT => {
                let (name, media_type, data, sound) = record::attachment(content)?;
                if !sound {
                    return None;
                }
                self.attachments.push(Attachment { name, media_type, data: content.get(data)?.to_vec() });
            }
            _ => {}
        }
        Some(())
    }

    /// Reads one block's messages, and the channels that it defines.
    pub(super) fn load_block(&mut self, block: usize, into: &mut Loaded) -> Result<(), RecordingError> {
        into.messages.clear();
        into.bytes.clear();
        let Some(block) = self.blocks.get(block).cloned() else { return Ok(()) };
        if block.kind == BlockKind::Plain {
            self.source.read(block.offset, block.length, &mut into.bytes)?;
        } else {
            self.unpack_chunk(&block, into)?;
        }
        let broken = self.list_messages(into);
        match broken {
            Some(at) if block.kind == BlockKind::Chunk => {
                into.messages.clear();
                Err(self
                    .source
                    .damaged(block.offset, format!("a chunk's records are damaged at its byte {at}")))
            }
            _ => Ok(()),
        }
    }

    fn unpack_chunk(&mut self, block: &Block, into: &mut Loaded) -> Result<(), RecordingError> {
        let path = self.source.path().to_owned();
        let damaged =
            |what: String| RecordingError::Damaged { path: path.clone(), offset: block.offset, what };
        let mut head = Vec::new();
        let header_span = PREFIX_BYTES + record::CHUNK_HEADER_BYTES;
        self.source.read(block.offset, header_span.min(block.length), &mut head)?;
        let content = head.get(PREFIX_BYTES as usize..).unwrap_or(&[]);
        let chunk = record::prefix(&head)
            .filter(|&(opcode, len)| {
                opcode == op::CHUNK
                    && (block.kind == BlockKind::CutChunk
                        || len.checked_add(PREFIX_BYTES) == Some(block.length))
            })
            .and_then(|_| ChunkRecord::parse(content))
            .ok_or_else(|| damaged("there should be a chunk here".into()))?;
        let packing = Packing::from_name(&chunk.compression).ok_or_else(|| {
            damaged(format!("a chunk is compressed with {:?}, known are lz4 and zstd", chunk.compression))
        })?;
        let data_at = PREFIX_BYTES + chunk.header_bytes;
        let room = block.length.saturating_sub(data_at);
        let whole = block.kind == BlockKind::Chunk;
        if whole && chunk.packed_bytes != room {
            return Err(damaged("a chunk's header contradicts its length".into()));
        }
        let limit = crate::recording::compression::MAX_CHUNK_BYTES;
        if room.min(chunk.packed_bytes) > limit {
            return Err(damaged(format!(
                "a chunk of {} bytes is refused, the limit is {limit}",
                chunk.packed_bytes
            )));
        }
        let offset = block.offset + data_at;
        self.source.read(offset, room.min(chunk.packed_bytes), &mut into.packed)?;
        let unpacked = unpack(packing, &mut into.packed, chunk.unpacked_bytes, &mut into.bytes);
        if !whole {
            return Ok(());
        }
        let crc_fits = chunk.unpacked_crc == 0 || crc32fast::hash(&into.bytes) == chunk.unpacked_crc;
        let verdict = match unpacked {
            Err(what) => Err(format!("a chunk fails its check (CRC): {what}")),
            Ok(()) if !crc_fits => Err("the checksum (CRC) of a chunk is wrong".into()),
            Ok(()) => Ok(()),
        };
        verdict.map_err(|what| {
            into.bytes.clear();
            self.source.damaged(block.offset, what)
        })
    }

    /// Lists the messages in the loaded bytes; gives where the records break off, if they do.
    fn list_messages(&mut self, into: &mut Loaded) -> Option<usize> {
        let Loaded { bytes, messages, .. } = into;
        let mut wire = Wire::new(bytes);
        while !wire.is_empty() {
            let at = wire.position();
            if self.list_record(&mut wire, bytes, messages).is_none() {
                return Some(at);
            }
        }
        None
    }

    fn list_record(&mut self, wire: &mut Wire, bytes: &[u8], messages: &mut Vec<Message>) -> Option<()> {
        let (opcode, len) = (wire.u8()?, wire.u64()?);
        let range = wire.take_range(usize::try_from(len).ok()?)?;
        let content = bytes.get(range.clone())?;
        match opcode {
            op::MESSAGE => {
                let message = MessageRecord::parse(content)?;
                messages.push(Message {
                    channel: u32::from(message.channel),
                    sequence: message.sequence,
                    log_time_ns: message.log_time_ns,
                    data: range.start + message.data.start..range.end,
                });
                Some(())
            }
            op::SCHEMA | op::CHANNEL => self.take_content(opcode, content),
            _ => Some(()),
        }
    }
}

impl Container for McapFile {
    fn path(&self) -> &Path {
        self.source.path()
    }

    fn kind(&self) -> &'static str {
        "mcap"
    }

    fn library(&self) -> &str {
        &self.library
    }

    fn indexed(&self) -> bool {
        self.indexed
    }

    fn size_bytes(&self) -> u64 {
        self.source.len()
    }

    fn channels(&self) -> &BTreeMap<u32, Channel> {
        &self.channels
    }

    fn blocks(&self) -> &[Block] {
        &self.blocks
    }

    fn damage(&self) -> &[Damage] {
        &self.damage
    }

    fn metadata(&self) -> &[(String, BTreeMap<String, String>)] {
        &self.metadata
    }

    fn attachments(&self) -> &[Attachment] {
        &self.attachments
    }

    fn load(&mut self, block: usize, into: &mut Loaded) -> Result<(), RecordingError> {
        self.load_block(block, into)
    }
}
