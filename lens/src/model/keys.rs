//! The keys of a camera model in a file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{
    BrownConrady5, CameraModel, DoubleSphere, Eucm, Intrinsics, KannalaBrandt4, ModelError, Pinhole,
    Rational8,
};

/// The camera model and its parameters. fx, fy are focal lengths and cx, cy the principal point, in pixels; the centre
/// of pixel (0,0) lies at (0,0), as in OpenCV.
// Unchecked numbers as they stand in the file; `CameraModel` is what they become.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "model", rename_all = "snake_case", deny_unknown_fields)]
#[schemars(rename = "CameraModel")]
pub enum ModelKeys {
    /// No distortion.
    Pinhole { fx: f64, fy: f64, cx: f64, cy: f64 },
    /// Brown–Conrady: OpenCV's five coefficients, `plumb_bob`, `radtan`.
    BrownConrady5 { fx: f64, fy: f64, cx: f64, cy: f64, k1: f64, k2: f64, p1: f64, p2: f64, k3: f64 },
    /// OpenCV's rational model with eight coefficients.
    Rational8 {
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        k1: f64,
        k2: f64,
        p1: f64,
        p2: f64,
        k3: f64,
        k4: f64,
        k5: f64,
        k6: f64,
    },
    /// Kannala–Brandt: OpenCV's `fisheye`, Kalibr's `equidistant`.
    KannalaBrandt4 { fx: f64, fy: f64, cx: f64, cy: f64, k1: f64, k2: f64, k3: f64, k4: f64 },
    /// Double sphere (Usenko 2018): -1 < xi < 1, 0 <= alpha <= 1.
    DoubleSphere { fx: f64, fy: f64, cx: f64, cy: f64, xi: f64, alpha: f64 },
    /// Enhanced unified camera model (Khomutenko 2016): 0 <= alpha <= 1, beta > 0.
    Eucm { fx: f64, fy: f64, cx: f64, cy: f64, alpha: f64, beta: f64 },
}

impl TryFrom<ModelKeys> for CameraModel {
    type Error = ModelError;

    fn try_from(keys: ModelKeys) -> Result<Self, ModelError> {
        Ok(match keys {
            ModelKeys::Pinhole { fx, fy, cx, cy } => Pinhole::new(Intrinsics { fx, fy, cx, cy })?.into(),
            ModelKeys::BrownConrady5 { fx, fy, cx, cy, k1, k2, p1, p2, k3 } => {
                BrownConrady5::new(Intrinsics { fx, fy, cx, cy }, [k1, k2, p1, p2, k3])?.into()
            }
            ModelKeys::Rational8 { fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 } => {
                Rational8::new(Intrinsics { fx, fy, cx, cy }, [k1, k2, p1, p2, k3, k4, k5, k6])?.into()
            }
            ModelKeys::KannalaBrandt4 { fx, fy, cx, cy, k1, k2, k3, k4 } => {
                KannalaBrandt4::new(Intrinsics { fx, fy, cx, cy }, [k1, k2, k3, k4])?.into()
            }
            ModelKeys::DoubleSphere { fx, fy, cx, cy, xi, alpha } => {
                DoubleSphere::new(Intrinsics { fx, fy, cx, cy }, xi, alpha)?.into()
            }
            ModelKeys::Eucm { fx, fy, cx, cy, alpha, beta } => {
                Eucm::new(Intrinsics { fx, fy, cx, cy }, alpha, beta)?.into()
            }
        })
    }
}

impl From<CameraModel> for ModelKeys {
    fn from(model: CameraModel) -> Self {
        let Intrinsics { fx, fy, cx, cy } = *model.intrinsics();
        match model {
            CameraModel::Pinhole(_) => Self::Pinhole { fx, fy, cx, cy },
            CameraModel::BrownConrady5(m) => {
                let [k1, k2, p1, p2, k3] = m.coefficients();
                Self::BrownConrady5 { fx, fy, cx, cy, k1, k2, p1, p2, k3 }
            }
            CameraModel::Rational8(m) => {
                let [k1, k2, p1, p2, k3, k4, k5, k6] = m.coefficients();
                Self::Rational8 { fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 }
            }
            CameraModel::KannalaBrandt4(m) => {
                let [k1, k2, k3, k4] = m.coefficients();
                Self::KannalaBrandt4 { fx, fy, cx, cy, k1, k2, k3, k4 }
            }
            CameraModel::DoubleSphere(m) => {
                Self::DoubleSphere { fx, fy, cx, cy, xi: m.xi(), alpha: m.alpha() }
            }
            CameraModel::Eucm(m) => Self::Eucm { fx, fy, cx, cy, alpha: m.alpha(), beta: m.beta() },
        }
    }
}
