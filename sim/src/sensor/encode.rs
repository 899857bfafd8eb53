//! From R′G′B′ codes or linear light to the bytes of a pixel format: the inverse of `coshade_capture::convert`.

use coshade_capture::{ColorEncoding, Frame, FrameError, PixelFormat, YuvMatrix, YuvRange};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Quality of Motion JPEG frames, as webcams have it.
pub const JPEG_QUALITY: u8 = 92;

/// What a sensor delivers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FormatSpec {
    /// 4:2:2, `Y0 U Y1 V`; the width must be even.
    #[default]
    Yuyv,
    /// 4:2:2, `U Y0 V Y1`; the width must be even.
    Uyvy,
    /// 4:2:0; width and height must be even.
    Nv12,
    /// Luminance.
    Grey,
    /// R′G′B′.
    Rgb24,
    /// Linear light as 32 bit floating point: the sensor's signal without response, clipping and quantisation. Its
    /// calibration has a linear response.
    RgbF32,
    /// Motion JPEG, quality 92, chroma at full resolution.
    Mjpg,
    /// Depth: makes the sensor a depth camera.
    Z16,
}

impl FormatSpec {
    /// The format of the frames.
    pub fn pixel_format(self) -> PixelFormat {
        match self {
            Self::Yuyv => PixelFormat::Yuyv,
            Self::Uyvy => PixelFormat::Uyvy,
            Self::Nv12 => PixelFormat::Nv12,
            Self::Grey => PixelFormat::Grey,
            Self::Rgb24 => PixelFormat::Rgb24,
            Self::RgbF32 => PixelFormat::RgbF32,
            Self::Mjpg => PixelFormat::Mjpg,
            Self::Z16 => PixelFormat::Z16,
        }
    }
}

/// Why codes make no frame.
#[derive(Debug, thiserror::Error)]
pub enum EncodeError {
    /// The size does not suit the format.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// Of the JPEG encoder.
    #[error("JPEG: {0}")]
    Jpeg(#[from] image::ImageError),
    /// No image format.
    #[error("{0} holds no codes of colours")]
    NoImage(PixelFormat),
}

/// The colour encoding of simulated frames: BT.601, as webcams have it; JPEG of full range, the rest limited.
pub fn color(format: PixelFormat) -> ColorEncoding {
    let range = if format == PixelFormat::Mjpg { YuvRange::Full } else { YuvRange::Limited };
    ColorEncoding { matrix: YuvMatrix::Bt601, range }
}

/// A frame of R′G′B′ codes (row by row, no padding), without stamps.
///
/// Luma and chroma by ITU-R BT.601, limited range, rounded to nearest. Chroma of 4:2:2 is filtered by ¼ ½ ¼ around the
/// even columns, of 4:2:0 also averaged over two rows: where `convert` expects it.
///
/// # Errors
/// [`EncodeError`] for a size that the format cannot have.
pub fn encode(codes: &[u8], [width, height]: [u32; 2], format: PixelFormat) -> Result<Frame, EncodeError> {
    let rgb = codes.as_chunks::<3>().0;
    let columns = width as usize;
    let luma = || rgb.iter().map(|rgb| code(16.0 + 219.0 / 255.0 * luminance(*rgb)));
    let bytes: Vec<u8> = match format {
        PixelFormat::Rgb24 => codes.to_vec(),
        PixelFormat::Grey => rgb.iter().map(|rgb| code(luminance(*rgb))).collect(),
        PixelFormat::Yuyv => packed(luma(), rgb, columns, |y, uv| [y, uv]),
        PixelFormat::Uyvy => packed(luma(), rgb, columns, |y, uv| [uv, y]),
        PixelFormat::Nv12 => {
            let mut bytes: Vec<u8> = luma().collect();
            for pair in rgb.chunks(2 * columns.max(1)) {
                let (upper, lower) = pair.split_at(columns.min(pair.len()));
                let lower = if lower.is_empty() { upper } else { lower };
                let rows = row_chroma(upper).zip(row_chroma(lower));
                bytes.extend(rows.flat_map(|(a, b)| [code((a[0] + b[0]) / 2.0), code((a[1] + b[1]) / 2.0)]));
            }
            bytes
        }
        PixelFormat::Mjpg => jpeg(codes, [width, height])?,
        other => return Err(EncodeError::NoImage(other)),
    };
    let mut frame = match format {
        PixelFormat::Mjpg => Frame::new(format, width, height, 0, bytes)?,
        _ => Frame::packed(format, width, height, bytes)?,
    };
    frame.color = color(format);
    Ok(frame)
}

/// A frame of linear light (row by row), without stamps.
///
/// # Errors
/// [`EncodeError::Frame`] for light that is no number, or infinite.
pub fn encode_linear(light: &[[f32; 3]], [width, height]: [u32; 2]) -> Result<Frame, EncodeError> {
    let bytes: Vec<u8> = light.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
    Ok(Frame::packed(PixelFormat::RgbF32, width, height, bytes)?)
}

fn jpeg(codes: &[u8], [width, height]: [u32; 2]) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut bytes, JPEG_QUALITY);
    encoder.write_image(codes, width, height, ExtendedColorType::Rgb8)?;
    Ok(bytes)
}

/// 4:2:2: each luma with one of the two chroma of its pair of pixels.
fn packed(
    luma: impl Iterator<Item = u8>,
    rgb: &[[u8; 3]],
    columns: usize,
    order: fn(u8, u8) -> [u8; 2],
) -> Vec<u8> {
    let chroma = rgb.chunks(columns.max(1)).flat_map(|row| row_chroma(row).flatten());
    luma.zip(chroma).flat_map(|(y, chroma)| order(y, code(chroma))).collect()
}

/// Cb and Cr (limited range, not rounded) at the even columns.
fn row_chroma(row: &[[u8; 3]]) -> impl Iterator<Item = [f32; 2]> + '_ {
    let at = |column: usize| row.get(column.min(row.len() - 1)).map_or([128.0; 2], |rgb| chroma(*rgb));
    (0..row.len()).step_by(2).map(move |column| {
        let (left, middle, right) = (at(column.saturating_sub(1)), at(column), at(column + 1));
        [0, 1].map(|i: usize| left[i] / 4.0 + middle[i] / 2.0 + right[i] / 4.0)
    })
}

/// Y′ from 0 to 255 (ITU-R BT.601-7, 2.5.1).
fn luminance([r, g, b]: [u8; 3]) -> f32 {
    0.299 * f32::from(r) + 0.587 * f32::from(g) + 0.114 * f32::from(b)
}

/// Cb and Cr in limited range (ITU-R BT.601-7, 2.5.2).
fn chroma([r, g, b]: [u8; 3]) -> [f32; 2] {
    let y = luminance([r, g, b]);
    let scale = 224.0 / 255.0;
    [128.0 + scale * (f32::from(b) - y) / 1.772, 128.0 + scale * (f32::from(r) - y) / 1.402]
}

fn code(value: f32) -> u8 {
    value.round().clamp(0.0, 255.0) as u8
}

#[cfg(test)]
mod tests {
    use coshade_capture::Converter;

    use super::*;

    /// Colours that change slowly, so that subsampled chroma loses nothing to speak of.
    fn smooth(width: u32, height: u32) -> Vec<u8> {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        pixels.flat_map(|(x, y)| [40 + x as u8, 60 + y as u8, 200 - x as u8]).collect()
    }

    #[test]
    fn what_is_encoded_is_decoded_again() {
        let size = [64, 48];
        let codes = smooth(64, 48);
        // Luma, Cb and Cr are each off by half a code at most: in green by (0.5·255/219) + 0.5·255/224·(0.344 + 0.714),
        // 1.19 codes, in blue by 0.58 + 0.57·1.772, 1.59; half a code for rounding, and the border columns and rows, whose
        // chroma is of half a slope further in, 0.9 of a code. JPEG at quality 92: steps up to 16 codes in the highest frequencies,
        // 2 or 3 in the lowest, of which a slope consists.
        let allowed = [
            (PixelFormat::Rgb24, 0),
            (PixelFormat::Yuyv, 3),
            (PixelFormat::Uyvy, 3),
            (PixelFormat::Nv12, 3),
            (PixelFormat::Mjpg, 5),
        ];
        for (format, worst_allowed) in allowed {
            let frame = encode(&codes, size, format).unwrap();
            let mut decoded = vec![0; codes.len()];
            Converter::new().rgb24(&frame, &mut decoded).unwrap();
            let worst = codes.iter().zip(&decoded).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
            assert!(worst <= worst_allowed, "{format}: {worst}");
        }
    }

    #[test]
    fn grey_is_luminance() {
        let frame = encode(&[255, 255, 255, 255, 0, 0], [2, 1], PixelFormat::Grey).unwrap();
        assert_eq!(frame.row(0), Some(&[255, 76][..]));
    }

    #[test]
    fn jpeg_keeps_chroma_at_full_resolution() {
        // Columns of red and blue in turn: halved chroma would make them all alike.
        let codes: Vec<u8> =
            (0..16 * 16).flat_map(|i| if i % 2 == 0 { [200, 40, 40] } else { [40, 40, 200] }).collect();
        let frame = encode(&codes, [16, 16], PixelFormat::Mjpg).unwrap();
        let mut decoded = vec![0; codes.len()];
        Converter::new().rgb24(&frame, &mut decoded).unwrap();
        assert!(decoded[0] > 150 && decoded[3] < 90, "{:?}", &decoded[..6]);
    }

    #[test]
    fn sizes_must_suit_the_format() {
        assert!(encode(&[0; 9], [3, 1], PixelFormat::Yuyv).is_err());
        assert!(encode(&[0; 6], [2, 1], PixelFormat::Nv12).is_err());
        assert!(matches!(encode(&[0; 6], [2, 1], PixelFormat::Z16), Err(EncodeError::NoImage(_))));
    }
}
