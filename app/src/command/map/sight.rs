//! Which tags are in which image.

use std::sync::atomic::AtomicBool;

use anyhow::bail;
use coshade_capture::LatestError;
use coshade_tracker::detector::DetectorSettings;
use coshade_tracker::map::View;
use coshade_tracker::{Family, Tracker, TrackerSettings};
use indicatif::ProgressBar;

use super::input::Input;
use super::{Args, stopped};
use crate::pipeline::{Handover, Options, Pipeline, Retry, Severity};

/// How often it is looked whether to end.
const POLL: std::time::Duration = std::time::Duration::from_millis(50);

/// What all images show.
pub struct Sights {
    /// One for each image.
    pub images: Vec<View>,
    /// Images that could not be read.
    pub damaged: u64,
}

/// Looks for tags in all images.
///
/// # Errors
/// No image could be read; it was told to stop.
pub fn look(
    input: Input,
    args: &Args,
    families: &[Family],
    stop: &AtomicBool,
    progress: &ProgressBar,
) -> anyhow::Result<Sights> {
    let settings = TrackerSettings {
        detector: DetectorSettings {
            families: families.to_vec(),
            decimate: args.decimate,
            threads: args.threads,
            ..DetectorSettings::default()
        },
        regions: false,
        filter: false,
        ..TrackerSettings::default()
    };
    let Input { name, source, calibration } = input;
    if source.camera.is_live() {
        bail!("{name}: is a live camera: record what it sees first (coshade record), then map the recording");
    }
    let build = move || Ok(Tracker::new(&calibration, &[], settings.clone())?);
    let options =
        Options { handover: Handover::Every, retry: Retry::Never, only_frame: None, max_frames: None };
    let mut pipeline = Pipeline::start(source, build, options)?;
    let mut images = Vec::new();
    while !stopped(stop) {
        for event in pipeline.events().filter(|event| event.severity != Severity::Info) {
            tracing::warn!("{event}");
        }
        let tracked = match pipeline.receive(POLL) {
            Ok(tracked) => tracked,
            Err(LatestError::Timeout) => continue,
            Err(LatestError::Closed) => break,
        };
        let observations = tracked.tracking.tags.into_iter().map(|tag| tag.observation).collect();
        for warning in &tracked.tracking.warnings {
            tracing::info!("image {}: {warning}", tracked.frame.sequence);
        }
        images.push(View { number: tracked.frame.sequence, observations });
        progress.inc(1);
    }
    let finished = pipeline.finish();
    if let Some(failure) = finished.failures.into_iter().next() {
        return Err(failure);
    }
    if stopped(stop) {
        bail!("{name}: stopped after {} images; nothing is written", images.len());
    }
    if images.is_empty() {
        bail!("{name}: no image could be read");
    }
    Ok(Sights { images, damaged: finished.metrics.damaged })
}
