//! Scenes, cameras and comparisons.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use coshade_lens::model::{Intrinsics, Pinhole};
use coshade_reference::camera::Camera;
use coshade_reference::emitter::{Environment, Interpolation, Layout};
use coshade_reference::film::{Film, FilmPixel};
use coshade_reference::integrator::{Settings, TraceScene};
use coshade_reference::job::{JobOptions, render};
use coshade_scene::light::{Rectangle, Spot};
use coshade_scene::shape::{cuboid, plane, sphere};
use coshade_scene::{Light, LightKind, Material, Mesh, Pose, Scene, Similarity, Thing, World};
use glam::{Quat, Vec2, Vec3};

pub fn at(x: f32, y: f32, z: f32) -> Similarity {
    Similarity::from_translation(Vec3::new(x, y, z))
}

/// At a place, local +z turned towards a direction.
pub fn facing(position: Vec3, direction: Vec3) -> Similarity {
    let turn = Quat::from_rotation_arc(Vec3::Z, direction.normalize_or(Vec3::Z));
    Similarity { rotation: turn, translation_m: position, scale: 1.0 }
}

/// Without any coat.
pub fn lambert(albedo: Vec3) -> Material {
    Material { ior: 1.0, ..Material::diffuse(albedo) }
}

pub fn glowing(radiance: Vec3, albedo: Vec3) -> Material {
    Material { emissive: radiance, ..lambert(albedo) }
}

pub fn black() -> Material {
    lambert(Vec3::ZERO)
}

pub fn thing(mesh: Mesh, material: Material, pose: Similarity, world: World) -> Thing {
    Thing {
        name: mesh.name.clone(),
        world,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(material)],
        pose: Pose::World(pose),
        hide_marker: false,
    }
}

pub fn real(mesh: Mesh, material: Material, pose: Similarity) -> Thing {
    thing(mesh, material, pose, World::Real)
}

pub fn square(side_m: f32) -> Mesh {
    plane(Vec2::splat(side_m)).unwrap()
}

pub fn block(x: f32, y: f32, z: f32) -> Mesh {
    cuboid(Vec3::new(x, y, z)).unwrap()
}

/// A ball of flat triangles.
pub fn faceted_ball(radius_m: f32, segments: u32) -> Mesh {
    Mesh { normals: Vec::new(), tangents: Vec::new(), ..sphere(radius_m, segments).unwrap() }
}

pub fn light(kind: LightKind, pose: Similarity, world: World) -> Light {
    Light { name: "lamp".to_owned(), world, pose: Pose::World(pose), kind }
}

pub fn spot(intensity: f32, half_angle_deg: f32, radius_m: f32) -> LightKind {
    let angle = half_angle_deg.to_radians();
    LightKind::Spot(Spot {
        radiant_intensity: Vec3::splat(intensity),
        inner_rad: angle,
        outer_rad: angle,
        radius_m,
    })
}

pub fn rectangle(x_m: f32, y_m: f32, radiance: f32) -> LightKind {
    LightKind::Rectangle(Rectangle { size_m: Vec2::new(x_m, y_m), radiance: Vec3::splat(radiance) })
}

/// The scene with nothing but its real things and lights.
pub fn only_real(scene: &Scene) -> Scene {
    let things = scene.things.iter().filter(|thing| thing.world.is_real()).cloned().collect();
    let lights = scene.lights.iter().filter(|light| light.world.is_real()).cloned().collect();
    Scene { things, lights }
}

/// The scene with everything in it really there.
pub fn all_real(scene: &Scene) -> Scene {
    let things = scene.things.iter().cloned().map(|thing| Thing { world: World::Real, ..thing }).collect();
    let lights = scene.lights.iter().cloned().map(|light| Light { world: World::Real, ..light }).collect();
    Scene { things, lights }
}

pub fn trace(scene: &Scene, environment: Option<Environment>) -> TraceScene {
    TraceScene::build(scene, environment, |_| None).unwrap()
}

pub fn white_sky() -> Option<Environment> {
    Some(Environment::constant(Vec3::ONE).unwrap())
}

/// One radiance from above the horizon, another from below.
pub fn two_skies(above: Vec3, below: Vec3) -> Option<Environment> {
    let texels = vec![above, below];
    Some(Environment::new(Layout::LatLong, [1, 2], texels, Interpolation::Nearest, 0.0).unwrap())
}

/// `side_px`² pixels that together see a square of `width_m` at `target`.
pub fn peephole(eye: Vec3, target: Vec3, width_m: f32, side_px: u32) -> Camera {
    let focal = f64::from(side_px) * f64::from(eye.distance(target)) / f64::from(width_m);
    let center = f64::from(side_px) / 2.0 - 0.5;
    let model = Pinhole::new(Intrinsics { fx: focal, fy: focal, cx: center, cy: center }).unwrap();
    let up = if (target - eye).cross(Vec3::Z).length() < 1e-3 { Vec3::Y } else { Vec3::Z };
    Camera::new(model.into(), [side_px; 2], Camera::look_at(eye, target, up)).unwrap()
}

pub fn picture(scene: &TraceScene, camera: &Camera, options: &JobOptions) -> Film {
    let film = render(scene, camera, options, |_| {}, &AtomicBool::new(false)).unwrap();
    assert_eq!(film.rejected_samples, 0);
    film
}

pub fn samples(samples: u32) -> JobOptions {
    JobOptions { samples, ..JobOptions::default() }
}

pub fn depth(max_depth: u32) -> Settings {
    Settings { max_depth, ..Settings::default() }
}

/// A mean and its standard error.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    pub mean: Vec3,
    pub error: Vec3,
}

pub fn real_of(film: &Film) -> Estimate {
    estimate(film, |pixel| (pixel.real, pixel.variance_real))
}

pub fn mixed_of(film: &Film) -> Estimate {
    estimate(film, |pixel| (pixel.mixed, pixel.variance_mixed))
}

pub fn difference_of(film: &Film) -> Estimate {
    estimate(film, |pixel| (pixel.difference, pixel.variance))
}

/// Over all pixels; these are independent unless they share photons.
fn estimate(film: &Film, of: impl Fn(&FilmPixel) -> (Vec3, Vec3)) -> Estimate {
    let count = film.pixels.len() as f32;
    let (mut mean, mut variance) = (Vec3::ZERO, Vec3::ZERO);
    for (value, its_variance) in film.pixels.iter().map(of) {
        mean += value / count;
        variance += its_variance / (count * count);
    }
    Estimate { mean, error: variance.map(f32::sqrt) }
}

/// From independent pictures: for photons, whose noise pixels share.
pub fn over_seeds(count: u32, picture: impl Fn(u32) -> Vec3) -> Estimate {
    let values: Vec<Vec3> = (1..=count).map(picture).collect();
    let n = count as f32;
    let mean = values.iter().sum::<Vec3>() / n;
    let squares: Vec3 = values.iter().map(|value| (*value - mean) * (*value - mean)).sum();
    Estimate { mean, error: (squares / (n * (n - 1.0))).map(f32::sqrt) }
}

impl Estimate {
    /// `expected`, within 3 standard errors and `off` (relative); the standard error must be below `precision` (relative
    /// to the largest channel).
    #[track_caller]
    pub fn is(&self, expected: Vec3, off: f32, precision: f32) {
        let scale = expected.abs().max_element();
        let allowed = 3.0 * self.error + off * scale;
        assert!(
            (self.mean - expected).abs().cmple(allowed).all(),
            "{} ± {}, expected {expected}",
            self.mean,
            self.error
        );
        let error = self.error.max_element();
        assert!(
            error <= precision * scale,
            "standard error {error} is too large for {expected} to be tested"
        );
    }

    /// The same as another estimate.
    #[track_caller]
    pub fn agrees(&self, other: &Self, precision: f32) {
        let error = (self.error * self.error + other.error * other.error).map(f32::sqrt);
        Self { mean: self.mean, error }.is(other.mean, 0.0, precision);
    }
}
