//! Pictures in files.

use std::io::Cursor;

use image::{DynamicImage, ImageFormat, ImageReader, Limits};

use super::error::Fault;
use crate::texture::Image;

/// Longest side, texels; what GPUs take.
const MAX_SIDE: u32 = 16384;
/// Most texels.
const MAX_TEXELS: u64 = 1 << 27;
/// A picture that claims more texels per byte is not one: PNG's deflate reaches 1032 bytes from one, and a JPEG block of
/// 64 texels takes at least half a byte per channel.
const MAX_TEXELS_PER_BYTE: u64 = 8 * 1100;

/// A decoded picture, and a note if it lost precision.
pub(super) fn decode(bytes: &[u8], name: &str, place: &str) -> Result<(Image, Option<String>), Fault> {
    let fail = |problem: String| Fault::new(place, problem);
    let format = image::guess_format(bytes)
        .ok()
        .filter(|format| matches!(format, ImageFormat::Png | ImageFormat::Jpeg));
    let Some(format) = format else {
        return Err(fail(format!("picture '{name}' is neither PNG nor JPEG")));
    };
    let broken = |error: image::ImageError| fail(format!("picture '{name}': {error}"));
    let (width, height) =
        ImageReader::with_format(Cursor::new(bytes), format).into_dimensions().map_err(broken)?;
    let texels = u64::from(width) * u64::from(height);
    if texels == 0 || width.max(height) > MAX_SIDE || texels > MAX_TEXELS {
        let problem = format!(
            "picture '{name}' has {width}×{height} texels, at most {MAX_SIDE} a side and {MAX_TEXELS} are read"
        );
        return Err(fail(problem));
    }
    if texels > MAX_TEXELS_PER_BYTE * bytes.len() as u64 {
        return Err(fail(format!(
            "picture '{name}' claims {width}×{height} texels in {} bytes",
            bytes.len()
        )));
    }
    let mut reader = ImageReader::with_format(Cursor::new(bytes), format);
    let mut limits = Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    limits.max_alloc = Some(16 * texels + (1 << 24));
    reader.limits(limits);
    let decoded = reader.decode().map_err(broken)?;
    let deep = !matches!(
        decoded,
        DynamicImage::ImageLuma8(_)
            | DynamicImage::ImageLumaA8(_)
            | DynamicImage::ImageRgb8(_)
            | DynamicImage::ImageRgba8(_)
    );
    let note =
        deep.then(|| format!("{place}: picture '{name}' has more than 8 bits a channel, reduced to 8"));
    Ok((Image { name: name.to_owned(), width, height, rgba: decoded.into_rgba8().into_raw() }, note))
}
