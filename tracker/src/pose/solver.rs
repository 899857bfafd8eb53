//! From observed tags to the pose of their body.

use std::collections::HashMap;

use coshade_lens::model::CameraModel;
use nalgebra::Isometry3;

use super::consensus::{Consensus, agree, robust_score};
use super::decision::Rivals;
use super::least_squares::{Fit, Search, minimise};
use super::mirror::{angle_rad, is_flat, mirrored_fit};
use super::residuals::{Imaging, Target};
use super::rolling::RowMotion;
use super::{
    Before, BodyPose, Certainty, Expected, Misfit, Past, PoseError, PoseEstimate, Rejected, Rejection,
};
use crate::body::{Body, BodyError, BodyTag};
use crate::detection::{TagId, TagObservation};
use crate::planar::{PlanarError, planar_starts};

/// Tags whose planar poses are tried as starts: more only help if as many are wrong.
const STARTING_TAGS: usize = 4;
/// Starts that are followed until tags agree.
const STARTS_FOLLOWED: usize = 3;
/// Starts that turn this far from a pose may lead to another.
const OTHER_START_RAD: f64 = 0.1;

/// Finds the pose of one body through one lens.
#[derive(Clone, Debug)]
pub struct PoseSolver {
    lens: CameraModel,
    name: String,
    tags: HashMap<TagId, BodyTag>,
    /// Time per row, and the row that is exposed at the frame's stamp.
    row_s: f64,
    centre_row: f64,
}

/// A usable observation.
struct Candidate {
    /// Its place in the list of observations.
    index: usize,
    /// Both planar poses.
    camera_from_body: [Isometry3<f64>; 2],
    /// Twice the area of its image.
    area_px2: f64,
}

/// The observations of one image.
struct Scene<'a> {
    imaging: Imaging<'a>,
    candidates: Vec<Candidate>,
    /// One for each candidate.
    targets: Vec<Target>,
    rejected: Vec<Rejected>,
}

/// What fits best.
struct BestTwo<'a> {
    best: Consensus,
    /// The rotation that fits second best, to the same observations.
    other: Option<Fit>,
    /// With the motion between rows that belongs to the best pose.
    imaging: Imaging<'a>,
}

/// The second best pose.
struct Rival {
    estimate: PoseEstimate,
    /// What it rests on, if not on the same observations as the best.
    consensus: Option<Consensus>,
}

impl PoseSolver {
    /// For a camera all of whose rows are exposed together.
    ///
    /// # Errors
    /// [`BodyError`] if a tag of the body has an impossible size or pose, or is there twice.
    pub fn new(lens: &CameraModel, body: &Body) -> Result<Self, BodyError> {
        body.check()?;
        let tags = body.tags.iter().map(|tag| (tag.tag, *tag)).collect();
        Ok(Self { lens: *lens, name: body.name.clone(), tags, row_s: 0.0, centre_row: 0.0 })
    }

    /// For a camera that exposes its `height_px` rows one after the other from the top, the last one `readout_s` after
    /// the first, and stamps its frames with the time of the centre row. The rows' times count where [`Past::before`] is
    /// given: then pose and motion are determined together.
    ///
    /// # Errors
    /// [`PoseError::Shutter`] if the read-out is not from 0 to 1 s.
    pub fn with_rolling_shutter(mut self, readout_s: f64, height_px: u32) -> Result<Self, PoseError> {
        if !(0.0..=1.0).contains(&readout_s) {
            return Err(PoseError::Shutter { readout_s, height_px });
        }
        let last_row = f64::from(height_px.saturating_sub(1).max(1));
        (self.row_s, self.centre_row) = (readout_s / last_row, last_row / 2.0);
        Ok(self)
    }

    /// The pose of the body in an image in which `observations` were made. Tags that are not the body's are ignored, and
    /// listed.
    ///
    /// # Errors
    /// [`PoseError`] if no observation can be used, or `past` is impossible.
    pub fn solve(&self, observations: &[TagObservation], past: &Past) -> Result<BodyPose, PoseError> {
        self.check(past)?;
        let mut scene = self.scene(observations, past);
        if scene.targets.is_empty() {
            return Err(PoseError::NoTag { body: self.name.clone(), rejected: scene.rejected });
        }
        let tags = scene.targets.len();
        let no_fit = || PoseError::NoFit { body: self.name.clone(), tags };
        let everything = vec![true; tags];
        let BestTwo { best, other, imaging } = scene.best_two(&everything).ok_or_else(no_fit)?;
        scene.imaging = imaging;
        let estimate = scene.estimate(&best.fit, &best.weights).ok_or_else(no_fit)?;
        let (estimate, certainty, best) = match scene.rival(&best, other.as_ref()) {
            None => (estimate, Certainty::Clear, best),
            Some(rival) => {
                let rivals =
                    Rivals { best: estimate, other: rival.estimate, contested: rival.consensus.is_some() };
                let (chosen, certainty) = rivals.decide(past.expected.as_ref());
                let other_chosen = chosen != estimate;
                (chosen, certainty, rival.consensus.filter(|_| other_chosen).unwrap_or(best))
            }
        };
        let misfit = Misfit::of(&estimate, scene.mean_side_px(&best));
        let used = scene.used(&best);
        scene.reject_unused(&best, &estimate.camera_from_body);
        Ok(BodyPose { estimate, certainty, used, rejected: scene.rejected, misfit })
    }

    fn check(&self, past: &Past) -> Result<(), PoseError> {
        let body = || self.name.clone();
        let finite = |pose: &Isometry3<f64>| pose.to_homogeneous().iter().all(|x| x.is_finite());
        if let Some(Expected { camera_from_body, covariance }) = &past.expected
            && !(finite(camera_from_body) && covariance.cholesky().is_some())
        {
            return Err(PoseError::Expected { body: body() });
        }
        if let Some(Before { camera_from_body, elapsed_s }) = past.before
            && !(finite(&camera_from_body) && elapsed_s > 0.0 && elapsed_s.is_finite())
        {
            return Err(PoseError::Before { body: body(), elapsed_s });
        }
        Ok(())
    }

    fn scene(&self, observations: &[TagObservation], past: &Past) -> Scene<'_> {
        let moving = past.before.filter(|_| self.row_s > 0.0);
        let motion = moving
            .map(|Before { camera_from_body: before, elapsed_s }| RowMotion::Since { before, elapsed_s });
        let imaging = Imaging { lens: &self.lens, motion };
        let mut scene = Scene { imaging, candidates: Vec::new(), targets: Vec::new(), rejected: Vec::new() };
        for (index, observation) in observations.iter().enumerate() {
            match self.prepared(index, observation) {
                Ok((candidate, target)) => {
                    scene.candidates.push(candidate);
                    scene.targets.push(target);
                }
                Err(reason) => scene.rejected.push(Rejected { tag: observation.tag, index, reason }),
            }
        }
        scene
    }

    fn prepared(&self, index: usize, observation: &TagObservation) -> Result<(Candidate, Target), Rejection> {
        let tag = self.tags.get(&observation.tag).ok_or(Rejection::Unknown)?;
        let tag_from_body = tag.body_from_tag.inverse();
        let starts = planar_starts(&self.lens, observation, tag.size_m)?;
        let times_s = observation.corners_px.map(|px| (px.y - self.centre_row) * self.row_s);
        let target = Target::new(observation, tag.corners_m(), times_s)
            .ok_or(PlanarError::Covariance { tag: observation.tag })?;
        let [a, b, c, d] = observation.corners_px;
        let area_px2 = (c - a).perp(&(d - b)).abs();
        let camera_from_body = starts.map(|camera_from_tag| camera_from_tag * tag_from_body);
        Ok((Candidate { index, camera_from_body, area_px2 }, target))
    }
}

impl<'a> Scene<'a> {
    /// The best poses, from the observations that are `allowed`.
    fn best_two(&self, allowed: &[bool]) -> Option<BestTwo<'a>> {
        let starts = self.starts(allowed);
        let mut best = self.consensus(allowed, &starts)?;
        let imaging = self.imaging.moving_as_at(&best.fit.camera_from_body);
        let mut other = self.other(&imaging, &best, &starts);
        if let Some(better) = other.filter(|other| other.chi2 < best.fit.chi2) {
            // The minimum that the starts led to was not the best one.
            let targets = self.allowed(allowed);
            other = Some(best.fit);
            best = match self.widened(allowed, agree(&imaging, &targets, &better.camera_from_body)) {
                Some(wider) if wider.weights != best.weights => wider,
                _ => Consensus { fit: better, weights: best.weights },
            };
        }
        Some(BestTwo { best, other, imaging })
    }

    /// Planar poses of the largest tags, the one that fits all tags best first.
    fn starts(&self, allowed: &[bool]) -> Vec<Isometry3<f64>> {
        let targets = self.allowed(allowed);
        let mut largest: Vec<&Candidate> =
            self.candidates.iter().zip(allowed).filter(|(_, allowed)| **allowed).map(|(c, _)| c).collect();
        largest.sort_by(|a, b| b.area_px2.total_cmp(&a.area_px2));
        let starts = largest.iter().take(STARTING_TAGS).flat_map(|candidate| candidate.camera_from_body);
        let mut scored: Vec<(f64, Isometry3<f64>)> =
            starts.map(|start| (robust_score(&self.imaging, &targets, &start), start)).collect();
        scored.sort_by(|a, b| a.0.total_cmp(&b.0));
        scored.into_iter().map(|(_, start)| start).collect()
    }

    /// What most tags agree on: from the best start, or from others if none do from there.
    fn consensus(&self, allowed: &[bool], starts: &[Isometry3<f64>]) -> Option<Consensus> {
        let targets = self.allowed(allowed);
        let mut best: Option<Consensus> = None;
        for start in starts.iter().take(STARTS_FOLLOWED) {
            let Some(found) = self.widened(allowed, agree(&self.imaging, &targets, start)) else { continue };
            let fits = self
                .estimate(&found.fit, &found.weights)
                .is_some_and(|pose| Misfit::of(&pose, self.mean_side_px(&found)).is_none());
            let better = best
                .as_ref()
                .is_none_or(|best| (found.used(), -found.fit.chi2) > (best.used(), -best.fit.chi2));
            if better {
                best = Some(found);
            }
            if fits {
                break;
            }
        }
        best
    }

    /// The second best rotation, from the mirrored pose, and for bodies that are not flat from the starts as well.
    fn other(&self, imaging: &Imaging<'_>, best: &Consensus, starts: &[Isometry3<f64>]) -> Option<Fit> {
        let Consensus { fit, weights } = best;
        let mirrored = mirrored_fit(imaging, &self.targets, weights, fit);
        if is_flat(&self.targets, weights) {
            return mirrored;
        }
        let elsewhere = |pose: &Isometry3<f64>| angle_rad(pose, &fit.camera_from_body) > OTHER_START_RAD;
        let start = starts.iter().find(|start| elsewhere(start));
        let followed = start
            .and_then(|start| minimise(imaging, &self.targets, weights, start, Search::FULL))
            .filter(|followed| elsewhere(&followed.camera_from_body));
        [mirrored, followed].into_iter().flatten().min_by(|a, b| a.chi2.total_cmp(&b.chi2))
    }

    /// The pose that might be true instead. Where a tag is in view twice, the other observation of it may be the right
    /// one: the pose without the first is a rival, too, if as many tags agree on it.
    fn rival(&self, best: &Consensus, other: Option<&Fit>) -> Option<Rival> {
        let mirrored = other.and_then(|other| self.estimate(other, &best.weights));
        let mirrored = mirrored.map(|estimate| Rival { estimate, consensus: None });
        let contested = self.without_duplicated(best).and_then(|allowed| {
            let consensus = self.best_two(&allowed)?.best;
            if consensus.used() < best.used() {
                return None;
            }
            let estimate = self.estimate(&consensus.fit, &consensus.weights)?;
            Some(Rival { estimate, consensus: Some(consensus) })
        });
        let rivals = [mirrored, contested].into_iter().flatten();
        rivals.min_by(|a, b| a.estimate.chi2.total_cmp(&b.estimate.chi2))
    }

    /// All observations except those used ones of which there is another of the same tag; `None` if there is no such.
    fn without_duplicated(&self, best: &Consensus) -> Option<Vec<bool>> {
        let count = |tag: TagId| self.targets.iter().filter(|target| target.tag == tag).count();
        let used = |weight: &f64| *weight > 0.0;
        let allowed: Vec<bool> = self
            .targets
            .iter()
            .zip(&best.weights)
            .map(|(target, weight)| !(used(weight) && count(target.tag) > 1))
            .collect();
        allowed.contains(&false).then_some(allowed)
    }

    fn allowed(&self, allowed: &[bool]) -> Vec<Target> {
        self.targets.iter().zip(allowed).filter(|(_, allowed)| **allowed).map(|(t, _)| t.clone()).collect()
    }

    /// A consensus among the allowed observations as one among all.
    fn widened(&self, allowed: &[bool], consensus: Option<Consensus>) -> Option<Consensus> {
        let Consensus { fit, weights } = consensus?;
        let mut narrow = weights.into_iter();
        let weights = allowed.iter().map(|allowed| if *allowed { narrow.next().unwrap_or(0.0) } else { 0.0 });
        Some(Consensus { fit, weights: weights.collect() })
    }

    fn estimate(&self, fit: &Fit, weights: &[f64]) -> Option<PoseEstimate> {
        let view = self.imaging.at(&fit.camera_from_body);
        let (mut sum_px2, mut corners) = (0.0, 0_u32);
        for (target, _) in self.targets.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
            sum_px2 += view.error_px(target)?.norm_squared();
            corners += 4;
        }
        let mut estimate = PoseEstimate {
            camera_from_body: fit.camera_from_body,
            covariance: fit.covariance()?,
            chi2: fit.chi2,
            degrees_of_freedom: (2 * corners).saturating_sub(6),
            rms_px: (sum_px2 / f64::from(corners.max(1))).sqrt(),
        };
        if estimate.fits_badly() {
            estimate.covariance *= estimate.variance_factor();
        }
        // What is hardly determined may not survive the scaling.
        estimate.covariance.cholesky().map(|_| estimate)
    }

    fn used(&self, best: &Consensus) -> Vec<TagId> {
        let used = self.targets.iter().zip(&best.weights).filter(|(_, weight)| **weight > 0.0);
        used.map(|(target, _)| target.tag).collect()
    }

    /// Root of the mean area of the tags that are used.
    fn mean_side_px(&self, best: &Consensus) -> f64 {
        let used = self.candidates.iter().zip(&best.weights).filter(|(_, weight)| **weight > 0.0);
        let (sum, count) = used
            .fold((0.0, 0.0), |(sum, count), (candidate, _)| (sum + candidate.area_px2 / 2.0, count + 1.0));
        if count > 0.0 { (sum / count).sqrt() } else { 0.0 }
    }

    fn reject_unused(&mut self, best: &Consensus, camera_from_body: &Isometry3<f64>) {
        let view = self.imaging.at(camera_from_body);
        let is_used = |tag: TagId| {
            self.targets.iter().zip(&best.weights).any(|(target, weight)| target.tag == tag && *weight > 0.0)
        };
        let unused = self.candidates.iter().zip(&self.targets).zip(&best.weights).filter(|(_, w)| **w == 0.0);
        for ((candidate, target), _) in unused {
            let rms_px = view.error_px(target).map_or(f64::INFINITY, |error| error.norm() / 2.0);
            let reason =
                if is_used(target.tag) { Rejection::Duplicate } else { Rejection::Outlier { rms_px } };
            self.rejected.push(Rejected { tag: target.tag, index: candidate.index, reason });
        }
        self.rejected.sort_by_key(|rejected| rejected.index);
    }
}
