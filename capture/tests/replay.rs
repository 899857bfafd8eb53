//! A recording as a camera: pace, seeking, loops, several cameras on one clock.

#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may panic")]

mod support;

use std::path::{Path, PathBuf};
use std::time::Duration;

use coshade_capture::recording::{Compression, Reader, RecordingOptions, RecordingWriter};
use coshade_capture::replay::{Playback, Rate, ReplayCamera, ReplayOptions};
use coshade_capture::{Camera, CaptureError, Control, ControlValue, Frame, PixelFormat, Timestamp, clock};
use coshade_lens::calibration::Calibration;
use support::{assert_same, frame, small_chunks};

const LONG: Duration = Duration::from_secs(5);
const INTERVAL: Duration = Duration::from_millis(20);

/// Frame `index` of a stream at exactly 50 frames a second.
fn regular(index: u64, offset_ns: u64) -> Frame {
    let mut frame = frame(PixelFormat::Yuyv, index);
    frame.captured = Timestamp::from_ns(10_000_000_000 + index * 20_000_000 + offset_ns);
    frame.arrived = frame.captured + Duration::from_millis(3);
    frame.sequence = 100 + index;
    frame
}

/// A recording of `camera` and `fisheye`, the latter 5 ms later each time.
fn two_streams(folder: &Path, count: u64) -> PathBuf {
    let path = folder.join("two.mcap");
    let options = RecordingOptions { overwrite: true, ..small_chunks(Compression::Lz4) };
    let mut writer = RecordingWriter::create(&path, options).unwrap();
    let calibration = Calibration::default_for([640, 480], 1.1).unwrap();
    let camera = writer.add_stream("camera", Some(&calibration), Some(50.0)).unwrap();
    let fisheye = writer.add_stream("fisheye", None, None).unwrap();
    for index in 0..count {
        writer.write(camera, &regular(index, 0), 0).unwrap();
        writer.write(fisheye, &regular(index, 5_000_000), 0).unwrap();
    }
    writer.finish(&[0, 0]).unwrap();
    path
}

fn options(rate: Rate, looping: bool) -> ReplayOptions {
    ReplayOptions { rate, looping, start: Duration::ZERO }
}

fn ended(camera: &mut ReplayCamera) -> bool {
    matches!(camera.next_frame(LONG), Err(CaptureError::EndOfStream { .. }))
}

#[test]
fn a_frame_that_was_taken_first_but_arrived_later_is_played() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("late.mcap");
    let mut writer = RecordingWriter::create(&path, small_chunks(Compression::None)).unwrap();
    let camera = writer.add_stream("camera", None, Some(50.0)).unwrap();
    let depth = writer.add_stream("depth", None, Some(50.0)).unwrap();
    for index in 0..4 {
        writer.write(camera, &regular(index, 4_000_000), 0).unwrap();
        // Slower to arrive, in a chunk of its own.
        writer.write(depth, &regular(index, 0), 0).unwrap();
    }
    writer.finish(&[0, 0]).unwrap();
    let mut depth = ReplayCamera::open(&format!("replay:{}#depth?rate=max", path.display())).unwrap();
    for index in 0..4 {
        assert_same(&depth.next_frame(LONG).unwrap(), &regular(index, 0));
    }
    assert!(ended(&mut depth));
    let first = regular(0, 0).captured;
    assert_eq!(Reader::open(&path).unwrap().span().unwrap(), Some((first, regular(3, 4_000_000).captured)));
}

#[test]
fn frames_come_back_as_recorded_and_end() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 50);
    let mut camera = ReplayCamera::open(&format!("replay:{}#camera?rate=max", path.display())).unwrap();
    assert_eq!((camera.stream().format, camera.stream().frames_per_second), (PixelFormat::Yuyv, Some(50.0)));
    assert_eq!(camera.calibration(), Some(&Calibration::default_for([640, 480], 1.1).unwrap()));
    for index in 0..50 {
        assert_same(&camera.next_frame(LONG).unwrap(), &regular(index, 0));
    }
    assert!(ended(&mut camera) && ended(&mut camera));
    let mut fisheye = ReplayCamera::open(&format!("replay:{}#fisheye", path.display())).unwrap();
    assert_same(&fisheye.next_frame(LONG).unwrap(), &regular(0, 5_000_000));
    assert!((fisheye.stream().frames_per_second.unwrap() - 50.0).abs() < 1e-9);
    assert!(fisheye.calibration().is_none());
}

#[test]
fn the_pace_is_that_of_the_recording() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 26);
    for (times, expected) in [(1.0, 0.5), (2.0, 0.25), (0.5, 1.0)] {
        let playback = Playback::open(&path, options(Rate::Times(times), false)).unwrap();
        let mut camera = playback.camera(Some("camera")).unwrap();
        let start = clock::now();
        for index in 0..26 {
            let frame = camera.next_frame(LONG).unwrap();
            let due = INTERVAL.mul_f64(index as f64 / times);
            // Never early; the clock starts with the first frame that is asked for.
            assert!(
                clock::now().saturating_since(start) >= due,
                "frame {index} at {:?}",
                clock::now().saturating_since(start)
            );
            assert_eq!(frame.sequence, 100 + index);
        }
        let took = clock::now().saturating_since(start).as_secs_f64();
        // A busy machine may be late by some time slices, but not by a multiple.
        assert!(took >= expected && took < expected + 0.4, "{times}: {took} s");
    }
}

#[test]
fn two_cameras_go_by_one_clock() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 100);
    let mut camera = ReplayCamera::open(&format!("replay:{}#camera?rate=1", path.display())).unwrap();
    let mut fisheye = ReplayCamera::open(&format!("replay:{}#fisheye", path.display())).unwrap();
    for index in 0..5 {
        assert_eq!(camera.next_frame(LONG).unwrap().sequence, 100 + index);
        assert_eq!(fisheye.next_frame(LONG).unwrap().sequence, 100 + index);
    }
    camera.playback().pause();
    // One frame may have become due before the pause.
    let mut after_pause = 0;
    for camera in [&mut camera, &mut fisheye] {
        while camera.next_frame(Duration::from_millis(60)).is_ok() {
            after_pause += 1;
        }
    }
    assert!(after_pause <= 2, "{after_pause}");
    assert!(!fisheye.playback().is_playing());
    fisheye.playback().seek(Duration::from_secs(1));
    fisheye.playback().play();
    // The camera's frame 50 is at 1 s, the fish-eye's 5 ms later.
    assert_eq!(camera.next_frame(LONG).unwrap().sequence, 150);
    assert_eq!(fisheye.next_frame(LONG).unwrap().sequence, 150);
    let conflict = ReplayCamera::open(&format!("replay:{}#camera?rate=max", path.display())).err().unwrap();
    assert!(conflict.to_string().contains("other options"), "{conflict}");
}

#[test]
fn a_time_out_is_kept_and_loses_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 10);
    let playback = Playback::open(&path, options(Rate::Times(0.1), false)).unwrap();
    let mut camera = playback.camera(Some("camera")).unwrap();
    camera.next_frame(LONG).unwrap();
    let start = clock::now();
    let error = camera.next_frame(Duration::from_millis(50)).unwrap_err();
    assert!(matches!(error, CaptureError::Timeout { .. }), "{error}");
    assert!(
        clock::now().saturating_since(start) >= Duration::from_millis(50)
            && clock::now().saturating_since(start) < Duration::from_millis(150)
    );
    assert_eq!(camera.next_frame(LONG).unwrap().sequence, 101);
}

#[test]
fn loops_and_seeks_never_turn_time_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 10);
    let playback = Playback::open(&path, options(Rate::Max, true)).unwrap();
    let mut camera = playback.camera(Some("camera")).unwrap();
    let mut fisheye = playback.camera(Some("fisheye")).unwrap();
    // 9 intervals and 5 ms from the first image to the last, and one interval.
    let period = Duration::from_millis(9 * 20 + 5 + 20);
    assert_eq!(playback.duration(), period);
    for pass in 0..3 {
        for index in 0..10 {
            let frame = camera.next_frame(LONG).unwrap();
            let original = regular(index, 0);
            assert_eq!(frame.captured, original.captured + period * pass);
            assert_eq!(frame.arrived, original.arrived + period * pass);
            assert_eq!(frame.sequence, 100 + u64::from(pass) * 10 + index);
            assert_eq!((&frame.pixels, frame.exposure), (&original.pixels, original.exposure));
            let other = fisheye.next_frame(LONG).unwrap();
            assert_eq!(other.captured.saturating_since(frame.captured), Duration::from_millis(5));
        }
    }
    playback.set_looping(false);
    playback.seek(Duration::from_millis(100));
    let frame = camera.next_frame(LONG).unwrap();
    assert_eq!(frame.pixels, regular(5, 0).pixels);
    assert_eq!(frame.captured, regular(5, 0).captured + period * 3);
    assert_eq!(frame.sequence, 130);
    for _ in 6..10 {
        camera.next_frame(LONG).unwrap();
    }
    assert!(ended(&mut camera));
    // Going back revives a camera that was at its end.
    playback.seek(Duration::ZERO);
    assert_eq!(camera.next_frame(LONG).unwrap().pixels, regular(0, 0).pixels);
}

#[test]
fn a_start_is_kept_and_a_paced_loop_goes_round() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 10);
    let source = format!("replay:{}#camera?rate=4&loop=true&start_s=0.1", path.display());
    let mut camera = ReplayCamera::open(&source).unwrap();
    let start = clock::now();
    let numbers: Vec<u64> = (0..20).map(|_| camera.next_frame(LONG).unwrap().sequence).collect();
    assert_eq!(numbers, (105..125).collect::<Vec<u64>>());
    // From 0.1 s in the first pass to 0.08 s in the third, at four times the pace.
    let line_s = 2.0 * 0.205 + 0.08 - 0.1;
    assert!(
        clock::now().saturating_since(start).as_secs_f64() >= line_s / 4.0,
        "{:?}",
        clock::now().saturating_since(start)
    );
}

#[test]
fn what_is_not_there_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 3);
    let open = |source: String| ReplayCamera::open(&source).err().unwrap().to_string();
    let error = open(format!("replay:{}", path.display()));
    assert!(error.contains("camera, fisheye") && error.contains("two.mcap"), "{error}");
    let error = open(format!("replay:{}#depth", path.display()));
    assert!(error.contains("\"depth\"") && error.contains("camera, fisheye"), "{error}");
    let error = open(format!("replay:{}/none.mcap", folder.path().display()));
    assert!(error.contains("none.mcap"), "{error}");
    let error = open(format!("replay:{}#camera?speed=1", path.display()));
    assert!(error.contains("speed"), "{error}");
}

#[test]
fn recorded_exposure_and_gain_can_be_read_not_set() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 6);
    let playback = Playback::open(&path, options(Rate::Max, false)).unwrap();
    let mut camera = playback.camera(Some("camera")).unwrap();
    for index in 0..6 {
        camera.next_frame(LONG).unwrap();
        let original = regular(index, 0);
        let exposure = camera.control(Control::Exposure).ok();
        assert_eq!(exposure, original.exposure.map(ControlValue::Time));
        let gain = camera.control(Control::Gain).ok();
        assert_eq!(gain, original.gain.map(|gain| ControlValue::Factor(gain.into())));
    }
    assert!(camera.controls().iter().all(|info| info.read_only) && camera.controls().len() == 2);
    let refused = camera.set_control(Control::Gain, ControlValue::Factor(2.0)).unwrap_err();
    assert!(matches!(refused, CaptureError::ControlRefused { .. }));
    let missing = camera.set_control(Control::Focus, ControlValue::Steps(2)).unwrap_err();
    assert!(matches!(missing, CaptureError::NoSuchControl { .. }));
}

#[test]
fn a_damaged_chunk_is_reported_and_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let path = two_streams(folder.path(), 100);
    let mut bytes = std::fs::read(&path).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    let chunk = &chunks[chunks.len() / 2];
    let middle = chunk.chunk_start_offset + chunk.chunk_length / 2;
    bytes[middle as usize] ^= 0x55;
    std::fs::write(&path, bytes).unwrap();
    let playback = Playback::open(&path, options(Rate::Max, false)).unwrap();
    let mut camera = playback.camera(Some("camera")).unwrap();
    let (mut frames, mut damaged) = (0, Vec::new());
    loop {
        match camera.next_frame(LONG) {
            Ok(_) => frames += 1,
            Err(CaptureError::EndOfStream { .. }) => break,
            Err(error) => damaged.push(error.to_string()),
        }
    }
    assert_eq!(damaged.len(), 1, "{damaged:?}");
    assert!(
        damaged[0].contains("CRC") && damaged[0].contains(&chunk.chunk_start_offset.to_string()),
        "{damaged:?}"
    );
    assert!(frames > 80, "{frames}");
}
