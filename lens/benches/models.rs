//! ns per projection and unprojection of each camera model, over points spread over 60 % of its cone.
//!
//!     cargo bench -p coshade-lens --bench models
#![allow(missing_docs, reason = "criterion's macros write undocumented functions")]

use std::hint::black_box;

use coshade_lens::model::{CameraModel, ModelKind};
use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use nalgebra::{Vector2, Vector3};

/// Calibrations of real lenses.
fn lenses() -> Vec<CameraModel> {
    let lenses: [(ModelKind, &[f64]); 7] = [
        (ModelKind::Pinhole, &[500.0, 510.0, 320.25, 239.5]),
        (ModelKind::BrownConrady5, &[531.9, 531.9, 342.0, 233.1, -0.3109, 0.1636, 0.0, 0.0, -0.0236]),
        (
            ModelKind::BrownConrady5,
            &[531.9, 531.9, 342.0, 233.1, -0.3109, 0.1636, 0.000916, 0.000435, -0.0236],
        ),
        (ModelKind::Rational8, &[420.0, 421.0, 639.5, 479.5, 5.1, 2.4, -0.0003, 0.0002, 0.07, 5.5, 4.1, 0.6]),
        (ModelKind::KannalaBrandt4, &[336.3, 336.1, 543.0, 377.7, 0.00246, -0.007507, 0.000969, -0.000473]),
        (ModelKind::DoubleSphere, &[313.2, 313.2, 638.7, 514.4, -0.18, 0.59]),
        (ModelKind::Eucm, &[377.6, 377.8, 638.6, 514.0, 0.6, 1.08]),
    ];
    lenses.into_iter().filter_map(|(kind, params)| CameraModel::from_params(kind, params).ok()).collect()
}

fn points(lens: &CameraModel) -> Vec<Vector3<f64>> {
    (0..256)
        .map(|i| {
            let theta = 0.6 * lens.max_angle_rad() * f64::from(i) / 255.0;
            let (sin, cos) = (2.4 * f64::from(i)).sin_cos();
            2.0 * Vector3::new(theta.sin() * cos, theta.sin() * sin, theta.cos())
        })
        .collect()
}

/// Calls `f` with one of `inputs` after the other.
fn over<T, R>(c: &mut Criterion, name: &str, inputs: &[T], mut f: impl FnMut(&T) -> R) {
    let mut next = inputs.iter().cycle();
    c.bench_function(name, |b| {
        b.iter_batched(|| next.next(), |input| input.map(&mut f), BatchSize::SmallInput)
    });
}

fn models(c: &mut Criterion) {
    for lens in lenses() {
        let name = |what: &str| {
            let tangential = lens.params().get(6..8).is_some_and(|p| p != [0.0, 0.0]);
            let radial_only = lens.kind() == ModelKind::BrownConrady5 && !tangential;
            format!("{}{}/{what}", lens.kind(), if radial_only { " (p1 = p2 = 0)" } else { "" })
        };
        let points = points(&lens);
        let pixels: Vec<Vector2<f64>> = points.iter().filter_map(|p| lens.project(p)).collect();
        over(c, &name("project"), &points, |point| lens.project(point));
        over(c, &name("unproject"), &pixels, |px| lens.unproject(px));
        over(c, &name("project_jacobian"), &points, |point| lens.project_jacobian(point));
        over(c, &name("unproject_jacobian"), &pixels, |px| lens.unproject_jacobian(px));
        let (kind, params) = (lens.kind(), lens.params());
        c.bench_function(&name("construct"), |b| {
            b.iter(|| CameraModel::from_params(kind, black_box(&params)))
        });
    }
}

criterion_group!(benches, models);
criterion_main!(benches);
