//! Reads little-endian numbers and strings from bytes that may lie about their lengths.

use std::ops::Range;

/// A position in a slice; every read that would leave it gives `None`.
#[derive(Clone, Debug)]
pub(crate) struct Wire<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Wire<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// How many bytes have been read.
    pub(crate) fn position(&self) -> usize {
        self.at
    }

    pub(crate) fn remaining(&self) -> usize {
        self.bytes.len() - self.at
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.remaining() == 0
    }

    pub(crate) fn take(&mut self, len: usize) -> Option<&'a [u8]> {
        let range = self.take_range(len)?;
        self.bytes.get(range)
    }

    /// Like [`take`](Self::take), but says where the bytes are.
    pub(crate) fn take_range(&mut self, len: usize) -> Option<Range<usize>> {
        let end = self.at.checked_add(len).filter(|&end| end <= self.bytes.len())?;
        let range = self.at..end;
        self.at = end;
        Some(range)
    }

    /// Skips to the next multiple of `alignment`, counted from `origin`.
    pub(crate) fn align(&mut self, origin: usize, alignment: usize) -> Option<()> {
        let past = (self.at.checked_sub(origin)?) % alignment;
        if past != 0 {
            self.take(alignment - past)?;
        }
        Some(())
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.array::<1>().map(|[byte]| byte)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub(crate) fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub(crate) fn f64(&mut self) -> Option<f64> {
        self.array().map(f64::from_le_bytes)
    }

    /// Bytes behind their length as u32.
    pub(crate) fn block(&mut self) -> Option<&'a [u8]> {
        let len = self.u32()?;
        self.take(usize::try_from(len).ok()?)
    }

    /// Text behind its length as u32; `None` also if it is not UTF-8.
    pub(crate) fn text(&mut self) -> Option<&'a str> {
        std::str::from_utf8(self.block()?).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_length_beyond_the_end_reads_nothing() {
        let mut wire = Wire::new(&[5, 0, 0, 0, b'a', b'b']);
        assert_eq!(wire.block(), None);
        let mut wire = Wire::new(&[0xff; 4]);
        assert_eq!(wire.block(), None);
        let mut wire = Wire::new(&[2, 0, 0, 0, b'a', b'b', 7]);
        assert_eq!(wire.text(), Some("ab"));
        assert_eq!(wire.u8(), Some(7));
        assert!(wire.is_empty());
        assert_eq!(wire.u8(), None);
    }

    #[test]
    fn alignment_counts_from_the_origin() {
        let bytes: Vec<u8> = (0..16).collect();
        let mut wire = Wire::new(&bytes);
        wire.take(5);
        wire.align(4, 4);
        assert_eq!(wire.u8(), Some(8));
    }
}
