//! Linear float images and the files they live in.
//!
//! Values are linear radiance, 1.0 = white. EXR and Radiance HDR hold that directly; PNG and JPEG hold sRGB code
//! values and are decoded with the exact piecewise curve of IEC 61966-2-1 ([`srgb`]), whatever colour profile they
//! name (a note says so if they name one). Alpha is linear in every format.
//!
//! [`read`] looks at the first bytes, not at the extension; [`outline`](outline()) at the header alone. [`ReadLimits`] bounds what a header may ask for.

mod error;
mod exr_dwa;
mod exr_read;
mod exr_write;
mod image;
mod outline;
mod png_jpeg;
mod radiance;
mod spec;
pub mod srgb;

use std::fs::File;
use std::io::Read;
use std::path::Path;

pub use self::image::{Channel, ColourKind, Image, Layer, LayeredImage, SampleCensus, Window};
pub use error::ImageError;
pub use exr_write::{Precision, write_exr};
pub use outline::{LayerOutline, outline};
pub use png_jpeg::{BitDepth, write_png, write_png_rgb8};
pub use spec::{ImageSpec, read_spec};

/// What a file may ask for before it is refused with [`ImageError::TooLarge`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadLimits {
    /// Bytes of all decoded samples together, as `f32`; the file itself may not be longer either.
    ///
    /// Reading takes at most about three times this at its peak: the file, the decoder's own samples, and ours.
    pub max_decoded_bytes: u64,
    /// Largest width or height, in pixels.
    pub max_side_px: usize,
}

impl Default for ReadLimits {
    /// 2 GiB: a 16384 × 8192 RGB environment map fits.
    fn default() -> Self {
        Self { max_decoded_bytes: 2 << 30, max_side_px: 1 << 16 }
    }
}

impl ReadLimits {
    /// Checks a size that a header claims, with `channels` of `f32` per pixel.
    pub(crate) fn check(
        &self,
        path: &Path,
        width: usize,
        height: usize,
        channels: usize,
    ) -> Result<u64, ImageError> {
        let bytes = (width as u64)
            .checked_mul(height as u64)
            .and_then(|pixels| pixels.checked_mul(channels as u64))
            .and_then(|samples| samples.checked_mul(4))
            .unwrap_or(u64::MAX);
        if width == 0 || height == 0 || channels == 0 {
            return Err(ImageError::decode(
                path,
                "header",
                format!("the image is empty: {width}x{height} px, {channels} channels"),
            ));
        }
        if width > self.max_side_px || height > self.max_side_px || bytes > self.max_decoded_bytes {
            return Err(ImageError::TooLarge {
                path: path.into(),
                width,
                height,
                channels,
                limit_bytes: self.max_decoded_bytes,
                limit_side_px: self.max_side_px,
            });
        }
        Ok(bytes)
    }
}

/// Reads every layer of an image file with the default [`ReadLimits`].
///
/// # Errors
/// The file cannot be read, is of no known format, is broken, uses a feature named in the error (deep data,
/// subsampled channels, …), or is larger than the limits.
pub fn read(path: impl AsRef<Path>) -> Result<LayeredImage, ImageError> {
    read_with_limits(path, &ReadLimits::default())
}

/// [`read`] with limits of the caller's.
///
/// # Errors
/// As [`read`].
pub fn read_with_limits(path: impl AsRef<Path>, limits: &ReadLimits) -> Result<LayeredImage, ImageError> {
    let path = path.as_ref();
    let open = |source| ImageError::Open { path: path.into(), source };
    let about = std::fs::metadata(path).map_err(open)?;
    if !about.is_file() {
        return Err(ImageError::unsupported(path, "not a regular file"));
    }
    let too_long = || {
        let limit = limits.max_decoded_bytes;
        ImageError::unsupported(path, format!("the file is longer than the read limit of {limit} bytes"))
    };
    if about.len() > limits.max_decoded_bytes {
        return Err(too_long());
    }
    let mut bytes = Vec::new();
    // The file may grow between the look and the read.
    let mut file = File::open(path).map_err(open)?.take(limits.max_decoded_bytes.saturating_add(1));
    file.read_to_end(&mut bytes).map_err(open)?;
    if bytes.len() as u64 > limits.max_decoded_bytes {
        return Err(too_long());
    }
    read_bytes(path, &bytes, limits)
}

/// Reads an image file that is in memory; `path` is what errors call it.
///
/// # Errors
/// As [`read`].
pub fn read_bytes(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<LayeredImage, ImageError> {
    match bytes {
        [] => Err(ImageError::UnknownFormat { path: path.into(), found: "an empty file".into() }),
        [0x76, 0x2f, 0x31, 0x01, ..] => exr_read::read(path, bytes, limits),
        [b'#', b'?', ..] => radiance::read(path, bytes, limits),
        [0x89, b'P', b'N', b'G', ..] => png_jpeg::read_png(path, bytes, limits),
        [0xff, 0xd8, ..] => png_jpeg::read_jpeg(path, bytes, limits),
        _ => {
            let head: Vec<String> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            let found = format!("a file that begins with bytes {}", head.join(" "));
            Err(ImageError::UnknownFormat { path: path.into(), found })
        }
    }
}
