//! Analytic derivatives against central differences.
//!
//! The difference quotient D(h) is off by c h² + O(h⁴) and by rounding, at most C ε/h. Since D(h) − D(h/2) = ¾ c h²,
//! |D(h) − D(h/2)| + C ε/h bounds the error of D(h/2), three times over; and it must itself be small, or the test
//! would prove nothing.

use coshade_lens::model::CameraModel;
use nalgebra::SVector;
use proptest::prelude::*;

use crate::lenses::{self, direction};

/// Step of every difference quotient, relative to the size of what is varied.
const STEP: f64 = 1e-4;
/// Roundings in one evaluation, times the condition number of the (well inside) points used.
const ROUNDINGS: f64 = 1e3;

/// Compares `analytic` with the derivative of `f` at 0, where the argument counts in units of `scale`, and the value
/// has the given `size`.
fn check<const N: usize>(
    what: &str,
    analytic: SVector<f64, N>,
    size: f64,
    scale: f64,
    f: impl Fn(f64) -> Option<SVector<f64, N>>,
) -> Result<(), TestCaseError> {
    let quotient = |h: f64| Some((f(h * scale)? - f(-h * scale)?) / (2.0 * h));
    let (Some(coarse), Some(fine)) = (quotient(STEP), quotient(STEP / 2.0)) else {
        return Err(TestCaseError::fail(format!("{what}: the step leaves the cone")));
    };
    let tolerance = (coarse - fine).norm() + ROUNDINGS * f64::EPSILON * size / STEP;
    let error = (analytic * scale - fine).norm();
    prop_assert!(error <= tolerance, "{what}: {error} > {tolerance}: {} {fine}", analytic * scale);
    prop_assert!(tolerance < 1e-4 * (size + fine.norm()), "{what}: loose, {tolerance}");
    Ok(())
}

/// One unit of each parameter: focal lengths for the intrinsics, 0.01 for coefficients (of powers up to r⁷).
fn unit_of(lens: &CameraModel, param: usize) -> f64 {
    if param < 4 { lens.intrinsics().fx } else { 0.01 }
}

/// Whether both ends of the step are lenses: alpha = 0 has no neighbour below.
fn can_vary(lens: &CameraModel, param: usize) -> bool {
    let step = STEP * unit_of(lens, param);
    varied(lens, param, step).is_some() && varied(lens, param, -step).is_some()
}

fn varied(lens: &CameraModel, param: usize, by: f64) -> Option<CameraModel> {
    let mut params = lens.params();
    params[param] += by;
    CameraModel::from_params(lens.kind(), &params).ok()
}

fn check_project(lens: &CameraModel, theta: f64, phi: f64) -> Result<(), TestCaseError> {
    let distance = 2.5;
    let point = direction(theta, phi) * distance;
    let forward = lens.project_jacobian(&point).unwrap();
    prop_assert_eq!(Some(forward.px), lens.project(&point));
    let size = lens.intrinsics().fx + forward.px.norm();
    for axis in 0..3 {
        let analytic = forward.d_px_d_point.column(axis).into_owned();
        check(&format!("{lens:?} point[{axis}] at {theta}, {phi}"), analytic, size, distance, |by| {
            let mut point = point;
            point[axis] += by;
            lens.project(&point)
        })?;
    }
    for (i, name) in lens.param_names().iter().enumerate().filter(|(i, _)| can_vary(lens, *i)) {
        let analytic = forward.d_px_d_params.column(i).into_owned();
        check(&format!("{lens:?} {name} at {theta}, {phi}"), analytic, size, unit_of(lens, i), |by| {
            varied(lens, i, by)?.project(&point)
        })?;
    }
    let unused = forward.d_px_d_params.columns_range(lens.params().len()..);
    prop_assert!(unused.iter().all(|d| *d == 0.0));
    Ok(())
}

fn check_unproject(lens: &CameraModel, theta: f64, phi: f64) -> Result<(), TestCaseError> {
    let px = lens.project(&direction(theta, phi)).unwrap();
    let back = lens.unproject_jacobian(&px).unwrap();
    prop_assert_eq!(Some(back.ray), lens.unproject(&px));
    for axis in 0..2 {
        let analytic = back.d_ray_d_px.column(axis).into_owned();
        check(
            &format!("{lens:?} px[{axis}] at {theta}, {phi}"),
            analytic,
            1.0,
            lens.intrinsics().fx,
            |by| {
                let mut px = px;
                px[axis] += by;
                lens.unproject(&px)
            },
        )?;
    }
    for (i, name) in lens.param_names().iter().enumerate().filter(|(i, _)| can_vary(lens, *i)) {
        let analytic = back.d_ray_d_params.column(i).into_owned();
        check(&format!("{lens:?} ray by {name} at {theta}, {phi}"), analytic, 1.0, unit_of(lens, i), |by| {
            varied(lens, i, by)?.unproject(&px)
        })?;
    }
    Ok(())
}

/// The angles that are tested: on the axis, beside it, and out to 70 % of the cone but not so far that a pinhole's
/// image grows without bound.
fn angles(lens: &CameraModel) -> [f64; 5] {
    let widest = 0.7 * lens.max_angle_rad();
    [0.0, 1e-9, 0.2 * widest, 0.6 * widest, widest]
}

#[test]
fn known_lenses() {
    for lens in lenses::known() {
        for theta in angles(&lens) {
            for phi in [0.0, 1.0, 2.5, 4.0, 5.5] {
                check_project(&lens, theta, phi).unwrap();
                check_unproject(&lens, theta, phi).unwrap();
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn random_lenses(lens in lenses::random(), phi in 0.0..6.3) {
        for theta in angles(&lens) {
            check_project(&lens, theta, phi)?;
            check_unproject(&lens, theta, phi)?;
        }
    }
}

/// Scaling the point by a power of two leaves the pixel and divides the derivative, also where squares overflow.
#[test]
fn any_distance() {
    for lens in lenses::known() {
        let point = direction(0.3, 1.0);
        let near = lens.project_jacobian(&point).unwrap();
        for exponent in [-900, -300, 300, 900] {
            let scale = 2f64.powi(exponent);
            let far = lens.project_jacobian(&(point * scale)).unwrap();
            assert!((far.px - near.px).norm() < 1e-12 * near.px.norm(), "{lens:?}");
            let difference = far.d_px_d_point * scale - near.d_px_d_point;
            assert!(difference.norm() < 1e-12 * near.d_px_d_point.norm(), "{lens:?} {exponent}");
        }
    }
}
