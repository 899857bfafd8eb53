//! Simulated cameras as their readers meet them: controls, losses, rolling shutter, the same bytes every time.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use std::sync::Arc;
use std::time::Duration;

use coshade_capture::{Camera, CaptureError, Control, ControlValue, Converter, Frame};
use coshade_lens::calibration::{Calibration, Noise, Response, Vignetting};
use coshade_reference::accel::Sees;
use coshade_sim::sensor::Exposure;
use coshade_sim::tracer::Room;
use coshade_sim::{Pace, SimCamera, SimSensor, World};

/// A sensor in the chequered room; `keys` go into its section.
fn sensor(keys: &str) -> SimSensor {
    let text = format!(
        "version = 1\nseed = 4\nduration_s = 1\n[[keyframe]]\ntime_s = 0\nposition_m = [0.1, 0.2, 0.1]\n\
         [sensor.camera]\nsize_px = [32, 24]\nfov_deg = 60\nframes_per_second = 20\n{keys}"
    );
    let world = World::parse(&text, "room.toml").unwrap();
    world.sensor("camera", Arc::new(Room::default())).unwrap()
}

fn camera(keys: &str) -> SimCamera {
    SimCamera::new("sim:room", sensor(keys), Pace::Fast)
}

fn brightness(frame: &Frame) -> f64 {
    let mut rgb = vec![0; frame.pixel_count() * 3];
    Converter::new().rgb24(frame, &mut rgb).unwrap();
    rgb.iter().map(|code| f64::from(*code)).sum::<f64>() / rgb.len() as f64
}

fn frames(camera: &mut SimCamera, count: usize) -> Vec<Frame> {
    (0..count).map(|_| camera.next_frame(Duration::ZERO).unwrap()).collect()
}

#[test]
fn a_control_shows_after_its_latency() {
    let mut camera = camera("control_latency_frames = 3\n");
    let before = brightness(&frames(&mut camera, 2)[1]);
    let report = camera.set_control(Control::Exposure, ControlValue::Time(Duration::from_millis(5))).unwrap();
    assert_eq!(
        (report.actual, report.latency_frames),
        (ControlValue::Time(Duration::from_millis(5)), Some(3))
    );
    let after: Vec<f64> = frames(&mut camera, 5).iter().map(brightness).collect();
    // The control was set before frame 2: frames 2, 3 and 4 are as before, 5 and 6 have half the light.
    assert_eq!(after[..3], [before; 3]);
    assert!(after[3] < 0.85 * before && after[3] == after[4], "{before} {after:?}");
}

#[test]
fn white_balance_and_gain_do_what_they_say() {
    let mut camera = camera("format = 'rgb24'\n");
    let before = frames(&mut camera, 1).remove(0);
    camera.set_control(Control::WhiteBalance, ControlValue::Kelvin(7000.0)).unwrap();
    let yellower = frames(&mut camera, 1).remove(0);
    let channel = |frame: &Frame, channel: usize| {
        frame.pixels.iter().skip(channel).step_by(3).map(|c| u32::from(*c)).sum::<u32>()
    };
    assert!(channel(&yellower, 0) > channel(&before, 0) && channel(&yellower, 2) < channel(&before, 2));
    assert_eq!(channel(&yellower, 1), channel(&before, 1));
    camera.set_control(Control::WhiteBalance, ControlValue::Kelvin(5000.0)).unwrap();
    camera.set_control(Control::Gain, ControlValue::Factor(0.5)).unwrap();
    let darker = frames(&mut camera, 1).remove(0);
    assert!(channel(&darker, 1) < channel(&before, 1));
    assert_eq!(darker.gain, Some(0.5));
}

#[test]
fn a_linear_sensor_delivers_the_radiance_times_what_its_calibration_says() {
    let folder = tempfile::tempdir().unwrap();
    let mut calibration = Calibration::default_for([32, 24], 1.0).unwrap();
    let (center_px, radius_px) = ([15.5, 11.5], 20.0);
    calibration.vignetting = Vignetting::Radial { center_px, radius_px, coefficients: vec![-0.4] };
    let file = folder.path().join("linear.toml");
    let world = |text: &str| World::parse(text, folder.path().join("room.toml")).unwrap();
    let text =
        "version = 1\nduration_s = 1\n[sensor.camera]\ncalibration = 'linear.toml'\nformat = 'rgbf32'\n";

    // The response of its calibration must be linear.
    calibration.write(&file).unwrap();
    let error = world(text).calibration("camera").unwrap_err().to_string();
    for part in ["sensor camera", "linear.toml", "RGBF32", "`srgb`", "kind = \"linear\""] {
        assert!(error.contains(part), "{error}");
    }
    calibration.response = Response::Linear;
    calibration.write(&file).unwrap();

    let sensor = world(text).sensor("camera", Arc::new(Room::default())).unwrap();
    let exposure = Exposure { time: 3.0, gain: 2.5, ..Exposure::default() };
    let frame = sensor.frame(0, &exposure).unwrap();
    let found: Vec<[f32; 3]> = (0..24).flat_map(|y| frame.rgb_f32_row(y)).collect();
    for (pixel, (found, radiance)) in found.iter().zip(sensor.radiance(0, Sees::RealOnly)).enumerate() {
        let (x, y) = ((pixel % 32) as f64 - center_px[0], (pixel / 32) as f64 - center_px[1]);
        let falloff = 1.0 - 0.4 * (x * x + y * y) / (radius_px * radius_px);
        for (found, radiance) in found.iter().zip(radiance) {
            let exact = f64::from(radiance) * 3.0 * 2.5 * falloff;
            // The falloff and the frame are rounded to 24 bits.
            assert!(
                (f64::from(*found) - exact).abs() <= exact * 2.0 * f64::from(f32::EPSILON),
                "{found} {exact}"
            );
        }
    }
    assert!(found.iter().flatten().any(|value| *value > 4.0), "0.7 · 7.5 in the middle is not clipped");

    // Without vignetting, at the calibration's exposure, it is the radiance itself.
    let plain = self::sensor("format = 'rgbf32'\n");
    let frame = plain.frame(7, &Exposure::default()).unwrap();
    let found: Vec<[f32; 3]> = (0..24).flat_map(|y| frame.rgb_f32_row(y)).collect();
    assert_eq!(found, plain.radiance(7, Sees::RealOnly));
    assert_eq!(plain.calibration().response, Response::Linear);
}

#[test]
fn controls_fail_silently_as_listed() {
    let mut camera = camera(
        "fault = [{ kind = 'ignore', control = 'exposure' }, { kind = 'pretend', control = 'gain' }]\n",
    );
    let before = brightness(&frames(&mut camera, 1)[0]);
    let start = camera.control(Control::Exposure).unwrap();
    let ignored =
        camera.set_control(Control::Exposure, ControlValue::Time(Duration::from_millis(2))).unwrap();
    assert_eq!((ignored.actual, camera.control(Control::Exposure).unwrap()), (start, start));
    let pretended = camera.set_control(Control::Gain, ControlValue::Factor(0.25)).unwrap();
    assert_eq!(pretended.actual, ControlValue::Factor(0.25));
    assert_eq!(brightness(&frames(&mut camera, 1)[0]), before);
}

#[test]
fn wrong_values_are_refused_with_a_reason() {
    let mut camera = camera("");
    for (control, value, message) in [
        (Control::Exposure, ControlValue::Time(Duration::from_secs(5)), "allowed: 10µs to 1s"),
        (Control::Gain, ControlValue::Factor(f64::NAN), "allowed: 0.01 to 100"),
        (Control::Gain, ControlValue::Kelvin(1.0), "another kind"),
        (Control::Focus, ControlValue::Steps(1), "no control Focus"),
        (Control::AutoExposure, ControlValue::Switch(true), "no control AutoExposure"),
    ] {
        let error = camera.set_control(control, value).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn automatic_exposure_pumps_until_it_is_switched_off() {
    let mut camera = camera("fault = [{ kind = 'pump', amplitude = 0.5, period_s = 0.4 }]\n");
    let shown: Vec<f64> = frames(&mut camera, 8).iter().map(brightness).collect();
    // Frames are 50 ms apart: brightest at 0.1 s, darkest at 0.3 s.
    assert!(shown[2] > shown[0] && shown[0] > shown[6], "{shown:?}");
    assert!(camera.set_control(Control::Exposure, ControlValue::Time(Duration::from_millis(10))).is_err());
    assert!(camera.controls().iter().any(|info| info.control == Control::Exposure && info.read_only));
    camera.set_control(Control::AutoExposure, ControlValue::Switch(false)).unwrap();
    let still: Vec<f64> = frames(&mut camera, 8).iter().map(brightness).collect();
    assert!(still.iter().all(|brightness| *brightness == shown[0]), "{still:?} {shown:?}");
}

#[test]
fn losses_are_those_that_were_listed() {
    let mut camera = camera(
        "fault = [{ kind = 'drop', frames = [1, 4] }, { kind = 'stall', from_s = 0.3, for_s = 0.25 }, { kind = 'vanish', at_s = 0.8 }]\n",
    );
    let (mut sequences, mut timeouts) = (Vec::new(), 0);
    let end = loop {
        match camera.next_frame(Duration::from_millis(100)) {
            Ok(frame) => sequences.push(frame.sequence),
            Err(CaptureError::Timeout { .. }) => timeouts += 1,
            Err(error) => break error,
        }
    };
    // Frames 6 to 10 are exposed at 0.3 to 0.5 s; the stall of 0.25 s is longer than two waits of 0.1 s.
    assert_eq!(sequences, [0, 2, 3, 5, 11, 12, 13, 14, 15]);
    assert_eq!(timeouts, 2);
    assert!(matches!(end, CaptureError::Lost { .. }), "{end}");
}

#[test]
fn frames_come_in_real_time() {
    let mut camera = SimCamera::new("sim:room", sensor(""), Pace::RealTime);
    let start = coshade_capture::clock::now();
    frames_within(&mut camera, 3);
    // The third frame is due 100 ms after the first.
    assert!(coshade_capture::clock::now().saturating_since(start) >= Duration::from_millis(100));
    assert!(matches!(camera.next_frame(Duration::ZERO), Err(CaptureError::Timeout { .. })));
}

fn frames_within(camera: &mut SimCamera, count: usize) {
    for _ in 0..count {
        camera.next_frame(Duration::from_secs(5)).unwrap();
    }
}

/// A calibration file, changed.
fn calibrated(folder: &std::path::Path, change: impl FnOnce(&mut Calibration)) -> String {
    let mut calibration = Calibration::default_for([96, 64], 1.0).unwrap();
    change(&mut calibration);
    let path = folder.join("camera.toml");
    calibration.write(&path).unwrap();
    path.display().to_string()
}

#[test]
fn the_same_seed_gives_the_same_bytes_whatever_the_threads() {
    let folder = tempfile::tempdir().unwrap();
    let noise = Noise { shot: 0.002, read: 0.00005, at_gain: Vec::new() };
    let file = calibrated(folder.path(), |calibration| calibration.noise = Some(noise));
    let make = |seed: u32, format: &str, threads: usize| {
        let text = format!(
            "version = 1\nseed = {seed}\nduration_s = 1\n[sensor.camera]\ncalibration = '{file}'\nformat = '{format}'\n"
        );
        let world = World::parse(&text, "room.toml").unwrap();
        let sensor = world.sensor("camera", Arc::new(Room::default())).unwrap();
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| sensor.frame(3, &Exposure::default()).unwrap().pixels.to_vec())
    };
    for format in ["rgb24", "z16"] {
        assert_eq!(make(1, format, 1), make(1, format, 3), "{format}");
        assert_ne!(make(1, format, 1), make(2, format, 1), "{format}");
    }
}

#[test]
fn a_rolling_shutter_skews_an_upright_edge_by_the_closed_form() {
    let (readout_s, rate_rad_per_s) = (0.03, 2.0_f64);
    let folder = tempfile::tempdir().unwrap();
    let file = calibrated(folder.path(), |calibration| calibration.readout_s = readout_s);
    // A steady turn to the left about the world's z, looking along +y at time 0.5 s.
    let keyframes: String = (0..5)
        .map(|k| {
            let angle = rate_rad_per_s * (f64::from(k) * 0.25 - 0.5);
            let upright = glam::DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
            let [x, y, z, w] = (glam::DQuat::from_rotation_z(angle) * upright).to_array();
            format!(
                "[[keyframe]]\ntime_s = {}\nposition_m = [0, 0, 0]\nquaternion_xyzw = [{x}, {y}, {z}, {w}]\n",
                f64::from(k) * 0.25
            )
        })
        .collect();
    let text = format!(
        "version = 1\nduration_s = 1\n{keyframes}[sensor.camera]\ncalibration = '{file}'\nphase_s = 0.5\nshutter_bands = 64\n"
    );
    let world = World::parse(&text, "room.toml").unwrap();
    // One edge in the middle of the wall at y = +2, seen in both halves of the image.
    let rays_per_side = 16;
    let room = Room { square_m: 10.0, rays_per_side, ..Room::default() };
    let sensor = world.sensor("camera", Arc::new(room)).unwrap();
    let picture = sensor.radiance(0, Sees::RealOnly);
    let intrinsics = *sensor.calibration().model.intrinsics();
    for (row, pixels) in picture.chunks(96).enumerate().filter(|(row, _)| !(30..34).contains(row)) {
        let (left, right) = (f64::from(pixels[0][0]), f64::from(pixels[95][0]));
        let covered: f64 = pixels.iter().map(|pixel| (f64::from(pixel[0]) - right) / (left - right)).sum();
        let edge_px = covered - 0.5;
        // The camera turns left by ωt, so the edge is seen at the angle ωt to the right.
        let time_s = (row as f64 / 63.0 - 0.5) * readout_s;
        let expected_px = intrinsics.cx + intrinsics.fx * (rate_rad_per_s * time_s).tan();
        // A pixel knows how much of it is covered to half a ray's width.
        assert!(
            (edge_px - expected_px).abs() <= 0.5 / f64::from(rays_per_side) + 1e-6,
            "{row}: {edge_px} {expected_px}"
        );
    }
}
