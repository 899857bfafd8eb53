//! The recording of a desk that comes with the project: it must be what its world file says.

use std::path::{Path, PathBuf};

use coshade_capture::recording::{Reader, describe};
use coshade_capture::{Converter, PixelFormat};
use coshade_lens::calibration::Calibration;
use coshade_sim::World;
use glam::{DQuat, DVec3};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

const STALE: &str =
    "the recording is stale: coshade simulate worlds/desk.toml -o assets/desk.mcap --overwrite";

#[test]
fn the_recorded_desk_is_that_of_its_world_file() {
    let world = World::read(root().join("worlds/desk.toml")).unwrap();
    let path = root().join("assets/desk.mcap");
    let described = describe(&path).unwrap();
    assert!(described.session["session"] == world.text(), "{STALE}");
    assert!(described.size_bytes <= 8_000_000, "{} bytes", described.size_bytes);
    assert_eq!(described.damage, []);
    let streams: Vec<_> = described.streams.iter().map(|s| (s.name.as_str(), s.frames)).collect();
    assert_eq!(streams, [("camera", 40), ("depth", 40), ("fisheye", 20)]);

    let mut reader = Reader::open(&path).unwrap();
    for stream in reader.streams() {
        let truth = world.calibration(&stream.name).unwrap();
        let text = stream.calibration_toml.as_deref().unwrap();
        assert_eq!(Calibration::parse(text, "recorded").unwrap(), truth, "{}: {STALE}", stream.name);
    }
    let transforms = reader.transforms().unwrap();
    assert_eq!(transforms.len(), 100);
    for transform in transforms {
        let time_s = (transform.stamp.as_ns() - 10_000_000_000) as f64 * 1e-9;
        let mount = world.path().pose(time_s);
        let position_m = DVec3::from_array(transform.translation_m);
        match transform.child.as_str() {
            "camera" => {
                let turned = DQuat::from_array(transform.rotation_xyzw).angle_between(mount.rotation);
                assert!((position_m - mount.position_m).length() < 1e-9 && turned < 1e-6, "{STALE}");
            }
            // Five centimetres beside the camera.
            "depth" => assert!(((position_m - mount.position_m).length() - 0.0524).abs() < 1e-4),
            _ => assert!((position_m - DVec3::new(0.24, 0.235, 0.033)).length() < 1e-9),
        }
    }
}

#[test]
fn its_frames_can_be_read_and_are_well_exposed() {
    let mut reader = Reader::open(root().join("assets/desk.mcap")).unwrap();
    let names: Vec<String> = reader.streams().iter().map(|stream| stream.name.clone()).collect();
    let mut converter = Converter::new();
    while let Some(read) = reader.next_frame().unwrap() {
        let frame = &read.frame;
        let pixels = (frame.width_px * frame.height_px) as usize;
        if frame.format == PixelFormat::Z16 {
            let measured = frame.pixels.as_chunks::<2>().0.iter().filter(|count| **count != [0; 2]).count();
            assert!(measured * 10 > pixels * 6, "frame {}: {measured} depths", frame.sequence);
            continue;
        }
        let mut rgb = vec![0; pixels * 3];
        converter.rgb24(frame, &mut rgb).unwrap();
        let mean = rgb.iter().map(|code| f64::from(*code)).sum::<f64>() / rgb.len() as f64;
        let clipped = rgb.iter().filter(|code| **code == 255).count() as f64 / rgb.len() as f64;
        let name = names[read.stream].as_str();
        // A fish-eye has black corners and the window in its image.
        let (range, most) = if name == "camera" { (50.0..160.0, 0.01) } else { (30.0..100.0, 0.1) };
        assert!(range.contains(&mean) && clipped < most, "{name} {}: {mean} {clipped}", frame.sequence);
    }
}
