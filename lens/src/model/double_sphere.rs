//! The double sphere model.

use nalgebra::{Matrix2x3, Vector2, Vector3};

use super::projection::{ParamJacobian, PlaneJacobian, Projection, unit};
use super::{Intrinsics, ModelError, ModelKind, check, second_sphere};

/// The double sphere model with xi (ξ) and alpha (α): wide and fish-eye lenses with a closed-form inverse.
///
/// V. Usenko, N. Demmel, D. Cremers, "The Double Sphere Camera Model", 3DV 2018, eq. 40–52. On the unit sphere
/// (X² + Y² + Z² = 1):
///
/// ```text
/// ζ = Z + ξ,   d2 = √(X² + Y² + ζ²),   m = (X, Y) / (α d2 + (1−α) ζ)
/// ```
///
/// −1 < ξ < 1 and 0 ≤ α ≤ 1. With (sin ψ, cos ψ) = (√(X²+Y²), ζ)/d2, valid for cos ψ > −w, w = min(α, 1−α)/max(α, 1−α),
/// which is exactly where m stops to grow or leaves to infinity (less a margin, see `second_sphere`). The paper's
/// bound Z > −w₂ (eq. 43) takes d2 for 1: it is too narrow for most lenses and admits negative denominators for ξ
/// near −1. Our cone is the one whose image the paper's condition for the inverse, |m|² ≤ 1/(2α−1), describes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleSphere {
    intrinsics: Intrinsics,
    xi: f64,
    alpha: f64,
    /// The smallest valid cos ψ.
    min_cos: f64,
    max_angle_rad: f64,
}

/// A direction seen from the centre of the second sphere.
struct Second {
    zeta: f64,
    d2: f64,
    denominator: f64,
}

impl DoubleSphere {
    /// From intrinsics, ξ in (−1, 1) and α in [0, 1].
    ///
    /// # Errors
    /// If a parameter is out of range.
    pub fn new(intrinsics: Intrinsics, xi: f64, alpha: f64) -> Result<Self, ModelError> {
        let model = ModelKind::DoubleSphere;
        intrinsics.check(model)?;
        check::require(xi > -1.0 && xi < 1.0, model, "xi", xi, "above -1 and below 1")?;
        check::require((0.0..=1.0).contains(&alpha), model, "alpha", alpha, "between 0 and 1")?;
        let alpha = alpha.abs(); // −0 would divide to the wrong infinity
        let min_cos = second_sphere::min_cos(alpha);
        let max_angle_rad = max_angle_rad(xi, min_cos);
        check::field_of_view(model, max_angle_rad)?;
        Ok(Self { intrinsics, xi, alpha, min_cos, max_angle_rad })
    }

    /// ξ, the distance between the two spheres' centres.
    pub fn xi(&self) -> f64 {
        self.xi
    }

    /// α, which places the centre of projection behind the second sphere.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    fn second(&self, direction: &Vector3<f64>) -> Option<Second> {
        let zeta = direction.z + self.xi;
        let d2 = (direction.xy().norm_squared() + zeta * zeta).sqrt();
        let denominator = self.alpha * d2 + (1.0 - self.alpha) * zeta;
        (zeta > self.min_cos * d2).then_some(Second { zeta, d2, denominator })
    }
}

/// The angle at the first sphere's centre for ψ at the second's: the unit vector on the ray from (0, −ξ) along ψ.
fn max_angle_rad(xi: f64, cos: f64) -> f64 {
    let sin = (1.0 - cos * cos).sqrt();
    let d2 = xi * cos + (1.0 - xi * xi * sin * sin).sqrt();
    (d2 * sin).atan2(d2 * cos - xi)
}

impl Projection for DoubleSphere {
    fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    fn max_angle_rad(&self) -> f64 {
        self.max_angle_rad
    }

    fn plane_from_point(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (direction, _) = unit(point)?;
        Some(direction.xy() / self.second(&direction)?.denominator)
    }

    fn plane_jacobian(&self, point: &Vector3<f64>) -> Option<PlaneJacobian> {
        let (direction, distance) = unit(point)?;
        let Second { zeta, d2, denominator } = self.second(&direction)?;
        let plane = direction.xy() / denominator;
        // With d1 = |point| = 1: ∂d1 = direction, ζ = ξ d1 + Z, d2² = X² + Y² + ζ².
        let d_zeta = direction * self.xi + Vector3::z();
        let d_d2 = (Vector3::new(direction.x, direction.y, 0.0) + d_zeta * zeta) / d2;
        let d_denominator = d_d2 * self.alpha + d_zeta * (1.0 - self.alpha);
        let by_denominator = -plane / denominator;
        let d_plane_d_point =
            Matrix2x3::identity() / denominator + by_denominator * d_denominator.transpose();
        let mut d_plane_d_params = ParamJacobian::zeros();
        d_plane_d_params.set_column(0, &(by_denominator * (self.alpha * zeta / d2 + (1.0 - self.alpha))));
        d_plane_d_params.set_column(1, &(by_denominator * (d2 - zeta)));
        Some(PlaneJacobian { plane, d_plane_d_point: d_plane_d_point / distance, d_plane_d_params })
    }

    fn ray_from_plane(&self, plane: &Vector2<f64>) -> Option<Vector3<f64>> {
        let rho_squared = plane.norm_squared();
        let height = second_sphere::height(self.alpha, rho_squared)?;
        let square = height * height;
        let root = (square + (1.0 - self.xi * self.xi) * rho_squared).sqrt();
        let along = (height * self.xi + root) / (square + rho_squared);
        let ray = (plane * along).push(along * height - self.xi);
        Some(ray / ray.norm())
    }
}
