use std::path::Path;

use super::{ImageError, ReadLimits, Window, exr_read, radiance};

/// What the header of an EXR or Radiance HDR file says of a layer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LayerOutline {
    /// As [`Layer::name`](super::Layer::name).
    pub name: String,
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Names of the channels, in the order of [`Image::channels`](super::Image::channels).
    pub channels: Vec<String>,
    /// As [`Image::window`](super::Image::window).
    pub window: Option<Window>,
}

/// The layers of an EXR or Radiance HDR file by its header alone: those that [`read_bytes`](super::read_bytes) gives.
///
/// `bytes` is the file, or as much of its beginning as holds the header; `path` is what errors call it.
///
/// # Errors
/// As [`read`](super::read), as far as the header shows it; another format.
pub fn outline(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<Vec<LayerOutline>, ImageError> {
    match bytes {
        [0x76, 0x2f, 0x31, 0x01, ..] => exr_read::outline(path, bytes, limits),
        [b'#', b'?', ..] => Ok(vec![radiance::outline(path, bytes, limits)?]),
        _ => Err(ImageError::unsupported(path, "is neither an EXR nor a Radiance HDR file")),
    }
}
