//! ROS 1 bags: a real one of an Intel RealSense D435, and small ones of every kind of chunk and image.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may panic")]

mod support;

use std::path::PathBuf;
use std::time::Duration;

use coshade_capture::recording::describe;
use coshade_capture::replay::ReplayCamera;
use coshade_capture::{Camera, CaptureError, DepthFrame, PixelFormat};
use support::bag::{Bag, image};
use support::read_all;

fn write(folder: &tempfile::TempDir, bytes: &[u8]) -> PathBuf {
    let path = folder.path().join("test.bag");
    std::fs::write(&path, bytes).unwrap();
    path
}

#[test]
fn a_realsense_recording_is_described_and_replayed() {
    let name = "a_realsense_recording_is_described_and_replayed";
    let Some(path) = coshade_testdata::find(name, "rgbd/realsense-bag/single_depth_color_640x480.bag") else {
        return;
    };
    let description = describe(&path).unwrap();
    assert!(description.indexed && description.damage.is_empty(), "{:?}", description.damage);
    assert_eq!(description.topics.len(), 70);
    let metadata =
        description.topics.iter().find(|topic| topic.topic.ends_with("Depth_0/image/metadata")).unwrap();
    assert_eq!((metadata.schema.as_str(), metadata.messages), ("diagnostic_msgs/KeyValue", 36));
    let [depth, color] = &description.streams[..] else { panic!("{:?}", description.streams) };
    assert_eq!((depth.format.as_str(), depth.width_px, depth.height_px, depth.frames), ("z16", 640, 480, 2));
    assert_eq!(
        (color.format.as_str(), color.width_px, color.height_px, color.frames),
        ("rgb24", 640, 480, 1)
    );
    assert_eq!(depth.depth_unit_m, Some(f64::from(0.001_f32)));
    assert_eq!(depth.problem, None);
    let lens = color.intrinsics.clone().unwrap();
    assert_eq!((lens.width_px, lens.height_px, lens.distortion_model.as_str()), (640, 480, "Brown Conrady"));
    assert!((lens.fx_fy_cx_cy_px[0] - 613.0).abs() < 1.0, "{lens:?}");

    let source = format!("replay:{}#{}?rate=max", path.display(), depth.topic);
    let mut camera = ReplayCamera::open(&source).unwrap();
    let frame = camera.next_frame(Duration::from_secs(1)).unwrap();
    assert_eq!(frame.sequence, 0xa9);
    let depth = DepthFrame::try_from(frame).unwrap();
    let measured = (0..480).flat_map(|y| depth.row_codes(y).collect::<Vec<_>>()).filter(|&code| code > 0);
    let mut measured: Vec<u16> = measured.collect();
    measured.sort_unstable();
    // The unit is a millimetre and the camera stood in a room.
    let median_mm = measured[measured.len() / 2];
    assert!(measured.len() > 100_000 && (300..8000).contains(&median_mm), "{} {median_mm}", measured.len());
}

#[test]
fn every_compression_gives_the_same_images_and_others_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let pixels: Vec<u8> = (0..32).collect();
    for compression in ["none", "bz2", "lz4"] {
        let bytes = Bag::new().chunk(compression, |chunk| {
            chunk.connection(3, "/camera/image", "sensor_msgs/Image");
            chunk.message(3, 2_000_000_001, &image(9, "mono8", 6, 4, 8, &pixels));
        });
        let (frames, errors) = read_all(&write(&folder, &bytes));
        assert!(errors.is_empty(), "{errors:?}");
        let frame = &frames[0].frame;
        assert_eq!(
            (frame.format, frame.width_px, frame.height_px, frame.stride_bytes),
            (PixelFormat::Grey, 6, 4, 8)
        );
        assert_eq!(&frame.pixels[..], &pixels[..]);
        assert_eq!(
            (frame.sequence, frame.captured.as_ns(), frame.arrived.as_ns()),
            (9, 5_000_000_017, 2_000_000_001)
        );
    }
    let bytes = Bag::new().chunk("zip", |chunk| chunk.connection(0, "/a", "sensor_msgs/Image"));
    let description = describe(write(&folder, &bytes)).unwrap();
    assert!(description.damage.iter().any(|damage| damage.what.contains("zip")), "{:?}", description.damage);
}

#[test]
fn image_encodings_are_mapped_or_named() {
    let folder = tempfile::tempdir().unwrap();
    let read = |encoding: &str, step: u32, data: &[u8]| {
        let bytes = Bag::new().chunk("none", |chunk| {
            chunk.connection(0, "/camera/image", "sensor_msgs/Image");
            chunk.message(0, 1, &image(0, encoding, 2, 1, step, data));
        });
        read_all(&write(&folder, &bytes))
    };
    // Encoding, stride, bytes; format and bytes of the frame.
    type Case<'a> = (&'a str, u32, &'a [u8], PixelFormat, &'a [u8]);
    let cases: [Case; 7] = [
        ("rgb8", 6, &[1, 2, 3, 4, 5, 6], PixelFormat::Rgb24, &[1, 2, 3, 4, 5, 6]),
        ("bgr8", 6, &[1, 2, 3, 4, 5, 6], PixelFormat::Rgb24, &[3, 2, 1, 6, 5, 4]),
        ("bgra8", 8, &[1, 2, 3, 9, 4, 5, 6, 9], PixelFormat::Rgb24, &[3, 2, 1, 6, 5, 4]),
        ("yuv422", 4, &[1, 2, 3, 4], PixelFormat::Uyvy, &[1, 2, 3, 4]),
        ("yuv422_yuy2", 4, &[1, 2, 3, 4], PixelFormat::Yuyv, &[1, 2, 3, 4]),
        ("mono16", 4, &[1, 2, 3, 4], PixelFormat::Y16, &[1, 2, 3, 4]),
        ("16UC1", 4, &[1, 2, 3, 4], PixelFormat::Z16, &[1, 2, 3, 4]),
    ];
    for (encoding, step, data, format, expected) in cases {
        let (frames, errors) = read(encoding, step, data);
        assert!(errors.is_empty(), "{encoding}: {errors:?}");
        assert_eq!((frames[0].frame.format, &frames[0].frame.pixels[..]), (format, expected), "{encoding}");
        let unit = (format == PixelFormat::Z16).then_some(0.001);
        assert_eq!(frames[0].frame.depth_unit_m, unit, "{encoding}");
    }
    let (frames, errors) = read("32FC1", 8, &[0; 8]);
    assert!(
        frames.is_empty() && errors[0].contains("32FC1") && errors[0].contains("/camera/image"),
        "{errors:?}"
    );
    let (frames, errors) = read("32FC3", 24, &[0; 24]);
    assert!(frames.is_empty() && errors[0].contains("nor their order"), "{errors:?}");
    let (frames, errors) = read("rgb8", 0, &[0; 6]);
    assert!(frames.is_empty() && !errors.is_empty());
}

#[test]
fn a_stream_that_cannot_be_replayed_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    let bytes = Bag::new().chunk("none", |chunk| {
        chunk.connection(0, "/depth", "sensor_msgs/Image");
        chunk.message(0, 1, &image(0, "32FC1", 2, 1, 8, &[0; 8]));
    });
    let path = write(&folder, &bytes);
    let error = ReplayCamera::open(&format!("replay:{}", path.display())).err().unwrap();
    assert!(matches!(&error, CaptureError::Lost { .. }) && error.to_string().contains("32FC1"), "{error}");
}
