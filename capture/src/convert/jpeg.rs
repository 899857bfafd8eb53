//! JPEG images as cameras send them: checked, completed where tables are left out, decoded.
//!
//! Cameras leave out the Huffman tables where they are the usual ones, pad the frame behind its end, and now and then
//! deliver half of it. The first is mended, the second ignored, the third refused: a frame without its end marker
//! would decode to an image whose lower part is grey. What was lost *between* start and end of the image data cannot
//! be told apart from image data in general, and shows as a disturbed image.

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use super::luma_601;
use crate::frame::{Frame, MAX_SIZE_PX};

mod tables;

/// Why bytes are no readable JPEG image.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum JpegError {
    /// The first bytes are not a JPEG's.
    #[error("no JPEG image: it does not begin with FF D8")]
    NotJpeg,
    /// The bytes end before the image does.
    #[error("the JPEG image is truncated: its {0} bytes end without an end marker")]
    Truncated(usize),
    /// A header segment contradicts itself.
    #[error("the JPEG image is damaged at byte {at}: {reason}")]
    Damaged {
        /// Where.
        at: usize,
        /// What is wrong there.
        reason: String,
    },
    /// A valid image of a kind that no camera sends.
    #[error("{0} JPEG images are not supported: save it as 8 bit baseline or progressive, grey or colour")]
    Unsupported(&'static str),
    /// The image is of another size than the frame says.
    #[error(
        "the JPEG image is {} x {} pixels, its frame {} x {}",
        image_px[0], image_px[1], frame_px[0], frame_px[1]
    )]
    Size {
        /// Width and height in the JPEG header.
        image_px: [u32; 2],
        /// Width and height of the frame.
        frame_px: [u32; 2],
    },
    /// The decoder gave up on the image data.
    #[error("the JPEG image cannot be decoded: {0}")]
    Data(String),
}

/// What the headers of a JPEG image say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct JpegHeader {
    /// Width in pixels, 1 to [`MAX_SIZE_PX`].
    pub width_px: u32,
    /// Height in pixels, 1 to [`MAX_SIZE_PX`].
    pub height_px: u32,
    /// 1 for grey, 3 for colour.
    pub channels: u32,
    has_huffman_tables: bool,
    /// Where the first scan's header begins.
    scan_at: usize,
    /// Where the image ends, behind its end marker.
    end: usize,
}

/// Width, height and number of channels from the first bytes of an image, as far as its frame header.
///
/// # Errors
/// [`JpegError`], [`JpegError::Truncated`] if the frame header comes later.
pub fn image_size(bytes: &[u8]) -> Result<[u32; 3], JpegError> {
    if !bytes.starts_with(&[0xFF, 0xD8]) {
        return Err(JpegError::NotJpeg);
    }
    let mut at = 2;
    loop {
        let (marker, marker_at) = next_marker(bytes, at)?;
        at = marker_at + 2;
        if matches!(marker, 0x01 | 0xD0..=0xD7) {
            continue;
        }
        let segment = segment(bytes, at)?;
        match marker {
            0xC0..=0xC2 => return frame_header(segment, marker_at),
            0xD9 | 0xDA => return Err(damaged(marker_at, "image data before the frame header")),
            _ => at += 2 + segment.len(),
        }
    }
}

impl JpegHeader {
    /// Reads all headers and finds the end of the image; does not decode it.
    ///
    /// # Errors
    /// [`JpegError`], [`JpegError::Truncated`] if there is no end.
    pub fn read(bytes: &[u8]) -> Result<Self, JpegError> {
        if !bytes.starts_with(&[0xFF, 0xD8]) {
            return Err(JpegError::NotJpeg);
        }
        let mut size = None;
        let (mut has_huffman_tables, mut scan_at) = (false, None);
        let mut at = 2;
        loop {
            let (marker, marker_at) = next_marker(bytes, at)?;
            at = marker_at + 2;
            match marker {
                0x01 | 0xD0..=0xD7 => continue,
                0xD9 => break,
                _ => {}
            }
            let segment = segment(bytes, at)?;
            match marker {
                0xC0..=0xC2 if size.is_some() => return Err(damaged(marker_at, "a second frame header")),
                0xC0..=0xC2 => size = Some(frame_header(segment, marker_at)?),
                0xC4 => has_huffman_tables = true,
                0xC3 | 0xC5..=0xCF => return Err(JpegError::Unsupported("lossless and arithmetic")),
                0xDA => scan_at = scan_at.or(Some(marker_at)),
                _ => {}
            }
            at += 2 + segment.len();
            if marker == 0xDA {
                at = end_of_scan(bytes, at).ok_or(JpegError::Truncated(bytes.len()))?;
            }
        }
        let [width_px, height_px, channels] =
            size.ok_or_else(|| damaged(at, "it ends without a frame header"))?;
        let scan_at = scan_at.ok_or_else(|| damaged(at, "it ends without image data"))?;
        check_plausible(width_px, height_px, scan_at, at)?;
        Ok(Self { width_px, height_px, channels, has_huffman_tables, scan_at, end: at })
    }
}

fn damaged(at: usize, reason: &str) -> JpegError {
    JpegError::Damaged { at, reason: reason.into() }
}

/// The marker at `at` (any number of FF may come before it) and where it begins.
fn next_marker(bytes: &[u8], at: usize) -> Result<(u8, usize), JpegError> {
    let rest = bytes.get(at..).unwrap_or(&[]);
    match rest.iter().position(|byte| *byte != 0xFF) {
        None => Err(JpegError::Truncated(bytes.len())),
        Some(0) => Err(damaged(at, "a marker should be here")),
        Some(fill) => Ok((rest[fill], at + fill - 1)),
    }
}

/// The content of the segment whose length field is at `at`.
fn segment(bytes: &[u8], at: usize) -> Result<&[u8], JpegError> {
    let truncated = JpegError::Truncated(bytes.len());
    let Some(&[high, low]) = bytes.get(at..at + 2) else {
        return Err(truncated);
    };
    let len = usize::from(u16::from_be_bytes([high, low]));
    if len < 2 {
        return Err(damaged(at, "a segment shorter than its own length field"));
    }
    bytes.get(at + 2..at + len).ok_or(truncated)
}

/// Width, height and number of channels.
fn frame_header(segment: &[u8], at: usize) -> Result<[u32; 3], JpegError> {
    let &[precision, h1, h0, w1, w0, channels, ..] = segment else {
        return Err(damaged(at, "a frame header that is too short"));
    };
    if precision != 8 {
        return Err(JpegError::Unsupported("12 and 16 bit"));
    }
    if channels != 1 && channels != 3 {
        return Err(JpegError::Unsupported("CMYK and two-channel"));
    }
    let (width_px, height_px) = (u32::from_be_bytes([0, 0, w1, w0]), u32::from_be_bytes([0, 0, h1, h0]));
    let allowed = 1..=MAX_SIZE_PX;
    if !allowed.contains(&width_px) || !allowed.contains(&height_px) {
        let reason = format!("{width_px} x {height_px} pixels: each side must be 1 to {MAX_SIZE_PX}");
        return Err(JpegError::Damaged { at, reason });
    }
    Ok([width_px, height_px, channels.into()])
}

/// Where the entropy-coded data that begins at `at` ends: at the next marker that is no restart marker.
fn end_of_scan(bytes: &[u8], mut at: usize) -> Option<usize> {
    loop {
        at += bytes.get(at..)?.iter().position(|byte| *byte == 0xFF)?;
        match bytes.get(at + 1)? {
            0x00 | 0xD0..=0xD7 => at += 2,
            0xFF => at += 1,
            _ => return Some(at),
        }
    }
}

/// Each block of 8 x 8 pixels takes at least a bit: a short file that claims to be huge is not worth the memory.
fn check_plausible(width_px: u32, height_px: u32, scan_at: usize, end: usize) -> Result<(), JpegError> {
    let blocks = width_px.div_ceil(8) as usize * height_px.div_ceil(8) as usize;
    if (end - scan_at) * 8 < blocks {
        let reason =
            format!("{} bytes of image data are too few for {width_px} x {height_px} pixels", end - scan_at);
        return Err(JpegError::Damaged { at: scan_at, reason });
    }
    Ok(())
}

/// What to decode to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channels {
    Luma,
    Rgb,
}

/// Decodes JPEG images; keeps the memory for those that must be completed.
#[derive(Clone, Debug, Default)]
pub(super) struct Decoder {
    completed: Vec<u8>,
    rgb: Vec<u8>,
}

impl Decoder {
    /// Decodes the image of a checked MJPG frame to `out`, whose length fits frame and channels.
    pub(super) fn decode(
        &mut self,
        frame: &Frame,
        channels: Channels,
        out: &mut [u8],
    ) -> Result<(), JpegError> {
        let header = JpegHeader::read(&frame.pixels)?;
        let image_px = [header.width_px, header.height_px];
        let frame_px = [frame.width_px, frame.height_px];
        if image_px != frame_px {
            return Err(JpegError::Size { image_px, frame_px });
        }
        let mut bytes = frame.pixels.get(..header.end).unwrap_or(&frame.pixels);
        if !header.has_huffman_tables {
            let (before, scan) = bytes.split_at(header.scan_at);
            self.completed.clear();
            for part in [before, &tables::STANDARD_HUFFMAN_TABLES, scan] {
                self.completed.extend_from_slice(part);
            }
            bytes = &self.completed;
        }
        decode(bytes, channels, out, &mut self.rgb)
    }
}

fn decode(bytes: &[u8], channels: Channels, out: &mut [u8], scratch: &mut Vec<u8>) -> Result<(), JpegError> {
    let side = MAX_SIZE_PX as usize;
    let color = match channels {
        Channels::Luma => ColorSpace::Luma,
        Channels::Rgb => ColorSpace::RGB,
    };
    let options = DecoderOptions::default()
        .set_strict_mode(true)
        .set_max_width(side)
        .set_max_height(side)
        .jpeg_set_out_colorspace(color);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    let failed = |error: zune_jpeg::errors::DecodeErrors| JpegError::Data(error.to_string());
    decoder.decode_headers().map_err(failed)?;
    if channels == Channels::Luma && decoder.input_colorspace() == Some(ColorSpace::RGB) {
        // Its first channel is red, not luma.
        scratch.resize(out.len() * 3, 0);
        decode(bytes, Channels::Rgb, scratch, &mut Vec::new())?;
        out.iter_mut().zip(scratch.as_chunks::<3>().0).for_each(|(out, rgb)| *out = luma_601(*rgb));
        return Ok(());
    }
    decoder.decode_into(out).map_err(failed)
}
