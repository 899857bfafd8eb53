//! Pinhole with rational radial and tangential distortion.

use nalgebra::{Vector2, Vector3};

use super::pinhole::{divide, divide_jacobian, unit_ray};
use super::projection::{PlaneJacobian, Projection};
use super::radial_tangential::RadialTangential;
use super::{Intrinsics, ModelError, ModelKind, check};

/// OpenCV's eight-parameter model (`CALIB_RATIONAL_MODEL`): k1, k2, p1, p2, k3, k4, k5, k6. Wide pinhole lenses, and
/// what the Azure Kinect and many phones report.
///
/// D. Claus & A. Fitzgibbon, "A rational function lens distortion model for general cameras", CVPR 2005, in the
/// radial form of OpenCV's `calib3d` documentation. With (x, y) = (X, Y)/Z and s = x² + y²:
///
/// ```text
/// g  = (1 + k1 s + k2 s² + k3 s³) / (1 + k4 s + k5 s² + k6 s³)
/// mx = x g + 2 p1 x y + p2 (s + 2x²)
/// my = y g + p1 (s + 2y²) + 2 p2 x y
/// ```
///
/// Valid in the largest cone in which this is provably one-to-one: up to the first turning point of r g(r²) or the first
/// zero of the denominator, or where d(r g)/dr = 6 r |(p1, p2)| if tangential terms are there. It never reaches 90°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rational8 {
    intrinsics: Intrinsics,
    distortion: RadialTangential,
}

impl Rational8 {
    /// From intrinsics and k1, k2, p1, p2, k3, k4, k5, k6.
    ///
    /// # Errors
    /// If a parameter is out of range, or the coefficients leave no usable field of view.
    pub fn new(intrinsics: Intrinsics, coefficients: [f64; 8]) -> Result<Self, ModelError> {
        let model = ModelKind::Rational8;
        intrinsics.check(model)?;
        check::finite_coefficients(model, &coefficients)?;
        let [k1, k2, p1, p2, k3, k4, k5, k6] = coefficients;
        let distortion = RadialTangential::new([k1, k2, k3], [k4, k5, k6], [p1, p2]);
        check::field_of_view(model, distortion.max_angle_rad())?;
        Ok(Self { intrinsics, distortion })
    }

    /// k1, k2, p1, p2, k3, k4, k5, k6.
    pub fn coefficients(&self) -> [f64; 8] {
        self.distortion.coefficients()
    }
}

impl Projection for Rational8 {
    fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    fn max_angle_rad(&self) -> f64 {
        self.distortion.max_angle_rad()
    }

    fn plane_from_point(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        self.distortion.distort(&divide(point)?)
    }

    fn plane_jacobian(&self, point: &Vector3<f64>) -> Option<PlaneJacobian> {
        let divided = divide(point)?;
        let (plane, d_plane_d_divided, d_plane_d_params) = self.distortion.distort_jacobian(&divided)?;
        let d_plane_d_point = d_plane_d_divided * divide_jacobian(&divided, point.z);
        Some(PlaneJacobian { plane, d_plane_d_point, d_plane_d_params })
    }

    fn ray_from_plane(&self, plane: &Vector2<f64>) -> Option<Vector3<f64>> {
        Some(unit_ray(&self.distortion.undistort(plane)?))
    }
}
