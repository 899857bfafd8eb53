use std::fmt;
use std::sync::Arc;

use coshade_image_file::srgb;

/// A camera's response: channel (0, 1, 2 = R, G, B; 0 for grey) and linear radiance in, code value of [0, 1] out.
pub type Response = Arc<dyn Fn(usize, f32) -> f32 + Send + Sync>;

/// How radiance is shown: what SSIM, FLIP and the display-referred errors are measured on.
///
/// Radiance is scaled by 2^`exposure_ev`, then encoded with sRGB or, if there is one, with the camera's response, whose
/// code values are taken as sRGB ones (that is how a camera image is looked at); then clipped to [0, 1].
#[derive(Clone, Default)]
pub struct DisplayTransform {
    /// Stops of exposure before encoding; 0 leaves radiance as it is.
    pub exposure_ev: f32,
    /// The camera's response instead of the sRGB curve.
    pub response: Option<Response>,
}

impl DisplayTransform {
    /// Code value in [0, 1] of a radiance in channel `channel`; NaN if the response gives one.
    pub fn code(&self, channel: usize, radiance: f32) -> f32 {
        let exposed = f64::from(radiance) * f64::from(self.exposure_ev).exp2();
        match &self.response {
            Some(response) => response(channel, exposed as f32).clamp(0.0, 1.0),
            None => srgb::encode(exposed.clamp(0.0, 1.0)) as f32,
        }
    }

    /// `sRGB` or `camera response`.
    pub fn name(&self) -> &'static str {
        if self.response.is_some() { "camera response" } else { "sRGB" }
    }
}

impl fmt::Debug for DisplayTransform {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} at {} EV", self.name(), self.exposure_ev)
    }
}
