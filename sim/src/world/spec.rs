//! What a world file says.

use std::collections::BTreeMap;
use std::path::PathBuf;

use coshade_scene::session::light::LightSpec;
use coshade_scene::session::placement::{Placement, Tag};
use coshade_scene::session::sensors::EnvironmentSpec;
use coshade_scene::session::thing::ThingSpec;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::faults::FaultSpec;
use crate::sensor::{DepthSpec, FormatSpec};
use crate::tracer::TraceSpec;

/// A world and the sensors that see it: the truth that a session tries to find out. Every path is relative to this file.
/// Metres and seconds; +Z is up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorldSpec {
    /// Version of this format.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// Starts noise, jitter and faults. The same seed gives the same bytes.
    #[serde(default)]
    #[schemars(range(max = 9_007_199_254_740_992_u64))]
    pub seed: u64,
    /// How long the sensors look.
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 36000))]
    pub duration_s: f64,
    /// Light from all around.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub environment: Option<EnvironmentSpec>,
    /// Things. Cameras see the real ones; virtual ones are there for the truth that a composite is compared with.
    #[serde(default, rename = "thing", skip_serializing_if = "Vec::is_empty")]
    pub things: Vec<ThingSpec>,
    /// Lights, as things.
    #[serde(default, rename = "light", skip_serializing_if = "Vec::is_empty")]
    pub lights: Vec<LightSpec>,
    /// Printed AprilTags. Things and lights may be attached to them.
    #[serde(default, rename = "tag", skip_serializing_if = "Vec::is_empty")]
    pub tags: Vec<TagSpec>,
    /// Printed boards of AprilTags.
    #[serde(default, rename = "board", skip_serializing_if = "Vec::is_empty")]
    pub boards: Vec<BoardSpec>,
    /// The way of the rig. Left out: it stays at the world's origin.
    #[serde(default, rename = "keyframe", skip_serializing_if = "Vec::is_empty")]
    pub keyframes: Vec<KeyframeSpec>,
    /// By the names that a session and its rig file use: `camera`, `fisheye`, `depth`.
    #[serde(rename = "sensor")]
    pub sensors: BTreeMap<String, SensorSpec>,
    /// How carefully light is traced.
    #[serde(default)]
    pub trace: TraceSpec,
}

/// A printed tag: a thin sheet, black of albedo 0.04 on white of albedo 0.85. Leave some tenths of a millimetre between it
/// and the surface it lies on.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TagSpec {
    /// Which, and how large.
    #[serde(flatten)]
    pub tag: Tag,
    /// Where. Tag frame: x right, y up along the print, z out of the paper, origin at its centre.
    #[serde(default)]
    pub pose: Placement,
}

/// A printed board; its tags as [`TagSpec`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoardSpec {
    /// Board file.
    pub file: PathBuf,
    /// Where. Board frame: x right, y up along the print, z out of the paper, origin at its centre.
    #[serde(default)]
    pub pose: Placement,
}

/// A place that the rig passes. Between them it moves with continuous acceleration. Rig frame: x right, y down, z forward.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct KeyframeSpec {
    /// When.
    #[schemars(range(min = -36000, max = 36000))]
    pub time_s: f64,
    /// Where the rig's origin is.
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub position_m: [f64; 3],
    /// What it looks at, upright. Give this or `quaternion_xyzw`; without either it looks along world +y.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub look_at_m: Option<[f64; 3]>,
    /// How it is turned: unit quaternion, real part last. Normalised if its length is within 1 ± 0.001.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion_xyzw: Option<[f64; 4]>,
}

/// What a sensor is fixed to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum MountSpec {
    /// The rig.
    #[default]
    Rig,
    /// The room.
    World,
}

/// A sensor as it truly is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorSpec {
    /// Its true calibration: lens, image size, read-out time, response, vignetting, noise, colours. Give this, or `size_px`
    /// and `fov_deg`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// Image size of a sensor without distortion, vignetting and noise, of sRGB response (linear for `rgbf32`).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 1, max = 16384)))]
    pub size_px: Option<[u32; 2]>,
    /// Its field of view across the width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1.0, max = 359.0))]
    pub fov_deg: Option<f64>,
    /// What it is fixed to.
    #[serde(default)]
    pub mount: MountSpec,
    /// Where it is on the rig or in the room. Sensor frame: x right, y down, z forward.
    #[serde(default)]
    pub pose: Placement,
    /// What it delivers; `z16` makes it a depth camera.
    #[serde(default)]
    pub format: FormatSpec,
    /// Errors of a depth camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthSpec>,
    /// Rate.
    #[serde(default = "thirty")]
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 1000))]
    pub frames_per_second: f64,
    /// When its first frame is exposed.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 36000))]
    pub phase_s: f64,
    /// What must be added to its stamps to get the session's clock, as in a rig file.
    #[serde(default)]
    #[schemars(range(min = -5_000_000_000_i64, max = 5_000_000_000_i64))]
    pub time_offset_ns: i64,
    /// Standard deviation of its stamps.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub jitter_s: f64,
    /// From the exposure of a frame to its arrival.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub delay_s: f64,
    /// Of a rolling shutter: the image is traced in so many bands of rows, each with a pose of its own. Higher: more exact.
    #[serde(default = "sixty_four")]
    #[schemars(range(min = 1, max = 16384))]
    pub shutter_bands: u32,
    /// Exposure time that the calibration holds for, and that the sensor starts with.
    #[serde(default = "hundredth")]
    #[schemars(range(min = 1e-5, max = 1.0))]
    pub exposure_s: f64,
    /// Gain that the calibration holds for, and that the sensor starts with.
    #[serde(default = "one")]
    #[schemars(range(min = 0.01, max = 100.0))]
    pub gain: f64,
    /// White balance that the calibration holds for, and that the sensor starts with.
    #[serde(default = "daylight")]
    #[schemars(range(min = 1000, max = 40000))]
    pub white_balance_k: f64,
    /// Frames from setting a control to the first frame that shows it.
    #[serde(default)]
    #[schemars(range(max = 1000))]
    pub control_latency_frames: u32,
    /// What goes wrong with it.
    #[serde(default, rename = "fault", skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<FaultSpec>,
}

fn thirty() -> f64 {
    30.0
}

fn sixty_four() -> u32 {
    64
}

fn hundredth() -> f64 {
    0.01
}

fn one() -> f64 {
    1.0
}

fn daylight() -> f64 {
    5000.0
}
