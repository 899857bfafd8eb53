//! `coshade track`: where tags and bodies are in the frames of a camera.

mod bodies;
pub mod input;
mod measured;
mod output;
pub mod rows;
mod summary;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::atomic::Ordering;
use std::time::Duration;

use anyhow::anyhow;
use coshade_capture::LatestError;
use coshade_tracker::detector::DetectorSettings;
use coshade_tracker::{Family, TagId, Tracker, TrackerSettings};
use indicatif::{ProgressBar, ProgressStyle};

use super::print;
use crate::interrupt;
use crate::pipeline::{CameraState, Event, Finished, Handover, Options, Pipeline, Retry, Severity};
use bodies::Bodies;
use input::{Beside, Input};
use output::Output;
use summary::{EventRow, Summary, Tally};

/// How often it is looked whether to end.
const POLL: Duration = Duration::from_millis(50);
/// Events that are kept for the summary.
const MAX_EVENTS: usize = 1000;

/// Find tags in the frames of a camera, and where the bodies that carry them are.
///
/// Give a session, or a source with --board and --tag. Prints a line for each body in each frame: number and time of the
/// frame; position in millimetres and rotation in degrees (about fixed x first, then y, then z) of the body in the camera's
/// frame (x right, y down, z forward); root mean square distance of its tags' corners from where the pose puts them; how
/// many tags it rests on; and why this pose and not its mirror image. At the end: rates, latency, and figures for each body
/// and tag.
///
/// Files are measured frame by frame, as fast as can be. Live cameras are measured at their newest frame, and opened again when they are
/// lost. Ctrl-C ends with what is done. Exit code 1 if frames were damaged, the camera was lost or the tracker failed; 2 if
/// nothing could be tracked.
#[derive(clap::Args)]
pub struct Args {
    /// Session file; or a source, such as replay:desk.mcap#camera or images:photos/*.png
    #[arg(value_name = "SESSION|SOURCE")]
    input: String,
    /// Calibration file of the source, unless it brings its own
    #[arg(long, value_name = "TOML")]
    calibration: Option<PathBuf>,
    /// A board to find in the source (repeat for more). The first body named lies flat at the world's origin
    #[arg(long, value_name = "TOML")]
    board: Vec<PathBuf>,
    /// A single tag to find in the source, such as tag36h11:7:0.05, its size in metres (repeat for more)
    #[arg(long, value_name = "FAMILY:ID:SIZE_M", value_parser = tag)]
    tag: Vec<(TagId, f64)>,
    /// A family whose tags are shown even if they are on no body (repeat for more); without any body, tag36h11
    #[arg(long, value_name = "NAME", value_parser = family)]
    family: Vec<Family>,
    /// End after so many frames
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..))]
    frames: Option<u64>,
    /// Only the frame of this number
    #[arg(long, value_name = "NUMBER", conflicts_with = "frames")]
    frame: Option<u64>,
    /// Poses as measured, with their jitter
    #[arg(long)]
    no_filter: bool,
    /// Look for tags in an image so many times smaller; corners are always measured in the whole one. Higher: faster, and
    /// small tags are missed
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = decimation)]
    decimate: f32,
    /// Threads of the detector
    #[arg(long, value_name = "COUNT", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=64))]
    threads: u32,
    /// Look at the whole of every image, not only around where tags were
    #[arg(long)]
    full_frame: bool,
    /// Take a file for a live camera: at its own pace, only the newest frame counts, and what is lost is opened again
    #[arg(long)]
    live: bool,
    /// Draw axes, outlines and names into the frames: a .png gets the last frame tracked, a folder gets each as
    /// NUMBER.png
    #[arg(short, long, value_name = "PNG|FOLDER")]
    output: Option<PathBuf>,
    /// Print one JSON object.
    /// `input`: the session or source.
    /// `frames`: for each frame `frame` (its number), `captured_ns` (middle of the exposure), `latency_ms` (from the frame
    /// being there to the end of its tracking; a file's frame may wait for the one before), `searched` (the whole image was
    /// searched), `world_from_camera` (null while the anchor is not seen), `bodies`, `tags`, `warnings`.
    /// `bodies` of a frame: `name`, `camera_from_body`, `measured_camera_from_body` (without filter), `position_std_mm` and
    /// `rotation_std_deg` (along and about the camera's axes), `rms_px` (corners to where the pose puts them), `reduced_chi2`
    /// (about 1 if lens and body are right), `certainty` (`clear`; `by_past`: another pose fits as well, and earlier frames
    /// decided; `ambiguous`: nothing decides), `other_camera_from_body` (null if clear), `tags_used`, `tags_rejected`.
    /// `tags` of a frame: `family`, `id`, `corners_px` (lower left, lower right, upper right, upper left of the print; the
    /// first pixel's centre is 0, 0), `hamming` (corrected bits) and `margin` (contrast of the bits, codes), both null if the
    /// tag was followed from the frame before, `poses` (both poses of a tag of known size, `camera_from_tag` and `rms_px`).
    /// Poses: `position_m`, `quaternion_xyzw`, and the same rotation as `rotation_deg`.
    /// `bodies` and `tags` of all frames: `frames` (in how many), `certainty` (how many of each), `jumps` (times that a
    /// measured rotation changed by more than 30 degrees between neighbouring frames), `frames_with_rejected_tags`, `rms_px`.
    /// `pipeline`: `elapsed_s`, `camera` (`delivering`, `stalled`, `lost`, `ended`), `frames_in`, `tracked`, `tracked_per_s`, `overwritten` (before tracking), `unread` (behind it),
    /// `missing` (by number), `damaged`, `stalls`, `lost`, `restarts`, `events_dropped`, `latency_ms`, `capture_latency_ms`
    /// (from the middle of the exposure; live cameras), `track_ms`, `camera_cpu_s`, `tracker_cpu_s`.
    /// `warnings`: what the tracker had to say, alike ones together: `message` (the first), `first_frame`, `count`.
    /// `events`: `at_s`, `thread`, `severity`, `message`.
    #[arg(long, verbatim_doc_comment, conflicts_with = "json_lines")]
    json: bool,
    /// Print a line of JSON for each frame as it comes, as in `frames` of --json, and at the end the rest
    #[arg(long)]
    json_lines: bool,
}

/// Tracks and prints.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let beside = Beside {
        calibration: args.calibration.as_deref(),
        boards: &args.board,
        tags: &args.tag,
        live: args.live,
    };
    let Input { name, source, calibration, bodies, filter } = Input::open(&args.input, &beside)?;
    let settings = TrackerSettings {
        detector: DetectorSettings {
            families: families(args, &bodies),
            decimate: args.decimate,
            threads: args.threads,
            ..DetectorSettings::default()
        },
        regions: !args.full_frame,
        filter: filter && !args.no_filter,
        ..TrackerSettings::default()
    };
    let mut output = Output::new(args, &calibration, &bodies)?;
    let stop = interrupt::on_ctrl_c()?;
    let (is_live, lens, list) = (args.live || source.camera.is_live(), calibration, bodies.list.clone());
    let build = move || Ok(Tracker::new(&lens, &list, settings.clone())?);
    let mut pipeline = Pipeline::start(source, build, options(args, is_live))?;
    let progress = progress(args);
    let mut tally = Tally::new(&bodies.list);
    let mut events = Vec::new();
    while !stop.load(Ordering::Relaxed) {
        note(pipeline.events(), &mut events);
        progress.set_message(status(pipeline.camera()));
        let tracked = match pipeline.receive(POLL) {
            Ok(tracked) => tracked,
            Err(LatestError::Timeout) => continue,
            Err(LatestError::Closed) => break,
        };
        let row = measured::row(&tracked, bodies.anchor.as_ref());
        tally.add(&row);
        output.frame(&tracked.frame, row)?;
        progress.inc(1);
    }
    let finished = pipeline.finish();
    progress.finish_and_clear();
    note(finished.events.iter().cloned(), &mut events);
    let frames = output.finish()?;
    let summary = tally.finish(name, finished.metrics.clone(), events, frames);
    report(args, &summary, finished)
}

fn report(args: &Args, summary: &Summary, finished: Finished) -> anyhow::Result<ExitCode> {
    let Finished { metrics, failures, .. } = finished;
    let failed = !failures.is_empty();
    for (index, failure) in failures.into_iter().enumerate() {
        if metrics.tracked == 0 && index == 0 {
            return Err(failure);
        }
        tracing::error!("{failure:#}");
    }
    if args.json {
        print::json(summary)?;
    } else if args.json_lines {
        print::text(&(serde_json::to_string(summary)? + "\n"))?;
    } else {
        print::text(&summary.text())?;
    }
    if metrics.tracked == 0 {
        return Err(anyhow!("{}: no frame could be tracked", summary.input));
    }
    let troubled = failed || metrics.damaged + metrics.lost + metrics.restarts > 0;
    Ok(if troubled { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn options(args: &Args, is_live: bool) -> Options {
    let (handover, retry) = match is_live {
        true => (Handover::Newest, Retry::UntilStopped),
        false => (Handover::Every, Retry::Never),
    };
    Options { handover, retry, only_frame: args.frame, max_frames: args.frames }
}

/// Those of the bodies, those asked for, and the usual one rather than none.
fn families(args: &Args, bodies: &Bodies) -> Vec<Family> {
    let tags = bodies.list.iter().flat_map(|body| &body.tags).map(|tag| tag.tag.family);
    let mut families: Vec<Family> = tags.chain(args.family.iter().copied()).collect();
    families.sort_unstable();
    families.dedup();
    if families.is_empty() { vec![Family::Tag36h11] } else { families }
}

fn note(new: impl Iterator<Item = Event>, events: &mut Vec<EventRow>) {
    for event in new {
        match event.severity {
            Severity::Error => tracing::error!("{event}"),
            // What was a warning is not left open.
            Severity::Warning | Severity::Info => tracing::warn!("{event}"),
        }
        if events.len() < MAX_EVENTS {
            events.push(EventRow::from(&event));
        }
    }
}

/// A count of frames, where they are not printed anyway.
fn progress(args: &Args) -> ProgressBar {
    if !args.json {
        return ProgressBar::hidden();
    }
    let progress = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("tracking {elapsed} {pos} frames, {per_sec} {msg}") {
        progress.set_style(style);
    }
    progress
}

fn status(camera: CameraState) -> &'static str {
    match camera {
        CameraState::Delivering | CameraState::Ended => "",
        CameraState::Stalled => "(the camera has stalled)",
        CameraState::Lost => "(the camera is gone)",
    }
}

pub fn tag(text: &str) -> Result<(TagId, f64), String> {
    let parts: Vec<&str> = text.split(':').collect();
    let &[name, id, size_m] = parts.as_slice() else {
        return Err("family, number and size in metres, such as tag36h11:7:0.05".to_owned());
    };
    let family = family(name)?;
    let count = family.tag_count();
    let id = id.parse().ok().filter(|id| *id < count);
    let id = id.ok_or_else(|| format!("{family} has tags from 0 to {}", count - 1))?;
    match size_m.parse::<f64>() {
        Ok(size_m) if (1e-6..=100.0).contains(&size_m) => Ok((TagId { family, id }, size_m)),
        _ => Err(format!("`{size_m}` is no size: metres, from 1e-6 to 100")),
    }
}

pub fn family(name: &str) -> Result<Family, String> {
    name.parse().map_err(|error: coshade_tracker::family::UnknownFamily| error.to_string())
}

pub fn decimation(text: &str) -> Result<f32, String> {
    match text.parse::<f32>() {
        Ok(factor) if (1.0..=16.0).contains(&factor) => Ok(factor),
        _ => Err("a factor from 1 to 16".to_owned()),
    }
}
