//! Where tiles and text go.

use ab_glyph::{Font, FontRef, PxScale, ScaleFont, point};
use anyhow::{Context as _, bail};
use image::{GenericImage, Rgb, RgbImage};

use super::Tile;

const PAPER: Rgb<u8> = Rgb([250, 250, 248]);
const INK: Rgb<u8> = Rgb([40, 40, 44]);
/// Between tiles and around them.
const GAP_PX: u32 = 12;
const LABEL_PX: u32 = 22;
const TITLE_PX: u32 = 34;
/// Height of letters as a share of the line.
const TEXT_SHARE: f32 = 0.76;
/// A sheet beyond this is a mistake rather than something to look at.
const MAX_PIXELS: u64 = 1 << 28;

/// Rows of tiles.
pub struct Sheet {
    columns: usize,
    tile_px: u32,
    title: Option<String>,
    rows: Vec<Vec<Tile>>,
}

impl Sheet {
    /// Nothing on it but the title.
    pub fn new(columns: u32, tile_px: u32, title: Option<&str>) -> Self {
        Self { columns: columns as usize, tile_px, title: title.map(str::to_owned), rows: Vec::new() }
    }

    /// Adds tiles that begin a new row; none if there are none.
    pub fn add_rows(&mut self, tiles: Vec<Tile>) {
        let mut tiles = tiles.into_iter().peekable();
        while tiles.peek().is_some() {
            self.rows.push(tiles.by_ref().take(self.columns).collect());
        }
    }

    /// All on paper.
    ///
    /// # Errors
    /// A sheet too large to be looked at.
    pub fn draw(&self) -> anyhow::Result<RgbImage> {
        let widest = self.rows.iter().map(Vec::len).max().unwrap_or(0) as u32;
        let width = GAP_PX + widest * (self.tile_px + GAP_PX);
        let title = if self.title.is_some() { TITLE_PX } else { 0 };
        let heights: Vec<u32> = self.rows.iter().map(|row| row_height(row)).collect();
        let height = heights.iter().map(|height| u64::from(height + GAP_PX + LABEL_PX)).sum::<u64>();
        let height = height + u64::from(GAP_PX + title);
        if u64::from(width) * height > MAX_PIXELS {
            bail!("the sheet would have {width}x{height} pixels: give fewer pictures or a smaller --tile-px");
        }
        let mut canvas = RgbImage::from_pixel(width, height as u32, PAPER);
        let font =
            FontRef::try_from_slice(epaint_default_fonts::UBUNTU_LIGHT).context("the font of labels")?;
        if let Some(title) = &self.title {
            text(&mut canvas, &font, title, [GAP_PX, GAP_PX / 2], TITLE_PX, width - 2 * GAP_PX);
        }
        let mut top = GAP_PX + title;
        for (row, height) in self.rows.iter().zip(heights) {
            for (column, tile) in (0..).zip(row) {
                let left = GAP_PX + column * (self.tile_px + GAP_PX);
                let inset = (self.tile_px - tile.image.width()) / 2;
                canvas.copy_from(&tile.image, left + inset, top)?;
                text(&mut canvas, &font, &tile.label, [left, top + height], LABEL_PX, self.tile_px);
            }
            top += height + LABEL_PX + GAP_PX;
        }
        Ok(canvas)
    }
}

fn row_height(row: &[Tile]) -> u32 {
    row.iter().map(|tile| tile.image.height()).max().unwrap_or(0)
}

/// One line, smaller where it would be wider than `room_px`.
fn text(
    canvas: &mut RgbImage,
    font: &FontRef<'_>,
    line: &str,
    [left, top]: [u32; 2],
    height_px: u32,
    room_px: u32,
) {
    let wanted = height_px as f32 * TEXT_SHARE;
    let advance = |size: f32| {
        let font = font.as_scaled(PxScale::from(size));
        line.chars().map(|letter| font.h_advance(font.glyph_id(letter))).sum::<f32>()
    };
    let size = wanted * (room_px as f32 / advance(wanted).max(1.0)).min(1.0);
    let scaled = font.as_scaled(PxScale::from(size));
    let baseline = top as f32 + (height_px as f32 + scaled.ascent() + scaled.descent()) / 2.0;
    let mut x = left as f32;
    for letter in line.chars() {
        let glyph = scaled.scaled_glyph(letter);
        let advance = scaled.h_advance(glyph.id);
        let placed = ab_glyph::Glyph { position: point(x, baseline), ..glyph };
        if let Some(outline) = scaled.outline_glyph(placed) {
            let bounds = outline.px_bounds();
            outline.draw(|dx, dy, share| {
                let (px, py) = (bounds.min.x + dx as f32, bounds.min.y + dy as f32);
                if px >= 0.0 && py >= 0.0 {
                    blend(canvas, px as u32, py as u32, share);
                }
            });
        }
        x += advance;
    }
}

fn blend(canvas: &mut RgbImage, x: u32, y: u32, share: f32) {
    if let Some(pixel) = canvas.get_pixel_mut_checked(x, y) {
        let mix = |(paper, ink): (u8, u8)| {
            (f32::from(paper) * (1.0 - share) + f32::from(ink) * share).round() as u8
        };
        *pixel = Rgb([0, 1, 2].map(|i| mix((pixel.0[i], INK.0[i]))));
    }
}
