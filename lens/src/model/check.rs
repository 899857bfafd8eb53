//! Range checks of single parameters.

use super::{ModelError, ModelKind};

/// A usable field of view: below this many radians off the axis a "model" is a typing error.
const MIN_FIELD_OF_VIEW_RAD: f64 = 1e-3;

/// `Ok` if `ok`, else an error that says what is `allowed`.
pub fn require(
    ok: bool,
    model: ModelKind,
    param: &'static str,
    value: f64,
    allowed: &'static str,
) -> Result<(), ModelError> {
    if ok { Ok(()) } else { Err(ModelError::OutOfRange { model, param, value, allowed }) }
}

/// Any finite number.
pub fn finite(model: ModelKind, param: &'static str, value: f64) -> Result<(), ModelError> {
    require(value.is_finite(), model, param, value, "a finite number")
}

/// A finite number above zero.
pub fn positive(model: ModelKind, param: &'static str, value: f64) -> Result<(), ModelError> {
    require(value.is_finite() && value > 0.0, model, param, value, "a finite number above 0")
}

/// All distortion coefficients of `model` (its parameters after the four intrinsics) are finite.
pub fn finite_coefficients(model: ModelKind, coefficients: &[f64]) -> Result<(), ModelError> {
    let names = model.param_names().iter().skip(4);
    names.zip(coefficients).try_for_each(|(name, &value)| finite(model, name, value))
}

/// The cone is wide enough to be a camera's.
pub fn field_of_view(model: ModelKind, max_angle_rad: f64) -> Result<(), ModelError> {
    if max_angle_rad >= MIN_FIELD_OF_VIEW_RAD {
        Ok(())
    } else {
        Err(ModelError::NoFieldOfView { model, max_angle_rad })
    }
}
