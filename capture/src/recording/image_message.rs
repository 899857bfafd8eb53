//! Images as Foxglove and ROS serialize them.

use super::container::{Channel, Encoding};
use super::protobuf::visit_fields;
use super::wire::Wire;

/// An image in a message; the bytes are those of the message.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ImageMessage<'a> {
    /// As the message's header says; `None` if it has none or it is zero.
    pub(crate) stamp_ns: Option<u64>,
    /// As the message's header says (ROS 1).
    pub(crate) sequence: Option<u32>,
    pub(crate) width_px: u32,
    pub(crate) height_px: u32,
    /// Foxglove's or ROS's name of the pixel layout, or of the compression.
    pub(crate) encoding: &'a str,
    pub(crate) stride_bytes: u32,
    pub(crate) big_endian: bool,
    pub(crate) data: &'a [u8],
}

/// Which message a channel's images are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ImageKind {
    Raw,
    Compressed,
}

/// The kind of a channel's images, `None` if it has none that can be read.
pub(crate) fn kind(channel: &Channel) -> Option<ImageKind> {
    match (&channel.encoding, channel.schema.as_str()) {
        (Encoding::Protobuf, "foxglove.RawImage")
        | (Encoding::Ros1, "sensor_msgs/Image")
        | (Encoding::Cdr, "sensor_msgs/msg/Image") => Some(ImageKind::Raw),
        (Encoding::Protobuf, "foxglove.CompressedImage")
        | (Encoding::Ros1, "sensor_msgs/CompressedImage")
        | (Encoding::Cdr, "sensor_msgs/msg/CompressedImage") => Some(ImageKind::Compressed),
        _ => None,
    }
}

/// Reads an image; `None` if the message is malformed.
pub(crate) fn parse<'a>(encoding: &Encoding, kind: ImageKind, message: &'a [u8]) -> Option<ImageMessage<'a>> {
    match (encoding, kind) {
        (Encoding::Protobuf, ImageKind::Raw) => protobuf_raw(message),
        (Encoding::Protobuf, ImageKind::Compressed) => protobuf_compressed(message),
        (Encoding::Ros1, _) => ros1(message, kind),
        (Encoding::Cdr, _) => cdr(message, kind),
        (Encoding::Other(_), _) => None,
    }
}

fn protobuf_raw(message: &[u8]) -> Option<ImageMessage<'_>> {
    let mut image = ImageMessage::default();
    visit_fields(message, |number, value| {
        match number {
            1 => image.stamp_ns = protobuf_stamp(value.bytes()?),
            2 => image.width_px = u32::try_from(value.integer()?).ok()?,
            3 => image.height_px = u32::try_from(value.integer()?).ok()?,
            4 => image.encoding = value.text()?,
            5 => image.stride_bytes = u32::try_from(value.integer()?).ok()?,
            6 => image.data = value.bytes()?,
            _ => {}
        }
        Some(())
    })?;
    Some(image)
}

fn protobuf_compressed(message: &[u8]) -> Option<ImageMessage<'_>> {
    let mut image = ImageMessage::default();
    visit_fields(message, |number, value| {
        match number {
            1 => image.stamp_ns = protobuf_stamp(value.bytes()?),
            2 => image.data = value.bytes()?,
            3 => image.encoding = value.text()?,
            _ => {}
        }
        Some(())
    })?;
    Some(image)
}

/// A `google.protobuf.Timestamp`.
fn protobuf_stamp(message: &[u8]) -> Option<u64> {
    let (mut seconds, mut ns) = (0_u64, 0_u64);
    visit_fields(message, |number, value| {
        match number {
            1 => seconds = value.integer()?,
            2 => ns = value.integer()?,
            _ => {}
        }
        Some(())
    })?;
    stamp(seconds, ns)
}

fn stamp(seconds: u64, ns: u64) -> Option<u64> {
    seconds.checked_mul(1_000_000_000)?.checked_add(ns).filter(|&ns| ns > 0)
}

/// `sensor_msgs/Image` or `sensor_msgs/CompressedImage` as ROS 1 has them.
fn ros1(message: &[u8], kind: ImageKind) -> Option<ImageMessage<'_>> {
    let mut wire = Wire::new(message);
    let sequence = Some(wire.u32()?);
    let stamp_ns = stamp(wire.u32()?.into(), wire.u32()?.into());
    let _frame_id = wire.block()?;
    let mut image = ImageMessage { stamp_ns, sequence, ..ImageMessage::default() };
    if kind == ImageKind::Raw {
        (image.height_px, image.width_px) = (wire.u32()?, wire.u32()?);
    }
    image.encoding = wire.text()?;
    if kind == ImageKind::Raw {
        image.big_endian = wire.u8()? != 0;
        image.stride_bytes = wire.u32()?;
    }
    image.data = wire.block()?;
    Some(image)
}

/// The same as ROS 2 has them: CDR, little endian, each number aligned to its size behind the 4 bytes of the header.
fn cdr(message: &[u8], kind: ImageKind) -> Option<ImageMessage<'_>> {
    const HEADER_BYTES: usize = 4;
    let mut wire = Wire::new(message);
    let &[_, 1, _, _] = wire.take(HEADER_BYTES)? else { return None };
    let u32_aligned = |wire: &mut Wire| {
        wire.align(HEADER_BYTES, 4)?;
        wire.u32()
    };
    let stamp_ns = stamp(u32_aligned(&mut wire)?.into(), u32_aligned(&mut wire)?.into());
    let _frame_id = cdr_text(&mut wire)?;
    let mut image = ImageMessage { stamp_ns, ..ImageMessage::default() };
    if kind == ImageKind::Raw {
        (image.height_px, image.width_px) = (u32_aligned(&mut wire)?, u32_aligned(&mut wire)?);
    }
    image.encoding = cdr_text(&mut wire)?;
    if kind == ImageKind::Raw {
        image.big_endian = wire.u8()? != 0;
        image.stride_bytes = u32_aligned(&mut wire)?;
    }
    let len = u32_aligned(&mut wire)?;
    image.data = wire.take(usize::try_from(len).ok()?)?;
    return Some(image);

    fn cdr_text<'a>(wire: &mut Wire<'a>) -> Option<&'a str> {
        wire.align(HEADER_BYTES, 4)?;
        let text = wire.text()?;
        Some(text.strip_suffix('\0').unwrap_or(text))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `sensor_msgs/msg/Image` with a frame_id of 3 letters: 4 bytes of text with its NUL need no padding, 6 of the
    /// encoding need 1 byte less than the flag behind it takes.
    #[test]
    fn cdr_image_with_its_alignment() {
        let mut bytes = vec![0, 1, 0, 0];
        for number in [7_u32, 9, 4] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(b"cam\0");
        for number in [2_u32, 3, 6] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(b"mono8\0");
        bytes.extend([0, 0]); // the flag and one byte of padding: 4 + 4 * 6 + 4 + 6 + 2 = 40
        bytes.extend(3_u32.to_le_bytes());
        bytes.extend(6_u32.to_le_bytes());
        bytes.extend([1, 2, 3, 4, 5, 6]);
        let image = cdr(&bytes, ImageKind::Raw).unwrap();
        assert_eq!((image.width_px, image.height_px, image.stride_bytes), (3, 2, 3));
        assert_eq!((image.encoding, image.data), ("mono8", &[1, 2, 3, 4, 5, 6][..]));
        assert_eq!(image.stamp_ns, Some(7_000_000_009));
        assert!((0..bytes.len()).all(|cut| cdr(&bytes[..cut], ImageKind::Raw).is_none()));
    }
}
