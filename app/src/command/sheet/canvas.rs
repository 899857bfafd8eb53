//! Where tiles and text go.

use anyhow::bail;
use image::{GenericImage, Rgb, RgbImage};

use super::Tile;
use crate::canvas::{self, Text};

const PAPER: Rgb<u8> = Rgb([250, 250, 248]);
const INK: Rgb<u8> = Rgb([40, 40, 44]);
/// Between tiles and around them.
const GAP_PX: u32 = 12;
const LABEL_PX: u32 = 22;
const TITLE_PX: u32 = 34;
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
        let font = canvas::font()?;
        let write = |canvas: &mut RgbImage, line: &str, [left, top]: [u32; 2], height_px, room_px| {
            let at_px = [left as f32, top as f32];
            Text { font: &font, line, at_px, height_px, room_px, ink: INK }.draw(canvas);
        };
        if let Some(title) = &self.title {
            write(&mut canvas, title, [GAP_PX, GAP_PX / 2], TITLE_PX, width - 2 * GAP_PX);
        }
        let mut top = GAP_PX + title;
        for (row, height) in self.rows.iter().zip(heights) {
            for (column, tile) in (0..).zip(row) {
                let left = GAP_PX + column * (self.tile_px + GAP_PX);
                let inset = (self.tile_px - tile.image.width()) / 2;
                canvas.copy_from(&tile.image, left + inset, top)?;
                write(&mut canvas, &tile.label, [left, top + height], LABEL_PX, self.tile_px);
            }
            top += height + LABEL_PX + GAP_PX;
        }
        Ok(canvas)
    }
}

fn row_height(row: &[Tile]) -> u32 {
    row.iter().map(|tile| tile.image.height()).max().unwrap_or(0)
}
