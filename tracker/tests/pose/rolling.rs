//! Rows that are exposed one after the other.

use coshade_tracker::pose::Before;
use coshade_tracker::{Body, Past, PoseSolver, lie};
use nalgebra::{Isometry3, Vector3, Vector6};

use super::support::*;

const READOUT_S: f64 = 0.02;
const FRAME_S: f64 = 1.0 / 30.0;
const HEIGHT_PX: u32 = 720;

/// When a row is exposed, against the time stamp of its frame: the middle row at 0.
fn row_time_s(row: f64) -> f64 {
    (row / f64::from(HEIGHT_PX - 1) - 0.5) * READOUT_S
}

/// A body that moves with a twist and its rate of change.
struct Motion {
    now: Isometry3<f64>,
    twist: Vector6<f64>,
    acceleration: Vector6<f64>,
}

impl Motion {
    fn at(&self, time_s: f64) -> Isometry3<f64> {
        lie::exp(&(self.twist * time_s + self.acceleration * (time_s * time_s / 2.0))) * self.now
    }

    /// Error of the corners of a body's pose, in metres.
    fn error_m(&self, body: &Body, found: &Isometry3<f64>) -> f64 {
        let corners = body.tags.iter().flat_map(|tag| tag.corners_m());
        corners.map(|corner| (found * corner - self.now * corner).norm()).fold(0.0, f64::max)
    }
}

/// About half a metre and a radian per second.
fn motion(acceleration: f64, random: &mut Random) -> Motion {
    let mut twist =
        |scale: f64| Vector6::from_fn(|i, _| random.normal() * scale * if i < 3 { 1.0 } else { 0.5 });
    let (twist, acceleration) = (twist(1.0), twist(acceleration));
    // Low in the image, where the middle row's time is far off.
    let sight = Vector3::new(random.between(-0.3, 0.3), random.between(0.1, 0.2), 1.0).normalize();
    Motion { now: facing(&sight, 0.4, random.between(0.3, 0.9), random), twist, acceleration }
}

/// Errors of the pose, with and without the rows' times.
fn errors_m(body: &Body, motion: &Motion, elapsed_s: f64, noise_px: f64, random: &mut Random) -> [f64; 2] {
    let solver = PoseSolver::new(&pinhole(), body).unwrap();
    let rolling = solver.clone().with_rolling_shutter(READOUT_S, HEIGHT_PX).unwrap();
    let mut seen = observe_moving(&pinhole(), body, |row| motion.at(row_time_s(row)), noise_px, random);
    seen.iter_mut().for_each(|seen| seen.covariance_px2.fill_diagonal(0.01));
    let before = Before { camera_from_body: motion.at(-elapsed_s), elapsed_s };
    let past = Past { expected: None, before: Some(before) };
    [rolling, solver]
        .map(|solver| motion.error_m(body, &solver.solve(&seen, &past).unwrap().estimate.camera_from_body))
}

#[test]
fn a_steady_motion_leaves_no_bias() {
    let mut random = Random(31);
    for body in [board(3, 2, 0.04, 0.05), Body::single(tag(0), 0.08)] {
        let mut largest = [0.0_f64; 2];
        for _ in 0..200 {
            let errors = errors_m(&body, &motion(0.0, &mut random), FRAME_S, 0.0, &mut random);
            for (largest, error) in largest.iter_mut().zip(errors) {
                *largest = largest.max(error);
            }
        }
        println!("{}: {:.2e} m with the rows' times, {:.2e} m without", body.name, largest[0], largest[1]);
        // The corners are exact, and the model is: what is left is where the fit stops (10⁻⁵ deviations).
        assert!(largest[0] < 1e-6 && largest[1] > 2e-3, "{largest:?}");
    }
}

#[test]
fn what_is_left_of_an_unsteady_motion_is_of_second_order() {
    let mut random = Random(32);
    let body = board(3, 2, 0.04, 0.05);
    const ACCELERATION: f64 = 5.0; // m/s² and rad/s², halved for the translation
    let (mut sums, mut uncorrected_m) = ([0.0; 2], 0.0);
    for _ in 0..100 {
        let motion = motion(ACCELERATION, &mut random);
        for (sum, elapsed_s) in sums.iter_mut().zip([FRAME_S, FRAME_S / 2.0]) {
            let [error_m, without_m] = errors_m(&body, &motion, elapsed_s, 0.0, &mut random);
            *sum += error_m;
            uncorrected_m += without_m / 2.0;
        }
    }
    println!(
        "mean errors {:.2e} m, {:.2e} m; {:.2e} m without",
        sums[0] / 100.0,
        sums[1] / 100.0,
        uncorrected_m / 100.0
    );
    // The velocity is wrong by a Δt/2 (and the rows' own a τ/2): the error falls with the time between the frames.
    // Rows are at most 10 ms off, so halving Δt = 33 ms leaves (17 + 10)/(33 + 10) = 0.63 of it at most.
    assert!(sums[1] < 0.63 * sums[0]);
    // a Δt/2 against v: rates of 5/s² and 1/s give 0.083, and 0.025 more for the rows' own.
    assert!(sums[0] < 0.11 * uncorrected_m);
}

#[test]
fn noise_is_not_enlarged_much() {
    let mut random = Random(33);
    let body = board(3, 2, 0.04, 0.05);
    let (mut moving, mut still) = (0.0, 0.0);
    for _ in 0..300 {
        let steady = motion(0.0, &mut random);
        moving += errors_m(&body, &steady, FRAME_S, 0.1, &mut random)[0];
        let resting = Motion { twist: Vector6::zeros(), ..steady };
        still += errors_m(&body, &resting, FRAME_S, 0.1, &mut random)[1];
    }
    // The rows' times multiply the pose's error by 1 + τ/Δt, τ here up to half of the read-out of 0.6 Δt: 1.3.
    assert!(moving < 1.3 * still, "{moving} {still}");
}

#[test]
fn where_a_tag_was_does_not_decide_where_it_is() {
    // Flat, small, slowly moving; and the pose before may have been the wrong one of two.
    let body = Body::single(tag(0), 0.05);
    let solver =
        PoseSolver::new(&pinhole(), &body).unwrap().with_rolling_shutter(READOUT_S, HEIGHT_PX).unwrap();
    let mut random = Random(34);
    let (mut flips, mut ambiguous, mut silent) = (0, 0, 0);
    for view in 0..4000 {
        let moving = motion(0.0, &mut random);
        let away = 0.05 * FOCAL_PX / random.between(20.0, 60.0) / moving.now.translation.vector.norm();
        let mut now = moving.now;
        now.translation.vector *= away;
        let moving = Motion { now, ..moving };
        let seen = observe_moving(&pinhole(), &body, |row| moving.at(row_time_s(row)), 0.1, &mut random);
        let mut camera_from_body = moving.at(-FRAME_S);
        if view % 2 == 0 {
            camera_from_body.rotation = mirrored(&camera_from_body);
        }
        let before = Some(Before { camera_from_body, elapsed_s: FRAME_S });
        let pose = solver.solve(&seen, &Past { expected: None, before }).unwrap();
        let found = pose.estimate.camera_from_body.rotation;
        let flipped = found.angle_to(&mirrored(&moving.now)) < found.angle_to(&moving.now.rotation);
        flips += u32::from(flipped);
        ambiguous += u32::from(pose.certainty.is_ambiguous());
        silent += u32::from(flipped && !pose.certainty.is_ambiguous());
    }
    println!("of 4000: {flips} flips, {silent} of them silent, {ambiguous} ambiguous");
    assert!(flips > 50 && silent <= 1, "{flips} {silent}");
}
