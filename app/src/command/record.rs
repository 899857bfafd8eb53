//! `coshade record`: writes what cameras deliver into a recording.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::{Context as _, anyhow, bail};
use coshade_capture::recording::{
    Compression, Recorder, RecordingError, RecordingOptions, StreamCounts, StreamId, check_name,
};
use coshade_capture::{Camera, CaptureError, Timestamp, clock};
use coshade_lens::calibration::Calibration;
use coshade_scene::session::Session;
use coshade_scene::session::source::SourceUri;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::{print, seconds};
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
/// cameras never wait for the disk: frames that do not fit are counted and reported. Exit code 1 if frames were lost or
/// a source failed; 2, and no file, if nothing could be recorded.
#[derive(clap::Args)]
pub struct Args {
    /// Session file, whose camera, fisheye and depth sources are recorded
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
    #[arg(long, value_name = "SECONDS", value_parser = duration, allow_negative_numbers = true)]
    duration: Option<Duration>,
    /// End each stream after so many frames
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(1..))]
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
    source: String,
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
        None if args.source.is_empty() => bail!("name a session file, or sources with --source NAME=URI"),
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
    check_output(args, &inputs)?;
    let recorder = Recorder::create(&args.output, options, QUEUE_FRAMES).inspect_err(|error| {
        if matches!(error, RecordingError::Write { .. }) {
            remove_file(&args.output);
        }
    })?;
    let begun = clock::now();
    let limits = Limits { end: args.duration.map(|duration| begun + duration), frames: args.frames };
    let ended = record_all(&recorder, inputs, limits);
    let duration_s = clock::now().saturating_since(begun).as_secs_f64();
    let is_empty = recorder.written() == 0;
    let finished = recorder.finish();
    let failed = match (&ended, &finished) {
        (Err(_), _) | (_, Err(_)) => true,
        (Ok(ended), Ok(_)) => !ended.failed.is_empty(),
    };
    if failed && is_empty {
        remove_file(&args.output);
    }
    // Why a source or the file failed says more than that the recording has ended.
    let ended = ended?;
    let counts = match finished {
        Err(error) => return Err(ended.failed.into_iter().next().unwrap_or_else(|| error.into())),
        Ok(_) if failed && is_empty => {
            return Err(ended.failed.into_iter().next().unwrap_or_else(|| anyhow!("nothing was recorded")));
        }
        Ok(counts) => counts,
    };
    for error in &ended.failed {
        tracing::error!("{error:#}");
    }
    let streams = counts
        .into_iter()
        .zip(ended.damaged)
        .map(|(counts, damaged)| StreamSummary { counts, damaged })
        .collect();
    let whole = report(&Summary { output: args.output.clone(), duration_s, streams }, args.json)?;
    Ok(if failed { ExitCode::FAILURE } else { whole })
}

/// What exists is kept unless told otherwise, and what is being read is always kept.
fn check_output(args: &Args, inputs: &[Input]) -> anyhow::Result<()> {
    let output = &args.output;
    if output.is_dir() {
        bail!("{}: is a folder; name a file in it", output.display());
    }
    if output.exists() && !args.overwrite {
        bail!("{}: exists already; choose another name, or give --overwrite", output.display());
    }
    let Ok(output_file) = output.canonicalize() else { return Ok(()) };
    for input in inputs {
        let file =
            input.source.parse::<SourceUri>().ok().and_then(|uri| Path::new(&uri.path).canonicalize().ok());
        if file.as_ref() == Some(&output_file) {
            bail!("{}: source {} reads this file; choose another output", output.display(), input.name);
        }
    }
    Ok(())
}

/// A recording of nothing. Devices such as /dev/null stay.
fn remove_file(path: &Path) {
    if path.metadata().is_ok_and(|about| about.is_file())
        && let Err(error) = std::fs::remove_file(path)
    {
        tracing::warn!("{}: holds nothing, and cannot be removed: {error}", path.display());
    }
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

/// How the sources ended.
struct Ended {
    /// Damaged frames of each source.
    damaged: Vec<u64>,
    /// Why sources ended before their time.
    failed: Vec<anyhow::Error>,
}

/// One thread a source, until all have ended.
fn record_all(recorder: &Recorder, inputs: Vec<Input>, limits: Limits) -> anyhow::Result<Ended> {
    let stop = interrupt::on_ctrl_c()?;
    let progress = progress_line();
    let mut streams = Vec::new();
    for input in inputs {
        let rate = input.camera.stream().frames_per_second;
        let id = recorder.add_stream(&input.name, input.calibration.as_ref(), rate)?;
        streams.push((input, id, AtomicU64::new(0)));
    }
    let failed = thread::scope(|scope| {
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
    let damaged = streams.into_iter().map(|(_, _, damaged)| damaged.into_inner()).collect();
    Ok(Ended { damaged, failed })
}

fn joined(thread: std::io::Result<thread::ScopedJoinHandle<'_, anyhow::Result<()>>>) -> anyhow::Result<()> {
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

fn named_inputs(source: &[(String, String)], calibration: &[(String, String)]) -> anyhow::Result<Vec<Input>> {
    for (name, file) in calibration {
        if source.iter().all(|(source, _)| source != name) {
            bail!("--calibration {name}={file}: there is no --source {name}=…");
        }
    }
    for (index, (name, _)) in source.iter().enumerate() {
        check_name(name)?;
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
    Ok(Input { name: name.to_owned(), source: source.to_owned(), camera, calibration })
}

fn name_and_value(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() && !value.is_empty() => {
            Ok((name.to_owned(), value.to_owned()))
        }
        _ => Err("a name, `=`, and what it stands for, such as camera=images:photos".to_owned()),
    }
}

fn duration(text: &str) -> Result<Duration, String> {
    match seconds(text)? {
        Duration::ZERO => Err("nothing can be recorded in no time".to_owned()),
        duration => Ok(duration),
    }
}
