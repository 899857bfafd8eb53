//! One image file to one frame.

use std::io::{Cursor, Read};
use std::path::Path;

use image::codecs::png::PngDecoder;
use image::{ColorType, ImageDecoder, Limits};

use super::linear;
use super::options::Deliver;
use super::pnm::PnmHeader;
use crate::convert::Converter;
use crate::convert::jpeg::{self, JpegHeader};
use crate::frame::{Frame, MAX_SIZE_PX};
use crate::pixel_format::{ColorEncoding, PixelFormat, YuvMatrix, YuvRange};
use crate::pool::{FramePool, PixelBuffer, PixelBufferMut};

/// Largest image file that is read.
const MAX_FILE_BYTES: u64 = 1 << 30;
/// No image compresses better than this: deflate's limit is 1032.
pub(super) const MAX_COMPRESSION: u64 = 1100;

/// What is to be made of a file's samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Target {
    Image(Deliver),
    Depth { unit_m: f64, invalid: Option<u16> },
}

impl Target {
    /// The format of the frames from a file of this format, or why there are none.
    pub(super) fn format(self, native: PixelFormat) -> Result<PixelFormat, String> {
        match (self, native) {
            (Self::Image(Deliver::Native), native) => Ok(native),
            (Self::Image(Deliver::Grey), _) => Ok(PixelFormat::Grey),
            (Self::Image(Deliver::Rgb), _) => Ok(PixelFormat::Rgb24),
            (Self::Depth { .. }, PixelFormat::Y16) => Ok(PixelFormat::Z16),
            (Self::Depth { .. }, other) => {
                Err(format!("depth must be 16 bit grey, the file is {other}: leave out `depth_unit_m`"))
            }
        }
    }
}

/// Format and size of an image file, from its header.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Probe {
    pub(super) format: PixelFormat,
    pub(super) width_px: u32,
    pub(super) height_px: u32,
}

/// Reads as much of the file as its header takes. `layer` is the wanted one of an EXR file.
pub(super) fn probe(path: &Path, layer: Option<&str>) -> Result<Probe, String> {
    const HEADER_BYTES: u64 = 1 << 16;
    let mut bytes = Vec::new();
    let file_bytes = read_bytes(path, HEADER_BYTES, &mut bytes)?;
    let probed = probe_bytes(&bytes, layer);
    if probed.is_err() && file_bytes > HEADER_BYTES {
        // An image may carry more than that (a preview, a colour profile) in or before its header.
        read_bytes(path, MAX_FILE_BYTES, &mut bytes)?;
        return probe_bytes(&bytes, layer);
    }
    probed
}

fn probe_bytes(bytes: &[u8], layer: Option<&str>) -> Result<Probe, String> {
    let (format, width_px, height_px) = match Kind::of_layer(bytes, layer)? {
        Kind::Jpeg => {
            let [width_px, height_px, _] = jpeg::image_size(bytes).map_err(|error| error.to_string())?;
            (PixelFormat::Mjpg, width_px, height_px)
        }
        Kind::Pnm => {
            let header = PnmHeader::read(bytes)?;
            let format = match (header.channels, header.white) {
                (1, ..=255) => PixelFormat::Grey,
                (1, _) => PixelFormat::Y16,
                _ => PixelFormat::Rgb24,
            };
            (format, header.width_px, header.height_px)
        }
        Kind::Png => {
            let decoder = png_decoder(bytes)?;
            let (width_px, height_px) = decoder.dimensions();
            (png_format(decoder.color_type())?, width_px, height_px)
        }
        Kind::Linear => {
            let layer = linear::layer(bytes, layer)?;
            let side = |px| u32::try_from(px).unwrap_or(u32::MAX);
            (PixelFormat::RgbF32, side(layer.width), side(layer.height))
        }
    };
    check_size(width_px, height_px)?;
    Ok(Probe { format, width_px, height_px })
}

fn check_size(width_px: u32, height_px: u32) -> Result<(), String> {
    let allowed = 1..=MAX_SIZE_PX;
    match allowed.contains(&width_px) && allowed.contains(&height_px) {
        true => Ok(()),
        false => Err(format!("{width_px} x {height_px} pixels: each side must be 1 to {MAX_SIZE_PX}")),
    }
}

/// What a file is, by its first bytes: names lie.
enum Kind {
    Png,
    Jpeg,
    Pnm,
    /// EXR or Radiance HDR.
    Linear,
}

impl Kind {
    fn of(bytes: &[u8]) -> Result<Self, String> {
        match bytes {
            [0x89, b'P', b'N', b'G', ..] => Ok(Self::Png),
            [0xFF, 0xD8, ..] => Ok(Self::Jpeg),
            [b'P', b'1'..=b'6', ..] => Ok(Self::Pnm),
            [0x76, 0x2f, 0x31, 0x01, ..] | [b'#', b'?', ..] => Ok(Self::Linear),
            [] => Err("the file is empty".into()),
            _ => Err("neither PNG, JPEG, PGM, PPM, EXR nor HDR".into()),
        }
    }

    /// [`of`](Self::of) a file of which a layer may be wanted.
    fn of_layer(bytes: &[u8], layer: Option<&str>) -> Result<Self, String> {
        match (Self::of(bytes)?, layer) {
            (Self::Png | Self::Jpeg | Self::Pnm, Some(_)) => {
                Err("no EXR image, and others have no layers: leave out `layer`".into())
            }
            (kind, _) => Ok(kind),
        }
    }
}

fn png_decoder(bytes: &[u8]) -> Result<PngDecoder<Cursor<&[u8]>>, String> {
    // Only the decoder's own buffers count here, the image is decoded to memory of ours.
    let mut limits = Limits::default();
    limits.max_alloc = Some(64 << 20);
    PngDecoder::with_limits(Cursor::new(bytes), limits).map_err(|error| error.to_string())
}

fn png_format(color: ColorType) -> Result<PixelFormat, String> {
    match color {
        ColorType::L8 | ColorType::La8 => Ok(PixelFormat::Grey),
        ColorType::L16 | ColorType::La16 => Ok(PixelFormat::Y16),
        ColorType::Rgb8 | ColorType::Rgba8 | ColorType::Rgb16 | ColorType::Rgba16 => Ok(PixelFormat::Rgb24),
        other => Err(format!("PNG images of kind {other:?} are not supported")),
    }
}

/// Reads the first `limit` bytes of a file; returns how many it has.
fn read_bytes(path: &Path, limit: u64, bytes: &mut Vec<u8>) -> Result<u64, String> {
    let unreadable = |error: std::io::Error| format!("cannot be read: {error}");
    // Opening a pipe would wait for somebody to write into it, so its kind is looked at first.
    let metadata = std::fs::metadata(path).map_err(unreadable)?;
    if !metadata.is_file() {
        return Err("is no file".into());
    }
    if metadata.len() > MAX_FILE_BYTES {
        return Err(format!("{} bytes: an image file may have up to {MAX_FILE_BYTES}", metadata.len()));
    }
    bytes.clear();
    let file = std::fs::File::open(path).map_err(unreadable)?;
    file.take(limit).read_to_end(bytes).map_err(unreadable)?;
    Ok(metadata.len())
}

/// Reads image files; keeps its memory from one to the next.
#[derive(Debug)]
pub(super) struct Reader {
    target: Target,
    layer: Option<String>,
    pool: FramePool,
    converter: Converter,
    file: Vec<u8>,
    samples: Vec<u8>,
    /// What was last told of a header.
    noted: Vec<String>,
}

impl Reader {
    /// `layer` is the wanted one of EXR files.
    pub(super) fn new(target: Target, layer: Option<String>) -> Self {
        /// Enough for a pipeline; a reader that keeps more frames costs memory, not frames.
        const POOLED_FRAMES: usize = 8;
        let pool = FramePool::new(POOLED_FRAMES, 0);
        Self {
            target,
            layer,
            pool,
            converter: Converter::new(),
            file: Vec::new(),
            samples: Vec::new(),
            noted: Vec::new(),
        }
    }

    /// The frame in a file.
    ///
    /// # Errors
    /// A sentence that says what is wrong with the file.
    pub(super) fn read(&mut self, path: &Path) -> Result<Frame, String> {
        let mut file = std::mem::take(&mut self.file);
        let frame = read_bytes(path, MAX_FILE_BYTES, &mut file).and_then(|_| self.frame(path, &file));
        self.file = file;
        frame
    }

    fn frame(&mut self, path: &Path, bytes: &[u8]) -> Result<Frame, String> {
        let frame = match Kind::of_layer(bytes, self.layer.as_deref())? {
            Kind::Jpeg => self.jpeg(bytes),
            Kind::Pnm => self.pnm(bytes),
            Kind::Png => self.png(bytes),
            Kind::Linear => self.linear(path, bytes),
        }?;
        self.deliver(frame)
    }

    fn jpeg(&mut self, bytes: &[u8]) -> Result<Frame, String> {
        // Damage is found here and not by whoever decodes the frame.
        let header = JpegHeader::read(bytes).map_err(|error| error.to_string())?;
        let pixels = fill(&self.pool, bytes.len(), |pixels| {
            pixels.copy_from_slice(bytes);
            Ok(())
        })?;
        let mut frame = frame(PixelFormat::Mjpg, header.width_px, header.height_px, pixels)?;
        frame.color = ColorEncoding { matrix: YuvMatrix::Bt601, range: YuvRange::Full };
        Ok(frame)
    }

    fn pnm(&mut self, bytes: &[u8]) -> Result<Frame, String> {
        let Probe { format, width_px, height_px } = probe_bytes(bytes, None)?;
        let header = PnmHeader::read(bytes)?;
        if (bytes.len() as u64) < header.least_bytes() {
            return Err(format!(
                "truncated: {} bytes, at least {} are needed",
                bytes.len(),
                header.least_bytes()
            ));
        }
        let (white, is_depth) = (u32::from(header.white), matches!(self.target, Target::Depth { .. }));
        let scaled = |sample: u16, full: u32| (u32::from(sample) * full + white / 2) / white;
        let pixels = fill(&self.pool, row_bytes(format, width_px) * height_px as usize, |pixels| {
            if format == PixelFormat::Y16 {
                let mut codes = pixels.as_chunks_mut::<2>().0.iter_mut();
                return header.samples(bytes, &mut |sample| {
                    // Depth is counts; of an image the largest value is white.
                    let code = if is_depth { sample } else { scaled(sample, 65535) as u16 };
                    codes.next().into_iter().for_each(|out| *out = code.to_le_bytes());
                });
            }
            let mut codes = pixels.iter_mut();
            header.samples(bytes, &mut |sample| {
                codes.next().into_iter().for_each(|out| *out = scaled(sample, 255) as u8);
            })
        })?;
        frame(format, width_px, height_px, pixels)
    }

    fn png(&mut self, bytes: &[u8]) -> Result<Frame, String> {
        let decoder = png_decoder(bytes)?;
        let (width_px, height_px) = decoder.dimensions();
        check_size(width_px, height_px)?;
        let color = decoder.color_type();
        let format = png_format(color)?;
        let total = decoder.total_bytes();
        if total > bytes.len() as u64 * MAX_COMPRESSION {
            return Err(format!("{} bytes are too few for {width_px} x {height_px} pixels", bytes.len()));
        }
        self.samples.resize(total as usize, 0);
        decoder.read_image(&mut self.samples).map_err(|error| error.to_string())?;
        let samples = &self.samples;
        let pixels = fill(&self.pool, row_bytes(format, width_px) * height_px as usize, |pixels| {
            repack(color, samples, pixels);
            Ok(())
        })?;
        frame(format, width_px, height_px, pixels)
    }

    fn linear(&mut self, path: &Path, bytes: &[u8]) -> Result<Frame, String> {
        let layer = linear::layer(bytes, self.layer.as_deref())?;
        let (image, notes) = linear::read(bytes, &layer)?;
        // Once, not with each of a thousand frames.
        if notes != self.noted {
            notes.iter().for_each(|note| tracing::warn!("{}: {note}", path.display()));
            self.noted = notes;
        }
        let side = |px| u32::try_from(px).map_err(|_| format!("{px} pixels a side"));
        let (width_px, height_px) = (side(image.width())?, side(image.height())?);
        let len = row_bytes(PixelFormat::RgbF32, width_px) * height_px as usize;
        let pixels = fill(&self.pool, len, |pixels| linear::pack(&image, pixels))?;
        frame(PixelFormat::RgbF32, width_px, height_px, pixels)
    }

    /// From what the file holds to what is asked for.
    fn deliver(&mut self, mut frame: Frame) -> Result<Frame, String> {
        let format = self.target.format(frame.format)?;
        if let Target::Depth { unit_m, invalid } = self.target {
            frame.format = format;
            frame.depth_unit_m = Some(unit_m);
            if let Some(invalid) = invalid {
                frame.pixels = without_code(&self.pool, &frame.pixels, invalid)?;
            }
            return Ok(frame);
        }
        if format == frame.format {
            return Ok(frame);
        }
        let len = row_bytes(format, frame.width_px) * frame.height_px as usize;
        let converter = &mut self.converter;
        let pixels = fill(&self.pool, len, |pixels| {
            let converted = match format {
                PixelFormat::Grey => converter.grey(&frame, pixels),
                _ => converter.rgb24(&frame, pixels),
            };
            converted.map_err(|error| error.to_string())
        })?;
        self::frame(format, frame.width_px, frame.height_px, pixels)
    }
}

fn row_bytes(format: PixelFormat, width_px: u32) -> usize {
    format.bytes_per_row_pixel() as usize * width_px as usize
}

fn frame(format: PixelFormat, width_px: u32, height_px: u32, pixels: PixelBuffer) -> Result<Frame, String> {
    Frame::packed(format, width_px, height_px, pixels).map_err(|error| error.to_string())
}

/// A pooled buffer, or memory of its own if the reader holds all of the pool, filled by `write`.
fn fill(
    pool: &FramePool,
    len: usize,
    write: impl FnOnce(&mut [u8]) -> Result<(), String>,
) -> Result<PixelBuffer, String> {
    let mut pixels = pool.acquire(len).unwrap_or_else(|| PixelBufferMut::from_vec(vec![0; len]));
    write(&mut pixels)?;
    Ok(pixels.freeze())
}

/// Copies 16 bit codes with one of them replaced by 0.
fn without_code(pool: &FramePool, codes: &[u8], invalid: u16) -> Result<PixelBuffer, String> {
    fill(pool, codes.len(), |pixels| {
        let codes = codes.as_chunks::<2>().0;
        for (out, code) in pixels.as_chunks_mut::<2>().0.iter_mut().zip(codes) {
            *out = if u16::from_le_bytes(*code) == invalid { [0; 2] } else { *code };
        }
        Ok(())
    })
}

/// Decoded PNG samples (16 bit ones in native byte order) to a frame's bytes: alpha is left out, not multiplied in, and
/// 16 bit colour rounded to 8.
fn repack(color: ColorType, samples: &[u8], pixels: &mut [u8]) {
    let channels = usize::from(color.channel_count());
    let kept = if channels < 3 { 1 } else { 3 };
    let wide = color.bytes_per_pixel() as usize > channels;
    if !wide {
        for (out, pixel) in pixels.chunks_exact_mut(kept).zip(samples.chunks_exact(channels)) {
            out.copy_from_slice(&pixel[..kept]);
        }
        return;
    }
    let codes = samples.as_chunks::<2>().0;
    let wanted =
        codes.chunks_exact(channels).flat_map(|pixel| &pixel[..kept]).map(|code| u16::from_ne_bytes(*code));
    if kept == 1 {
        pixels
            .as_chunks_mut::<2>()
            .0
            .iter_mut()
            .zip(wanted)
            .for_each(|(out, code)| *out = code.to_le_bytes());
    } else {
        pixels.iter_mut().zip(wanted).for_each(|(out, code)| *out = crate::convert::high_8(code));
    }
}
