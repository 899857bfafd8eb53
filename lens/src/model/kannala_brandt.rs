//! The fish-eye model of Kannala and Brandt.

use std::f64::consts::PI;

use nalgebra::{Matrix2, Matrix2x3, Vector2, Vector3};

use super::polynomial::{self as poly, MIN_SLOPE};
use super::projection::{ParamJacobian, PlaneJacobian, Projection, unit};
use super::root::increasing_root;
use super::{Intrinsics, ModelError, ModelKind, check};

/// The Kannala–Brandt model with k1..k4: OpenCV's `fisheye`, Kalibr's and ROS' `equidistant`.
///
/// J. Kannala & S. Brandt, "A generic camera model and calibration method for conventional, wide-angle, and fish-eye
/// lenses", PAMI 28(8), 2006, eq. 6, with the first coefficient normalised to 1 as in OpenCV. With θ the angle from
/// the optical axis and φ the direction around it:
///
/// ```text
/// d(θ) = θ + k1 θ³ + k2 θ⁵ + k3 θ⁷ + k4 θ⁹,   m = d(θ) (cos φ, sin φ)
/// ```
///
/// Valid up to the first turning point of d, or up to 180° if there is none (without the backward axis itself, whose image
/// is a circle). Points behind the camera are projected, unlike by OpenCV, whose formula is only right for Z > 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KannalaBrandt4 {
    intrinsics: Intrinsics,
    k: [f64; 4],
    max_angle_rad: f64,
    /// d at the largest angle.
    max_image_radius: f64,
}

impl KannalaBrandt4 {
    /// From intrinsics and k1..k4.
    ///
    /// # Errors
    /// If a parameter is out of range, or the coefficients leave no usable field of view.
    pub fn new(intrinsics: Intrinsics, coefficients: [f64; 4]) -> Result<Self, ModelError> {
        let model = ModelKind::KannalaBrandt4;
        intrinsics.check(model)?;
        check::finite_coefficients(model, &coefficients)?;
        let max_angle_rad = max_angle_rad(&coefficients);
        check::field_of_view(model, max_angle_rad)?;
        let mut this = Self { intrinsics, k: coefficients, max_angle_rad, max_image_radius: 0.0 };
        this.max_image_radius = this.image_radius(max_angle_rad).0;
        Ok(this)
    }

    /// k1, k2, k3, k4.
    pub fn coefficients(&self) -> [f64; 4] {
        self.k
    }

    /// d(θ) and d'(θ).
    fn image_radius(&self, theta: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.k;
        let t = theta * theta;
        let value = theta * (1.0 + t * (k1 + t * (k2 + t * (k3 + t * k4))));
        let slope = 1.0 + t * (3.0 * k1 + t * (5.0 * k2 + t * (7.0 * k3 + t * (9.0 * k4))));
        (value, slope)
    }
}

/// The first θ in [0, π] at which d' is no longer positive (by the margin `MIN_SLOPE`).
fn max_angle_rad(k: &[f64; 4]) -> f64 {
    let slope = poly::of_square(&[1.0, 3.0 * k[0], 5.0 * k[1], 7.0 * k[2], 9.0 * k[3]]);
    poly::positive_up_to(&poly::sum(&slope, -MIN_SLOPE, &poly::magnitude(&slope)), PI)
}

impl Projection for KannalaBrandt4 {
    fn intrinsics(&self) -> &Intrinsics {
        &self.intrinsics
    }

    fn max_angle_rad(&self) -> f64 {
        self.max_angle_rad
    }

    fn plane_from_point(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        let (direction, _) = unit(point)?;
        let sin = direction.x.hypot(direction.y);
        let theta = sin.atan2(direction.z);
        if theta >= self.max_angle_rad {
            return None;
        }
        if sin == 0.0 {
            return Some(Vector2::zeros());
        }
        Some(direction.xy() * (self.image_radius(theta).0 / sin))
    }

    fn plane_jacobian(&self, point: &Vector3<f64>) -> Option<PlaneJacobian> {
        let (direction, distance) = unit(point)?;
        let sin = direction.x.hypot(direction.y);
        let theta = sin.atan2(direction.z);
        if theta >= self.max_angle_rad {
            return None;
        }
        if sin == 0.0 {
            return Some(PlaneJacobian {
                plane: Vector2::zeros(),
                d_plane_d_point: Matrix2x3::identity() / distance,
                d_plane_d_params: ParamJacobian::zeros(),
            });
        }
        let (radius, slope) = self.image_radius(theta);
        // On the unit sphere θ changes by (z dr − r dz), and the direction e around the axis turns by 1/r.
        let e = direction.xy() / sin;
        let radial = e * e.transpose();
        let by_xy = radial * (slope * direction.z) + (Matrix2::identity() - radial) * (radius / sin);
        let mut d_plane_d_point = Matrix2x3::zeros();
        d_plane_d_point.fixed_columns_mut::<2>(0).copy_from(&by_xy);
        d_plane_d_point.set_column(2, &(e * (-slope * sin)));

        let square = theta * theta;
        let mut power = theta;
        let mut d_plane_d_params = ParamJacobian::zeros();
        for i in 0..self.k.len() {
            power *= square;
            d_plane_d_params.set_column(i, &(e * power));
        }
        Some(PlaneJacobian {
            plane: direction.xy() * (radius / sin),
            d_plane_d_point: d_plane_d_point / distance,
            d_plane_d_params,
        })
    }

    fn ray_from_plane(&self, plane: &Vector2<f64>) -> Option<Vector3<f64>> {
        let radius = plane.x.hypot(plane.y);
        if radius.is_nan() || radius > self.max_image_radius {
            return None;
        }
        if radius == 0.0 {
            return Some(Vector3::z());
        }
        let theta = increasing_root(|t| self.image_radius(t), radius, self.max_angle_rad, radius)?;
        let (sin, cos) = theta.sin_cos();
        Some((plane * (sin / radius)).push(cos))
    }
}
