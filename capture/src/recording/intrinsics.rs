//! The lens data that other programs record beside their images.

use super::container::Encoding;
use super::error::RecordingError;
use super::reader::Reader;
use super::wire::Wire;
use foxglove::messages::CameraCalibration;
use prost::Message;

/// Most distortion coefficients that are read; models have up to 14.
const MAX_COEFFICIENTS: u32 = 100;

/// Lens data as ROS and Foxglove have it, for pixels whose centres are at whole numbers.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct RecordedIntrinsics {
    /// The topic it was found on.
    pub topic: String,
    /// Width of the images in pixels.
    pub width_px: u32,
    /// Height of the images in pixels.
    pub height_px: u32,
    /// Focal lengths and principal point: fx, fy, cx, cy in pixels.
    pub fx_fy_cx_cy_px: [f64; 4],
    /// The distortion model as it was written.
    pub distortion_model: String,
    /// Its coefficients, in the order they were written.
    pub distortion: Vec<f64>,
}

/// The topics that may hold the lens data of the images on `topic`.
fn candidates(topic: &str) -> Vec<String> {
    let parent = topic.rsplit_once('/').map_or("", |(parent, _)| parent);
    let mut topics: Vec<_> = ["camera_info", "calibration"].map(|name| format!("{parent}/{name}")).into();
    // RealSense: /device_0/sensor_0/Depth_0/image/data and /device_0/sensor_0/Depth_0/info/camera_info
    topics.extend(parent.strip_suffix("/image").map(|stream| format!("{stream}/info/camera_info")));
    topics
}

impl Reader {
    /// The lens data recorded beside each stream by whatever program; the next frame is then the first one again.
    ///
    /// # Errors
    /// [`RecordingError::Read`] if the disk fails.
    pub fn intrinsics(&mut self) -> Result<Vec<Option<RecordedIntrinsics>>, RecordingError> {
        let wanted: Vec<_> = self.streams().iter().map(|stream| candidates(&stream.topic)).collect();
        let mut found: Vec<Option<RecordedIntrinsics>> = vec![None; wanted.len()];
        let topics: Vec<String> = wanted.iter().flatten().cloned().collect();
        let there = self.container().channels().values().filter(|channel| topics.contains(&channel.topic));
        let mut missing = there.count();
        if missing == 0 {
            return Ok(found);
        }
        let channels: Vec<_> = self.container().channels().values().cloned().collect();
        let is_wanted = |topic: &str, schema: &str| {
            schema.contains("Camera") && topics.iter().any(|known| known == topic)
        };
        self.visit_topics(is_wanted, |topic, _, data| {
            let channel = channels.iter().find(|channel| channel.topic == topic);
            let info = channel.and_then(|channel| parse(&channel.encoding, topic, data));
            for (entry, topics) in found.iter_mut().zip(&wanted) {
                if entry.is_none() && topics.iter().any(|known| known == topic) && info.is_some() {
                    entry.clone_from(&info);
                    missing -= 1;
                }
            }
            missing > 0
        })?;
        Ok(found)
    }
}

fn parse(encoding: &Encoding, topic: &str, message: &[u8]) -> Option<RecordedIntrinsics> {
    match encoding {
        Encoding::Ros1 => ros1(topic, message),
        Encoding::Protobuf => {
            let message = CameraCalibration::decode(message).ok()?;
            let k: [f64; 9] = message.k.try_into().ok()?;
            Some(RecordedIntrinsics {
                topic: topic.to_owned(),
                width_px: message.width,
                height_px: message.height,
                fx_fy_cx_cy_px: from_matrix(k),
                distortion_model: message.distortion_model,
                distortion: message.d,
            })
        }
        Encoding::Cdr | Encoding::Other(_) => None,
    }
}

fn from_matrix([fx, _, cx, _, fy, cy, ..]: [f64; 9]) -> [f64; 4] {
    [fx, fy, cx, cy]
}

/// `sensor_msgs/CameraInfo`.
fn ros1(topic: &str, message: &[u8]) -> Option<RecordedIntrinsics> {
    let mut wire = Wire::new(message);
    wire.take(12)?;
    let _frame_id = wire.block()?;
    let (height_px, width_px) = (wire.u32()?, wire.u32()?);
    let distortion_model = wire.text()?.to_owned();
    let count = wire.u32().filter(|&count| count <= MAX_COEFFICIENTS)?;
    let distortion = (0..count).map(|_| wire.f64()).collect::<Option<Vec<_>>>()?;
    let mut k = [0.0; 9];
    for entry in &mut k {
        *entry = wire.f64()?;
    }
    let (topic, fx_fy_cx_cy_px) = (topic.to_owned(), from_matrix(k));
    Some(RecordedIntrinsics { topic, width_px, height_px, fx_fy_cx_cy_px, distortion_model, distortion })
}
