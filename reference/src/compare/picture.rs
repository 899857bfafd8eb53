//! Pictures of where two images differ.

use std::path::Path;

use super::prepare::Prepared;
use super::{CompareError, Comparison, colour_map, font};
use coshade_image_file::{ImageError, write_png_rgb8};

const BLACK: [u8; 3] = [0; 3];
const WHITE: [u8; 3] = [255; 3];

/// An 8-bit RGB picture, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Three code values per pixel.
    pub rgb: Vec<u8>,
}

impl Picture {
    fn filled(width: usize, height: usize, colour: [u8; 3]) -> Self {
        Self { width, height, rgb: colour.repeat(width * height) }
    }

    /// Sets a pixel; what lies outside is dropped.
    fn set(&mut self, x: usize, y: usize, colour: [u8; 3]) {
        if x < self.width && y < self.height {
            let start = 3 * (y * self.width + x);
            if let Some(pixel) = self.rgb.get_mut(start..start + 3) {
                pixel.copy_from_slice(&colour);
            }
        }
    }

    /// Writes it as PNG.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn save(&self, path: &Path) -> Result<(), ImageError> {
        write_png_rgb8(path, self.width, self.height, &self.rgb)
    }
}

/// A picture of the signed difference and the scale it is drawn in.
#[derive(Debug, Clone, PartialEq)]
pub struct DifferencePicture {
    /// Red where A is brighter, blue where B is, light grey where they agree, black where a pixel does not count;
    /// below it a bar of the scale.
    pub picture: Picture,
    /// Radiance at the ends of the scale; larger differences have the end's colour.
    pub limit: f32,
}

/// A − B of the channel in which it is largest, so that a change of hue at equal brightness shows.
pub(super) fn signed_difference(prepared: &Prepared<'_>, clip: Option<f32>) -> Vec<Option<f32>> {
    let clipped = |value: f32| clip.map_or(value, |clip| value.min(clip));
    let at = |i: usize| {
        let difference =
            |(a, b): (&&[f32], &&[f32])| (clipped(a[i]) - clipped(b[i])).clamp(f32::MIN, f32::MAX);
        let differences = prepared.a.iter().zip(&prepared.b).map(difference);
        prepared.valid[i].then(|| differences.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or(0.0))
    };
    (0..prepared.grid.pixels()).map(at).collect()
}

/// Draws the signed difference. Without a `limit`, the scale ends at the 99.5th percentile of its magnitude, rounded up
/// to 1, 2 or 5 times a power of ten (1 if the images agree).
///
/// # Errors
/// `limit` is not a positive number.
pub fn difference_picture(
    comparison: &Comparison,
    limit: Option<f32>,
) -> Result<DifferencePicture, CompareError> {
    let limit = match limit {
        Some(limit) if limit > 0.0 && limit.is_finite() => limit,
        Some(limit) => {
            let expected = "a positive radiance";
            return Err(CompareError::Option { option: "diff-limit", value: limit.to_string(), expected });
        }
        None => automatic_limit(&comparison.difference),
    };
    let scale = 1.0 / f64::from(limit);
    let colours = comparison.difference.iter().map(|difference| {
        difference.map_or(BLACK, |difference| colour_map::diverging(f64::from(difference) * scale))
    });
    let labels = [format!("-{}", number(limit)), "0".into(), format!("+{}", number(limit))];
    let picture = with_legend(comparison, colours, &|t| colour_map::diverging(2.0 * t - 1.0), &labels);
    Ok(DifferencePicture { picture, limit })
}

/// Draws the FLIP error in the magma colours of its authors, 0 black to 1 light yellow, with a bar of the scale.
///
/// # Errors
/// The images are layers of data, which have no FLIP error.
pub fn flip_picture(comparison: &Comparison) -> Result<Picture, CompareError> {
    let flip = comparison.flip.as_ref().ok_or_else(|| CompareError::NotColour {
        a: comparison.report.a.name.clone(),
        b: comparison.report.b.name.clone(),
        channels: comparison.report.channels.join(" "),
    })?;
    let colours = flip.iter().map(|&error| colour_map::magma(error));
    let labels = ["0", "0.5", "1"].map(String::from);
    Ok(with_legend(comparison, colours, &colour_map::magma, &labels))
}

/// Smallest of 1, 2, 5 · 10^n that 99.5 % of the magnitudes do not exceed.
fn automatic_limit(difference: &[Option<f32>]) -> f32 {
    let mut magnitudes: Vec<f32> = difference.iter().flatten().map(|value| value.abs()).collect();
    magnitudes.sort_by(f32::total_cmp);
    let rank = (magnitudes.len() as f64 * 0.995).ceil() as usize;
    let percentile = magnitudes.get(rank.saturating_sub(1)).copied().unwrap_or(0.0);
    // A few hot pixels may be all there is to see.
    let magnitude = if percentile > 0.0 { percentile } else { magnitudes.last().copied().unwrap_or(0.0) };
    if magnitude == 0.0 { 1.0 } else { round_up_125(magnitude) }
}

fn round_up_125(value: f32) -> f32 {
    let value = f64::from(value);
    let decade = value.log10().floor() as i32;
    // 10^n by way of text, which is the float nearest to it.
    let candidates = (decade - 1..=decade + 1)
        .flat_map(|n| [1, 2, 5].map(|digit| format!("{digit}e{n}").parse::<f32>().unwrap_or(f32::MAX)));
    let large_enough =
        |candidate: &f32| candidate.is_finite() && f64::from(*candidate) >= value * (1.0 - 1e-6);
    // The reciprocal of a subnormal limit would be infinite.
    candidates.into_iter().find(large_enough).unwrap_or(f32::MAX).max(f32::MIN_POSITIVE)
}

/// `0.05`, `20`, and `2e-7` where digits would be too many.
fn number(value: f32) -> String {
    if (1e-3..1e4).contains(&value) { format!("{value}") } else { format!("{value:e}") }
}

/// Puts pixels on a canvas with a colour bar and three labels (left, middle, right) beneath.
fn with_legend(
    comparison: &Comparison,
    colours: impl Iterator<Item = [u8; 3]>,
    bar: &dyn Fn(f64) -> [u8; 3],
    labels: &[String; 3],
) -> Picture {
    let (width, height) = (comparison.report.a.width_px, comparison.report.a.height_px);
    let zoom = (width / 400).clamp(1, 6);
    let text_width = |text: &str| (text.len() * font::ADVANCE - 1) * zoom;
    let margin = 4 * zoom;
    let widest = labels.iter().map(|label| text_width(label)).sum::<usize>() + 6 * margin;
    let canvas_width = width.max(widest);
    let bar_height = 8 * zoom;
    let legend_height = margin + bar_height + 2 * zoom + font::GLYPH_HEIGHT * zoom + margin;
    let mut picture = Picture::filled(canvas_width, height + legend_height, WHITE);

    let left = (canvas_width - width) / 2;
    for (i, colour) in colours.enumerate() {
        picture.set(left + i % width, i / width, colour);
    }
    let bar_width = canvas_width - 2 * margin;
    let bar_top = height + margin;
    for x in 0..bar_width {
        let colour = bar(x as f64 / (bar_width - 1).max(1) as f64);
        (bar_top..bar_top + bar_height).for_each(|y| picture.set(margin + x, y, colour));
    }
    let text_top = bar_top + bar_height + 2 * zoom;
    let [low, middle, high] = labels;
    let starts = [margin, (canvas_width - text_width(middle)) / 2, canvas_width - margin - text_width(high)];
    for (label, start) in [low, middle, high].into_iter().zip(starts) {
        for (x, y) in font::dots(label) {
            for (dx, dy) in (0..zoom).flat_map(|dy| (0..zoom).map(move |dx| (dx, dy))) {
                picture.set(start + x * zoom + dx, text_top + y * zoom + dy, BLACK);
            }
        }
    }
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_one_two_or_five() {
        let cases =
            [(0.011, 0.02), (0.02, 0.02), (0.021, 0.05), (0.6, 1.0), (1.0, 1.0), (3.0, 5.0), (7e-7, 1e-6)];
        for (value, expected) in cases {
            assert_eq!(round_up_125(value), expected);
        }
        assert!(round_up_125(1e-44) >= f32::MIN_POSITIVE);
        assert!(round_up_125(3e38).is_finite());
    }

    #[test]
    fn the_percentile_ignores_a_few_hot_pixels_but_not_if_there_is_nothing_else() {
        let mut difference = vec![Some(0.03); 1000];
        difference[7] = Some(-50.0);
        difference.push(None);
        assert_eq!(automatic_limit(&difference), 0.05);
        let mut single = vec![Some(0.0); 1000];
        single[3] = Some(-0.7);
        assert_eq!(automatic_limit(&single), 1.0);
        assert_eq!(automatic_limit(&[None]), 1.0);
    }

    #[test]
    fn numbers_are_short() {
        assert_eq!([0.05, 20.0, 2e-7, 1e5].map(number), ["0.05", "20", "2e-7", "1e5"]);
    }
}
