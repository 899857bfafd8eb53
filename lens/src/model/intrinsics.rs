//! Focal lengths and principal point, which all models share.

use nalgebra::{Matrix3, Vector2};

use super::check;
use super::{ModelError, ModelKind};
use crate::pixel::CameraPx;

/// The affine last step of every model, from the plane of unit focal length to pixels: `u = fx·mx + cx`,
/// `v = fy·my + cy`. The centre of pixel (0,0) lies at (0,0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// Focal length along the rows, in pixels; > 0.
    pub fx: f64,
    /// Focal length along the columns, in pixels; > 0.
    pub fy: f64,
    /// Column of the principal point, in pixels.
    pub cx: f64,
    /// Row of the principal point, in pixels.
    pub cy: f64,
}

impl Intrinsics {
    /// Checked: focal lengths finite and > 0, principal point finite.
    pub(super) fn check(&self, model: ModelKind) -> Result<(), ModelError> {
        check::positive(model, "fx", self.fx)?;
        check::positive(model, "fy", self.fy)?;
        check::finite(model, "cx", self.cx)?;
        check::finite(model, "cy", self.cy)
    }

    /// Plane of unit focal length → pixels.
    pub fn px_from_plane(&self, plane: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new(self.fx * plane.x + self.cx, self.fy * plane.y + self.cy)
    }

    /// Pixels → plane of unit focal length.
    pub fn plane_from_px(&self, px: &Vector2<f64>) -> Vector2<f64> {
        Vector2::new((px.x - self.cx) / self.fx, (px.y - self.cy) / self.fy)
    }

    /// The intrinsics of the image scaled by `scale` per axis (2 = twice as many pixels): `fx' = s·fx`,
    /// `cx' = s(cx + ½) − ½`. The distortion parameters of all models stay as they are.
    pub fn scaled(&self, scale: Vector2<f64>) -> Self {
        let center_px = CameraPx::new(self.cx, self.cy).scaled(scale).0;
        Self { fx: self.fx * scale.x, fy: self.fy * scale.y, cx: center_px.x, cy: center_px.y }
    }

    /// The camera matrix K (3×3, OpenCV's convention, no skew).
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }
}
