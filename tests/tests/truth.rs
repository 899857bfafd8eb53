//! The truth cases keep what `tests/truth/README.md` promises.

#![expect(clippy::unwrap_used, reason = "helpers of tests: a panic is a failed test")]

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use coshade_lens::calibration::{Calibration, Channel};
use coshade_lens::pixel::CameraPx;
use coshade_reference::camera::Camera;
use coshade_reference::film::Film;
use coshade_reference::integrator::Settings;
use coshade_reference::job::{JobOptions, render};
use coshade_scene::session::Session;
use coshade_scene::session::placement::PoseSpec;
use coshade_sim::world::World;
use coshade_tests::{PixelSet, TruthCase};
use glam::Vec3;
use nalgebra::Vector2;

const CASES: [&str; 7] = [
    "1_shadow",
    "2_bleeding",
    "3_four_interactions",
    "4_glossy_table",
    "5_caustic",
    "6_near_light",
    "7_closed_room",
];
/// Made by Mitsuba and OpenCV.
const FOREIGN: [&str; 2] = ["1_shadow", "6_near_light"];

fn folder(case: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("truth").join(case)
}

fn world(case: &str) -> World {
    World::read(folder(case).join("world.toml")).unwrap()
}

#[test]
fn the_truth_is_surer_than_it_needs_to_be() {
    for case in CASES {
        let truth = TruthCase::read(&folder(case)).unwrap();
        assert_eq!(truth.size_px, [320, 240], "{case}");
        let (naive, error) = (truth.rmse(&truth.real, PixelSet::Real), truth.standard_error(PixelSet::Real));
        assert!(error <= naive / 20.0, "{case}: standard error {error}, change {naive}");
        // Something virtual is to be seen, and does something to what is real.
        assert!(naive > 0.005 && truth.count(PixelSet::Virtual) > 1000, "{case}: {naive}");
        assert!(truth.mixed.iter().chain(&truth.real).all(|radiance| radiance.is_finite()), "{case}");
        for (index, (real, mixed)) in truth.real.iter().zip(&truth.mixed).enumerate() {
            let (difference, sum) = (truth.difference[index], *mixed - *real);
            // Half floats keep 11 bits; the difference is summed up by itself.
            let rounding = (real.abs() + mixed.abs() + difference.abs()) / 1024.0 + 1e-5;
            assert!(
                (difference - sum).abs().cmple(rounding).all(),
                "{case}, pixel {index}: {difference} {sum}"
            );
        }
    }
}

#[test]
fn all_cases_together_are_small() {
    fn bytes(path: &Path) -> u64 {
        if path.is_dir() {
            std::fs::read_dir(path).unwrap().map(|entry| bytes(&entry.unwrap().path())).sum()
        } else {
            path.metadata().unwrap().len()
        }
    }
    let all = bytes(&folder(""));
    assert!(all <= 12_000_000, "{all}");
}

/// A session knows what its world is, as far as it says.
#[test]
fn sessions_and_worlds_agree() {
    for case in CASES {
        let world = world(case);
        for (name, pictures) in [("session.toml", "exr"), ("sensor.toml", "png")] {
            let session = Session::read(folder(case).join(name)).unwrap();
            assert!(session.assemble().unwrap().lights_to_fit.is_empty());
            let spec = session.spec();
            assert_eq!(spec.things, world.spec().things, "{case} {name}");
            for light in &spec.lights {
                assert!(world.spec().lights.contains(light), "{case} {name}: {light:?}");
            }
            let fisheye = spec.fisheye.as_ref().unwrap();
            assert_eq!(spec.camera.source, format!("images:camera.{pictures}"));
            assert_eq!(fisheye.source, format!("images:fisheye.{pictures}"));
            let sensors = [("camera", &spec.camera.pose), ("fisheye", &fisheye.pose)];
            for (sensor, pose) in sensors {
                let placement = world.spec().sensors[sensor].pose.clone();
                assert_eq!(pose.as_ref().unwrap(), &PoseSpec::World { placement }, "{case} {name} {sensor}");
            }
            assert_eq!(world.spec().sensors["depth"].pose, world.spec().sensors["camera"].pose);
            let calibrations = [("camera", &spec.camera.calibration), ("fisheye", &fisheye.calibration)];
            for (sensor, file) in calibrations {
                let stated = Calibration::read(session.resolve(file.as_ref().unwrap())).unwrap();
                let true_one = world.calibration(sensor).unwrap();
                assert_eq!(stated.model, true_one.model, "{case} {name} {sensor}");
                assert_eq!(stated.image_circle, true_one.image_circle, "{case} {name} {sensor}");
                if pictures == "png" {
                    assert_eq!(stated, true_one);
                }
            }
        }
    }
}

/// What sensors deliver, taken back through their calibration, is the clean picture but for their noise: the error in
/// units of its standard deviation has mean 0 and mean square 1.
#[test]
fn sensors_saw_the_clean_pictures() {
    for case in CASES {
        for sensor in ["camera", "fisheye"] {
            let calibration = world(case).calibration(sensor).unwrap();
            let clean = coshade_image_file::read(folder(case).join(sensor).with_extension("exr")).unwrap();
            let planes = clean.layers[0].image.rgb().unwrap();
            let seen = image::open(folder(case).join(sensor).with_extension("png")).unwrap().into_rgb8();
            let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
            for (x, y, codes) in seen.enumerate_pixels() {
                let position = Vector2::new(f64::from(x), f64::from(y));
                let Some(ray) = calibration.model.unproject(&position) else { continue };
                let falloff =
                    calibration.vignetting.falloff(CameraPx(position), ray.x.hypot(ray.y).atan2(ray.z));
                for (plane, code) in planes.iter().zip(codes.0) {
                    let light = f64::from(plane[y as usize * seen.width() as usize + x as usize]) * falloff;
                    // Where noise is cut at black or white, it is no longer what the calibration says.
                    let variance = calibration.noise.as_ref().unwrap().variance(light, None);
                    if light < 6.0 * variance.sqrt() || light + 6.0 * variance.sqrt() > 1.0 {
                        continue;
                    }
                    let code = f64::from(code) / 255.0;
                    let slope = calibration.response.inverse_slope(Channel::Green, code);
                    let rounding = (slope / 255.0).powi(2) / 12.0;
                    let error = calibration.response.inverse(Channel::Green, code) - light;
                    let normal = error / (variance + rounding).sqrt();
                    sum += normal;
                    squares += normal * normal;
                    count += 1.0;
                }
            }
            assert!(count > 3_000.0, "{case} {sensor}: {count}");
            // Standard errors of mean and mean square: 1/√n and √2/√n; what the response's bend adds is below 1 %.
            assert!((sum / count).abs() < 5.0 / f64::sqrt(count) + 0.01, "{case} {sensor}: {}", sum / count);
            let allowed = 5.0 * f64::sqrt(2.0 / count) + 0.02;
            assert!((squares / count - 1.0).abs() < allowed, "{case} {sensor}: {}", squares / count);
        }
    }
}

fn traced(case: &str, samples: u32) -> Film {
    let world = world(case);
    let tracer = std::sync::Arc::new(world.tracer().unwrap());
    let sensor = world.sensor("camera", tracer.clone()).unwrap();
    let pose = sensor.world_from_sensor(0.0).similarity();
    let calibration = sensor.calibration();
    let camera = Camera::of_calibration(calibration, pose).unwrap();
    let max_depth = world.spec().trace.max_depth;
    let options = JobOptions {
        samples,
        // Not the seed that the cases of our own were made with.
        seed: 1,
        settings: Settings { max_depth, ..Settings::default() },
        ..JobOptions::default()
    };
    render(tracer.scene(), &camera, &options, |_| {}, &AtomicBool::new(false)).unwrap()
}

/// Scenes written by hand for another renderer, its picture warped by another library: if our tracer makes the same of
/// our description of it, both understand cameras, poses, lights and materials alike.
#[test]
fn our_tracer_finds_the_truth_that_was_made_elsewhere() {
    const BLOCK: usize = 16;
    for case in FOREIGN {
        let truth = TruthCase::read(&folder(case)).unwrap();
        let film = traced(case, 48);
        let [width, height] = truth.size_px;
        let (mut blocks, mut far) = (0, 0);
        let (mut ours, mut theirs) = (Vec3::ZERO, Vec3::ZERO);
        for (left, top) in
            (0..height / BLOCK).flat_map(|y| (0..width / BLOCK).map(move |x| (x * BLOCK, y * BLOCK)))
        {
            let indices = (0..BLOCK * BLOCK).map(|i| (top + i / BLOCK) * width + left + i % BLOCK);
            let (mut delta, mut variance) = (Vec3::ZERO, Vec3::ZERO);
            for index in indices {
                let pixel = &film.pixels[index];
                delta += pixel.difference - truth.difference[index];
                variance += pixel.variance + truth.difference_error[index].powf(2.0);
                ours += pixel.mixed;
                theirs += truth.mixed[index];
            }
            for channel in 0..3 {
                blocks += 1;
                far += usize::from(delta[channel].abs() > 4.0 * variance[channel].sqrt() + 1e-4);
            }
        }
        assert!(
            far * 200 <= blocks,
            "{case}: {far} of {blocks} blocks are off by more than 4 standard errors"
        );
        let off = (ours / theirs - Vec3::ONE).abs().max_element();
        assert!(off < 0.003, "{case}: the mean is off by {off}");
    }
}
