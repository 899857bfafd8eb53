//! Text as outlines: the same in every output, whatever fonts a viewer has.

use ab_glyph::{Font, FontRef, OutlineCurve, Point};

use super::drawing::{Contour, Path, Segment};
use super::error::PrintError;

/// Letters of the built-in font.
pub(super) struct Letters {
    font: FontRef<'static>,
    units_per_em: f32,
}

/// Which point of a line of text is at the given place, on its baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Anchor {
    Start,
    Middle,
}

impl Letters {
    pub(super) fn new() -> Result<Self, PrintError> {
        let font =
            FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).map_err(|_| PrintError::Font)?;
        let units_per_em = font.units_per_em().ok_or(PrintError::Font)?;
        Ok(Self { font, units_per_em })
    }

    /// Length of a line with letters of `em_mm`.
    pub(super) fn width_mm(&self, line: &str, em_mm: f64) -> f64 {
        let advances = line.chars().map(|letter| self.advance(letter));
        advances.sum::<f64>() * em_mm
    }

    /// A line of text as a shape.
    pub(super) fn line(&self, text: &str, [x, baseline]: [f64; 2], em_mm: f64, anchor: Anchor) -> Path {
        let mut left = match anchor {
            Anchor::Start => x,
            Anchor::Middle => x - self.width_mm(text, em_mm) / 2.0,
        };
        let mut contours = Vec::new();
        for letter in text.chars() {
            let scale = em_mm / f64::from(self.units_per_em);
            let place =
                |point: Point| [left + f64::from(point.x) * scale, baseline - f64::from(point.y) * scale];
            contours.extend(self.letter(letter, &place));
            left += self.advance(letter) * em_mm;
        }
        Path { name: text.to_owned(), contours }
    }

    /// Words of a text in lines no wider than `width_mm`, as far as single words allow. No-break spaces hold.
    pub(super) fn wrapped(&self, text: &str, em_mm: f64, width_mm: f64) -> Vec<String> {
        let mut lines: Vec<String> = Vec::new();
        for word in text.split(' ').filter(|word| !word.is_empty()) {
            match lines.last_mut() {
                Some(line) if self.width_mm(&format!("{line} {word}"), em_mm) <= width_mm => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }

    /// In units of the em.
    fn advance(&self, letter: char) -> f64 {
        f64::from(self.font.h_advance_unscaled(self.font.glyph_id(letter)) / self.units_per_em)
    }

    fn letter(&self, letter: char, place: &dyn Fn(Point) -> [f64; 2]) -> Vec<Contour> {
        let outline = self.font.outline(self.font.glyph_id(letter));
        let mut contours: Vec<Contour> = Vec::new();
        let mut here = None;
        for curve in outline.iter().flat_map(|outline| &outline.curves) {
            let (from, to, segment) = match *curve {
                OutlineCurve::Line(from, to) => (from, to, Segment::Line(place(to))),
                OutlineCurve::Quad(from, control, to) => {
                    (from, to, Segment::Quadratic(place(control), place(to)))
                }
                // TrueType has no cubic curves, and the font is built in.
                OutlineCurve::Cubic(from, _, _, to) => (from, to, Segment::Line(place(to))),
            };
            match contours.last_mut() {
                Some(contour) if here == Some(from) => contour.segments.push(segment),
                _ => contours.push(Contour { start_mm: place(from), segments: vec![segment] }),
            }
            here = Some(to);
        }
        contours
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_as_wide_and_high_as_it_says() {
        let letters = Letters::new().unwrap();
        let path = letters.line("HIH", [50.0, 20.0], 10.0, Anchor::Middle);
        let [low, high] = path.bounds_mm().unwrap();
        let width = letters.width_mm("HIH", 10.0);
        // Side bearings are a few per cent of the em.
        assert!((low[0] + high[0] - 100.0).abs() < 0.1, "{low:?} {high:?}");
        assert!(high[0] - low[0] < width && high[0] - low[0] > width - 2.5);
        // Capitals stand on the baseline, 0.6 to 0.75 em high.
        assert!((high[1] - 20.0).abs() < 1e-6 && (12.5..14.0).contains(&low[1]), "{low:?} {high:?}");
        assert_eq!(path.contours.len(), 3);
        // An O has a hole, and what the caption uses is in the font.
        assert_eq!(letters.line("O", [0.0; 2], 1.0, Anchor::Start).contours.len(), 2);
        let missing = letters.line("\u{10ffff}", [0.0; 2], 1.0, Anchor::Start).contours;
        for letter in ['–', '…', '%', '\u{a0}'] {
            assert_ne!(letters.line(&letter.to_string(), [0.0; 2], 1.0, Anchor::Start).contours, missing);
        }
    }

    #[test]
    fn lines_are_no_wider_than_asked() {
        let letters = Letters::new().unwrap();
        let text = "print at full size and measure the ruler before you trust the board";
        let lines = letters.wrapped(text, 3.0, 40.0);
        assert!(lines.len() > 1);
        assert!(lines.iter().all(|line| letters.width_mm(line, 3.0) <= 40.0));
        assert_eq!(lines.join(" "), text);
        assert_eq!(letters.wrapped("incomprehensible", 3.0, 1.0), ["incomprehensible"]);
    }
}
