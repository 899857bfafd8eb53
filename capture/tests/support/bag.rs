//! Writes ROS 1 bags, independently of the code that reads them.

/// A bag being written.
pub struct Bag {
    bytes: Vec<u8>,
}

/// A chunk being written.
#[derive(Default)]
pub struct Chunk {
    bytes: Vec<u8>,
}

fn record(fields: &[(&str, &[u8])], data: &[u8]) -> Vec<u8> {
    let mut header = Vec::new();
    for (name, value) in fields {
        let len = (name.len() + 1 + value.len()) as u32;
        header.extend(len.to_le_bytes());
        header.extend(name.as_bytes());
        header.push(b'=');
        header.extend(*value);
    }
    let mut out = (header.len() as u32).to_le_bytes().to_vec();
    out.extend(header);
    out.extend((data.len() as u32).to_le_bytes());
    out.extend(data);
    out
}

fn fields(entries: &[(&str, &str)]) -> Vec<u8> {
    let mut out = Vec::new();
    for (name, value) in entries {
        let text = format!("{name}={value}");
        out.extend((text.len() as u32).to_le_bytes());
        out.extend(text.as_bytes());
    }
    out
}

fn time(ns: u64) -> [u8; 8] {
    let mut out = [0; 8];
    out[..4].copy_from_slice(&((ns / 1_000_000_000) as u32).to_le_bytes());
    out[4..].copy_from_slice(&((ns % 1_000_000_000) as u32).to_le_bytes());
    out
}

impl Chunk {
    pub fn connection(&mut self, id: u32, topic: &str, kind: &str) {
        self.bytes.extend(record(
            &[("op", &[7]), ("conn", &id.to_le_bytes()), ("topic", topic.as_bytes())],
            &fields(&[("topic", topic), ("type", kind), ("md5sum", "*"), ("message_definition", "")]),
        ));
    }

    pub fn message(&mut self, id: u32, at_ns: u64, data: &[u8]) {
        self.bytes.extend(record(&[("op", &[2]), ("conn", &id.to_le_bytes()), ("time", &time(at_ns))], data));
    }
}

impl Bag {
    pub fn new() -> Self {
        let mut bytes = b"#ROSBAG V2.0\n".to_vec();
        let counts: (&[u8], &[u8]) = (&[1, 0, 0, 0], &[1, 0, 0, 0]);
        let header =
            [("op", &[3][..]), ("index_pos", &[0; 8]), ("conn_count", counts.0), ("chunk_count", counts.1)];
        bytes.extend(record(&header, &[b' '; 64]));
        Self { bytes }
    }

    /// The bag with one chunk and no index, as a recorder that was killed leaves it.
    pub fn chunk(mut self, compression: &str, fill: impl FnOnce(&mut Chunk)) -> Vec<u8> {
        let mut chunk = Chunk::default();
        fill(&mut chunk);
        let size = chunk.bytes.len() as u32;
        let packed = match compression {
            "bz2" => {
                use std::io::Write;
                let mut encoder = bzip2::write::BzEncoder::new(Vec::new(), bzip2::Compression::best());
                encoder.write_all(&chunk.bytes).unwrap();
                encoder.finish().unwrap()
            }
            "lz4" => {
                use std::io::Write;
                let mut encoder = lz4::EncoderBuilder::new().build(Vec::new()).unwrap();
                encoder.write_all(&chunk.bytes).unwrap();
                encoder.finish().0
            }
            _ => chunk.bytes,
        };
        let header =
            [("op", &[5][..]), ("compression", compression.as_bytes()), ("size", &size.to_le_bytes())];
        self.bytes.extend(record(&header, &packed));
        self.bytes
    }
}

/// A `sensor_msgs/Image`.
pub fn image(sequence: u32, encoding: &str, width: u32, height: u32, step: u32, data: &[u8]) -> Vec<u8> {
    let mut out = Vec::new();
    for number in [sequence, 5, 17] {
        out.extend(number.to_le_bytes());
    }
    out.extend(3_u32.to_le_bytes());
    out.extend(b"cam");
    out.extend(height.to_le_bytes());
    out.extend(width.to_le_bytes());
    out.extend((encoding.len() as u32).to_le_bytes());
    out.extend(encoding.as_bytes());
    out.push(0);
    out.extend(step.to_le_bytes());
    out.extend((data.len() as u32).to_le_bytes());
    out.extend(data);
    out
}
