//! Exponential and logarithm of rigid motions, SE(3).
//!
//! A *twist* is (rotation; translation): the first three numbers are a rotation vector in radians, the last three a
//! translation in metres. Poses are disturbed on the left, `a_from_b ← exp(δ) * a_from_b`, so δ lives in frame a: for
//! `camera_from_body` it turns and shifts the body about the camera's centre, along the camera's axes. All covariances
//! of poses in this crate are those of this δ.
//!
//! Barfoot, *State Estimation for Robotics*, 2nd ed., chapter 8 (there with the translation first).

use nalgebra::{Isometry3, Matrix3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};

/// Below this square of the angle the coefficients are summed as series: six terms leave less than 10⁻¹⁵ of each, and
/// above it the closed forms lose less than 10⁻¹² to cancellation.
const SERIES_BELOW: f64 = 0.25;

/// The motion that a constant twist makes in one unit of time.
pub fn exp(twist: &Vector6<f64>) -> Isometry3<f64> {
    let (rotation, translation) = split(twist);
    let shift = rotation_left_jacobian(&rotation) * translation;
    Isometry3::from_parts(Translation3::from(shift), rotation_exp(&rotation))
}

/// The twist of a motion, its rotation at most π: the inverse of [`exp`].
pub fn log(motion: &Isometry3<f64>) -> Vector6<f64> {
    let rotation = rotation_log(&motion.rotation);
    join(&rotation, &(rotation_left_jacobian_inverse(&rotation) * motion.translation.vector))
}

/// How a motion carries twists: `motion * exp(δ) = exp(adjoint(motion) * δ) * motion`.
pub fn adjoint(motion: &Isometry3<f64>) -> Matrix6<f64> {
    let rotation = motion.rotation.to_rotation_matrix().into_inner();
    blocks(&rotation, &(motion.translation.vector.cross_matrix() * rotation))
}

/// The rotation by a rotation vector.
pub fn rotation_exp(rotation: &Vector3<f64>) -> UnitQuaternion<f64> {
    let half = rotation.norm() / 2.0;
    // sin(x)/x, whose next term is below rounding here.
    let sinc = if half < 1e-4 { 1.0 - half * half / 6.0 } else { half.sin() / half };
    UnitQuaternion::new_normalize(Quaternion::from_parts(half.cos(), rotation * (sinc / 2.0)))
}

/// The rotation vector of a rotation, of length π at most.
pub fn rotation_log(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let (sin, cos) = (rotation.imag(), rotation.scalar());
    let (sin, cos) = if cos < 0.0 { (-sin, -cos) } else { (sin, cos) };
    let length = sin.norm();
    // Half angle over its sine. Both ends are well conditioned: near π the quaternion's vector has length 1.
    let ratio = if length < 1e-4 { 1.0 + length * length / 6.0 } else { length.atan2(cos) / length };
    sin * (2.0 * ratio)
}

/// How the exponential moves with its argument: `exp(ξ + δ) = exp(left_jacobian(ξ) * δ) * exp(ξ)` to first order
/// (Barfoot, eqs. 8.90 and 8.91).
pub fn left_jacobian(twist: &Vector6<f64>) -> Matrix6<f64> {
    let (rotation, translation) = split(twist);
    blocks(&rotation_left_jacobian(&rotation), &mixed_block(&rotation, &translation))
}

/// The inverse of [`left_jacobian`]: `log(exp(δ) * exp(ξ)) = ξ + left_jacobian_inverse(ξ) * δ` to first order. Defined
/// for rotations below 2π, so for every result of [`log`].
pub fn left_jacobian_inverse(twist: &Vector6<f64>) -> Matrix6<f64> {
    let (rotation, translation) = split(twist);
    let inverse = rotation_left_jacobian_inverse(&rotation);
    blocks(&inverse, &(-inverse * mixed_block(&rotation, &translation) * inverse))
}

/// The left Jacobian of SO(3) (Barfoot, eq. 8.77).
fn rotation_left_jacobian(rotation: &Vector3<f64>) -> Matrix3<f64> {
    let square = rotation.norm_squared();
    let cross = rotation.cross_matrix();
    Matrix3::identity() + cross * one_minus_cos(square) + cross * cross * angle_minus_sin(square)
}

fn rotation_left_jacobian_inverse(rotation: &Vector3<f64>) -> Matrix3<f64> {
    let square = rotation.norm_squared();
    let cross = rotation.cross_matrix();
    let factor = if square < SERIES_BELOW {
        series(
            square,
            [1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0, 1.0 / 1_209_600.0, 1.0 / 47_900_160.0, 5.28e-10],
        )
    } else {
        let half = square.sqrt() / 2.0;
        (1.0 - half / half.tan()) / square
    };
    Matrix3::identity() - cross * 0.5 + cross * cross * factor
}

/// The lower left block of the left Jacobian: Q of Barfoot's eq. 8.91.
fn mixed_block(rotation: &Vector3<f64>, translation: &Vector3<f64>) -> Matrix3<f64> {
    let square = rotation.norm_squared();
    let (r, t) = (rotation.cross_matrix(), translation.cross_matrix());
    let (rt, tr) = (r * t, t * r);
    let rtr = rt * r;
    t * 0.5
        + (rt + tr + rtr) * angle_minus_sin(square)
        + (r * rt + tr * r - rtr * 3.0) * fourth_order(square)
        + (rtr * r + r * rtr) * fifth_order(square)
}

/// (1 − cos θ)/θ², from θ².
fn one_minus_cos(square: f64) -> f64 {
    if square < SERIES_BELOW {
        return series(
            square,
            [1.0 / 2.0, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40_320.0, 1.0 / 3_628_800.0, -2.087_675_7e-9],
        );
    }
    (1.0 - square.sqrt().cos()) / square
}

/// (θ − sin θ)/θ³, from θ².
fn angle_minus_sin(square: f64) -> f64 {
    if square < SERIES_BELOW {
        return series(
            square,
            [1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0, -1.0 / 362_880.0, 1.0 / 39_916_800.0, -1.605_904_4e-10],
        );
    }
    let angle = square.sqrt();
    (angle - angle.sin()) / (square * angle)
}

/// (θ² + 2 cos θ − 2)/(2 θ⁴), from θ².
fn fourth_order(square: f64) -> f64 {
    if square < SERIES_BELOW {
        return series(
            square,
            [
                1.0 / 24.0,
                -1.0 / 720.0,
                1.0 / 40_320.0,
                -1.0 / 3_628_800.0,
                1.0 / 479_001_600.0,
                -1.147_074_6e-11,
            ],
        );
    }
    (square + 2.0 * square.sqrt().cos() - 2.0) / (2.0 * square * square)
}

/// (2 θ − 3 sin θ + θ cos θ)/(2 θ⁵), from θ².
fn fifth_order(square: f64) -> f64 {
    if square < SERIES_BELOW {
        return series(
            square,
            [1.0 / 120.0, -1.0 / 2520.0, 1.0 / 120_960.0, -1.0 / 9_979_200.0, 8.029_522e-10, -4.588_298e-12],
        );
    }
    let angle = square.sqrt();
    (2.0 * angle - 3.0 * angle.sin() + angle * angle.cos()) / (2.0 * square * square * angle)
}

/// `c[0] + c[1] x + c[2] x² + …`.
fn series(x: f64, coefficients: [f64; 6]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)
}

/// Rotation and translation of a twist.
pub fn split(twist: &Vector6<f64>) -> (Vector3<f64>, Vector3<f64>) {
    (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned())
}

/// A twist from its parts.
pub fn join(rotation: &Vector3<f64>, translation: &Vector3<f64>) -> Vector6<f64> {
    Vector6::new(rotation.x, rotation.y, rotation.z, translation.x, translation.y, translation.z)
}

/// `[diagonal, 0; lower, diagonal]`.
fn blocks(diagonal: &Matrix3<f64>, lower: &Matrix3<f64>) -> Matrix6<f64> {
    let mut out = Matrix6::zeros();
    out.fixed_view_mut::<3, 3>(0, 0).copy_from(diagonal);
    out.fixed_view_mut::<3, 3>(3, 3).copy_from(diagonal);
    out.fixed_view_mut::<3, 3>(3, 0).copy_from(lower);
    out
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use nalgebra::Matrix4;

    use super::*;

    /// Angles around zero, around the change from series to closed form, and up to π.
    const ANGLES: [f64; 13] =
        [0.0, 1e-300, 1e-12, 1e-6, 1.9e-4, 2.1e-4, 0.1, 0.4999, 0.5001, 1.5, 3.0, PI - 1e-6, PI - 1e-12];

    fn twists() -> Vec<Vector6<f64>> {
        let axes =
            [Vector3::x(), -Vector3::z(), Vector3::new(0.36, -0.48, 0.8), Vector3::new(-0.6, 0.0, -0.8)];
        let shifts = [Vector3::zeros(), Vector3::new(0.3, -2.0, 0.7), Vector3::new(-1e-9, 1e-7, 0.0)];
        let mut twists = Vec::new();
        for angle in ANGLES {
            for axis in axes {
                twists.extend(shifts.map(|shift| join(&(axis * angle), &shift)));
            }
        }
        twists
    }

    /// The exponential of the 4×4 matrix of a twist by its power series, after halving it 20 times.
    fn matrix_exp(twist: &Vector6<f64>) -> Matrix4<f64> {
        let (rotation, translation) = split(twist);
        let mut matrix = Matrix4::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation.cross_matrix());
        matrix.fixed_view_mut::<3, 1>(0, 3).copy_from(&translation);
        let (mut term, mut sum) = (Matrix4::identity(), Matrix4::identity());
        for i in 1..40 {
            term = term * matrix / f64::from(i);
            sum += term;
        }
        sum
    }

    #[test]
    fn exp_is_the_matrix_exponential() {
        for twist in twists() {
            let error = (exp(&twist).to_homogeneous() - matrix_exp(&twist)).amax();
            assert!(error < 2e-14, "{twist:?}: {error:e}");
        }
    }

    #[test]
    fn log_inverts_exp() {
        for twist in twists() {
            let error = (log(&exp(&twist)) - twist).amax();
            assert!(error < 2e-14 * (1.0 + twist.norm()), "{twist:?}: {error:e}");
            // The other quaternion of the same rotation.
            let motion = exp(&twist);
            let negated = UnitQuaternion::new_unchecked(-motion.rotation.into_inner());
            let same = Isometry3::from_parts(motion.translation, negated);
            assert!((exp(&log(&same)).to_homogeneous() - motion.to_homogeneous()).amax() < 2e-14);
        }
    }

    #[test]
    fn a_half_turn_has_a_logarithm() {
        let twist = join(&(Vector3::new(0.6, 0.8, 0.0) * PI), &Vector3::new(1.0, 2.0, 3.0));
        let back = exp(&log(&exp(&twist)));
        assert!((back.to_homogeneous() - matrix_exp(&twist)).amax() < 2e-14);
        assert!((log(&exp(&twist)).fixed_rows::<3>(0).norm() - PI).abs() < 1e-14);
    }

    #[test]
    fn the_adjoint_carries_twists() {
        let delta = Vector6::new(0.2, -0.1, 0.3, 0.5, 0.7, -0.4);
        for twist in twists() {
            let motion = exp(&twist);
            let left = motion * exp(&delta);
            let right = exp(&(adjoint(&motion) * delta)) * motion;
            assert!((left.to_homogeneous() - right.to_homogeneous()).amax() < 1e-14);
        }
    }

    #[test]
    fn jacobians_agree_with_differences() {
        const STEP: f64 = 1e-5;
        // Central differences of third derivatives up to about 1 leave STEP²/6, and rounding 1e-15/STEP.
        const TOLERANCE: f64 = 5e-10;
        for twist in twists().into_iter().filter(|twist| twist.norm() > 1e-30) {
            let jacobian = left_jacobian(&twist);
            for i in 0..6 {
                let delta = Vector6::ith(i, STEP);
                let change = log(&(exp(&(twist + delta)) * exp(&(twist - delta)).inverse())) / (2.0 * STEP);
                let error = (jacobian.column(i) - change).amax();
                assert!(error < TOLERANCE, "column {i} at {twist:?}: {error:e}");
            }
            let product = jacobian * left_jacobian_inverse(&twist);
            assert!((product - Matrix6::identity()).amax() < 1e-12, "{twist:?}");
        }
    }

    #[test]
    fn series_meet_the_closed_forms() {
        let (below, above) = (SERIES_BELOW * (1.0 - 1e-12), SERIES_BELOW);
        for function in [one_minus_cos, angle_minus_sin, fourth_order, fifth_order] {
            let error = function(below) / function(above) - 1.0;
            assert!(error.abs() < 3e-12, "{error:e}");
        }
    }
}
