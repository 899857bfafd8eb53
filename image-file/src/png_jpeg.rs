//! PNG and JPEG: sRGB code values outside, linear radiance inside.

use std::io::Cursor;
use std::path::Path;

use ::image::codecs::jpeg::JpegDecoder;
use ::image::codecs::png::{PngDecoder, PngEncoder};
use ::image::metadata::Orientation;
use ::image::{ColorType, DynamicImage, ExtendedColorType, ImageDecoder, ImageEncoder, ImageResult, Limits};

use super::image::{Channel, ColourKind, Image, LayeredImage};
use super::{ImageError, ReadLimits, srgb};

pub(super) fn read_png(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<LayeredImage, ImageError> {
    let decoder = PngDecoder::with_limits(Cursor::new(bytes), crate_limits(limits));
    decode(path, "PNG", decoder, limits)
}

pub(super) fn read_jpeg(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<LayeredImage, ImageError> {
    decode(path, "JPEG", JpegDecoder::new(Cursor::new(bytes)), limits)
}

fn crate_limits(limits: &ReadLimits) -> Limits {
    let side = u32::try_from(limits.max_side_px).unwrap_or(u32::MAX);
    let mut crate_limits = Limits::no_limits();
    crate_limits.max_image_width = Some(side);
    crate_limits.max_image_height = Some(side);
    crate_limits.max_alloc = Some(limits.max_decoded_bytes);
    crate_limits
}

fn decode(
    path: &Path,
    format: &'static str,
    decoder: ImageResult<impl ImageDecoder>,
    limits: &ReadLimits,
) -> Result<LayeredImage, ImageError> {
    let broken = |error: ::image::ImageError| ImageError::decode(path, format, error);
    let mut decoder = decoder.map_err(broken)?;
    let (width, height) = decoder.dimensions();
    let channels = usize::from(decoder.color_type().channel_count());
    limits.check(path, width as usize, height as usize, channels)?;
    decoder.set_limits(crate_limits(limits)).map_err(broken)?;

    let mut notes = Vec::new();
    if decoder.icc_profile().ok().flatten().is_some() {
        notes.push("its ICC profile is ignored: values are taken as sRGB".into());
    }
    // Broken metadata does not make the pixels unreadable; then the raster stays as stored.
    let orientation = decoder.orientation().unwrap_or(Orientation::NoTransforms);
    let mut picture = DynamicImage::from_decoder(decoder).map_err(broken)?;
    if orientation != Orientation::NoTransforms {
        picture.apply_orientation(orientation);
        notes.push(format!("turned upright by its EXIF orientation ({orientation:?})"));
    }
    let mut file = LayeredImage::single(linearise(path, format, &picture)?);
    file.notes = notes;
    Ok(file)
}

fn linearise(path: &Path, format: &'static str, picture: &DynamicImage) -> Result<Image, ImageError> {
    let names: &[&str] = match picture.color() {
        ColorType::L8 | ColorType::L16 => &["Y"],
        ColorType::La8 | ColorType::La16 => &["Y", "A"],
        ColorType::Rgb8 | ColorType::Rgb16 => &["R", "G", "B"],
        ColorType::Rgba8 | ColorType::Rgba16 => &["R", "G", "B", "A"],
        other => {
            return Err(ImageError::decode(path, format, format!("pixel type {other:?} is not read")));
        }
    };
    let table: Vec<f32> = (0..=255u8).map(|code| srgb::decode(f64::from(code) / 255.0) as f32).collect();
    let plane = |index: usize, is_alpha: bool| -> Vec<f32> {
        let codes = |bytes: &[u8]| -> Vec<f32> {
            let mine = bytes.iter().skip(index).step_by(names.len()).copied();
            if is_alpha {
                mine.map(|code| f32::from(code) / 255.0).collect()
            } else {
                mine.map(|code| table.get(usize::from(code)).copied().unwrap_or(1.0)).collect()
            }
        };
        let wide_codes = |words: &[u16]| -> Vec<f32> {
            let mine = words.iter().skip(index).step_by(names.len()).map(|&code| f64::from(code) / 65535.0);
            mine.map(|code| if is_alpha { code } else { srgb::decode(code) } as f32).collect()
        };
        match picture {
            DynamicImage::ImageLuma16(wide) => wide_codes(wide),
            DynamicImage::ImageLumaA16(wide) => wide_codes(wide),
            DynamicImage::ImageRgb16(wide) => wide_codes(wide),
            DynamicImage::ImageRgba16(wide) => wide_codes(wide),
            narrow => codes(narrow.as_bytes()),
        }
    };
    let channels = names
        .iter()
        .enumerate()
        .map(|(index, &name)| Channel { name: name.into(), samples: plane(index, name == "A") });
    Image::new(picture.width() as usize, picture.height() as usize, channels.collect())
}

/// Bits per sample of a PNG.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BitDepth {
    /// 8 bits.
    Eight,
    /// 16 bits.
    Sixteen,
}

/// Writes a colour or grey image as an sRGB PNG: linear values are clipped to [0, 1], encoded with the exact curve and
/// rounded. Alpha, if there, is kept and not encoded.
///
/// # Errors
/// A layer of data (depth, normals), NaN samples, or the file cannot be written.
pub fn write_png(path: impl AsRef<Path>, image: &Image, depth: BitDepth) -> Result<(), ImageError> {
    let path = path.as_ref();
    let names: &[&str] = match image.colour_kind() {
        ColourKind::Rgb => &["R", "G", "B", "A"],
        ColourKind::Grey => &["Y", "A"],
        ColourKind::Data => {
            let names = image.channel_names().join(" ");
            return Err(ImageError::write(path, format!("a PNG holds R G B or Y, not {names}; write EXR")));
        }
    };
    let planes: Vec<(bool, &[f32])> =
        names.iter().filter_map(|name| Some((*name == "A", image.channel(name)?))).collect();
    let nan = planes.iter().flat_map(|(_, plane)| *plane).filter(|sample| sample.is_nan()).count();
    if nan > 0 {
        return Err(ImageError::write(path, format!("{nan} samples are NaN; write EXR to keep them")));
    }
    let (colour_8, colour_16) = match planes.len() {
        1 => (ExtendedColorType::L8, ExtendedColorType::L16),
        2 => (ExtendedColorType::La8, ExtendedColorType::La16),
        3 => (ExtendedColorType::Rgb8, ExtendedColorType::Rgb16),
        _ => (ExtendedColorType::Rgba8, ExtendedColorType::Rgba16),
    };
    let pixels = image.width() * image.height();
    let codes = |max_code: u16| {
        let planes = &planes;
        (0..pixels).flat_map(move |pixel| {
            planes.iter().map(move |(is_alpha, plane)| {
                let sample = plane.get(pixel).copied().unwrap_or(0.0);
                if *is_alpha {
                    (sample.clamp(0.0, 1.0) * f32::from(max_code)).round() as u16
                } else {
                    srgb::encode_to_code(sample, max_code)
                }
            })
        })
    };
    match depth {
        BitDepth::Eight => {
            let bytes: Vec<u8> = codes(255).map(|code| code as u8).collect();
            save(path, &bytes, image.width(), image.height(), colour_8)
        }
        BitDepth::Sixteen => {
            // The encoder takes words in the machine's order.
            let bytes: Vec<u8> = codes(u16::MAX).flat_map(u16::to_ne_bytes).collect();
            save(path, &bytes, image.width(), image.height(), colour_16)
        }
    }
}

/// Writes code values as they are, three bytes per pixel, row by row.
///
/// # Errors
/// `rgb` does not fit the size, or the file cannot be written.
pub fn write_png_rgb8(
    path: impl AsRef<Path>,
    width: usize,
    height: usize,
    rgb: &[u8],
) -> Result<(), ImageError> {
    let path = path.as_ref();
    if Some(rgb.len()) != width.checked_mul(height).and_then(|pixels| pixels.checked_mul(3)) {
        let got = rgb.len();
        return Err(ImageError::write(path, format!("{got} bytes are not {width}x{height} px of 3")));
    }
    save(path, rgb, width, height, ExtendedColorType::Rgb8)
}

fn save(
    path: &Path,
    bytes: &[u8],
    width: usize,
    height: usize,
    colour: ExtendedColorType,
) -> Result<(), ImageError> {
    let side = |side: usize| u32::try_from(side).map_err(|error| ImageError::write(path, error));
    let mut encoded = Vec::new();
    PngEncoder::new(&mut encoded)
        .write_image(bytes, side(width)?, side(height)?, colour)
        .map_err(|error| ImageError::write(path, error))?;
    std::fs::write(path, encoded).map_err(|error| ImageError::write(path, error))
}
