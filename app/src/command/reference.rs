//! `coshade reference`: the path-traced truth of a session.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::{Context as _, bail};
use coshade_image_file::Precision;
use coshade_reference::film::{Film, merge};
use coshade_reference::integrator::Settings;
use coshade_reference::job::{JobOptions, Progress, Shard, render};
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::print;
use super::traced::Traced;
use crate::interrupt;

/// Steps of the progress bar.
const STEPS: u64 = 1000;

/// Trace the truth: the real room, and the room with the virtual things really in it.
///
/// Of a session, whose camera must stand still (`pose` in `[camera]`), or of what a sensor of a simulated world sees in one of its frames.
/// Light comes from `[environment]` and `[[light]]`. The EXR has
/// layers `real`, `mixed`, `difference` (mixed − real), `depth_z_m` (or `range_m`), `normal`, `albedo`, `coverage` (share
/// of the pixel that virtual things cover) and variances of the means. Same seed, same picture, whatever the number of
/// threads. Ctrl-C writes what is done.
#[derive(clap::Args)]
pub struct Args {
    /// Session file, or a world file and one of its sensors, such as desk.toml#camera
    #[arg(value_name = "SESSION|WORLD#SENSOR", required_unless_present = "merge")]
    scene: Option<String>,
    /// Which frame of a world's sensor, from 0; the whole picture is of the middle of its exposure
    #[arg(long, value_name = "N", conflicts_with = "merge")]
    frame: Option<u64>,
    /// Put these shards together instead of tracing
    #[arg(long, value_name = "EXR", num_args = 1.., conflicts_with = "scene")]
    merge: Vec<PathBuf>,
    /// The picture to write
    #[arg(short, long, value_name = "EXR")]
    output: PathBuf,
    /// Samples a pixel. Higher: less noise (it falls with the square root), slower
    #[arg(long, default_value_t = 64)]
    samples: u32,
    /// Begin no further pass after so many seconds
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    seconds: Option<Duration>,
    /// End when the noise of the difference is at most this share of the difference (root mean squares)
    #[arg(long, value_name = "SHARE")]
    error: Option<f64>,
    /// Most scattering events of a path; 1 = direct light. Left out: what the world file says under [trace], else 64
    #[arg(long, value_name = "EVENTS")]
    max_depth: Option<u32>,
    /// Another seed is an independent picture
    #[arg(long, default_value_t = 0)]
    seed: u32,
    /// Trace part i of n only; --merge puts the parts together to the very same picture
    #[arg(long, value_name = "I/N", default_value = "1/1")]
    shard: Shard,
    /// 0 = one for each processor
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Write half floats (shards are always float)
    #[arg(long)]
    half: bool,
    /// Print one JSON object: `output`, `samples_min`, `seconds`, the root mean squares over the pixels
    /// `difference_rms` and `difference_standard_error_rms`, and `relative_error`, which --error bounds
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Summary {
    output: PathBuf,
    samples_min: u32,
    seconds: f64,
    difference_rms: f64,
    difference_standard_error_rms: f64,
    relative_error: f64,
}

/// Traces or merges, and writes.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    check_output(&args.output)?;
    let begun = coshade_capture::clock::now();
    let film = match &args.scene {
        Some(name) => trace(name, args)?,
        None => merged(&args.merge)?,
    };
    let whole = args.shard.count == 1;
    let precision = if args.half && whole { Precision::Half } else { Precision::Float };
    film.write(&args.output, precision)?;
    let figures = film.figures();
    let summary = Summary {
        output: args.output.clone(),
        samples_min: figures.samples_min,
        seconds: coshade_capture::clock::now().saturating_since(begun).as_secs_f64(),
        difference_rms: figures.difference_rms,
        difference_standard_error_rms: figures.difference_error_rms,
        relative_error: figures.relative_error(),
    };
    if args.json {
        print::json(&summary)?;
    } else {
        print::text(&format!(
            "{}: {} samples a pixel, {:.1} s, noise {:.2}% of the difference\n",
            summary.output.display(),
            summary.samples_min,
            summary.seconds,
            100.0 * summary.relative_error
        ))?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Before an hour of work, not behind it.
fn check_output(path: &Path) -> anyhow::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    if !folder.is_dir() {
        bail!("{}: the folder {} does not exist", path.display(), folder.display());
    }
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    if ending != "exr" {
        bail!("{}: layers need an .exr file", path.display());
    }
    Ok(())
}

fn merged(shards: &[PathBuf]) -> anyhow::Result<Film> {
    let films = shards.iter().map(|path| Ok(Film::read(path)?)).collect::<anyhow::Result<Vec<_>>>()?;
    // Its errors count the files from 1.
    let names: Vec<_> = shards.iter().map(|path| path.display().to_string()).collect();
    merge(&films).with_context(|| format!("cannot merge {}", names.join(", ")))
}

fn trace(name: &str, args: &Args) -> anyhow::Result<Film> {
    let Traced { scene, camera, max_depth } = Traced::read(name, args.frame)?;
    let default = Settings::default();
    let options = JobOptions {
        samples: args.samples,
        time_limit: args.seconds,
        error_limit: args.error,
        settings: Settings {
            max_depth: args.max_depth.or(max_depth).unwrap_or(default.max_depth),
            ..default
        },
        seed: args.seed,
        shard: args.shard,
        threads: args.threads,
        ..JobOptions::default()
    };
    let bar = ProgressBar::new(STEPS);
    bar.set_style(ProgressStyle::with_template("tracing {elapsed} {wide_bar} {msg}")?);
    let film =
        render(&scene, &camera, &options, |progress| show(&bar, progress, &options), interrupt::on_ctrl_c()?);
    bar.finish_and_clear();
    Ok(film?)
}

/// Of the limits, the one that is nearest.
fn show(bar: &ProgressBar, progress: &Progress, options: &JobOptions) {
    let by_samples = f64::from(progress.samples) / f64::from(progress.samples_wanted);
    let by_time =
        options.time_limit.map_or(0.0, |limit| progress.elapsed.as_secs_f64() / limit.as_secs_f64());
    // Noise falls with the square root of the work.
    let by_error = match (progress.relative_error, options.error_limit) {
        (Some(error), Some(limit)) => (limit / error).powi(2),
        _ => 0.0,
    };
    let done = by_samples.max(by_time).max(by_error).clamp(0.0, 1.0);
    bar.set_position((done * STEPS as f64) as u64);
    bar.set_message(format!("{} of {} samples", progress.samples, progress.samples_wanted));
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds")?;
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}
