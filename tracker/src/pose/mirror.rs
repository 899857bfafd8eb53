//! The other pose of a flat thing.
//!
//! From far away, a flat thing looks the same if its plane is mirrored at the plane across the line of sight. Of the
//! two poses only perspective tells which is true. Schweighofer and Pinz, *Robust Pose Estimation from a Planar
//! Target*, PAMI 2006, section 4.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::least_squares::{Fit, Search, middle, minimise};
use super::residuals::{Imaging, Target};

/// Poses closer than this in rotation are one minimum, found twice.
const SAME_MINIMUM_RAD: f64 = 2e-3;

/// A pose whose χ² is this many times the best one's (or that of a few tags) is out of the question, however well it is
/// found.
const HOPELESS: f64 = 20.0;
const FEW: f64 = 50.0;

/// The best pose in the mirrored orientation of `best`. Where perspective is so strong, or the thing is seen so
/// frontally, that no minimum lies there: the mirrored rotation itself, with the translation that fits best. `None` if
/// that is outside the lens' field of view.
pub(crate) fn mirrored_fit(
    imaging: &Imaging<'_>,
    targets: &[Target],
    weights: &[f64],
    best: &Fit,
) -> Option<Fit> {
    let mirrored = mirrored(targets, weights, &best.camera_from_body)?;
    let fit = |start: &Isometry3<f64>, search| minimise(imaging, targets, weights, start, search);
    let shifted = fit(&mirrored, Search { least_gain: Search::ROUGH.least_gain, ..Search::TRANSLATION })?;
    let rough = fit(&shifted.camera_from_body, Search::ROUGH)?;
    if rough.chi2 > HOPELESS * best.chi2.max(FEW) {
        return Some(rough);
    }
    let free = fit(&rough.camera_from_body, Search::FULL)?;
    let merged = angle_rad(&free.camera_from_body, &best.camera_from_body) < SAME_MINIMUM_RAD;
    if merged { fit(&shifted.camera_from_body, Search::TRANSLATION) } else { Some(free) }
}

/// The rotation between two poses.
pub(crate) fn angle_rad(a: &Isometry3<f64>, b: &Isometry3<f64>) -> f64 {
    a.rotation.angle_to(&b.rotation)
}

/// `camera_from_body` with its observed corners' plane mirrored at the plane across the line of sight, and its points
/// mirrored at the former: two reflections, so a rotation.
fn mirrored(
    targets: &[Target],
    weights: &[f64],
    camera_from_body: &Isometry3<f64>,
) -> Option<Isometry3<f64>> {
    let middle = middle(targets, weights)?;
    let normal = plane_normal(targets, weights, &middle);
    let seen_at = (camera_from_body * Point3::from(middle)).coords;
    let sight = seen_at.try_normalize(0.0)?;
    let rotation = camera_from_body.rotation.to_rotation_matrix().into_inner();
    let turned = Rotation3::from_matrix_unchecked(reflection(&sight) * rotation * reflection(&normal));
    let turned = UnitQuaternion::from_rotation_matrix(&turned);
    Some(Isometry3::from_parts(Translation3::from(seen_at - turned * middle), turned))
}

/// Reflection at the plane across a unit vector.
fn reflection(across: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::identity() - across * across.transpose() * 2.0
}

/// Whether all corners lie in one plane, to a thousandth of their extent.
pub(crate) fn is_flat(targets: &[Target], weights: &[f64]) -> bool {
    middle(targets, weights).is_none_or(|middle| {
        let spread = spread(targets, weights, &middle).symmetric_eigenvalues();
        spread.min() <= 1e-6 * spread.max()
    })
}

/// The normal of the plane through the corners: the direction in which they spread least.
fn plane_normal(targets: &[Target], weights: &[f64], middle: &Vector3<f64>) -> Vector3<f64> {
    let eigen = spread(targets, weights, middle).symmetric_eigen();
    eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned()
}

fn spread(targets: &[Target], weights: &[f64], middle: &Vector3<f64>) -> Matrix3<f64> {
    let used = targets.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
    used.flat_map(|(target, _)| &target.corners_m).fold(Matrix3::zeros(), |sum, corner| {
        let offset = corner.coords - middle;
        sum + offset * offset.transpose()
    })
}
