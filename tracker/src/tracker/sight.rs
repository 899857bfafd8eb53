//! What is looked at in one image: where tags should be, around where they were lost, or everywhere.

use coshade_capture::Timestamp;
use coshade_lens::model::CameraModel;
use nalgebra::Vector2;

use super::body::BodyTracker;
use super::follow::{Expectation, Strays, is_same_place, side_px};
use super::{Found, TrackedTag, Tracking};
use crate::detection::{Detection, TagId, TagObservation};
use crate::detector::{FindTags, Region};
use crate::luma::Luma;
use crate::planar::planar_poses;
use crate::refine::{RefineError, Refined, Refiner};

/// Standard error of corners that only the detector's outline tells, in px.
const OUTLINE_ERROR_PX: f64 = 0.5;
/// A tag that is followed must explain this much of the pixels' variance: nobody has read its bits.
const MIN_FOLLOWED: f64 = 0.7;
/// What explains as much is in its place.
const SURELY_EXPLAINED: f64 = 0.93;
/// A tag that is followed is looked at with so many pixels at least.
const MIN_FOLLOW_PIXELS: usize = 250;
/// The same of a tag that its body tells of after a search.
const COMPLETING_PIXELS: usize = 1500;
/// Parts of the image that are searched for lost tags, at most so many in an image: bounds the time.
const MAX_REGIONS: usize = 8;
/// Tags of this side are found in any image, larger ones in one that is so many times smaller.
const EASY_SIDE_PX: f64 = 40.0;
/// Around the place where a tag should be, in sides of it, and in px at least.
const REGION_SIDES: f64 = 0.75;
const REGION_PX: f64 = 24.0;

/// One image, and what was seen in it so far.
pub(super) struct Sight<'a> {
    image: &'a Luma<'a>,
    lens: &'a CameraModel,
    detector: &'a mut dyn FindTags,
    refiner: &'a mut Refiner,
    bodies: &'a [BodyTracker],
    tracking: Tracking,
    /// Where tags are expected, and how many pixels are looked at there.
    expected: Vec<Expectation>,
    pixels: usize,
    /// Parts that may still be searched.
    regions: usize,
}

impl<'a> Sight<'a> {
    pub(super) fn new(
        image: &'a Luma<'a>,
        lens: &'a CameraModel,
        detector: &'a mut dyn FindTags,
        refiner: &'a mut Refiner,
        bodies: &'a [BodyTracker],
    ) -> Self {
        let tracking = Tracking::default();
        Self {
            image,
            lens,
            detector,
            refiner,
            bodies,
            tracking,
            expected: Vec::new(),
            pixels: COMPLETING_PIXELS,
            regions: MAX_REGIONS,
        }
    }

    /// What was seen so far.
    pub(super) fn tracking(&self) -> &Tracking {
        &self.tracking
    }

    pub(super) fn into_tracking(self) -> Tracking {
        self.tracking
    }

    /// Looks for tags where they should be: those of bodies where their ways lead, and those that were seen (`alone`).
    pub(super) fn follow(&mut self, now: Timestamp, alone: &[Expectation], pixels: usize) {
        let bodies = self.bodies;
        self.expected =
            bodies.iter().flat_map(|body| body.expected_tags(self.lens, self.image, now)).collect();
        for alone in alone {
            if !self.expected.iter().any(|other| other.may_be(alone)) {
                self.expected.push(*alone);
            }
        }
        self.pixels = (pixels / self.expected.len().max(1)).max(MIN_FOLLOW_PIXELS);
        let expected = std::mem::take(&mut self.expected);
        self.look(&expected);
        self.expected = expected;
        for body in bodies {
            let own: Vec<Expectation> = alone.iter().filter(|seen| body.has(seen.tag)).copied().collect();
            self.follow_body(body, &own);
        }
        let missing = self.look_again(alone);
        self.search_around(&missing, usize::MAX);
    }

    /// Where the way of a body was not foreseen, one tag that is found tells where the others are. `seen` are its tags that
    /// were seen before.
    fn follow_body(&mut self, body: &BodyTracker, seen: &[Expectation]) {
        if seen.iter().all(|seen| self.tracking.has(seen.tag)) {
            return;
        }
        if !self.tracking.tags.iter().any(|found| body.has(found.observation.tag)) {
            let missing = self.look_again(seen);
            self.search_around(&missing, 1);
        }
        self.complete(body);
    }

    /// Looks for the tags of a body where those that were found put them: also for those that no detector reads, because they
    /// are small or seen flat.
    fn complete(&mut self, body: &BodyTracker) {
        let again = body.expected_again(self.lens, self.image, &self.tracking.observations());
        self.look(&again);
    }

    /// Fits tags where they are expected, unless they were found.
    fn look(&mut self, expected: &[Expectation]) {
        for Expectation { tag, corners_px } in expected {
            if self.tracking.has(*tag) {
                continue;
            }
            let Ok(mut pattern) = self.refiner.refine_near(self.image, *tag, corners_px, self.pixels) else {
                continue;
            };
            if pattern.explained < SURELY_EXPLAINED {
                // Covered in part, or not quite there yet: a careful look tells.
                let again = self.refiner.refine(self.image, *tag, &pattern.observation.corners_px);
                pattern = again.ok().filter(|again| again.explained > pattern.explained).unwrap_or(pattern);
            }
            if pattern.explained >= MIN_FOLLOWED {
                self.add(pattern.observation.clone(), None, Some(pattern));
            }
        }
    }

    /// Fits those that were not found where they should be after all, by their neighbours. Returns where those are expected
    /// that are still missing.
    fn look_again(&mut self, lost: &[Expectation]) -> Vec<Expectation> {
        let strays = Strays::new(&self.expected, &self.tracking);
        let missing = lost.iter().filter(|lost| !self.tracking.has(lost.tag));
        let mut again: Vec<Expectation> = missing.map(|lost| strays.correct(lost).unwrap_or(*lost)).collect();
        self.look(&again);
        again.retain(|lost| !self.tracking.has(lost.tag));
        again
    }

    /// Searches the parts of the image around lost tags, the largest first, until `enough` of them are found.
    fn search_around(&mut self, lost: &[Expectation], enough: usize) {
        let mut lost = lost.to_vec();
        lost.sort_by(|a, b| side_px(&b.corners_px).total_cmp(&side_px(&a.corners_px)));
        let mut found = 0;
        for Expectation { tag, corners_px } in lost {
            if found >= enough || self.regions == 0 {
                return;
            }
            let Some(region) = region_around(self.image, &corners_px) else { continue };
            self.regions -= 1;
            let decimate = (side_px(&corners_px) / EASY_SIDE_PX) as u32;
            for detection in self.detector.find_in(self.image, region, decimate).unwrap_or_default() {
                self.take(&detection);
            }
            found += usize::from(self.tracking.has(tag));
        }
    }

    /// Looks for tags in the whole image, made `decimate` times smaller, beside those that are known.
    pub(super) fn search(&mut self, decimate: u32) {
        self.tracking.searched = true;
        match self.detector.find_coarsely(self.image, decimate) {
            Ok(found) => found.iter().for_each(|found| self.take(found)),
            Err(error) => self.tracking.warnings.push(error.to_string()),
        }
        self.bodies.iter().for_each(|body| self.complete(body));
    }

    /// Takes in what the detector found, unless it is there already.
    fn take(&mut self, found: &Detection) {
        let Detection { tag, corners_px, hamming, margin } = found;
        let is_this = |other: &TrackedTag| {
            other.observation.tag == *tag && is_same_place(&other.observation.corners_px, corners_px)
        };
        if self.tracking.tags.iter().any(is_this) {
            return;
        }
        let how = Some(Found { hamming: *hamming, margin: *margin });
        match self.refiner.refine(self.image, *tag, corners_px) {
            Ok(pattern) => self.add(pattern.observation.clone(), how, Some(pattern)),
            // Read without an error it is a tag, of which something covers much, or which is bent.
            Err(RefineError::Unlike { .. } | RefineError::Lost) if *hamming == 0 => {
                self.add(TagObservation::from_detection(found, OUTLINE_ERROR_PX), how, None);
            }
            Err(error) => self.tracking.warnings.push(format!("{tag} was found and is not used: {error}")),
        }
    }

    fn add(&mut self, observation: TagObservation, found: Option<Found>, pattern: Option<Refined>) {
        let size_m = |tag: TagId| self.bodies.iter().find_map(|body| body.size_m(tag));
        let poses =
            size_m(observation.tag).and_then(|size_m| planar_poses(self.lens, &observation, size_m).ok());
        self.tracking.tags.push(TrackedTag { observation, found, pattern, poses });
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
