//! How many camera samples a second the path tracer takes, by scene and number of threads, and what the difference layer
//! gains from common random numbers.
//!
//! `cargo run -p coshade-reference --example samples [-- <seconds each>]` (default 3).
#![allow(clippy::print_stdout, reason = "a report")]

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use coshade_lens::model::{Intrinsics, Pinhole};
use coshade_reference::camera::Camera;
use coshade_reference::emitter::Environment;
use coshade_reference::integrator::{Method, Settings, TraceScene};
use coshade_reference::job::{JobOptions, render};
use coshade_scene::light::Spot;
use coshade_scene::shape::{TeapotLid, cuboid, plane, teapot};
use coshade_scene::{Light, LightKind, Material, Mesh, Pose, Scene, Similarity, Thing, World};
use glam::{Quat, Vec2, Vec3};

type Failure = Box<dyn std::error::Error>;

const SIZE_PX: [u32; 2] = [320, 240];

fn main() -> Result<(), Failure> {
    let seconds: f64 = std::env::args().nth(1).map_or(Ok(3.0), |text| text.parse())?;
    let seconds = Duration::try_from_secs_f64(seconds)?;
    println!("scene                    threads   samples/s   noise of mixed   of the difference");
    for (name, material) in [
        ("teapot, opaque", Material::diffuse(Vec3::new(0.2, 0.6, 0.3))),
        ("teapot, metal", Material::metal(Vec3::new(1.0, 0.8, 0.3), 0.3)),
        ("teapot, glass, photons", Material::glass(1.5)),
    ] {
        let scene =
            TraceScene::build(&desk(material)?, Some(Environment::constant(Vec3::splat(0.3))?), |_| None)?;
        for threads in [1, 2] {
            measure(name, &scene, threads, seconds)?;
        }
    }
    Ok(())
}

fn thing(mesh: Mesh, material: Material, z: f32, world: World) -> Thing {
    Thing {
        name: mesh.name.clone(),
        world,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(material)],
        pose: Pose::World(Similarity::from_translation(Vec3::new(0.0, 0.0, z))),
        hide_marker: false,
    }
}

/// A virtual teapot on a real desk in a real room, under a real lamp and a white sky.
fn desk(material: Material) -> Result<Scene, Failure> {
    let room = Material { double_sided: true, ..Material::diffuse(Vec3::splat(0.7)) };
    let pot = teapot(0.15, 16, TeapotLid::Sealed)?;
    let things = vec![
        thing(plane(Vec2::splat(4.0))?, room, -0.8, World::Real),
        thing(
            cuboid(Vec3::new(1.2, 0.8, 0.03))?,
            Material::diffuse(Vec3::new(0.6, 0.4, 0.2)),
            -0.015,
            World::Real,
        ),
        thing(pot, material, 0.0005, World::Virtual),
    ];
    let position = Vec3::new(0.3, 0.5, 0.9);
    let lamp = Spot { radiant_intensity: Vec3::splat(3.0), inner_rad: 0.4, outer_rad: 0.5, radius_m: 0.01 };
    let lamp = Light {
        name: "lamp".to_owned(),
        world: World::Real,
        pose: Pose::World(Similarity {
            rotation: Quat::from_rotation_arc(Vec3::Z, (-position).normalize_or(Vec3::NEG_Z)),
            translation_m: position,
            scale: 1.0,
        }),
        kind: LightKind::Spot(lamp),
    };
    Ok(Scene { things, lights: vec![lamp] })
}

fn measure(name: &str, scene: &TraceScene, threads: usize, seconds: Duration) -> Result<(), Failure> {
    let model = Pinhole::new(Intrinsics { fx: 300.0, fy: 300.0, cx: 159.5, cy: 119.5 })?;
    let pose = Camera::look_at(Vec3::new(0.5, -0.5, 0.45), Vec3::new(0.0, 0.0, 0.05), Vec3::Z);
    let camera = Camera::new(model.into(), SIZE_PX, pose)?;
    let options = JobOptions {
        samples: 1 << 20,
        time_limit: Some(seconds),
        threads,
        settings: Settings { method: Method::PathsAndPhotons, ..Settings::default() },
        ..JobOptions::default()
    };
    let mut speed = 0.0;
    let film = render(
        scene,
        &camera,
        &options,
        |progress| {
            let samples = u64::from(progress.samples) * u64::from(SIZE_PX[0]) * u64::from(SIZE_PX[1]);
            speed = samples as f64 / progress.elapsed.as_secs_f64();
        },
        &AtomicBool::new(false),
    )?;
    // On real pixels only: elsewhere the two worlds have nothing in common.
    let real = film.pixels.iter().filter(|pixel| pixel.coverage == 0.0);
    let figures = coshade_reference::film::FilmFigures::of(real);
    let root = f64::from(figures.samples_min).sqrt();
    println!(
        "{name:24} {threads:7} {speed:11.0} {:16.3} {:19.3}",
        figures.mixed_error_rms * root,
        figures.difference_error_rms * root
    );
    Ok(())
}
