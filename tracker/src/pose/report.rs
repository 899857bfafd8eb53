//! What a solver says about a pose.

use std::fmt;

use nalgebra::{Isometry3, Matrix6};

use super::chi_squared::{ONE_IN_1E3, ONE_IN_1E6, limit};
use super::mirror::angle_rad;
use crate::detection::TagId;
use crate::planar::PlanarError;

/// Errors beyond this part of a tag's side are no matter of print and lens.
const MISFIT_OF_SIDE: f64 = 0.01;
/// Errors beyond this are not either, however large the tags are.
const MISFIT_PX: f64 = 1.0;

/// A pose and how well it is known.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseEstimate {
    /// Body to camera frame, at the frame's time stamp.
    pub camera_from_body: Isometry3<f64>,
    /// Covariance of δ in `exp(δ) * camera_from_body` (see [`crate::lie`]): rotation vector in radians, then translation
    /// in metres, along the camera's axes. From the corners' covariance; enlarged by [`reduced_chi2`](Self::reduced_chi2)
    /// if the corners fit worse than theirs allows, once in a thousand.
    pub covariance: Matrix6<f64>,
    /// Sum of squares of the corners' errors in units of their covariance.
    pub chi2: f64,
    /// Corner coordinates that are used, less the six numbers of the pose.
    pub degrees_of_freedom: u32,
    /// Root mean square distance of the corners from where the pose puts them, in pixels of the image.
    pub rms_px: f64,
}

impl PoseEstimate {
    /// χ² per degree of freedom: about 1 if the corners' covariances are right, and body and lens too.
    pub fn reduced_chi2(&self) -> f64 {
        self.chi2 / f64::from(self.degrees_of_freedom.max(1))
    }

    /// By which factor χ² is more than it should be, 1 at least.
    pub(crate) fn variance_factor(&self) -> f64 {
        self.reduced_chi2().max(1.0)
    }

    /// Whether errors of the stated size are that large less than once in a thousand.
    pub(crate) fn fits_badly(&self) -> bool {
        self.chi2 > limit(f64::from(self.degrees_of_freedom.max(1)), ONE_IN_1E3)
    }
}

/// Whether the pose could be another.
#[derive(Clone, Debug, PartialEq)]
pub enum Certainty {
    /// No other pose fits: the odds against are above 10⁴.
    Clear,
    /// Another pose fits as well, and what was expected decided between them.
    ByPast {
        /// The other.
        other: Box<PoseEstimate>,
    },
    /// Another pose fits as well, and nothing decides between them. The first is the more probable one.
    Ambiguous {
        /// The other.
        other: Box<PoseEstimate>,
    },
}

impl Certainty {
    /// The other pose, unless it is ruled out by the image.
    pub fn other(&self) -> Option<&PoseEstimate> {
        match self {
            Self::Clear => None,
            Self::ByPast { other } | Self::Ambiguous { other } => Some(other),
        }
    }

    /// Whether nothing decides between two poses.
    pub fn is_ambiguous(&self) -> bool {
        matches!(self, Self::Ambiguous { .. })
    }
}

/// An observation that a pose does not rest on.
#[derive(Clone, Debug, PartialEq)]
pub struct Rejected {
    /// Which tag.
    pub tag: TagId,
    /// Where in the list of observations.
    pub index: usize,
    /// Why.
    pub reason: Rejection,
}

/// Why an observation is not used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Rejection {
    /// The body has no such tag.
    #[error("not a tag of the body")]
    Unknown,
    /// The tag is in view twice, and another observation of it fits better.
    #[error("in view more than once; another one fits better")]
    Duplicate,
    /// It is not where the other tags say: moved, or a false detection.
    #[error("{rms_px:.1} px from where the other tags put it")]
    Outlier {
        /// Root mean square distance of its corners from there; infinite if that is outside the field of view.
        rms_px: f64,
    },
    /// Its corners give no pose.
    #[error(transparent)]
    Unusable(#[from] PlanarError),
}

/// Tags that do not fit their body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Misfit {
    /// Root mean square distance of the corners from where the pose puts them.
    pub rms_px: f64,
    /// χ² per degree of freedom.
    pub reduced_chi2: f64,
}

impl fmt::Display for Misfit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { rms_px, reduced_chi2 } = self;
        write!(
            f,
            "tags do not fit the body: rms {rms_px:.2} px, {:.1} times the corners' errors; check sizes, positions and \
             the lens",
            reduced_chi2.sqrt()
        )
    }
}

impl Misfit {
    /// Whether tags of about `side_px` fit so badly that body or lens must be wrong.
    pub(crate) fn of(estimate: &PoseEstimate, side_px: f64) -> Option<Self> {
        let PoseEstimate { chi2, degrees_of_freedom, rms_px, .. } = *estimate;
        let beyond_noise = chi2 > limit(f64::from(degrees_of_freedom.max(1)), ONE_IN_1E6);
        let visible = rms_px > (MISFIT_OF_SIDE * side_px).min(MISFIT_PX);
        (beyond_noise && visible).then(|| Self { rms_px, reduced_chi2: estimate.reduced_chi2() })
    }
}

/// The pose of a body in one image.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyPose {
    /// The pose.
    pub estimate: PoseEstimate,
    /// Whether it could be another.
    pub certainty: Certainty,
    /// The tags it rests on.
    pub used: Vec<TagId>,
    /// The observations it does not rest on.
    pub rejected: Vec<Rejected>,
    /// Set if its tags fit so badly that the body's description or the lens must be wrong.
    pub misfit: Option<Misfit>,
}

impl BodyPose {
    /// The rotation between the pose and the other one that might be true, if there is one: a tag that nearly faces the
    /// camera is ambiguous by a few degrees, which noise would make anyway; a small one that leans, by tens of degrees.
    pub fn ambiguity_rad(&self) -> Option<f64> {
        let other = self.certainty.other()?;
        Some(angle_rad(&self.estimate.camera_from_body, &other.camera_from_body))
    }
}
