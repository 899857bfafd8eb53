//! What every model can do, and what follows for all of them alike from the map of a point to the plane.

use nalgebra::{Matrix2, Matrix2x3, Matrix3x2, SMatrix, Vector2, Vector3};

use super::{Intrinsics, MAX_PARAMS};

/// How closely the forward projection must reproduce a point of the plane of unit focal length before its ray counts
/// as found, relative to 1 + its magnitude. Ill-conditioned but valid points reach some 10⁻¹¹ (see `MIN_SLOPE`).
const REPRODUCED: f64 = 1e-10;

/// Derivatives of two or three outputs by the parameters: column i belongs to `param_names()[i]`, the columns after
/// the model's last parameter are zero.
pub type ParamJacobian<const ROWS: usize> = SMatrix<f64, ROWS, MAX_PARAMS>;

/// A projected point and how it changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProjectJacobian {
    /// Where the point lands, in pixels.
    pub px: Vector2<f64>,
    /// ∂px/∂point, in pixels per unit of the point.
    pub d_px_d_point: Matrix2x3<f64>,
    /// ∂px/∂params.
    pub d_px_d_params: ParamJacobian<2>,
}

/// A pixel's ray and how it changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UnprojectJacobian {
    /// Unit ray in the camera frame.
    pub ray: Vector3<f64>,
    /// ∂ray/∂px, per pixel; its columns are perpendicular to the ray.
    pub d_ray_d_px: Matrix3x2<f64>,
    /// ∂ray/∂params at a fixed pixel; its columns are perpendicular to the ray.
    pub d_ray_d_params: ParamJacobian<3>,
}

/// A point on the plane of unit focal length and how it changes with the camera-frame point and with the model's own
/// parameters (columns after the four intrinsics).
#[derive(Clone, Copy, Debug)]
pub struct PlaneJacobian {
    /// The point of the plane.
    pub plane: Vector2<f64>,
    /// ∂plane/∂point.
    pub d_plane_d_point: Matrix2x3<f64>,
    /// ∂plane/∂params: column i belongs to the model's i-th parameter after fx, fy, cx, cy.
    pub d_plane_d_params: ParamJacobian<2>,
}

/// A camera model: a one-to-one map between the directions inside a cone around the optical axis and image points.
///
/// A model supplies the map between camera-frame points (any length, x right, y down, z forward) and the *plane of
/// unit focal length*; pixels, unit rays and derivatives of the inverse follow for all models alike.
///
/// No function panics, and none returns NaN or infinities: where a point or pixel lies outside the model's domain (or
/// is not a number), the answer is `None`.
pub trait Projection {
    /// Focal lengths and principal point.
    fn intrinsics(&self) -> &Intrinsics;

    /// The angle from the optical axis, in radians, up to which the projection is one-to-one and well conditioned;
    /// points further off project to `None`.
    fn max_angle_rad(&self) -> f64;

    /// Camera-frame point → plane of unit focal length, `None` outside the cone. May return infinities.
    fn plane_from_point(&self, point: &Vector3<f64>) -> Option<Vector2<f64>>;

    /// [`plane_from_point`](Self::plane_from_point) with derivatives. May return infinities.
    fn plane_jacobian(&self, point: &Vector3<f64>) -> Option<PlaneJacobian>;

    /// Plane of unit focal length → unit ray, `None` if the plane's point is no image of the cone. The answer is a
    /// candidate that the caller checks by projecting it.
    fn ray_from_plane(&self, plane: &Vector2<f64>) -> Option<Vector3<f64>>;

    /// The pixel on which `point` lands, `None` outside the cone.
    fn project(&self, point: &Vector3<f64>) -> Option<Vector2<f64>> {
        if !all_finite(point.as_slice()) {
            return None;
        }
        let px = self.intrinsics().px_from_plane(&self.plane_from_point(point)?);
        all_finite(px.as_slice()).then_some(px)
    }

    /// The unit ray that lands on `px`, `None` if none inside the cone does.
    ///
    /// A ray is returned only if [`project`](Self::project) accepts it and reproduces the pixel.
    fn unproject(&self, px: &Vector2<f64>) -> Option<Vector3<f64>> {
        let intrinsics = self.intrinsics();
        let plane = intrinsics.plane_from_px(px);
        let ray = self.ray_from_plane(&plane)?;
        let again = self.plane_from_point(&ray)?;
        let reproduced = (again - plane).amax() <= REPRODUCED * (1.0 + plane.amax());
        let finite = all_finite(ray.as_slice()) && all_finite(intrinsics.px_from_plane(&again).as_slice());
        (reproduced && finite).then_some(ray)
    }

    /// [`project`](Self::project) with its derivatives by the point and by all parameters.
    fn project_jacobian(&self, point: &Vector3<f64>) -> Option<ProjectJacobian> {
        if !all_finite(point.as_slice()) {
            return None;
        }
        let intrinsics = self.intrinsics();
        let PlaneJacobian { plane, d_plane_d_point, d_plane_d_params } = self.plane_jacobian(point)?;
        let focal = Matrix2::new(intrinsics.fx, 0.0, 0.0, intrinsics.fy);
        let mut d_px_d_params = ParamJacobian::<2>::zeros();
        d_px_d_params.fixed_view_mut::<2, 4>(0, 0).copy_from_slice(&[
            plane.x, 0.0, 0.0, plane.y, 1.0, 0.0, 0.0, 1.0, // by fx, fy, cx, cy, column by column
        ]);
        let own = focal * d_plane_d_params.fixed_columns::<{ MAX_PARAMS - 4 }>(0);
        d_px_d_params.fixed_columns_mut::<{ MAX_PARAMS - 4 }>(4).copy_from(&own);
        let px = intrinsics.px_from_plane(&plane);
        let d_px_d_point = focal * d_plane_d_point;
        let finite = all_finite(px.as_slice())
            && all_finite(d_px_d_point.as_slice())
            && all_finite(d_px_d_params.as_slice());
        finite.then_some(ProjectJacobian { px, d_px_d_point, d_px_d_params })
    }

    /// [`unproject`](Self::unproject) with its derivatives by the pixel and by all parameters.
    ///
    /// Implicit function theorem on `project(ray, params) = px` over the unit sphere. With E (3×2) an orthonormal
    /// basis of the plane perpendicular to the ray: ∂ray/∂px = E (∂px/∂point · E)⁻¹, and
    /// ∂ray/∂params = −∂ray/∂px · ∂px/∂params.
    fn unproject_jacobian(&self, px: &Vector2<f64>) -> Option<UnprojectJacobian> {
        let ray = self.unproject(px)?;
        let forward = self.project_jacobian(&ray)?;
        let tangents = tangents(&ray);
        let d_ray_d_px = tangents * (forward.d_px_d_point * tangents).try_inverse()?;
        let d_ray_d_params = -d_ray_d_px * forward.d_px_d_params;
        let finite = all_finite(d_ray_d_px.as_slice()) && all_finite(d_ray_d_params.as_slice());
        finite.then_some(UnprojectJacobian { ray, d_ray_d_px, d_ray_d_params })
    }
}

fn all_finite(values: &[f64]) -> bool {
    values.iter().all(|v| v.is_finite())
}

/// Direction and length of a finite point, `None` for the origin. Neither overflows nor underflows on the way.
pub(super) fn unit(point: &Vector3<f64>) -> Option<(Vector3<f64>, f64)> {
    let size = point.amax();
    if size == 0.0 {
        return None;
    }
    let scaled = point / size;
    let norm = scaled.norm();
    Some((scaled / norm, norm * size))
}

/// Two unit vectors perpendicular to a unit ray and to each other, as columns (Duff et al., "Building an Orthonormal
/// Basis, Revisited", JCGT 2017).
fn tangents(ray: &Vector3<f64>) -> Matrix3x2<f64> {
    let sign = 1.0f64.copysign(ray.z);
    let a = -1.0 / (sign + ray.z);
    let b = ray.x * ray.y * a;
    Matrix3x2::new(
        1.0 + sign * ray.x * ray.x * a,
        b,
        sign * b,
        sign + ray.y * ray.y * a,
        -sign * ray.x,
        -ray.y,
    )
}
