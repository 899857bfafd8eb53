//! `coshade simulate`: a described world as its sensors would record it.

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::Ordering;

use coshade_capture::recording::{Compression, RecordingOptions, StreamCounts};
use coshade_sim::cache::PictureCache;
use coshade_sim::recording::Recording;
use coshade_sim::world::World;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::print;
use crate::interrupt;

/// Trace a described world through its simulated sensors into a recording.
///
/// The recording holds frames, calibrations and true poses; MCAP.truth.json beside it holds the truth of each frame.
/// docs/world.md lists the keys of a world file. Traced pictures are kept, so a second run only adds what has changed.
/// Ctrl-C ends with what is done; the recording is whole.
#[derive(clap::Args)]
pub struct Args {
    /// World file
    world: PathBuf,
    /// The recording to write
    #[arg(short, long, value_name = "MCAP")]
    output: PathBuf,
    /// Replace OUTPUT if it exists
    #[arg(long)]
    overwrite: bool,
    /// Trace all pictures anew, and keep none
    #[arg(long)]
    no_cache: bool,
    /// Print one JSON object: `output`, `truth` (file), and `streams`, each with `name`, `written`, `dropped`
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Summary {
    output: PathBuf,
    truth: PathBuf,
    streams: Vec<StreamCounts>,
}

/// Simulates and prints what was recorded.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let world = World::read(&args.world)?;
    let tracer = Arc::new(world.tracer()?);
    let cache = if args.no_cache { None } else { PictureCache::of_user() };
    let stop = interrupt::on_ctrl_c()?;
    let bar = ProgressBar::new(0);
    bar.set_style(ProgressStyle::with_template("simulating {elapsed} {wide_bar} {pos} of {len} frames")?);
    // Nothing waits for the disk: rather a small file.
    let options = RecordingOptions {
        overwrite: args.overwrite,
        compression: Compression::Zstd,
        ..RecordingOptions::default()
    };
    let simulated = Recording { world: &world, tracer, cache }.write(&args.output, options, |progress| {
        bar.set_length(progress.total);
        bar.set_position(progress.done);
        !stop.load(Ordering::Relaxed)
    });
    bar.finish_and_clear();
    let simulated = simulated?;
    let summary = Summary { output: args.output.clone(), truth: simulated.truth, streams: simulated.streams };
    if args.json {
        print::json(&summary)?;
    } else {
        let mut text = format!("{}, {}\n", summary.output.display(), summary.truth.display());
        for StreamCounts { name, written, .. } in &summary.streams {
            text += &format!("  stream {name}: {written} frames\n");
        }
        print::text(&text)?;
    }
    Ok(ExitCode::SUCCESS)
}
