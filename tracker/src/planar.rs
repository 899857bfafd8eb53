//! Both poses of a single tag, through any lens.
//!
//! A square that is small in the image looks nearly the same from two sides. Both poses are found in closed form
//! (Collins and Bartoli, *Infinitesimal Plane-Based Pose Estimation*, IJCV 2014) and then refined in pixels of the image.
//! The closed form needs a pinhole's image: the corners' rays are put on the plane that touches the unit sphere where
//! the line of sight to the tag's centre leaves it, so nothing depends on the lens' axis, and tags beyond 90° off it are
//! as good as any.

use coshade_lens::model::CameraModel;
use nalgebra::{
    Isometry3, Matrix2, Matrix3, Matrix6, Rotation3, Translation3, UnitQuaternion, Vector2, Vector3,
};

use crate::body::{BodyTag, SIZE_RANGE_M};
use crate::detection::{TagId, TagObservation};
use crate::pose::least_squares::{Fit, Search, minimise};
use crate::pose::mirror::{angle_rad, mirrored_fit};
use crate::pose::residuals::{Imaging, Target};

/// Tags whose image is thinner than this, relative to its length, are seen edge-on: the cosine of 89.97°.
const MIN_ASPECT: f64 = 5e-4;

/// One pose of a tag and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarPose {
    /// Tag to camera frame.
    pub camera_from_tag: Isometry3<f64>,
    /// Covariance of a twist on the left (see [`crate::lie`]), from the corners' covariance.
    pub covariance: Matrix6<f64>,
    /// Sum of squares of the corners' errors in units of their covariance; two degrees of freedom.
    pub chi2: f64,
    /// Root mean square distance of the corners from where the pose puts them, in pixels of the image.
    pub rms_px: f64,
}

/// Why the corners of a tag give no pose.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PlanarError {
    /// The tag's size is no length.
    #[error("size of {tag}: {size_m} m; it must be from {} to {} m", SIZE_RANGE_M.start(), SIZE_RANGE_M.end())]
    Size {
        /// The tag.
        tag: TagId,
        /// Its size.
        size_m: f64,
    },
    /// A corner cannot have been seen through this lens.
    #[error(
        "corner {corner} of {tag} at ({x_px:.1}, {y_px:.1}) px is outside the lens' field of view; check that the \
         calibration belongs to this camera and image size"
    )]
    OutsideLens {
        /// The tag.
        tag: TagId,
        /// Which corner, counted as in [`UNIT_CORNERS`](crate::UNIT_CORNERS).
        corner: usize,
        /// Its column.
        x_px: f64,
        /// Its row.
        y_px: f64,
    },
    /// The corners are no image of a square.
    #[error("the corners of {tag} are no convex quadrilateral, or it is seen edge-on")]
    NoQuadrilateral {
        /// The tag.
        tag: TagId,
    },
    /// The corners turn the wrong way round.
    #[error("the corners of {tag} are in mirrored order, as if seen from behind")]
    Mirrored {
        /// The tag.
        tag: TagId,
    },
    /// The covariance is no covariance.
    #[error("the covariance of the corners of {tag} is not positive definite")]
    Covariance {
        /// The tag.
        tag: TagId,
    },
    /// No pose near the closed form fits, or the corners leave it undetermined.
    #[error("no pose fits the corners of {tag}")]
    NoFit {
        /// The tag.
        tag: TagId,
    },
}

/// Both poses of a tag of `size_m`, the better first.
///
/// The second is a minimum of its own if there is one. A tag that fills much of the view, or faces the camera, has only
/// one: then the second is the mirrored orientation of the first, with the translation that fits best.
///
/// # Errors
/// [`PlanarError`] if the corners are no image of a square seen from its front through this lens.
pub fn planar_poses(
    lens: &CameraModel,
    observation: &TagObservation,
    size_m: f64,
) -> Result<[PlanarPose; 2], PlanarError> {
    let tag = observation.tag;
    let own = BodyTag { tag, size_m, body_from_tag: Isometry3::identity() };
    let starts = planar_starts(lens, observation, size_m)?;
    let target =
        Target::new(observation, own.corners_m(), [0.0; 4]).ok_or(PlanarError::Covariance { tag })?;
    let imaging = Imaging { lens, motion: None };
    let targets = [target];
    let fits = starts.map(|start| minimise(&imaging, &targets, &[1.0], &start, Search::FULL));
    let better = |a: Fit, b: Fit| if a.chi2 <= b.chi2 { a } else { b };
    let best = fits.iter().flatten().copied().reduce(better).ok_or(PlanarError::NoFit { tag })?;
    let other = mirrored_fit(&imaging, &targets, &[1.0], &best).ok_or(PlanarError::NoFit { tag })?;
    // The mirrored pose can be the better minimum, if neither start led to it.
    let (best, other) = if other.chi2 < best.chi2 { (other, best) } else { (best, other) };
    let pose = |fit: Fit| PlanarPose::of_fit(&imaging, &targets[0], &fit).ok_or(PlanarError::NoFit { tag });
    Ok([pose(best)?, pose(other)?])
}

impl PlanarPose {
    /// The rotation between two poses.
    pub fn angle_to_rad(&self, other: &Self) -> f64 {
        angle_rad(&self.camera_from_tag, &other.camera_from_tag)
    }

    fn of_fit(imaging: &Imaging<'_>, target: &Target, fit: &Fit) -> Option<Self> {
        let error = imaging.at(&fit.camera_from_body).error_px(target)?;
        Some(Self {
            camera_from_tag: fit.camera_from_body,
            covariance: fit.covariance()?,
            chi2: fit.chi2,
            rms_px: error.norm() / 2.0,
        })
    }
}

/// Both poses in closed form, in no order.
pub(crate) fn planar_starts(
    lens: &CameraModel,
    observation: &TagObservation,
    size_m: f64,
) -> Result<[Isometry3<f64>; 2], PlanarError> {
    let tag = observation.tag;
    if !SIZE_RANGE_M.contains(&size_m) {
        return Err(PlanarError::Size { tag, size_m });
    }
    let mut rays = [Vector3::zeros(); 4];
    for (corner, (ray, px)) in rays.iter_mut().zip(&observation.corners_px).enumerate() {
        let outside = PlanarError::OutsideLens { tag, corner, x_px: px.x, y_px: px.y };
        *ray = lens.unproject(px).ok_or(outside)?;
    }
    let tangent = Tangent::new(&rays).ok_or(PlanarError::NoQuadrilateral { tag })?;
    let by_tag = tangent.derivative_at_centre().ok_or(PlanarError::NoQuadrilateral { tag })?;
    let [long, thin] = singular_values(&by_tag);
    if long.is_nan() || thin <= MIN_ASPECT * long {
        return Err(PlanarError::NoQuadrilateral { tag });
    }
    // Across the line of sight a tag's front is turned over: y is up in its frame and down in the camera's.
    if by_tag.determinant() > 0.0 {
        return Err(PlanarError::Mirrored { tag });
    }
    let mut poses = [Isometry3::identity(); 2];
    for (pose, rotation) in poses.iter_mut().zip(rotations(&(by_tag / long))) {
        let translation = tangent.translation(&rotation).ok_or(PlanarError::NoFit { tag })?;
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        let scaled = Isometry3::from_parts(Translation3::from(translation * size_m), rotation);
        *pose = tangent.camera_from_tangent * scaled;
    }
    Ok(poses)
}

/// The corners on the plane z = 1 of a frame whose z axis runs to the tag's centre.
struct Tangent {
    camera_from_tangent: UnitQuaternion<f64>,
    corners: [Vector2<f64>; 4],
}

impl Tangent {
    /// `None` if the corners do not lie around one point, in front of it.
    fn new(rays: &[Vector3<f64>; 4]) -> Option<Self> {
        let [a, b, c, d] = rays;
        // The diagonals' planes meet in the line of sight to the centre. Its length is the sine of small angles.
        let centre = a.cross(c).cross(&b.cross(d)).try_normalize(1e-14)?;
        let centre = if centre.dot(&(a + b + c + d)) < 0.0 { -centre } else { centre };
        // Any turn about z will do. A half turn has many axes; take one.
        let camera_from_tangent = UnitQuaternion::rotation_between(&Vector3::z(), &centre)
            .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
        let turned = rays.map(|ray| camera_from_tangent.inverse_transform_vector(&ray));
        turned
            .iter()
            .all(|ray| ray.z > 1e-6)
            .then(|| Self { camera_from_tangent, corners: turned.map(|ray| ray.xy() / ray.z) })
    }

    /// The derivative of the homography from a tag of size 1 to the plane, at the tag's centre.
    ///
    /// The centre goes to 0, so the homography is p = Jx/(1 + g·x). On a diagonal with ends ±x that gives
    /// p₋(1 − g·x) = −Jx and p₊(1 + g·x) = Jx: both ends lie on one line through 0, and their difference e gives
    /// g·x = −(p₊ + p₋)·e/e·e. `None` if the centre does not lie between the ends.
    fn derivative_at_centre(&self) -> Option<Matrix2<f64>> {
        let [p0, p1, p2, p3] = &self.corners;
        let half_diagonal = |minus: &Vector2<f64>, plus: &Vector2<f64>| {
            let along = plus - minus;
            let perspective = -(plus + minus).dot(&along) / along.norm_squared();
            (perspective.abs() < 1.0)
                .then(|| (plus * (1.0 + perspective) - minus * (1.0 - perspective)) / 2.0)
        };
        // J (½, ½) and J (½, −½): upper right and lower right.
        let (rising, falling) = (half_diagonal(p0, p2)?, half_diagonal(p3, p1)?);
        Some(Matrix2::from_columns(&[rising + falling, rising - falling]))
    }

    /// The translation of a tag of size 1 that fits the corners best, linearly: the point R x + t is to lie on the
    /// ray (u, v, 1), so t_x − u t_z = −(R x)_x + u (R x)_z and likewise for v.
    fn translation(&self, rotation: &Matrix3<f64>) -> Option<Vector3<f64>> {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for (corner, [x, y]) in self.corners.iter().zip(crate::UNIT_CORNERS) {
            let turned = rotation * Vector3::new(x, y, 0.0);
            for axis in 0..2 {
                let mut row = Vector3::zeros();
                row[axis] = 1.0;
                row.z = -corner[axis];
                normal += row * row.transpose();
                right -= row * row.dot(&turned);
            }
        }
        let translation = normal.cholesky()?.solve(&right);
        (translation.z > 0.0 && translation.norm().is_finite()).then_some(translation)
    }
}

/// Both rotations whose upper left 2×2 block is `block` (IPPE, section 3.3: at the centre of the tangent plane its
/// rotation R_v is the identity). Its larger singular value is 1, so the rest of its columns' unit lengths is one row,
/// known up to its sign.
fn rotations(block: &Matrix2<f64>) -> [Matrix3<f64>; 2] {
    let rest = Matrix2::identity() - block.transpose() * block;
    let (x, y) = (rest[(0, 0)].max(0.0).sqrt(), rest[(1, 1)].max(0.0).sqrt());
    let y = if rest[(0, 1)] < 0.0 { -y } else { y };
    [1.0, -1.0].map(|sign| {
        let first = block.column(0).push(sign * x);
        let second = block.column(1).push(sign * y);
        Matrix3::from_columns(&[first, second, first.cross(&second)])
    })
}

/// The larger first. From JᵀJ's eigenvalues: m ± √(m² − det²), m half its trace.
fn singular_values(matrix: &Matrix2<f64>) -> [f64; 2] {
    let mean = matrix.norm_squared() / 2.0;
    let determinant = matrix.determinant().abs();
    let long = (mean + (mean * mean - determinant * determinant).max(0.0).sqrt()).sqrt();
    [long, determinant / long]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_closed_form_is_exact_without_noise() {
        // A square seen through the tangent plane itself: one of both rotations is the true one.
        let rotation = Rotation3::from_euler_angles(2.6, 0.3, 0.8);
        let centre = Vector3::new(-0.3, 0.8, -0.4);
        let rays = crate::UNIT_CORNERS
            .map(|[x, y]| (rotation * Vector3::new(x, y, 0.0) * 0.1 + centre).try_normalize(0.0).unwrap());
        let tangent = Tangent::new(&rays).unwrap();
        let by_tag = tangent.derivative_at_centre().unwrap();
        let [long, thin] = singular_values(&by_tag);
        let svd = by_tag.svd(false, false).singular_values;
        assert!((long - svd.max()).abs() < 1e-15 && (thin - svd.min()).abs() < 1e-15);
        let found = rotations(&(by_tag / long)).map(|matrix| {
            assert!((matrix.transpose() * matrix - Matrix3::identity()).amax() < 1e-12);
            assert!((matrix.determinant() - 1.0).abs() < 1e-12);
            let turned = tangent.camera_from_tangent.to_rotation_matrix().into_inner() * matrix;
            let translation = tangent.translation(&matrix).unwrap();
            (
                (turned - rotation.matrix()).amax(),
                (tangent.camera_from_tangent * translation * 0.1 - centre).amax(),
            )
        });
        assert!(found.iter().any(|(turn, shift)| *turn < 1e-12 && *shift < 1e-12), "{found:?}");
    }

    #[test]
    fn a_ray_straight_back_has_a_tangent_plane() {
        let rays = crate::UNIT_CORNERS
            .map(|[x, y]| Vector3::new(x * 0.1, -y * 0.1, -1.0).try_normalize(0.0).unwrap());
        assert!(Tangent::new(&rays).unwrap().derivative_at_centre().is_some());
    }
}
