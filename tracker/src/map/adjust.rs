//! Robust adjustment of all tags and views together.

use nalgebra::{DMatrix, Isometry3, SMatrix};

use super::problem::{Observation, Problem};
use super::system::System;
use super::{Job, MapError};
use crate::body::BodyTag;
use crate::detection::TagObservation;
use crate::planar::planar_poses;
use crate::pose::chi_squared::{MEDIAN_OF_8, ONE_IN_1E4, ONE_IN_1E6, limit};
use crate::pose::consensus::robust_score;
use crate::pose::least_squares::{Search, minimise as minimise_pose};
use crate::pose::residuals::{Imaging, Target};

/// Rounds of reweighting at most.
const ROUNDS: usize = 40;
/// By how much the kernel narrows from round to round.
const NARROWING: f64 = 0.5;
/// Widest kernel, as a multiple of the narrow one.
const WIDEST: f64 = 1e8;
/// Weights that change less than this from round to round have settled.
const SETTLED: f64 = 1e-3;
/// Rounds in which observations are taken in or left out at most.
const SELECTIONS: usize = 6;
/// χ² of one observation at which its weight is a quarter: twice what is expected.
const KERNEL: f64 = 2.0 * MEDIAN_OF_8;
/// Round from which on the lens is estimated too.
const LENS_FROM: usize = 5;
/// Steps between two rounds.
const SHORT: usize = 4;
/// Steps at most.
const FULL: usize = 100;
/// A step that promises less than this part of χ² is the last one.
const LEAST_GAIN: f64 = 1e-10;
const FIRST_DAMPING: f64 = 1e-4;
const MAX_DAMPING: f64 = 1e10;
/// Errors of lens and print are no normal ones: where they rule, χ² up to this many times what normal errors reach is no
/// mistake (twice their distance).
const NOT_NORMAL: f64 = 4.0;
/// Errors beyond the corners' own are looked for up to here.
const MOST_UNEXPLAINED_PX: f64 = 1e3;

/// A map, and what it rests on.
pub(super) struct Adjusted {
    pub problem: Problem,
    /// 1 for observations that are used, 0 for others.
    pub weights: Vec<f64>,
    /// Of the unknowns that views share.
    pub covariance: DMatrix<f64>,
    pub reduced_chi2: f64,
    pub unexplained_px: f64,
}

/// The map near `problem` on which most observations agree.
///
/// Reweighted by Geman and McClure's kernel, which is so wide in the beginning that all observations count, and narrows
/// while they come together (Yang, Antonante, Tzoumas and Carlone, *Graduated Non-Convexity for Robust Spatial
/// Perception*, 2020): so the error of a long chain is spread over it, and does not break it in one place. Then with
/// observations in or out: one worse than one in 10⁶ is out. What lens and print add to the corners' errors is found on the
/// way from the median observation.
pub(super) fn adjust(mut problem: Problem, job: &Job<'_>) -> Result<Adjusted, MapError> {
    let lens_is_free = problem.free_lens;
    // With errors of metres the lens would be bent to fit them.
    problem.free_lens = false;
    let mut before = vec![0.0; problem.observations.len()];
    let mut unexplained_px = 0.0;
    let mut width = WIDEST;
    for round in 0..ROUNDS {
        job.check()?;
        unexplained_px = explain(&mut problem, &before);
        relocate(&mut problem, unexplained_px);
        let squares = problem.squares();
        let kept = best_of_each_tag(&problem, &squares);
        let worst = squares.iter().copied().filter(|square| square.is_finite()).fold(1.0, f64::max);
        width = (width * NARROWING).min(worst / KERNEL).max(1.0);
        let weight = |(kept, square): (&f64, &f64)| kept / (1.0 + square / (KERNEL * width)).powi(2);
        let weights: Vec<f64> = kept.iter().zip(&squares).map(weight).collect();
        let settled = weights.iter().zip(&before).all(|(now, before)| (now - before).abs() < SETTLED);
        if settled && width <= 1.0 && problem.free_lens == lens_is_free {
            break;
        }
        problem.free_lens = lens_is_free && (round >= LENS_FROM || settled);
        problem = minimise(problem, &weights, SHORT, job)?;
        before = weights;
    }
    problem.free_lens = lens_is_free;
    let mut weights: Vec<f64> = Vec::new();
    for _ in 0..SELECTIONS {
        relocate(&mut problem, unexplained_px);
        let squares = problem.squares();
        let kept = best_of_each_tag(&problem, &squares);
        let most = limit(8.0, ONE_IN_1E6) * if unexplained_px > 0.0 { NOT_NORMAL } else { 1.0 };
        let selected =
            kept.iter().zip(&squares).map(|(kept, square)| if *square <= most { *kept } else { 0.0 });
        let selected = connected(&problem, selected.collect());
        let same = selected == weights;
        weights = selected;
        if same {
            break;
        }
        problem = minimise(problem, &weights, FULL, job)?;
        unexplained_px = explain(&mut problem, &weights);
    }
    finish(problem, weights, unexplained_px)
}

fn finish(problem: Problem, weights: Vec<f64>, unexplained_px: f64) -> Result<Adjusted, MapError> {
    let undetermined = MapError::Undetermined { refine_lens: problem.free_lens };
    let is_used = |tag: usize| {
        let mut used = problem.observations.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0);
        used.any(|(observation, _)| observation.tag == tag)
    };
    if let Some((_, tag)) = problem.tags.iter().enumerate().find(|(index, _)| !is_used(*index)) {
        return Err(MapError::NoFit { tag: tag.tag });
    }
    let system = System::new(&problem, &weights).ok_or(undetermined.clone())?;
    let covariance = system.covariance().ok_or(undetermined)?;
    let reduced_chi2 = system.chi2 / freedom(&problem, &weights).max(1.0);
    Ok(Adjusted { problem, weights, covariance, reduced_chi2, unexplained_px })
}

/// Puts cameras where what they see fits better: a camera that took a tag's other pose for the true one does not get there
/// step by step.
fn relocate(problem: &mut Problem, unexplained_px: f64) {
    let mut poses = Vec::new();
    for (index, camera) in problem.cameras.iter().enumerate() {
        let own = problem.observations.iter().filter(|observation| observation.camera == index);
        let seen: Vec<(TagObservation, BodyTag)> =
            own.filter_map(|own| own.as_seen(&problem.tags, unexplained_px)).collect();
        let targets: Vec<Target> =
            seen.iter().filter_map(|(seen, tag)| Target::new(seen, tag.corners_m(), [0.0; 4])).collect();
        let imaging = Imaging { lens: &problem.lens, motion: None };
        let score = |pose: &Isometry3<f64>| robust_score(&imaging, &targets, pose);
        let here = score(&camera.camera_from_map);
        let view = imaging.at(&camera.camera_from_map);
        if targets.iter().all(|target| view.square(target) <= limit(8.0, ONE_IN_1E4)) {
            continue;
        }
        let starts = seen.iter().filter_map(|(seen, tag)| {
            let poses = planar_poses(&problem.lens, seen, tag.size_m).ok()?;
            Some(poses.map(|pose| pose.camera_from_tag * tag.body_from_tag.inverse()))
        });
        let better = |start: Isometry3<f64>| {
            let weights = vec![1.0; targets.len()];
            let fit = minimise_pose(&imaging, &targets, &weights, &start, Search::ROUGH)?;
            Some([start, fit.camera_from_body])
        };
        let tried = starts.flatten().filter_map(better).flatten().map(|pose| (score(&pose), pose));
        if let Some((score, pose)) = tried.min_by(|a, b| a.0.total_cmp(&b.0))
            && score < here
        {
            poses.push((index, pose));
        }
    }
    for (index, pose) in poses {
        if let Some(camera) = problem.cameras.get_mut(index) {
            camera.camera_from_map = pose;
        }
    }
}

/// A view of one tag says nothing of how tags lie to each other.
fn connected(problem: &Problem, mut weights: Vec<f64>) -> Vec<f64> {
    let mut used = vec![0_usize; problem.cameras.len()];
    for (observation, _) in problem.observations.iter().zip(&weights).filter(|(_, weight)| **weight > 0.0) {
        if let Some(used) = used.get_mut(observation.camera) {
            *used += 1;
        }
    }
    for (observation, weight) in problem.observations.iter().zip(&mut weights) {
        if used.get(observation.camera).is_none_or(|used| *used < 2) {
            *weight = 0.0;
        }
    }
    weights
}

/// 1 for the observation of each tag in each view that fits best, 0 for its duplicates and what the lens cannot see.
fn best_of_each_tag(problem: &Problem, squares: &[f64]) -> Vec<f64> {
    let mut best = std::collections::HashMap::new();
    for (index, (Observation { camera, tag, .. }, square)) in
        problem.observations.iter().zip(squares).enumerate()
    {
        if square.is_finite() {
            let entry = best.entry((camera, tag)).or_insert((index, square));
            if square < entry.1 {
                *entry = (index, square);
            }
        }
    }
    let mut kept = vec![0.0; squares.len()];
    for (index, _) in best.into_values() {
        if let Some(kept) = kept.get_mut(index) {
            *kept = 1.0;
        }
    }
    kept
}

/// Coordinates less unknowns.
fn freedom(problem: &Problem, weights: &[f64]) -> f64 {
    let used = weights.iter().filter(|weight| **weight > 0.0).count();
    let shared = problem.free().into_iter().filter(|free| *free).count();
    let mut cameras: Vec<usize> = problem
        .observations
        .iter()
        .zip(weights)
        .filter(|(_, weight)| **weight > 0.0)
        .map(|(observation, _)| observation.camera)
        .collect();
    cameras.sort_unstable();
    cameras.dedup();
    (8 * used) as f64 - shared as f64 - 6.0 * cameras.len() as f64
}

/// Takes as much error beside the corners' own that the median observation fits as it should; all count where none is used
/// yet. Returns it.
fn explain(problem: &mut Problem, weights: &[f64]) -> f64 {
    let all = weights.iter().all(|weight| *weight <= 0.0);
    let used = problem.observations.iter().zip(weights).filter(|(_, weight)| all || **weight > 0.0);
    let errors: Vec<_> = used
        .filter_map(|(observation, _)| Some((observation.clone(), problem.error_px(observation)?)))
        .collect();
    let count = 8.0 * errors.len() as f64;
    let free = if all { count } else { freedom(problem, weights) };
    let expected = MEDIAN_OF_8 * (free / count.max(1.0)).clamp(0.1, 1.0);
    let is_enough = |px: f64| {
        let square = |(observation, error): &(Observation, nalgebra::SVector<f64, 8>)| {
            let whitening = observation.whitening_with(px).unwrap_or_else(SMatrix::zeros);
            (whitening * error).norm_squared()
        };
        let mut squares: Vec<f64> = errors.iter().map(square).collect();
        squares.sort_by(f64::total_cmp);
        squares.get(squares.len() / 2).is_none_or(|median| *median <= expected)
    };
    let (mut low, mut high) = (0.0, MOST_UNEXPLAINED_PX);
    if is_enough(0.0) {
        high = 0.0;
    }
    // To a thousandth of it, or of a pixel.
    while high - low > 1e-3 * f64::max(1.0, low) {
        let middle = (low + high) / 2.0;
        if is_enough(middle) { high = middle } else { low = middle }
    }
    for observation in &mut problem.observations {
        if let Some(whitening) = observation.whitening_with(high) {
            observation.whitening = whitening;
        }
    }
    high
}

/// The least weighted sum of squares (Levenberg and Marquardt).
fn minimise(mut problem: Problem, weights: &[f64], steps: usize, job: &Job<'_>) -> Result<Problem, MapError> {
    let undetermined = || MapError::Undetermined { refine_lens: problem.free_lens };
    let mut here = System::new(&problem, weights).ok_or_else(undetermined)?;
    let mut damping = FIRST_DAMPING;
    for _ in 0..steps {
        job.check()?;
        let mut next = None;
        while damping <= MAX_DAMPING {
            let Some(step) = here.step(damping) else {
                damping *= 10.0;
                continue;
            };
            if step.promised.is_nan() || step.promised < LEAST_GAIN * here.chi2 {
                return Ok(problem);
            }
            let moved = problem.moved(&step.shared, &step.cameras);
            next = moved.and_then(|moved| {
                let system = System::new(&moved, weights)?;
                (system.chi2 < here.chi2).then_some((moved, system))
            });
            if next.is_some() {
                break;
            }
            damping *= 10.0;
        }
        let Some((moved, system)) = next else { break };
        (problem, here) = (moved, system);
        damping = (damping * 0.1).max(1e-12);
    }
    Ok(problem)
}
