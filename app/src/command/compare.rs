//! `coshade compare`: how far two images are from each other.

use std::path::PathBuf;
use std::process::ExitCode;

use coshade_reference::compare::{self, CompareArgs};

use super::print;

/// Compare two images: RMSE in linear radiance, PSNR, SSIM, mean FLIP; apart for real, virtual and edge pixels.
///
/// Reads EXR, Radiance HDR, PNG and JPEG; FILE.exr#LAYER names a layer. 8- and 16-bit files are decoded from sRGB.
/// Differences are A − B, radiance 1.0 = white; FLIP is LDR-FLIP at 67 pixels per degree.
/// Exit code 0 however far they are from each other; 2 if they cannot be compared.
#[derive(clap::Args)]
pub struct Args {
    /// The image to judge
    a: String,
    /// The reference
    b: String,
    /// Layer of both images, where A or B names none
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,
    /// Coverage by virtual things: 0 real, 1 virtual, between edge; gives figures for each set
    #[arg(long, value_name = "FILE[#LAYER]")]
    coverage: Option<String>,
    /// Clip of the linear RMSE, in multiples of white
    #[arg(long, value_name = "WHITES", default_value_t = 4.0)]
    clip: f32,
    /// Exposure in stops before PSNR, SSIM and FLIP
    #[arg(long, value_name = "EV", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Write a picture of the signed difference, PNG: red where A is brighter, blue where it is darker
    #[arg(long, value_name = "PNG")]
    diff: Option<PathBuf>,
    /// Difference at the ends of that picture's colour scale; chosen from the images if not given
    #[arg(long, value_name = "RADIANCE", requires = "diff")]
    diff_limit: Option<f32>,
    /// Write a picture of the FLIP error, PNG
    #[arg(long, value_name = "PNG")]
    flip: Option<PathBuf>,
    /// Print one JSON object: `rmse_linear` (clipped), `rmse_linear_unclipped`, `psnr_db`, `ssim`, `flip_mean`, …,
    /// the same under `sets.real`, `sets.virtual`, `sets.edge`; `null` where a figure does not exist
    #[arg(long)]
    json: bool,
}

/// Compares and prints.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let report = compare::run(&CompareArgs {
        layer: args.layer.clone(),
        coverage: args.coverage.clone(),
        clip_white: args.clip,
        exposure_ev: args.exposure,
        diff: args.diff.clone(),
        diff_limit: args.diff_limit,
        flip: args.flip.clone(),
        ..CompareArgs::new(&args.a, &args.b)
    })?;
    if args.json {
        print::json(&report)?;
    } else {
        print::text(&report.to_string())?;
    }
    Ok(ExitCode::SUCCESS)
}
