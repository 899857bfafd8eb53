//! Which observations agree on one pose.

use nalgebra::Isometry3;

use super::chi_squared::{MEDIAN_OF_8, ONE_IN_1E6, limit};
use super::least_squares::{Fit, Search, minimise};
use super::residuals::{Imaging, Target};

/// Rounds of reweighting at most.
const ROUNDS: usize = 20;
/// Weights that change less than this from round to round have settled.
const SETTLED: f64 = 1e-3;
/// Rounds in which tags are taken in or left out at most.
const SELECTIONS: usize = 4;
/// χ² of one tag at which its weight is a quarter: twice what is expected.
const KERNEL: f64 = 2.0 * MEDIAN_OF_8;

/// A pose and the observations that it rests on.
#[derive(Clone, Debug)]
pub(crate) struct Consensus {
    /// The fit to those observations, all weighted alike.
    pub fit: Fit,
    /// 1 for observations that are used, 0 for others; in the order of the targets.
    pub weights: Vec<f64>,
}

impl Consensus {
    /// How many observations are used.
    pub fn used(&self) -> usize {
        self.weights.iter().filter(|weight| **weight > 0.0).count()
    }
}

/// How badly a pose fits all tags, each of them limited (Cauchy's kernel): to compare poses some of whose tags are wrong.
pub(crate) fn robust_score(imaging: &Imaging<'_>, targets: &[Target], pose: &Isometry3<f64>) -> f64 {
    let squares = squares(imaging, targets, pose);
    let kept = best_of_each_tag(targets, &squares);
    let worst = f64::MAX; // outside the field of view: bad, but comparable
    kept.iter().zip(&squares).map(|(kept, square)| kept * (1.0 + square.min(worst) / KERNEL).ln()).sum()
}

/// The pose near `start` on which most tags agree.
///
/// If all fit, they are used. Else they are reweighted (Geman and McClure's kernel), on a scale that follows the median
/// tag: so most tags lead while the start is poor, and errors that all tags share (a calibration that is a bit off)
/// throw none out. In the end a tag is left out if it is worse than one in 10⁶ on that scale. Of observations of one tag
/// at most one is used. Without a majority nobody can tell who is wrong: then all are used, and fit badly.
pub(crate) fn agree(imaging: &Imaging<'_>, targets: &[Target], start: &Isometry3<f64>) -> Option<Consensus> {
    let kept = best_of_each_tag(targets, &squares(imaging, targets, start));
    let all = minimise(imaging, targets, &kept, start, Search::ROUGH)
        .filter(|rough| rough.chi2 <= limit(8.0, ONE_IN_1E6) * kept.iter().sum::<f64>())
        .and_then(|rough| minimise(imaging, targets, &kept, &rough.camera_from_body, Search::FULL));
    if let Some(fit) = all {
        let squares = squares(imaging, targets, &fit.camera_from_body);
        let same = best_of_each_tag(targets, &squares) == kept;
        if same && selected(&kept, &squares, 1.0) == kept {
            return Some(Consensus { fit, weights: kept });
        }
    }
    let pose = reweighted(imaging, targets, start)?;
    select(imaging, targets, &pose)
}

/// χ² of each observation.
fn squares(imaging: &Imaging<'_>, targets: &[Target], pose: &Isometry3<f64>) -> Vec<f64> {
    let view = imaging.at(pose);
    targets.iter().map(|target| view.square(target)).collect()
}

/// 1 for the observation of each tag that fits best, 0 for its duplicates.
fn best_of_each_tag(targets: &[Target], squares: &[f64]) -> Vec<f64> {
    let beaten = |i: usize, target: &Target| {
        let rivals = targets.iter().zip(squares).enumerate();
        rivals
            .filter(|(j, (rival, _))| *j != i && rival.tag == target.tag)
            .any(|(j, (_, square))| squares.get(i).is_none_or(|own| square < own || (square == own && j < i)))
    };
    targets.iter().enumerate().map(|(i, target)| if beaten(i, target) { 0.0 } else { 1.0 }).collect()
}

/// By how much errors are larger than stated, as a factor of χ², 1 at least: from the median of the tags (of an even
/// number the lower middle, so that half of the tags being wrong is not the measure).
fn scale(kept: &[f64], squares: &[f64]) -> f64 {
    let mut squares: Vec<f64> =
        kept.iter().zip(squares).filter(|(kept, _)| **kept > 0.0).map(|(_, square)| *square).collect();
    squares.sort_by(f64::total_cmp);
    let median = squares.get(squares.len().saturating_sub(1) / 2).copied().unwrap_or(0.0);
    (median / MEDIAN_OF_8).max(1.0)
}

fn selected(kept: &[f64], squares: &[f64], scale: f64) -> Vec<f64> {
    let most = limit(8.0, ONE_IN_1E6) * scale;
    kept.iter().zip(squares).map(|(kept, square)| if *square <= most { *kept } else { 0.0 }).collect()
}

fn reweighted(imaging: &Imaging<'_>, targets: &[Target], start: &Isometry3<f64>) -> Option<Isometry3<f64>> {
    let mut pose = *start;
    let mut before = vec![0.0; targets.len()];
    for _ in 0..ROUNDS {
        let squares = squares(imaging, targets, &pose);
        let kept = best_of_each_tag(targets, &squares);
        let scale = scale(&kept, &squares);
        if !scale.is_finite() {
            return None;
        }
        let weight = |(kept, square): (&f64, &f64)| kept / (1.0 + square / (KERNEL * scale)).powi(2);
        let weights: Vec<f64> = kept.iter().zip(&squares).map(weight).collect();
        if weights.iter().zip(&before).all(|(now, before)| (now - before).abs() < SETTLED) {
            break;
        }
        pose = minimise(imaging, targets, &weights, &pose, Search::SHORT)?.camera_from_body;
        before = weights;
    }
    Some(pose)
}

fn select(imaging: &Imaging<'_>, targets: &[Target], pose: &Isometry3<f64>) -> Option<Consensus> {
    let mut pose = *pose;
    let mut last: Option<Consensus> = None;
    for _ in 0..SELECTIONS {
        let squares = squares(imaging, targets, &pose);
        let kept = best_of_each_tag(targets, &squares);
        let mut weights = selected(&kept, &squares, scale(&kept, &squares));
        if 2.0 * weights.iter().sum::<f64>() <= kept.iter().sum::<f64>() {
            weights = kept;
        }
        if let Some(last) = last.take_if(|last| last.weights == weights) {
            return Some(last);
        }
        let fit = minimise(imaging, targets, &weights, &pose, Search::FULL)?;
        pose = fit.camera_from_body;
        last = Some(Consensus { fit, weights });
    }
    last
}
