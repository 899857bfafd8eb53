//! A described room seen by a see-through camera and a fish-eye on one rig, as files: two folders of frames, their
//! calibrations, a session. `simulated_room FOLDER [FRAMES]`.
//!
//! `FOLDER/lenses.png` shows the first frame in the rasters of `coshade_lens`: the camera, the camera made a pinhole,
//! the fish-eye, the fish-eye as octahedral map of the whole sphere.

mod room;

use std::error::Error;
use std::path::Path;

use coshade_lens::calibration::Calibration;
use coshade_lens::pixel::RasterPx;
use coshade_lens::raster::{OctahedralRaster, PinholeRaster, Raster};
use coshade_lens::remap::RemapTable;
use coshade_scene::rig::Rig;
use image::{Rgb, RgbImage};
use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};
use rayon::prelude::*;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Linear RGB, row by row.
struct Picture {
    size_px: [u32; 2],
    rgb: Vec<f32>,
}

fn main() -> Result<()> {
    let mut args = std::env::args().skip(1);
    let folder = args.next().ok_or("usage: simulated_room FOLDER [FRAMES]")?;
    let frames: u32 = args.next().map_or(Ok(45), |frames| frames.parse())?;
    let folder = Path::new(&folder);
    for (name, text) in [
        ("camera.toml", include_str!("camera.toml")),
        ("fisheye.toml", include_str!("fisheye.toml")),
        ("rig.toml", include_str!("rig.toml")),
        ("session.toml", include_str!("session.toml")),
    ] {
        std::fs::create_dir_all(folder)?;
        std::fs::write(folder.join(name), text)?;
    }
    let rig = Rig::read(folder.join("rig.toml"))?;
    let sensor = |name: &'static str| -> Result<_> {
        let rotation = rig.sensors.get(name).ok_or("a sensor that the rig lacks")?.rotation()?;
        let rig_from_sensor = UnitQuaternion::from_quaternion(Quaternion::from(rotation.to_array()));
        let calibration = Calibration::read(folder.join(format!("{name}.toml")))?;
        Ok((name, calibration, rig_from_sensor.inverse().to_rotation_matrix()))
    };
    let lenses = [sensor("camera")?, sensor("fisheye")?];
    for (name, calibration, sensor_from_rig) in &lenses {
        std::fs::create_dir_all(folder.join(name))?;
        for index in 0..frames {
            let (rig_m, rig_from_world) = hand_held_path(f64::from(index) / 30.0);
            let raster = camera_raster(calibration, sensor_from_rig * rig_from_world)?;
            let picture = photograph(&raster, &rig_m);
            encode(&picture).save(folder.join(format!("{name}/{index:04}.png")))?;
        }
    }
    let [(_, camera, _), (_, fisheye, fisheye_from_rig)] = &lenses;
    contact_sheet(camera, fisheye, fisheye_from_rig)?.save(folder.join("lenses.png"))?;
    Ok(())
}

/// Position of the rig in the world and the rotation into its frame (x right, y down, z ahead).
fn hand_held_path(time_s: f64) -> (Vector3<f64>, Rotation3<f64>) {
    let sway = |period_s: f64, phase: f64| (std::f64::consts::TAU * time_s / period_s + phase).sin();
    let position =
        Vector3::new(1.1 + 0.10 * sway(2.3, 0.0), 1.2 + 0.25 * sway(3.1, 0.5), 1.45 + 0.03 * sway(0.9, 1.0));
    let (yaw, pitch) = (0.55 + 0.15 * sway(2.9, 0.2), -0.16 + 0.04 * sway(1.7, 0.9));
    let ahead = Vector3::new(yaw.cos() * pitch.cos(), yaw.sin() * pitch.cos(), pitch.sin());
    // `look_at_rh` looks along −z with +y up: half a turn about x makes it z ahead, y down.
    let gl_from_world = Rotation3::look_at_rh(&ahead, &Vector3::z());
    let rig_from_gl = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    (position, rig_from_gl * gl_from_world)
}

fn camera_raster(calibration: &Calibration, camera_from_frame: Rotation3<f64>) -> Result<Raster> {
    Ok(calibration.raster(camera_from_frame)?.into())
}

/// What a raster at `position_m` in the room sees, 3 × 3 rays a pixel. Black where the lens sees nothing.
fn photograph(raster: &Raster, position_m: &Vector3<f64>) -> Picture {
    const GRID: u32 = 3;
    let [width, height] = raster.size_px();
    let pixel = |x: u32, y: u32| {
        let mut sum = Vector3::zeros();
        for (i, j) in (0..GRID * GRID).map(|n| (n % GRID, n / GRID)) {
            let at = |pixel: u32, sub: u32| f64::from(pixel) + (f64::from(sub) + 0.5) / f64::from(GRID);
            if let Some(direction) = raster.direction(RasterPx::new(at(x, i), at(y, j))) {
                sum += room::radiance(position_m, &direction);
            }
        }
        (sum / f64::from(GRID * GRID)).cast::<f32>()
    };
    let rgb = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| (0..width).flat_map(move |x| <[f32; 3]>::from(pixel(x, y))))
        .collect();
    Picture { size_px: [width, height], rgb }
}

fn encode(picture: &Picture) -> RgbImage {
    let [width, height] = picture.size_px;
    RgbImage::from_fn(width, height, |x, y| {
        let at = 3 * (y * width + x) as usize;
        let code = |linear: f32| {
            let linear = linear.clamp(0.0, 1.0);
            let encoded =
                if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
            (encoded * 255.0).round() as u8
        };
        Rgb([code(picture.rgb[at]), code(picture.rgb[at + 1]), code(picture.rgb[at + 2])])
    })
}

fn remap(picture: &Picture, source: &Raster, destination: &Raster) -> Result<Picture> {
    let size_px = destination.size_px();
    let mut rgb = vec![0.0; 3 * size_px[0] as usize * size_px[1] as usize];
    RemapTable::build(source, destination)?.apply::<3>(&picture.rgb, &mut rgb)?;
    Ok(Picture { size_px, rgb })
}

/// Top: the camera; the camera without its distortion. Bottom: the fish-eye; its map of the whole sphere.
fn contact_sheet(
    camera: &Calibration,
    fisheye: &Calibration,
    fisheye_from_rig: &Rotation3<f64>,
) -> Result<RgbImage> {
    const GAP_PX: i64 = 8;
    let (rig_m, rig_from_world) = hand_held_path(0.0);
    let camera = camera_raster(camera, rig_from_world)?;
    let fisheye = camera_raster(fisheye, fisheye_from_rig * rig_from_world)?;
    let pinhole: Raster = PinholeRaster::with_fov(camera.size_px(), 1.05, rig_from_world)?.into();
    let octahedral: Raster = OctahedralRaster::new(fisheye.size_px()[0], Rotation3::identity())?.into();

    let (seen, around) = (photograph(&camera, &rig_m), photograph(&fisheye, &rig_m));
    let tiles = [
        encode(&seen),
        encode(&remap(&seen, &camera, &pinhole)?),
        encode(&around),
        encode(&remap(&around, &fisheye, &octahedral)?),
    ];
    let column = i64::from(tiles[0].width().max(tiles[2].width())) + GAP_PX;
    let row = i64::from(tiles[0].height().max(tiles[1].height())) + GAP_PX;
    let mut sheet = RgbImage::from_pixel(
        (2 * column - GAP_PX) as u32,
        (row + i64::from(tiles[2].height().max(tiles[3].height()))) as u32,
        Rgb([28, 28, 30]),
    );
    for (tile, (i, j)) in tiles.iter().zip([(0, 0), (1, 0), (0, 1), (1, 1)]) {
        let centred = (column - GAP_PX - i64::from(tile.width())) / 2;
        image::imageops::overlay(&mut sheet, tile, i * column + centred, j * row);
    }
    Ok(sheet)
}
