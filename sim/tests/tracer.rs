//! The path tracer as the eye of sensors: caustics, repeatability, noise.

#![expect(clippy::unwrap_used, reason = "clippy knows only functions marked as tests as tests")]

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coshade_lens::calibration::Calibration;
use coshade_reference::accel::Sees;
use coshade_reference::camera::Camera;
use coshade_reference::integrator::{Classes, Method, Settings, TraceScene};
use coshade_reference::job::{JobOptions, render};
use coshade_reference::photon::{Photon, PhotonPaths, trace_photons};
use coshade_scene::light::Spot;
use coshade_scene::shape::{plane, sphere};
use coshade_scene::{Light, LightKind, Material, Mesh, Pose, Scene, Similarity, Thing, World};
use coshade_sim::pose::Rigid;
use coshade_sim::tracer::{PathTracer, TraceSpec, Tracer as _, View};
use glam::{DVec3, Quat, Vec2, Vec3};

const EYE: Vec3 = Vec3::new(0.0, 2.5, 1.5);

fn thing(name: &str, mesh: Mesh, material: Material, z_m: f32) -> Thing {
    Thing {
        name: name.to_owned(),
        world: World::Real,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(material)],
        pose: Pose::World(Similarity::from_translation(Vec3::new(0.0, 0.0, z_m))),
        hide_marker: false,
    }
}

/// A ball above a floor, under a lamp as large as a table.
fn scene(ball: Material) -> Scene {
    let spot = Spot {
        radiant_intensity: Vec3::new(4.0, 3.0, 2.0),
        inner_rad: 60_f32.to_radians(),
        outer_rad: 80_f32.to_radians(),
        radius_m: 0.5,
    };
    let down = Quat::from_rotation_x(std::f32::consts::PI);
    Scene {
        things: vec![
            thing("floor", plane(Vec2::splat(1.4)).unwrap(), Material::diffuse(Vec3::splat(0.6)), 0.0),
            thing("ball", sphere(0.3, 64).unwrap(), ball, 0.35),
        ],
        lights: vec![Light {
            name: "lamp".into(),
            world: World::Real,
            pose: Pose::World(Similarity {
                rotation: down,
                translation_m: Vec3::new(0.2, 0.0, 2.0),
                scale: 1.0,
            }),
            kind: LightKind::Spot(spot),
        }],
    }
}

fn traced(scene: &Scene) -> TraceScene {
    TraceScene::build(scene, None, |_| None).unwrap()
}

/// 8 × 8 pixels that together see a square of `width_m` at a place.
fn peephole(target: Vec3, width_m: f32) -> (Calibration, Similarity) {
    let fov_rad = 2.0 * (width_m / 2.0 / EYE.distance(target)).atan();
    let calibration = Calibration::default_for([8, 8], f64::from(fov_rad)).unwrap();
    (calibration, Camera::look_at(EYE, target, Vec3::Z))
}

fn view<'a>(calibration: &'a Calibration, pose: &Similarity) -> View<'a> {
    let world_from_camera =
        Rigid { rotation: pose.rotation.as_dquat(), position_m: pose.translation_m.as_dvec3() };
    View { calibration, world_from_camera, rows: 0..8, sees: Sees::RealOnly }
}

fn tracer(scene: &Scene, samples: u32) -> PathTracer {
    PathTracer::new(traced(scene), TraceSpec { samples, max_depth: 12 }, String::new())
}

/// Mean and standard error.
fn statistics(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (mean, (squares / (n * (n - 1.0))).sqrt())
}

/// By eye paths alone, which hit this large lamp by chance: mean of the green channel and its standard error.
fn by_eye_paths(calibration: &Calibration, pose: Similarity, classes: Classes) -> (f64, f64) {
    let settings = Settings { method: Method::Paths, max_depth: 12, classes, ..Settings::default() };
    let camera = Camera::new(calibration.model, [8, 8], pose).unwrap();
    let scene = traced(&scene(Material::glass(1.5)));
    let options = JobOptions { samples: 4096, settings, ..JobOptions::default() };
    let film = render(&scene, &camera, &options, |_| {}, &AtomicBool::new(false)).unwrap();
    let mean = film.pixels.iter().map(|pixel| f64::from(pixel.real.y)).sum::<f64>() / 64.0;
    let variance: f64 = film.pixels.iter().map(|pixel| f64::from(pixel.variance_real.y)).sum();
    (mean, variance.sqrt() / 64.0)
}

#[test]
fn caustics_are_those_of_eye_paths() {
    const SAMPLES: u32 = 16;
    const WIDTH_M: f32 = 0.04;
    let target = Vec3::new(-0.05, 0.0, 0.0);
    let (calibration, pose) = peephole(target, WIDTH_M);
    let scene = scene(Material::glass(1.5));
    let picture = tracer(&scene, SAMPLES).radiance(&view(&calibration, &pose));
    let green: Vec<f64> = picture.iter().map(|pixel| f64::from(pixel[1])).collect();
    let (found, _) = statistics(&green);
    let (expected, its_error) = by_eye_paths(&calibration, pose, Classes::ALL);
    let (without, _) = by_eye_paths(&calibration, pose, Classes { lamp_caustics: false, ..Classes::ALL });

    // Pixels share the photons: of n that arrive in the square, the noise is 1/sqrt(n). A quarter as many start here.
    let (traced, stop) = (traced(&scene), AtomicBool::new(false));
    let settings = Settings { max_depth: 12, ..Settings::default() };
    let photons =
        trace_photons(&traced, &settings, PhotonPaths::Caustics, SAMPLES << 16, [1, 0], &stop).unwrap();
    let inside = |photon: &&Photon| {
        let off = (photon.position - target).abs();
        off.z < 0.01 && off.truncate().max_element() < WIDTH_M / 2.0
    };
    let arrived = 4 * photons.iter().filter(inside).count();
    let photon_error = (expected - without) / (arrived as f64).sqrt();

    // Other light deviates by less than itself from sample to sample.
    let other_error = without / f64::from(64 * SAMPLES).sqrt();

    let error = other_error.hypot(its_error).hypot(photon_error);
    assert!((found - expected).abs() < 3.0 * error, "{found}, expected {expected}, ± {error}");
    assert!(expected - without > 20.0 * error, "{expected} with, {without} without caustics, ± {error}");
}

#[test]
fn the_same_view_is_the_same_picture() {
    let scene = scene(Material::glass(1.5));
    let (calibration, pose) = peephole(Vec3::new(-0.2, 0.0, 0.0), 0.8);
    let view = view(&calibration, &pose);
    let whole = tracer(&scene, 4).radiance(&view);
    // On one thread, in parts, photons and all.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let parts = pool.install(|| {
        let tracer = tracer(&scene, 4);
        [0..3, 3..8].map(|rows| tracer.radiance(&View { rows, ..view.clone() })).concat()
    });
    assert_eq!(whole, parts);
}

/// The noise must not stand still on the screen while the camera moves.
#[test]
fn another_place_has_other_noise() {
    let scene = scene(Material::diffuse(Vec3::splat(0.5)));
    let (calibration, pose) = peephole(Vec3::new(-0.6, 0.0, 0.0), 0.04);
    let tracer = tracer(&scene, 4);
    let pictures: Vec<Vec<f64>> = (0..2)
        .map(|step| {
            let mut view = view(&calibration, &pose);
            view.world_from_camera.position_m += DVec3::splat(1e-9 * f64::from(step));
            tracer.radiance(&view).iter().map(|pixel| f64::from(pixel[1])).collect()
        })
        .collect();
    let noise: Vec<Vec<f64>> = pictures
        .iter()
        .map(|picture| {
            let (mean, error) = statistics(picture);
            picture.iter().map(|value| (value - mean) / (error * 8.0)).collect()
        })
        .collect();
    // Of 64 independent pairs: standard error 1/8.
    let correlation = noise[0].iter().zip(&noise[1]).map(|(a, b)| a * b).sum::<f64>() / 64.0;
    assert!(correlation.abs() < 0.5, "{correlation}");
}

#[test]
fn tracing_both_worlds_or_one_is_the_same() {
    use coshade_reference::camera::CameraRay;
    use coshade_reference::differential::Worlds;
    use coshade_reference::integrator::EyePath;
    use coshade_reference::random::Sampler;

    let mut scene = scene(Material::glass(1.5));
    scene.things[1].world = World::Virtual;
    let scene = traced(&scene);
    let settings = Settings { max_depth: 12, method: Method::Paths, ..Settings::default() };
    let mut differ = 0;
    for index in 0..500 {
        let at = Sampler::of_sequence(index, 1).next_2d() * 1.2 - 0.6;
        let direction = (at.extend(0.0) - EYE).normalize_or_zero();
        let ray = CameraRay { origin: EYE, direction, depth_per_m: 1.0 };
        let trace = |worlds| {
            let sampler = Sampler::new([0, 0], index, 7);
            EyePath::trace_in(worlds, &scene, settings, None, &ray, sampler).radiance
        };
        let both = trace(Worlds::BOTH);
        let (real, mixed) = (trace(Worlds::REAL).real(), trace(Worlds::MIXED).mixed());
        assert!(both.real().abs_diff_eq(real, 1e-4 * (1.0 + real.max_element())), "{index}");
        assert!(both.mixed().abs_diff_eq(mixed, 1e-4 * (1.0 + mixed.max_element())), "{index}");
        differ += u32::from(real != mixed);
    }
    assert!(differ > 50, "{differ}");
}
