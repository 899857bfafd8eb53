//! Text and lines on pictures.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use anyhow::Context as _;
use image::{Rgb, RgbImage};

/// Height of letters as a share of the line.
const TEXT_SHARE: f32 = 0.76;

/// The font of labels.
///
/// # Errors
/// It is none, which a test excludes.
pub fn font() -> anyhow::Result<FontRef<'static>> {
    FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).context("the font of labels")
}

/// A line of text, and how it looks.
pub struct Text<'a> {
    /// See [`font`].
    pub font: &'a FontRef<'static>,
    /// Without line breaks.
    pub line: &'a str,
    /// Upper left corner. May lie outside of the picture.
    pub at_px: [f32; 2],
    /// Of the line.
    pub height_px: u32,
    /// Where it would be wider, it is made smaller.
    pub room_px: u32,
    /// Colour.
    pub ink: Rgb<u8>,
}

impl Text<'_> {
    /// Puts it on a picture.
    pub fn draw(&self, picture: &mut RgbImage) {
        let wanted = self.height_px as f32 * TEXT_SHARE;
        let size = wanted * (self.room_px as f32 / self.width_px(wanted).max(1.0)).min(1.0);
        let scaled = self.font.as_scaled(PxScale::from(size));
        let [mut x, top] = self.at_px;
        let baseline = top + (self.height_px as f32 + scaled.ascent() + scaled.descent()) / 2.0;
        for letter in self.line.chars() {
            let glyph = scaled.scaled_glyph(letter);
            let advance = scaled.h_advance(glyph.id);
            let placed = ab_glyph::Glyph { position: point(x, baseline), ..glyph };
            if let Some(outline) = scaled.outline_glyph(placed) {
                let bounds = outline.px_bounds();
                outline.draw(|dx, dy, share| {
                    blend(picture, [bounds.min.x + dx as f32, bounds.min.y + dy as f32], share, self.ink);
                });
            }
            x += advance;
        }
    }

    fn width_px(&self, size: f32) -> f32 {
        let scaled = self.font.as_scaled(PxScale::from(size));
        self.line.chars().map(|letter| scaled.h_advance(scaled.glyph_id(letter))).sum()
    }
}

/// A straight line with round ends and soft edges. The centre of the first pixel is at (0, 0); what lies outside of the
/// picture is left out.
pub fn line(picture: &mut RgbImage, from_px: [f64; 2], to_px: [f64; 2], width_px: f64, ink: Rgb<u8>) {
    let reach = width_px / 2.0 + 1.0;
    let range = |axis: usize, size: u32| {
        let low = (from_px[axis].min(to_px[axis]) - reach).ceil().max(0.0);
        let high = (from_px[axis].max(to_px[axis]) + reach).floor().min(f64::from(size) - 1.0);
        // NaN and empty ranges make no pixels.
        if low <= high { low as u32..high as u32 + 1 } else { 0..0 }
    };
    let (columns, rows) = (range(0, picture.width()), range(1, picture.height()));
    for y in rows {
        for x in columns.clone() {
            let away = distance([f64::from(x), f64::from(y)], from_px, to_px);
            let share = (width_px / 2.0 + 0.5 - away).clamp(0.0, 1.0);
            blend(picture, [x as f32, y as f32], share as f32, ink);
        }
    }
}

/// From a point to the nearest one of a segment.
fn distance(point: [f64; 2], from: [f64; 2], to: [f64; 2]) -> f64 {
    let [along, off] = [[to[0] - from[0], to[1] - from[1]], [point[0] - from[0], point[1] - from[1]]];
    let length2 = along[0] * along[0] + along[1] * along[1];
    let share =
        if length2 > 0.0 { ((off[0] * along[0] + off[1] * along[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    (off[0] - share * along[0]).hypot(off[1] - share * along[1])
}

fn blend(picture: &mut RgbImage, [x, y]: [f32; 2], share: f32, ink: Rgb<u8>) {
    if x < 0.0 || y < 0.0 {
        return;
    }
    if let Some(pixel) = picture.get_pixel_mut_checked(x as u32, y as u32) {
        let mix = |(below, ink): (u8, u8)| {
            (f32::from(below) * (1.0 - share) + f32::from(ink) * share).round() as u8
        };
        *pixel = Rgb([0, 1, 2].map(|i| mix((pixel.0[i], ink.0[i]))));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const INK: Rgb<u8> = Rgb([255; 3]);

    fn sum(picture: &RgbImage) -> f64 {
        picture.pixels().map(|pixel| f64::from(pixel.0[0]) / 255.0).sum()
    }

    #[test]
    fn a_line_covers_its_area() {
        // Length times width, and the two half discs at its ends: the soft edge keeps the area of straight edges, and is
        // off by less than a pixel at the round ones.
        for (from, to) in [([10.0, 10.0], [40.0, 10.0]), ([10.5, 40.25], [40.0, 12.0])] {
            let mut picture = RgbImage::new(50, 50);
            line(&mut picture, from, to, 3.0, INK);
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            let area = 3.0 * length + std::f64::consts::PI * 1.5 * 1.5;
            assert!((sum(&picture) - area).abs() < 1.0 + 0.01 * area, "{} for {area}", sum(&picture));
        }
    }

    #[test]
    fn lines_from_anywhere_stay_inside() {
        let mut picture = RgbImage::new(8, 8);
        line(&mut picture, [-1e9, 4.0], [1e9, 4.0], 1.0, INK);
        assert_eq!(sum(&picture), 8.0);
        for (from, to) in [([f64::NAN, 0.0], [5.0, 5.0]), ([20.0, 20.0], [30.0, 20.0])] {
            let mut picture = RgbImage::new(8, 8);
            line(&mut picture, from, to, 1.0, INK);
            assert_eq!(sum(&picture), 0.0);
        }
    }

    #[test]
    fn text_is_made_smaller_to_fit() {
        let font = font().unwrap();
        let columns = |room_px| {
            let mut picture = RgbImage::new(400, 40);
            let text =
                Text { font: &font, line: "tag36h11 3", at_px: [0.0, 0.0], height_px: 40, room_px, ink: INK };
            text.draw(&mut picture);
            picture.enumerate_pixels().filter(|(.., pixel)| pixel.0[0] > 128).map(|(x, ..)| x).max().unwrap()
        };
        assert!(columns(400) > 100 && columns(60) < 60);
    }
}
