//! The clean pictures of a case.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Context as _;
use coshade_image_file::{Image, LayeredImage, Precision, write_exr};
use coshade_reference::accel::Sees;
use coshade_reference::camera::Camera;
use coshade_reference::film::Film;
use coshade_reference::integrator::{Settings, TraceScene};
use coshade_reference::job::{JobOptions, render};
use coshade_sim::device::SimSensor;
use coshade_sim::world::World;
use glam::Vec3;
use image::{ImageBuffer, Luma};
use indicatif::ProgressBar;

/// Of depth.png: fine enough for the depth of a clean case, and reaches 6.5 m.
const DEPTH_UNIT_M: f32 = 1e-4;
/// About a pixel on the desk: caustics are not to be blurred by more.
const PHOTON_RADIUS_M: f32 = 0.003;
const PHOTONS_PER_PASS: u32 = 100_000;
/// The fish-eye's picture is summed up over large angles, the camera's is looked at pixel by pixel.
const FISHEYE_SHARE: u32 = 8;

/// Traces `world.toml` of a case's folder with the samples that it states.
pub fn trace(folder: &Path) -> anyhow::Result<()> {
    let world = World::read(folder.join("world.toml"))?;
    let tracer = Arc::new(world.tracer()?);
    let sensor = |name: &str| world.sensor(name, tracer.clone());
    let (camera, fisheye, depth) = (sensor("camera")?, sensor("fisheye")?, sensor("depth")?);

    let film = film(&world, tracer.scene(), &camera, 1)?;
    write_exr(folder.join("truth.exr"), &truth_layers(&film)?, Precision::Half)?;
    let real: Vec<Vec3> = film.pixels.iter().map(|pixel| pixel.real).collect();
    write_picture(&folder.join("camera.exr"), &camera, &real)?;

    let film = self::film(&world, tracer.scene(), &fisheye, FISHEYE_SHARE)?;
    let real: Vec<Vec3> = film.pixels.iter().map(|pixel| pixel.real).collect();
    write_picture(&folder.join("fisheye.exr"), &fisheye, &real)?;

    write_depth(&folder.join("depth.png"), &depth)
}

fn film(world: &World, scene: &TraceScene, sensor: &SimSensor, share: u32) -> anyhow::Result<Film> {
    let pose = sensor.world_from_sensor(sensor.timing().time_s(0)).similarity();
    let trace = world.spec().trace;
    let options = JobOptions {
        samples: (trace.samples / share).max(1),
        settings: Settings { max_depth: trace.max_depth, ..Settings::default() },
        photon_radius_m: Some(PHOTON_RADIUS_M),
        photons_per_pass: Some(PHOTONS_PER_PASS),
        ..JobOptions::default()
    };
    let bar = ProgressBar::new(u64::from(options.samples));
    let camera = Camera::of_calibration(sensor.calibration(), pose)?;
    let film = render(
        scene,
        &camera,
        &options,
        |progress| bar.set_position(u64::from(progress.samples)),
        &AtomicBool::new(false),
    );
    bar.finish_and_clear();
    film.with_context(|| world.file().display().to_string())
}

/// As [`Film::to_layers`], without the real world (which is camera.exr), and the noise as a standard error, whose numbers
/// are large enough for half floats.
fn truth_layers(film: &Film) -> anyhow::Result<LayeredImage> {
    let mut all = film.to_layers()?;
    all.layers.retain(|layer| {
        ["mixed", "difference", "coverage", "depth_z_m", "normal", "albedo"].contains(&layer.name.as_str())
    });
    let [width, height] = film.size_px.map(|side| side as usize);
    let error = |pixel: &coshade_reference::film::FilmPixel| pixel.variance.to_array().map(f32::sqrt).into();
    let errors: Vec<Vec3> = film.pixels.iter().map(error).collect();
    all.push("difference_error", Image::from_rgb(width, height, &errors)?)?;
    Ok(all)
}

fn write_picture(path: &Path, sensor: &SimSensor, radiance: &[Vec3]) -> anyhow::Result<()> {
    let [width, height] = sensor.calibration().size_px.map(|side| side as usize);
    let file = LayeredImage::single(Image::from_rgb(width, height, radiance)?);
    Ok(write_exr(path, &file, Precision::Half)?)
}

fn write_depth(path: &Path, sensor: &SimSensor) -> anyhow::Result<()> {
    let depth = sensor.true_depth(0, Sees::RealOnly);
    let counts = depth.iter().map(|sample| {
        let count = (sample.z_m / DEPTH_UNIT_M).round();
        // 0 is no depth: nothing there, or too far.
        if count < 65536.0 { count as u16 } else { 0 }
    });
    let [width, height] = sensor.calibration().size_px;
    let image = ImageBuffer::<Luma<u16>, _>::from_raw(width, height, counts.collect::<Vec<u16>>());
    Ok(image.context("depth of another size")?.save(path)?)
}
