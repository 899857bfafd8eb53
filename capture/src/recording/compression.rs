//! Unpacks chunks of recordings, within limits that do not depend on what the file claims.

use std::io::Read;

/// Largest chunk that is unpacked. A chunk is held in memory as a whole; recorders use a few MiB.
pub(crate) const MAX_CHUNK_BYTES: u64 = 512 << 20;

/// How the bytes of a chunk are packed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Packing {
    None,
    Lz4,
    Zstd,
    Bzip2,
}

impl Packing {
    /// The packing with this name in an MCAP file or a bag.
    pub(crate) fn from_name(name: &str) -> Option<Self> {
        match name {
            "" | "none" => Some(Self::None),
            "lz4" => Some(Self::Lz4),
            "zstd" => Some(Self::Zstd),
            "bz2" => Some(Self::Bzip2),
            _ => None,
        }
    }
}

/// Unpacks `packed` into `out` (cleared first), which must give exactly `size` bytes.
///
/// # Errors
/// What is wrong. `out` then holds what could be unpacked before that.
pub(crate) fn unpack(
    packing: Packing,
    packed: &mut Vec<u8>,
    size: u64,
    out: &mut Vec<u8>,
) -> Result<(), String> {
    out.clear();
    if size > MAX_CHUNK_BYTES {
        return Err(format!("a chunk of {size} bytes is refused, the limit is {MAX_CHUNK_BYTES}"));
    }
    let result = match packing {
        Packing::None => {
            std::mem::swap(packed, out);
            Ok(())
        }
        Packing::Lz4 => lz4::Decoder::new(packed.as_slice())
            .and_then(|decoder| read_some(decoder, size, packed.len(), out)),
        Packing::Zstd => zstd::stream::read::Decoder::with_buffer(packed.as_slice())
            .and_then(|decoder| read_some(decoder, size, packed.len(), out)),
        Packing::Bzip2 => read_some(bzip2::read::BzDecoder::new(packed.as_slice()), size, packed.len(), out),
    };
    result.map_err(|error| format!("cannot be unpacked: {error}"))?;
    if out.len() as u64 != size {
        let than = if out.len() as u64 > size { "more" } else { "less" };
        return Err(format!("unpacks to {than} than the {size} bytes it should"));
    }
    Ok(())
}

/// Reads one byte more than `size`, so that too long a chunk shows.
fn read_some(decoder: impl Read, size: u64, packed_len: usize, out: &mut Vec<u8>) -> std::io::Result<()> {
    // The claimed size is believed only as far as the packed bytes make it likely; the vector grows if it was true.
    let likely = packed_len.saturating_mul(16).saturating_add(1 << 16);
    out.reserve(likely.min(usize::try_from(size).unwrap_or(likely)));
    decoder.take(size.saturating_add(1)).read_to_end(out).map(|_| ())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packed_zstd(bytes: &[u8]) -> Vec<u8> {
        zstd::stream::encode_all(bytes, 1).unwrap()
    }

    #[test]
    fn a_bomb_is_stopped_at_the_size_it_claims() {
        let mut bomb = packed_zstd(&vec![0; 64 << 20]);
        assert!(bomb.len() < 16 << 10);
        let mut out = Vec::new();
        let error = unpack(Packing::Zstd, &mut bomb, 1000, &mut out).unwrap_err();
        assert!(error.contains("more than the 1000"), "{error}");
        assert!(out.capacity() < 1 << 20);
    }

    #[test]
    fn an_absurd_size_is_refused_before_memory_is_taken() {
        let mut out = Vec::new();
        let error = unpack(Packing::Zstd, &mut packed_zstd(b"hello"), u64::MAX, &mut out).unwrap_err();
        assert!(error.contains("refused"), "{error}");
        let error = unpack(Packing::Lz4, &mut vec![1, 2, 3], MAX_CHUNK_BYTES, &mut out).unwrap_err();
        assert!(error.contains("unpack"), "{error}");
        assert!(out.capacity() < 1 << 20);
    }

    #[test]
    fn a_cut_chunk_gives_what_came_before_the_cut() {
        let bytes: Vec<u8> =
            (0..1_000_000_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
        let mut packed = packed_zstd(&bytes);
        packed.truncate(packed.len() / 2);
        let mut out = Vec::new();
        assert!(unpack(Packing::Zstd, &mut packed, 1_000_000, &mut out).is_err());
        assert!(out.len() > 100_000);
        assert_eq!(out, bytes[..out.len()]);
    }
}
