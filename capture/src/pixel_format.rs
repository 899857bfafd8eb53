//! How the bytes of a frame are to be read.

use std::fmt;

use coshade_lens::calibration::Response;

/// Layout of a frame's bytes, named after the V4L2 code; V4L2 has none for [`PixelFormat::RgbF32`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PixelFormat {
    /// 4:2:2, 8 bit, `Y0 U Y1 V`, 2 bytes a pixel.
    Yuyv,
    /// 4:2:2, 8 bit, `U Y0 V Y1`, 2 bytes a pixel.
    Uyvy,
    /// 4:2:0, 8 bit: a plane of Y, then a plane of interleaved `U V` at half resolution.
    Nv12,
    /// 8 bit luminance.
    Grey,
    /// 16 bit luminance, little endian.
    Y16,
    /// 16 bit depth, little endian; 0 = no measurement. The frame holds the unit.
    Z16,
    /// 8 bit R'G'B', 3 bytes a pixel.
    Rgb24,
    /// Linear RGB signal of the sensor, 32 bit floating point, little endian, 12 bytes a pixel.
    ///
    /// Proportional to radiance × exposure × gain × vignetting, without noise reduction, clipping or response; 1 is code
    /// white, and values may lie above it (or below 0, of noise around black). Every value is finite. A calibration of such
    /// frames has a linear response.
    RgbF32,
    /// One JPEG image a frame (Motion JPEG).
    Mjpg,
}

impl PixelFormat {
    /// Bytes a pixel takes in a row (of the Y plane for NV12); 0 for MJPG, which has no rows.
    pub const fn bytes_per_row_pixel(self) -> u32 {
        match self {
            Self::Mjpg => 0,
            Self::Nv12 | Self::Grey => 1,
            Self::Yuyv | Self::Uyvy | Self::Y16 | Self::Z16 => 2,
            Self::Rgb24 => 3,
            Self::RgbF32 => 12,
        }
    }
}

/// A calibration that cannot be the one of linear frames.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{format} frames hold linear light, but the calibration's response is `{response}`: use a calibration with \
     response = {{ kind = \"linear\" }}"
)]
pub struct ResponseMismatch {
    /// Layout of the frames.
    pub format: PixelFormat,
    /// [`Response::kind`] of the calibration.
    pub response: &'static str,
}

impl PixelFormat {
    /// Whether a calibration with this response can be the one of such frames: linear ones have a linear response.
    ///
    /// # Errors
    /// [`ResponseMismatch`] names both.
    pub fn check_response(self, response: &Response) -> Result<(), ResponseMismatch> {
        let is_linear = match response {
            Response::Linear => true,
            Response::Gamma { gamma } => *gamma == 1.0,
            Response::Srgb | Response::Rec709 | Response::Table(_) => false,
        };
        match self {
            Self::RgbF32 if !is_linear => Err(ResponseMismatch { format: self, response: response.kind() }),
            _ => Ok(()),
        }
    }
}

impl fmt::Display for PixelFormat {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Yuyv => "YUYV",
            Self::Uyvy => "UYVY",
            Self::Nv12 => "NV12",
            Self::Grey => "GREY",
            Self::Y16 => "Y16",
            Self::Z16 => "Z16",
            Self::Rgb24 => "RGB24",
            Self::RgbF32 => "RGBF32",
            Self::Mjpg => "MJPG",
        })
    }
}

/// Which luma coefficients made Y′CbCr from R′G′B′.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum YuvMatrix {
    /// ITU-R BT.601: standard definition video and JPEG.
    #[default]
    Bt601,
    /// ITU-R BT.709: high definition video.
    Bt709,
}

/// Which code values stand for black and white in Y′CbCr.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum YuvRange {
    /// 0…255 for all channels, as JPEG has it.
    Full,
    /// 16…235 for Y′, 16…240 for Cb and Cr.
    #[default]
    Limited,
}

/// The colour encoding of a Y′CbCr frame, as the device reports it. Ignored for formats without chroma subsampling.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
pub struct ColorEncoding {
    /// Luma coefficients.
    pub matrix: YuvMatrix,
    /// Code range.
    pub range: YuvRange,
}
