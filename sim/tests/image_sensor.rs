//! What was asked of an image sensor, measured back from its images.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use coshade_lens::calibration::{Calibration, Channel, Noise, Response, Vignetting};
use coshade_sim::sensor::{Exposure, ImageSensor};

const SIZE: [u32; 2] = [48, 32];
const PIXELS: usize = 48 * 32;

fn sensor(change: impl FnOnce(&mut Calibration)) -> ImageSensor {
    let mut calibration = Calibration::default_for(SIZE, 1.0).unwrap();
    calibration.response = Response::Linear;
    change(&mut calibration);
    assert!(calibration.mistakes().is_empty());
    ImageSensor::new(calibration, 5, 6)
}

fn noise(shot: f64, read: f64) -> Option<Noise> {
    Some(Noise { shot, read, at_gain: Vec::new() })
}

/// Mean, variance and third central moment of the linear light of a flat field, and how many numbers they are from.
fn flat(sensor: &ImageSensor, light: f32, frames: u64) -> (f64, f64, f64, f64) {
    let field = vec![[light; 3]; PIXELS];
    let codes = (0..frames).flat_map(|frame| sensor.codes(&field, &Exposure::default(), frame));
    let lights: Vec<f64> = codes.map(|code| f64::from(code) / 255.0).collect();
    let count = lights.len() as f64;
    let mean = lights.iter().sum::<f64>() / count;
    let moment = |power: i32| lights.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / count;
    (mean, moment(2), moment(3), count)
}

/// Rounding to codes adds the variance of a uniform distribution of a code's width (noise is wider than half a code).
const ROUNDING: f64 = 1.0 / (255.0 * 255.0 * 12.0);

#[test]
fn shot_and_read_noise_are_what_was_asked() {
    let (shot, read) = (0.002, 0.000_04);
    let sensor = sensor(|calibration| calibration.noise = noise(shot, read));
    // Bright enough that black does not clip (read noise is 0.0063), dark enough that white does not. Read noise shows in
    // the dark, so most frames are dark.
    let levels = [(0.05_f32, 600), (0.1, 200), (0.2, 60), (0.35, 60), (0.5, 60), (0.7, 60)];
    let (mut normal, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
    for (light, frames) in levels {
        let (mean, variance, _, count) = flat(&sensor, light, frames);
        let x = f64::from(light);
        assert!((mean - x).abs() < 5.0 * (variance / count).sqrt() + 1e-6, "{mean} {x}");
        // The variance of a variance is 2 σ⁴/n (its excess kurtosis, 1/electrons, is below 0.04).
        let weight = count / (2.0 * (shot * x + read + ROUNDING).powi(2));
        for (row, a) in [(0, x), (1, 1.0)] {
            normal[row][0] += weight * a * x;
            normal[row][1] += weight * a;
            right[row] += weight * a * (variance - ROUNDING);
        }
    }
    let determinant = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
    let found_shot = (right[0] * normal[1][1] - right[1] * normal[0][1]) / determinant;
    let found_read = (right[1] * normal[0][0] - right[0] * normal[1][0]) / determinant;
    let (shot_error, read_error) = ((normal[1][1] / determinant).sqrt(), (normal[0][0] / determinant).sqrt());
    assert!(5.0 * shot_error < 0.05 * shot, "the test is sharp enough: {shot_error}");
    assert!((found_shot - shot).abs() < 5.0 * shot_error, "{found_shot} {shot}");
    assert!(5.0 * read_error < 0.05 * read, "the test is sharp enough: {read_error}");
    assert!((found_read - read).abs() < 5.0 * read_error, "{found_read} {read}");
}

#[test]
fn read_noise_alone_is_what_was_asked() {
    let read = 0.000_1;
    let sensor = sensor(|calibration| calibration.noise = noise(0.0, read));
    let (_, variance, _, count) = flat(&sensor, 0.4, 16);
    let error = (2.0 / count).sqrt();
    assert!(5.0 * error < 0.05);
    assert!(((variance - ROUNDING) / read - 1.0).abs() < 5.0 * error * (1.0 + ROUNDING / read), "{variance}");
}

#[test]
fn few_electrons_are_poisson_distributed() {
    // White is 50 electrons, the field 10: third central moment = λ shot³ (a normal distribution's is 0).
    let shot = 0.02;
    let sensor = sensor(|calibration| calibration.noise = noise(shot, 0.0));
    let (mean, variance, third, count) = flat(&sensor, 0.2, 40);
    let electrons = 0.2 / shot;
    // Standard errors from the normal approximation of the moments: σ√(1/n), σ²√(2/n), σ³√(15/n); codes are whole multiples
    // of 1/255 and electrons of 5.1 codes, so rounding moves each level by up to half a code: at most 0.002 of the mean.
    assert!((mean - 0.2).abs() < 0.002 + 5.0 * (variance / count).sqrt());
    assert!((variance / (0.2 * shot) - 1.0).abs() < 0.01 + 5.0 * (2.2 / count).sqrt(), "{variance}");
    let expected = electrons * shot.powi(3);
    assert!(
        (third / expected - 1.0).abs() < 0.05 + 5.0 * (15.0 / count).sqrt() * variance.powf(1.5) / expected,
        "{third}"
    );
}

#[test]
fn responses_are_what_was_asked() {
    let light = |pixel: usize| (pixel as f32 + 0.5) / PIXELS as f32;
    let ramp: Vec<[f32; 3]> = (0..PIXELS).map(|pixel| [light(pixel); 3]).collect();
    for response in [Response::Srgb, Response::Rec709, Response::Gamma { gamma: 1.8 }, Response::Linear] {
        let sensor = sensor(|calibration| calibration.response = response.clone());
        let codes = sensor.codes(&ramp, &Exposure::default(), 0);
        for (pixel, code) in codes.chunks(3).enumerate() {
            // Without noise only rounding is left: half a code.
            let exact = 255.0 * response.forward(Channel::Green, f64::from(light(pixel)));
            assert!((f64::from(code[1]) - exact).abs() < 0.5 + 1e-4, "{response:?}");
        }
    }
    // The exponent measured back: least squares of ln(light) over ln(code).
    let sensor = sensor(|calibration| calibration.response = Response::Gamma { gamma: 2.2 });
    let codes = sensor.codes(&ramp, &Exposure::default(), 0);
    let bright = codes.chunks(3).enumerate().filter(|(_, code)| code[0] > 30);
    let (mut xy, mut xx) = (0.0, 0.0);
    for (pixel, code) in bright {
        let x = (f64::from(code[0]) / 255.0).ln();
        (xy, xx) = (xy + x * f64::from(light(pixel)).ln(), xx + x * x);
    }
    assert!((xy / xx / 2.2 - 1.0).abs() < 0.005, "{}", xy / xx);
}

#[test]
fn vignetting_is_what_was_asked() {
    let (center_px, radius_px, k) = ([23.5, 15.5], 28.0, [-0.35, 0.05]);
    let sensor = sensor(|calibration| {
        calibration.vignetting = Vignetting::Radial { center_px, radius_px, coefficients: k.to_vec() };
        calibration.noise = noise(0.001, 0.00002);
    });
    let field = vec![[0.6_f32; 3]; PIXELS];
    let frames = 60;
    let mut sums = vec![0.0; PIXELS];
    for frame in 0..frames {
        for (sum, code) in sums.iter_mut().zip(sensor.codes(&field, &Exposure::default(), frame).chunks(3)) {
            *sum +=
                code.iter().map(|code| f64::from(*code)).sum::<f64>() / (3.0 * 255.0 * frames as f64 * 0.6);
        }
    }
    // falloff − 1 = k1 ρ² + k2 ρ⁴.
    let (mut normal, mut right) = ([[0.0; 2]; 2], [0.0; 2]);
    for (pixel, measured) in sums.iter().enumerate() {
        let (x, y) = ((pixel % 48) as f64 - center_px[0], (pixel / 48) as f64 - center_px[1]);
        let rho2 = (x * x + y * y) / (radius_px * radius_px);
        for (row, a) in [rho2, rho2 * rho2].into_iter().enumerate() {
            normal[row][0] += a * rho2;
            normal[row][1] += a * rho2 * rho2;
            right[row] += a * (measured - 1.0);
        }
    }
    let determinant = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
    let k1 = (right[0] * normal[1][1] - right[1] * normal[0][1]) / determinant;
    let k2 = (right[1] * normal[0][0] - right[0] * normal[1][0]) / determinant;
    // Noise of one averaged pixel, at its largest; 1/(255² 12) from rounding.
    let variance = (0.001 * 0.6 + 0.00002 + ROUNDING) / (frames as f64 * 3.0 * 0.36);
    let errors = [normal[1][1], normal[0][0]].map(|entry: f64| (variance * entry / determinant).sqrt());
    assert!(5.0 * errors[0] < 0.05 * 0.35, "the test is sharp enough: {errors:?}");
    assert!(
        (k1 - k[0]).abs() < 5.0 * errors[0] && (k2 - k[1]).abs() < 5.0 * errors[1],
        "{k1} {k2} {errors:?}"
    );
}

#[test]
fn noise_of_the_signal_is_neither_clipped_nor_quantised() {
    let (shot, read) = (0.002, 0.000_4);
    let sensor = sensor(|calibration| calibration.noise = noise(shot, read));
    // In the dark half of the read noise lies below 0; far above white nothing clips.
    for light in [0.0_f32, 3.0] {
        let field = vec![[light; 3]; PIXELS];
        let signal: Vec<f64> = (0..24)
            .flat_map(|frame| sensor.signal(&field, &Exposure::default(), frame))
            .flat_map(|pixel| pixel.map(f64::from))
            .collect();
        let count = signal.len() as f64;
        let mean = signal.iter().sum::<f64>() / count;
        let variance = signal.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count;
        let expected = shot * f64::from(light) + read;
        assert!((mean - f64::from(light)).abs() < 5.0 * (expected / count).sqrt(), "{mean}");
        assert!((variance / expected - 1.0).abs() < 5.0 * (2.0 / count).sqrt(), "{variance}");
    }
}

#[test]
fn exposure_gain_and_colours_scale_light() {
    let sensor = sensor(|calibration| {
        calibration.radiometric.scale = 2.0;
        calibration.radiometric.color_matrix = [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
    });
    let field = vec![[0.3, 0.2, 0.1]; PIXELS];
    let exposure = Exposure { time: 2.0, gain: 1.5, white_balance: [0.5, 1.0, 1.0] };
    // Working = 2 M own: own blue = 0.1/2/0.5, green = 0.2/2, red = 0.3/2 − 0.5 · green.
    let own = [0.15 - 0.05, 0.1, 0.1].map(|x: f32| x * 3.0);
    let light = sensor.light(&field, &exposure);
    let expected = [own[0] * 0.5, own[1], own[2]];
    assert!(
        light[100].iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6),
        "{:?} {expected:?}",
        light[100]
    );
    let codes = sensor.codes(&field, &exposure, 0);
    assert_eq!(codes[300..303], expected.map(|x| (x * 255.0).round() as u8));
    // Clipped, not wrapped.
    let bright = sensor.codes(&vec![[1e6, f32::INFINITY, -3.0]; PIXELS], &exposure, 0);
    assert_eq!(bright[1], 255);
}
