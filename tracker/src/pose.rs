//! The pose of a body in one image, from the corners of its tags.
//!
//! All tags together, by robust non-linear least squares in pixels of the image itself, through its lens; started from
//! both [planar poses](crate::planar) of the largest tags. A flat body that is small in the image has two poses that fit:
//! both are followed, and a pose is only called [`Certainty::Clear`] if the other one is ruled out.
//!
//! | module | what is there |
//! | --- | --- |
//! | `residuals` | errors of corners, and their derivatives |
//! | `rolling` | poses of rows that are exposed one after the other |
//! | `least_squares` | Levenberg–Marquardt |
//! | `consensus` | which tags agree |
//! | `mirror` | the other pose of a flat thing |
//! | `decision` | which of two poses is true |
//! | `report` | what is said about a pose |

pub(crate) mod chi_squared;
pub(crate) mod consensus;
mod decision;
pub(crate) mod least_squares;
pub(crate) mod mirror;
mod report;
pub(crate) mod residuals;
mod rolling;
mod solver;

use nalgebra::{Isometry3, Matrix6};

pub use report::{BodyPose, Certainty, Misfit, PoseEstimate, Rejected, Rejection};
pub use solver::PoseSolver;

/// What earlier frames say about a pose. All of it may be left out.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Past {
    /// Where the body should be now; decides between two poses that fit alike.
    pub expected: Option<Expected>,
    /// Where it was; needed to take rows that are exposed one after the other for what they are.
    pub before: Option<Before>,
}

/// A pose that was predicted from earlier frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// Body to camera frame, at this frame's time stamp.
    pub camera_from_body: Isometry3<f64>,
    /// Covariance of a twist on its left (see [`crate::lie`]). The smaller, the more it decides.
    pub covariance: Matrix6<f64>,
}

/// A pose of an earlier frame, near enough that the motion since then was steady.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Before {
    /// Body to camera frame, at that frame's time stamp.
    pub camera_from_body: Isometry3<f64>,
    /// Time from that frame's stamp to this one's, above 0.
    pub elapsed_s: f64,
}

/// Why there is no pose.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseError {
    /// No observation can be used.
    #[error("no usable tag of {body} in view{}", list(rejected))]
    NoTag {
        /// Name of the body.
        body: String,
        /// What is wrong with the observations.
        rejected: Vec<Rejected>,
    },
    /// The solver found no pose at all.
    #[error("no pose of {body} fits its {tags} observed tags")]
    NoFit {
        /// Name of the body.
        body: String,
        /// How many observations there are.
        tags: usize,
    },
    /// The expected pose is not finite, or its covariance not positive definite.
    #[error("the expected pose of {body} must be finite, and its covariance positive definite")]
    Expected {
        /// Name of the body.
        body: String,
    },
    /// The earlier pose is not finite or not earlier.
    #[error("the pose of {body} before must be finite, and its time earlier ({elapsed_s} s)")]
    Before {
        /// Name of the body.
        body: String,
        /// Time that has elapsed.
        elapsed_s: f64,
    },
    /// The shutter is impossible.
    #[error("rolling shutter of {readout_s} s over {height_px} rows: it must take from 0 to 1 s")]
    Shutter {
        /// Time from the first row to the last.
        readout_s: f64,
        /// Rows of the image.
        height_px: u32,
    },
}

/// The first few in words.
fn list(rejected: &[Rejected]) -> String {
    const SHOWN: usize = 5;
    let shown = rejected.iter().take(SHOWN).map(|Rejected { tag, reason, .. }| format!("{tag}: {reason}"));
    let shown: Vec<String> = shown.collect();
    match rejected.len() {
        0 => String::new(),
        1..=SHOWN => format!(" ({})", shown.join("; ")),
        count => format!(" ({}; and {} more)", shown.join("; "), count - SHOWN),
    }
}
