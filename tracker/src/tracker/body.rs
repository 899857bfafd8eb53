//! One body from image to image.

use coshade_capture::Timestamp;
use coshade_lens::calibration::Calibration;
use coshade_lens::model::CameraModel;
use nalgebra::Isometry3;

use super::follow::{Expectation, expected_tags};
use super::{TrackerError, TrackerSettings};
use crate::body::Body;
use crate::detection::{TagId, TagObservation};
use crate::filter::{FilterSettings, PoseFilter};
use crate::history::{HistorySettings, PoseHistory, StampedPose};
use crate::luma::Luma;
use crate::pose::{Before, BodyPose, Expected, Past, PoseError, PoseEstimate, PoseSolver};

/// A body in view.
#[derive(Clone, Debug)]
pub struct TrackedBody {
    /// Its name.
    pub name: String,
    /// Its pose as this image tells it.
    pub measured: BodyPose,
    /// Body to camera frame without jitter, if the tracker filters; else as measured.
    pub camera_from_body: Isometry3<f64>,
}

/// A body, and where it was.
pub(super) struct BodyTracker {
    body: Body,
    solver: PoseSolver,
    filter: PoseFilter,
    history: PoseHistory,
}

impl BodyTracker {
    pub(super) fn new(
        calibration: &Calibration,
        body: &Body,
        settings: &TrackerSettings,
    ) -> Result<Self, TrackerError> {
        let solver = PoseSolver::new(&calibration.model, body)?
            .with_rolling_shutter(calibration.readout_s, calibration.size_px[1])?;
        let filter =
            PoseFilter::new(FilterSettings { enabled: settings.filter, ..FilterSettings::default() });
        Ok(Self { body: body.clone(), solver, filter, history: PoseHistory::new(HistorySettings::default()) })
    }

    pub(super) fn forget(&mut self) {
        self.filter.reset();
        self.history.clear();
    }

    pub(super) fn history(&self) -> &PoseHistory {
        &self.history
    }

    pub(super) fn name(&self) -> &str {
        &self.body.name
    }

    pub(super) fn size_m(&self, tag: TagId) -> Option<f64> {
        self.body.tag(tag).map(|tag| tag.size_m)
    }

    pub(super) fn has(&self, tag: TagId) -> bool {
        self.body.tag(tag).is_some()
    }

    /// Its tags where its way leads.
    pub(super) fn expected_tags(&self, lens: &CameraModel, image: &Luma, now: Timestamp) -> Vec<Expectation> {
        let last = || self.history.latest().copied().filter(|last| is_recent(last.stamp, now));
        let predicted = self.history.predict(now).or_else(last);
        predicted.map_or_else(Vec::new, |pose| expected_tags(lens, image, &self.body, &pose.camera_from_body))
    }

    /// Its tags where those that were found so far put them.
    pub(super) fn expected_again(
        &self,
        lens: &CameraModel,
        image: &Luma,
        observations: &[TagObservation],
    ) -> Vec<Expectation> {
        let pose = self.solver.solve(observations, &Past::default()).ok();
        pose.map_or_else(Vec::new, |pose| {
            expected_tags(lens, image, &self.body, &pose.estimate.camera_from_body)
        })
    }

    /// Its pose, `None` if none of its tags is in view.
    pub(super) fn solve(
        &mut self,
        captured: Timestamp,
        observations: &[TagObservation],
    ) -> Result<Option<TrackedBody>, PoseError> {
        let own: Vec<TagObservation> = observations
            .iter()
            .filter(|observation| self.body.tag(observation.tag).is_some())
            .cloned()
            .collect();
        if own.is_empty() {
            return Ok(None);
        }
        let measured = self.solver.solve(&own, &self.past(captured))?;
        let estimate = &measured.estimate;
        let mut camera_from_body = estimate.camera_from_body;
        if measured.certainty.is_ambiguous() {
            // What may be wrong is no past to go by.
            self.filter.reset();
        } else {
            let filtered = self.filter.filter(captured, &estimate.camera_from_body, &estimate.covariance);
            camera_from_body = filtered.unwrap_or(camera_from_body);
            let PoseEstimate { camera_from_body, covariance, .. } = *estimate;
            let kept = self.history.push(StampedPose { stamp: captured, camera_from_body, covariance });
            if kept.is_err() {
                // Another sequence has begun.
                self.history.clear();
            }
        }
        Ok(Some(TrackedBody { name: self.body.name.clone(), measured, camera_from_body }))
    }

    fn past(&self, now: Timestamp) -> Past {
        let expected = self
            .history
            .predict(now)
            .map(|pose| Expected { camera_from_body: pose.camera_from_body, covariance: pose.covariance });
        let before = self.history.latest().and_then(|pose| {
            let elapsed_s = now.signed_ns_since(pose.stamp) as f64 * 1e-9;
            let near = elapsed_s > 0.0 && elapsed_s < MAX_STEADY_S;
            near.then_some(Before { camera_from_body: pose.camera_from_body, elapsed_s })
        });
        Past { expected, before }
    }
}

/// A pose that is older says nothing of where to look.
const RECENT_NS: i64 = 500_000_000;

fn is_recent(stamp: Timestamp, now: Timestamp) -> bool {
    (0..=RECENT_NS).contains(&now.signed_ns_since(stamp))
}

/// Over longer times no motion is steady enough to tell how rows moved.
const MAX_STEADY_S: f64 = 0.15;
