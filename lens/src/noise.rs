//! Sensor noise: shot noise grows with the light, read noise does not.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::calibration::Mistake;
use crate::vignetting::interpolate;

/// The variance of a pixel's linear light x: `shot`·x + `read`, in units of code white squared, before vignetting is
/// undone (Foi et al., *Practical Poissonian-Gaussian noise modeling*, IEEE TIP 17(10), 2008, eq. 3).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Noise {
    /// Variance per linear light, in units of code white, 0 to 1. An 8-bit webcam: about 0.001.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub shot: f64,
    /// Variance in the dark, in units of code white squared, 0 to 1. An 8-bit webcam: about 0.00001.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub read: f64,
    /// The same at other gains of the camera, by rising gain. Between two the numbers are interpolated; without them
    /// `shot` and `read` hold for every gain.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub at_gain: Vec<NoiseAtGain>,
}

/// The noise at one gain of the camera.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NoiseAtGain {
    /// The gain, as the factor by which it multiplies the code values, relative to the gain of the calibration.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub gain: f64,
    /// As `shot` above.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub shot: f64,
    /// As `read` above.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub read: f64,
}

impl Noise {
    /// Shot and read noise at a gain relative to the calibration's; `None` for the calibration's own.
    pub fn at(&self, gain: Option<f64>) -> (f64, f64) {
        let Some(gain) = gain.filter(|_| !self.at_gain.is_empty()) else { return (self.shot, self.read) };
        let gains: Vec<f64> = self.at_gain.iter().map(|n| n.gain).collect();
        let of = |value: fn(&NoiseAtGain) -> f64| -> Vec<f64> { self.at_gain.iter().map(value).collect() };
        (interpolate(&gains, &of(|n| n.shot), gain), interpolate(&gains, &of(|n| n.read), gain))
    }

    /// The variance of linear light `light` (units of code white), see [`Noise`]. Light below 0 counts as dark.
    pub fn variance(&self, light: f64, gain: Option<f64>) -> f64 {
        let (shot, read) = self.at(gain);
        shot * light.max(0.0) + read
    }

    /// The first mistake, its key counted from the noise, or `None`.
    pub fn mistake(&self) -> Option<Mistake> {
        let bad = |(_, value): &(&str, f64)| !(0.0..=1.0).contains(value);
        if let Some((key, value)) = [("shot", self.shot), ("read", self.read)].into_iter().find(bad) {
            return Some(Mistake::new(&[key], format!("`{value}` is out of range"), "0 to 1"));
        }
        let mut last_gain = 0.0;
        for (i, at) in self.at_gain.iter().enumerate() {
            let wrong = |key, value: f64, allowed| {
                Some(Mistake::new(
                    &["at_gain", &i.to_string(), key],
                    format!("`{value}` is out of range"),
                    allowed,
                ))
            };
            if !(at.gain > last_gain && at.gain < 1e6) {
                return wrong("gain", at.gain, "more than 0, and more than the gain before it");
            }
            last_gain = at.gain;
            if let Some((key, value)) = [("shot", at.shot), ("read", at.read)].into_iter().find(bad) {
                return wrong(key, value, "0 to 1");
            }
        }
        None
    }
}
