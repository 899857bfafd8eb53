//! From any pixel format to R′G′B′ or luminance.
//!
//! This is the one decode path of the project: the promise that a camera pixel which nothing virtual touches leaves
//! with the code value it came with is about the codes of [`Converter::rgb24`]. [`Converter::rgb_f32`] is those very
//! codes divided by 255, so `round(255 x)` gives them back bit for bit. Whoever decodes elsewhere (on a GPU, say)
//! breaks the promise unless the result is the same to the bit.
//!
//! **Rounding**: the formulas of ITU-R BT.601 and BT.709 are evaluated in 32 bit floating point, clipped to 0…255, and
//! rounded to nearest, halves to even. Over all code triples that is within 0.5 + 1e-4 of the exact value.
//!
//! **Chroma** of 4:2:2 and 4:2:0 is where MPEG-2, H.264 and V4L2 put it: horizontally on the even columns, vertically
//! between two rows. [`ChromaUpsampling`] says how the pixels between get theirs.
//!
//! **JPEG** is decoded by the crate `zune-jpeg`, whose chroma sits between the pixels both ways as JFIF has it, and is
//! upsampled linearly (the "fancy upsampling" of libjpeg). Its frames are BT.601, full range, whatever
//! [`Frame::color`] says.
//!
//! **Linear frames** (RGBF32) have no codes. [`Converter::rgb_f32`] gives their values as they are, which are the codes of
//! a linear response; [`Converter::rgb24`] and [`Converter::grey`] give a picture to look at and to find tags in, clipped
//! and encoded as sRGB.

pub mod jpeg;
mod linear;
mod yuv;

use crate::frame::{Frame, FrameError};
use crate::pixel_format::PixelFormat;
use crate::pool::FramePool;
use yuv::YuvRows;

/// Where pixels between chroma samples get their chroma from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ChromaUpsampling {
    /// Interpolated at the pixel's place: no colour fringe of a pixel's width at edges. What rendering wants.
    #[default]
    Linear,
    /// The sample of the pixel's own group, as OpenCV and libyuv do: half a pixel off, but the same codes as theirs.
    Nearest,
}

/// Converts frames; holds the memory that it needs, so that a stream of frames of one size allocates nothing
/// (MJPG apart: `zune-jpeg` allocates for each image).
#[derive(Clone, Debug, Default)]
pub struct Converter {
    chroma: ChromaUpsampling,
    rows: YuvRows,
    rgb: Vec<u8>,
    jpeg: jpeg::Decoder,
}

/// Why a frame could not be converted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ConvertError {
    /// The frame contradicts itself.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The output has not the size of the frame.
    #[error("the output holds {found} values, the frame needs {needed}")]
    Output {
        /// Values needed.
        needed: usize,
        /// Values there are.
        found: usize,
    },
    /// An MJPG frame is no readable JPEG image.
    #[error(transparent)]
    Jpeg(#[from] jpeg::JpegError),
}

impl Converter {
    /// A converter with linear chroma upsampling.
    pub fn new() -> Self {
        Self::default()
    }

    /// A converter with the given chroma upsampling of the YUV formats (JPEG is always upsampled linearly).
    pub fn with_chroma(chroma: ChromaUpsampling) -> Self {
        Self { chroma, ..Self::default() }
    }

    /// 8 bit R′G′B′, row by row without padding: `3 · width · height` bytes.
    ///
    /// Formats of one channel give three equal ones; their 16 bits are divided by 257 and rounded. Linear values are clipped
    /// to 0…1, encoded as sRGB and rounded.
    ///
    /// # Errors
    /// [`ConvertError`]; the output's content is then unspecified.
    pub fn rgb24(&mut self, frame: &Frame, out: &mut [u8]) -> Result<(), ConvertError> {
        check(frame, out.len(), 3)?;
        let row_len = frame.width_px as usize * 3;
        match frame.format {
            PixelFormat::Mjpg => self.jpeg.decode(frame, jpeg::Channels::Rgb, out)?,
            PixelFormat::Yuyv | PixelFormat::Uyvy | PixelFormat::Nv12 => {
                self.rows.convert(frame, self.chroma, out);
            }
            PixelFormat::Rgb24 => each_row(frame, out, row_len, |row, out| out.copy_from_slice(row)),
            PixelFormat::Grey => each_row(frame, out, row_len, |row, out| {
                spread(row.iter().copied(), out);
            }),
            PixelFormat::Y16 | PixelFormat::Z16 => each_row(frame, out, row_len, |row, out| {
                spread(codes_16(row).map(high_8), out);
            }),
            PixelFormat::RgbF32 => each_linear(frame, out, |rgb| rgb.map(linear::code)),
        }
        Ok(())
    }

    /// R′G′B′ from 0 to 1, row by row without padding: `3 · width · height` values.
    ///
    /// The codes of [`rgb24`](Self::rgb24) divided by 255; for 16 bit formats the codes divided by 65535; linear values as
    /// they are, neither clipped nor encoded.
    ///
    /// # Errors
    /// As [`rgb24`](Self::rgb24).
    pub fn rgb_f32(&mut self, frame: &Frame, out: &mut [f32]) -> Result<(), ConvertError> {
        check(frame, out.len(), 3)?;
        if matches!(frame.format, PixelFormat::Y16 | PixelFormat::Z16) {
            let row_len = frame.width_px as usize * 3;
            each_row(frame, out, row_len, |row, out| {
                spread(codes_16(row).map(|code| f32::from(code) / 65535.0), out);
            });
            return Ok(());
        }
        if frame.format == PixelFormat::RgbF32 {
            each_linear(frame, out, |rgb| rgb);
            return Ok(());
        }
        let mut rgb = std::mem::take(&mut self.rgb);
        rgb.resize(out.len(), 0);
        let converted = self.rgb24(frame, &mut rgb);
        for (out, code) in out.iter_mut().zip(&rgb) {
            *out = f32::from(*code) / 255.0;
        }
        self.rgb = rgb;
        converted
    }

    /// 8 bit luminance for detectors, row by row without padding: `width · height` bytes.
    ///
    /// The Y codes themselves where the format has them (in the range they were coded in; MJPG as JPEG's Y), else
    /// Y′ = 0.299 R′ + 0.587 G′ + 0.114 B′ of the codes of [`rgb24`](Self::rgb24), rounded. For GREY and NV12 the same bytes are in the frame already: its
    /// [`row`](Frame::row)s can be read without a copy.
    ///
    /// # Errors
    /// As [`rgb24`](Self::rgb24).
    pub fn grey(&mut self, frame: &Frame, out: &mut [u8]) -> Result<(), ConvertError> {
        check(frame, out.len(), 1)?;
        let row_len = frame.width_px as usize;
        match frame.format {
            PixelFormat::Mjpg => self.jpeg.decode(frame, jpeg::Channels::Luma, out)?,
            PixelFormat::Grey | PixelFormat::Nv12 => {
                each_row(frame, out, row_len, |row, out| out.copy_from_slice(row));
            }
            PixelFormat::Yuyv => each_row(frame, out, row_len, |row, out| every_second(row, 0, out)),
            PixelFormat::Uyvy => each_row(frame, out, row_len, |row, out| every_second(row, 1, out)),
            PixelFormat::Y16 | PixelFormat::Z16 => each_row(frame, out, row_len, |row, out| {
                out.iter_mut().zip(codes_16(row)).for_each(|(out, code)| *out = high_8(code));
            }),
            PixelFormat::Rgb24 => each_row(frame, out, row_len, |row, out| {
                out.iter_mut().zip(row.as_chunks::<3>().0).for_each(|(out, rgb)| *out = luma_601(*rgb));
            }),
            PixelFormat::RgbF32 => each_linear(frame, out, |rgb| [luma_601(rgb.map(linear::code))]),
        }
        Ok(())
    }

    /// [`rgb24`](Self::rgb24) into a frame of `pool`, everything else as in `frame`; `None` if the pool is empty.
    ///
    /// # Errors
    /// As [`rgb24`](Self::rgb24).
    pub fn rgb24_frame(&mut self, frame: &Frame, pool: &FramePool) -> Result<Option<Frame>, ConvertError> {
        self.pooled_frame(frame, pool, PixelFormat::Rgb24, Self::rgb24)
    }

    /// [`grey`](Self::grey) into a frame of `pool`, everything else as in `frame`; `None` if the pool is empty.
    ///
    /// # Errors
    /// As [`rgb24`](Self::rgb24).
    pub fn grey_frame(&mut self, frame: &Frame, pool: &FramePool) -> Result<Option<Frame>, ConvertError> {
        self.pooled_frame(frame, pool, PixelFormat::Grey, Self::grey)
    }

    fn pooled_frame(
        &mut self,
        frame: &Frame,
        pool: &FramePool,
        format: PixelFormat,
        convert: impl FnOnce(&mut Self, &Frame, &mut [u8]) -> Result<(), ConvertError>,
    ) -> Result<Option<Frame>, ConvertError> {
        frame.check()?;
        let stride_bytes = frame.width_px * format.bytes_per_row_pixel();
        let Some(mut pixels) = pool.acquire(stride_bytes as usize * frame.height_px as usize) else {
            return Ok(None);
        };
        convert(self, frame, &mut pixels)?;
        Ok(Some(Frame { format, stride_bytes, pixels: pixels.freeze(), depth_unit_m: None, ..frame.clone() }))
    }
}

fn check(frame: &Frame, found: usize, channels: usize) -> Result<(), ConvertError> {
    frame.check()?;
    let needed = frame.pixel_count() * channels;
    if found == needed { Ok(()) } else { Err(ConvertError::Output { needed, found }) }
}

/// Calls `convert` with each row of the frame and of the output.
fn each_row<T>(frame: &Frame, out: &mut [T], row_len: usize, mut convert: impl FnMut(&[u8], &mut [T])) {
    for (y, out) in (0..frame.height_px).zip(out.chunks_exact_mut(row_len)) {
        if let Some(row) = frame.row(y) {
            convert(row, out);
        }
    }
}

/// Writes what `convert` makes of each pixel of a linear frame.
fn each_linear<T, const N: usize>(frame: &Frame, out: &mut [T], convert: impl Fn([f32; 3]) -> [T; N]) {
    for (y, out) in (0..frame.height_px).zip(out.chunks_exact_mut(frame.width_px as usize * N)) {
        let pixels = out.as_chunks_mut::<N>().0.iter_mut();
        pixels.zip(frame.rgb_f32_row(y)).for_each(|(out, rgb)| *out = convert(rgb));
    }
}

/// Writes each value three times.
fn spread<T: Copy>(values: impl Iterator<Item = T>, out: &mut [T]) {
    for (out, value) in out.as_chunks_mut::<3>().0.iter_mut().zip(values) {
        *out = [value; 3];
    }
}

fn every_second(row: &[u8], first: usize, out: &mut [u8]) {
    for (out, pair) in out.iter_mut().zip(row.as_chunks::<2>().0) {
        *out = pair[first];
    }
}

fn codes_16(row: &[u8]) -> impl Iterator<Item = u16> + '_ {
    row.as_chunks::<2>().0.iter().map(|&code| u16::from_le_bytes(code))
}

/// 65535 → 255, rounded to nearest (257 is odd: there are no halves).
pub(crate) fn high_8(code: u16) -> u8 {
    ((u32::from(code) + 128) / 257) as u8
}

/// Luma of BT.601 in 16 bit fixed point; the three weights add up to one.
fn luma_601([r, g, b]: [u8; 3]) -> u8 {
    ((19595 * u32::from(r) + 38470 * u32::from(g) + 7471 * u32::from(b) + 32768) >> 16) as u8
}
