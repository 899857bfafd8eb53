//! Pinhole with three radial and two tangential distortion coefficients.

use nalgebra::{Vector2, Vector3};

use super::pinhole::{divide, divide_jacobian, unit_ray};
use super::projection::{ParamJacobian, PlaneJacobian, Projection};
use super::radial_tangential::RadialTangential;
use super::{Intrinsics, ModelError, ModelKind, check};

/// The Brown–Conrady model with k1, k2, p1, p2, k3: OpenCV's five-parameter model, Kalibr's and ROS' `radtan` and
/// `plumb_bob` (there k3 = 0 or last).
///
/// D. C. Brown, "Decentering distortion of lenses", Photogrammetric Engineering 32(3), 1966, with OpenCV's naming and
/// order. With (x, y) = (X, Y)/Z and s = x² + y²:
///
/// ```text
/// mx = x (1 + k1 s + k2 s² + k3 s³) + 2 p1 x y + p2 (s + 2x²)
/// my = y (1 + k1 s + k2 s² + k3 s³) + p1 (s + 2y²) + 2 p2 x y
/// ```
///
/// Valid in the largest cone in which this is provably one-to-one: up to the first turning point of the radial
/// polynomial, or where h'(r) = 6 r |(p1, p2)| with h = r (1 + k1 r² + …) if tangential terms are there. It never
/// reaches 90°.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BrownConrady5 {
    intrinsics: Intrinsics,
    distortion: RadialTangential,
}

impl BrownConrady5 {
    /// From intrinsics and k1, k2, p1, p2, k3.
    ///
    /// # Errors
    /// If a parameter is out of range, or the coefficients leave no usable field of view.
    pub fn new(intrinsics: Intrinsics, coefficients: [f64; 5]) -> Result<Self, ModelError> {
        let model = ModelKind::BrownConrady5;
        intrinsics.check(model)?;
        check::finite_coefficients(model, &coefficients)?;
        let [k1, k2, p1, p2, k3] = coefficients;
        let distortion = RadialTangential::new([k1, k2, k3], [0.0; 3], [p1, p2]);
        check::field_of_view(model, distortion.max_angle_rad())?;
        Ok(Self { intrinsics, distortion })
    }

    /// k1, k2, p1, p2, k3.
    pub fn coefficients(&self) -> [f64; 5] {
        let [k1, k2, p1, p2, k3, ..] = self.distortion.coefficients();
        [k1, k2, p1, p2, k3]
    }
}

impl Projection for BrownConrady5 {
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
        let (plane, d_plane_d_divided, by_all_eight) = self.distortion.distort_jacobian(&divided)?;
        let mut d_plane_d_params = ParamJacobian::<2>::zeros();
        d_plane_d_params.fixed_columns_mut::<5>(0).copy_from(&by_all_eight.fixed_columns::<5>(0));
        let d_plane_d_point = d_plane_d_divided * divide_jacobian(&divided, point.z);
        Some(PlaneJacobian { plane, d_plane_d_point, d_plane_d_params })
    }

    fn ray_from_plane(&self, plane: &Vector2<f64>) -> Option<Vector3<f64>> {
        Some(unit_ray(&self.distortion.undistort(plane)?))
    }
}
