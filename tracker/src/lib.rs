//! AprilTags: what they look like, and boards of them.
//!
//! | module | what is there |
//! | --- | --- |
//! | [`family`] | the tag families |
//! | [`bitmap`] | black and white cells of a tag |
//! | [`board`] | the board file: tags that are fixed to each other, on one sheet or in space |
//! | [`luma`] | the borrowed image that is looked at |
//! | [`detection`] | tags found in an image |
//! | [`detector`] | the AprilTag library, which finds them |
//! | [`refine`] | corners as exactly as the pixels tell |
//! | [`body`] | tags that are fixed to each other |
//! | [`planar`] | both poses of a single tag |
//! | [`pose`] | the pose of a body in one image |
//! | [`filter`] | poses without jitter and without lag |
//! | [`history`] | poses of the near past, at any moment in it |
//! | [`tracker`] | all of it together, from image to image |
//! | [`map`] | tags whose poses to each other are unknown, from many images |
//! | [`lie`] | exponential and logarithm of rigid motions |
//! | [`mod@print`] | tags on paper: PDF, SVG, PNG |

pub mod bitmap;
pub mod board;
pub mod body;
pub mod detection;
pub mod detector;
pub mod family;
pub mod filter;
pub mod history;
pub mod lie;
pub mod luma;
pub mod map;
pub mod planar;
pub mod pose;
pub mod print;
pub mod refine;
pub mod tracker;

pub use bitmap::{TagBitmap, TagError, tag_bitmap};
pub use board::{Board, BoardMistake, BoardProvenance, BoardTag};
pub use body::{Body, BodyError, BodyTag};
pub use detection::{Detection, TagId, TagObservation, UNIT_CORNERS};
pub use family::Family;
pub use luma::{Luma, LumaError};
pub use planar::{PlanarError, PlanarPose, planar_poses};
pub use pose::{BodyPose, Certainty, Past, PoseError, PoseEstimate, PoseSolver};
pub use tracker::{TrackedBody, TrackedTag, Tracker, TrackerError, TrackerSettings, Tracking};
