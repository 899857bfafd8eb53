//! Walks over the fields of a protobuf message without copying them.
//!
//! An image's bytes are copied once, from the chunk into a pooled buffer; a generated decoder would copy them twice.

use super::wire::Wire;

/// The value of a field on the wire (<https://protobuf.dev/programming-guides/encoding/>).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Value<'a> {
    Varint(u64),
    Fixed64(u64),
    Bytes(&'a [u8]),
    Fixed32(u32),
}

impl<'a> Value<'a> {
    /// An integer field of any wire type.
    pub(crate) fn integer(self) -> Option<u64> {
        match self {
            Self::Varint(value) | Self::Fixed64(value) => Some(value),
            Self::Fixed32(value) => Some(u64::from(value)),
            Self::Bytes(_) => None,
        }
    }

    pub(crate) fn bytes(self) -> Option<&'a [u8]> {
        if let Self::Bytes(bytes) = self { Some(bytes) } else { None }
    }

    pub(crate) fn text(self) -> Option<&'a str> {
        std::str::from_utf8(self.bytes()?).ok()
    }
}

/// Calls `visit` with number and value of every field; `None` if the message is malformed or `visit` says so.
pub(crate) fn visit_fields<'a>(
    message: &'a [u8],
    mut visit: impl FnMut(u64, Value<'a>) -> Option<()>,
) -> Option<()> {
    let mut wire = Wire::new(message);
    while !wire.is_empty() {
        let key = varint(&mut wire)?;
        let value = match key & 7 {
            0 => Value::Varint(varint(&mut wire)?),
            1 => Value::Fixed64(wire.u64()?),
            2 => {
                let len = varint(&mut wire)?;
                Value::Bytes(wire.take(usize::try_from(len).ok()?)?)
            }
            5 => Value::Fixed32(wire.u32()?),
            _ => return None,
        };
        visit(key >> 3, value)?;
    }
    Some(())
}

fn varint(wire: &mut Wire) -> Option<u64> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let byte = wire.u8()?;
        value |= u64::from(byte & 0x7f) << shift;
        if byte & 0x80 == 0 {
            return Some(value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use prost::Message;

    use super::*;

    #[test]
    fn reads_what_prost_wrote() {
        let image = foxglove::messages::RawImage {
            timestamp: Some(foxglove::messages::Timestamp::new(1 << 31, 5)),
            width: 640,
            encoding: "yuyv".into(),
            data: foxglove::bytes::Bytes::from_static(b"\x01\xff\x00"),
            ..Default::default()
        };
        let bytes = image.encode_to_vec();
        let mut seen = Vec::new();
        visit_fields(&bytes, |number, value| {
            seen.push((number, value));
            Some(())
        })
        .unwrap();
        assert!(seen.contains(&(2, Value::Fixed32(640))));
        assert!(seen.contains(&(4, Value::Bytes(b"yuyv"))));
        assert!(seen.contains(&(6, Value::Bytes(b"\x01\xff\x00"))));
        let stamp =
            seen.iter().find(|(number, _)| *number == 1).and_then(|(_, value)| value.bytes()).unwrap();
        let mut seconds = None;
        visit_fields(stamp, |number, value| {
            if number == 1 {
                seconds = value.integer();
            }
            Some(())
        });
        assert_eq!(seconds, Some(1 << 31));
    }

    #[test]
    fn malformed_messages_are_refused() {
        let ignore = |_, _| Some(());
        for bytes in [
            &[0x08_u8][..],
            &[0x08, 0xff, 0xff],
            &[0x12, 5, 1],
            &[0x0b],
            &[0x80; 11],
            &[0x09, 1, 2],
            &[0x0d, 1],
        ] {
            assert_eq!(visit_fields(bytes, ignore), None, "{bytes:?}");
        }
    }
}
