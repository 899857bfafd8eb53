//! A borrowed 8-bit image: what detection and refinement look at.

use coshade_capture::{Frame, PixelFormat};

/// Brightness codes of an image, borrowed. In camera coordinates: the centre of pixel (0, 0) is at (0, 0).
#[derive(Clone, Copy, Debug)]
pub struct Luma<'a> {
    pixels: &'a [u8],
    width_px: u32,
    height_px: u32,
    stride_bytes: u32,
}

/// Why bytes are no image.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LumaError {
    /// No pixels, or rows that overlap.
    #[error(
        "an image of {width_px} x {height_px} pixels with {stride_bytes} bytes a row: it needs pixels, and rows at least as long as its width"
    )]
    Size {
        /// Width in pixels.
        width_px: u32,
        /// Height in pixels.
        height_px: u32,
        /// Bytes from one row to the next.
        stride_bytes: u32,
    },
    /// The bytes end before the image does.
    #[error("an image of {width_px} x {height_px} pixels has {found_bytes} bytes and needs {needed_bytes}")]
    TooShort {
        /// Width in pixels.
        width_px: u32,
        /// Height in pixels.
        height_px: u32,
        /// Bytes needed at least.
        needed_bytes: u64,
        /// Bytes there are.
        found_bytes: usize,
    },
}

impl<'a> Luma<'a> {
    /// An image of `pixels`, whose last row may end without padding.
    ///
    /// # Errors
    /// [`LumaError`] if the bytes are not that image.
    pub fn new(
        pixels: &'a [u8],
        width_px: u32,
        height_px: u32,
        stride_bytes: u32,
    ) -> Result<Self, LumaError> {
        if width_px == 0 || height_px == 0 || stride_bytes < width_px {
            return Err(LumaError::Size { width_px, height_px, stride_bytes });
        }
        let needed_bytes = u64::from(height_px - 1) * u64::from(stride_bytes) + u64::from(width_px);
        if (pixels.len() as u64) < needed_bytes {
            return Err(LumaError::TooShort { width_px, height_px, needed_bytes, found_bytes: pixels.len() });
        }
        Ok(Self { pixels, width_px, height_px, stride_bytes })
    }

    /// The brightness of a frame that has it as a plane of its own (GREY, NV12), without a copy; `None` for other
    /// formats, which [`coshade_capture::Converter::grey_frame`] converts.
    pub fn of_frame(frame: &'a Frame) -> Option<Self> {
        match frame.format {
            PixelFormat::Grey | PixelFormat::Nv12 => {
                Self::new(&frame.pixels, frame.width_px, frame.height_px, frame.stride_bytes).ok()
            }
            _ => None,
        }
    }

    /// Width in pixels.
    pub fn width_px(&self) -> u32 {
        self.width_px
    }

    /// Height in pixels.
    pub fn height_px(&self) -> u32 {
        self.height_px
    }

    /// Bytes from one row to the next.
    pub fn stride_bytes(&self) -> u32 {
        self.stride_bytes
    }

    /// The bytes, from the first pixel on.
    pub fn bytes(&self) -> &'a [u8] {
        self.pixels
    }

    /// Row `y`, empty below the image.
    #[inline]
    pub fn row(&self, y: u32) -> &'a [u8] {
        let start = y as usize * self.stride_bytes as usize;
        match y < self.height_px {
            true => self.pixels.get(start..start + self.width_px as usize).unwrap_or(&[]),
            false => &[],
        }
    }

    /// The code at column `x` of row `y`, `None` outside.
    #[inline]
    pub fn get(&self, x: u32, y: u32) -> Option<u8> {
        self.row(y).get(x as usize).copied()
    }

    /// The part that starts at column `x` of row `y`, without a copy, as much of it as lies inside; `None` if nothing does.
    pub fn crop(&self, x: u32, y: u32, width_px: u32, height_px: u32) -> Option<Self> {
        let start = u64::from(y) * u64::from(self.stride_bytes) + u64::from(x);
        let (width_px, height_px) =
            (width_px.min(self.width_px.checked_sub(x)?), height_px.min(self.height_px.checked_sub(y)?));
        let pixels = self.pixels.get(usize::try_from(start).ok()?..)?;
        Self::new(pixels, width_px, height_px, self.stride_bytes).ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_shares_the_bytes() {
        let bytes: Vec<u8> = (0..=255).collect();
        let image = Luma::new(&bytes, 14, 16, 16).unwrap();
        let part = image.crop(3, 5, 100, 2).unwrap();
        assert_eq!((part.width_px(), part.height_px()), (11, 2));
        assert_eq!(part.get(0, 0), Some(5 * 16 + 3));
        assert_eq!(part.get(10, 1), image.get(13, 6));
        assert_eq!((part.get(11, 0), part.get(0, 2)), (None, None));
        assert!(image.crop(14, 0, 1, 1).is_none() && image.crop(0, 16, 1, 1).is_none());
    }

    #[test]
    fn what_is_no_image_is_refused() {
        for (width, height, stride) in
            [(0, 1, 1), (1, 0, 1), (5, 5, 4), (16, 17, 16), (u32::MAX, u32::MAX, u32::MAX)]
        {
            assert!(Luma::new(&[0; 256], width, height, stride).is_err());
        }
        // The last row needs no padding.
        assert!(Luma::new(&[0; 25], 1, 2, 24).is_ok());
    }
}
