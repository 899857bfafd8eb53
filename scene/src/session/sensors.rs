//! Cameras, fish-eye, environment and depth camera of a session.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::placement::PoseSpec;

/// The see-through camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CameraSpec {
    /// `v4l:DEVICE`, `nokhwa:NUMBER`, `replay:FILE#STREAM`, `images:PATTERN` or `sim:WORLD#CAMERA`.
    #[schemars(length(min = 1))]
    pub source: String,
    /// Calibration file. Needed unless the source brings one along (`replay:`, `sim:`), and stronger than that one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// `world_from_camera` of a camera that stands still, on a tripod say: nothing is tracked then. Camera frame: x right,
    /// y down, z forward.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseSpec>,
    /// What the device is set to and held at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controls: Option<Controls>,
}

/// Settings that a session fixes, so that the radiance of its images stays comparable. Those left out are locked at what
/// the device has chosen when the session starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Controls {
    /// Image size to ask for, width and height.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 1, max = 16384)))]
    pub size_px: Option<[u32; 2]>,
    /// Images a second to ask for.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 1000))]
    pub frames_per_second: Option<f64>,
    /// Exposure time. Higher: brighter, more motion blur. Lower: darker, sharper.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0), range(max = 60))]
    pub exposure_s: Option<f64>,
    /// Factor on the signal, 1 = none. Higher: brighter, more noise. Lower: darker, less noise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gain: Option<f64>,
    /// Colour temperature. Higher: the image turns yellower. Lower: bluer.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1000, max = 40000))]
    pub white_balance_k: Option<f64>,
    /// Focus in the device's own steps.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus_steps: Option<i64>,
    /// Hold exposure, gain, white balance and focus. `false` leaves them to the device; every frame is then compensated,
    /// which is less exact.
    #[serde(default = "yes", skip_serializing_if = "Clone::clone")]
    #[schemars(extend("default" = true))]
    pub lock: bool,
}

impl Default for Controls {
    fn default() -> Self {
        Self {
            size_px: None,
            frames_per_second: None,
            exposure_s: None,
            gain: None,
            white_balance_k: None,
            focus_steps: None,
            lock: true,
        }
    }
}

/// The fish-eye camera that sees where the light comes from.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FisheyeSpec {
    /// As of `[camera]`.
    #[schemars(length(min = 1))]
    pub source: String,
    /// As of `[camera]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// What it is fixed to.
    pub mount: Mount,
    /// With `mount = "world"`: `world_from_fisheye`, or the pose in the frame of a tag on its housing. Camera frame: x
    /// right, y down, z forward. Left out: at the world's origin looking straight up, image right along world x.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pose: Option<PoseSpec>,
    /// What the device is set to and held at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controls: Option<Controls>,
    /// How far away the light is. Left out: infinitely far.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room: Option<RoomProxy>,
}

/// What a fish-eye is fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Mount {
    /// To the see-through camera: the rig file says how.
    Rig,
    /// To the room.
    World,
}

/// A panorama of the light instead of a fish-eye.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EnvironmentSpec {
    /// Equirectangular image, `.hdr` or `.exr`, upper edge up. Its middle column lies towards world +x,
    /// columns right of it towards −y (as in Blender).
    pub file: PathBuf,
    /// Turns it around the world's z axis, counter-clockwise seen from above.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schemars(extend("default" = 0))]
    pub yaw_deg: f64,
    /// Factor from the image's values to radiance (1 = code white of the see-through camera at its calibration
    /// exposure). Higher: more light.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    #[schemars(extend("default" = 1))]
    #[schemars(range(min = 0.0))]
    pub scale: f64,
    /// How far away the light is. Left out: infinitely far.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub room: Option<RoomProxy>,
}

/// A room around the world's origin that the light comes from, so that nearby light has parallax.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RoomProxy {
    /// Middle of the room.
    #[serde(default)]
    pub center_m: [f64; 3],
    /// Its form.
    #[serde(flatten)]
    pub form: RoomForm,
}

/// Form of a room proxy.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RoomForm {
    /// Lengths along x, y and z, metres.
    Box([f64; 3]),
    /// Radius, metres.
    Sphere(#[schemars(extend("exclusiveMinimum" = 0))] f64),
}

/// The depth camera. With one, the real scene needs no model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DepthSpec {
    /// As of `[camera]`.
    #[schemars(length(min = 1))]
    pub source: String,
    /// As of `[camera]`. Left out: the depth images are registered to the see-through camera's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// What the device is set to and held at.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub controls: Option<Controls>,
}

fn yes() -> bool {
    true
}

fn one() -> f64 {
    1.0
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

fn is_one(number: &f64) -> bool {
    *number == 1.0
}
