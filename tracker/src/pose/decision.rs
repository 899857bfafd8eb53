//! Which of two poses is the true one, and how sure that is.

use nalgebra::{Isometry3, Matrix6};

use super::chi_squared::{ONE_IN_1E4, limit};
use super::{Certainty, Expected, PoseEstimate};
use crate::lie;

/// Probability of the other pose below which it is ruled out.
const FLIP_PROBABILITY: f64 = 1e-4;
/// Poses closer than this in rotation are not told apart: the thing faces the camera, and how it leans is noise.
const ONE_POSE_RAD: f64 = 0.0175;

/// Two poses that might both be true.
pub(crate) struct Rivals {
    /// The one that fits better.
    pub best: PoseEstimate,
    pub other: PoseEstimate,
    /// Whether they rest on different observations of one tag, so that they are not two views of one thing.
    pub contested: bool,
}

impl Rivals {
    /// The pose, and how sure it is.
    ///
    /// With normal errors the odds between both are exp(Δχ²/2). Where the better one fits worse than the corners' errors
    /// allow, something else is wrong as well, and Δχ² counts in units of that misfit. If the odds do not decide, the
    /// past does, as one more measurement: of both poses, one must be near what is expected and the other not.
    pub fn decide(self, expected: Option<&Expected>) -> (PoseEstimate, Certainty) {
        let Self { best, other, .. } = &self;
        let decisive = 2.0 * ((1.0 - FLIP_PROBABILITY) / FLIP_PROBABILITY).ln();
        let by_fit = (other.chi2 - best.chi2) / best.variance_factor();
        if by_fit >= decisive || self.is_one_pose() {
            return (self.best, Certainty::Clear);
        }
        let distance = |pose: &PoseEstimate| expected.and_then(|expected| expected.distance(pose));
        let (Some(to_best), Some(to_other)) = (distance(best), distance(other)) else {
            return (self.best, Certainty::Ambiguous { other: Box::new(self.other) });
        };
        let for_best = by_fit + to_other - to_best;
        let nearer = to_best.min(to_other);
        let (pose, other) = if for_best >= 0.0 { (self.best, self.other) } else { (self.other, self.best) };
        let other = Box::new(other);
        if for_best.abs() >= decisive && nearer <= limit(6.0, ONE_IN_1E4) {
            return (pose, Certainty::ByPast { other });
        }
        (pose, Certainty::Ambiguous { other })
    }

    fn is_one_pose(&self) -> bool {
        let (a, b) = (&self.best, &self.other);
        if self.contested {
            let apart =
                squared_distance(&a.camera_from_body, &b.camera_from_body, &(a.covariance + b.covariance));
            return apart.is_some_and(|apart| apart <= limit(6.0, ONE_IN_1E4));
        }
        a.camera_from_body.rotation.angle_to(&b.camera_from_body.rotation) < ONE_POSE_RAD
    }
}

impl Expected {
    /// Squared Mahalanobis distance of a pose: χ² with six degrees of freedom if it is the expected one.
    fn distance(&self, pose: &PoseEstimate) -> Option<f64> {
        squared_distance(&pose.camera_from_body, &self.camera_from_body, &(self.covariance + pose.covariance))
    }
}

fn squared_distance(a: &Isometry3<f64>, b: &Isometry3<f64>, covariance: &Matrix6<f64>) -> Option<f64> {
    let twist = lie::log(&(a * b.inverse()));
    let distance = twist.dot(&covariance.cholesky()?.solve(&twist));
    distance.is_finite().then_some(distance)
}
