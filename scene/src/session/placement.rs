//! Where things are, as written in a session.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Where a thing or a light is: in the world, or attached to something that is tracked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "in", rename_all = "lowercase")]
pub enum PoseSpec {
    /// Fixed in the world: right-handed, +Z up, metres.
    World {
        /// Place and orientation.
        #[serde(flatten)]
        placement: Placement,
    },
    /// Attached to one tag. Its frame: x right, y up along the print, z out of the paper, origin at its centre.
    Marker {
        /// The tag.
        #[serde(flatten)]
        tag: Tag,
        /// Place and orientation in the tag's frame.
        #[serde(flatten)]
        placement: Placement,
    },
    /// Attached to a rigid body with several tags.
    Body {
        /// File that says where its tags are, written as a board. Relative to the session file.
        body: PathBuf,
        /// Place and orientation in the body's frame.
        #[serde(flatten)]
        placement: Placement,
    },
    /// Attached to a printed board. Its frame: as a tag's.
    Board {
        /// File that describes the board. Relative to the session file.
        board: PathBuf,
        /// Place and orientation in the board's frame.
        #[serde(flatten)]
        placement: Placement,
    },
}

impl Default for PoseSpec {
    fn default() -> Self {
        Self::World { placement: Placement::default() }
    }
}

impl PoseSpec {
    /// Place and orientation in whatever it is attached to.
    pub fn placement(&self) -> &Placement {
        match self {
            Self::World { placement }
            | Self::Marker { placement, .. }
            | Self::Body { placement, .. }
            | Self::Board { placement, .. } => placement,
        }
    }

    /// True if it needs a tracker.
    pub fn is_tracked(&self) -> bool {
        !matches!(self, Self::World { .. })
    }
}

/// One AprilTag.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Tag {
    /// Tag family, such as `tag36h11`.
    pub family: String,
    /// Number of the tag within its family.
    pub id: u32,
    /// Side of the square through the tag's four detected corners (tag36h11: outer edge of the black border).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub size_m: f64,
}

/// Place, orientation and size in a frame. At most one of `rotation_deg`, `quaternion_xyzw`, `axis_angle` and
/// `look_at_m` is given; without any it is not turned.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Placement {
    /// Where its origin is.
    #[serde(default, skip_serializing_if = "is_origin")]
    #[schemars(extend("default" = [0, 0, 0]))]
    pub position_m: [f64; 3],
    /// Turned about the fixed x axis first, then about the fixed y, then about the fixed z axis: R = Rz·Ry·Rx
    /// (Blender's "XYZ Euler").
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation_deg: Option<[f64; 3]>,
    /// Unit quaternion, real part last. Normalised if its length is within 1 ± 0.001.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion_xyzw: Option<[f64; 4]>,
    /// An axis and the angle around it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis_angle: Option<AxisAngle>,
    /// A point of the frame that its +z axis is aimed at: where a camera looks, where a lamp shines. Its +x axis is level
    /// and its +y axis points down, so that a camera's image is upright; aimed straight up or down, +x is the frame's x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub look_at_m: Option<[f64; 3]>,
    /// Factor on all lengths of the thing; 1 if left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub scale: Option<f64>,
}

/// A rotation by an angle around an axis, counter-clockwise seen against the axis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct AxisAngle {
    /// Of any length but zero.
    pub axis: [f64; 3],
    /// Around it.
    pub angle_deg: f64,
}

fn is_origin(position_m: &[f64; 3]) -> bool {
    *position_m == [0.0; 3]
}
