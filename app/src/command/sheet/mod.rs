//! `coshade sheet`: pictures and recordings at a glance.

mod canvas;
mod pictures;
mod recordings;
mod tone;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::bail;
use image::RgbImage;
use image::imageops::FilterType;

use super::print;
use canvas::Sheet;

/// Put pictures and frames of recordings on one labelled sheet.
///
/// Pictures stand side by side in the order given; each stream of a recording has a row of its own, of frames spread evenly over it. Radiance
/// is shown as sRGB, clipped at 1. Layers with values below zero, such as differences, are shown around mid-grey, scaled by their
/// 99.5th percentile (in the label); depth as colours from near (light) to far (dark).
#[derive(clap::Args)]
pub struct Args {
    /// Pictures (EXR, HDR, PNG, JPEG; file.exr#layer) and recordings (MCAP, bag; file.mcap#stream for one stream)
    #[arg(required = true, value_name = "PICTURE|RECORDING")]
    inputs: Vec<String>,
    /// The sheet to write
    #[arg(short, long, value_name = "PNG")]
    output: PathBuf,
    /// Pictures in a row
    #[arg(long, default_value_t = 4, value_parser = clap::value_parser!(u32).range(1..=64))]
    columns: u32,
    /// Width of each, pixels; smaller pictures are not enlarged
    #[arg(long, default_value_t = 320, value_parser = clap::value_parser!(u32).range(16..=4096))]
    tile_px: u32,
    /// A line above all
    #[arg(long)]
    title: Option<String>,
    /// Stops by which radiance is made brighter
    #[arg(long, default_value_t = 0.0, value_parser = stops, allow_negative_numbers = true)]
    exposure_ev: f32,
}

/// A picture and what is written under it.
pub(super) struct Tile {
    image: RgbImage,
    label: String,
}

/// Reads, lays out and writes.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    if !args.output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
        bail!("{}: sheets are written as .png", args.output.display());
    }
    let mut sheet = Sheet::new(args.columns, args.tile_px, args.title.as_deref());
    let mut row = Vec::new();
    for input in &args.inputs {
        if recordings::is_recording(input) {
            sheet.add_rows(std::mem::take(&mut row));
            for row in recordings::rows(input, args.columns)? {
                sheet.add_rows(row.into_iter().map(|tile| fitted(tile, args.tile_px)).collect());
            }
        } else {
            row.push(fitted(pictures::tile(input, args.exposure_ev)?, args.tile_px));
        }
    }
    sheet.add_rows(row);
    write(&args.output, &sheet.draw()?)?;
    print::text(&format!("{}\n", args.output.display()))?;
    Ok(ExitCode::SUCCESS)
}

/// Made no wider than a tile.
fn fitted(tile: Tile, tile_px: u32) -> Tile {
    let (width, height) = tile.image.dimensions();
    if width <= tile_px {
        return tile;
    }
    let scaled = f64::from(height) * f64::from(tile_px) / f64::from(width);
    let image =
        image::imageops::resize(&tile.image, tile_px, (scaled.round() as u32).max(1), FilterType::Triangle);
    Tile { image, ..tile }
}

fn write(path: &Path, sheet: &RgbImage) -> anyhow::Result<()> {
    Ok(coshade_image_file::write_png_rgb8(
        path,
        sheet.width() as usize,
        sheet.height() as usize,
        sheet.as_raw(),
    )?)
}

fn stops(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(stops) if (-30.0..=30.0).contains(&stops) => Ok(stops),
        _ => Err("a number of stops from -30 to 30".to_owned()),
    }
}
