//! What the tracker holds on to.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::placement::{Placement, Tag};

/// Tracking of the see-through camera by AprilTags.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrackingSpec {
    /// What the world is fixed to.
    pub anchor: Anchor,
    /// More tags that may be followed, beside those that things and lights are attached to.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<Tag>,
    /// Take jitter out of measured poses. Never predicts: the image that was tracked is the one that is drawn into.
    #[serde(default = "yes", skip_serializing_if = "Clone::clone")]
    #[schemars(extend("default" = true))]
    pub filter: bool,
}

/// A board or a tag, and how it lies in the world.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Anchor {
    /// What is looked for.
    #[serde(flatten)]
    pub target: AnchorTarget,
    /// How it lies: `world_from_anchor`.
    #[serde(default)]
    pub up: Up,
}

/// What the world is fixed to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum AnchorTarget {
    /// A printed board.
    Board {
        /// File that describes the board. Relative to the session file.
        board: PathBuf,
    },
    /// A single tag.
    Tag(Tag),
}

/// `world_from_anchor`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum Up {
    /// By name.
    Named(NamedUp),
    /// Given.
    Pose(Placement),
}

/// The usual ways to lay an anchor.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum NamedUp {
    /// The print lies flat: its z is the world's.
    #[default]
    Z,
    /// The print stands upright: its y is the world's z.
    Y,
    /// The largest horizontal plane of the depth image or map is level.
    Plane,
}

impl Default for Up {
    fn default() -> Self {
        Self::Named(NamedUp::default())
    }
}

fn yes() -> bool {
    true
}
