//! Recordings: MCAP and ROS 1 bags.

use std::fmt::Write as _;
use std::path::Path;

use coshade_capture::recording::{self, Description, StreamDescription};

use super::{Found, Problem, Severity};

pub fn look(path: &Path) -> anyhow::Result<Found> {
    let description = recording::describe(path)?;
    Ok(Found {
        content: serde_json::to_value(&description)?,
        text: text(&description),
        problems: problems(&description),
    })
}

fn text(description: &Description) -> String {
    let mut out = String::new();
    let Description { container, library, size_bytes, duration_s, .. } = description;
    let by = if library.is_empty() { String::new() } else { format!(", written by {library}") };
    let mib = *size_bytes as f64 / f64::from(1 << 20);
    let _ = writeln!(out, "  {container}{by}, {mib:.2} MiB, {duration_s:.3} s");
    for stream in &description.streams {
        let _ = writeln!(out, "  {}", stream_line(stream));
    }
    let others = description
        .topics
        .iter()
        .filter(|topic| description.streams.iter().all(|stream| stream.topic != topic.topic));
    for topic in others {
        let _ = writeln!(out, "  {}: {} messages, {}", topic.topic, topic.messages, topic.schema);
    }
    if !description.attachments.is_empty() {
        let _ = writeln!(out, "  attached: {}", description.attachments.join(", "));
    }
    for (key, value) in description.session.iter().filter(|(_, value)| !value.contains('\n')) {
        let _ = writeln!(out, "  {key}: {value}");
    }
    out
}

fn stream_line(stream: &StreamDescription) -> String {
    let StreamDescription { name, frames, width_px, height_px, format, .. } = stream;
    let mut line = format!("stream {name}: {frames} frames {width_px}x{height_px} px {format}");
    if let Some(rate) = stream.frames_per_second {
        let _ = write!(line, ", {rate:.2} frames/s, longest gap {:.1} ms", stream.longest_interval_s * 1e3);
    }
    if let Some(unit_m) = stream.depth_unit_m {
        // Cameras state it in 32 bit: seven digits are all it has.
        let _ = write!(line, ", depth unit {} m", (unit_m * 1e9).round() / 1e9);
    }
    if stream.exposure {
        line += ", exposure times";
    }
    match (&stream.calibration, &stream.intrinsics) {
        (true, _) => line += ", calibration",
        (false, Some(intrinsics)) => {
            let _ = write!(line, ", intrinsics ({})", intrinsics.distortion_model);
        }
        (false, None) => {}
    }
    line
}

fn problems(description: &Description) -> Vec<Problem> {
    let mut problems = Vec::new();
    for damage in &description.damage {
        let lost = match damage.lost_bytes {
            0 => String::new(),
            bytes => format!(" ({bytes} bytes lost)"),
        };
        let message = format!("at byte {}: {}{lost}", damage.offset, damage.what);
        problems.push(Problem::new(Severity::Error, message));
    }
    let unlisted = description.damage_count.saturating_sub(description.damage.len() as u64);
    if unlisted > 0 {
        problems.push(Problem::new(Severity::Error, format!("and {unlisted} more damaged places")));
    }
    if !description.indexed {
        let message =
            "no index: the recording was cut short, or never finished; it plays up to its last whole chunk";
        problems.push(Problem::new(Severity::Warning, message));
    }
    for stream in &description.streams {
        let name = &stream.name;
        if stream.missing > 0 {
            let message = format!("stream {name}: {} frames missing by their numbers", stream.missing);
            problems.push(Problem::new(Severity::Warning, message));
        }
        if let Some(dropped) = stream.dropped.filter(|&dropped| dropped > 0) {
            let message = format!("stream {name}: the recorder dropped {dropped} frames");
            problems.push(Problem::new(Severity::Warning, message));
        }
        if let Some(problem) = &stream.problem {
            problems.push(Problem::new(Severity::Warning, format!("stream {name}: {problem}")));
        }
    }
    if description.streams.is_empty() {
        problems.push(Problem::new(Severity::Warning, "no image streams"));
    }
    problems
}
