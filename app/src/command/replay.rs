//! `coshade replay`: plays a recording through, as a session would.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use coshade_capture::recording::Reader;
use coshade_capture::replay::{Playback, Rate, ReplayCamera, ReplayOptions};
use coshade_capture::{Camera, CaptureError, Converter, Frame, PixelFormat, Timestamp, clock};
use coshade_image_file::{Image, LayeredImage, Precision, write_exr};
use glam::Vec3;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::{print, seconds};
use crate::interrupt;

const POLL: Duration = Duration::from_millis(100);

/// Play a recording through and report rates, gaps and damage; --export writes its frames as image files.
///
/// Exit code 1 if frames were damaged, 2 if the recording cannot be played or an image not written.
#[derive(clap::Args)]
pub struct Args {
    /// The recording; FILE#STREAM plays one stream, FILE all
    recording: String,
    /// 1 = in real time, 2 = twice as fast, max = as fast as can be
    #[arg(long, default_value = "1", value_parser = rate)]
    rate: Rate,
    /// Begin so many seconds after the first frame
    #[arg(long, value_name = "SECONDS", default_value = "0", value_parser = seconds, allow_negative_numbers = true)]
    start: Duration,
    /// Play again and again, until Ctrl-C
    #[arg(long = "loop")]
    looping: bool,
    /// Write the frames here as STREAM/000000.png (colour, grey, 16 bit depth), .jpg (as it came from the camera) or
    /// .exr (linear light)
    #[arg(long, value_name = "FOLDER", conflicts_with = "looping")]
    export: Option<PathBuf>,
    /// Print one JSON object: `duration_s` (wall clock), and `streams`, each with `name`, `frames`, `damaged`,
    /// `missing` (by the frames' numbers), `frames_per_second` (wall clock) and `mean_lateness_ms`, `max_lateness_ms`
    /// (behind the recorded pace; null with --rate max)
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Summary {
    recording: PathBuf,
    duration_s: f64,
    streams: Vec<StreamSummary>,
}

#[derive(Clone, Debug, Default, Serialize)]
struct StreamSummary {
    name: String,
    frames: u64,
    damaged: u64,
    missing: u64,
    frames_per_second: Option<f64>,
    mean_lateness_ms: Option<f64>,
    max_lateness_ms: Option<f64>,
}

/// Plays and prints.
pub fn run(args: &Args) -> anyhow::Result<ExitCode> {
    let whole = Path::new(&args.recording);
    let (path, only) = match args.recording.rsplit_once('#') {
        Some((path, stream)) if !whole.exists() => (PathBuf::from(path), Some(stream)),
        _ => (whole.to_owned(), None),
    };
    let options = ReplayOptions { rate: args.rate, looping: args.looping, start: args.start };
    let playback = Playback::open(&path, options)?;
    if args.start > playback.duration() {
        let length_s = playback.duration().as_secs_f64();
        bail!("--start {}: {} lasts only {length_s:.3} s", args.start.as_secs_f64(), path.display());
    }
    let names: Vec<String> = match only {
        Some(name) => vec![name.to_owned()],
        None => Reader::open(&path)?.streams().iter().map(|stream| stream.name.clone()).collect(),
    };
    let cameras = names
        .into_iter()
        .map(|name| Ok((playback.camera(Some(&name))?, name)))
        .collect::<anyhow::Result<Vec<_>>>()?;
    let summary = play(args, &playback, cameras)?;
    if args.json {
        print::json(&summary)?;
    } else {
        print::text(&text(&summary))?;
    }
    let damaged = summary.streams.iter().any(|stream| stream.damaged > 0);
    Ok(if damaged { ExitCode::FAILURE } else { ExitCode::SUCCESS })
}

fn text(summary: &Summary) -> String {
    let mut out = format!("{}: {:.2} s\n", summary.recording.display(), summary.duration_s);
    for stream in &summary.streams {
        let StreamSummary { name, frames, damaged, missing, .. } = stream;
        out += &format!("  stream {name}: {frames} frames, {missing} missing, {damaged} damaged");
        if let Some(rate) = stream.frames_per_second {
            out += &format!(", {rate:.1} frames/s");
        }
        if let (Some(mean), Some(max)) = (stream.mean_lateness_ms, stream.max_lateness_ms) {
            out += &format!(", late by {mean:.2} ms (at most {max:.2} ms)");
        }
        out += "\n";
    }
    out
}

fn play(args: &Args, playback: &Playback, cameras: Vec<(ReplayCamera, String)>) -> anyhow::Result<Summary> {
    let stop = interrupt::on_ctrl_c()?;
    let length_s = playback.duration().as_secs_f64();
    let progress = ProgressBar::new((length_s * 1e3) as u64);
    progress.set_style(ProgressStyle::with_template("replaying {elapsed} {wide_bar} {percent}%")?);
    let begun = clock::now();
    let streams = thread::scope(|scope| {
        let threads: Vec<_> = cameras
            .into_iter()
            .map(|(camera, name)| {
                let work = move || play_one(camera, name, args, stop);
                thread::Builder::new().name("replay".to_owned()).spawn_scoped(scope, work)
            })
            .collect();
        while threads.iter().flatten().any(|thread| !thread.is_finished()) {
            progress.set_position(playback.position().as_millis() as u64);
            thread::sleep(POLL.min(Duration::from_millis(20)));
        }
        threads
            .into_iter()
            .map(|thread| {
                thread
                    .context("no thread for a stream")?
                    .join()
                    .map_err(|_| anyhow!("a stream's thread has failed"))?
            })
            .collect::<anyhow::Result<Vec<_>>>()
    });
    progress.finish_and_clear();
    let duration_s = clock::now().saturating_since(begun).as_secs_f64();
    Ok(Summary { recording: playback.path().to_owned(), duration_s, streams: streams? })
}

fn play_one(
    mut camera: ReplayCamera,
    name: String,
    args: &Args,
    stop: &AtomicBool,
) -> anyhow::Result<StreamSummary> {
    let mut tally = Tally::new(name, args.rate);
    let mut export = match &args.export {
        Some(folder) => Some(Export::new(folder, &tally.summary.name)?),
        None => None,
    };
    while !stop.load(Ordering::Relaxed) {
        match camera.next_frame(POLL) {
            Ok(frame) => {
                tally.count(&frame);
                if let Some(export) = &mut export {
                    export.write(&frame)?;
                }
            }
            Err(CaptureError::Timeout { .. }) => {}
            Err(CaptureError::EndOfStream { .. }) => break,
            Err(error @ CaptureError::Damaged { .. }) => {
                tracing::warn!("{error}");
                tally.summary.damaged += 1;
            }
            Err(error) => return Err(error.into()),
        }
    }
    Ok(tally.finish())
}

/// Counts the frames of a stream and compares their pace with the recorded one.
struct Tally {
    summary: StreamSummary,
    rate: Rate,
    /// Capture and wall-clock time of the first frame.
    first: Option<(Timestamp, Timestamp)>,
    last_arrival: Timestamp,
    last_sequence: Option<u64>,
    lateness_sum_ms: f64,
}

impl Tally {
    fn new(name: String, rate: Rate) -> Self {
        let summary = StreamSummary { name, ..StreamSummary::default() };
        let last_arrival = Timestamp::default();
        Self { summary, rate, first: None, last_arrival, last_sequence: None, lateness_sum_ms: 0.0 }
    }

    fn count(&mut self, frame: &Frame) {
        let now = clock::now();
        let (first_capture, first_arrival) = *self.first.get_or_insert((frame.captured, now));
        self.summary.frames += 1;
        self.last_arrival = now;
        if let Some(last) = self.last_sequence.replace(frame.sequence) {
            self.summary.missing += frame.sequence.saturating_sub(last).saturating_sub(1);
        }
        if let Rate::Times(times) = self.rate {
            let due_ns = frame.captured.signed_ns_since(first_capture) as f64 / times;
            let late_ms = (now.signed_ns_since(first_arrival) as f64 - due_ns) * 1e-6;
            self.lateness_sum_ms += late_ms;
            let max = self.summary.max_lateness_ms.get_or_insert(late_ms);
            *max = max.max(late_ms);
        }
    }

    fn finish(mut self) -> StreamSummary {
        if let Some((_, first_arrival)) = self.first {
            let span_s = self.last_arrival.saturating_since(first_arrival).as_secs_f64();
            let intervals = self.summary.frames.saturating_sub(1) as f64;
            self.summary.frames_per_second = (span_s > 0.0).then(|| intervals / span_s);
            if self.summary.max_lateness_ms.is_some() {
                self.summary.mean_lateness_ms = Some(self.lateness_sum_ms / self.summary.frames as f64);
            }
        }
        self.summary
    }
}

/// Writes frames as files that any program reads.
struct Export {
    folder: PathBuf,
    converter: Converter,
    written: u64,
}

impl Export {
    fn new(folder: &Path, stream: &str) -> anyhow::Result<Self> {
        let folder = folder.join(folder_name(stream));
        std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
        Ok(Self { folder, converter: Converter::default(), written: 0 })
    }

    fn write(&mut self, frame: &Frame) -> anyhow::Result<()> {
        let ending = match frame.format {
            PixelFormat::Mjpg => "jpg",
            PixelFormat::RgbF32 => "exr",
            _ => "png",
        };
        let path = self.folder.join(format!("{:06}.{ending}", self.written));
        self.written += 1;
        let written = self.write_file(&path, frame).with_context(|| path.display().to_string());
        if written.is_err() {
            // Half an image is worse than none; the error above is the one to report.
            let _ = std::fs::remove_file(&path);
        }
        written
    }

    fn write_file(&mut self, path: &Path, frame: &Frame) -> anyhow::Result<()> {
        let (width, height) = (frame.width_px, frame.height_px);
        match frame.format {
            PixelFormat::Mjpg => Ok(std::fs::write(path, &frame.pixels[..])?),
            PixelFormat::RgbF32 => {
                let pixels: Vec<Vec3> =
                    (0..height).flat_map(|y| frame.rgb_f32_row(y)).map(Vec3::from_array).collect();
                let image = Image::from_rgb(width as usize, height as usize, &pixels)?;
                Ok(write_exr(path, &LayeredImage::single(image), Precision::Float)?)
            }
            PixelFormat::Grey => {
                let rows: Vec<u8> = (0..height).filter_map(|y| frame.row(y)).flatten().copied().collect();
                Ok(image::save_buffer(path, &rows, width, height, image::ColorType::L8)?)
            }
            PixelFormat::Y16 | PixelFormat::Z16 => {
                let bytes: Vec<u8> = (0..height).filter_map(|y| frame.row(y)).flatten().copied().collect();
                let codes =
                    bytes.chunks_exact(2).map(|code| u16::from_le_bytes([code[0], code[1]])).collect();
                let image = image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::from_raw(width, height, codes);
                Ok(image.context("a frame shorter than its size")?.save(path)?)
            }
            _ => {
                let mut rgb = vec![0; 3 * frame.pixel_count()];
                self.converter.rgb24(frame, &mut rgb)?;
                Ok(image::save_buffer(path, &rgb, width, height, image::ColorType::Rgb8)?)
            }
        }
    }
}

/// The folder for a stream, always one within the export: a stream of another program's recording is named by its
/// topic, which may hold slashes, or be `..`.
fn folder_name(stream: &str) -> String {
    let name = stream.replace(['/', '\\'], "_");
    if name.chars().all(|c| c == '.') { name.replace('.', "_") + "_" } else { name }
}

fn rate(text: &str) -> Result<Rate, String> {
    if text == "max" {
        return Ok(Rate::Max);
    }
    match text.parse::<f64>() {
        Ok(times) if (0.001..=1000.0).contains(&times) => Ok(Rate::Times(times)),
        _ => Err("a factor from 0.001 to 1000, or max".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::folder_name;

    #[test]
    fn an_export_stays_in_its_folder() {
        assert_eq!(folder_name("camera"), "camera");
        assert_eq!(folder_name("device_0/image/data"), "device_0_image_data");
        for stream in ["", ".", "..", "../..", "/", "/etc", "..\\.."] {
            let name = folder_name(stream);
            let parts: Vec<_> = std::path::Path::new(&name).components().collect();
            assert!(matches!(parts[..], [std::path::Component::Normal(_)]), "{stream:?} became {name:?}");
        }
    }
}
