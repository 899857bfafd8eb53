//! How well the tracker does on a recorded world: poses and overlay against the truth.
//!
//!     cargo run -p coshade-tests --example tracking [-- --no-filter --full-frame]

#![allow(clippy::print_stdout, reason = "a report")]

use anyhow::Result;
use clap::Parser;
use coshade_tests::tracking::{self, Figures};
use coshade_tracker::TrackerSettings;

#[derive(Parser)]
struct Args {
    /// Leave the jitter in
    #[arg(long)]
    no_filter: bool,
    /// Search the whole of every image
    #[arg(long)]
    full_frame: bool,
    /// Print every frame
    #[arg(long)]
    frames: bool,
}

fn main() -> Result<()> {
    let args = Args::parse();
    let settings =
        TrackerSettings { filter: !args.no_filter, regions: !args.full_frame, ..TrackerSettings::default() };
    let tracked = tracking::desk(settings)?;
    if args.frames {
        for frame in tracked.iter().flat_map(|body| &body.frames) {
            println!("{frame:?}");
        }
    }
    println!(
        "body           frames  mm median/95 %     deg median/95 %   overlay px median/95 %   ambiguous  flips"
    );
    for body in &tracked {
        let Figures { translation_mm, rotation_deg, overlay_px } = body.figures();
        println!(
            "{:14} {:6}  {:6.3} / {:6.3}   {:6.3} / {:6.3}   {:8.3} / {:6.3}   {:14} {:6}",
            body.name,
            body.frames.len(),
            translation_mm[0],
            translation_mm[1],
            rotation_deg[0],
            rotation_deg[1],
            overlay_px[0],
            overlay_px[1],
            body.ambiguous(),
            body.flips()
        );
    }
    Ok(())
}
