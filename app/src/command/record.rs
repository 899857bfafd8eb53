//! `coshade record`: writes what cameras deliver into a recording.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};
use coshade_capture::recording::{Compression, Recorder, RecordingOptions, StreamCounts, StreamId};
use coshade_capture::{Camera, CaptureError, Timestamp, clock};
use coshade_lens::calibration::Calibration;
use coshade_scene::session::Session;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::print;
use crate::{interrupt, sources};

/// Frames that may wait to be written, of all streams together.
const QUEUE_FRAMES: usize = 64;
/// How often a thread that waits for a frame looks whether it should end.
const POLL: Duration = Duration::from_millis(100);
/// How long a source that can wait does so for the disk.
const DISK: Duration = Duration::from_secs(30);

/// Record cameras into an MCAP file: the sensors of a session, or sources named one by one.
///
/// Ends when every source has ended, after --duration or --frames, or on Ctrl-C; the file is whole in every case. Live
/// cameras never wait for the disk: frames that do not fit are counted and reported. Exit code 1 if frames were lost.
#[derive(clap::Args)]
pub struct Args {
    /// Session file, whose camera, fisheye and depth sources are recorded
    #[arg(required_unless_present = "source")]
    session: Option<PathBuf>,
    /// A source, as NAME=URI, such as camera=images:photos/*.png?fps=30 (repeat for more)
    #[arg(long, value_name = "NAME=URI", conflicts_with = "session", value_parser = name_and_value)]
    source: Vec<(String, String)>,
    /// Calibration file of a source, as NAME=FILE
    #[arg(long, value_name = "NAME=FILE", conflicts_with = "session", value_parser = name_and_value)]
    calibration: Vec<(String, String)>,
    /// The recording to write
    #[arg(short, long, value_name = "MCAP")]
    output: PathBuf,
    /// Replace OUTPUT if it exists
    #[arg(long)]
    overwrite: bool,
    /// End after so many seconds
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,
    /// End each stream after so many frames
    #[arg(long, value_name = "COUNT")]
    frames: Option<u64>,
    /// none: least work, largest file; lz4; zstd: smallest file, several times the work of lz4
    #[arg(long, value_enum, default_value = "lz4")]
    compression: CompressionArg,
    /// Print one JSON object: `output`, `duration_s`, and `streams`, each with `name`, `written`, `dropped` (no room
    /// in the recorder's queue) and `damaged` (could not be read from the source)
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum CompressionArg {
    None,
    Lz4,
    Zstd,
}

/// A source about to be recorded.
struct Input {
    name: String,
    camera: Box<dyn Camera>,
    calibration: Option<Calibration>,
}

#[derive(Serialize)]
struct Summary {
    output: PathBuf,
    duration_s: f64,
    streams: Vec<StreamSummary>,
}

#[derive(Serialize)]
struct StreamSummary {
    #[serde(flatten)]
    counts: StreamCounts,
    damaged: u64,
}

/// Records and prints what was recorded.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let (inputs, session_text) = match &args.session {
        Some(path) => session_inputs(path)?,
        None => (named_inputs(&args.source, &args.calibration)?, None),
    };
    let options = RecordingOptions {
        overwrite: args.overwrite,
        compression: match args.compression {
            CompressionArg::None => Compression::None,
            CompressionArg::Lz4 => Compression::Lz4,
            CompressionArg::Zstd => Compression::Zstd,
        },
        session: session_text,
        ..RecordingOptions::default()
    };
    let recorder = Recorder::create(&args.output, options, QUEUE_FRAMES)?;
    let begun = clock::now();
    let limits = Limits { end: args.duration.map(|duration| begun + duration), frames: args.frames };
    let damaged = record_all(&recorder, inputs, limits)?;
    let duration_s = clock::now().saturating_since(begun).as_secs_f64();
    let counts = recorder.finish()?;
    let streams =
        counts.into_iter().zip(damaged).map(|(counts, damaged)| StreamSummary { counts, damaged }).collect();
    report(&Summary { output: args.output.clone(), duration_s, streams }, args.json)
}

fn report(summary: &Summary, json: bool) -> anyhow::Result<ExitCode> {
    if json {
        print::json(summary)?;
    } else {
        let mut text = format!("{}: {:.2} s\n", summary.output.display(), summary.duration_s);
        for StreamSummary { counts, damaged } in &summary.streams {
            let StreamCounts { name, written, dropped } = counts;
            text += &format!("  stream {name}: {written} frames, {dropped} dropped, {damaged} damaged\n");
        }
        print::text(&text)?;
    }
    let lost = summary.streams.iter().any(|stream| stream.counts.dropped + stream.damaged > 0);
    Ok(if lost { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

#[derive(Clone, Copy)]
struct Limits {
    end: Option<Timestamp>,
    frames: Option<u64>,
}

/// One thread a source, until all have ended. Returns the number of damaged frames of each.
fn record_all(recorder: &Recorder, inputs: Vec<Input>, limits: Limits) -> anyhow::Result<Vec<u64>> {
    let stop = interrupt::on_ctrl_c()?;
    let progress = progress_line();
    let mut streams = Vec::new();
    for input in inputs {
        let rate = input.camera.stream().frames_per_second;
        let id = recorder.add_stream(&input.name, input.calibration.as_ref(), rate)?;
        streams.push((input, id, AtomicU64::new(0)));
    }
    let failed: Vec<anyhow::Error> = thread::scope(|scope| {
        let threads: Vec<_> = streams
            .iter_mut()
            .map(|(input, id, damaged)| {
                let work = || record_one(recorder, input, *id, limits, stop, damaged);
                thread::Builder::new().name(format!("record {id:?}")).spawn_scoped(scope, work)
            })
            .collect();
        while threads.iter().flatten().any(|thread| !thread.is_finished()) {
            progress.set_message(format!("{} frames", recorder.written()));
            progress.tick();
            thread::sleep(POLL);
        }
        threads.into_iter().filter_map(|thread| joined(thread).err()).collect()
    });
    progress.finish_and_clear();
    for error in &failed {
        tracing::warn!("{error:#}");
    }
    if failed.len() == streams.len()
        && recorder.written() == 0
        && let Some(error) = failed.into_iter().next()
    {
        return Err(error);
    }
    Ok(streams.into_iter().map(|(_, _, damaged)| damaged.into_inner()).collect())
}

fn joined(
    thread: std::io::Result<thread::ScopedJoinHandle<'_, anyhow::Result<()>>>,
) -> anyhow::Result<()> {
    thread.context("no thread for a source")?.join().map_err(|_| anyhow!("a source's thread has failed"))?
}

fn record_one(
    recorder: &Recorder,
    input: &mut Input,
    stream: StreamId,
    limits: Limits,
    stop: &AtomicBool,
    damaged: &AtomicU64,
) -> anyhow::Result<()> {
    let mut taken = 0;
    let over = |taken| {
        stop.load(Ordering::Relaxed)
            || limits.end.is_some_and(|end| clock::now() >= end)
            || limits.frames.is_some_and(|frames| taken >= frames)
    };
    while !over(taken) {
        match input.camera.next_frame(POLL) {
            Ok(frame) => {
                let recorded = if input.camera.is_live() {
                    recorder.try_record(stream, frame)
                } else {
                    recorder.record_within(stream, frame, DISK)
                };
                if !recorded && let Some(error) = recorder.take_error() {
                    return Err(error.into());
                }
                taken += 1;
            }
            Err(CaptureError::Timeout { .. }) => {}
            Err(CaptureError::EndOfStream { .. }) => break,
            Err(error @ CaptureError::Damaged { .. }) => {
                tracing::warn!("{error}");
                damaged.fetch_add(1, Ordering::Relaxed);
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

fn progress_line() -> ProgressBar {
    let progress = ProgressBar::new_spinner();
    if let Ok(style) = ProgressStyle::with_template("{spinner} recording {elapsed}, {msg}") {
        progress.set_style(style);
    }
    progress
}

fn session_inputs(path: &Path) -> anyhow::Result<(Vec<Input>, Option<String>)> {
    let session = Session::read(path)?;
    let inputs = sources::sensors(&session)?
        .into_iter()
        .map(|sensor| open(sensor.name, &sensor.source, sensor.calibration.as_deref()))
        .collect::<anyhow::Result<_>>()?;
    Ok((inputs, Some(session.text().to_owned())))
}

fn named_inputs(
    source: &[(String, String)],
    calibration: &[(String, String)],
) -> anyhow::Result<Vec<Input>> {
    for (name, file) in calibration {
        if source.iter().all(|(source, _)| source != name) {
            bail!("--calibration {name}={file}: there is no --source {name}=…");
        }
    }
    for (index, (name, _)) in source.iter().enumerate() {
        if source[..index].iter().any(|(other, _)| other == name) {
            bail!("--source {name}=…: two sources of this name");
        }
    }
    source
        .iter()
        .map(|(name, uri)| {
            let file = calibration.iter().find(|(of, _)| of == name).map(|(_, file)| Path::new(file));
            open(name, uri, file)
        })
        .collect()
}

fn open(name: &str, source: &str, calibration: Option<&Path>) -> anyhow::Result<Input> {
    let camera = sources::registry().open(source)?;
    let calibration = match calibration {
        Some(file) => Some(sources::calibration_for(camera.as_ref(), file)?),
        None => camera.calibration().cloned(),
    };
    Ok(Input { name: name.to_owned(), camera, calibration })
}

fn name_and_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("write NAME=VALUE".to_owned()),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let seconds: f64 = text.parse().map_err(|_| "not a number of seconds")?;
    Duration::try_from_secs_f64(seconds).map_err(|error| error.to_string())
}
