//! Frames of recordings as tiles.

use std::path::{Path, PathBuf};

use anyhow::{Context as _, bail};
use coshade_capture::recording::{Reader, RecordingError};
use coshade_capture::{Converter, DepthFrame, Frame, PixelFormat, Timestamp};
use coshade_image_file::Image;
use image::RgbImage;

use super::{Tile, tone};
use crate::command::info::kind::{self, Kind};

/// True for `file.mcap`, `file.bag`, with or without `#stream`.
pub fn is_recording(text: &str) -> bool {
    kind::by_ending(&split(text).0) == Some(Kind::Recording)
}

fn split(text: &str) -> (PathBuf, Option<&str>) {
    match text.rsplit_once('#') {
        Some((path, stream)) if !Path::new(text).exists() => (PathBuf::from(path), Some(stream)),
        _ => (PathBuf::from(text), None),
    }
}

/// One row a stream, each of `count` frames spread evenly over the recording.
///
/// # Errors
/// A file that is no recording, or a stream that it does not have.
pub fn rows(text: &str, count: u32) -> anyhow::Result<Vec<Vec<Tile>>> {
    let (path, only) = split(text);
    let mut reader = Reader::open(&path)?;
    let streams = match only {
        Some(name) => vec![reader.stream(Some(name))?],
        None => (0..reader.streams().len()).collect(),
    };
    if streams.is_empty() {
        bail!("{}: no images in it", path.display());
    }
    let Some((first, last)) = reader.span()? else { bail!("{}: no frames in it", path.display()) };
    let mut converter = Converter::new();
    let mut rows = Vec::new();
    for stream in streams {
        let name = reader.streams().get(stream).map(|stream| stream.name.clone()).unwrap_or_default();
        reader.select(&[stream]);
        let mut row = Vec::new();
        let mut last_shown = None;
        for part in 0..count {
            let step_ns = last.saturating_since(first).as_nanos() as f64 / f64::from(count);
            let from_ns = first.as_ns() as f64 + step_ns * f64::from(part);
            reader.seek(Timestamp::from_ns(from_ns as u64));
            let Some(frame) = next(&mut reader)? else { break };
            // Of few frames, the next one may be the same.
            if last_shown.replace(frame.captured) == Some(frame.captured) {
                continue;
            }
            let time_s = frame.captured.saturating_since(first).as_secs_f64();
            let toned = shown(&frame, &mut converter)
                .with_context(|| format!("{}, stream {name}", path.display()))?;
            let note = toned.note.map(|note| format!(", {note}")).unwrap_or_default();
            row.push(Tile { image: toned.image, label: format!("{name}, {time_s:.2} s{note}") });
        }
        rows.push(row);
    }
    Ok(rows)
}

/// The next sound frame; damage goes to the log.
fn next(reader: &mut Reader) -> anyhow::Result<Option<Frame>> {
    loop {
        match reader.next_frame() {
            Ok(found) => return Ok(found.map(|found| found.frame)),
            Err(error @ (RecordingError::Damaged { .. } | RecordingError::Unsupported { .. })) => {
                tracing::warn!("{error}")
            }
            Err(error) => return Err(error.into()),
        }
    }
}

fn shown(frame: &Frame, converter: &mut Converter) -> anyhow::Result<tone::Toned> {
    let (width, height) = (frame.width_px, frame.height_px);
    if frame.format == PixelFormat::Z16 {
        let depth = DepthFrame::try_from(frame.clone())?;
        let metres = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
        let plane = metres.map(|(x, y)| depth.depth_m(x, y).unwrap_or(0.0) as f32).collect();
        let image = Image::from_plane(width as usize, height as usize, "Z", plane)?;
        return Ok(tone::tone(&image, 0.0));
    }
    let mut rgb = vec![0; 3 * frame.pixel_count()];
    converter.rgb24(frame, &mut rgb)?;
    let image = RgbImage::from_raw(width, height, rgb).context("a frame shorter than its size")?;
    Ok(tone::Toned { image, note: None })
}
