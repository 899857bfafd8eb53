//! How well the largest loop of tags closes: the same pose, reached the short way and the long way round.
//!
//! The loop is cut between two neighbours: views that see tags on both sides of the cut are taken out. What is left is a
//! chain that leads from one neighbour to the other all the way round; the views that were taken out say directly how the
//! two lie to each other. No image is used for both.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use coshade_lens::model::CameraModel;
use nalgebra::{Isometry3, Vector2};

use super::graph::Graph;
use super::grow::grow;
use super::{Job, MapError, View, adjust};
use crate::detection::TagId;

/// Shorter loops are within one view, or nearly so.
const SHORTEST: usize = 4;

/// The largest loop of tags that has no short cut, and by how much it fails to close.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Its tags in order; it is cut between the last and the first.
    pub tags: Vec<TagId>,
    /// Views that see across the cut, which the long way does without.
    pub views_across: usize,
    /// Views along the long way.
    pub views_around: usize,
    /// Length of the long way, from tag to tag.
    pub length_m: f64,
    /// With tags and views adjusted together.
    pub adjusted: ClosureError,
    /// With tags only chained to each other.
    pub chained: ClosureError,
}

/// How the pose of the first tag in the frame of the last differs between both ways.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosureError {
    /// Distance between both places.
    pub translation_m: f64,
    /// Angle between both rotations.
    pub rotation_rad: f64,
}

impl ClosureError {
    fn between(short: &Isometry3<f64>, long: &Isometry3<f64>) -> Self {
        Self {
            translation_m: (short.translation.vector - long.translation.vector).norm(),
            rotation_rad: short.rotation.angle_to(&long.rotation),
        }
    }
}

type Poses = BTreeMap<TagId, Isometry3<f64>>;

/// `None` if there is no loop, or its cut leaves no way round.
pub(super) fn measure(
    job: &Job<'_>,
    graph: &Graph,
    group: &[TagId],
    lens: &CameraModel,
) -> Result<Option<Closure>, MapError> {
    let tags = graph.longest_loop(group);
    let (Some(&first), Some(&last)) = (tags.first(), tags.last()) else { return Ok(None) };
    if tags.len() < SHORTEST {
        return Ok(None);
    }
    let places = places(graph, &tags);
    let (across, around): (Vec<View>, Vec<View>) =
        job.views.iter().cloned().partition(|view| is_across(view, &places, tags.len()));
    let long = chain(&job.of(&around, *lens), last, first)?;
    let short = chain(&job.of(&across, *lens), last, first)?;
    let (Some(long), Some(short)) = (long, short) else { return Ok(None) };
    let Some(direct) = short.adjusted.get(&first) else { return Ok(None) };
    let error = |poses: &Poses| poses.get(&first).map(|pose| ClosureError::between(direct, pose));
    let (Some(adjusted), Some(chained)) = (error(&long.adjusted), error(&long.chained)) else {
        return Ok(None);
    };
    let place = |tag: &TagId| long.adjusted.get(tag).map(|pose| pose.translation.vector);
    let steps =
        tags.windows(2).filter_map(|pair| Some((place(pair.first()?)? - place(pair.last()?)?).norm()));
    Ok(Some(Closure {
        views_across: across.len(),
        views_around: around.len(),
        length_m: steps.sum(),
        adjusted,
        chained,
        tags,
    }))
}

/// For each tag, where along the loop it is: the mean of those of the loop that it is nearest to, the first of which is at 0.
fn places(graph: &Graph, cycle: &[TagId]) -> BTreeMap<TagId, f64> {
    let turn = std::f64::consts::TAU / cycle.len() as f64;
    let mut nearest: BTreeMap<TagId, (usize, Vector2<f64>)> = BTreeMap::new();
    for (place, tag) in cycle.iter().enumerate() {
        let angle = turn * place as f64;
        let here = Vector2::new(angle.cos(), angle.sin());
        for (other, steps) in graph.distances(*tag) {
            let entry = nearest.entry(other).or_insert((steps, Vector2::zeros()));
            match steps.cmp(&entry.0) {
                Ordering::Less => *entry = (steps, here),
                Ordering::Equal => entry.1 += here,
                Ordering::Greater => {}
            }
        }
    }
    let place = |(tag, (_, sum)): (TagId, (usize, Vector2<f64>))| {
        let place = sum.y.atan2(sum.x) / turn;
        // The cut is half a step before the first.
        (tag, if place < -0.5 { place + cycle.len() as f64 } else { place })
    };
    nearest.into_iter().map(place).collect()
}

/// Whether two of its tags are nearer to each other through the cut than along the loop.
fn is_across(view: &View, places: &BTreeMap<TagId, f64>, length: usize) -> bool {
    let places = || view.observations.iter().filter_map(|seen| places.get(&seen.tag).copied());
    let (low, high) = (places().fold(f64::MAX, f64::min), places().fold(f64::MIN, f64::max));
    2.0 * (high - low) > length as f64
}

struct Chain {
    chained: Poses,
    adjusted: Poses,
}

/// Poses in the frame of `from`, if the views lead from there to `to`.
fn chain(job: &Job<'_>, from: TagId, to: TagId) -> Result<Option<Chain>, MapError> {
    let group: Vec<TagId> = Graph::new(job.views).distances(from).into_keys().collect();
    if !group.contains(&to) {
        return Ok(None);
    }
    let made = grow(job, from, &group).and_then(|grown| {
        let chained = Poses::from(&grown);
        let adjusted = adjust::adjust(grown, job)?;
        Ok(Chain { chained, adjusted: Poses::from(&adjusted.problem) })
    });
    match made {
        Err(MapError::Stopped) => Err(MapError::Stopped),
        // Too few views on one of both ways: then this is not known, while the map is.
        made => Ok(made.ok()),
    }
}
