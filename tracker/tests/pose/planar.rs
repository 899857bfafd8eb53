//! Both poses of a single tag.

use coshade_lens::model::{CameraModel, ModelKind};
use coshade_tracker::{Body, PlanarError, TagObservation, lie, planar_poses};
use nalgebra::{Isometry3, SMatrix, UnitQuaternion, Vector2, Vector3};

use super::support::*;

const SIZE_M: f64 = 0.08;

fn lenses() -> Vec<(CameraModel, f64)> {
    let brown = [900.0, 905.0, 640.0, 350.0, -0.28, 0.09, 0.001, -0.0007, -0.012];
    vec![
        (pinhole(), 40.0),
        (CameraModel::from_params(ModelKind::BrownConrady5, &brown).unwrap(), 35.0),
        (fisheye(), 90.0),
        (
            CameraModel::from_params(ModelKind::DoubleSphere, &[350.0, 350.0, 800.0, 800.0, -0.2, 0.6])
                .unwrap(),
            85.0,
        ),
    ]
}

fn observation(
    lens: &CameraModel,
    pose: &Isometry3<f64>,
    sigma_px: f64,
    random: &mut Random,
) -> TagObservation {
    observe(lens, &Body::single(tag(5), SIZE_M), pose, sigma_px, random).remove(0)
}

/// A direction up to `limit_deg` off the axis.
fn direction(limit_deg: f64, random: &mut Random) -> Vector3<f64> {
    let (sin, cos) = random.between(0.0, limit_deg).to_radians().sin_cos();
    let (y, x) = random.between(0.0, std::f64::consts::TAU).sin_cos();
    Vector3::new(x * sin, y * sin, cos)
}

#[test]
fn without_noise_the_pose_is_exact() {
    let mut random = Random(21);
    for (lens, limit_deg) in lenses() {
        for _ in 0..300 {
            let (distance_m, tilt) = (random.between(0.3, 3.0), random.between(0.0, 80f64.to_radians()));
            let truth = facing(&direction(limit_deg, &mut random), distance_m, tilt, &mut random);
            let mut seen = observation(&lens, &truth, 0.0, &mut random);
            seen.covariance_px2 = SMatrix::identity() * 0.01;
            let [best, other] = planar_poses(&lens, &seen, SIZE_M).unwrap();
            let error = lie::log(&(best.camera_from_tag * truth.inverse()));
            // A step below 10⁻⁵ standard deviations ends the fit; near facing, some deviations are most of a radian.
            let deviations = best.covariance.diagonal().map(f64::sqrt);
            assert!(error.component_div(&deviations).amax() < 1e-4, "{:?}: {error:?}", lens.kind());
            assert!(best.rms_px < 1e-5 && best.chi2 <= other.chi2);
            assert!(best.angle_to_rad(&other) > 0.0 || tilt < 1e-3);
        }
    }
}

#[test]
fn the_second_pose_is_the_mirrored_one() {
    let mut random = Random(22);
    for (lens, limit_deg) in lenses() {
        for _ in 0..200 {
            // Far away: 20 to 30 px, so that both are minima.
            let distance_m = lens.intrinsics().fx * SIZE_M / random.between(20.0, 30.0);
            let tilt = random.between(0.4, 1.1);
            let truth = facing(&direction(limit_deg, &mut random), distance_m, tilt, &mut random);
            let seen = observation(&lens, &truth, 0.02, &mut random);
            let poses = planar_poses(&lens, &seen, SIZE_M).unwrap();
            let nearest = |rotation: &UnitQuaternion<f64>| {
                poses
                    .map(|pose| pose.camera_from_tag.rotation.angle_to(rotation))
                    .into_iter()
                    .fold(9.0, f64::min)
            };
            // The mirrored pose shifts by the perspective it cannot explain: some of half a side over the distance
            // (1 to 2 %), divided by the sine of the tilt.
            assert!(nearest(&truth.rotation) < 0.06, "{}", nearest(&truth.rotation));
            assert!(nearest(&mirrored(&truth)) < 0.15, "{}", nearest(&mirrored(&truth)));
        }
    }
}

#[test]
fn errors_are_as_large_as_the_covariance_says_out_to_94_degrees() {
    const VIEWS: u32 = 1000;
    let mut random = Random(23);
    let lens = fisheye();
    for (low_deg, high_deg) in [(0.0, 30.0), (60.0, 80.0), (80.0, 94.0)] {
        let (mut distance, mut chi2) = (0.0, 0.0);
        for _ in 0..VIEWS {
            let (sin, cos) = random.between(low_deg, high_deg).to_radians().sin_cos();
            let sight = Vector3::new(sin, 0.0, cos);
            // About 100 px; not so wide that a corner leaves the lens' cone.
            let truth = facing(&sight, 0.34, random.between(0.4, 1.0), &mut random);
            let Some(seen) = observe(&lens, &Body::single(tag(5), SIZE_M), &truth, 0.1, &mut random).pop()
            else {
                continue;
            };
            let [best, _] = planar_poses(&lens, &seen, SIZE_M).unwrap();
            let error = lie::log(&(best.camera_from_tag * truth.inverse()));
            distance += error.dot(&best.covariance.cholesky().unwrap().solve(&error)) / f64::from(VIEWS);
            chi2 += best.chi2 / f64::from(VIEWS);
        }
        println!("{low_deg}–{high_deg}° off the axis: mean distance {distance:.2} of 6, χ² {chi2:.2} of 2");
        // Deviations of the means over 1000 views: √(12/1000) = 0.11 and √(4/1000) = 0.063.
        assert!((distance - 6.0).abs() < 0.55 && (chi2 - 2.0).abs() < 0.32, "{low_deg}°: {distance}, {chi2}");
    }
}

fn seen_by(lens: &CameraModel, corners: [[f64; 2]; 4]) -> Result<(), PlanarError> {
    let corners_px = corners.map(Vector2::from);
    let seen = TagObservation { tag: tag(5), corners_px, covariance_px2: SMatrix::identity() };
    planar_poses(lens, &seen, SIZE_M).map(|_| ())
}

#[test]
fn what_is_no_tag_is_named() {
    let lens = pinhole();
    let [a, b, c, d] = [[100.0, 200.0], [200.0, 205.0], [190.0, 100.0], [95.0, 110.0]];
    assert_eq!(seen_by(&lens, [a, b, c, d]), Ok(()));
    assert_eq!(seen_by(&lens, [d, c, b, a]), Err(PlanarError::Mirrored { tag: tag(5) }));
    let no_quadrilateral = Err(PlanarError::NoQuadrilateral { tag: tag(5) });
    assert_eq!(seen_by(&lens, [a, c, b, d]), no_quadrilateral); // a bow tie
    assert_eq!(seen_by(&lens, [a, b, [130.0, 190.0], d]), no_quadrilateral); // a dent
    assert_eq!(seen_by(&lens, [a, a, a, a]), no_quadrilateral);
    assert_eq!(seen_by(&lens, [a, b, a, b]), no_quadrilateral);
    assert_eq!(seen_by(&lens, [[0.0, 0.0], [10.0, 10.0], [20.0, 20.0], [30.0, 30.0]]), no_quadrilateral);
    for nonsense in [f64::NAN, f64::INFINITY, -1e300] {
        let error = seen_by(&lens, [a, b, [nonsense, 100.0], d]).unwrap_err();
        assert!(
            matches!(error, PlanarError::OutsideLens { corner: 2, .. } | PlanarError::NoQuadrilateral { .. }),
            "{error}"
        );
    }
    let outside = seen_by(&fisheye(), [a, b, c, [-3000.0, 0.0]]).unwrap_err();
    assert!(
        outside.to_string().contains("corner 3 of tag36h11 5") && outside.to_string().contains("calibration")
    );

    let mut seen = TagObservation {
        tag: tag(5),
        corners_px: [a, b, c, d].map(Vector2::from),
        covariance_px2: SMatrix::identity(),
    };
    for size_m in [0.0, -0.1, f64::NAN, f64::INFINITY, 1e9, 1e-30] {
        assert!(matches!(planar_poses(&lens, &seen, size_m), Err(PlanarError::Size { .. })));
    }
    for covariance in
        [SMatrix::zeros(), -SMatrix::<f64, 8, 8>::identity(), SMatrix::repeat(f64::NAN), SMatrix::repeat(1.0)]
    {
        seen.covariance_px2 = covariance;
        assert_eq!(planar_poses(&lens, &seen, SIZE_M), Err(PlanarError::Covariance { tag: tag(5) }));
    }
}

/// Corners with errors of 0.1 px through a distorted lens, and OpenCV 5's poses: `solvePnPGeneric` (IPPE) and then
/// `solvePnPRefineLM` to convergence; rotation vector, translation in metres, root mean square distance in pixels.
struct Reference {
    corners_px: [[f64; 2]; 4],
    poses: [([f64; 3], [f64; 3], f64); 2],
}

#[test]
fn both_poses_are_those_of_opencv() {
    let params = [900.0, 905.0, 640.0, 350.0, -0.28, 0.09, 0.001, -0.0007, -0.012];
    let lens = CameraModel::from_params(ModelKind::BrownConrady5, &params).unwrap();
    let references = [
        Reference {
            corners_px: [[578.981, 334.115], [560.241, 264.311], [491.243, 273.108], [509.833, 345.732]],
            poses: [
                ([-1.7830011, 2.2549295, -0.7636191], [-0.1101047, -0.0483976, 0.9443652], 0.131481),
                ([-1.9239645, 2.2923879, 0.6684206], [-0.1113893, -0.0475551, 0.9470224], 1.317702),
            ],
        },
        Reference {
            corners_px: [[662.767, 203.215], [644.614, 257.754], [718.270, 268.681], [733.280, 212.950]],
            poses: [
                ([1.7101644, 2.1617369, -0.7463688], [0.0536416, -0.1236351, 0.9659938], 0.042996),
                ([-1.5879363, -1.9103876, -0.8590066], [0.0539875, -0.1225190, 0.9700284], 1.829889),
            ],
        },
        Reference {
            corners_px: [[520.561, 493.474], [477.214, 468.763], [449.380, 511.748], [492.900, 537.693]],
            poses: [
                ([0.7458526, -2.8653136, 0.6562729], [-0.2372156, 0.2322676, 1.3548383], 0.056068),
                ([-0.8076036, 2.6857000, 0.0205711], [-0.2373595, 0.2333299, 1.3575347], 0.511687),
            ],
        },
        Reference {
            corners_px: [[287.864, 529.743], [300.360, 516.162], [286.658, 501.348], [274.252, 515.023]],
            poses: [
                ([2.8945569, -1.2038482, -0.0171812], [-1.3873706, 0.6471466, 3.3508579], 0.010851),
                ([2.6107181, -1.0806847, 1.3064394], [-1.3874784, 0.6472033, 3.3519279], 0.093179),
            ],
        },
        Reference {
            corners_px: [[805.758, 374.398], [765.585, 421.030], [815.698, 459.805], [856.740, 414.555]],
            poses: [
                ([-1.2203345, -2.4652627, -0.2450356], [0.2093838, 0.0826439, 1.0894614], 0.039729),
                ([1.2053589, 2.7075650, -0.6949603], [0.2100906, 0.0818307, 1.0920535], 0.855505),
            ],
        },
        Reference {
            corners_px: [[790.255, 514.915], [826.952, 561.003], [862.843, 529.110], [827.162, 484.954]],
            poses: [
                ([2.2402426, 1.1772585, 0.0315833], [0.2581622, 0.2360918, 1.2129830], 0.042862),
                ([-2.3970123, -1.0063418, 0.7359514], [0.2579280, 0.2374530, 1.2163795], 1.060816),
            ],
        },
    ];
    for Reference { corners_px, poses } in references {
        let corners_px = corners_px.map(Vector2::from);
        let seen = TagObservation { tag: tag(5), corners_px, covariance_px2: SMatrix::identity() };
        let found = planar_poses(&lens, &seen, SIZE_M).unwrap();
        for (found, (rotation, translation_m, rms_px)) in found.iter().zip(poses) {
            let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(rotation));
            let shift_m = found.camera_from_tag.translation.vector - Vector3::from(translation_m);
            let turn = found.camera_from_tag.rotation.angle_to(&rotation);
            // Its numbers are rounded to 10⁻⁷, and its fit ends where χ² no longer changes: near 10⁻⁸ of it, so some
            // 10⁻⁴ of the poses' deviations, which here are up to 0.1 rad and 10 mm.
            assert!(turn < 1e-5 && shift_m.norm() < 1e-6, "{turn:e} rad, {:e} m", shift_m.norm());
            assert!((found.rms_px - rms_px).abs() < 1e-6);
        }
    }
}
