//! Why numbers are not a camera model.

use super::ModelKind;

/// Why parameters do not make a camera model. Each message names the model, the parameter and what is allowed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ModelError {
    /// A parameter lies outside the range in which the model is defined (NaN and infinities lie outside of all).
    #[error("camera model {model}: {param} = {value} is not allowed; it must be {allowed}")]
    OutOfRange {
        /// The model.
        model: ModelKind,
        /// The parameter's name, as in the calibration file.
        param: &'static str,
        /// What it was.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// A list of parameters has the wrong length.
    #[error("camera model {model} has {} parameters ({}), got {got}", model.param_names().len(), model.param_names().join(", "))]
    ParamCount {
        /// The model.
        model: ModelKind,
        /// How many parameters were given.
        got: usize,
    },
    /// Every parameter is allowed by itself, but together they fold the image onto itself right beside the axis.
    #[error(
        "camera model {model}: the distortion ({}) folds the image {max_angle_rad:e} rad off the optical axis, \
         so no usable field of view is left; check the order and the signs of these coefficients",
        model.param_names()[4..].join(", ")
    )]
    NoFieldOfView {
        /// The model.
        model: ModelKind,
        /// Up to which angle the projection is one-to-one.
        max_angle_rad: f64,
    },
    /// No model has this name.
    #[error("unknown camera model \"{0}\"; known are {names}", names = ModelKind::ALL.map(ModelKind::name).join(", "))]
    UnknownName(String),
}
