//! Makes frames of images that other programs recorded, without our own description beside them.

use super::image_message::{ImageKind, ImageMessage};
use crate::clock::Timestamp;
use crate::frame::{Frame, MAX_SIZE_PX};
use crate::pixel_format::{ColorEncoding, PixelFormat, YuvRange};
use crate::pool::PixelBuffer;

/// Metres a count of a depth image in ROS (REP 118).
pub(crate) const ROS_DEPTH_UNIT_M: f64 = 0.001;

/// How the bytes of a foreign image become a frame's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Change {
    None,
    /// 3 bytes a pixel in the order B G R.
    SwapRedBlue,
    /// 4 bytes a pixel, the last is dropped.
    DropAlpha {
        swap: bool,
    },
}

impl Change {
    /// Bytes of a pixel before the change.
    const fn pixel_bytes(self) -> usize {
        match self {
            Self::None => 1,
            Self::SwapRedBlue => 3,
            Self::DropAlpha { .. } => 4,
        }
    }
}

/// What is known of a foreign stream beside its images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ForeignStream {
    /// 16 bit images are depth with this unit.
    pub(crate) depth_unit_m: Option<f64>,
}

/// The frame in a foreign image message that was logged at `log_time_ns` as number `sequence` of its stream.
///
/// `pixels` gives a buffer of so many bytes and lets them be filled.
///
/// # Errors
/// What is not supported or contradicts itself.
pub(crate) fn frame(
    image: &ImageMessage,
    kind: ImageKind,
    stream: ForeignStream,
    log_time_ns: u64,
    sequence: u64,
    pixels: impl FnOnce(usize, &mut dyn FnMut(&mut [u8])) -> PixelBuffer,
) -> Result<Frame, String> {
    let mut frame = match kind {
        ImageKind::Compressed => compressed(image, pixels)?,
        ImageKind::Raw => raw(image, stream, pixels)?,
    };
    frame.captured = Timestamp::from_ns(image.stamp_ns.unwrap_or(log_time_ns));
    frame.arrived = Timestamp::from_ns(log_time_ns);
    frame.sequence = image.sequence.filter(|&number| number > 0).map_or(sequence, u64::from);
    Ok(frame)
}

fn raw(
    image: &ImageMessage,
    stream: ForeignStream,
    pixels: impl FnOnce(usize, &mut dyn FnMut(&mut [u8])) -> PixelBuffer,
) -> Result<Frame, String> {
    let (format, change) = layout(image.encoding, stream)?;
    let wide = matches!(format, PixelFormat::Y16 | PixelFormat::Z16);
    if image.width_px > MAX_SIZE_PX || image.height_px > MAX_SIZE_PX {
        return Err(format!(
            "{} x {} pixels are more than {MAX_SIZE_PX} a side",
            image.width_px, image.height_px
        ));
    }
    let (buffer, stride_bytes) = if change == Change::None {
        let buffer = pixels(image.data.len(), &mut |out| {
            out.copy_from_slice(image.data);
            if wide && image.big_endian {
                out.as_chunks_mut::<2>().0.iter_mut().for_each(|pair| pair.reverse());
            }
        });
        (buffer, image.stride_bytes)
    } else {
        let (width, stride) = (image.width_px as usize, image.stride_bytes as usize);
        let needed = (stride as u64) * u64::from(image.height_px);
        if stride < width * change.pixel_bytes() || (image.data.len() as u64) < needed {
            let found = image.data.len();
            return Err(format!(
                "rows of {stride} bytes, {found} bytes of pixels: that is no image {width} pixels wide"
            ));
        }
        let rows = image.data.chunks_exact(stride.max(1)).take(image.height_px as usize);
        let buffer = pixels(width * 3 * image.height_px as usize, &mut |out| {
            let out_rows = out.chunks_exact_mut((width * 3).max(1));
            out_rows.zip(rows.clone()).for_each(|(out, row)| convert_row(row, out, change));
        });
        (buffer, image.width_px * 3)
    };
    let mut frame = Frame::new(format, image.width_px, image.height_px, stride_bytes, buffer)
        .map_err(|e| e.to_string())?;
    if format == PixelFormat::Z16 {
        frame.depth_unit_m = Some(stream.depth_unit_m.unwrap_or(ROS_DEPTH_UNIT_M));
    }
    Ok(frame)
}

fn layout(encoding: &str, stream: ForeignStream) -> Result<(PixelFormat, Change), String> {
    Ok(match encoding {
        "yuyv" | "yuv422_yuy2" => (PixelFormat::Yuyv, Change::None),
        "uyvy" | "yuv422" => (PixelFormat::Uyvy, Change::None),
        "nv12" => (PixelFormat::Nv12, Change::None),
        "mono8" | "8UC1" => (PixelFormat::Grey, Change::None),
        "mono16" if stream.depth_unit_m.is_none() => (PixelFormat::Y16, Change::None),
        "mono16" | "16UC1" => (PixelFormat::Z16, Change::None),
        "rgb8" => (PixelFormat::Rgb24, Change::None),
        "bgr8" | "8UC3" => (PixelFormat::Rgb24, Change::SwapRedBlue),
        "rgba8" => (PixelFormat::Rgb24, Change::DropAlpha { swap: false }),
        "bgra8" | "8UC4" => (PixelFormat::Rgb24, Change::DropAlpha { swap: true }),
        "32FC3" => {
            return Err("images of encoding \"32FC3\" are supported only if coshade recorded them: the encoding does not \
                 say whether its three numbers are colours, nor their order"
                .into());
        }
        other => {
            return Err(format!(
                "images of encoding {other:?} are not supported; supported are yuyv, uyvy, nv12, mono8, mono16, \
                 16UC1, rgb8, bgr8, rgba8, bgra8"
            ));
        }
    })
}

fn convert_row(row: &[u8], out: &mut [u8], change: Change) {
    let swap = matches!(change, Change::SwapRedBlue | Change::DropAlpha { swap: true });
    for (pixel, out) in row.chunks_exact(change.pixel_bytes()).zip(out.as_chunks_mut::<3>().0) {
        let &[first, second, third, ..] = pixel else { continue };
        *out = if swap { [third, second, first] } else { [first, second, third] };
    }
}

fn compressed(
    image: &ImageMessage,
    pixels: impl FnOnce(usize, &mut dyn FnMut(&mut [u8])) -> PixelBuffer,
) -> Result<Frame, String> {
    // ROS writes "rgb8; jpeg compressed bgr8", Foxglove "jpeg".
    let is_jpeg = ["jpeg", "jpg"].iter().any(|name| image.encoding.contains(name))
        && image.data.starts_with(&[0xff, 0xd8]);
    if !is_jpeg {
        return Err(format!(
            "compressed images of format {:?} are not supported; supported is jpeg",
            image.encoding
        ));
    }
    let (width_px, height_px) =
        jpeg_size(image.data).ok_or("the JPEG image is damaged: it does not say its size")?;
    let buffer = pixels(image.data.len(), &mut |out| out.copy_from_slice(image.data));
    let mut frame =
        Frame::new(PixelFormat::Mjpg, width_px, height_px, 0, buffer).map_err(|error| error.to_string())?;
    frame.color = ColorEncoding { range: YuvRange::Full, ..ColorEncoding::default() };
    Ok(frame)
}

/// Width and height from a JPEG's start-of-frame segment (ITU-T T.81, B.2.2).
fn jpeg_size(jpeg: &[u8]) -> Option<(u32, u32)> {
    let mut at = 2;
    loop {
        let &[0xff, marker] = jpeg.get(at..at + 2)? else { return None };
        if marker == 0xff {
            at += 1;
            continue;
        }
        let segment = jpeg.get(at + 2..)?;
        let len = usize::from(u16::from_be_bytes(segment.get(..2)?.try_into().ok()?));
        let is_frame = (0xc0..=0xcf).contains(&marker) && ![0xc4, 0xc8, 0xcc].contains(&marker);
        if is_frame {
            let &[height_high, height_low, width_high, width_low] = segment.get(3..7)? else { return None };
            let size = |high, low| u32::from(u16::from_be_bytes([high, low]));
            return Some((size(width_high, width_low), size(height_high, height_low)));
        }
        if len < 2 || marker == 0xda {
            return None;
        }
        at += 2 + len;
    }
}
