//! A camera whose frames are image files.

use std::path::PathBuf;
use std::time::Duration;

use super::files;
use super::options::{ImagesOptions, Layout, Pace, TumStream};
use super::read::{Probe, Reader, Target, probe};
use super::tum::{self, TumFile};
use crate::camera::{Camera, CaptureError, StreamInfo};
use crate::clock::{Timestamp, now};
use crate::control::{Control, ControlInfo, ControlReport, ControlValue};
use crate::frame::Frame;
use crate::pixel_format::{ColorEncoding, PixelFormat, YuvMatrix, YuvRange};

const DEFAULT_FRAMES_PER_SECOND: f64 = 30.0;

/// Plays image files as frames, one after the other. None is left out if the reader is late: the rest comes later.
///
/// Stamps are those of the files' list (TUM), else the first frame is taken at 0 and the others follow at the rate.
pub struct ImagesCamera {
    name: String,
    stream: StreamInfo,
    files: Vec<TumFile>,
    reader: Reader,
    pace: Pace,
    repeat: bool,
    /// Time from the first frame to the first frame of the next round.
    round: Duration,
    sequence: u64,
    /// The moment on the clock that the first stamp stands for, once the first frame was asked for.
    started: Option<Timestamp>,
}

impl ImagesCamera {
    /// Opens the images that `options` name; `name` is for messages.
    ///
    /// Reads the header of every file, so that a folder of mixed sizes is refused here and not in its middle. Files
    /// that cannot be read at all are reported as damaged frames when their turn comes.
    ///
    /// # Errors
    /// [`CaptureError::Lost`] that says which file or option is wrong.
    pub fn open(name: &str, options: &ImagesOptions) -> Result<Self, CaptureError> {
        Self::try_open(name, options)
            .map_err(|reason| CaptureError::Lost { source_name: name.into(), reason })
    }

    fn try_open(name: &str, options: &ImagesOptions) -> Result<Self, String> {
        let target = match depth_unit_m(options) {
            Some(unit_m) => Target::Depth { unit_m, invalid: options.depth_invalid },
            None => Target::Image(options.deliver),
        };
        let fps = options.frames_per_second.unwrap_or(DEFAULT_FRAMES_PER_SECOND);
        let (files, frames_per_second) = match options.layout {
            Layout::Files => (at_rate(files::list(&options.path)?, fps), Some(fps)),
            Layout::Tum => (tum_files(options)?, None),
        };
        let probed = probe_all(&files, target, options.layer.as_deref())?;
        let format = target.format(probed.format)?;
        let stream = StreamInfo {
            format,
            color: color(format),
            width_px: probed.width_px,
            height_px: probed.height_px,
            frames_per_second,
            depth_unit_m: depth_unit_m(options),
        };
        let round = round(&files, Duration::from_secs_f64(1.0 / fps));
        Ok(Self {
            name: name.into(),
            stream,
            files,
            reader: Reader::new(target, options.layer.clone()),
            pace: options.pace,
            repeat: options.repeat,
            round,
            sequence: 0,
            started: None,
        })
    }

    /// Number of files.
    pub fn file_count(&self) -> usize {
        self.files.len()
    }

    /// The file of the next frame and its stamp; `None` behind the last.
    fn upcoming(&self) -> Option<(PathBuf, Timestamp)> {
        let count = self.files.len() as u64;
        let (round, index) = (self.sequence / count, (self.sequence % count) as usize);
        if round > 0 && !self.repeat {
            return None;
        }
        let file = self.files.get(index)?;
        let passed = Duration::from_nanos((self.round.as_nanos() as u64).saturating_mul(round));
        Some((file.path.clone(), file.stamp + passed))
    }

    /// Waits until the frame of `stamp` is due; `false` if that is later than `timeout` allows.
    fn wait_for(&mut self, stamp: Timestamp, timeout: Duration) -> bool {
        if self.pace == Pace::Fast {
            return true;
        }
        let first = self.files.first().map_or(stamp, |file| file.stamp);
        let started = *self.started.get_or_insert_with(now);
        let due = started + stamp.saturating_since(first);
        let wait = due.saturating_since(now());
        std::thread::sleep(wait.min(timeout));
        if wait > timeout {
            return false;
        }
        // A reader that was late does not get the frames it missed in a burst.
        self.started = Some(started + now().saturating_since(due));
        true
    }

    fn read(&mut self, path: &std::path::Path) -> Result<Frame, String> {
        let frame = self.reader.read(path).map_err(|reason| format!("{}: {reason}", path.display()))?;
        let (size, expected) =
            ([frame.width_px, frame.height_px], [self.stream.width_px, self.stream.height_px]);
        if size != expected || frame.format != self.stream.format {
            return Err(format!(
                "{}: {} of {} x {} pixels, the stream is {} of {} x {}",
                path.display(),
                frame.format,
                size[0],
                size[1],
                self.stream.format,
                expected[0],
                expected[1]
            ));
        }
        Ok(frame)
    }
}

impl Camera for ImagesCamera {
    fn name(&self) -> &str {
        &self.name
    }

    fn stream(&self) -> &StreamInfo {
        &self.stream
    }

    fn is_live(&self) -> bool {
        false
    }

    fn next_frame(&mut self, timeout: Duration) -> Result<Frame, CaptureError> {
        let source_name = self.name.clone();
        let Some((path, stamp)) = self.upcoming() else {
            return Err(CaptureError::EndOfStream { source_name });
        };
        if !self.wait_for(stamp, timeout) {
            return Err(CaptureError::Timeout { source_name, timeout });
        }
        let sequence = self.sequence;
        self.sequence += 1;
        match self.read(&path) {
            Ok(frame) => Ok(Frame { captured: stamp, arrived: now(), sequence, ..frame }),
            Err(reason) => Err(CaptureError::Damaged { source_name, sequence, reason }),
        }
    }

    fn controls(&self) -> Vec<ControlInfo> {
        Vec::new()
    }

    fn control(&mut self, control: Control) -> Result<ControlValue, CaptureError> {
        Err(CaptureError::NoSuchControl { source_name: self.name.clone(), control })
    }

    fn set_control(&mut self, control: Control, _: ControlValue) -> Result<ControlReport, CaptureError> {
        Err(CaptureError::NoSuchControl { source_name: self.name.clone(), control })
    }
}

fn depth_unit_m(options: &ImagesOptions) -> Option<f64> {
    let is_tum_depth = options.layout == Layout::Tum && options.stream == TumStream::Depth;
    options.depth_unit_m.or(is_tum_depth.then_some(tum::DEPTH_UNIT_M))
}

fn color(format: PixelFormat) -> ColorEncoding {
    match format {
        PixelFormat::Mjpg => ColorEncoding { matrix: YuvMatrix::Bt601, range: YuvRange::Full },
        _ => ColorEncoding::default(),
    }
}

fn at_rate(paths: Vec<PathBuf>, fps: f64) -> Vec<TumFile> {
    let stamp = |n: usize| Timestamp::from_ns((n as f64 * 1e9 / fps).round() as u64);
    paths.into_iter().enumerate().map(|(n, path)| TumFile { stamp: stamp(n), path }).collect()
}

fn tum_files(options: &ImagesOptions) -> Result<Vec<TumFile>, String> {
    let read = |list: &str| {
        let files =
            tum::read_files(&PathBuf::from(&options.path).join(list)).map_err(|error| error.to_string())?;
        match files.is_empty() {
            true => Err(format!("{list} lists no files")),
            false => Ok(files),
        }
    };
    let (own, other) = match options.stream {
        TumStream::Rgb => ("rgb.txt", "depth.txt"),
        TumStream::Depth => ("depth.txt", "rgb.txt"),
    };
    let mut files = read(own)?;
    if let Some(within) = options.associate {
        let stamps = |files: &[TumFile]| files.iter().map(|file| file.stamp).collect::<Vec<_>>();
        let (own_stamps, other_stamps) = (stamps(&files), stamps(&read(other)?));
        // Always colour first: both cameras of a folder must find the same pairs.
        let kept: Vec<usize> = match options.stream {
            TumStream::Rgb => {
                tum::associate(&own_stamps, &other_stamps, within).iter().map(|pair| pair.0).collect()
            }
            TumStream::Depth => {
                tum::associate(&other_stamps, &own_stamps, within).iter().map(|pair| pair.1).collect()
            }
        };
        files = kept.iter().filter_map(|index| files.get(*index).cloned()).collect();
        if files.is_empty() {
            return Err(format!("no image of {own} is within {} s of one of {other}", within.as_secs_f64()));
        }
    }
    Ok(files)
}

/// The common size and format of all readable files.
fn probe_all(files: &[TumFile], target: Target, layer: Option<&str>) -> Result<Probe, String> {
    let mut first: Option<(&TumFile, Probe)> = None;
    let mut unreadable = None;
    for file in files {
        let probed = match probe(&file.path, layer) {
            Ok(probed) => probed,
            Err(reason) => {
                unreadable.get_or_insert_with(|| format!("{}: {reason}", file.path.display()));
                continue;
            }
        };
        let Some((first_file, expected)) = first else {
            first = Some((file, probed));
            continue;
        };
        let describe = |file: &TumFile, probe: Probe| {
            format!(
                "{} is {} of {} x {} pixels",
                file.path.display(),
                probe.format,
                probe.width_px,
                probe.height_px
            )
        };
        let (a, b) = (describe(file, probed), describe(first_file, expected));
        if [probed.width_px, probed.height_px] != [expected.width_px, expected.height_px] {
            return Err(format!(
                "{a}, but {b}: a stream has one size, choose files with a pattern such as `*.png`"
            ));
        }
        if target.format(probed.format) != target.format(expected.format) {
            return Err(format!(
                "{a}, but {b}: choose files with a pattern such as `*.color.*`, or add ?as=rgb"
            ));
        }
    }
    match (first, unreadable) {
        (Some((_, probed)), _) => Ok(probed),
        (None, Some(reason)) => Err(format!("no file can be read; the first: {reason}")),
        (None, None) => Err("no images there".into()),
    }
}

/// From the first frame of a round to that of the next: the last frame lasts as long as the others do on average.
fn round(files: &[TumFile], single: Duration) -> Duration {
    match files {
        [first, .., last] => {
            let span = last.stamp.saturating_since(first.stamp);
            span + span / (files.len() as u32 - 1)
        }
        _ => single,
    }
}
