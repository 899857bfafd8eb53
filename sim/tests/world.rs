//! The world file: read, refused, recorded, opened as a source.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

use coshade_capture::recording::{Reader, RecordingOptions};
use coshade_capture::{CaptureError, SourceRegistry};
use coshade_config::reference_page;
use coshade_reference::accel::Sees;
use coshade_sim::cache::PictureCache;
use coshade_sim::{Recording, World, WorldSpec};
use coshade_testdata::mutate::mutations;

const DESK: &str = include_str!("data/desk.toml");

fn desk_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/desk.toml")
}

#[test]
fn the_reference_page_is_fresh() {
    let page = reference_page::<WorldSpec>("The world file", DESK);
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/world.md");
    if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
        std::fs::write(&path, &page).unwrap();
    }
    let committed = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(committed == page, "docs/world.md is stale: UPDATE_DOCS=1 cargo test -p coshade-sim rewrites it");
}

#[test]
fn mistakes_are_named_at_their_places() {
    for (from, to, message) in [
        ("seed = 7", "sede = 7", "sede: unknown key"),
        ("id = 3\nsize_m", "id = 587\nsize_m", "tag[0].id: tag36h11 has no tag 587"),
        ("sphere = 0.05", "sphere = -1", "thing[2].shape.sphere: -1 is no length"),
        ("time_s = 0.5\n", "time_s = 0\n", "keyframe[1].time_s: keyframe 1: time 0 s"),
        ("size_px = [80, 60]", "size_px = [81, 60]", "sensor.camera.size_px: the width must be even"),
        ("size_px = [64, 64]\n", "", "neither `calibration` nor both"),
        (
            "format = \"mjpg\"",
            "format = \"mjpg\"\ndepth = {}",
            "sensor.fisheye.depth: only for depth cameras",
        ),
        ("kind = \"stall\"", "kind = \"stahl\"", "sensor.depth.fault[0].kind"),
        (
            "look_at_m = [0, 0, 0]",
            "look_at_m = [-0.3, -0.8, 0.5]",
            "keyframe[0].look_at_m: the place of the rig itself",
        ),
    ] {
        assert!(DESK.contains(from), "{from}");
        let error = World::parse(&DESK.replacen(from, to, 1), "desk.toml").unwrap_err().to_string();
        assert!(error.contains(message) && error.contains("desk.toml:"), "{error}");
    }
}

#[test]
fn damaged_worlds_are_refused_or_read() {
    let folder = desk_file();
    for (number, bytes) in mutations(DESK.as_bytes(), 400) {
        let text = String::from_utf8_lossy(&bytes);
        let Ok(world) = World::parse(&text, &folder) else { continue };
        for name in world.spec().sensors.keys() {
            let pose = world.path().pose(0.25);
            assert!(pose.position_m.is_finite() && pose.rotation.is_finite(), "{number}: {name}");
            let _ = world.calibration(name);
        }
        if number % 20 == 0 {
            let _ = world.tracer();
        }
    }
}

#[test]
fn things_on_tags_and_tags_on_boards_are_in_their_true_places() {
    let world = World::read(desk_file()).unwrap();
    let tags = world.tags().unwrap();
    assert_eq!(
        tags.iter().map(|tag| (tag.family.as_str(), tag.id)).collect::<Vec<_>>(),
        [("tag36h11", 3), ("tag25h9", 0), ("tag25h9", 1)]
    );
    assert!((tags[2].world_from_tag.position_m - glam::DVec3::new(-0.25, 0.2, 0.0)).length() < 1e-12);
    let sensor = world.sensor("camera", Arc::new(world.tracer().unwrap())).unwrap();
    // The middle of the cube's top: tag 3 is at the origin, the cube 0.2 m and 0.1 m off and 0.085 m high.
    let camera_from_world = sensor.world_from_sensor(0.0).inverse();
    let seen = camera_from_world.transform_point(glam::DVec3::new(0.2, 0.1, 0.085));
    let pixel = sensor.calibration().model.project(&nalgebra::Vector3::new(seen.x, seen.y, seen.z)).unwrap();
    let (real, mixed) = (sensor.true_depth(0, Sees::RealOnly), sensor.true_depth(0, Sees::Everything));
    let (x, y) = (pixel.x.round() as usize, pixel.y.round() as usize);
    // The pixel's centre is up to 0.7 of a pixel from the point: 0.7 · 1.3 m / 69 px on a surface seen at 30°.
    assert!((f64::from(real[y * 80 + x].z_m) - seen.z).abs() < 0.025, "{} {}", real[y * 80 + x].z_m, seen.z);
    // The virtual ball is no part of what the camera sees.
    assert!(real.iter().zip(&mixed).any(|(real, mixed)| mixed.z_m < real.z_m));
    assert!(real.iter().zip(&mixed).all(|(real, mixed)| mixed.z_m <= real.z_m));
}

#[test]
fn tags_of_a_cube_are_on_its_faces() {
    let folder = tempfile::tempdir().unwrap();
    let cube = "version = 1\nfamily = \"tag36h11\"\n[[tag]]\nid = 1\nsize_m = 0.08\nposition_m = [0.05, 0, 0]\n\
                rotation_deg = [90, 0, 90]\n[[tag]]\nid = 0\nfamily = \"tag25h9\"\nsize_m = 0.06\n\
                position_m = [0, 0, 0.05]\n";
    std::fs::write(folder.path().join("board.toml"), cube).unwrap();
    // The file puts its board at (-0.3, 0.2, 0), not turned.
    let world = World::parse(DESK, folder.path().join("desk.toml")).unwrap();
    let tags = world.tags().unwrap();
    let (side, top) = (&tags[1], &tags[2]);
    assert_eq!((side.family.as_str(), side.id, top.family.as_str(), top.id), ("tag36h11", 1, "tag25h9", 0));
    // Seen from +x, the print's right is +y, its up is +z.
    let lower_left = side.corners_m()[0] - glam::DVec3::new(-0.3, 0.2, 0.0);
    assert!((lower_left - glam::DVec3::new(0.05, -0.04, -0.04)).length() < 1e-12, "{lower_left}");
    let upper_right = top.corners_m()[2] - glam::DVec3::new(-0.3, 0.2, 0.0);
    assert!((upper_right - glam::DVec3::new(0.03, 0.03, 0.05)).length() < 1e-12, "{upper_right}");
}

#[test]
fn unknown_tags_boards_and_sensors_are_named() {
    let without_tag = DESK.replacen("id = 3\nsize_m = 0.08\npose", "id = 4\nsize_m = 0.08\npose", 1);
    let world = World::parse(&without_tag, desk_file()).unwrap();
    assert!(world.tracer().err().unwrap().to_string().contains("cube"));
    let error = world.calibration("eye").unwrap_err().to_string();
    assert!(error.contains("no sensor `eye`; there are camera, depth, fisheye"), "{error}");
    let elsewhere = World::parse(DESK, "/nonexistent/desk.toml").unwrap();
    assert!(elsewhere.tags().unwrap_err().to_string().contains("/nonexistent/board.toml"));
}

#[test]
fn a_world_is_recorded_with_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    let world = World::read(desk_file()).unwrap();
    let cache = PictureCache::new(folder.path().join("cache"));
    let record = |name: &str| {
        let recording = Recording {
            world: &world,
            tracer: Arc::new(world.tracer().unwrap()),
            cache: Some(cache.clone()),
        };
        let path = folder.path().join(name);
        let mut told = 0;
        let simulated = recording
            .write(&path, RecordingOptions::default(), |progress| {
                told = progress.done;
                true
            })
            .unwrap();
        assert_eq!(told, 13, "5 + 3 + 5 frames");
        (path, simulated)
    };
    let (path, simulated) = record("desk.mcap");
    let counts: Vec<(&str, u64)> = simulated.streams.iter().map(|s| (s.name.as_str(), s.written)).collect();
    // Camera: 5 frames without the dropped one. Depth: at 0.05 to 0.45 s, without those at 0.25 s (0.35 s is past the stall).
    assert_eq!(counts, [("camera", 4), ("depth", 4), ("fisheye", 3)]);
    let mut reader = Reader::open(&path).unwrap();
    let transforms = reader.transforms().unwrap();
    assert_eq!(transforms.len(), 11);
    for transform in transforms.iter().filter(|transform| transform.child == "camera") {
        let time_s = (transform.stamp.as_ns() - 10_000_000_000) as f64 * 1e-9;
        let truth = world.path().pose(time_s);
        assert!((glam::DVec3::from_array(transform.translation_m) - truth.position_m).length() < 1e-9);
    }
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&simulated.truth).unwrap()).unwrap();
    let frames = &truth["sensors"][0]["frames"];
    assert_eq!(
        (frames[3]["delivered"].as_bool(), frames[2]["delivered"].as_bool()),
        (Some(false), Some(true))
    );
    let depth = &truth["sensors"][1]["frames"][1];
    assert_eq!(depth["true_ns"].as_i64().unwrap() - depth["stamp_ns"].as_i64().unwrap(), 20_000_000);

    // Made again from the cache, frame by frame the same.
    let (again, _) = record("again.mcap");
    let pixels = |path: &Path| {
        let mut reader = Reader::open(path).unwrap();
        let mut all = Vec::new();
        while let Some(read) = reader.next_frame().unwrap() {
            all.push((read.frame.captured, read.frame.pixels.to_vec()));
        }
        all
    };
    assert_eq!(pixels(&path), pixels(&again));
}

#[test]
fn a_sensor_is_opened_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut registry = SourceRegistry::builtin();
    coshade_sim::source::register(&mut registry);
    let cache = folder.path().join("cache").display().to_string();
    let name = |sensor: &str, options: &str| {
        format!("sim:{}#{sensor}?cache={cache}{options}", desk_file().display())
    };
    let mut camera = registry.open(&name("camera", "&pace=fast")).unwrap();
    assert_eq!(camera.calibration().unwrap().size_px, [80, 60]);
    let mut sequences = Vec::new();
    loop {
        match camera.next_frame(Duration::ZERO) {
            Ok(frame) => sequences.push(frame.sequence),
            Err(CaptureError::EndOfStream { .. }) => break,
            Err(error) => unreachable!("{error}"),
        }
    }
    assert_eq!(sequences, [0, 1, 2, 4]);
    for (wrong, message) in [
        (name("eye", ""), "no sensor `eye`"),
        (name("camera", "&pace=slow"), "pace=slow"),
        (name("camera", "&loud=1"), "unknown option `loud=1`"),
        ("sim:/nonexistent.toml#camera".to_owned(), "/nonexistent.toml"),
        ("sim:desk.toml".to_owned(), "which camera"),
    ] {
        let error = registry.open(&wrong).err().unwrap().to_string();
        assert!(error.contains(message), "{error}");
    }
}
