//! The pinhole camera.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::projection::{ParamJacobian, PlaneJacobian, Projection};
use super::{Intrinsics, ModelError, ModelKind};

/// The pinhole camera without distortion: `m = (x, y)/z`.
///
/// Hartley & Zisserman, *Multiple View Geometry*, 2nd ed., section 6.1; OpenCV's `projectPoints` with no distortion.
/// Valid for z > 0, up to but not including 90°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    intrinsics: Intrinsics,
}

impl Pinhole {
    /// From intrinsics.
    ///
    /// # Errors
    /// If one of them is out of range.
    pub fn new(intrinsics: Intrinsics) -> Result<Self, ModelError> {
        intrinsics.check(ModelKind::Pinhole)?;
        Ok(Self { intrinsics })
    }
}

/// `(x, y)/z`, `None` for points that are not in front of the camera.
pub(super) fn divide(point: &Vector3<f64>) -> Option<Vector2<f64>> {
    (point.z > 0.0).then(|| point.xy() / point.z)
}

/// The derivative of [`divide`], given its result.
pub(super) fn divide_jacobian(divided: &Vector2<f64>, z: f64) -> Matrix2x3<f64> {
    Matrix2x3::new(1.0, 0.0, -divided.x, 0.0, 1.0, -divided.y) / z
}

/// The unit ray through a point of the plane z = 1.
pub(super) fn unit_ray(divided: &Vector2<f64>) -> Vector3<f64> {
    Vector3::new(divided.x, divided.y, 1.0) / divided.norm().hypot(1.0)
}

impl Projection for Pinhole {
    fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    fn max_angle_rad(&self) -> f64 {
        std::f64::consts::FRAC_PI_2
    }

    fn plane_from_point(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        divide(point)
    }

    fn plane_jacobian(&self, point: &Vector3<f64>) -> Option<PlaneJacobian> {
        let plane = divide(point)?;
        let d_plane_d_point = divide_jacobian(&plane, point.z);
        Some(PlaneJacobian { plane, d_plane_d_point, d_plane_d_params: ParamJacobian::zeros() })
    }

    fn ray_from_plane(&self, plane: &Vector2<f64>) -> Option<Vector3<f64>> {
        Some(unit_ray(plane))
    }
}
