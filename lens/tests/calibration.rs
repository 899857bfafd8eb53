//! The calibration file: what is written is read, and what is wrong is named.

#![expect(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    reason = "clippy knows only functions marked as tests as tests"
)]

use std::path::Path;

use coshade_lens::calibration::{
    Calibration, CalibrationError, Channel, Noise, NoiseAtGain, Response, ResponseTable, Vignetting,
};
use coshade_lens::model::ModelKind;
use coshade_lens::pixel::CameraPx;
use nalgebra::Vector2;
use proptest::prelude::*;

const CAMERA: &str = include_str!("data/camera.toml");
const FISHEYE: &str = include_str!("data/fisheye.toml");

fn camera() -> Calibration {
    Calibration::parse(CAMERA, "camera.toml").unwrap()
}

fn fisheye() -> Calibration {
    Calibration::parse(FISHEYE, "fisheye.toml").unwrap()
}

/// The message for `CAMERA` or `FISHEYE` with `from` replaced by `to`.
fn message(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from}");
    let error = Calibration::parse(&text.replacen(from, to, 1), "test.toml").expect_err(to).to_string();
    println!("{error}\n");
    error
}

#[test]
fn the_examples_say_what_they_say() {
    let camera = camera();
    assert_eq!(camera.size_px, [1280, 720]);
    assert_eq!(camera.model.kind(), ModelKind::BrownConrady5);
    assert_eq!(camera.response, Response::Gamma { gamma: 2.18 });
    assert_eq!(camera.noise.as_ref().unwrap().at_gain.len(), 2);
    assert_eq!(camera.provenance.std_dev["fy"], 0.61);
    let fisheye = fisheye();
    assert_eq!(fisheye.image_circle.unwrap().max_angle_deg, Some(92.5));
    assert!(fisheye.model.max_angle_rad() > 93_f64.to_radians());
    assert_eq!(fisheye.radiometric.scale, 1.83);
    let defaults = Calibration::parse(
        "version = 1\nsize_px = [4, 3]\n[lens]\nmodel = \"pinhole\"\nfx = 4.0\nfy = 4.0\ncx = 1.5\ncy = 1.0\n",
        "a.toml",
    );
    let defaults = defaults.unwrap();
    assert_eq!(defaults.response, Response::Srgb);
    assert_eq!(defaults.vignetting, Vignetting::None);
    assert_eq!(defaults.radiometric.working_from_camera(), nalgebra::Matrix3::identity());
}

#[test]
fn every_mistake_is_named_with_its_place() {
    for (text, from, to, expected) in [
        (CAMERA, "version = 1", "version = 2", vec!["test.toml:3", "version"]),
        (CAMERA, "[1280, 720]", "[1280, 0]", vec![":4:", "size_px", "16384"]),
        (CAMERA, "[1280, 720]", "[1280, 70000]", vec![":4:", "size_px", "16384"]),
        (CAMERA, "[1280, 720]", "[1280]", vec![":4:", "size_px"]),
        (CAMERA, "readout_s = 0.0262", "readout_s = -1", vec![":5:", "readout_s"]),
        (CAMERA, "readout_s", "readout", vec![":5:", "readout", "readout_s"]),
        (CAMERA, "fx = 931.42", "fx = -931.42", vec!["lens", "fx"]),
        (CAMERA, "fx = 931.42\n", "", vec!["lens", "fx"]),
        (CAMERA, "k1 = 0.0431", "k9 = 0.0431", vec!["lens", "k9"]),
        (CAMERA, "brown_conrady5", "brown_conrad5", vec![":8:", "brown_conrady5"]),
        (CAMERA, "gamma = 2.18", "gamma = 22", vec![":21:", "gamma", "5"]),
        (CAMERA, "kind = \"gamma\"", "kind = \"gama\"", vec![":20:", "gamma"]),
        (CAMERA, "radius_px = 734.3", "radius_px = 0", vec![":26:", "radius_px"]),
        (CAMERA, "radius_px = 734.3", "radius_px = 100", vec![":27:", "coefficients", "falloff"]),
        (CAMERA, "[-0.284, 0.061]", "[]", vec!["coefficients"]),
        (CAMERA, "center_px = [639.5, 359.5]", "center_px = [639.5]", vec![":25:", "center_px"]),
        (CAMERA, "shot = 0.00082", "shot = -1", vec![":30:", "shot"]),
        (CAMERA, "gain = 4.0", "gain = 1.0", vec![":34:", "noise.at_gain[1].gain"]),
        (CAMERA, "gain = 4.0, shot = 0.0033", "gain = 4.0, shot = 3", vec![":34:", "shot"]),
        (CAMERA, "rms_px = 0.21", "rms_px = -0.21", vec![":41:", "rms_px"]),
        (CAMERA, "cx = 0.71", "k7 = 0.71", vec![":47:", "k7", "k3"]),
        (CAMERA, "cx = 0.71", "cx = -0.71", vec!["std_dev.cx"]),
        (CAMERA, "notes = \"Focus", "covariance = [[1.0]]\nnotes = \"Focus", vec![":42:", "covariance", "9"]),
        (CAMERA, "shot = 0.00082", "shot = nan", vec![":30:", "shot"]),
        (FISHEYE, "radius_px = 493.0\n", "", vec!["image_circle", "radius_px"]),
        (FISHEYE, "max_angle_deg = 92.5", "max_angle_deg = 270", vec![":19:", "max_angle_deg", "180"]),
        (FISHEYE, "0.0037, 0.0101", "0.0101, 0.0037", vec![":24:", "response.red[2]", "rise"]),
        (FISHEYE, "0.4479, 0.6931, 1.0]", "0.4479, 0.6931]", vec![":25:", "response.green", "8 points"]),
        (FISHEYE, "0.4502, 0.6952, 1.0]", "0.4502, 0.6952, 0.9]", vec![":26:", "response.blue[8]"]),
        (FISHEYE, "codes = [0.0, 0.05", "codes = [0.2, 0.05", vec![":23:", "response.codes[0]"]),
        (FISHEYE, "codes = [0.0, 0.05,", "codes = [0.0,", vec![":23:", "response.codes", "9"]),
        (FISHEYE, "[0, 30, 60, 80, 90, 93]", "[0, 30, 60, 60, 90, 93]", vec![":30:", "angles_deg[3]"]),
        (FISHEYE, "[0, 30, 60, 80, 90, 93]", "[1, 30, 60, 80, 90, 93]", vec![":30:", "angles_deg[0]"]),
        (FISHEYE, "[1.0, 0.99", "[0.99", vec![":31:", "falloff"]),
        (FISHEYE, "0.74, 0.6]", "0.74, 0.0]", vec![":31:", "falloff[5]", "0.02"]),
        (FISHEYE, "scale = 1.83", "scale = 0", vec![":34:", "scale"]),
        (FISHEYE, "[0.004, -0.061, 1.057]", "[0.0, 0.0, 0.0]", vec![":35:", "color_matrix", "determinant"]),
        (FISHEYE, "[0.004, -0.061, 1.057]", "[0.0, 0.0]", vec!["color_matrix"]),
    ] {
        let message = message(text, from, to);
        for part in expected {
            assert!(message.contains(part), "{to}: no {part:?} in {message}");
        }
        assert!(message.contains("test.toml:"), "{message}");
    }
}

#[test]
fn several_mistakes_are_reported_at_once() {
    let text = FISHEYE.replace("scale = 1.83", "scale = 1e12").replace("0.74, 0.6]", "0.74, 0.001]");
    let error = Calibration::parse(&text, "test.toml").unwrap_err().to_string();
    assert!(error.contains("radiometric.scale") && error.contains("vignetting.falloff[5]"), "{error}");
}

#[test]
fn an_absent_file_is_named() {
    let error = Calibration::read("/nonexistent/camera.toml").unwrap_err().to_string();
    assert!(error.contains("/nonexistent/camera.toml"), "{error}");
}

#[test]
fn what_is_written_is_read_bit_by_bit() {
    let folder = tempfile::tempdir().unwrap();
    let mut full = camera();
    full.provenance.covariance =
        Some((0..9).map(|i| (0..9).map(|j| f64::from(i == j) / 3.0).collect()).collect());
    full.radiometric.scale = 1.0 / 3.0;
    full.readout_s = 0.1 + 0.2;
    for (name, calibration) in [
        ("camera.toml", camera()),
        ("fisheye.toml", fisheye()),
        ("full.toml", full),
        ("default.toml", Calibration::default_for([640, 480], 1.1).unwrap()),
        ("wide.toml", Calibration::default_for([640, 480], 3.2).unwrap()),
    ] {
        let path = folder.path().join(name);
        calibration.write(&path).unwrap();
        assert_eq!(Calibration::read(&path).unwrap(), calibration);
        calibration.write(&path).unwrap();
        assert_eq!(Calibration::read(&path).unwrap(), calibration);
    }
}

#[test]
fn comments_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera.toml");
    std::fs::write(&path, CAMERA).unwrap();
    let mut calibration = Calibration::read(&path).unwrap();
    calibration.write(&path).unwrap();
    assert_eq!(std::fs::read_to_string(&path).unwrap(), CAMERA);
    calibration.readout_s = 0.03;
    calibration.provenance.rms_px = Some(0.19);
    calibration.write(&path).unwrap();
    let expected =
        CAMERA.replace("readout_s = 0.0262", "readout_s = 0.03").replace("rms_px = 0.21", "rms_px = 0.19");
    assert_eq!(std::fs::read_to_string(&path).unwrap(), expected);
}

#[test]
fn nothing_wrong_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("camera.toml");
    let mut calibration = camera();
    calibration.radiometric.scale = f64::NAN;
    let error = calibration.write(&path).unwrap_err().to_string();
    assert!(error.contains("radiometric.scale"), "{error}");
    assert!(!path.exists());
}

#[test]
fn a_default_says_that_it_assumes() {
    let calibration = Calibration::default_for([640, 480], 60_f64.to_radians()).unwrap();
    assert!(calibration.provenance.notes.as_ref().unwrap().contains("sRGB assumed"));
    // The image's left edge is half the field of view off the axis.
    let ray = calibration.model.unproject(&Vector2::new(-0.5, 239.5)).unwrap();
    assert!((ray.x.atan2(ray.z).to_degrees() + 30.0).abs() < 1e-9);
    let wide = Calibration::default_for([640, 480], 186_f64.to_radians()).unwrap();
    let ray = wide.model.unproject(&Vector2::new(-0.5, 239.5)).unwrap();
    assert!((ray.x.atan2(ray.z).to_degrees() + 93.0).abs() < 1e-9);
    for (size, fov) in
        [([0, 480], 1.0), ([640, 20000], 1.0), ([640, 480], 0.0), ([640, 480], f64::NAN), ([640, 480], 7.0)]
    {
        assert!(Calibration::default_for(size, fov).is_err(), "{size:?} {fov}");
    }
}

/// Whatever the scale, a place of the image keeps its ray, its vignetting and its validity.
#[test]
fn a_scaled_calibration_sees_the_same() {
    for original in [camera(), fisheye()] {
        let [width, height] = original.size_px;
        for (numerator, denominator) in [(1, 2), (2, 1), (1, 1)] {
            let size = [width * numerator / denominator, height * numerator / denominator];
            let (scaled, warning) = original.scaled_to(size).unwrap();
            assert_eq!(warning.is_some(), numerator != denominator);
            if let Some(warning) = warning {
                let text = warning.to_string();
                assert!(
                    text.contains("binning") && text.contains(&format!("{}×{}", size[0], size[1])),
                    "{text}"
                );
            }
            scaled.validate().unwrap();
            let scale = f64::from(numerator) / f64::from(denominator);
            for y in (0..=height).step_by(40) {
                for x in (0..=width).step_by(40) {
                    let corner = CameraPx::new(f64::from(x) - 0.5, f64::from(y) - 0.5);
                    let there = corner.scaled(Vector2::new(scale, scale));
                    let (a, b) = (original.model.unproject(&corner.0), scaled.model.unproject(&there.0));
                    assert_eq!(a.is_some(), b.is_some(), "{corner:?}");
                    let (Some(a), Some(b)) = (a, b) else { continue };
                    assert!((a - b).norm() < 1e-12, "{corner:?}");
                    let gains = (original.vignetting.gain(corner, 0.3), scaled.vignetting.gain(there, 0.3));
                    assert!((gains.0 - gains.1).abs() < 1e-12);
                    if let (Some(a), Some(b)) = (original.image_circle, scaled.image_circle) {
                        assert_eq!(a.contains(corner, 0.0), b.contains(there, 0.0));
                    }
                }
            }
        }
    }
    let (half, _) = camera().scaled_to([640, 360]).unwrap();
    assert_eq!(half.provenance.std_dev["fx"], 0.31);
    assert_eq!(half.provenance.rms_px, Some(0.105));
}

#[test]
fn another_shape_is_refused_with_both_sizes() {
    // 1280×720 × ⅔ = 853.3×480: both roundings are the same shape.
    for size in [[853, 480], [854, 480], [427, 240], [1920, 1080]] {
        assert!(camera().scaled_to(size).is_ok(), "{size:?}");
    }
    for size in [[640, 480], [1280, 718], [720, 1280]] {
        let error = camera().scaled_to(size).unwrap_err();
        assert!(matches!(error, CalibrationError::Aspect { .. }));
        let text = error.to_string();
        assert!(text.contains("1280×720") && text.contains(&format!("{}×{}", size[0], size[1])), "{text}");
    }
    assert!(camera().scaled_to([0, 0]).is_err());
}

/// The reference page is made from the docstrings: every key has one.
#[test]
fn every_key_is_documented() {
    fn undocumented(at: &str, schema: &serde_json::Value, found: &mut Vec<String>) {
        let empty = serde_json::Map::new();
        for (key, value) in schema.as_object().unwrap_or(&empty) {
            if key == "properties" {
                for (name, property) in value.as_object().unwrap() {
                    // The tag of a union is documented by its variants, the lens by its models' names.
                    if property.get("description").is_none() && property.get("const").is_none() {
                        found.push(format!("{at}.{name}"));
                    }
                }
            }
            undocumented(&format!("{at}/{key}"), value, found);
        }
        for value in schema.as_array().into_iter().flatten() {
            undocumented(at, value, found);
        }
    }
    let mut found = Vec::new();
    undocumented("", &serde_json::to_value(schemars::schema_for!(Calibration)).unwrap(), &mut found);
    found.retain(|key| !key.contains("CameraModel"));
    assert!(found.is_empty(), "{found:?}");
}

fn responses() -> Vec<Response> {
    let Response::Table(uneven) = fisheye().response else { panic!("the example has a table") };
    let curve =
        |gamma: f64| (0..256).map(|code| 0.002 + 0.998 * (f64::from(code) / 255.0).powf(gamma)).collect();
    let even = ResponseTable { codes: None, red: curve(2.0), green: curve(2.2), blue: curve(1.0) };
    vec![
        Response::Srgb,
        Response::Rec709,
        Response::Gamma { gamma: 2.2 },
        Response::Gamma { gamma: 0.5 },
        Response::Linear,
        Response::Table(uneven),
        Response::Table(even),
    ]
}

#[test]
fn responses_have_their_published_values() {
    let srgb = |code: f64| Response::Srgb.inverse(Channel::Green, code);
    assert_eq!(srgb(1.0), 1.0);
    // IEC 61966-2-1: code 128 is 0.2158605.
    assert!((srgb(128.0 / 255.0) - 0.215_860_5).abs() < 1e-7);
    assert!((srgb(5.0 / 255.0) - 5.0 / 255.0 / 12.92).abs() < 1e-15);
    // BT.709 gives grey of 18 % the code 0.409.
    assert!((Response::Rec709.forward(Channel::Red, 0.18) - 0.409).abs() < 5e-4);
    assert!((Response::Gamma { gamma: 2.0 }.inverse(Channel::Blue, 0.5) - 0.25).abs() < 1e-15);
}

#[test]
fn responses_are_inverse_and_monotonic_with_their_derivative() {
    for response in responses() {
        assert_eq!(response.mistake(), None);
        for channel in Channel::ALL {
            let mut last = f64::NEG_INFINITY;
            for i in -100..=1200 {
                let code = f64::from(i) / 1000.0;
                let light = response.inverse(channel, code);
                assert!(light > last, "{response:?} at {code}");
                last = light;
                let back = response.forward(channel, light);
                assert!((back - code).abs() < 1e-12, "{response:?} at {code}: {back}");
                let again = response.inverse(channel, response.forward(channel, code));
                assert!((again - code).abs() < 3e-9, "{response:?} at light {code}: {again}");
                // Off the joints of the pieces, a difference over 2e-7 is the slope to 1e-5.
                let at = code + 0.000_437;
                let h = 1e-7;
                let slope =
                    (response.inverse(channel, at + h) - response.inverse(channel, at - h)) / (2.0 * h);
                let exact = response.inverse_slope(channel, at);
                assert!(
                    (slope / exact - 1.0).abs() < 1e-4 || at.abs() < 1e-3,
                    "{response:?} at {at}: {slope} {exact}"
                );
                let product = exact * response.forward_slope(channel, response.inverse(channel, at));
                assert!((product - 1.0).abs() < 1e-6, "{response:?} at {at}: {product}");
            }
        }
        for code in [0.0_f32, 0.01, 0.5, 1.0] {
            let back = response.forward_rgb(response.inverse_rgb([code; 3]));
            assert!(back.iter().all(|b| (b - code).abs() < 2e-6), "{response:?} {code}: {back:?}");
        }
    }
}

#[test]
fn vignetting_and_noise_are_what_they_say() {
    let Calibration { vignetting, noise, .. } = camera();
    let corner = CameraPx::new(639.5 + 734.3, 359.5);
    assert!((vignetting.falloff(corner, 0.0) - (1.0 - 0.284 + 0.061)).abs() < 1e-12);
    assert_eq!(vignetting.gain(CameraPx::new(639.5, 359.5), 0.0), 1.0);
    assert!(vignetting.gain(CameraPx::new(1e300, f64::NAN), 0.0) <= 50.0);
    let by_angle = fisheye().vignetting;
    assert!((by_angle.falloff(corner, 45_f64.to_radians()) - 0.97).abs() < 1e-12);
    assert_eq!(by_angle.falloff(corner, 3.0), 0.6);
    let noise: Noise = noise.unwrap();
    assert!((noise.variance(0.5, None) - (0.00041 + 6.1e-6)).abs() < 1e-15);
    assert!(
        (noise.variance(1.0, Some(2.5)) - ((0.00082 + 0.0033) / 2.0 + (6.1e-6 + 4.9e-5) / 2.0)).abs() < 1e-15
    );
    assert_eq!(noise.at(Some(100.0)), (0.0033, 4.9e-5));
    assert_eq!(noise.variance(-3.0, None), noise.read);
    assert_eq!(noise.at_gain[0], NoiseAtGain { gain: 1.0, shot: 0.00082, read: 6.1e-6 });
}

/// From codes to working RGB by hand: 0.5^2.18, divided by the falloff.
#[test]
fn codes_become_working_light() {
    let camera = camera();
    let place = CameraPx::new(639.5 + 734.3 / 2.0, 359.5);
    let falloff = 1.0 - 0.284 / 4.0 + 0.061 / 16.0;
    let expected = 0.5_f64.powf(2.18) / falloff;
    let rgb = camera.working_rgb(place, [0.5; 3]).unwrap();
    assert!(rgb.iter().all(|c| (c - expected).abs() < 1e-12), "{rgb:?} {expected}");
}

/// The curves that Radiance's tools measured for a real camera fit the formats.
#[test]
fn radiance_curves_fit() {
    let folder = "environment/fisheye-bracket-office";
    let Some(folder) = coshade_testdata::find("radiance_curves_fit", folder) else { return };
    let table = response_of(&folder.join("Response_function.rsp"));
    let response = Response::Table(table);
    assert_eq!(response.mistake(), None);
    for channel in Channel::ALL {
        assert!((response.forward(channel, response.inverse(channel, 0.37)) - 0.37).abs() < 1e-12);
    }
    // vignetting_f11.cal: an even polynomial (its odd terms are 1e-15), distances in units of 1806 px.
    let vignetting = Vignetting::Radial {
        center_px: [1806.0, 1806.0],
        radius_px: 1806.0,
        coefficients: vec![0.146646808299942, -1.10561435342648, 1.68145806563186, -0.996388772575075],
    };
    assert_eq!(vignetting.mistake(|_| 0.97 * 1806.0), None);
    let wide = vignetting.mistake(|_| 1806.0 * 2_f64.sqrt()).unwrap().to_string();
    assert!(wide.contains("coefficients") && wide.contains("image_circle"), "{wide}");
}

/// One line for each channel: the degree and the coefficients of a polynomial, highest power first.
fn response_of(path: &Path) -> ResponseTable {
    let text = std::fs::read_to_string(path).unwrap();
    let mut curves = text.lines().filter(|line| !line.trim().is_empty()).map(|line| {
        let numbers: Vec<f64> = line.split_whitespace().map(|n| n.parse().unwrap()).collect();
        let light = |code: f64| numbers[1..].iter().fold(0.0, |sum, c| sum * code + c);
        (0..256).map(|code| light(f64::from(code) / 255.0)).collect::<Vec<_>>()
    });
    let mut next = || curves.next().unwrap();
    ResponseTable { codes: None, red: next(), green: next(), blue: next() }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Damaged files are read or refused with a place, never more.
    #[test]
    fn damaged_files_never_panic(
        fisheye in prop::bool::ANY,
        edits in prop::collection::vec((0..4_u8, 0.0..1.0_f64, prop::num::u8::ANY), 1..4),
    ) {
        let mut bytes = if fisheye { FISHEYE } else { CAMERA }.as_bytes().to_vec();
        for (kind, place, byte) in edits {
            let at = (place * (bytes.len() - 1) as f64) as usize;
            match kind {
                0 => bytes[at] = byte,
                1 => { bytes.remove(at); }
                2 => bytes.insert(at, b"0123456789-.[]{}=\"e\n"[byte as usize % 20]),
                _ => bytes[at] = b"0123456789-.[]{}=\"e\n"[byte as usize % 20],
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("damaged.toml");
        std::fs::write(&path, &bytes).unwrap();
        match Calibration::read(&path) {
            Ok(calibration) => {
                prop_assert!(calibration.mistakes().is_empty());
                let light = calibration.working_rgb(CameraPx::new(3.0, 4.0), [0.3; 3]);
                prop_assert!(light.is_none_or(|light| light.iter().all(|c| c.is_finite())));
            }
            Err(error) => {
                let text = error.to_string();
                prop_assert!(text.contains("damaged.toml:"), "{}", text);
            }
        }
    }
}
