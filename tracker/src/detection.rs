//! Tags found in an image.

use nalgebra::{SMatrix, Vector2};

use crate::family::Family;

/// The corners of a tag of size 1 in its own frame (x right, y up along the print), in the order in which all corners are
/// given: lower left, lower right, upper right, upper left. Seen from the front that is counter-clockwise.
pub const UNIT_CORNERS: [[f64; 2]; 4] = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];

/// The family and number of a tag.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct TagId {
    /// The family.
    pub family: Family,
    /// The number within the family.
    pub id: u32,
}

impl std::fmt::Display for TagId {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {}", self.family, self.id)
    }
}

/// A tag as a detector finds it.
#[derive(Clone, Debug, PartialEq)]
pub struct Detection {
    /// Which tag.
    pub tag: TagId,
    /// Its corners in the order of [`UNIT_CORNERS`], in camera coordinates: the centre of pixel (0, 0) is at (0, 0).
    pub corners_px: [Vector2<f64>; 4],
    /// Wrong bits that were corrected.
    pub hamming: u32,
    /// Mean difference of the bits' brightness from the threshold, in codes. Higher: more certain.
    pub margin: f32,
}

/// Where the corners of a tag are, and how well that is known: what poses are computed from.
#[derive(Clone, Debug, PartialEq)]
pub struct TagObservation {
    /// Which tag.
    pub tag: TagId,
    /// Its corners in the order of [`UNIT_CORNERS`], in camera coordinates.
    pub corners_px: [Vector2<f64>; 4],
    /// Covariance of the corners, in px², in the order x₀ y₀ x₁ y₁ ….
    pub covariance_px2: SMatrix<f64, 8, 8>,
}

impl TagObservation {
    /// The corners as the detector gives them, each known to `sigma_px` (standard deviation) in x and y, all independent
    /// of each other. What is not above zero is refused by the solvers.
    pub fn from_detection(detection: &Detection, sigma_px: f64) -> Self {
        let covariance_px2 = SMatrix::identity() * (sigma_px * sigma_px);
        Self { tag: detection.tag, corners_px: detection.corners_px, covariance_px2 }
    }
}
