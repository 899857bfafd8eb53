//! One image as the sensor delivered it.

use std::time::Duration;

use crate::clock::Timestamp;
use crate::pixel_format::{ColorEncoding, PixelFormat};
use crate::pool::PixelBuffer;

/// Widest and highest frame that is accepted, in pixels: a larger one is taken for garbage.
pub const MAX_SIZE_PX: u32 = 16_384;

/// One image as the sensor delivered it, with what is known of how it was taken.
///
/// Cloning shares the pixels. Sizes of 4:2:2 formats are even across, of 4:2:0 formats even both ways, as V4L2 has
/// them: a source whose image is odd crops it or converts it.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Layout of the bytes.
    pub format: PixelFormat,
    /// Colour encoding of Y′CbCr formats.
    pub color: ColorEncoding,
    /// Width in pixels.
    pub width_px: u32,
    /// Height in pixels.
    pub height_px: u32,
    /// Bytes from one row to the next (of the Y plane for NV12, whose UV plane has the same); 0 for MJPG.
    pub stride_bytes: u32,
    /// The bytes, shared and pooled. The last row may end without padding.
    pub pixels: PixelBuffer,
    /// Middle of the exposure of the image's centre row, on the session's clock.
    pub captured: Timestamp,
    /// When this process got the frame.
    pub arrived: Timestamp,
    /// Counts up by one a frame as the device numbers them; a gap is a dropped frame.
    pub sequence: u64,
    /// Exposure time, if the device tells.
    pub exposure: Option<Duration>,
    /// Gain factor (1 = none), if the device tells.
    pub gain: Option<f32>,
    /// Metres a count for [`PixelFormat::Z16`], else `None`.
    pub depth_unit_m: Option<f64>,
}

/// Why bytes are no frame of the size and format they are said to have.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FrameError {
    /// No pixels, or absurdly many.
    #[error("a frame of {width_px} x {height_px} pixels: each side must be 1 to {MAX_SIZE_PX}")]
    Size {
        /// Width in pixels.
        width_px: u32,
        /// Height in pixels.
        height_px: u32,
    },
    /// Chroma is shared by pairs of pixels, and there is half a pair.
    #[error("a {format} frame of {width_px} x {height_px} pixels: {which} must be even, crop the image")]
    OddSize {
        /// Layout of the bytes.
        format: PixelFormat,
        /// Width in pixels.
        width_px: u32,
        /// Height in pixels.
        height_px: u32,
        /// What must be even.
        which: &'static str,
    },
    /// The rows would overlap, or a compressed frame was given a stride.
    #[error("a stride of {stride_bytes} bytes: a {format} frame {width_px} pixels wide needs {needed}")]
    Stride {
        /// Layout of the bytes.
        format: PixelFormat,
        /// Width in pixels.
        width_px: u32,
        /// The stride given.
        stride_bytes: u32,
        /// What it must be.
        needed: String,
    },
    /// The buffer ends before the image does.
    #[error(
        "{found_bytes} bytes: a {format} frame of {width_px} x {height_px} pixels with a stride of {stride_bytes} \
         bytes needs {needed_bytes}"
    )]
    TooShort {
        /// Layout of the bytes.
        format: PixelFormat,
        /// Width in pixels.
        width_px: u32,
        /// Height in pixels.
        height_px: u32,
        /// The stride given.
        stride_bytes: u32,
        /// Bytes needed at least.
        needed_bytes: u64,
        /// Bytes there are.
        found_bytes: usize,
    },
    /// A linear frame holds a value that is no number, or infinite.
    #[error("pixel ({x}, {y}): {channel} is {value}; a RGBF32 frame holds finite values only")]
    NotFinite {
        /// Column.
        x: usize,
        /// Row.
        y: u32,
        /// `red`, `green` or `blue`.
        channel: &'static str,
        /// What is there.
        value: f32,
    },
    /// A frame that should be depth is of another format.
    #[error("a {0} frame is no depth image: its format must be Z16")]
    NotDepth(PixelFormat),
    /// Depth without a usable unit.
    #[error("a depth frame needs its unit in metres a count, a positive number; it has {0:?}")]
    DepthUnit(Option<f64>),
}

impl Frame {
    /// A frame of `pixels`, checked, with stamps and number 0, default colour encoding, and nothing known of the
    /// exposure: set the public fields to what is known.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn new(
        format: PixelFormat,
        width_px: u32,
        height_px: u32,
        stride_bytes: u32,
        pixels: impl Into<PixelBuffer>,
    ) -> Result<Self, FrameError> {
        let frame = Self {
            format,
            color: ColorEncoding::default(),
            width_px,
            height_px,
            stride_bytes,
            pixels: pixels.into(),
            captured: Timestamp::default(),
            arrived: Timestamp::default(),
            sequence: 0,
            exposure: None,
            gain: None,
            depth_unit_m: None,
        };
        frame.check()?;
        Ok(frame)
    }

    /// [`new`](Self::new) for rows without padding between them.
    ///
    /// # Errors
    /// As [`check`](Self::check).
    pub fn packed(
        format: PixelFormat,
        width_px: u32,
        height_px: u32,
        pixels: impl Into<PixelBuffer>,
    ) -> Result<Self, FrameError> {
        // A width too large for the product is refused by the check of the size.
        let stride_bytes = width_px.saturating_mul(format.bytes_per_row_pixel());
        Self::new(format, width_px, height_px, stride_bytes, pixels)
    }

    /// Whether size, stride and number of bytes fit each other, and linear values are finite: what every reader of pixels
    /// relies on.
    ///
    /// # Errors
    /// [`FrameError::Size`], [`FrameError::OddSize`], [`FrameError::Stride`], [`FrameError::TooShort`] or
    /// [`FrameError::NotFinite`].
    pub fn check(&self) -> Result<(), FrameError> {
        let Self { format, width_px, height_px, stride_bytes, .. } = *self;
        check_size(format, width_px, height_px)?;
        let row_bytes = width_px * format.bytes_per_row_pixel();
        let stride_error = |needed| FrameError::Stride { format, width_px, stride_bytes, needed };
        if format == PixelFormat::Mjpg && stride_bytes != 0 {
            return Err(stride_error("0, for it has no rows".into()));
        }
        if stride_bytes < row_bytes {
            return Err(stride_error(format!("at least {row_bytes}")));
        }
        // The last row needs no padding behind it; a compressed frame has at least its first and last marker.
        let rows = u64::from(height_px) + u64::from(height_px / 2) * u64::from(format == PixelFormat::Nv12);
        let needed_bytes = match format {
            PixelFormat::Mjpg => 4,
            _ => (rows - 1) * u64::from(stride_bytes) + u64::from(row_bytes),
        };
        let found_bytes = self.pixels.len();
        if (found_bytes as u64) < needed_bytes {
            return Err(FrameError::TooShort {
                format,
                width_px,
                height_px,
                stride_bytes,
                needed_bytes,
                found_bytes,
            });
        }
        match format {
            PixelFormat::RgbF32 => self.check_finite(),
            _ => Ok(()),
        }
    }

    fn check_finite(&self) -> Result<(), FrameError> {
        for (y, row) in (0..self.height_px).filter_map(|y| Some((y, self.row(y)?))) {
            let values = || row.as_chunks::<4>().0.iter().map(|bytes| f32::from_le_bytes(*bytes));
            // Without a way out of the loop it becomes vector code.
            if values().fold(true, |all, value| all & value.is_finite()) {
                continue;
            }
            if let Some((at, value)) = values().enumerate().find(|(_, value)| !value.is_finite()) {
                let channel = ["red", "green", "blue"][at % 3];
                return Err(FrameError::NotFinite { x: at / 3, y, channel, value });
            }
        }
        Ok(())
    }

    /// The bytes of row `y` without padding: of the Y plane for NV12. `None` below the image, for MJPG, and for a
    /// frame that [`check`](Self::check) would refuse.
    pub fn row(&self, y: u32) -> Option<&[u8]> {
        if y >= self.height_px || self.format == PixelFormat::Mjpg {
            return None;
        }
        self.row_at(y)
    }

    /// The linear red, green and blue of row `y`, left to right; empty below the image and for other formats than RGBF32.
    pub fn rgb_f32_row(&self, y: u32) -> impl Iterator<Item = [f32; 3]> + '_ {
        let row = self.row(y).filter(|_| self.format == PixelFormat::RgbF32).unwrap_or(&[]);
        let values = row.as_chunks::<4>().0.as_chunks::<3>().0.iter();
        values.map(|pixel| pixel.map(f32::from_le_bytes))
    }

    /// The interleaved `U V` bytes of chroma row `y` (half as many as image rows); `None` for other formats than NV12.
    pub fn chroma_row(&self, y: u32) -> Option<&[u8]> {
        if self.format != PixelFormat::Nv12 || y >= self.height_px / 2 {
            return None;
        }
        self.row_at(self.height_px.checked_add(y)?)
    }

    fn row_at(&self, y: u32) -> Option<&[u8]> {
        let start = usize::try_from(u64::from(y) * u64::from(self.stride_bytes)).ok()?;
        let len = (self.width_px as usize).checked_mul(self.format.bytes_per_row_pixel() as usize)?;
        self.pixels.get(start..start.checked_add(len)?)
    }

    /// Number of pixels.
    pub fn pixel_count(&self) -> usize {
        self.width_px as usize * self.height_px as usize
    }
}

fn check_size(format: PixelFormat, width_px: u32, height_px: u32) -> Result<(), FrameError> {
    let allowed = 1..=MAX_SIZE_PX;
    if !allowed.contains(&width_px) || !allowed.contains(&height_px) {
        return Err(FrameError::Size { width_px, height_px });
    }
    let which = match format {
        PixelFormat::Yuyv | PixelFormat::Uyvy if !width_px.is_multiple_of(2) => "the width",
        PixelFormat::Nv12 if !(width_px | height_px).is_multiple_of(2) => "both",
        _ => return Ok(()),
    };
    Err(FrameError::OddSize { format, width_px, height_px, which })
}

/// A depth image: a [`Frame`] of format Z16 whose unit is known.
///
/// Depth is along the optical axis (`depth_z_m` of the conventions).
#[derive(Clone, Debug)]
pub struct DepthFrame {
    frame: Frame,
    unit_m: f64,
}

impl DepthFrame {
    /// The depth at column `x`, row `y` in metres; `None` where nothing was measured and outside the image.
    pub fn depth_m(&self, x: u32, y: u32) -> Option<f64> {
        if x >= self.frame.width_px {
            return None;
        }
        let at = x as usize * 2;
        let code = match self.frame.row(y)?.get(at..at + 2)? {
            &[low, high] => u16::from_le_bytes([low, high]),
            _ => return None,
        };
        (code != 0).then(|| f64::from(code) * self.unit_m)
    }

    /// Metres a count.
    pub fn unit_m(&self) -> f64 {
        self.unit_m
    }

    /// The frame underneath.
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The counts of row `y`, left to right, 0 where nothing was measured; empty below the image.
    pub fn row_codes(&self, y: u32) -> impl Iterator<Item = u16> + '_ {
        let row = self.frame.row(y).unwrap_or(&[]);
        row.as_chunks::<2>().0.iter().map(|&code| u16::from_le_bytes(code))
    }
}

impl TryFrom<Frame> for DepthFrame {
    type Error = FrameError;

    fn try_from(frame: Frame) -> Result<Self, FrameError> {
        frame.check()?;
        if frame.format != PixelFormat::Z16 {
            return Err(FrameError::NotDepth(frame.format));
        }
        match frame.depth_unit_m {
            Some(unit_m) if unit_m.is_finite() && unit_m > 0.0 => Ok(Self { frame, unit_m }),
            other => Err(FrameError::DepthUnit(other)),
        }
    }
}
