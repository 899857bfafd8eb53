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
mod settings;

use coshade_capture::Timestamp;
use coshade_lens::calibration::Calibration;
use coshade_lens::model::CameraModel;
use nalgebra::Vector2;

use crate::body::{Body, BodyError};
use crate::detection::{Detection, TagId, TagObservation};
use crate::detector::{Detector, DetectorError, FindTags, Region};
use crate::history::PoseHistory;
use crate::luma::Luma;
use crate::planar::{PlanarPose, planar_poses};
use crate::pose::PoseError;
use crate::refine::{RefineError, Refined, Refiner};
use body::BodyTracker;
pub use body::TrackedBody;
use follow::{Expectation, Trail, is_same_place, side_px};
pub use settings::TrackerSettings;

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
    last_search: Option<Timestamp>,
}

/// Standard error of corners that only the detector's outline tells, in px.
const OUTLINE_ERROR_PX: f64 = 0.5;
/// A tag that is followed must explain this much of the pixels' variance: nobody has read its bits.
const MIN_FOLLOWED: f64 = 0.7;
/// A tag that is followed is looked at with so many pixels at least.
const MIN_FOLLOW_PIXELS: usize = 250;
/// Parts of the image that are searched for lost tags, at most so many in an image: bounds the time.
const MAX_REGIONS: usize = 2;
/// Around the place where a tag should be, in sides of it, and in px at least.
const REGION_SIDES: f64 = 0.75;
const REGION_PX: f64 = 24.0;

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
            last_search: None,
        })
    }

    /// What is seen in `image`, the middle row of which was exposed at `captured`.
    pub fn track(&mut self, image: &Luma, captured: Timestamp) -> Tracking {
        let mut tracking = Tracking::default();
        // A stamp that goes back is the beginning of another sequence.
        if self.last_search.is_some_and(|last| captured < last) {
            self.forget();
        }
        let lost = self.settings.regions && self.follow(image, captured, &mut tracking);
        let every = if lost { self.settings.search_every / 2 } else { self.settings.search_every };
        let due = self.last_search.is_none_or(|last| captured.saturating_since(last) >= every);
        if due || !self.settings.regions || tracking.tags.is_empty() {
            self.last_search = Some(captured);
            tracking.searched = true;
            self.search(image, &mut tracking);
        }
        self.remember(captured, &tracking.tags);
        self.solve(captured, &mut tracking);
        tracking
    }

    /// Forgets all earlier images.
    pub fn forget(&mut self) {
        self.trails.clear();
        self.last_search = None;
        self.bodies.iter_mut().for_each(BodyTracker::forget);
    }

    /// The last poses of the body of that name: where it was when another sensor looked.
    pub fn history(&self, body: &str) -> Option<&PoseHistory> {
        self.bodies.iter().find(|own| own.name() == body).map(BodyTracker::history)
    }

    /// Looks for tags where they should be. Returns whether one that was in view is missing.
    fn follow(&mut self, image: &Luma, captured: Timestamp, tracking: &mut Tracking) -> bool {
        self.trails.retain(|trail| trail.is_remembered(captured));
        let mut expected: Vec<Expectation> =
            self.bodies.iter().flat_map(|body| body.expected_tags(&self.lens, image, captured)).collect();
        for trail in &self.trails {
            let alone = trail.expect(captured);
            if !expected.iter().any(|other| other.may_be(&alone)) {
                expected.push(alone);
            }
        }
        let pixels = self.settings.follow_pixels / expected.len().max(1);
        self.look(image, &expected, pixels, tracking);
        let mut regions = MAX_REGIONS;
        for index in 0..self.bodies.len() {
            self.follow_body(index, image, &expected, pixels, &mut regions, tracking);
        }
        let ways = self.trails.iter().map(|trail| trail.expect(captured));
        let lost: Vec<Expectation> = ways.filter(|expected| !tracking.has(expected.tag)).collect();
        self.search_around(image, &lost, &mut regions, tracking);
        lost.iter().any(|lost| !tracking.has(lost.tag))
    }

    /// Where the way of a body was not foreseen, one tag that is found tells where the others are.
    fn follow_body(
        &mut self,
        index: usize,
        image: &Luma,
        expected: &[Expectation],
        pixels: usize,
        regions: &mut usize,
        tracking: &mut Tracking,
    ) {
        let Some(body) = self.bodies.get(index) else { return };
        let own = |tag: TagId| body.has(tag);
        let lost: Vec<Expectation> = expected
            .iter()
            .filter(|expected| own(expected.tag) && !tracking.has(expected.tag))
            .filter(|expected| self.trails.iter().any(|trail| trail.is(expected.tag)))
            .copied()
            .collect();
        if lost.is_empty() {
            return;
        }
        if !tracking.tags.iter().any(|tag| own(tag.observation.tag)) {
            self.search_around(image, &lost, regions, tracking);
        }
        let again = self
            .bodies
            .get(index)
            .map(|body| body.expected_again(&self.lens, image, &tracking.observations()));
        let again: Vec<Expectation> =
            again.into_iter().flatten().filter(|expected| !tracking.has(expected.tag)).collect();
        self.look(image, &again, pixels, tracking);
    }

    /// Fits tags where they are expected.
    fn look(&mut self, image: &Luma, expected: &[Expectation], pixels: usize, tracking: &mut Tracking) {
        for Expectation { tag, corners_px } in expected {
            match self.refiner.refine_near(image, *tag, corners_px, pixels.max(MIN_FOLLOW_PIXELS)) {
                Ok(pattern) if pattern.explained >= MIN_FOLLOWED => {
                    tracking.tags.push(self.tracked(pattern.observation.clone(), None, Some(pattern)));
                }
                _ => {}
            }
        }
    }

    /// Searches the parts of the image around lost tags, the largest first.
    fn search_around(
        &mut self,
        image: &Luma,
        lost: &[Expectation],
        regions: &mut usize,
        tracking: &mut Tracking,
    ) {
        let mut lost = lost.to_vec();
        lost.sort_by(|a, b| side_px(&b.corners_px).total_cmp(&side_px(&a.corners_px)));
        for Expectation { tag, corners_px } in lost {
            if tracking.has(tag) || *regions == 0 {
                continue;
            }
            let Some(region) = region_around(image, &corners_px) else { continue };
            *regions -= 1;
            for found in self.detector.find_in(image, region).unwrap_or_default() {
                self.take(image, &found, tracking);
            }
        }
    }

    /// Looks for tags in the whole image.
    fn search(&mut self, image: &Luma, tracking: &mut Tracking) {
        match self.detector.find(image) {
            Ok(found) => found.iter().for_each(|found| self.take(image, found, tracking)),
            Err(error) => tracking.warnings.push(error.to_string()),
        }
    }

    /// Takes in what the detector found, unless it is there already.
    fn take(&mut self, image: &Luma, found: &Detection, tracking: &mut Tracking) {
        let Detection { tag, corners_px, hamming, margin } = found;
        let is_this = |other: &TrackedTag| {
            other.observation.tag == *tag && is_same_place(&other.observation.corners_px, corners_px)
        };
        if tracking.tags.iter().any(is_this) {
            return;
        }
        let how = Some(Found { hamming: *hamming, margin: *margin });
        match self.refiner.refine(image, *tag, corners_px) {
            Ok(pattern) => tracking.tags.push(self.tracked(pattern.observation.clone(), how, Some(pattern))),
            // Read without an error it is a tag, of which something covers much, or which is bent.
            Err(RefineError::Unlike { .. } | RefineError::Lost) if *hamming == 0 => {
                let observation = TagObservation::from_detection(found, OUTLINE_ERROR_PX);
                tracking.tags.push(self.tracked(observation, how, None));
            }
            Err(error) => tracking.warnings.push(format!("{tag} was found and is not used: {error}")),
        }
    }

    fn tracked(
        &self,
        observation: TagObservation,
        found: Option<Found>,
        pattern: Option<Refined>,
    ) -> TrackedTag {
        let size_m = self.bodies.iter().find_map(|body| body.size_m(observation.tag));
        let poses = size_m.and_then(|size_m| planar_poses(&self.lens, &observation, size_m).ok());
        TrackedTag { observation, found, pattern, poses }
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

/// A part of the image in which a lost tag should be.
fn region_around(image: &Luma, corners_px: &[Vector2<f64>; 4]) -> Option<Region> {
    let margin = (REGION_SIDES * side_px(corners_px)).max(REGION_PX);
    let low =
        corners_px.iter().fold(corners_px[0], |low, corner| low.inf(corner)).map(|x| (x - margin).max(0.0));
    let high = corners_px.iter().fold(corners_px[0], |high, corner| high.sup(corner)).map(|x| x + margin);
    let last = Vector2::new(f64::from(image.width_px()), f64::from(image.height_px()));
    let size = high.inf(&last) - low;
    (size.x >= 1.0 && size.y >= 1.0).then(|| Region {
        x_px: low.x as u32,
        y_px: low.y as u32,
        width_px: size.x.ceil() as u32,
        height_px: size.y.ceil() as u32,
    })
}
