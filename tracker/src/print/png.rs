//! Drawings as PNG: the share of each pixel that is white, with the resolution in the file.

use ab_glyph_rasterizer::{Point, Rasterizer, point};
use png::{BitDepth, ColorType, Encoder, PixelDimensions, Unit};

use super::drawing::{Drawing, Path, Segment};
use super::error::PrintError;

/// An image beyond this is a mistake.
const MAX_PIXELS: u64 = 1 << 28;
/// Rows that are drawn at once: bounds the memory for large tags.
const STRIP_ROWS: usize = 256;

/// Grey levels, row by row.
struct Canvas {
    width: usize,
    height: usize,
    levels: Vec<u8>,
    px_per_mm: f64,
}

impl Drawing {
    /// The bytes of an 8-bit grey PNG file of `px_per_m` pixels a metre. Edges on whole pixels are sharp; others are
    /// grey by the share of the pixel that they cover.
    ///
    /// # Errors
    /// [`PrintError::TooLarge`]; [`PrintError::Png`] if the encoder fails.
    pub fn to_png(&self, px_per_m: u32) -> Result<Vec<u8>, PrintError> {
        let mut canvas = Canvas::new(self.size_mm, px_per_m)?;
        for path in &self.paths {
            canvas.fill(path);
        }
        let mut file = Vec::new();
        canvas.encode(&mut file, px_per_m).map_err(|error| PrintError::Png(error.to_string()))?;
        Ok(file)
    }
}

impl Canvas {
    fn new(size_mm: [f64; 2], px_per_m: u32) -> Result<Self, PrintError> {
        let px_per_mm = f64::from(px_per_m) / 1000.0;
        let [width, height] = size_mm.map(|side| (side * px_per_mm).round().max(1.0) as u64);
        if width.saturating_mul(height) > MAX_PIXELS {
            return Err(PrintError::TooLarge { width, height });
        }
        let levels = vec![255; (width * height) as usize];
        Ok(Self { width: width as usize, height: height as usize, levels, px_per_mm })
    }

    fn fill(&mut self, path: &Path) {
        let Some([low, high]) = path.bounds_mm() else { return };
        let first = low.map(|place| (place * self.px_per_mm).floor().max(0.0) as usize);
        let last = high.map(|place| (place * self.px_per_mm).ceil().max(0.0) as usize + 1);
        let (last_column, last_row) = (last[0].min(self.width), last[1].min(self.height));
        let width = last_column.saturating_sub(first[0]);
        if width == 0 {
            return;
        }
        for top in (first[1]..last_row).step_by(STRIP_ROWS) {
            let rows = STRIP_ROWS.min(last_row - top);
            let mut strip = Rasterizer::new(width, rows);
            self.draw(&mut strip, path, [first[0], top]);
            strip
                .for_each_pixel_2d(|x, y, share| self.darken(first[0] + x as usize, top + y as usize, share));
        }
    }

    fn draw(&self, strip: &mut Rasterizer, path: &Path, [left, top]: [usize; 2]) {
        let place = |[x, y]: [f64; 2]| -> Point {
            // Subtracted before the rounding to single precision.
            point((x * self.px_per_mm - left as f64) as f32, (y * self.px_per_mm - top as f64) as f32)
        };
        for contour in &path.contours {
            let mut here = contour.start_mm;
            for segment in &contour.segments {
                match *segment {
                    Segment::Line(end) => strip.draw_line(place(here), place(end)),
                    Segment::Quadratic(control, end) => {
                        strip.draw_quad(place(here), place(control), place(end))
                    }
                }
                here = segment.end_mm();
            }
            strip.draw_line(place(here), place(contour.start_mm));
        }
    }

    fn darken(&mut self, x: usize, y: usize, share: f32) {
        if let Some(level) = self.levels.get_mut(y * self.width + x) {
            *level = (f32::from(*level) * (1.0 - share.clamp(0.0, 1.0))).round() as u8;
        }
    }

    fn encode(&self, file: &mut Vec<u8>, px_per_m: u32) -> Result<(), png::EncodingError> {
        let mut encoder = Encoder::new(file, self.width as u32, self.height as u32);
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Eight);
        encoder.set_pixel_dims(Some(PixelDimensions { xppu: px_per_m, yppu: px_per_m, unit: Unit::Meter }));
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&self.levels)?;
        writer.finish()
    }
}
