//! Lenses and directions for the other tests.

use coshade_lens::model::{CameraModel, ModelKind};
use nalgebra::Vector3;
use proptest::prelude::*;

/// Calibrations of real lenses, and the limits of each model's formula.
pub fn known() -> Vec<CameraModel> {
    use ModelKind::*;
    let lenses: [(ModelKind, &[f64]); 20] = [
        (Pinhole, &[500.0, 510.0, 320.25, 239.5]),
        (BrownConrady5, &[531.9, 531.9, 342.0, 233.1, -0.3109, 0.1636, 0.000916, 0.000435, -0.0236]),
        (BrownConrady5, &[770.2, 768.8, 393.9, 315.1, -0.0331, 2.391, 0.005464, -0.000906, -13.26]),
        (BrownConrady5, &[700.0, 690.0, 639.5, 359.5, 0.12, 0.03, -0.002, 0.001, 0.01]),
        (BrownConrady5, &[700.0, 690.0, 639.5, 359.5, 0.0, 0.0, 0.0, 0.0, 0.0]),
        (Rational8, &[610.0, 609.0, 638.0, 366.0, 0.62, -2.7, 0.0007, -0.0002, 1.6, 0.5, -2.5, 1.5]),
        (Rational8, &[420.0, 421.0, 639.5, 479.5, 5.1, 2.4, -0.0003, 0.0002, 0.07, 5.5, 4.1, 0.6]),
        (Rational8, &[420.0, 421.0, 639.5, 479.5, 0.1, 0.0, 0.0, 0.0, 0.0, -0.5, 0.0, 0.0]),
        (KannalaBrandt4, &[336.3, 336.1, 543.0, 377.7, 0.00246, -0.007507, 0.000969, -0.000473]),
        (KannalaBrandt4, &[384.7, 385.7, 639.5, 477.9, 0.03276, -0.02968, 0.004865, 0.000562]),
        (KannalaBrandt4, &[380.3, 380.2, 509.9, 514.3, 0.006135, -0.003204, 0.001345, -0.000612]),
        (KannalaBrandt4, &[300.0, 300.0, 511.5, 511.5, 0.0, 0.0, 0.0, 0.0]),
        (DoubleSphere, &[313.2, 313.2, 638.7, 514.4, -0.18, 0.59]),
        (DoubleSphere, &[250.0, 251.0, 319.5, 239.5, 0.3, 0.35]),
        (DoubleSphere, &[250.0, 251.0, 319.5, 239.5, 0.0, 0.0]),
        (DoubleSphere, &[250.0, 251.0, 319.5, 239.5, 0.9, 0.5]),
        (DoubleSphere, &[250.0, 251.0, 319.5, 239.5, -0.9, 1.0]),
        (Eucm, &[377.6, 377.8, 638.6, 514.0, 0.6, 1.08]),
        (Eucm, &[250.0, 251.0, 319.5, 239.5, 0.0, 0.7]),
        (Eucm, &[250.0, 251.0, 319.5, 239.5, 1.0, 2.0]),
    ];
    lenses.map(|(kind, params)| CameraModel::from_params(kind, params).unwrap()).to_vec()
}

/// Any lens that a calibration might end at, mild or strong, whatever its cone.
pub fn random() -> impl Strategy<Value = CameraModel> {
    let intrinsics = (100.0..3000.0, 0.8..1.2, 0.0..2000.0, 0.0..1500.0)
        .prop_map(|(fx, aspect, cx, cy)| [fx, fx * aspect, cx, cy]);
    let kind = proptest::sample::select(ModelKind::ALL.to_vec());
    (kind, intrinsics, proptest::collection::vec(-1.0..1.0, 8)).prop_filter_map(
        "no field of view",
        |(kind, intrinsics, unit)| {
            let own = coefficients(kind, &unit);
            CameraModel::from_params(kind, &[&intrinsics[..], &own[..]].concat()).ok()
        },
    )
}

/// The model's own parameters from numbers in [−1, 1].
fn coefficients(kind: ModelKind, unit: &[f64]) -> Vec<f64> {
    let scales: &[f64] = match kind {
        ModelKind::Pinhole => &[],
        ModelKind::BrownConrady5 => &[0.6, 0.6, 0.05, 0.05, 0.6],
        ModelKind::Rational8 => &[1.5, 1.5, 0.05, 0.05, 1.5, 1.5, 1.5, 1.5],
        ModelKind::KannalaBrandt4 => &[0.2, 0.1, 0.05, 0.02],
        ModelKind::DoubleSphere => return vec![0.95 * unit[0], 0.5 + 0.5 * unit[1]],
        ModelKind::Eucm => return vec![0.5 + 0.5 * unit[0], 1.7 + 1.5 * unit[1]],
    };
    scales.iter().zip(unit).map(|(scale, u)| scale * u).collect()
}

/// The unit direction at `theta` from the axis, `phi` around it.
pub fn direction(theta: f64, phi: f64) -> Vector3<f64> {
    Vector3::new(theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos())
}

/// The angle between two vectors, accurate for small ones too.
pub fn angle(a: &Vector3<f64>, b: &Vector3<f64>) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}
