//! An opened bag.

use std::collections::BTreeMap;
use std::path::Path;

use super::record::{Fields, MAGIC, MAX_HEADER_BYTES, op, time_ns};
use crate::recording::compression::{MAX_CHUNK_BYTES, Packing, unpack};
use crate::recording::container::{
    Attachment, Block, BlockKind, Channel, Container, Damage, Encoding, Loaded, Message, Source,
};
use crate::recording::error::RecordingError;
use crate::recording::wire::Wire;

/// Largest record other than a chunk that is read; the largest real ones list the messages of a chunk.
const MAX_RECORD_BYTES: u64 = 64 << 20;

/// A bag whose chunks and connections are known.
pub(crate) struct BagFile {
    source: Source,
    channels: BTreeMap<u32, Channel>,
    blocks: Vec<Block>,
    damage: Vec<Damage>,
    indexed: bool,
}

/// Where a record's parts are, and its header.
struct Head {
    header: Vec<u8>,
    data_at: u64,
    data_bytes: u64,
}

impl BagFile {
    /// Opens the bag behind `source`, which begins with [`MAGIC`].
    pub(crate) fn open(source: Source) -> Result<Self, RecordingError> {
        let (channels, blocks, damage) = (BTreeMap::new(), Vec::new(), Vec::new());
        let mut bag = Self { source, channels, blocks, damage, indexed: false };
        bag.walk()?;
        if !bag.indexed {
            bag.learn_channels()?;
            let what = "the bag was not closed or its index is damaged: read without it".to_owned();
            bag.damage.push(Damage { offset: bag.source.len(), lost_bytes: 0, what });
        }
        Ok(bag)
    }

    /// Walks over all records; the data of chunks is skipped.
    fn walk(&mut self) -> Result<(), RecordingError> {
        let mut at = MAGIC.len() as u64;
        while at < self.source.len() {
            let next = match self.head(at)? {
                Ok(head) => {
                    let end = head.data_at + head.data_bytes;
                    if end > self.source.len() {
                        self.cut_record(at, &head)
                    } else {
                        self.record(at, &head)?.map(|()| end)
                    }
                }
                Err(what) => Err(what),
            };
            match next {
                Ok(next) => at = next,
                Err(what) => {
                    // Records cannot be told from data: after a broken one nothing can be found any more.
                    let lost_bytes = self.source.len() - at;
                    self.damage.push(Damage { offset: at, lost_bytes, what });
                    self.indexed = false;
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    fn head(&mut self, at: u64) -> Result<Result<Head, String>, RecordingError> {
        let mut bytes = Vec::new();
        self.source.read(at, 4, &mut bytes)?;
        let Some(header_bytes) = Wire::new(&bytes).u32().map(u64::from) else {
            return Ok(Err("the file ends within a record".into()));
        };
        if header_bytes > MAX_HEADER_BYTES {
            return Ok(Err(format!(
                "a record's header of {header_bytes} bytes is refused, the limit is {MAX_HEADER_BYTES}"
            )));
        }
        self.source.read(at + 4, header_bytes + 4, &mut bytes)?;
        let mut wire = Wire::new(&bytes);
        let header = wire.take(usize::try_from(header_bytes).unwrap_or(usize::MAX));
        let (Some(header), Some(data_bytes)) = (header, wire.u32()) else {
            return Ok(Err("the file ends within a record".into()));
        };
        let data_at = at + 4 + header_bytes + 4;
        Ok(Ok(Head { header: header.to_vec(), data_at, data_bytes: u64::from(data_bytes) }))
    }

    /// The file ends within this record: of a chunk, what is there can be read.
    fn cut_record(&mut self, at: u64, head: &Head) -> Result<u64, String> {
        let is_chunk = Fields::parse(&head.header).is_some_and(|fields| fields.op() == Some(op::CHUNK));
        if is_chunk {
            let length = self.source.len() - at;
            self.blocks.push(Block {
                offset: at,
                length,
                start_ns: 0,
                end_ns: u64::MAX,
                kind: BlockKind::CutChunk,
            });
        }
        Err("the file ends within a record".into())
    }

    /// Takes in one record. The inner error is damage.
    fn record(&mut self, at: u64, head: &Head) -> Result<Result<(), String>, RecordingError> {
        let parsed = Fields::parse(&head.header).and_then(|fields| Some((fields, fields.op()?)));
        let Some((fields, opcode)) = parsed else {
            return Ok(Err("a record's header is damaged".into()));
        };
        if opcode == op::CHUNK {
            let length = head.data_at + head.data_bytes - at;
            // Until an index says when its messages are, any time is possible.
            self.blocks.push(Block {
                offset: at,
                length,
                start_ns: 0,
                end_ns: u64::MAX,
                kind: BlockKind::Chunk,
            });
            return Ok(Ok(()));
        }
        if !matches!(opcode, op::CHUNK_INFO | op::CONNECTION) {
            let known = matches!(opcode, op::BAG_HEADER | op::INDEX | op::MESSAGE);
            return Ok(if known { Ok(()) } else { Err(format!("there is no record of type {opcode:#04x}")) });
        }
        if head.data_bytes > MAX_RECORD_BYTES {
            return Ok(Err(format!(
                "a record of {} bytes is refused, the limit is {MAX_RECORD_BYTES}",
                head.data_bytes
            )));
        }
        let mut data = Vec::new();
        self.source.read(head.data_at, head.data_bytes, &mut data)?;
        let taken = if opcode == op::CONNECTION {
            self.indexed = true;
            self.connection(&fields, &data)
        } else {
            self.chunk_info(&fields)
        };
        Ok(taken.ok_or_else(|| "a record of the index is damaged".to_owned()))
    }

    fn connection(&mut self, fields: &Fields, data: &[u8]) -> Option<()> {
        let id = fields.u32("conn")?;
        let topic = fields.text("topic")?.to_owned();
        let schema = Fields::parse(data)?.text("type")?.to_owned();
        let metadata = BTreeMap::new();
        self.channels.entry(id).or_insert(Channel { topic, schema, encoding: Encoding::Ros1, metadata });
        Some(())
    }

    fn chunk_info(&mut self, fields: &Fields) -> Option<()> {
        let offset = u64::from_le_bytes(fields.get("chunk_pos")?.try_into().ok()?);
        let (start_ns, end_ns) = (fields.time_ns("start_time")?, fields.time_ns("end_time")?);
        let index = self.blocks.binary_search_by_key(&offset, |block| block.offset);
        if let Some(block) = index.ok().and_then(|index| self.blocks.get_mut(index)) {
            (block.start_ns, block.end_ns) = (start_ns, end_ns);
        }
        Some(())
    }

    /// Without an index, connections are known only from within the chunks.
    fn learn_channels(&mut self) -> Result<(), RecordingError> {
        let mut loaded = Loaded::default();
        for block in 0..self.blocks.len() {
            match self.load_block(block, &mut loaded) {
                Ok(()) | Err(RecordingError::Damaged { .. }) => {}
                Err(error) => return Err(error),
            }
            let times = loaded.messages.iter().map(|message| message.log_time_ns);
            if let (Some(start), Some(end), Some(block)) =
                (times.clone().min(), times.max(), self.blocks.get_mut(block))
            {
                (block.start_ns, block.end_ns) = (start, end);
            }
        }
        Ok(())
    }

    fn load_block(&mut self, block: usize, into: &mut Loaded) -> Result<(), RecordingError> {
        into.messages.clear();
        into.bytes.clear();
        let Some(block) = self.blocks.get(block).cloned() else { return Ok(()) };
        self.unpack_chunk(&block, into)?;
        match self.list_messages(into) {
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
        let head = self.head(block.offset)?.map_err(|what| self.source.damaged(block.offset, what))?;
        let fields = Fields::parse(&head.header);
        let described = fields.and_then(|fields| Some((fields.text("compression")?, fields.u32("size")?)));
        let path = self.source.path().to_owned();
        let damaged =
            |what: String| RecordingError::Damaged { path: path.clone(), offset: block.offset, what };
        let (compression, size) = described.ok_or_else(|| damaged("a chunk's header is damaged".into()))?;
        let packing = Packing::from_name(compression).ok_or_else(|| {
            damaged(format!("a chunk is compressed with {compression:?}, known are none, lz4 and bz2"))
        })?;
        if head.data_bytes > MAX_CHUNK_BYTES {
            return Err(damaged(format!(
                "a chunk of {} bytes is refused, the limit is {MAX_CHUNK_BYTES}",
                head.data_bytes
            )));
        }
        self.source.read(head.data_at, head.data_bytes, &mut into.packed)?;
        let unpacked = unpack(packing, &mut into.packed, u64::from(size), &mut into.bytes);
        match unpacked {
            Err(what) if block.kind == BlockKind::Chunk => {
                into.bytes.clear();
                Err(self.source.damaged(block.offset, format!("a chunk {what}")))
            }
            _ => Ok(()),
        }
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
        let fields = Fields::parse(wire.block()?)?;
        let data_bytes = wire.u32()?;
        let data = wire.take_range(usize::try_from(data_bytes).ok()?)?;
        match fields.op()? {
            op::CONNECTION => self.connection(&fields, bytes.get(data)?),
            op::MESSAGE => {
                let log_time_ns = time_ns(&mut Wire::new(fields.get("time")?))?;
                messages.push(Message { channel: fields.u32("conn")?, sequence: 0, log_time_ns, data });
                Some(())
            }
            _ => None,
        }
    }
}

impl Container for BagFile {
    fn path(&self) -> &Path {
        self.source.path()
    }

    fn kind(&self) -> &'static str {
        "rosbag"
    }

    fn library(&self) -> &str {
        ""
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
        &[]
    }

    fn attachments(&self) -> &[Attachment] {
        &[]
    }

    fn load(&mut self, block: usize, into: &mut Loaded) -> Result<(), RecordingError> {
        self.load_block(block, into)
    }
}
