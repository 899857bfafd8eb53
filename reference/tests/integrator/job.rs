//! Jobs: the same picture whatever the threads, shards that fit together, limits that end.

use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use coshade_image_file::Precision;
use coshade_lens::model::{Intrinsics, KannalaBrandt4, Pinhole};
use coshade_reference::camera::Camera;
use coshade_reference::film::{Film, merge};
use coshade_reference::integrator::TraceScene;
use coshade_reference::job::{JobError, JobOptions, Shard, render};
use coshade_scene::shape::sphere;
use coshade_scene::{Material, Scene, World};
use glam::Vec3;

use crate::studio::*;

fn scene() -> TraceScene {
    let things = vec![
        real(square(2.0), lambert(Vec3::splat(0.6)), at(0.0, 0.0, 0.0)),
        thing(sphere(0.3, 32).unwrap(), Material::glass(1.5), at(0.0, 0.0, 0.3), World::Virtual),
    ];
    let lamp = light(
        spot(3.0, 30.0, 0.02),
        facing(Vec3::new(0.0, 0.5, 1.5), Vec3::new(0.0, -0.3, -1.0)),
        World::Real,
    );
    trace(&Scene { things, lights: vec![lamp] }, white_sky())
}

/// 50 × 36 pixels: tiles at the edges are cut.
fn camera() -> Camera {
    let model = Pinhole::new(Intrinsics { fx: 50.0, fy: 50.0, cx: 24.5, cy: 17.5 }).unwrap();
    let pose = Camera::look_at(Vec3::new(1.5, 1.0, 1.2), Vec3::new(0.0, 0.0, 0.2), Vec3::Z);
    Camera::new(model.into(), [50, 36], pose).unwrap()
}

fn options() -> JobOptions {
    JobOptions { photons_per_pass: Some(3000), ..samples(3) }
}

#[test]
fn threads_do_not_change_a_bit() {
    let (scene, camera) = (scene(), camera());
    let one = picture(&scene, &camera, &JobOptions { threads: 1, ..options() });
    let three = picture(&scene, &camera, &JobOptions { threads: 3, ..options() });
    assert_eq!(one, three);
    let other = picture(&scene, &camera, &JobOptions { seed: 1, ..options() });
    assert_ne!(one, other);
}

#[test]
fn shards_merge_to_the_whole_picture() {
    let (scene, camera) = (scene(), camera());
    let whole = picture(&scene, &camera, &options());
    let folder = tempfile::tempdir().unwrap();
    let part = |index| {
        let shard = Shard { index, count: 5 };
        let film = picture(&scene, &camera, &JobOptions { shard, ..options() });
        let path = folder.path().join(format!("{index}.exr"));
        film.write(&path, Precision::Float).unwrap();
        Film::read(&path).unwrap()
    };
    let mut parts: Vec<Film> = (0..5).rev().map(part).collect();
    assert_eq!(merge(&parts).unwrap(), whole);
    let shard = Shard { index: 2, count: 5 };
    parts[2] = picture(&scene, &camera, &JobOptions { seed: 9, shard, ..options() });
    assert_eq!(
        merge(&parts).unwrap_err().to_string().split(':').next(),
        Some("picture 3 is a shard of another job than picture 1")
    );
}

#[test]
fn more_shards_than_tiles_leave_some_empty() {
    let tiny = peephole(Vec3::new(1.5, 1.0, 1.2), Vec3::ZERO, 1.0, 4);
    let film = picture(&scene(), &tiny, &JobOptions { shard: Shard { index: 1, count: 2 }, ..options() });
    assert!(film.pixels.iter().all(|pixel| pixel.samples == 0));
}

#[test]
fn limits_end_a_job() {
    let (scene, camera) = (scene(), camera());
    let none = AtomicBool::new(false);
    let endless = JobOptions { samples: 1 << 20, photons_per_pass: Some(500), ..JobOptions::default() };
    let timed = JobOptions { time_limit: Some(Duration::from_millis(50)), ..endless.clone() };
    let mut seen = Vec::new();
    let film = render(&scene, &camera, &timed, |progress| seen.push(*progress), &none).unwrap();
    let last = seen.last().unwrap();
    assert!(last.elapsed >= Duration::from_millis(50) && last.samples < 1000);
    assert!(seen.iter().zip(1..).all(|(progress, sample)| progress.samples == sample));
    assert!(film.pixels.iter().all(|pixel| pixel.samples == last.samples));

    let exact = JobOptions { error_limit: Some(0.2), ..endless.clone() };
    let mut last = None;
    let film = render(&scene, &camera, &exact, |progress| last = Some(*progress), &none).unwrap();
    assert!(last.unwrap().relative_error.unwrap() <= 0.2);
    assert!(film.figures().relative_error() <= 0.2);

    let stop = AtomicBool::new(false);
    let after_two = |progress: &coshade_reference::job::Progress| {
        stop.store(progress.samples >= 2, Ordering::Relaxed);
    };
    let film = render(&scene, &camera, &endless, after_two, &stop).unwrap();
    assert_eq!(film.figures().samples_min, 2);
    let error = render(&scene, &camera, &endless, |_| {}, &stop).unwrap_err();
    assert!(matches!(error, JobError::NoSamples));
    let senseless = JobOptions { samples: 0, ..endless };
    assert!(matches!(render(&scene, &camera, &senseless, |_| {}, &none), Err(JobError::Option { .. })));
}

/// Depth, normal, albedo and coverage of a floor and a virtual block that covers the left half.
#[test]
fn layers_show_the_first_surface_of_the_mixed_world() {
    let things = vec![
        real(square(4.0), lambert(Vec3::new(0.1, 0.2, 0.3)), at(0.0, 0.0, 0.0)),
        thing(block(1.0, 4.0, 0.5), lambert(Vec3::new(0.4, 0.5, 0.6)), at(-0.5, 0.0, 0.25), World::Virtual),
    ];
    let scene = trace(&Scene { things, lights: Vec::new() }, white_sky());
    let film = picture(&scene, &peephole(Vec3::new(0.0, 0.0, 2.0), Vec3::ZERO, 1.0, 9), &samples(64));
    let (left, middle, right) =
        (film.pixel(0, 4).unwrap(), film.pixel(4, 4).unwrap(), film.pixel(8, 4).unwrap());
    assert_eq!((left.coverage, right.coverage), (1.0, 0.0));
    // The edge is in the middle of the middle pixel.
    assert!((middle.coverage - 0.5).abs() < 0.05, "{}", middle.coverage);
    // z along the axis, not the ray's length.
    assert!((left.depth_m - 1.5).abs() < 1e-5 && (right.depth_m - 2.0).abs() < 1e-5);
    assert!((right.normal - Vec3::Z).length() < 1e-5);
    assert!((left.albedo - Vec3::new(0.4, 0.5, 0.6)).length() < 1e-5);
    assert!((right.albedo - Vec3::new(0.1, 0.2, 0.3)).length() < 1e-5);
}

/// A fish-eye sees nothing outside of its cone; inside, its depth is range.
#[test]
fn wide_lenses_have_range_and_an_edge() {
    let intrinsics = Intrinsics { fx: 8.0, fy: 8.0, cx: 31.5, cy: 31.5 };
    let lens = KannalaBrandt4::new(intrinsics, [0.0; 4]).unwrap();
    let room = Material { double_sided: true, ..glowing(Vec3::ONE, Vec3::ZERO) };
    let ball = real(faceted_ball(2.0, 32), room, at(0.0, 0.0, 0.0));
    let scene = trace(&Scene { things: vec![ball], lights: Vec::new() }, None);
    let camera = Camera::new(lens.into(), [64, 64], at(0.0, 0.0, 0.0)).unwrap();
    let film = picture(&scene, &camera, &samples(4));
    assert!(film.depth_is_range);
    let max_px = 8.0 * camera.model().max_angle_rad() as f32;
    for (at, pixel) in film.pixels.iter().enumerate() {
        let radius = ((at % 64) as f32 - 31.5).hypot((at / 64) as f32 - 31.5);
        if radius < max_px - 1.0 {
            assert_eq!(pixel.mixed, Vec3::ONE);
            // Facets: cos(π/32) at least, along both angles.
            assert!((2.0 * 0.99..=2.0 + 1e-5).contains(&pixel.depth_m), "{}", pixel.depth_m);
        } else if radius > max_px + 1.0 {
            let nothing = (pixel.mixed, pixel.coverage, pixel.depth_m, pixel.samples);
            assert_eq!(nothing, (Vec3::ZERO, 0.0, 0.0, 4));
        }
    }
}
