//! Nonsense gets a message.

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_tracker::pose::{Before, Expected};
use coshade_tracker::{Body, BodyError, Detection, Past, PoseError, PoseSolver, TagObservation};
use nalgebra::{Isometry3, Matrix6, Vector2, Vector3};

use super::support::*;

#[test]
fn impossible_bodies_are_refused() {
    for size_m in [0.0, -0.05, f64::NAN, f64::INFINITY, 1e-300, 1e300] {
        let error = PoseSolver::new(&pinhole(), &Body::single(tag(3), size_m)).unwrap_err();
        assert!(matches!(error, BodyError::Size { .. }));
        assert!(error.to_string().contains("size of tag36h11 3"), "{error}");
    }
    let mut far = board(2, 1, 0.03, 0.04);
    far.tags[1].body_from_tag.translation.vector.y = f64::NAN;
    assert!(matches!(PoseSolver::new(&pinhole(), &far), Err(BodyError::Pose { tag: t, .. }) if t == tag(1)));
    far.tags[1].body_from_tag.translation.vector.y = 1e200;
    assert!(matches!(PoseSolver::new(&pinhole(), &far), Err(BodyError::Pose { .. })));
    let mut twice = board(2, 1, 0.03, 0.04);
    twice.tags[1].tag = tag(0);
    let error = PoseSolver::new(&pinhole(), &twice).unwrap_err();
    assert_eq!(error.to_string(), "board: tag36h11 0 is there twice; every tag is there once");
}

#[test]
fn impossible_shutters_are_refused() {
    let solver = PoseSolver::new(&pinhole(), &Body::single(tag(3), 0.05)).unwrap();
    for readout_s in [-0.01, 1.5, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            solver.clone().with_rolling_shutter(readout_s, 720),
            Err(PoseError::Shutter { .. })
        ));
    }
    for height_px in [0, 1] {
        assert!(solver.clone().with_rolling_shutter(0.01, height_px).is_ok());
    }
}

#[test]
fn impossible_pasts_are_refused() {
    let body = Body::single(tag(3), 0.05);
    let solver = PoseSolver::new(&pinhole(), &body).unwrap();
    let pose = facing(&Vector3::z(), 0.3, 0.5, &mut Random(1));
    let seen = observe(&pinhole(), &body, &pose, 0.1, &mut Random(1));
    let mut broken = pose;
    broken.translation.vector.x = f64::NAN;
    let expected = |camera_from_body, covariance| Past {
        expected: Some(Expected { camera_from_body, covariance }),
        before: None,
    };
    for past in [
        expected(broken, Matrix6::identity()),
        expected(pose, Matrix6::zeros()),
        expected(pose, Matrix6::repeat(f64::NAN)),
    ] {
        assert!(matches!(solver.solve(&seen, &past), Err(PoseError::Expected { .. })));
    }
    for (camera_from_body, elapsed_s) in
        [(broken, 0.1), (pose, 0.0), (pose, -0.1), (pose, f64::NAN), (pose, f64::INFINITY)]
    {
        let past = Past { expected: None, before: Some(Before { camera_from_body, elapsed_s }) };
        assert!(matches!(solver.solve(&seen, &past), Err(PoseError::Before { .. })));
    }
}

#[test]
fn without_a_tag_the_reason_is_told() {
    let body = Body::single(tag(3), 0.05);
    let solver = PoseSolver::new(&pinhole(), &body).unwrap();
    let error = solver.solve(&[], &Past::default()).unwrap_err();
    assert_eq!(error.to_string(), "no usable tag of tag36h11 3 in view");
    let stranger = observe(
        &pinhole(),
        &Body::single(tag(4), 0.05),
        &facing(&Vector3::z(), 0.3, 0.5, &mut Random(1)),
        0.1,
        &mut Random(1),
    );
    let error = solver.solve(&stranger, &Past::default()).unwrap_err();
    assert_eq!(error.to_string(), "no usable tag of tag36h11 3 in view (tag36h11 4: not a tag of the body)");
}

#[test]
fn the_wrong_lens_gets_a_message() {
    // A lens that sees 20° to each side, for an image that it cannot have made.
    let lens = [3000.0, 3000.0, 2000.0, 1500.0, 3.0, 0.0, 0.0, 0.0];
    let narrow = CameraModel::from_params(
        ModelKind::KannalaBrandt4,
        &[lens[0], lens[1], lens[2], lens[3], -2.0, 0.0, 0.0, 0.0],
    )
    .unwrap();
    let body = Body::single(tag(3), 0.05);
    let corners_px = [[10.0, 60.0], [60.0, 60.0], [60.0, 10.0], [10.0, 10.0]].map(Vector2::from);
    let detection = Detection { tag: tag(3), corners_px, hamming: 0, margin: 50.0 };
    let seen = [TagObservation::from_detection(&detection, 0.2)];
    let error = PoseSolver::new(&narrow, &body).unwrap().solve(&seen, &Past::default()).unwrap_err();
    assert!(
        error.to_string().contains("outside the lens' field of view; check that the calibration"),
        "{error}"
    );
}

#[test]
fn damaged_observations_give_poses_or_errors() {
    let body = board(3, 2, 0.03, 0.04);
    let fish = fisheye();
    let solvers = [PoseSolver::new(&pinhole(), &body).unwrap(), PoseSolver::new(&fish, &body).unwrap()];
    let mut random = Random(41);
    const VALUES: [f64; 12] = [
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        0.0,
        -0.0,
        1e308,
        -1e308,
        1e-308,
        1e20,
        -1.0,
        1e7,
        300.0,
    ];
    for round in 0..1000 {
        let truth =
            facing(&sight(&pinhole(), 100.0, &mut random), random.between(0.1, 2.0), 0.5, &mut random);
        let mut seen = observe(&pinhole(), &body, &truth, 0.1, &mut random);
        for _ in 0..1 + round % 8 {
            let pick = |count: usize, random: &mut Random| (random.uniform() * count as f64) as usize;
            if seen.is_empty() {
                break;
            }
            let which = pick(seen.len(), &mut random);
            let value = VALUES[pick(VALUES.len(), &mut random)];
            match pick(6, &mut random) {
                0 => seen[which].corners_px[pick(4, &mut random)].x = value,
                1 => seen[which].corners_px[pick(4, &mut random)].y = value,
                2 => seen[which].covariance_px2[pick(64, &mut random)] = value,
                3 => seen[which].corners_px = [seen[which].corners_px[0]; 4],
                4 => seen[which].tag = tag(pick(8, &mut random) as u32),
                _ => seen[which].corners_px.swap(0, pick(4, &mut random)),
            }
        }
        let mut before = Isometry3::identity();
        before.translation.vector.z = VALUES[round % VALUES.len()].clamp(-10.0, 10.0);
        let past =
            Past { expected: None, before: Some(Before { camera_from_body: before, elapsed_s: 0.03 }) };
        for solver in &solvers {
            let rolling = solver.clone().with_rolling_shutter(0.02, 720).unwrap();
            for result in [solver.solve(&seen, &Past::default()), rolling.solve(&seen, &past)] {
                let Ok(pose) = result else { continue };
                let estimate = &pose.estimate;
                assert!(estimate.camera_from_body.to_homogeneous().iter().all(|x| x.is_finite()));
                assert!(estimate.covariance.cholesky().is_some(), "{pose:?}");
                assert!(estimate.chi2.is_finite() && estimate.rms_px.is_finite());
                assert_eq!(pose.used.len() + pose.rejected.len(), seen.len());
            }
        }
    }
}
