//! Typed camera controls: what can be set, what was asked, what took.

use std::time::Duration;

/// A setting of a camera, in units that do not depend on the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Control {
    /// Exposure time; value is [`ControlValue::Time`].
    Exposure,
    /// Analogue and digital gain as a factor, 1 = none; value is [`ControlValue::Factor`].
    Gain,
    /// White balance as a colour temperature; value is [`ControlValue::Kelvin`].
    WhiteBalance,
    /// Focus in the device's own steps; value is [`ControlValue::Steps`].
    Focus,
    /// Automatic exposure (and gain); value is [`ControlValue::Switch`].
    AutoExposure,
    /// Automatic white balance; value is [`ControlValue::Switch`].
    AutoWhiteBalance,
    /// Automatic focus; value is [`ControlValue::Switch`].
    AutoFocus,
}

/// The value of a control, in the unit that the control's kind says.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ControlValue {
    /// A time.
    Time(Duration),
    /// A factor without unit.
    Factor(f64),
    /// A colour temperature in kelvin.
    Kelvin(f64),
    /// Steps of the device's own scale.
    Steps(i64),
    /// On or off.
    Switch(bool),
}

/// What a camera says of one of its controls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlInfo {
    /// Which control.
    pub control: Control,
    /// Smallest value.
    pub min: ControlValue,
    /// Largest value.
    pub max: ControlValue,
    /// Distance between neighbouring values, `None` if any value between can be set.
    pub step: Option<ControlValue>,
    /// Value after a reset.
    pub default: ControlValue,
    /// Frames from setting the control to the first frame that shows it, `None` if unknown.
    pub latency_frames: Option<u32>,
    /// Whether the control can be read but not set now (an exposure while automatic exposure is on, say).
    pub read_only: bool,
}

/// What became of a request to set a control.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControlReport {
    /// Which control.
    pub control: Control,
    /// What was asked for.
    pub requested: ControlValue,
    /// What the device reads back. A device may accept a request silently and not act on it: compare.
    pub actual: ControlValue,
    /// Frames until the change shows, `None` if unknown.
    pub latency_frames: Option<u32>,
}
