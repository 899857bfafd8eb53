//! The first poses: tag by tag, each from the views that show it beside tags that are placed already.

use std::collections::BTreeMap;

use nalgebra::Isometry3;

use super::problem::{Camera, Observation, Problem, Tag};
use super::{Job, MapError};
use crate::body::BodyTag;
use crate::detection::{TagId, TagObservation};
use crate::planar::{PlanarPose, planar_poses};
use crate::pose::chi_squared::MEDIAN_OF_8;
use crate::pose::consensus::{agree, robust_score};
use crate::pose::least_squares::{Search, minimise};
use crate::pose::residuals::{Imaging, Target};

/// Views that suggest a tag's pose.
const SUGGESTING: usize = 12;
/// Views that vote on it.
const VOTING: usize = 16;

/// An observation with both its poses.
struct Seen<'a> {
    observation: &'a TagObservation,
    camera_from_tag: [PlanarPose; 2],
}

/// A view in which a tag is beside others that are placed.
struct Sight<'a> {
    seen: &'a [Seen<'a>],
    /// Which of them is the tag.
    own: usize,
    /// The largest of the others.
    largest: usize,
}

type Placed = BTreeMap<TagId, Isometry3<f64>>;

/// Poses of all tags of a connected group, and of the views that show two of them.
pub(super) fn grow(job: &Job<'_>, origin: TagId, group: &[TagId]) -> Result<Problem, MapError> {
    let seen: Vec<Vec<Seen<'_>>> = job.views.iter().map(|view| with_poses(job, &view.observations)).collect();
    let mut placed = Placed::from([(origin, Isometry3::identity())]);
    while placed.len() < group.len() {
        job.check()?;
        let (tag, sights) = next(&seen, group, &placed)?;
        let pose = place(job, tag, &sights, &placed).ok_or(MapError::NoPose { tag })?;
        placed.insert(tag, pose);
    }
    problem(job, origin, &seen, &placed)
}

fn with_poses<'a>(job: &Job<'_>, observations: &'a [TagObservation]) -> Vec<Seen<'a>> {
    let seen = |observation: &'a TagObservation| {
        let camera_from_tag = planar_poses(&job.lens, observation, job.sizes.of(observation.tag)).ok()?;
        Some(Seen { observation, camera_from_tag })
    };
    observations.iter().filter_map(seen).collect()
}

/// The tag that most views show beside tags that are placed, and these views.
fn next<'a>(
    seen: &'a [Vec<Seen<'a>>],
    group: &[TagId],
    placed: &Placed,
) -> Result<(TagId, Vec<Sight<'a>>), MapError> {
    let sights = |tag: TagId| -> Vec<Sight<'a>> {
        seen.iter().flat_map(|seen| sights_of(seen, tag, placed)).collect()
    };
    let open = || group.iter().filter(|tag| !placed.contains_key(tag)).copied();
    let best = open().map(|tag| (tag, sights(tag))).max_by_key(|(_, sights)| sights.len());
    match best {
        Some((_, sights)) if sights.is_empty() => {
            let tag = open().next();
            Err(tag.map_or(MapError::Undetermined { refine_lens: false }, |tag| MapError::NoPose { tag }))
        }
        Some(best) => Ok(best),
        None => Err(MapError::Undetermined { refine_lens: false }),
    }
}

fn sights_of<'a>(seen: &'a [Seen<'a>], tag: TagId, placed: &Placed) -> Vec<Sight<'a>> {
    let others = seen.iter().enumerate().filter(|(_, other)| placed.contains_key(&other.observation.tag));
    let largest = others.max_by(|a, b| area_px2(a.1).total_cmp(&area_px2(b.1)));
    let Some((largest, _)) = largest else { return Vec::new() };
    let own = seen.iter().enumerate().filter(|(_, seen)| seen.observation.tag == tag);
    own.map(|(own, _)| Sight { seen, own, largest }).collect()
}

fn area_px2(seen: &Seen<'_>) -> f64 {
    let [a, b, c, d] = seen.observation.corners_px;
    (c - a).perp(&(d - b)).abs() / 2.0
}

impl Sight<'_> {
    fn own(&self) -> Option<&Seen<'_>> {
        self.seen.get(self.own)
    }

    /// Both poses of the camera by the largest tag that is placed.
    fn camera_from_map(&self, placed: &Placed) -> Vec<Isometry3<f64>> {
        let by = self.seen.get(self.largest);
        by.into_iter().flat_map(|seen| starts(seen, placed)).collect()
    }

    /// How well a pose of the tag fits what is seen here: less is better.
    fn cost(&self, job: &Job<'_>, tag: TagId, pose: &Isometry3<f64>, placed: &Placed) -> f64 {
        let mut with_it: Placed = self
            .seen
            .iter()
            .filter_map(|seen| placed.get_key_value(&seen.observation.tag))
            .map(|(k, v)| (*k, *v))
            .collect();
        with_it.insert(tag, *pose);
        let used =
            self.seen.iter().enumerate().filter(|(i, seen)| seen.observation.tag != tag || *i == self.own);
        let targets: Vec<Target> =
            used.filter_map(|(_, seen)| target(job, seen.observation, &with_it)).collect();
        let imaging = Imaging { lens: &job.lens, motion: None };
        let own = self.own().into_iter().flat_map(|seen| starts(seen, &with_it));
        let start = self.camera_from_map(placed).into_iter().chain(own);
        let start = lowest(start, |start| robust_score(&imaging, &targets, start));
        let weights = vec![1.0; targets.len()];
        let fit = start.and_then(|start| minimise(&imaging, &targets, &weights, &start, Search::ROUGH));
        // Limited, so that a view in which something else is wrong has one vote as others have.
        let worst = 1e12;
        fit.map_or(worst, |fit| fit.chi2.min(worst) / (MEDIAN_OF_8 * weights.len() as f64)).ln_1p()
    }
}

/// Poses of a camera by one tag that is placed.
fn starts(seen: &Seen<'_>, placed: &Placed) -> Vec<Isometry3<f64>> {
    let Some(map_from_tag) = placed.get(&seen.observation.tag) else { return Vec::new() };
    let tag_from_map = map_from_tag.inverse();
    seen.camera_from_tag.iter().map(|pose| pose.camera_from_tag * tag_from_map).collect()
}

fn lowest(
    poses: impl Iterator<Item = Isometry3<f64>>,
    cost: impl Fn(&Isometry3<f64>) -> f64,
) -> Option<Isometry3<f64>> {
    poses.map(|pose| (cost(&pose), pose)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, pose)| pose)
}

fn target(job: &Job<'_>, observation: &TagObservation, placed: &Placed) -> Option<Target> {
    let body_from_tag = *placed.get(&observation.tag)?;
    let own = BodyTag { tag: observation.tag, size_m: job.sizes.of(observation.tag), body_from_tag };
    Target::new(observation, own.corners_m(), [0.0; 4])
}

/// The pose on which most views agree, of those that any suggests.
fn place(job: &Job<'_>, tag: TagId, sights: &[Sight<'_>], placed: &Placed) -> Option<Isometry3<f64>> {
    let suggested = spread(sights, SUGGESTING).flat_map(|sight| {
        let map_from_camera: Vec<_> = sight.camera_from_map(placed).iter().map(Isometry3::inverse).collect();
        let own = sight.own().into_iter().flat_map(|seen| seen.camera_from_tag);
        own.flat_map(|own| {
            map_from_camera.iter().map(|camera| camera * own.camera_from_tag).collect::<Vec<_>>()
        })
        .collect::<Vec<_>>()
    });
    let cost = |pose: &Isometry3<f64>| -> f64 {
        spread(sights, VOTING).map(|sight| sight.cost(job, tag, pose, placed)).sum()
    };
    lowest(suggested, cost)
}

/// At most so many, from the first to the last.
fn spread<T>(all: &[T], most: usize) -> impl Iterator<Item = &T> {
    let step = all.len().div_ceil(most).max(1);
    all.iter().step_by(step)
}

fn problem(
    job: &Job<'_>,
    origin: TagId,
    seen: &[Vec<Seen<'_>>],
    placed: &Placed,
) -> Result<Problem, MapError> {
    let tag = |(tag, map_from_tag): (&TagId, &Isometry3<f64>)| Tag {
        tag: *tag,
        size_m: job.sizes.of(*tag),
        map_from_tag: *map_from_tag,
        free_pose: *tag != origin,
        free_size: job.sizes.is_free(*tag),
    };
    let tags: Vec<Tag> = placed.iter().map(tag).collect();
    let mut problem = Problem::new(tags, job.lens, job.refine_lens);
    for (view, seen) in job.views.iter().zip(seen) {
        job.check()?;
        let known: Vec<&Seen<'_>> =
            seen.iter().filter(|seen| placed.contains_key(&seen.observation.tag)).collect();
        let first = known.first().map(|seen| seen.observation.tag);
        if known.iter().all(|seen| Some(seen.observation.tag) == first) {
            continue;
        }
        let Some(camera_from_map) = camera(job, &known, placed) else { continue };
        let camera = problem.cameras.len();
        problem.cameras.push(Camera { number: view.number, camera_from_map });
        for seen in known {
            if let Some(observation) = Observation::new(camera, &problem.tags, seen.observation) {
                problem.observations.push(observation);
            }
        }
    }
    Ok(problem)
}

/// The pose of a camera on which most of its tags agree.
fn camera(job: &Job<'_>, seen: &[&Seen<'_>], placed: &Placed) -> Option<Isometry3<f64>> {
    let targets: Vec<Target> = seen.iter().filter_map(|seen| target(job, seen.observation, placed)).collect();
    let imaging = Imaging { lens: &job.lens, motion: None };
    let start = lowest(seen.iter().flat_map(|seen| starts(seen, placed)), |start| {
        robust_score(&imaging, &targets, start)
    })?;
    Some(agree(&imaging, &targets, &start).map_or(start, |consensus| consensus.fit.camera_from_body))
}
