//! A feature of one pixel goes through the whole chain: simulated camera → tracker → lens → picture.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use std::fmt::Write as _;
use std::sync::Arc;

use coshade_capture::{Converter, Frame};
use coshade_lens::response::Channel;
use coshade_sim::World;
use coshade_sim::sensor::Exposure;
use coshade_tracker::{Board, Body, Luma, Tracker, TrackerSettings};
use nalgebra::{Point3, Vector2};

/// An odd lens: principal point off by fractions of a pixel, distorted.
const CAMERA: &str = "version = 1\nsize_px = [240, 180]\n[lens]\nmodel = 'brown_conrady5'\nfx = 251.3\nfy = 250.1\n\
                      cx = 117.81\ncy = 92.34\nk1 = -0.17\nk2 = 0.06\np1 = 0.0011\np2 = -0.0007\nk3 = 0.0\n";
const BOARD: &str = "version = 1\nfamily = 'tag36h11'\n\
                     [[tag]]\nid = 1\nsize_m = 0.06\nposition_m = [-0.08, 0.05]\n\
                     [[tag]]\nid = 2\nsize_m = 0.06\nposition_m = [0.08, 0.05]\n\
                     [[tag]]\nid = 3\nsize_m = 0.06\nposition_m = [-0.08, -0.05]\n\
                     [[tag]]\nid = 4\nsize_m = 0.06\nposition_m = [0.08, -0.05]\n";
const WORLD: &str = "version = 1\nseed = 3\nduration_s = 0.3\n[trace]\nsamples = 96\nmax_depth = 1\n\
                     [[board]]\nfile = 'board.toml'\npose = { position_m = [0, 0, 0.0005] }\n\
                     [sensor.camera]\ncalibration = 'camera.toml'\nframes_per_second = 10\nformat = 'rgb24'\n\
                     [[keyframe]]\ntime_s = 0\nposition_m = [-0.08, -0.2, 0.42]\nlook_at_m = [0.003, 0.004, 0]\n\
                     [[keyframe]]\ntime_s = 0.3\nposition_m = [0.09, -0.17, 0.44]\nlook_at_m = [0.001, 0.002, 0]\n\
                     [[light]]\nkind = 'area'\nworld = 'real'\nsize_m = [0.5, 0.5]\nradiance = [9, 9, 9]\n\
                     pose = { in = 'world', position_m = [0.02, 0.05, 1.5], rotation_deg = [180, 0, 0] }\n\
                     [[thing]]\nname = 'paper'\nworld = 'real'\nshape = { plane = [0.8, 0.6] }\n\
                     pose = { in = 'world', position_m = [0, 0, 0] }\nmaterial = { base_color = [0.8, 0.8, 0.8], ior = 1 }\n";
/// Side of a dot: about a pixel.
const DOT_M: f64 = 0.0018;
/// Above the paper: so little that a dot's shadow, which lies beside it, moves its centre by less than 0.01 px.
const DOT_Z_M: f64 = 0.00005;

/// Between and around the tags, in irregular places.
fn dots() -> Vec<[f64; 2]> {
    let columns = [-0.17, -0.145, -0.02, 0.003, 0.0253, 0.146, 0.168];
    let rows = [-0.1, -0.061, -0.03, 0.004, 0.033, 0.071, 0.109];
    let jitter = |i: usize| 0.0009 * ((i * 7 % 11) as f64 / 5.0 - 1.0);
    let all = columns.iter().flat_map(|x| rows.iter().map(move |y| [*x, *y])).enumerate();
    all.map(|(i, [x, y])| [x + jitter(i), y + jitter(i + 5)]).collect()
}

fn world_text() -> String {
    let mut text = WORLD.to_owned();
    for (i, [x, y]) in dots().iter().enumerate() {
        writeln!(
            text,
            "[[thing]]\nname = 'dot {i}'\nworld = 'real'\nshape = {{ plane = [{DOT_M}, {DOT_M}] }}\n\
             pose = {{ in = 'world', position_m = [{x}, {y}, {DOT_Z_M}] }}\n\
             material = {{ base_color = [0.02, 0.02, 0.02], ior = 1 }}"
        )
        .unwrap();
    }
    text
}

/// Where the darkness around a place has its centre of mass, in linear light.
fn dark_spot(light: &[f64], width: usize, near: &Vector2<f64>) -> Option<Vector2<f64>> {
    const REACH: i64 = 2;
    let (x0, y0) = (near.x.round() as i64, near.y.round() as i64);
    let at = |x: i64, y: i64| {
        let inside = x >= 0 && y >= 0 && (x as usize) < width;
        inside.then(|| light.get(y as usize * width + x as usize).copied()).flatten()
    };
    let around = |reach: i64| (-reach..=reach).flat_map(move |dy| (-reach..=reach).map(move |dx| (dx, dy)));
    // The paper is brighter towards the lamp: a slope of 0.2 % a pixel would move the centre by a tenth of one.
    let (mut paper, mut slope, mut count, mut squares) = (0.0, Vector2::zeros(), 0.0, 0.0);
    for (dx, dy) in around(REACH + 1).filter(|(dx, dy)| dx.abs().max(dy.abs()) > REACH) {
        let value = at(x0 + dx, y0 + dy)?;
        paper += value;
        slope += Vector2::new(dx as f64, dy as f64) * value;
        count += 1.0;
        squares += (dx * dx) as f64;
    }
    (paper, slope) = (paper / count, slope / squares);
    let (mut mass, mut moment) = (0.0, Vector2::zeros());
    for (dx, dy) in around(REACH) {
        let offset = Vector2::new(dx as f64, dy as f64);
        let dark = paper + slope.dot(&offset) - at(x0 + dx, y0 + dy)?;
        mass += dark;
        moment += (Vector2::new(x0 as f64, y0 as f64) + offset) * dark;
    }
    Some(moment / mass)
}

fn grey(frame: &Frame) -> Vec<u8> {
    let mut codes = vec![0; (frame.width_px * frame.height_px) as usize];
    Converter::new().grey(frame, &mut codes).unwrap();
    codes
}

#[test]
fn a_pixel_stays_in_its_place() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("camera.toml"), CAMERA).unwrap();
    std::fs::write(folder.path().join("board.toml"), BOARD).unwrap();
    let world = World::parse(&world_text(), folder.path().join("world.toml")).unwrap();
    let sensor = world.sensor("camera", Arc::new(world.tracer().unwrap())).unwrap();
    let calibration = sensor.calibration();
    let body = Body::from_board("board", &Board::parse(BOARD, "board.toml").unwrap()).unwrap();
    let mut tracker = Tracker::new(calibration, &[body], TrackerSettings::default()).unwrap();

    let mut offsets = Vec::new();
    for index in 0..sensor.frame_count() {
        let frame = sensor.frame(index, &Exposure::default()).unwrap();
        let (codes, width) = (grey(&frame), frame.width_px);
        let image = Luma::new(&codes, width, frame.height_px, width).unwrap();
        let tracking = tracker.track(&image, frame.captured);
        assert_eq!(tracking.tags.len(), 4);
        let camera_from_board = tracking.bodies[0].camera_from_body;
        let light: Vec<f64> = codes
            .iter()
            .map(|code| calibration.response.inverse(Channel::Green, f64::from(*code) / 255.0))
            .collect();
        for [x, y] in dots() {
            // The board's frame is the world's, lifted by half a millimetre.
            let place = camera_from_board * Point3::new(x, y, DOT_Z_M - 0.0005);
            let expected = calibration.model.project(&place.coords).unwrap();
            if let Some(seen) = dark_spot(&light, width as usize, &expected) {
                offsets.push(seen - expected);
            }
        }
    }
    let count = offsets.len() as f64;
    let mean = offsets.iter().sum::<Vector2<f64>>() / count;
    let spread =
        (offsets.iter().map(|offset| (offset - mean).norm_squared()).sum::<f64>() / (2.0 * count)).sqrt();
    let standard_error = spread / count.sqrt();
    println!(
        "{count} dots: mean offset ({:.4}, {:.4}) ± {standard_error:.4} px, each ± {spread:.3} px",
        mean.x, mean.y
    );
    assert!(count > 100.0, "{count}");
    assert!(mean.amax() < 0.02, "{mean}");
}
