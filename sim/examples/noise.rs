//! How noisy the tracer is beside the sensor: `noise WORLD SENSOR FRAME [PICTURE.png]`.
//!
//! Traces a frame twice, the second time from a nanometre away, which draws other random numbers. The difference of the two is
//! √2 times the tracer's standard error. It is compared with the noise that the sensor's calibration states for each pixel, in
//! linear light on the sensor. The picture is what the sensor makes of the first.

use std::io::Write as _;
use std::sync::Arc;

use coshade_capture::clock::now;
use coshade_reference::accel::Sees;
use coshade_sim::World;
use coshade_sim::sensor::{Exposure, ImageSensor};
use coshade_sim::tracer::{Tracer as _, View};
use glam::DVec3;

/// Median of the absolute value of a normally distributed number.
const NORMAL_MEDIAN: f64 = 0.674_49;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [world, sensor, frame, picture @ ..] = arguments.as_slice() else {
        return Err("arguments: WORLD SENSOR FRAME [PICTURE.png]".into());
    };
    let world = World::read(world)?;
    let tracer = Arc::new(world.tracer()?);
    let sensor = world.sensor(sensor, Arc::clone(&tracer) as _)?;
    let frame = frame.parse()?;
    let calibration = sensor.calibration();
    let [width_px, height_px] = calibration.size_px;
    let mut view = View {
        calibration,
        world_from_camera: sensor.world_from_sensor(sensor.timing().time_s(frame)),
        rows: 0..height_px,
        sees: Sees::RealOnly,
    };
    // Before the clock starts: photons are traced once for all pictures.
    tracer.radiance(&View { rows: 0..1, ..view.clone() });
    let start = now();
    let first = tracer.radiance(&view);
    let seconds = now().signed_ns_since(start) as f64 * 1e-9;
    view.world_from_camera.position_m += DVec3::splat(1e-9);
    let second = tracer.radiance(&view);

    let optics = ImageSensor::new(calibration.clone(), 0, 0);
    let exposure = Exposure::default();
    let light = [&first, &second].map(|radiance| optics.light(radiance, &exposure));
    let (shot, read) = calibration.noise.as_ref().map_or((0.0, 0.0), |noise| noise.at(Some(1.0)));
    let pairs = light[0].as_flattened().iter().zip(light[1].as_flattened());
    // Squares of the tracer's error and of the sensor's. What is clipped shows neither; a fish-eye sees nothing outside its
    // circle.
    let errors: Vec<[f64; 2]> = pairs
        .map(|(a, b)| [f64::from(*a), f64::from(*b)])
        .filter(|[a, b]| *a < 1.0 && *b < 1.0 && a + b > 0.0)
        .map(|[a, b]| [(a - b).powi(2) / 2.0, shot * (a + b) / 2.0 + read])
        .collect();
    let rms = |which: usize| (errors.iter().map(|e| e[which]).sum::<f64>() / errors.len() as f64).sqrt();
    let mut ratios: Vec<f64> = errors.iter().map(|e| (e[0] / e[1]).sqrt()).collect();
    ratios.sort_by(f64::total_cmp);
    let median = ratios.get(ratios.len() / 2).unwrap_or(&0.0) / NORMAL_MEDIAN;
    let light = light[0].as_flattened();
    let mean = light.iter().sum::<f32>() / light.len() as f32;
    let clipped = light.iter().filter(|x| **x >= 1.0).count() as f64 / light.len() as f64;
    write!(
        std::io::stdout(),
        "{width_px} x {height_px} pixels traced in {seconds:.1} s; mean light {mean:.3}, clipped {:.2} %\n\
         standard error of the tracer {:.5} (rms), noise of the sensor {:.5} (rms): ratio {:.3}; median of the pixels' ratios {median:.3}\n",
        100.0 * clipped,
        rms(0),
        rms(1),
        rms(0) / rms(1),
    )?;
    if let [picture] = picture {
        let codes = optics.codes(&first, &exposure, frame);
        image::save_buffer(picture, &codes, width_px, height_px, image::ExtendedColorType::Rgb8)?;
    }
    Ok(())
}
