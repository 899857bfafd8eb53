//! A tag that is small in the image has two poses. The wrong one is never called clear.

use coshade_tracker::pose::Expected;
use coshade_tracker::{Body, BodyPose, Certainty, Past, PoseSolver, lie};
use nalgebra::{Isometry3, Matrix6, Vector6};

use super::support::*;

const SIZE_M: f64 = 0.05;
const SIZES_PX: [f64; 6] = [14.0, 20.0, 30.0, 50.0, 100.0, 200.0];
const NOISES_PX: [f64; 4] = [0.05, 0.1, 0.2, 0.5];

/// A flip is an estimate on the other side: nearer to the mirrored pose than to the true one. Tilts below this are left
/// out: there both are one degree or two from facing the camera, and on which side of it an estimate falls is noise.
const LEAST_TILT_DEG: f64 = 5.0;

fn is_flipped(pose: &BodyPose, truth: &Isometry3<f64>) -> bool {
    let found = pose.estimate.camera_from_body.rotation;
    found.angle_to(&mirrored(truth)) < found.angle_to(&truth.rotation)
}

/// A tag of `size_px` at random in the image.
fn place(size_px: f64, tilt_deg: f64, random: &mut Random) -> Isometry3<f64> {
    let sight = sight(&pinhole(), 100.0, random);
    facing(&sight, FOCAL_PX * SIZE_M / size_px, tilt_deg.to_radians(), random)
}

#[test]
fn flips_of_single_tags_are_not_silent() {
    let solver = PoseSolver::new(&pinhole(), &Body::single(tag(1), SIZE_M)).unwrap();
    let mut random = Random(1);
    let (mut views, mut flips, mut silent) = (0, 0, 0);
    println!("reported ambiguous, in %, for tilts of 5–20°, 20–50°, 50–80°");
    for noise_px in NOISES_PX {
        for size_px in SIZES_PX {
            let mut line = format!("noise {noise_px:4} px, side {size_px:3} px:");
            for (low, high) in [(LEAST_TILT_DEG, 20.0), (20.0, 50.0), (50.0, 80.0)] {
                let mut ambiguous = 0;
                const VIEWS: u32 = 300;
                for _ in 0..VIEWS {
                    let truth = place(size_px, random.between(low, high), &mut random);
                    let seen = observe(&pinhole(), solver_body(), &truth, noise_px, &mut random);
                    let Ok(pose) = solver.solve(&seen, &Past::default()) else { continue };
                    views += 1;
                    let flipped = is_flipped(&pose, &truth);
                    flips += u32::from(flipped);
                    ambiguous += u32::from(pose.certainty.is_ambiguous());
                    silent += u32::from(flipped && !pose.certainty.is_ambiguous());
                }
                line += &format!(" {:5.1}", 100.0 * f64::from(ambiguous) / f64::from(VIEWS));
            }
            println!("{line}");
        }
    }
    println!("{views} views, {flips} flips, {silent} of them silent");
    // Stated: below 1 in 10⁴ where both poses are equally probable beforehand.
    assert!(flips > views / 10 && 10_000 * silent <= views, "{silent} of {views}");
}

fn solver_body() -> &'static Body {
    static BODY: std::sync::LazyLock<Body> = std::sync::LazyLock::new(|| Body::single(tag(1), SIZE_M));
    &BODY
}

#[test]
fn large_tilted_tags_are_clear() {
    let solver = PoseSolver::new(&pinhole(), solver_body()).unwrap();
    let mut random = Random(2);
    for _ in 0..300 {
        let truth = place(100.0, random.between(20.0, 70.0), &mut random);
        let seen = observe(&pinhole(), solver_body(), &truth, 0.1, &mut random);
        let pose = solver.solve(&seen, &Past::default()).unwrap();
        assert_eq!(pose.certainty, Certainty::Clear);
        assert!(!is_flipped(&pose, &truth));
    }
}

#[test]
fn one_of_two_poses_is_near_the_truth() {
    let solver = PoseSolver::new(&pinhole(), solver_body()).unwrap();
    let mut random = Random(3);
    let mut ambiguous = 0;
    for _ in 0..500 {
        let truth = place(20.0, random.between(25.0, 60.0), &mut random);
        let seen = observe(&pinhole(), solver_body(), &truth, 0.1, &mut random);
        let pose = solver.solve(&seen, &Past::default()).unwrap();
        if let Certainty::Ambiguous { other } = &pose.certainty {
            ambiguous += 1;
            let angle = |pose: &Isometry3<f64>| pose.rotation.angle_to(&truth.rotation);
            let nearer = angle(&pose.estimate.camera_from_body).min(angle(&other.camera_from_body));
            // 0.1 px on 20 px tilted by 25°: 0.1/(10 sin 25°) = 1.4° a corner; the tail is long where it leans less.
            assert!(nearer.to_degrees() < 12.0, "{}", nearer.to_degrees());
        }
    }
    assert!(ambiguous > 100, "{ambiguous}");
}

/// What a filter would say: the true pose with errors of 2° and 2 mm.
fn expected(truth: &Isometry3<f64>, random: &mut Random) -> Expected {
    let sigma = Vector6::new(0.035, 0.035, 0.035, 0.002, 0.002, 0.002);
    // About the body, carried to a twist about the camera.
    let carried = lie::adjoint(truth);
    let error = carried * sigma.map(|sigma| sigma * random.normal());
    let covariance = carried * Matrix6::from_diagonal(&sigma.component_mul(&sigma)) * carried.transpose();
    Expected {
        camera_from_body: lie::exp(&error) * truth,
        covariance: (covariance + covariance.transpose()) / 2.0,
    }
}

#[test]
fn the_past_decides() {
    let solver = PoseSolver::new(&pinhole(), solver_body()).unwrap();
    let mut random = Random(4);
    let (mut by_past, mut ambiguous, mut silent) = (0, 0, 0);
    for _ in 0..2000 {
        let truth = place(25.0, random.between(20.0, 60.0), &mut random);
        let seen = observe(&pinhole(), solver_body(), &truth, 0.2, &mut random);
        let past = Past { expected: Some(expected(&truth, &mut random)), before: None };
        let pose = solver.solve(&seen, &past).unwrap();
        by_past += u32::from(matches!(pose.certainty, Certainty::ByPast { .. }));
        ambiguous += u32::from(pose.certainty.is_ambiguous());
        silent += u32::from(is_flipped(&pose, &truth) && !pose.certainty.is_ambiguous());
    }
    println!("{by_past} decided by the past, {ambiguous} ambiguous, {silent} silent flips");
    assert_eq!(silent, 0);
    assert!(by_past > 10 * ambiguous);
}

#[test]
fn a_past_that_is_elsewhere_does_not_decide() {
    let solver = PoseSolver::new(&pinhole(), solver_body()).unwrap();
    let mut random = Random(5);
    for _ in 0..300 {
        let truth = place(20.0, random.between(20.0, 60.0), &mut random);
        let elsewhere = place(20.0, random.between(20.0, 60.0), &mut random);
        let seen = observe(&pinhole(), solver_body(), &truth, 0.2, &mut random);
        let past = Past { expected: Some(expected(&elsewhere, &mut random)), before: None };
        let pose = solver.solve(&seen, &past).unwrap();
        assert!(!matches!(pose.certainty, Certainty::ByPast { .. }));
    }
}

#[test]
fn two_tags_do_not_flip() {
    let mut random = Random(6);
    let cube = cube(0.04, 0.05);
    let board = board(4, 3, 0.03, 0.05);
    let mut views = [0, 0];
    for (body, views) in [&cube, &board].into_iter().zip(&mut views) {
        let solver = PoseSolver::new(&pinhole(), body).unwrap();
        for _ in 0..1500 {
            let noise_px = random.between(0.05, 0.5);
            // Sides of 24 to 100 px (cube) and 24 to 60 px (board).
            let sight = sight(&pinhole(), 250.0, &mut random);
            let (distance_m, tilt) = (random.between(0.4, 1.0), random.between(0.1, 1.2));
            let truth = facing(&sight, distance_m, tilt, &mut random);
            let seen = observe(&pinhole(), body, &truth, noise_px, &mut random);
            if seen.len() < 2 {
                continue;
            }
            *views += 1;
            let pose = solver.solve(&seen, &Past::default()).unwrap();
            let found = pose.estimate.camera_from_body.rotation;
            let silent = !pose.certainty.is_ambiguous();
            assert!(
                !silent || found.angle_to(&truth.rotation) < found.angle_to(&mirrored(&truth)),
                "{truth}"
            );
            if body.name == "cube" {
                assert_eq!(pose.certainty, Certainty::Clear);
            }
        }
    }
    println!("{views:?} views of cube and board");
    assert!(views.iter().all(|views| *views > 500));
}
