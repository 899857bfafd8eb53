//! Tags that are fixed to each other.

use nalgebra::{Isometry3, Point3};

use crate::detection::{TagId, UNIT_CORNERS};

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

    /// Its tag of that name.
    pub fn tag(&self, tag: TagId) -> Option<&BodyTag> {
        self.tags.iter().find(|own| own.tag == tag)
    }
}
