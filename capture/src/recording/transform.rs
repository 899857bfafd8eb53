//! Poses in a recording, on the topic `/tf`.

use foxglove::messages::{FrameTransform, Quaternion, Vector3};
use prost::Message;

use super::error::RecordingError;
use super::reader::Reader;
use super::writer::stamp;
use crate::clock::Timestamp;

/// `parent_from_child`: the pose of one frame in another at a time.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedTransform {
    /// When it was so.
    pub stamp: Timestamp,
    /// The frame that the pose is given in, such as `world`.
    pub parent: String,
    /// The frame whose pose it is, such as `camera`: the name of a stream for its camera.
    pub child: String,
    /// Where the child's origin is in the parent's frame, in metres.
    pub translation_m: [f64; 3],
    /// How the child is turned in the parent's frame: a unit quaternion x, y, z, w.
    pub rotation_xyzw: [f64; 4],
}

impl RecordedTransform {
    pub(super) fn message(&self) -> FrameTransform {
        let [x, y, z] = self.translation_m;
        let translation = Some(Vector3 { x, y, z });
        let [x, y, z, w] = self.rotation_xyzw;
        FrameTransform {
            timestamp: Some(stamp(self.stamp)),
            parent_frame_id: self.parent.clone(),
            child_frame_id: self.child.clone(),
            translation,
            rotation: Some(Quaternion { x, y, z, w }),
        }
    }

    fn from_message(message: FrameTransform, stamp: Timestamp) -> Option<Self> {
        let (translation, rotation) = (message.translation?, message.rotation?);
        Some(Self {
            stamp,
            parent: message.parent_frame_id,
            child: message.child_frame_id,
            translation_m: [translation.x, translation.y, translation.z],
            rotation_xyzw: [rotation.x, rotation.y, rotation.z, rotation.w],
        })
    }
}

impl Reader {
    /// All poses of the recording in their order; the next frame is then the first one again.
    ///
    /// # Errors
    /// [`RecordingError::Read`] if the disk fails. Damaged chunks and messages are skipped here.
    pub fn transforms(&mut self) -> Result<Vec<RecordedTransform>, RecordingError> {
        let mut found = Vec::new();
        let is_transform = |_: &str, schema: &str| schema == "foxglove.FrameTransform";
        self.visit_topics(is_transform, |_, logged, data| {
            let message = FrameTransform::decode(data).ok();
            found.extend(message.and_then(|message| RecordedTransform::from_message(message, logged)));
            true
        })?;
        Ok(found)
    }
}
