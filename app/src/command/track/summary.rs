//! What all frames come to.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use coshade_tracker::Body;
use nalgebra::UnitQuaternion;
use serde::Serialize;

use super::rows::{BodyRow, FrameRow};
use crate::pipeline::metrics::Spread;
use crate::pipeline::{Event, Metrics};

/// A rotation by more from one frame to the next is no motion of a hand: at 30 frames a second, 900° a second.
const JUMP_DEG: f64 = 30.0;

/// Kinds of warnings that are told apart; there are far fewer.
const MAX_KINDS: usize = 100;

/// The figures of a run.
#[derive(Clone, Debug, Serialize)]
pub struct Summary {
    /// Session or source.
    pub input: String,
    /// What the threads did.
    pub pipeline: Metrics,
    /// Every body looked for.
    pub bodies: Vec<BodySummary>,
    /// Every tag seen.
    pub tags: Vec<TagSummary>,
    /// What the tracker had to say, alike ones together.
    pub warnings: Vec<WarningSummary>,
    /// Errors, warnings and recoveries of the threads.
    pub events: Vec<EventRow>,
    /// One for each frame; left out with --json-lines.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<Vec<FrameRow>>,
}

/// A body in all frames.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BodySummary {
    /// As in the frames.
    pub name: String,
    /// Frames in which it was found.
    pub frames: u64,
    /// Frames for each certainty.
    pub certainty: BTreeMap<&'static str, u64>,
    /// Times that its rotation changed by more than 30° from one frame to the next.
    pub jumps: u64,
    /// Frames in which a tag was left out.
    pub frames_with_rejected_tags: u64,
    /// Of the frames' distances of corners from where the pose puts them.
    pub rms_px: Option<Spread>,
}

/// A tag in all frames.
#[derive(Clone, Debug, Serialize)]
pub struct TagSummary {
    /// Family.
    pub family: &'static str,
    /// Number within the family.
    pub id: u32,
    /// Frames in which it was seen.
    pub frames: u64,
}

/// Warnings that differ in numbers only.
#[derive(Clone, Debug, Serialize)]
pub struct WarningSummary {
    /// The first of them.
    pub message: String,
    /// The frame it was about.
    pub first_frame: u64,
    /// How many there were.
    pub count: u64,
}

/// Something that happened.
#[derive(Clone, Debug, Serialize)]
pub struct EventRow {
    /// Since the process's clock began.
    pub at_s: f64,
    /// On which thread.
    pub thread: &'static str,
    /// `info`, `warning` or `error`.
    pub severity: &'static str,
    /// What happened.
    pub message: String,
}

impl From<&Event> for EventRow {
    fn from(event: &Event) -> Self {
        Self {
            at_s: event.at.as_secs_f64(),
            thread: event.thread,
            severity: event.severity.name(),
            message: event.message.clone(),
        }
    }
}

/// Adds up frames.
pub struct Tally {
    bodies: Vec<BodyTally>,
    tags: BTreeMap<(&'static str, u32), u64>,
    warnings: BTreeMap<String, WarningSummary>,
}

struct BodyTally {
    summary: BodySummary,
    rms_px: Vec<f32>,
    /// Its rotation, if it was found in the frame before.
    last: Option<UnitQuaternion<f64>>,
}

impl Tally {
    /// Of frames in which these bodies are looked for.
    pub fn new(bodies: &[Body]) -> Self {
        let of = |body: &Body| BodyTally {
            summary: BodySummary { name: body.name.clone(), ..BodySummary::default() },
            rms_px: Vec::new(),
            last: None,
        };
        Self { bodies: bodies.iter().map(of).collect(), tags: BTreeMap::new(), warnings: BTreeMap::new() }
    }

    /// Adds a frame. Warnings of a new kind go to the log.
    pub fn add(&mut self, frame: &FrameRow) {
        frame.warnings.iter().for_each(|warning| self.warn(frame.frame, warning));
        for tag in &frame.tags {
            *self.tags.entry((tag.family, tag.id)).or_default() += 1;
        }
        for body in &mut self.bodies {
            body.add(frame.bodies.iter().find(|row| row.name == body.summary.name));
        }
    }

    fn warn(&mut self, frame: u64, message: &str) {
        let kind: String = message.chars().filter(|letter| !letter.is_ascii_digit()).collect();
        if let Some(known) = self.warnings.get_mut(&kind) {
            known.count += 1;
        } else if self.warnings.len() < MAX_KINDS {
            tracing::warn!("frame {frame}: {message}");
            let first = WarningSummary { message: message.to_owned(), first_frame: frame, count: 1 };
            self.warnings.insert(kind, first);
        }
    }

    /// The figures, beside what the pipeline says.
    pub fn finish(
        self,
        input: String,
        pipeline: Metrics,
        events: Vec<EventRow>,
        frames: Option<Vec<FrameRow>>,
    ) -> Summary {
        let tag = |((family, id), frames)| TagSummary { family, id, frames };
        Summary {
            input,
            pipeline,
            bodies: self.bodies.into_iter().map(BodyTally::finish).collect(),
            tags: self.tags.into_iter().map(tag).collect(),
            warnings: self.warnings.into_values().collect(),
            events,
            frames,
        }
    }
}

impl BodyTally {
    fn add(&mut self, row: Option<&BodyRow>) {
        let Some(row) = row else {
            self.last = None;
            return;
        };
        let rotation = row.measured_camera_from_body.isometry().rotation;
        let jumped =
            self.last.replace(rotation).is_some_and(|last| last.angle_to(&rotation).to_degrees() > JUMP_DEG);
        self.summary.frames += 1;
        self.summary.jumps += u64::from(jumped);
        self.summary.frames_with_rejected_tags += u64::from(!row.tags_rejected.is_empty());
        *self.summary.certainty.entry(row.certainty).or_default() += 1;
        self.rms_px.push(row.rms_px as f32);
    }

    fn finish(mut self) -> BodySummary {
        self.rms_px.sort_by(f32::total_cmp);
        let at = |share: f64| {
            let rank = (self.rms_px.len() as f64 * share).ceil() as usize;
            self.rms_px.get(rank.saturating_sub(1)).map(|rms| f64::from(*rms))
        };
        let spread = || Some(Spread { median: at(0.5)?, p95: at(0.95)?, max: at(1.0)? });
        BodySummary { rms_px: spread(), ..self.summary }
    }
}

impl Summary {
    /// For people.
    pub fn text(&self) -> String {
        let Metrics { elapsed_s, tracked, tracked_per_s, overwritten, unread, .. } = self.pipeline;
        let mut out =
            format!("{}: {tracked} frames tracked in {elapsed_s:.2} s ({tracked_per_s:.1}/s)\n", self.input);
        let counts = [
            ("overwritten untracked", overwritten),
            ("overwritten unread", unread),
            ("missing", self.pipeline.missing),
            ("damaged", self.pipeline.damaged),
            ("stalls", self.pipeline.stalls),
            ("times lost", self.pipeline.lost),
            ("restarts", self.pipeline.restarts),
        ];
        let counts: Vec<_> = counts
            .iter()
            .filter(|(_, count)| *count > 0)
            .map(|(what, count)| format!("{count} {what}"))
            .collect();
        if !counts.is_empty() {
            let _ = writeln!(out, "  frames: {}", counts.join(", "));
        }
        let times = [
            ("latency", self.pipeline.latency_ms),
            ("latency from exposure", self.pipeline.capture_latency_ms),
            ("tracking", self.pipeline.track_ms),
        ];
        for (what, spread) in times {
            if let Some(Spread { median, p95, max }) = spread {
                let _ =
                    writeln!(out, "  {what}: median {median:.2} ms, 95 % {p95:.2} ms, longest {max:.2} ms");
            }
        }
        if let (Some(camera), Some(tracker)) = (self.pipeline.camera_cpu_s, self.pipeline.tracker_cpu_s) {
            let _ = writeln!(out, "  CPU: camera {camera:.2} s, tracker {tracker:.2} s");
        }
        for body in &self.bodies {
            let _ = writeln!(out, "  {}", body.text());
        }
        for WarningSummary { message, first_frame, count } in &self.warnings {
            let _ = writeln!(out, "  warning, {count} times, first of frame {first_frame}: {message}");
        }
        let tags: Vec<_> =
            self.tags.iter().map(|tag| format!("{} {} ({})", tag.family, tag.id, tag.frames)).collect();
        let tags = if tags.is_empty() { "none".to_owned() } else { tags.join(", ") };
        let _ = writeln!(out, "  tags seen (in so many frames): {tags}");
        out
    }
}

impl BodySummary {
    fn text(&self) -> String {
        let mut out = format!("{}: in {} frames", self.name, self.frames);
        for (certainty, frames) in &self.certainty {
            let _ = write!(out, ", {frames} {certainty}");
        }
        let _ = write!(out, ", {} jumps", self.jumps);
        if self.frames_with_rejected_tags > 0 {
            let _ = write!(out, ", tags rejected in {}", self.frames_with_rejected_tags);
        }
        if let Some(Spread { median, p95, max }) = self.rms_px {
            let _ = write!(out, ", rms median {median:.3} px, 95 % {p95:.3} px, largest {max:.3} px");
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Isometry3, Vector3};

    use super::*;

    fn frame(number: u64, angle_deg: Option<f64>, warning: &str) -> FrameRow {
        let body = |angle_deg: f64| {
            let pose = Isometry3::rotation(Vector3::x() * angle_deg.to_radians()).into();
            BodyRow {
                name: "board.toml".to_owned(),
                camera_from_body: pose,
                measured_camera_from_body: pose,
                position_std_mm: [0.0; 3],
                rotation_std_deg: [0.0; 3],
                rms_px: number as f64,
                reduced_chi2: 1.0,
                certainty: if number == 0 { "ambiguous" } else { "clear" },
                other_camera_from_body: None,
                tags_used: Vec::new(),
                tags_rejected: Vec::new(),
            }
        };
        FrameRow {
            frame: number,
            captured_ns: 0,
            latency_ms: 0.0,
            searched: true,
            world_from_camera: None,
            bodies: angle_deg.map(body).into_iter().collect(),
            tags: Vec::new(),
            warnings: vec![warning.to_owned()],
        }
    }

    #[test]
    fn jumps_are_counted_between_neighbouring_frames_only() {
        let board = Body { name: "board.toml".to_owned(), tags: Vec::new() };
        let mut tally = Tally::new(&[board]);
        // 20 degrees are a motion, 40 are none; behind a gap nothing is known.
        let angles = [Some(0.0), Some(20.0), Some(60.0), None, Some(0.0), Some(-29.0)];
        for (number, angle_deg) in (0..).zip(angles) {
            let warning = if number < 4 { format!("rms {number}.5 px") } else { "no tag".to_owned() };
            tally.add(&frame(number, angle_deg, &warning));
        }
        let bodies = &tally.bodies[0].summary;
        assert_eq!((bodies.frames, bodies.jumps), (5, 1));
        let warnings: Vec<_> =
            tally.warnings.values().map(|one| (one.message.as_str(), one.first_frame, one.count)).collect();
        assert_eq!(warnings, [("no tag", 4, 2), ("rms 0.5 px", 0, 4)]);
        let body = tally.bodies.remove(0).finish();
        assert_eq!(body.certainty, BTreeMap::from([("ambiguous", 1), ("clear", 4)]));
        // Of 0, 1, 2, 4, 5.
        assert_eq!(body.rms_px, Some(Spread { median: 2.0, p95: 5.0, max: 5.0 }));
    }
}
