//! A calibration for another size of the same image.

use std::fmt;

use nalgebra::Vector2;

use crate::calibration::{Calibration, CalibrationError};
use crate::pixel::CameraPx;
use crate::raster::{ImageCircle, check_size};

/// A calibration is used at another size than it was made for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ScaleWarning {
    /// Size of the calibration, in pixels.
    pub from: [u32; 2],
    /// Size of the images, in pixels.
    pub to: [u32; 2],
}

impl fmt::Display for ScaleWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([w, h], [to_w, to_h]) = (self.from, self.to);
        write!(
            f,
            "the calibration was made at {w}×{h} pixels and is used at {to_w}×{to_h}: binning is assumed (the camera scales \
             the whole image and crops nothing); if straight lines come out bent, calibrate at {to_w}×{to_h}"
        )
    }
}

impl Calibration {
    /// The calibration for images of `size_px`, if they have the same shape to within a pixel's rounding, with a
    /// warning if the size differs. Every place of the image keeps its ray. Noise is kept as it is.
    ///
    /// # Errors
    /// [`CalibrationError::Aspect`] for another shape; a size of 0 or beyond 16384.
    pub fn scaled_to(&self, size_px: [u32; 2]) -> Result<(Self, Option<ScaleWarning>), CalibrationError> {
        check_size(size_px)?;
        if size_px == self.size_px {
            return Ok((self.clone(), None));
        }
        let (from, to) = (self.size_px, size_px);
        let [width, height] = from.map(f64::from);
        let [to_width, to_height] = to.map(f64::from);
        // One side was rounded to the other's scale: less than one pixel of the smaller image.
        let rounding_px = (width * to_height - height * to_width).abs() / width.max(height);
        if rounding_px >= 1.0 {
            return Err(CalibrationError::Aspect { from, to });
        }
        let scale = Vector2::new(to_width / width, to_height / height);
        let model = self.model.scaled(scale)?;
        let scaled = Self {
            size_px,
            model,
            image_circle: self.image_circle.map(|circle| scaled_circle(&circle, scale)),
            vignetting: self.vignetting.scaled(scale),
            provenance: self.provenance.scaled(model.param_names(), scale),
            ..self.clone()
        };
        Ok((scaled, Some(ScaleWarning { from, to })))
    }
}

fn scaled_circle(circle: &ImageCircle, scale: Vector2<f64>) -> ImageCircle {
    ImageCircle {
        center_px: circle.center_px.map(|center| CameraPx(Vector2::from(center)).scaled(scale).0.into()),
        radius_px: circle.radius_px.map(|radius| radius * (scale.x * scale.y).sqrt()),
        max_angle_deg: circle.max_angle_deg,
    }
}
