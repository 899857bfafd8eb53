//! The records of a bag: a header of named fields, then data.

use crate::recording::wire::Wire;

/// First bytes of every bag of version 2.0.
pub(crate) const MAGIC: &[u8] = b"#ROSBAG V2.0\n";

/// Longest record header that is read; real ones have about 100 bytes.
pub(super) const MAX_HEADER_BYTES: u64 = 1 << 20;

pub(super) mod op {
    pub(crate) const MESSAGE: u8 = 0x02;
    pub(crate) const BAG_HEADER: u8 = 0x03;
    pub(crate) const INDEX: u8 = 0x04;
    pub(crate) const CHUNK: u8 = 0x05;
    pub(crate) const CHUNK_INFO: u8 = 0x06;
    pub(crate) const CONNECTION: u8 = 0x07;
}

/// The fields of a record's header.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fields<'a>(&'a [u8]);

impl<'a> Fields<'a> {
    /// `None` if a field reaches outside of `bytes` or has no name.
    pub(super) fn parse(bytes: &'a [u8]) -> Option<Self> {
        let mut wire = Wire::new(bytes);
        while !wire.is_empty() {
            let field = wire.block()?;
            field.iter().position(|&byte| byte == b'=').filter(|&at| at > 0)?;
        }
        Some(Self(bytes))
    }

    /// The value of the field `name`.
    pub(super) fn get(&self, name: &str) -> Option<&'a [u8]> {
        let mut wire = Wire::new(self.0);
        while let Some(field) = wire.block() {
            let value = field.strip_prefix(name.as_bytes()).and_then(|rest| rest.strip_prefix(b"="));
            if value.is_some() {
                return value;
            }
        }
        None
    }

    pub(super) fn text(&self, name: &str) -> Option<&'a str> {
        std::str::from_utf8(self.get(name)?).ok()
    }

    pub(super) fn op(&self) -> Option<u8> {
        let &[op] = self.get("op")? else { return None };
        Some(op)
    }

    pub(super) fn u32(&self, name: &str) -> Option<u32> {
        Some(u32::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    /// A time as nanoseconds.
    pub(super) fn time_ns(&self, name: &str) -> Option<u64> {
        time_ns(&mut Wire::new(self.get(name)?))
    }
}

/// A ROS time, seconds and nanoseconds, as nanoseconds.
pub(super) fn time_ns(wire: &mut Wire) -> Option<u64> {
    let (seconds, ns) = (wire.u32()?, wire.u32()?);
    Some(u64::from(seconds) * 1_000_000_000 + u64::from(ns))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_found_by_their_whole_name() {
        let mut bytes = Vec::new();
        for field in [b"op=\x05".as_slice(), b"size=\x01\x02\x00\x00", b"opera=x"] {
            bytes.extend((field.len() as u32).to_le_bytes());
            bytes.extend(field);
        }
        let fields = Fields::parse(&bytes).unwrap();
        assert_eq!(fields.op(), Some(5));
        assert_eq!(fields.u32("size"), Some(0x201));
        assert_eq!(fields.get("siz"), None);
        assert!(Fields::parse(&bytes[..bytes.len() - 1]).is_none());
        assert!(Fields::parse(b"\x02\0\0\0=x").is_none());
    }
}
