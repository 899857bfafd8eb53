//! The enhanced unified camera model.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::projection::{ParamJacobian, PlaneJacobian, Projection, unit};
use super::{Intrinsics, ModelError, ModelKind, check, second_sphere};

/// The enhanced unified camera model with alpha (α) and beta (β): wide and fish-eye lenses with a closed-form inverse.
///
/// B. Khomutenko, G. Garcia, P. Martinet, "An Enhanced Unified Camera Model", RA-L 1(1), 2016 (Usenko
/// 2018 restates it beside the double sphere model):
///
/// ```text
/// d = √(β (X² + Y²) + Z²),   m = (X, Y) / (α d + (1−α) Z)
/// ```
///
/// 0 ≤ α ≤ 1 and β > 0. With cos ψ = Z/d, valid for cos ψ > −w, w = min(α, 1−α)/max(α, 1−α)
/// which is exactly where m stops to grow or leaves to infinity (less a margin, see `second_sphere`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eucm {
    intrinsics: Intrinsics,
    alpha: f64,
    beta: f64,
    /// The smallest valid cos ψ.
    min_cos: f64,
    max_angle_rad: f64,
}

impl Eucm {
    /// From intrinsics, α in [0, 1] and β > 0.
    ///
    /// # Errors
    /// If a parameter is out of range, or the coefficients leave no usable field of view.
    pub fn new(intrinsics: Intrinsics, alpha: f64, beta: f64) -> Result<Self, ModelError> {
        let model = ModelKind::Eucm;
        intrinsics.check(model)?;
        check::require((0.0..=1.0).contains(&alpha), model, "alpha", alpha, "between 0 and 1")?;
        check::positive(model, "beta", beta)?;
        let alpha = alpha.abs(); // −0 would divide to the wrong infinity
        let min_cos = second_sphere::min_cos(alpha);
        let max_angle_rad = ((1.0 - min_cos * min_cos) / beta).sqrt().atan2(min_cos);
        check::field_of_view(model, max_angle_rad)?;
        Ok(Self { intrinsics, alpha, beta, min_cos, max_angle_rad })
    }

    /// α, the mix of parallel and central projection.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// β, the squared ratio of the ellipsoid's half-axes.
    pub fn beta(&self) -> f64 {
        self.beta
    }

    /// d and the denominator α d + (1−α) Z for a unit direction inside the cone.
    fn denominator(&self, direction: &Vector3<f64>) -> Option<(f64, f64)> {
        let d = (self.beta * direction.xy().norm_squared() + direction.z * direction.z).sqrt();
        let denominator = self.alpha * d + (1.0 - self.alpha) * direction.z;
        (direction.z > self.min_cos * d).then_some((d, denominator))
    }
}

impl Projection for Eucm {
    fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    fn max_angle_rad(&self) -> f64 {
        self.max_angle_rad
    }

    fn plane_from_point(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (direction, _) = unit(point)?;
        let (_, denominator) = self.denominator(&direction)?;
        Some(direction.xy() / denominator)
    }

    fn plane_jacobian(&self, point: &Vector3<f64>) -> Option<PlaneJacobian> {
        let (direction, distance) = unit(point)?;
        let (d, denominator) = self.denominator(&direction)?;
        let plane = direction.xy() / denominator;
        let d_d = Vector3::new(self.beta * direction.x, self.beta * direction.y, direction.z) / d;
        let d_denominator = d_d * self.alpha + Vector3::z() * (1.0 - self.alpha);
        let by_denominator = -plane / denominator;
        let d_plane_d_point =
            Matrix2x3::identity() / denominator + by_denominator * d_denominator.transpose();
        let mut d_plane_d_params = ParamJacobian::zeros();
        let d_beta = 0.5 * self.alpha * direction.xy().norm_squared() / d;
        d_plane_d_params.set_column(0, &(by_denominator * (d - direction.z)));
        d_plane_d_params.set_column(1, &(by_denominator * d_beta));
        Some(PlaneJacobian { plane, d_plane_d_point: d_plane_d_point / distance, d_plane_d_params })
    }

    fn ray_from_plane(&self, plane: &Vector2<f64>) -> Option<Vector3<f64>> {
        let height = second_sphere::height(self.alpha, self.beta * plane.norm_squared())?;
        let ray = plane.push(height);
        Some(ray / ray.norm())
    }
}
