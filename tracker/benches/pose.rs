//! Time of poses: of a single tag, of a board of twelve, with a wrong tag among them.

use std::hint::black_box;

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_tracker::pose::Before;
use coshade_tracker::{Body, BodyTag, Family, Past, PoseSolver, TagId, TagObservation, planar_poses};
use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, SMatrix, Translation3, Vector2, Vector3};

const SIZE_M: f64 = 0.03;

fn board(columns: u32, rows: u32) -> Body {
    let tags = (0..columns * rows).map(|id| {
        let (column, row) = (f64::from(id % columns), f64::from(id / columns));
        let body_from_tag = Isometry3::translation(column * 0.04 - 0.06, row * 0.04 - 0.04, 0.0);
        BodyTag { tag: TagId { family: Family::Tag36h11, id }, size_m: SIZE_M, body_from_tag }
    });
    Body { name: "board".into(), tags: tags.collect() }
}

fn camera_from_body() -> Isometry3<f64> {
    Translation3::new(0.05, 0.02, 0.5) * Isometry3::rotation(Vector3::new(2.7, 0.3, 0.2))
}

/// Corners with errors of about 0.1 px.
fn observe(lens: &CameraModel, body: &Body) -> Vec<TagObservation> {
    let camera_from_body = camera_from_body();
    let mut number = 0.0_f64;
    let mut error_px = || {
        number += 1.0;
        0.14 * (number * number).sin()
    };
    let observe = |own: &BodyTag| TagObservation {
        tag: own.tag,
        corners_px: own.corners_m().map(|corner| {
            let px = lens.project(&(camera_from_body * corner).coords).unwrap_or_default();
            px + Vector2::new(error_px(), error_px())
        }),
        covariance_px2: SMatrix::identity() * 0.01,
    };
    body.tags.iter().map(observe).collect()
}

fn poses(criterion: &mut Criterion) {
    let lenses: [(_, _, &[f64]); 2] = [
        ("pinhole", ModelKind::Pinhole, &[800.0, 800.0, 640.0, 360.0]),
        ("fish-eye", ModelKind::KannalaBrandt4, &[800.0, 800.0, 640.0, 360.0, 0.02, -0.006, 0.0008, 0.0]),
    ];
    for (name, kind, params) in lenses {
        let Ok(lens) = CameraModel::from_params(kind, params) else { continue };
        let single = observe(&lens, &board(1, 1)).remove(0);
        criterion.bench_function(&format!("{name}: both poses of a tag"), |bencher| {
            bencher.iter(|| planar_poses(&lens, black_box(&single), SIZE_M));
        });
        for (columns, rows) in [(1, 1), (4, 3)] {
            let body = board(columns, rows);
            let Ok(solver) = PoseSolver::new(&lens, &body) else { continue };
            let seen = observe(&lens, &body);
            let count = columns * rows;
            criterion.bench_function(&format!("{name}: body of {count} tags"), |bencher| {
                bencher.iter(|| solver.solve(black_box(&seen), &Past::default()));
            });
            let Ok(rolling) = solver.clone().with_rolling_shutter(0.02, 720) else { continue };
            let before = Before { camera_from_body: camera_from_body(), elapsed_s: 0.03 };
            let past = Past { expected: None, before: Some(before) };
            criterion.bench_function(&format!("{name}: rolling shutter, body of {count} tags"), |bencher| {
                bencher.iter(|| rolling.solve(black_box(&seen), &past));
            });
            if count > 1 {
                let mut wrong = seen.clone();
                wrong
                    .iter_mut()
                    .take(1)
                    .for_each(|seen| seen.corners_px.iter_mut().for_each(|px| px.x += 30.0));
                criterion.bench_function(&format!("{name}: one of {count} tags wrong"), |bencher| {
                    bencher.iter(|| solver.solve(black_box(&wrong), &Past::default()));
                });
            }
        }
    }
}

criterion_group!(benches, poses);
criterion_main!(benches);
