use std::f64::consts::PI;

use super::*;

fn keyframe(time_s: f64, position_m: [f64; 3], axis: [f64; 3], angle_rad: f64) -> Keyframe {
    let rotation = DQuat::from_axis_angle(DVec3::from_array(axis).normalize(), angle_rad);
    Keyframe { time_s, pose: Rigid { rotation, position_m: DVec3::from_array(position_m) } }
}

fn uneven() -> Vec<Keyframe> {
    vec![
        keyframe(0.0, [0.0, 0.0, 1.0], [0.0, 0.0, 1.0], 0.0),
        keyframe(0.7, [0.5, 0.1, 1.2], [0.0, 1.0, 1.0], 0.6),
        keyframe(1.2, [0.6, 0.9, 1.0], [1.0, 1.0, 0.0], 1.1),
        keyframe(2.5, [-0.4, 0.8, 0.9], [1.0, 0.0, 0.2], -0.4),
        keyframe(3.0, [-0.5, 0.2, 1.5], [0.3, 0.5, 1.0], -1.0),
    ]
}

#[test]
fn the_path_passes_through_its_keyframes() {
    let keyframes = uneven();
    let path = Path::new(&keyframes).unwrap();
    for keyframe in &keyframes {
        let pose = path.pose(keyframe.time_s);
        assert!((pose.position_m - keyframe.pose.position_m).length() < 1e-11);
        assert!(logarithm(pose.rotation.conjugate() * keyframe.pose.rotation).length() < 1e-11);
    }
}

#[test]
fn velocities_are_derivatives() {
    let path = Path::new(&uneven()).unwrap();
    let h = 1e-5;
    for step in 1..300 {
        let t = f64::from(step) * 0.01 - 1e-4;
        let (before, motion, after) = (path.pose(t - h), path.motion(t), path.pose(t + h));
        let velocity = (after.position_m - before.position_m) / (2.0 * h);
        let angular = logarithm(before.rotation.conjugate() * after.rotation) / (2.0 * h);
        // Central differences: h²/6 of the third derivative (below 1e3 here), and rounding of 1e-15/h.
        assert!((velocity - motion.velocity_m_per_s).length() < 1e-7, "{t}");
        assert!((angular - motion.angular_velocity_rad_per_s).length() < 1e-7, "{t}");
    }
}

#[test]
fn acceleration_is_continuous_over_keyframes() {
    let path = Path::new(&uneven()).unwrap();
    for t in [0.7, 1.2, 2.5] {
        let jump = |h: f64| {
            let acceleration = |from: f64, to: f64| {
                let (from, to, duration) = (path.motion(t + from), path.motion(t + to), to - from);
                let linear = (to.velocity_m_per_s - from.velocity_m_per_s) / duration;
                let angular = (to.angular_velocity_rad_per_s - from.angular_velocity_rad_per_s) / duration;
                (linear, angular)
            };
            let (left, right) = (acceleration(-h, 0.0), acceleration(0.0, h));
            (left.0 - right.0).length().max((left.1 - right.1).length())
        };
        // One-sided differences of a continuous derivative meet with h; a jump of it would stay.
        let (coarse, fine) = (jump(1e-3), jump(1e-4));
        assert!(fine < 0.15 * coarse + 1e-9, "{t}: {coarse} {fine}");
    }
}

#[test]
fn a_steady_turn_stays_steady() {
    let turn = |k: i32| keyframe(f64::from(k), [f64::from(k), 0.0, 0.0], [0.0, 0.0, 1.0], 0.3 * f64::from(k));
    let path = Path::new(&(0..6).map(turn).collect::<Vec<_>>()).unwrap();
    for step in 1..50 {
        let motion = path.motion(f64::from(step) * 0.1);
        assert!((motion.angular_velocity_rad_per_s - DVec3::new(0.0, 0.0, 0.3)).length() < 1e-10);
        assert!((motion.velocity_m_per_s - DVec3::X).length() < 1e-10);
    }
}

#[test]
fn the_rig_stands_still_outside() {
    let path = Path::new(&uneven()).unwrap();
    assert_eq!(path.motion(-1.0).pose, path.pose(0.0));
    assert_eq!(path.motion(9.0).velocity_m_per_s, DVec3::ZERO);
    let lone = Path::new(&uneven()[1..2]).unwrap();
    assert!((lone.pose(0.7).position_m - DVec3::new(0.5, 0.1, 1.2)).length() < 1e-12);
    assert_eq!(lone.pose(f64::NAN), lone.pose(0.0));
}

#[test]
fn impossible_keyframes_are_named() {
    assert_eq!(Path::new(&[]), Err(PathError::Empty));
    let mut keyframes = uneven();
    keyframes[2].time_s = 0.7;
    assert_eq!(Path::new(&keyframes), Err(PathError::Order { index: 2, time_s: 0.7 }));
    let half = [keyframe(0.0, [0.0; 3], [0.0, 0.0, 1.0], 0.0), keyframe(1.0, [0.0; 3], [0.0, 0.0, 1.0], PI)];
    assert!(matches!(Path::new(&half), Err(PathError::Turn { index: 1, .. })));
}
