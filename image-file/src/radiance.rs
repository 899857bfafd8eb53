//! Radiance HDR (`.hdr`, `.pic`): G. Ward, "Real Pixels", Graphics Gems II, 1991, and Radiance's `color.c`.
//!
//! A pixel is three 8-bit mantissas and a shared exponent: value = mantissa · 2^(exponent − 136), as OpenCV, Blender
//! and the `image` crate have it (Radiance itself adds ½ to the mantissa). The `image` crate's decoder is not used: it
//! knows one orientation only, and overflows on a chain of run-length markers.

use std::path::Path;

use super::image::{Channel, Image, LayeredImage};
use super::{ImageError, LayerOutline, ReadLimits};

const PART: &str = "Radiance HDR";

pub(super) fn read(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<LayeredImage, ImageError> {
    let mut reader = Reader { path, rest: bytes };
    let (raster, notes) = reader.start(limits)?;
    let (width, height) = (raster.width, raster.height);

    let mut planes: [Vec<f32>; 3] = Default::default();
    for plane in &mut planes {
        plane.resize(width * height, 0.0);
    }
    let mut scanline = vec![[0u8; 4]; width];
    for row in 0..height {
        reader.scanline(&mut scanline, row)?;
        let y = if raster.bottom_up { height - 1 - row } else { row };
        let start = y * width;
        for (axis, plane) in planes.iter_mut().enumerate() {
            let target = plane.iter_mut().skip(start).take(width);
            let source: &mut dyn Iterator<Item = &[u8; 4]> =
                if raster.right_to_left { &mut scanline.iter().rev() } else { &mut scanline.iter() };
            for (sample, pixel) in target.zip(source) {
                *sample = f32::from(pixel[axis]) * exponent_scale(pixel[3]);
            }
        }
    }
    let channels = ["R", "G", "B"].into_iter().zip(planes);
    let channels = channels.map(|(name, samples)| Channel { name: name.into(), samples }).collect();
    let mut file = LayeredImage::single(Image::new(width, height, channels)?);
    file.notes = notes;
    Ok(file)
}

/// The one layer that [`read`] would give.
pub(super) fn outline(path: &Path, bytes: &[u8], limits: &ReadLimits) -> Result<LayerOutline, ImageError> {
    let (Raster { width, height, .. }, _) = Reader { path, rest: bytes }.start(limits)?;
    let channels = ["R", "G", "B"].map(str::to_owned).into();
    Ok(LayerOutline { name: String::new(), width, height, channels, window: None })
}

/// 2^(e − 136), and 0 for e = 0. Subnormal below e = 10, but exact: 2^-135 is a multiple of the least `f32`.
fn exponent_scale(exponent: u8) -> f32 {
    if exponent == 0 { 0.0 } else { 2f64.powi(i32::from(exponent) - 136) as f32 }
}

struct Raster {
    width: usize,
    height: usize,
    bottom_up: bool,
    right_to_left: bool,
}

struct Reader<'a> {
    path: &'a Path,
    rest: &'a [u8],
}

impl<'a> Reader<'a> {
    fn broken(&self, reason: impl Into<String>) -> ImageError {
        ImageError::decode(self.path, PART, reason.into())
    }

    fn line(&mut self) -> Result<String, ImageError> {
        // Real header lines are short; the bound keeps a binary file's "line" out of messages.
        const LONGEST: usize = 4096;
        let end = self.rest.iter().take(LONGEST).position(|&byte| byte == b'\n');
        let end = end.ok_or_else(|| self.broken("the header does not end"))?;
        let (line, rest) = self.rest.split_at(end);
        self.rest = rest.get(1..).unwrap_or_default();
        Ok(String::from_utf8_lossy(line).trim_end_matches('\r').to_owned())
    }

    /// Reads all that comes before the pixels, and checks the size; with what the user should know.
    fn start(&mut self, limits: &ReadLimits) -> Result<(Raster, Vec<String>), ImageError> {
        let notes = self.header()?;
        let raster = self.resolution()?;
        limits.check(self.path, raster.width, raster.height, 3)?;
        Ok((raster, notes))
    }

    /// Reads up to the empty line and returns what the user should know.
    fn header(&mut self) -> Result<Vec<String>, ImageError> {
        let mut notes = Vec::new();
        self.line()?;
        loop {
            let line = self.line()?;
            if line.is_empty() {
                return Ok(notes);
            }
            match line.split_once('=').map(|(key, value)| (key.trim(), value.trim())) {
                Some(("FORMAT", "32-bit_rle_rgbe")) => {}
                Some(("FORMAT", other)) => {
                    let what = format!(
                        "FORMAT={other} is not read, only 32-bit_rle_rgbe; convert with `ra_xyze -r -u` or oiiotool"
                    );
                    return Err(ImageError::unsupported(self.path, what));
                }
                Some((key @ ("EXPOSURE" | "COLORCORR"), value)) => {
                    notes.push(format!(
                        "{key}={value} of the header is not divided out (as in OpenCV and Blender)"
                    ));
                }
                _ => {}
            }
        }
    }

    /// The line `-Y height +X width`; a sign turned means the image is stored from the other end.
    fn resolution(&mut self) -> Result<Raster, ImageError> {
        let line = self.line()?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let side = |text: &str| {
            text.parse::<usize>()
                .map_err(|_| self.broken(format!("{text:?} in {line:?} is not a size in pixels")))
        };
        match words.as_slice() {
            [y @ ("-Y" | "+Y"), height, x @ ("+X" | "-X"), width] => Ok(Raster {
                width: side(width)?,
                height: side(height)?,
                bottom_up: *y == "+Y",
                right_to_left: *x == "-X",
            }),
            ["+X" | "-X", _, "+Y" | "-Y", _] => Err(ImageError::unsupported(
                self.path,
                format!(
                    "the image is stored column by column (orientation {line:?}); turn it with `protate`"
                ),
            )),
            _ => Err(self.broken(format!("expected a size like \"-Y 512 +X 1024\", found {line:?}"))),
        }
    }

    fn take(&mut self, count: usize, row: usize) -> Result<&'a [u8], ImageError> {
        let (taken, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or_else(|| self.broken(format!("the file ends in row {row}")))?;
        self.rest = rest;
        Ok(taken)
    }

    fn pixel(&mut self, row: usize) -> Result<[u8; 4], ImageError> {
        match *self.take(4, row)? {
            [r, g, b, e] => Ok([r, g, b, e]),
            _ => Err(self.broken(format!("the file ends in row {row}"))),
        }
    }

    fn scanline(&mut self, scanline: &mut [[u8; 4]], row: usize) -> Result<(), ImageError> {
        let width = scanline.len();
        // Radiance writes component runs for these widths only; elsewhere the same bytes are a pixel.
        let may_be_runs = (8..=0x7fff).contains(&width);
        match *self.rest {
            [2, 2, high, low, ..] if may_be_runs && high < 128 => {
                let stated = usize::from(high) << 8 | usize::from(low);
                if stated != width {
                    return Err(self.broken(format!("row {row} says it is {stated} px wide, not {width}")));
                }
                self.take(4, row)?;
                (0..4).try_for_each(|component| self.component_runs(scanline, component, row))
            }
            _ => self.pixel_runs(scanline, row),
        }
    }

    /// One component of a row: a count above 128 repeats one byte, another count is so many bytes.
    fn component_runs(
        &mut self,
        scanline: &mut [[u8; 4]],
        component: usize,
        row: usize,
    ) -> Result<(), ImageError> {
        let mut filled = 0;
        while filled < scanline.len() {
            let count = usize::from(self.take(1, row)?.first().copied().unwrap_or(0));
            let (length, bytes) =
                if count > 128 { (count - 128, self.take(1, row)?) } else { (count, self.take(count, row)?) };
            let target = scanline
                .get_mut(filled..filled + length)
                .filter(|_| length > 0)
                .ok_or_else(|| self.broken(format!("a run of {length} px does not fit into row {row}")))?;
            for (pixel, &byte) in target.iter_mut().zip(bytes.iter().cycle()) {
                pixel[component] = byte;
            }
            filled += length;
        }
        Ok(())
    }

    /// A row of plain pixels, or the older coding where (1, 1, 1, n) repeats the last pixel n times and
    /// further markers count in the next higher byte.
    fn pixel_runs(&mut self, scanline: &mut [[u8; 4]], row: usize) -> Result<(), ImageError> {
        let mut filled = 0;
        let mut shift = 0;
        let mut last = None;
        while filled < scanline.len() {
            let pixel = self.pixel(row)?;
            let (value, length) = match (pixel, last) {
                ([1, 1, 1, count], Some(previous)) => {
                    let length = if shift < 32 { usize::from(count) << shift } else { usize::MAX };
                    shift += 8;
                    (previous, length)
                }
                _ => {
                    shift = 0;
                    (pixel, 1)
                }
            };
            let end = filled.saturating_add(length);
            let target = scanline
                .get_mut(filled..end)
                .ok_or_else(|| self.broken(format!("a run of {length} px does not fit into row {row}")))?;
            target.fill(value);
            filled = end;
            last = Some(value);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn decode(resolution: &str, data: &[u8]) -> Result<LayeredImage, ImageError> {
        let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{resolution}\n").into_bytes();
        bytes.extend_from_slice(data);
        read(Path::new("t.hdr"), &bytes, &ReadLimits::default())
    }

    fn red(file: &LayeredImage) -> Vec<f32> {
        file.layers[0].image.channel("R").unwrap().to_vec()
    }

    // Mantissa m with exponent 136 is m itself.
    const PIXELS: [u8; 16] = [1, 0, 0, 136, 2, 0, 0, 136, 3, 0, 0, 136, 4, 0, 0, 136];

    #[test]
    fn row_orientations_are_turned_upright() {
        assert_eq!(red(&decode("-Y 2 +X 2", &PIXELS).unwrap()), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(red(&decode("+Y 2 +X 2", &PIXELS).unwrap()), [3.0, 4.0, 1.0, 2.0]);
        assert_eq!(red(&decode("-Y 2 -X 2", &PIXELS).unwrap()), [2.0, 1.0, 4.0, 3.0]);
    }

    #[test]
    fn column_orientation_is_refused_by_name() {
        let message = decode("+X 2 -Y 2", &PIXELS).unwrap_err().to_string();
        assert!(message.contains("+X 2 -Y 2") && message.contains("t.hdr"), "{message}");
    }

    #[test]
    fn old_runs_count_in_higher_bytes() {
        // 1 pixel, then 1·1 + 1·256 repeats of it, in a row of 258.
        let data = [7, 0, 0, 136, 1, 1, 1, 1, 1, 1, 1, 1];
        assert_eq!(red(&decode("-Y 1 +X 258", &data).unwrap()), vec![7.0; 258]);
    }

    #[test]
    fn a_long_chain_of_empty_run_markers_is_an_error() {
        let mut data = vec![7, 0, 0, 136];
        data.extend([1, 1, 1, 0].repeat(40));
        assert!(decode("-Y 1 +X 258", &data).is_err());
    }

    #[test]
    fn new_runs_and_literals() {
        let mut data = vec![2, 2, 0, 8];
        data.extend([3, 1, 2, 3, 128 + 5, 9]); // red: 1 2 3 9 9 9 9 9
        data.extend([128 + 8, 0, 128 + 8, 0, 128 + 8, 136]);
        assert_eq!(red(&decode("-Y 1 +X 8", &data).unwrap()), [1.0, 2.0, 3.0, 9.0, 9.0, 9.0, 9.0, 9.0]);
    }

    #[test]
    fn exponents_at_both_ends() {
        let file = decode("-Y 1 +X 3", &[128, 0, 0, 255, 255, 0, 0, 1, 255, 255, 255, 0]).unwrap();
        let top = 128.0 * 2f32.powi(119);
        assert_eq!(red(&file), [top, (255.0 * 2f64.powi(-135)) as f32, 0.0]);
    }
}
