//! The rig file.

use std::collections::BTreeMap;

use coshade_scene::rig::RigProvenance;
use coshade_scene::{Rig, RigSensor};
use glam::DVec3;

fn rig() -> Rig {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let camera = RigSensor {
        position_m: [0.0; 3],
        quaternion_xyzw: [0.0, 0.0, 0.0, 1.0],
        time_offset_ns: 0,
        readout_s: 0.0,
    };
    let fisheye = RigSensor {
        position_m: [0.0, -0.1, 0.02],
        quaternion_xyzw: [-half, 0.0, 0.0, half],
        time_offset_ns: -1_250_000,
        readout_s: 0.016,
    };
    Rig {
        version: 1,
        sensors: BTreeMap::from([("camera".to_owned(), camera), ("fisheye".to_owned(), fisheye)]),
        provenance: Some(RigProvenance {
            tool: "coshade 0.1.0".to_owned(),
            when: Some("2026-11-22T12:00:00Z".to_owned()),
            images: vec!["desk.mcap".to_owned()],
            rms_px: Some(0.21),
            notes: None,
        }),
    }
}

#[test]
fn a_rig_is_read_as_it_was_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    rig().save(&path).unwrap();
    assert_eq!(Rig::read(&path).unwrap(), rig());
    rig().save(&path).unwrap();
    assert_eq!(Rig::read(&path).unwrap(), rig());
}

#[test]
fn the_quaternion_turns_the_sensor_into_the_rig() {
    // −90° about x: what the fish-eye sees ahead (z) is above the see-through camera (−y is up there: z → y).
    let forward = rig().sensors["fisheye"].rotation().unwrap() * DVec3::Z;
    assert!(forward.abs_diff_eq(DVec3::Y, 1e-12), "{forward}");
}

#[test]
fn mistakes_are_told_with_their_places() {
    let errors = |text: &str| {
        let error = Rig::parse(text, "rig.toml").unwrap_err();
        let line = |p: &coshade_config::Problem| format!("{}:{} {}: {}", p.line, p.column, p.key, p.message);
        error.problems().iter().map(line).collect::<Vec<_>>()
    };
    assert_eq!(
        errors("version = 1\n[sensor.eye]\nquaternion_xyzw = [0, 0, 0, 2]\n"),
        ["3:19 sensor.eye.quaternion_xyzw: a quaternion of length 2; unit length is needed"]
    );
    assert_eq!(
        errors(
            "version = 1\n[sensor.eye]\nquaternion = [0, 0, 0, 1]\nreadout_s = -1\ntime_offset_ns = 1.5\n"
        ),
        [
            "3:1 sensor.eye.quaternion: unknown key",
            "4:13 sensor.eye.readout_s: `-1` is out of range",
            "5:18 sensor.eye.time_offset_ns: expected an integer, found a number (`1.5`)",
        ]
    );
    assert_eq!(errors("version = 1"), ["1:1 sensor: missing key"]);
}

#[test]
fn a_rig_with_numbers_that_are_none_is_not_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("rig.toml");
    let mut rig = rig();
    rig.sensors.get_mut("camera").unwrap().position_m[1] = f64::NAN;
    assert!(rig.save(&path).is_err());
    assert!(!path.exists());
}
