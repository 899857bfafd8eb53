//! The rig file: where the cameras of a rig sit to each other, and how their clocks differ.

use std::collections::BTreeMap;
use std::path::Path;

use coshade_config::{Document, Error, KeyPath};
use glam::DQuat;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::session::{PlacementError, unit_quaternion};

/// Cameras that are fixed to each other. The rig's own frame is arbitrary; usually it is the see-through camera's.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Rig {
    /// Version of this format.
    #[schemars(range(min = 1, max = 1))]
    pub version: u32,
    /// By the names that the session uses: `camera`, `fisheye`, `depth`.
    #[serde(rename = "sensor")]
    pub sensors: BTreeMap<String, RigSensor>,
    /// How it was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub provenance: Option<RigProvenance>,
}

/// One camera of a rig: `rig_from_sensor`, and its timing. Sensor frame: x right, y down, z forward.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RigSensor {
    /// Where the sensor's origin is in the rig's frame.
    #[serde(default)]
    pub position_m: [f64; 3],
    /// Unit quaternion from the sensor's to the rig's frame, real part last. Normalised if its length is within
    /// 1 ± 0.001.
    #[serde(default = "no_rotation")]
    pub quaternion_xyzw: [f64; 4],
    /// What to add to the sensor's time stamps to get the session's clock.
    #[serde(default)]
    pub time_offset_ns: i64,
    /// Rolling shutter: from the exposure of the first row to that of the last. 0: global shutter.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub readout_s: f64,
}

/// How a rig was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RigProvenance {
    /// Program and version.
    pub tool: String,
    /// Date and time, RFC 3339.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub when: Option<String>,
    /// Images or recordings it was made from.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<String>,
    /// Root mean square distance between detected and reprojected corners.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0))]
    pub rms_px: Option<f64>,
    /// Anything else worth knowing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub notes: Option<String>,
}

fn no_rotation() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

impl Rig {
    /// Reads a rig file.
    ///
    /// # Errors
    /// [`Error::Invalid`] with all problems at once, each with its place; other variants if it cannot be read.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::read(path)?)
    }

    /// As [`Rig::read`] from a text; `path` is the file that messages name.
    ///
    /// # Errors
    /// As [`Rig::read`].
    pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::consistent(Document::parse(text, path)?)
    }

    /// Writes a rig file, whole or not at all; one that is there already is replaced.
    ///
    /// # Errors
    /// [`Error::Unwritable`] for a value such as NaN, [`Error::Invalid`] for one that could not be read again,
    /// [`Error::Write`].
    pub fn save(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        let path = path.as_ref();
        let mut document = Document::new(self, path)?;
        document.save_as(path)?;
        Ok(())
    }

    fn consistent(document: Document<Self>) -> Result<Self, Error> {
        let mut problems = Vec::new();
        for (name, sensor) in &document.value().sensors {
            if let Err(error) = unit_quaternion(sensor.quaternion_xyzw) {
                let at = KeyPath::root().key("sensor").key(name).key("quaternion_xyzw");
                problems.push(document.error_at(&at, error.to_string(), ""));
            }
        }
        Document::<Self>::reject(problems)?;
        Ok(document.into_value())
    }
}

impl RigSensor {
    /// Unit quaternion of `rig_from_sensor`.
    ///
    /// # Errors
    /// [`PlacementError::NotUnit`], which [`Rig::read`] rules out.
    pub fn rotation(&self) -> Result<DQuat, PlacementError> {
        unit_quaternion(self.quaternion_xyzw)
    }
}
