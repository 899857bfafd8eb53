//! Camera models: from camera-frame points to pixels and back.
//!
//! # Which model to choose
//!
//! | model | parameters after fx fy cx cy | choose it for | reaches |
//! | --- | --- | --- | --- |
//! | [`Pinhole`] | – | rendered or already rectified images | < 90° off the axis |
//! | [`BrownConrady5`] | k1 k2 p1 p2 k3 | webcams, lenses up to about 90° field of view; the default of OpenCV and ROS | first turning point, < 90° |
//! | [`Rational8`] | k1 k2 p1 p2 k3 k4 k5 k6 | wide pinhole-like lenses (90°–130°) for which five coefficients are not enough; needs many views out to the corners | first turning point or pole, < 90° |
//! | [`KannalaBrandt4`] | k1 k2 k3 k4 | **any fish-eye**; the most accurate beyond 120° and the one most tools know (OpenCV `fisheye`, Kalibr `equidistant`) | turning point, up to 180° |
//! | [`DoubleSphere`] | xi alpha | fish-eye lenses where speed counts: closed-form inverse, two parameters, nearly as accurate | closed form, beyond 90° |
//! | [`Eucm`] | alpha beta | the same, for catadioptric mirrors too | closed form, beyond 90° |
//!
//! All use the camera frame x right, y down, z forward, and pixel coordinates with the centre of pixel (0,0) at (0,0).
//!
//! # What all promise
//!
//! - [`CameraModel::project`] and [`CameraModel::unproject`] are inverse to each other to 10⁻⁹ (relative) inside a cone
//!   of [`max_angle_rad`](CameraModel::max_angle_rad) around the axis, and `None` outside; on the last 10⁻⁹ of the way to
//!   the edge, rounding decides. The cone is found when a model is built and ends before the projection turns back, so a
//!   ray returned is the only one that a pixel can have come from.
//! - A model that exists is valid: it is only built by checked constructors ([`CameraModel::from_params`], each
//!   model's `new`, or reading a file), which name the parameter at fault and what it may be.
//! - No NaN, no infinity, no panic, no unbounded loop, whatever the parameters and points.
//!
//! The generic part (pixels, unit rays, derivatives of the inverse) is in the trait [`Projection`].

mod brown_conrady;
mod check;
mod double_sphere;
mod error;
mod eucm;
mod intrinsics;
mod kannala_brandt;
mod keys;
mod kind;
mod pinhole;
mod polynomial;
mod projection;
mod radial_tangential;
mod rational;
mod root;
mod second_sphere;

use nalgebra::{Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use brown_conrady::BrownConrady5;
pub use double_sphere::DoubleSphere;
pub use error::ModelError;
pub use eucm::Eucm;
pub use intrinsics::Intrinsics;
pub use kannala_brandt::KannalaBrandt4;
pub use kind::{MAX_PARAMS, ModelKind};
pub use pinhole::Pinhole;
pub use projection::{ParamJacobian, PlaneJacobian, ProjectJacobian, Projection, UnprojectJacobian};
pub use rational::Rational8;

use keys::ModelKeys;

/// A camera's geometry: one of the [models](self), with its parameters.
///
/// In a file: `model = "kannala_brandt4"` and the parameters as keys (`fx`, `fy`, `cx`, `cy`, `k1`, …).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "ModelKeys", into = "ModelKeys")]
pub enum CameraModel {
    /// No distortion.
    Pinhole(Pinhole),
    /// Radial and tangential distortion.
    BrownConrady5(BrownConrady5),
    /// Rational radial and tangential distortion.
    Rational8(Rational8),
    /// Fish-eye, polynomial in the angle.
    KannalaBrandt4(KannalaBrandt4),
    /// Fish-eye, two spheres.
    DoubleSphere(DoubleSphere),
    /// Fish-eye, ellipsoid.
    Eucm(Eucm),
}

macro_rules! from_model {
    ($($model:ident),*) => { $(
        impl From<$model> for CameraModel {
            fn from(model: $model) -> Self {
                Self::$model(model)
            }
        }
    )* };
}
from_model!(Pinhole, BrownConrady5, Rational8, KannalaBrandt4, DoubleSphere, Eucm);

/// Calls the same method of whichever model it is.
macro_rules! dispatch {
    ($self:expr, $model:ident => $call:expr) => {
        match $self {
            CameraModel::Pinhole($model) => $call,
            CameraModel::BrownConrady5($model) => $call,
            CameraModel::Rational8($model) => $call,
            CameraModel::KannalaBrandt4($model) => $call,
            CameraModel::DoubleSphere($model) => $call,
            CameraModel::Eucm($model) => $call,
        }
    };
}

impl CameraModel {
    /// From the parameters in the order of [`ModelKind::param_names`].
    ///
    /// # Errors
    /// If there are too few or too many, one is out of range, or the distortion leaves no usable field of view.
    pub fn from_params(kind: ModelKind, params: &[f64]) -> Result<Self, ModelError> {
        let keys = match (kind, params) {
            (ModelKind::Pinhole, &[fx, fy, cx, cy]) => ModelKeys::Pinhole { fx, fy, cx, cy },
            (ModelKind::BrownConrady5, &[fx, fy, cx, cy, k1, k2, p1, p2, k3]) => {
                ModelKeys::BrownConrady5 { fx, fy, cx, cy, k1, k2, p1, p2, k3 }
            }
            (ModelKind::Rational8, &[fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6]) => {
                ModelKeys::Rational8 { fx, fy, cx, cy, k1, k2, p1, p2, k3, k4, k5, k6 }
            }
            (ModelKind::KannalaBrandt4, &[fx, fy, cx, cy, k1, k2, k3, k4]) => {
                ModelKeys::KannalaBrandt4 { fx, fy, cx, cy, k1, k2, k3, k4 }
            }
            (ModelKind::DoubleSphere, &[fx, fy, cx, cy, xi, alpha]) => {
                ModelKeys::DoubleSphere { fx, fy, cx, cy, xi, alpha }
            }
            (ModelKind::Eucm, &[fx, fy, cx, cy, alpha, beta]) => {
                ModelKeys::Eucm { fx, fy, cx, cy, alpha, beta }
            }
            _ => {
                return Err(ModelError::ParamCount { model: kind, got: params.len() });
            }
        };
        keys.try_into()
    }

    /// Which model this is.
    pub fn kind(&self) -> ModelKind {
        match self {
            Self::Pinhole(_) => ModelKind::Pinhole,
            Self::BrownConrady5(_) => ModelKind::BrownConrady5,
            Self::Rational8(_) => ModelKind::Rational8,
            Self::KannalaBrandt4(_) => ModelKind::KannalaBrandt4,
            Self::DoubleSphere(_) => ModelKind::DoubleSphere,
            Self::Eucm(_) => ModelKind::Eucm,
        }
    }

    /// The parameters in the order of [`param_names`](Self::param_names).
    pub fn params(&self) -> Vec<f64> {
        let Intrinsics { fx, fy, cx, cy } = *self.intrinsics();
        let mut params = vec![fx, fy, cx, cy];
        match self {
            Self::Pinhole(_) => {}
            Self::BrownConrady5(m) => params.extend(m.coefficients()),
            Self::Rational8(m) => params.extend(m.coefficients()),
            Self::KannalaBrandt4(m) => params.extend(m.coefficients()),
            Self::DoubleSphere(m) => params.extend([m.xi(), m.alpha()]),
            Self::Eucm(m) => params.extend([m.alpha(), m.beta()]),
        }
        params
    }

    /// The parameters' names: the keys in a file, and the columns of the parameter Jacobians.
    pub fn param_names(&self) -> &'static [&'static str] {
        self.kind().param_names()
    }

    /// Focal lengths and principal point.
    pub fn intrinsics(&self) -> &Intrinsics {
        dispatch!(self, model => model.intrinsics())
    }

    /// The same lens for the image scaled by `scale` per axis (2 = twice as many pixels): `fx' = s·fx`,
    /// `cx' = s(cx + ½) − ½`.
    ///
    /// # Errors
    /// If the scaled focal lengths are not above zero or the numbers not finite.
    pub fn scaled(&self, scale: Vector2<f64>) -> Result<Self, ModelError> {
        let Intrinsics { fx, fy, cx, cy } = self.intrinsics().scaled(scale);
        let mut params = self.params();
        params.splice(..4, [fx, fy, cx, cy]);
        Self::from_params(self.kind(), &params)
    }

    /// The angle from the optical axis, in radians, up to which the projection is one-to-one and well conditioned.
    /// Points further off project to `None`.
    pub fn max_angle_rad(&self) -> f64 {
        dispatch!(self, model => model.max_angle_rad())
    }

    /// The pixel on which the camera-frame `point` (any length) lands, `None` outside the cone.
    pub fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        dispatch!(self, model => model.project(point))
    }

    /// The unit ray in the camera frame that lands on `px`, `None` if none inside the cone does.
    pub fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        dispatch!(self, model => model.unproject(px))
    }

    /// [`project`](Self::project) with its derivatives by the point and by all parameters.
    pub fn project_jacobian(&self, point: &Vector3<f64>) -> Option<ProjectJacobian> {
        dispatch!(self, model => model.project_jacobian(point))
    }

    /// [`unproject`](Self::unproject) with its derivatives by the pixel and by all parameters.
    pub fn unproject_jacobian(&self, px: &Vector2<f64>) -> Option<UnprojectJacobian> {
        dispatch!(self, model => model.unproject_jacobian(px))
    }
}
