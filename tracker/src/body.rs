//! Tags that are fixed to each other.

use std::collections::HashSet;
use std::ops::RangeInclusive;

use nalgebra::{Isometry3, Point3};

use crate::detection::{TagId, UNIT_CORNERS};

/// What sizes of tags are lengths of anything that is printed and seen, in metres.
pub const SIZE_RANGE_M: RangeInclusive<f64> = 1e-6..=100.0;
/// Tags further than this from the body's origin are mistakes: beyond it corners lose micrometres to rounding.
const MAX_DISTANCE_M: f64 = 1e6;

/// A rigid thing that carries tags: a board, a cube with tags on its faces, a single tag, or a mapped room.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// What messages and tables call it.
    pub name: String,
    /// Its tags, each once.
    pub tags: Vec<BodyTag>,
}

/// One tag of a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyTag {
    /// Which tag.
    pub tag: TagId,
    /// Side of the square through its four detected corners (tag36h11: outer edge of the black border).
    pub size_m: f64,
    /// Tag to body frame. Tag frame: x right, y up along the print, z out of the paper, origin at its centre.
    pub body_from_tag: Isometry3<f64>,
}

/// Why tags are no rigid thing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// A size that is no length.
    #[error("{body}: size of {tag}: {size_m} m; it must be from {} to {} m", SIZE_RANGE_M.start(), SIZE_RANGE_M.end())]
    Size {
        /// Name of the body.
        body: String,
        /// The tag.
        tag: TagId,
        /// Its size.
        size_m: f64,
    },
    /// A pose that is no place.
    #[error("{body}: pose of {tag}: its numbers must be finite and within {MAX_DISTANCE_M} m of the origin")]
    Pose {
        /// Name of the body.
        body: String,
        /// The tag.
        tag: TagId,
    },
    /// The same tag twice.
    #[error("{body}: {tag} is there twice; every tag is there once")]
    Twice {
        /// Name of the body.
        body: String,
        /// The tag.
        tag: TagId,
    },
}

impl BodyTag {
    /// The corners in the body's frame, in the order of [`UNIT_CORNERS`].
    pub fn corners_m(&self) -> [Point3<f64>; 4] {
        UNIT_CORNERS.map(|[x, y]| self.body_from_tag * Point3::new(x * self.size_m, y * self.size_m, 0.0))
    }
}

impl Body {
    /// A single tag, whose frame is the body's.
    pub fn single(tag: TagId, size_m: f64) -> Self {
        let body_from_tag = Isometry3::identity();
        Self { name: tag.to_string(), tags: vec![BodyTag { tag, size_m, body_from_tag }] }
    }

    /// Whether a pose can be computed from it.
    ///
    /// # Errors
    /// [`BodyError`] naming the first tag whose size or pose is impossible, or that is there twice.
    pub fn check(&self) -> Result<(), BodyError> {
        let mut known = HashSet::new();
        for &BodyTag { tag, size_m, body_from_tag } in &self.tags {
            let body = || self.name.clone();
            if !SIZE_RANGE_M.contains(&size_m) {
                return Err(BodyError::Size { body: body(), tag, size_m });
            }
            let near = body_from_tag.translation.vector.amax() <= MAX_DISTANCE_M;
            // NaN is neither near nor of length 1.
            let turned = (body_from_tag.rotation.norm() - 1.0).abs() < 1e-6;
            if !(near && turned && body_from_tag.translation.vector.iter().all(|x| x.is_finite())) {
                return Err(BodyError::Pose { body: body(), tag });
            }
            if !known.insert(tag) {
                return Err(BodyError::Twice { body: body(), tag });
            }
        }
        Ok(())
    }

    /// Its tag of that name.
    pub fn tag(&self, tag: TagId) -> Option<&BodyTag> {
        self.tags.iter().find(|own| own.tag == tag)
    }
}
