//! `project` and `unproject` are inverse to each other to 10⁻⁹ over the whole cone.

use std::f64::consts::{PI, TAU};

use coshade_lens::model::{CameraModel, ModelKind};
use nalgebra::Vector2;
use proptest::prelude::*;

use crate::lenses::{self, angle, direction};

/// Fractions of the cone's angle: evenly, on the axis, right beside it, and ever closer to the edge; in its last 10⁻⁹
/// rounding decides on which side a point lies.
fn fractions() -> Vec<f64> {
    let even = (0..24).map(|i| f64::from(i) / 24.0);
    let near_axis = (1..16).map(|i| 10f64.powi(-i));
    let near_edge = (1..=9).map(|i| 1.0 - 10f64.powi(-i));
    even.chain(near_axis).chain(near_edge).chain([1e-30, 1e-160, 5e-324]).collect()
}

/// Both round trips of one lens; the largest errors in radians and in px (relative to 1 + |px|).
fn errors_over_the_cone(lens: &CameraModel) -> Result<(f64, f64), String> {
    let mut worst = (0.0f64, 0.0f64);
    for fraction in fractions() {
        for i in 0..9 {
            let phi = TAU * f64::from(i) / 9.0 + 0.01;
            let point = direction(lens.max_angle_rad() * fraction, phi);
            let at = format!("{lens:?} at {fraction} of {} rad, phi {phi}", lens.max_angle_rad());
            let px = lens.project(&(point * 3.7)).ok_or_else(|| format!("not projected: {at}"))?;
            let ray = lens.unproject(&px).ok_or_else(|| format!("not unprojected: {at}"))?;
            let again = lens.project(&ray).ok_or_else(|| format!("not projected again: {at}"))?;
            let (ray_error, px_error) = (angle(&ray, &point), (again - px).norm() / (1.0 + px.norm()));
            if ray_error.max(px_error).max((ray.norm() - 1.0).abs()) > 1e-9 {
                return Err(format!("{ray_error} rad, {px_error} px: {at}"));
            }
            worst = (worst.0.max(ray_error), worst.1.max(px_error));
        }
    }
    Ok(worst)
}

#[test]
fn known_lenses() {
    for lens in lenses::known() {
        let (rad, px) = errors_over_the_cone(&lens).unwrap();
        println!("{:15} {:6.2}°: {rad:.1e} rad, {px:.1e} px", lens.kind(), lens.max_angle_rad().to_degrees());
    }
}

#[test]
fn points_behind_the_camera() {
    for name in ["kannala_brandt4", "double_sphere", "eucm"] {
        let widest = lenses::known()
            .into_iter()
            .filter(|lens| lens.kind().name() == name)
            .max_by(|a, b| a.max_angle_rad().total_cmp(&b.max_angle_rad()))
            .unwrap();
        let point = direction(100f64.to_radians(), 1.0);
        let ray = lens_round_trip(&widest, &point);
        assert!(point.z < 0.0 && angle(&ray, &point) < 1e-12, "{name}");
    }
}

fn lens_round_trip(lens: &CameraModel, point: &nalgebra::Vector3<f64>) -> nalgebra::Vector3<f64> {
    lens.unproject(&lens.project(point).unwrap()).unwrap()
}

/// Without distortion the fish-eye model is r = f θ, right up to the backward axis, which itself has no image.
#[test]
fn a_linear_fish_eye_reaches_180_degrees() {
    let lens = CameraModel::from_params(
        "kannala_brandt4".parse().unwrap(),
        &[100.0, 100.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    );
    let lens = lens.unwrap();
    assert_eq!(lens.max_angle_rad(), PI);
    for beside in [1e-1, 1e-6, 1e-12] {
        let px = lens.project(&direction(PI - beside, 0.5)).unwrap();
        assert!((px.norm() - 100.0 * (PI - beside)).abs() < 1e-12 * 314.0);
        assert!(angle(&lens.unproject(&px).unwrap(), &direction(PI - beside, 0.5)) < 1e-14);
    }
    assert_eq!(lens.project(&-nalgebra::Vector3::z()), None);
    assert_eq!(lens.unproject(&Vector2::new(0.0, 314.2)), None);
}

/// A pixel either has a ray that lands on it, or none: also off the image and where the lens sees nothing.
#[test]
fn pixels_all_over_the_plane() {
    for lens in lenses::known() {
        let mut seen = 0;
        for i in -60..=60 {
            for j in -60..=60 {
                let px = Vector2::new(640.0 + 40.0 * f64::from(i), 480.0 + 40.0 * f64::from(j));
                let Some(ray) = lens.unproject(&px) else { continue };
                seen += 1;
                let again = lens.project(&ray).unwrap();
                assert!((again - px).norm() < 1e-9 * (1.0 + px.norm()), "{lens:?} {px:?}");
            }
        }
        assert!(seen > 20, "{lens:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn random_lenses(lens in lenses::random()) {
        errors_over_the_cone(&lens).map_err(TestCaseError::fail)?;
    }

    /// Tangential terms so strong that they shape the cone by themselves.
    #[test]
    fn tilted_lenses(k in proptest::array::uniform6(-2.0..2.0), p in proptest::array::uniform2(-1.0..1.0)) {
        let params = [1.0, 1.0, 0.0, 0.0, k[0], k[1], p[0], p[1], k[2], k[3], k[4], k[5]];
        let brown = CameraModel::from_params(ModelKind::BrownConrady5, &params[..9]).unwrap();
        let rational = CameraModel::from_params(ModelKind::Rational8, &params).unwrap();
        errors_over_the_cone(&brown).map_err(TestCaseError::fail)?;
        errors_over_the_cone(&rational).map_err(TestCaseError::fail)?;
    }
}
