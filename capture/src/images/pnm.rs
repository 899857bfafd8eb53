//! PGM and PPM images: the Netpbm formats P2, P3, P5 and P6, with 8 or 16 bits a sample.
//!
//! Read here because depth is often kept in PGM files, whose counts must arrive as they are: general readers stretch
//! samples to the full range where the header says that white is less than 65535.

/// The header of a PGM or PPM image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct PnmHeader {
    pub(super) width_px: u32,
    pub(super) height_px: u32,
    /// 1 for PGM, 3 for PPM.
    pub(super) channels: usize,
    /// The sample that stands for white, 1 to 65535.
    pub(super) white: u16,
    /// Samples as decimal numbers instead of bytes.
    is_text: bool,
    /// Where the samples begin.
    data_at: usize,
}

impl PnmHeader {
    /// Reads the header.
    ///
    /// # Errors
    /// A sentence that says what is wrong.
    pub(super) fn read(bytes: &[u8]) -> Result<Self, String> {
        let (channels, is_text) = match bytes.get(..2) {
            Some(b"P2") => (1, true),
            Some(b"P3") => (3, true),
            Some(b"P5") => (1, false),
            Some(b"P6") => (3, false),
            _ => return Err("no PGM or PPM image of kind P2, P3, P5 or P6".into()),
        };
        let mut words = Words { bytes, at: 2 };
        let mut field =
            |name| words.number().ok_or_else(|| format!("the {name} in the header is missing or no number"));
        let (width_px, height_px, white) = (field("width")?, field("height")?, field("largest value")?);
        let white = u16::try_from(white).ok().filter(|white| *white > 0);
        let white = white.ok_or("the largest value in the header must be 1 to 65535")?;
        // Exactly one blank separates the header from the samples.
        Ok(Self { width_px, height_px, channels, white, is_text, data_at: words.at + 1 })
    }

    /// Calls `put` with every sample in order. The caller has checked the size.
    ///
    /// # Errors
    /// A sentence if samples are missing or brighter than white.
    pub(super) fn samples(&self, bytes: &[u8], put: &mut dyn FnMut(u16)) -> Result<(), String> {
        let count = self.width_px as usize * self.height_px as usize * self.channels;
        if self.is_text {
            let mut words = Words { bytes, at: self.data_at };
            for n in 0..count {
                let sample = words.number().and_then(|sample| u16::try_from(sample).ok());
                put(self.checked(
                    sample.ok_or_else(|| format!("sample {n} of {count} is missing or no number"))?,
                )?);
            }
            return Ok(());
        }
        let sample_bytes = if self.white > 255 { 2 } else { 1 };
        let data = bytes.get(self.data_at..).unwrap_or(&[]);
        let data = data.get(..count * sample_bytes).ok_or_else(|| {
            format!("truncated: {} bytes of samples, {} are needed", data.len(), count * sample_bytes)
        })?;
        for sample in data.chunks_exact(sample_bytes) {
            put(self.checked(sample.iter().fold(0, |value, byte| value << 8 | u16::from(*byte)))?);
        }
        Ok(())
    }

    /// The least number of bytes the samples can take.
    pub(super) fn least_bytes(&self) -> u64 {
        let count = u64::from(self.width_px) * u64::from(self.height_px) * self.channels as u64;
        // Numbers as text are a digit and a blank each; the last blank may be missing.
        if self.is_text || self.white > 255 { count * 2 - 1 } else { count }
    }

    fn checked(&self, sample: u16) -> Result<u16, String> {
        match sample <= self.white {
            true => Ok(sample),
            false => Err(format!("a sample of {sample} is larger than the largest value {}", self.white)),
        }
    }
}

/// Decimal numbers between blanks and comments.
struct Words<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl Words<'_> {
    /// The next number; stops on the byte behind it.
    fn number(&mut self) -> Option<u32> {
        loop {
            match self.bytes.get(self.at)? {
                b'#' => self.at += self.bytes.get(self.at..)?.iter().position(|byte| *byte == b'\n')?,
                byte if byte.is_ascii_whitespace() => self.at += 1,
                _ => break,
            }
        }
        let digits = self.bytes.get(self.at..)?;
        let len = digits.iter().position(|byte| !byte.is_ascii_digit()).unwrap_or(digits.len());
        self.at += len;
        str::from_utf8(digits.get(..len)?).ok()?.parse().ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(bytes: &[u8]) -> Result<Vec<u16>, String> {
        let mut samples = Vec::new();
        PnmHeader::read(bytes)?.samples(bytes, &mut |sample| samples.push(sample))?;
        Ok(samples)
    }

    #[test]
    fn text_and_bytes_of_both_widths_are_read() {
        assert_eq!(samples(b"P2 # a comment\n2 1\n255\n7 # so\n255"), Ok(vec![7, 255]));
        assert_eq!(samples(b"P5\n2 1 255\n\x07\xff"), Ok(vec![7, 255]));
        assert_eq!(samples(b"P5 1 2 65535\n\x01\x02\xff\xfe"), Ok(vec![0x0102, 0xfffe]));
        assert_eq!(samples(b"P6 1 1 255\n\x01\x02\x03"), Ok(vec![1, 2, 3]));
        assert_eq!(samples(b"P3 1 1 1000\n1 20 1000"), Ok(vec![1, 20, 1000]));
        // A sample may look like a blank or a comment.
        assert_eq!(samples(b"P5 3 1 255\n\n# "), Ok(vec![10, 35, 32]));
    }

    #[test]
    fn damage_is_named() {
        for (bytes, message) in [
            (&b"P4 1 1\n\0"[..], "P2, P3, P5 or P6"),
            (b"P5 2", "the height in the header is missing"),
            (b"P5 2 2 0\n1234", "must be 1 to 65535"),
            (b"P5 2 2 65536\n1234", "must be 1 to 65535"),
            (b"P5 2 2 255\n123", "truncated: 3 bytes of samples, 4 are needed"),
            (b"P2 2 1 255\n12", "sample 1 of 2 is missing"),
            (b"P5 1 1 9\n\x0a", "a sample of 10 is larger than the largest value 9"),
            (b"P5 99999999999 1 255\n", "the width in the header is missing or no number"),
        ] {
            let error = samples(bytes).unwrap_err();
            assert!(error.contains(message), "{error}");
        }
    }
}
