//! The largest angle: the projection is one-to-one inside, and not much beyond.

use std::f64::consts::{FRAC_PI_2, PI};

use coshade_lens::model::{CameraModel, ModelKind};
use nalgebra::{Matrix3x2, Vector3};
use proptest::prelude::*;

use crate::lenses::{self, direction};

const STEPS: u32 = 2000;

/// The radius of the image over the angle, along one direction from the axis, in units of the focal length.
fn image_radius(lens: &CameraModel, theta: f64, phi: f64) -> Option<f64> {
    let center = lens.project(&Vector3::z())?;
    let offset = lens.project(&direction(theta, phi))? - center;
    Some((offset.x / lens.intrinsics().fx).hypot(offset.y / lens.intrinsics().fy))
}

/// Without tangential terms the image must move outwards at every step; with them, its Jacobian on the sphere must
/// stay positive definite (the definition of one-to-one that the models use).
fn check_inside(lens: &CameraModel) -> Result<(), TestCaseError> {
    for phi in [0.0, 0.7, 2.5, 4.0, 5.5] {
        let mut last = -1.0;
        for i in 0..STEPS {
            let theta = lens.max_angle_rad() * f64::from(i) / f64::from(STEPS);
            if !has_tangential(lens) {
                let radius = image_radius(lens, theta, phi).unwrap();
                prop_assert!(radius > last, "{lens:?} turns at {theta}");
                last = radius;
            }
            if let Some(forward) = lens.project_jacobian(&direction(theta, phi)) {
                let (out, around) =
                    (direction(theta + FRAC_PI_2, phi), direction(FRAC_PI_2, phi + FRAC_PI_2));
                let turn = forward.d_px_d_point * Matrix3x2::from_columns(&[out, around]);
                prop_assert!(turn.determinant() > 0.0, "{lens:?} folds at {theta}, {phi}");
            }
        }
        let beyond = lens.max_angle_rad() * (1.0 + 1e-12);
        prop_assert!(beyond > PI || lens.project(&direction(beyond, phi)).is_none(), "{lens:?}");
    }
    Ok(())
}

fn has_tangential(lens: &CameraModel) -> bool {
    matches!(lens.kind(), ModelKind::BrownConrady5 | ModelKind::Rational8)
        && lens.params()[6..8] != [0.0, 0.0]
}

/// The image radius by the plain published formula, with no regard to any cone.
fn formula(kind: ModelKind, p: &[f64], theta: f64) -> f64 {
    let (sin, cos) = theta.sin_cos();
    match kind {
        ModelKind::Pinhole => theta.tan(),
        ModelKind::BrownConrady5 | ModelKind::Rational8 => {
            let (r, s) = (theta.tan(), theta.tan().powi(2));
            let k = |i: usize| p.get(i).copied().unwrap_or(0.0);
            r * (1.0 + k(4) * s + k(5) * s.powi(2) + k(8) * s.powi(3))
                / (1.0 + k(9) * s + k(10) * s.powi(2) + k(11) * s.powi(3))
        }
        ModelKind::KannalaBrandt4 => {
            theta + (0..4).map(|i| p[4 + i] * theta.powi(3 + 2 * i as i32)).sum::<f64>()
        }
        ModelKind::DoubleSphere => {
            let zeta = cos + p[4];
            sin / (p[5] * sin.hypot(zeta) + (1.0 - p[5]) * zeta)
        }
        ModelKind::Eucm => sin / (p[4] * (p[5] * sin * sin + cos * cos).sqrt() + (1.0 - p[4]) * cos),
    }
}

/// Within a hundredth of the cone beyond its edge the formula turns back, flips its sign or leaves to infinity; or the
/// cone ends where every lens of its kind does (90° or 180°).
fn check_beyond(lens: &CameraModel) -> Result<(), TestCaseError> {
    let edge = lens.max_angle_rad();
    let natural_end = match lens.kind() {
        ModelKind::KannalaBrandt4 => PI,
        ModelKind::DoubleSphere | ModelKind::Eucm => f64::INFINITY,
        _ => FRAC_PI_2,
    };
    if edge >= natural_end - 2e-8 {
        return Ok(());
    }
    let params = lens.params();
    let radius = |i: u32| formula(lens.kind(), &params, edge * (1.0 + 0.01 * f64::from(i) / 1000.0));
    let turns = (0..1000).any(|i| {
        let (a, b) = (radius(i), radius(i + 1));
        b <= a || a < 0.0
    });
    prop_assert!(turns, "{lens:?} goes on beyond {edge}");
    Ok(())
}

#[test]
fn known_lenses() {
    for lens in lenses::known() {
        check_inside(&lens).unwrap();
        if !has_tangential(&lens) {
            check_beyond(&lens).unwrap();
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn random_lenses(lens in lenses::random()) {
        check_inside(&lens)?;
        let mut params = lens.params();
        if has_tangential(&lens) {
            params[6..8].fill(0.0);
        }
        check_beyond(&CameraModel::from_params(lens.kind(), &params).unwrap())?;
    }

    /// With tangential terms the cone ends exactly where the image turns back in the direction opposite to (p2, p1):
    /// the slope h' − 6 r |p| along it is zero (within the margin: 10⁻⁴ of its terms).
    #[test]
    fn tangential_terms_end_the_cone_where_the_image_turns(
        k1 in -0.5..0.0, p1 in -0.05..0.05, p2 in -0.05..0.05,
    ) {
        let params = [1.0, 1.0, 0.0, 0.0, k1, 0.0, p1, p2, 0.0];
        let lens = CameraModel::from_params(ModelKind::BrownConrady5, &params).unwrap();
        let (r, p) = (lens.max_angle_rad().tan(), p1.hypot(p2));
        let slope = 1.0 + 3.0 * k1 * r * r - 6.0 * r * p;
        prop_assert!(slope > 0.0 && slope < 1.01e-4 * (1.0 - 3.0 * k1 * r * r + 6.0 * r * p), "{slope}");
    }
}

/// Closed forms: Brown's 1 + 3 k1 r² = 0, the rational's pole 1 + k4 r² = 0, Kannala–Brandt's 1 + 3 k1 θ² = 0,
/// EUCM's and (with ξ = 0) double sphere's cos ψ = −(1−α)/α.
#[test]
fn closed_forms() {
    let cone = |kind, own: &[f64]| {
        let params = [&[500.0, 500.0, 0.0, 0.0], own].concat();
        CameraModel::from_params(kind, &params).unwrap().max_angle_rad()
    };
    let close = |got: f64, want: f64| assert!(got < want && got > want - 3e-4, "{got} {want}");
    close(cone(ModelKind::BrownConrady5, &[-0.3, 0.0, 0.0, 0.0, 0.0]), (1.0f64 / 0.9).sqrt().atan());
    close(cone(ModelKind::Rational8, &[0.0, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0]), 2f64.sqrt().atan());
    close(cone(ModelKind::KannalaBrandt4, &[-0.1, 0.0, 0.0, 0.0]), (1.0f64 / 0.3).sqrt());
    close(cone(ModelKind::DoubleSphere, &[0.0, 0.7]), (-3.0f64 / 7.0).acos());
    close(cone(ModelKind::Eucm, &[0.7, 1.0]), (-3.0f64 / 7.0).acos());
    close(cone(ModelKind::Eucm, &[0.3, 1.0]), (-3.0f64 / 7.0).acos());
    assert_eq!(cone(ModelKind::Pinhole, &[]), FRAC_PI_2);
    assert!(cone(ModelKind::KannalaBrandt4, &[0.1, 0.0, 0.0, 0.0]) == PI);
}

/// The double sphere's image ends where (ξ+c)² = w² (1 + 2ξc + ξ²), ξ + c < 0, for c = cos θ: c = −ξ(1−w²) −
/// w√(1−ξ²(1−w²)). The margin takes 10⁻⁴ off 1 + cos ψ or so, which is up to acos(2·10⁻⁴ − 1) off ψ near 180°.
#[test]
fn the_double_sphere_ends_where_its_image_does() {
    for i in -9..=9 {
        for j in 1..=19 {
            let (xi, alpha) = (0.1 * f64::from(i), 0.05 * f64::from(j));
            let lens = CameraModel::from_params(ModelKind::DoubleSphere, &[1.0, 1.0, 0.0, 0.0, xi, alpha]);
            let w = alpha.min(1.0 - alpha) / alpha.max(1.0 - alpha);
            let rest = 1.0 - w * w;
            let cos = -xi * rest - w * (1.0 - xi * xi * rest).max(0.0).sqrt();
            let (got, exact) = (lens.unwrap().max_angle_rad(), cos.max(-1.0).acos());
            let margin = if j == 10 { 0.3 } else { 0.01 };
            assert!(got < exact && got > exact - margin, "xi {xi} alpha {alpha}: {got} {exact}");
        }
    }
}
