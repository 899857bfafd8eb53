//! Poses by non-linear least squares.

use nalgebra::{Isometry3, Matrix3, Matrix6, Translation3, Vector3, Vector6};

use super::residuals::{Imaging, Target, disturbed};
use crate::lie;

/// A step that promises less than this of χ² is the last one: it is 10⁻⁵ of a standard deviation.
const CONVERGED: f64 = 1e-10;
const FIRST_DAMPING: f64 = 1e-4;
const MAX_DAMPING: f64 = 1e8;
/// Poses further away than this many times a thing's extent are none: it would be less than a pixel wide, and what
/// leads there is nonsense that fits best as a point.
const FURTHEST: f64 = 1e4;

/// What a fit may change, and how far it goes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Search {
    /// Whether rotation is kept.
    pub translation_only: bool,
    /// Steps tried at most.
    pub max_steps: usize,
    /// A step that promises less than this part of χ² is the last one.
    pub least_gain: f64,
}

impl Search {
    /// To the minimum, up to rounding.
    pub const FULL: Self = Self { translation_only: false, max_steps: 40, least_gain: 1e-12 };
    /// Near enough to see whether a minimum can be a good one.
    pub const ROUGH: Self = Self { least_gain: 1e-3, ..Self::FULL };
    /// The translation that goes with a rotation.
    pub const TRANSLATION: Self = Self { translation_only: true, max_steps: 10, ..Self::FULL };
    /// A few steps towards it, before weights change.
    pub const SHORT: Self = Self { max_steps: 3, ..Self::FULL };
}

/// A pose that fits.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fit {
    pub camera_from_body: Isometry3<f64>,
    /// Weighted sum of squares in units of the errors.
    pub chi2: f64,
    /// What a twist about `centre` is known by: the inverse of its covariance.
    information: Matrix6<f64>,
    centre: Vector3<f64>,
}

/// The sum of squares around a pose to second order.
struct Quadratic {
    chi2: f64,
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    centre: Vector3<f64>,
}

impl Fit {
    /// Covariance of a twist on the left of the pose, `None` if some of it is not determined.
    pub fn covariance(&self) -> Option<Matrix6<f64>> {
        let there = Translation3::from(self.centre);
        let carried = lie::adjoint(&Isometry3::from(there));
        let covariance = carried * self.information.cholesky()?.inverse() * carried.transpose();
        let covariance = (covariance + covariance.transpose()) / 2.0;
        // Rounding spoils what is hardly determined; infinities have no factor either.
        covariance.cholesky().map(|_| covariance)
    }
}

/// The pose near `start` with the least weighted sum of squares (Levenberg and Marquardt), targets of weight 0 left
/// out. `None` if at `start` a target is outside the lens' field of view, or all weights are 0.
pub(crate) fn minimise(
    imaging: &Imaging<'_>,
    targets: &[Target],
    weights: &[f64],
    start: &Isometry3<f64>,
    search: Search,
) -> Option<Fit> {
    let Search { translation_only, max_steps, least_gain } = search;
    let middle = middle(targets, weights)?;
    let furthest_m = FURTHEST * extent_m(targets, weights, &middle);
    let around = |pose: &Isometry3<f64>| {
        let there = quadratic(imaging, targets, weights, pose, &middle, translation_only)?;
        (there.centre.norm() <= furthest_m).then_some(there)
    };
    let mut pose = *start;
    let mut here = around(&pose)?;
    let mut damping = FIRST_DAMPING;
    for _ in 0..max_steps {
        let mut damped = here.hessian;
        damped.set_diagonal(&(here.hessian.diagonal() * (1.0 + damping)));
        let Some(factor) = damped.cholesky() else { break };
        let step = -factor.solve(&here.gradient);
        let promised = -step.dot(&here.gradient);
        if promised.is_nan() || promised < CONVERGED.max(least_gain * here.chi2) {
            break;
        }
        let next_pose = disturbed(&pose, &here.centre, &step);
        match around(&next_pose).filter(|next| next.chi2 < here.chi2) {
            Some(next) => {
                (pose, here) = (next_pose, next);
                damping *= 0.05;
            }
            None if damping > MAX_DAMPING => break,
            None => damping = (damping * 10.0).max(FIRST_DAMPING),
        }
    }
    let information = match translation_only {
        false => here.hessian,
        true => quadratic(imaging, targets, weights, &pose, &middle, false)?.hessian,
    };
    Some(Fit { camera_from_body: pose, chi2: here.chi2, information, centre: here.centre })
}

/// The middle of the corners in the body's frame: rotation and translation are least correlated about it.
pub(crate) fn middle(targets: &[Target], weights: &[f64]) -> Option<Vector3<f64>> {
    let (mut sum, mut count) = (Vector3::zeros(), 0.0);
    for (target, _) in targets.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        sum += target.corners_m.iter().map(|corner| corner.coords).sum::<Vector3<f64>>();
        count += 4.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// How far corners are from their middle at most.
fn extent_m(targets: &[Target], weights: &[f64], middle: &Vector3<f64>) -> f64 {
    let used = targets.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
    let distances =
        used.flat_map(|(target, _)| &target.corners_m).map(|corner| (corner.coords - middle).norm());
    distances.fold(0.0, f64::max)
}

fn quadratic(
    imaging: &Imaging<'_>,
    targets: &[Target],
    weights: &[f64],
    pose: &Isometry3<f64>,
    middle: &Vector3<f64>,
    translation_only: bool,
) -> Option<Quadratic> {
    let centre = (pose * nalgebra::Point3::from(*middle)).coords;
    let view = imaging.at(pose);
    let pivot = view.about(&centre);
    let mut sum = Quadratic { chi2: 0.0, hessian: Matrix6::zeros(), gradient: Vector6::zeros(), centre };
    for (target, &weight) in targets.iter().zip(weights).filter(|(_, weight)| **weight > 0.0) {
        let (residual, jacobian) = view.linearised(target, &pivot)?;
        sum.chi2 += weight * residual.norm_squared();
        sum.hessian += jacobian.tr_mul(&jacobian) * weight;
        sum.gradient += jacobian.tr_mul(&residual) * weight;
    }
    if translation_only {
        sum.gradient.fixed_rows_mut::<3>(0).fill(0.0);
        sum.hessian.fixed_view_mut::<3, 3>(0, 3).fill(0.0);
        sum.hessian.fixed_view_mut::<3, 3>(3, 0).fill(0.0);
        sum.hessian.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
    }
    sum.chi2.is_finite().then_some(sum)
}
