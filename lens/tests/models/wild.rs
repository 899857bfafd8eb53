//! Whatever the numbers: no NaN, no panic, no hang, and a word on what is wrong.

use std::time::{Duration, Instant};

use coshade_lens::model::{CameraModel, ModelError, ModelKind};
use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;

/// Numbers that break formulas, and ordinary ones.
fn wild() -> impl Strategy<Value = f64> {
    prop_oneof![
        3 => proptest::num::f64::ANY,
        3 => -2.0..2.0f64,
        2 => -1e4..1e4f64,
        4 => proptest::sample::select(vec![
            0.0, -0.0, 1.0, -1.0, 0.5, 1.0 - f64::EPSILON / 2.0, f64::EPSILON, 5e-324, -5e-324, 2.3e-308, 1e-160, 1e-30,
            1e8, 1e30, -1e30, 1e150, -1e160, 1e308, -1e308, f64::MAX, f64::MIN, f64::INFINITY, f64::NEG_INFINITY, f64::NAN,
        ]),
    ]
}

/// Half of the lenses have ordinary intrinsics, or hardly any would be accepted.
fn wild_params() -> impl Strategy<Value = (ModelKind, Vec<f64>)> {
    let kind = proptest::sample::select(ModelKind::ALL.to_vec());
    let own = prop_oneof![proptest::collection::vec(wild(), 12), proptest::collection::vec(-1.0..1.0f64, 12)];
    (kind, own, any::<bool>()).prop_map(|(kind, mut params, tame)| {
        if tame {
            params[..4].copy_from_slice(&[500.0, 510.0, 320.0, 240.0]);
        }
        params.truncate(kind.param_names().len());
        (kind, params)
    })
}

fn assert_finite(values: &[f64], what: &str) -> Result<(), TestCaseError> {
    prop_assert!(values.iter().all(|v| v.is_finite()), "{}: {:?}", what, values);
    Ok(())
}

fn call_everything(lens: &CameraModel, point: &Vector3<f64>, px: &Vector2<f64>) -> Result<(), TestCaseError> {
    let what = format!("{lens:?} {point:?} {px:?}");
    if let Some(px) = lens.project(point) {
        assert_finite(px.as_slice(), &what)?;
    }
    if let Some(ray) = lens.unproject(px) {
        assert_finite(ray.as_slice(), &what)?;
        prop_assert!((ray.norm() - 1.0).abs() < 1e-9, "{}", what);
        prop_assert!(lens.project(&ray).is_some(), "{}", what);
    }
    if let Some(forward) = lens.project_jacobian(point) {
        assert_finite(forward.px.as_slice(), &what)?;
        assert_finite(forward.d_px_d_point.as_slice(), &what)?;
        assert_finite(forward.d_px_d_params.as_slice(), &what)?;
    }
    if let Some(back) = lens.unproject_jacobian(px) {
        assert_finite(back.ray.as_slice(), &what)?;
        assert_finite(back.d_ray_d_px.as_slice(), &what)?;
        assert_finite(back.d_ray_d_params.as_slice(), &what)?;
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20_000))]

    #[test]
    fn parameters_points_and_pixels(
        (kind, params) in wild_params(),
        point in (wild(), wild(), wild()),
        px in (wild(), wild()),
    ) {
        #[expect(clippy::disallowed_methods, reason = "guards the test against a hang; nothing is timed")]
        let start = Instant::now();
        match CameraModel::from_params(kind, &params) {
            Ok(lens) => {
                assert_finite(&lens.params(), "params")?;
                prop_assert_eq!(&lens.params(), &params);
                prop_assert!(lens.max_angle_rad() > 0.0 && lens.max_angle_rad() <= std::f64::consts::PI);
                call_everything(&lens, &Vector3::new(point.0, point.1, point.2), &Vector2::new(px.0, px.1))?;
                call_everything(&lens, &Vector3::new(0.1, 0.2, 1.0), &Vector2::new(300.0, 200.0))?;
                if let Ok(scaled) = lens.scaled(Vector2::new(point.0, point.1)) {
                    assert_finite(&scaled.params(), "scaled")?;
                }
            }
            Err(error) => {
                let text = error.to_string();
                prop_assert!(text.contains(kind.name()), "{}", text);
            }
        }
        prop_assert!(start.elapsed() < Duration::from_secs(1), "{:?} {:?}", kind, params);
    }
}

#[test]
fn messages_name_the_parameter_and_its_range() {
    let message = |kind, params: &[f64]| CameraModel::from_params(kind, params).unwrap_err().to_string();
    let all = [
        (
            message(ModelKind::Pinhole, &[-3.0, 1.0, 0.0, 0.0]),
            "pinhole: fx = -3 is not allowed; it must be a finite number above 0",
        ),
        (
            message(ModelKind::Pinhole, &[1.0, 1.0, f64::NAN, 0.0]),
            "cx = NaN is not allowed; it must be a finite number",
        ),
        (
            message(ModelKind::DoubleSphere, &[1.0, 1.0, 0.0, 0.0, 1.0, 0.5]),
            "xi = 1 is not allowed; it must be above -1 and below 1",
        ),
        (
            message(ModelKind::Eucm, &[1.0, 1.0, 0.0, 0.0, 1.5, 0.5]),
            "alpha = 1.5 is not allowed; it must be between 0 and 1",
        ),
        (message(ModelKind::Eucm, &[1.0, 1.0, 0.0, 0.0, 0.5, 0.0]), "beta = 0 is not allowed"),
        (
            message(ModelKind::KannalaBrandt4, &[1.0, 1.0, 0.0, 0.0, 0.0, f64::INFINITY, 0.0, 0.0]),
            "k2 = inf is not allowed",
        ),
        (
            message(ModelKind::KannalaBrandt4, &[1.0; 5]),
            "has 8 parameters (fx, fy, cx, cy, k1, k2, k3, k4), got 5",
        ),
        (
            message(ModelKind::BrownConrady5, &[1.0, 1.0, 0.0, 0.0, -1e9, 0.0, 0.0, 0.0, 0.0]),
            "k1, k2, p1, p2, k3",
        ),
    ];
    for (message, expected) in all {
        assert!(message.contains(expected), "{message}");
    }
    let unknown = "fisheye".parse::<ModelKind>().unwrap_err();
    assert_eq!(unknown, ModelError::UnknownName("fisheye".into()));
    assert!(unknown.to_string().contains("kannala_brandt4"));
}
