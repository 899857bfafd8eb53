//! Codes of an image as light.

use coshade_lens::response::{Channel, Response};

/// The light that each 8-bit code stands for, times 255: like codes, but edges keep their place when they are blurred.
///
/// A blurred edge lies where the *light* is half way; a curve such as sRGB's would move it by up to 0.3 px.
#[derive(Clone, Debug)]
pub(crate) struct LightOfCode {
    light: [f64; 256],
    /// Light per code: the noise of the light is that of the code times this.
    slope: [f64; 256],
}

impl LightOfCode {
    pub(crate) fn new(response: &Response) -> Self {
        let code = |code: usize| code as f64 / 255.0;
        // The green channel has most of the brightness.
        Self {
            light: std::array::from_fn(|i| 255.0 * response.inverse(Channel::Green, code(i))),
            slope: std::array::from_fn(|i| response.inverse_slope(Channel::Green, code(i)).clamp(0.05, 20.0)),
        }
    }

    #[inline]
    pub(crate) fn of(&self, code: u8) -> f64 {
        self.light.get(usize::from(code)).copied().unwrap_or(0.0)
    }

    #[inline]
    pub(crate) fn slope(&self, code: u8) -> f64 {
        self.slope.get(usize::from(code)).copied().unwrap_or(1.0)
    }
}
