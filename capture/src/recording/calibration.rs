//! A calibration in a recording: for viewers as Foxglove has it, and complete as our own file.

use coshade_config::Document;
use coshade_lens::calibration::{Calibration, CalibrationError};
use coshade_lens::model::ModelKind;
use foxglove::messages::CameraCalibration;

use super::error::RecordingError;
use super::reader::Reader;
use super::stream::attachment_name;
use super::writer::stamp;
use crate::clock::Timestamp;

/// Foxglove's and ROS's name of a lens model; their own names for models that those do not know.
///
/// Coefficients are in the order of the file, which for the first three is that of ROS: k1, k2, p1, p2, k3, then k4,
/// k5, k6; and k1 to k4 of Kannala and Brandt.
fn model_name(kind: ModelKind) -> &'static str {
    match kind {
        ModelKind::Pinhole | ModelKind::BrownConrady5 => "plumb_bob",
        ModelKind::Rational8 => "rational_polynomial",
        ModelKind::KannalaBrandt4 => "kannala_brandt",
        ModelKind::DoubleSphere | ModelKind::Eucm => kind.name(),
    }
}

/// The calibration as viewers show it. Pixels have their centre at whole numbers there as here.
pub(super) fn message(stream: &str, calibration: &Calibration, at: Timestamp) -> CameraCalibration {
    let model = &calibration.model;
    let intrinsics = model.intrinsics();
    let (fx, fy, cx, cy) = (intrinsics.fx, intrinsics.fy, intrinsics.cx, intrinsics.cy);
    let coefficients = match model.kind() {
        ModelKind::Pinhole => vec![0.0; 5],
        _ => model.params().split_off(4),
    };
    let [width, height] = calibration.size_px;
    CameraCalibration {
        timestamp: Some(stamp(at)),
        frame_id: stream.to_owned(),
        width,
        height,
        distortion_model: model_name(model.kind()).to_owned(),
        d: coefficients,
        k: vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: vec![fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }
}

/// The text of the calibration file.
pub(super) fn toml(calibration: &Calibration) -> Result<String, CalibrationError> {
    Ok(Document::new(calibration, "calibration.toml")?.text().to_owned())
}

impl Reader {
    /// The calibration that was recorded with a stream, `None` if there is none.
    ///
    /// # Errors
    /// [`RecordingError::Unsupported`] if it is there and cannot be used.
    pub fn calibration(&self, stream: usize) -> Result<Option<Calibration>, RecordingError> {
        let Some(stream) = self.streams().get(stream) else { return Ok(None) };
        let Some(text) = &stream.calibration_toml else { return Ok(None) };
        // The name that messages show: the attachment within the file.
        let file = format!("{}:{}", self.path().display(), attachment_name(&stream.name));
        Calibration::parse(text, file).map(Some).map_err(|error| RecordingError::Unsupported {
            path: self.path().to_owned(),
            topic: stream.topic.clone(),
            what: format!("its calibration cannot be used: {error}"),
        })
    }
}
