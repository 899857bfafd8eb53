//! Tags and bodies from image to image.
//!
//! Tags are found by a [detector](crate::detector), their corners [refined](crate::refine), and the poses of bodies
//! [solved](crate::pose) from them. Between searches of the whole image, tags are looked for only where they should be:
//! where the pose that is predicted for their body puts them, or where their own way leads. There the fit of the pattern
//! alone finds them again, in a fraction of the time of a search; where it does not, the detector searches around.
//!
//! Every pose is measured in the image that it is given for. Earlier poses say where to look, decide between two poses
//! that fit alike, and how rows moved under a rolling shutter; the filter only removes jitter.

mod body;
mod follow;
mod schedule;
mod settings;
mod sight;

use std::time::Duration;

use coshade_capture::Timestamp;
use coshade_lens::calibration::Calibration;
use coshade_lens::model::CameraModel;

use crate::body::{Body, BodyError};
use crate::detection::{TagId, TagObservation};
use crate::detector::{Detector, DetectorError, FindTags};
use crate::history::PoseHistory;
use crate::luma::Luma;
use crate::planar::PlanarPose;
use crate::pose::PoseError;
use crate::refine::{Refined, Refiner};
use body::BodyTracker;
pub use body::TrackedBody;
use follow::{Expectation, Trail};
use schedule::Schedule;
pub use settings::TrackerSettings;
use sight::Sight;

/// Why there is no tracker.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum TrackerError {
    /// A setting of the detector is out of its range.
    #[error(transparent)]
    Detector(#[from] DetectorError),
    /// A body is impossible.
    #[error(transparent)]
    Body(#[from] BodyError),
    /// The shutter is impossible.
    #[error(transparent)]
    Pose(#[from] PoseError),
}

/// What is seen in one image.
#[derive(Clone, Debug, Default)]
pub struct Tracking {
    /// All tags in view.
    pub tags: Vec<TrackedTag>,
    /// The bodies in the order in which the tracker was given them, those in view.
    pub bodies: Vec<TrackedBody>,
    /// Whether tags were looked for in the whole image.
    pub searched: bool,
    /// What kept tags or bodies from being used, in words.
    pub warnings: Vec<String>,
}

/// A tag in view.
#[derive(Clone, Debug)]
pub struct TrackedTag {
    /// Its corners and their covariance.
    pub observation: TagObservation,
    /// How the detector found it; `None` if it was followed from an earlier image.
    pub found: Option<Found>,
    /// What its pattern looks like; `None` if only its outline could be used, because too much of it is covered or bent.
    pub pattern: Option<Refined>,
    /// Both poses, the better first, if its size is known.
    pub poses: Option<[PlanarPose; 2]>,
}

/// How a detector found a tag.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found {
    /// Wrong bits that were corrected.
    pub hamming: u32,
    /// Mean difference of the bits' brightness from the threshold, in codes.
    pub margin: f32,
}

/// Follows tags and bodies in the images of one camera.
pub struct Tracker {
    lens: CameraModel,
    detector: Box<dyn FindTags>,
    refiner: Refiner,
    bodies: Vec<BodyTracker>,
    settings: TrackerSettings,
    trails: Vec<Trail>,
    schedule: Schedule,
}

/// How long a tag that is out of sight is looked for where its way would lead, and how long it is missed.
const FOLLOWED: Duration = Duration::from_millis(500);
const MISSED: Duration = Duration::from_secs(5);

impl Tracking {
    /// All observed corners.
    pub fn observations(&self) -> Vec<TagObservation> {
        self.tags.iter().map(|tag| tag.observation.clone()).collect()
    }

    fn has(&self, tag: TagId) -> bool {
        self.tags.iter().any(|own| own.observation.tag == tag)
    }
}

impl Tracker {
    /// A tracker for the images of a camera.
    ///
    /// # Errors
    /// [`TrackerError`] for impossible settings or bodies.
    pub fn new(
        calibration: &Calibration,
        bodies: &[Body],
        settings: TrackerSettings,
    ) -> Result<Self, TrackerError> {
        let detector = Detector::new(&settings.detector)?;
        Self::with_detector(calibration, bodies, settings, Box::new(detector))
    }

    /// As [`new`](Self::new), with another way to find tags than the AprilTag library.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn with_detector(
        calibration: &Calibration,
        bodies: &[Body],
        settings: TrackerSettings,
        detector: Box<dyn FindTags>,
    ) -> Result<Self, TrackerError> {
        let lens = calibration.model;
        let tracker = |body: &Body| BodyTracker::new(calibration, body, &settings);
        Ok(Self {
            lens,
            detector,
            refiner: Refiner::new(Some(lens), &calibration.response, settings.refine),
            bodies: bodies.iter().map(tracker).collect::<Result<_, _>>()?,
            settings,
            trails: Vec::new(),
            schedule: Schedule::default(),
        })
    }

    /// What is seen in `image`, the middle row of which was exposed at `captured`.
    pub fn track(&mut self, image: &Luma, captured: Timestamp) -> Tracking {
        if !self.schedule.goes_on(captured) {
            self.forget();
        }
        self.trails.retain(|trail| trail.was_in(captured, MISSED));
        let mut sight =
            Sight::new(image, &self.lens, self.detector.as_mut(), &mut self.refiner, &self.bodies);
        if self.settings.regions {
            let here =
                |trail: &&Trail| trail.was_in(captured, FOLLOWED) && trail.should_be_in(image, captured);
            let trails = self.trails.iter().filter(here);
            let alone: Vec<Expectation> = trails.map(|trail| trail.expect(captured)).collect();
            sight.follow(captured, &alone, self.settings.follow_pixels);
        }
        let due = self.schedule.due(&self.settings, &self.trails, image, captured, sight.tracking());
        if let Some(decimate) = due {
            sight.search(decimate);
        }
        let mut tracking = sight.into_tracking();
        self.remember(captured, &tracking.tags);
        self.solve(captured, &mut tracking);
        tracking
    }

    /// Forgets all earlier images.
    pub fn forget(&mut self) {
        self.trails.clear();
        self.schedule.start_anew();
        self.bodies.iter_mut().for_each(BodyTracker::forget);
    }

    /// The last poses of the body of that name: where it was when another sensor looked.
    pub fn history(&self, body: &str) -> Option<&PoseHistory> {
        self.bodies.iter().find(|own| own.name() == body).map(BodyTracker::history)
    }

    /// Where tags were, for the next image.
    fn remember(&mut self, captured: Timestamp, tags: &[TrackedTag]) {
        let mut trails = std::mem::take(&mut self.trails);
        for TrackedTag { observation: TagObservation { tag, corners_px, .. }, .. } in tags {
            match trails.iter_mut().find(|trail| trail.may_be(*tag, corners_px)) {
                Some(trail) => trail.advance(captured, *corners_px),
                None => trails.push(Trail::new(*tag, captured, *corners_px)),
            }
        }
        self.trails = trails;
    }

    fn solve(&mut self, captured: Timestamp, tracking: &mut Tracking) {
        let observations = tracking.observations();
        for body in &mut self.bodies {
            match body.solve(captured, &observations) {
                Ok(Some(tracked)) => tracking.bodies.push(tracked),
                Ok(None) => {}
                Err(error) => tracking.warnings.push(error.to_string()),
            }
        }
    }
}
