//! Light samplers against their densities, and lights against closed forms.

use std::f64::consts::PI;
use std::sync::Arc;

use coshade_reference::accel::{Accel, Ray, Sees};
use coshade_reference::emitter::{Environment, Interpolation, Layout, Lights};
use coshade_reference::random::{Sampler, hash_words, unit_float};
use coshade_scene::light::{Rectangle, Spot};
use coshade_scene::shape::{plane, sphere};
use coshade_scene::{Light, LightKind, Material, Mesh, Pose, Scene, Similarity, Thing, World};
use glam::{Quat, Vec2, Vec3};

use crate::chi2::Sampling;

fn at(position: Vec3, rotation: Quat) -> Pose {
    Pose::World(Similarity { rotation, translation_m: position, scale: 1.0 })
}

fn lamp(kind: LightKind, pose: Pose) -> Scene {
    let light = Light { name: "lamp".into(), world: World::Real, pose, kind };
    Scene { things: Vec::new(), lights: vec![light] }
}

fn glowing(mesh: Mesh, double_sided: bool) -> Scene {
    let material = Material { emissive: Vec3::ONE, double_sided, ..Material::default() };
    let thing = Thing {
        name: "glow".into(),
        world: World::Virtual,
        mesh: Arc::new(mesh),
        materials: vec![Arc::new(material)],
        pose: at(Vec3::new(0.2, 0.1, 0.9), Quat::from_rotation_x(2.6)),
        hide_marker: false,
    };
    Scene { things: vec![thing], lights: Vec::new() }
}

fn build(scene: &Scene, environment: Option<Environment>) -> (Accel, Lights) {
    let accel = Accel::build(scene, |_| None).unwrap();
    let lights = Lights::build(scene, accel.geometry(), environment, |_| None).unwrap();
    (accel, lights)
}

/// Density of the set of lights towards a direction, found by casting a ray: what a path tracer weights with.
fn pdf_by_ray(accel: &Accel, lights: &Lights, from: Vec3, wi: Vec3) -> f64 {
    let ray = Ray::new(from, wi, 0);
    let mut pdf = lights.pdf_of_environment(wi);
    pdf += lights.hit_lamp(&ray).map_or(0.0, |hit| hit.pdf);
    // Every glowing triangle along the ray: sampling does not know what hides what.
    let mut next = ray;
    while let Some(hit) = accel.closest(&next, Sees::Everything) {
        pdf += lights.pdf_of_triangle(hit.triangle, from, next.at(hit.t));
        next.t_min = hit.t * (1.0 + 1e-5);
    }
    f64::from(pdf)
}

fn check(
    name: &str,
    scene: &Scene,
    environment: Option<Environment>,
    from: Vec3,
    axis: Vec3,
    crowding: f64,
) -> f64 {
    let (accel, lights) = build(scene, environment);
    Sampling {
        name: name.to_owned(),
        sample: &|u2, u1| lights.sample(accel.geometry(), from, u1, u2).map(|sample| sample.wi),
        pdf: &|wi| pdf_by_ray(&accel, &lights, from, wi),
        axis,
        crowding,
    }
    .check()
}

fn spot(radius_m: f32, inner: f32, outer: f32) -> LightKind {
    let (inner_rad, outer_rad) = (f32::to_radians(inner), f32::to_radians(outer));
    LightKind::Spot(Spot { radiant_intensity: Vec3::new(8.0, 7.0, 6.0), inner_rad, outer_rad, radius_m })
}

fn rectangle(x: f32, y: f32) -> LightKind {
    LightKind::Rectangle(Rectangle { size_m: Vec2::new(x, y), radiance: Vec3::new(1.0, 2.0, 3.0) })
}

/// Turned upside down: shines to −z.
fn down() -> Quat {
    Quat::from_rotation_x(std::f32::consts::PI)
}

#[test]
fn lamps_are_drawn_by_their_densities() {
    for (name, kind) in [("disc", spot(0.8, 60.0, 90.0)), ("rectangle", rectangle(1.5, 0.8))] {
        for tilt in [0.0, 0.4] {
            let pose = at(Vec3::new(0.3, -0.2, 1.0), down() * Quat::from_rotation_y(tilt));
            check(
                name,
                &lamp(kind, pose),
                None,
                Vec3::ZERO,
                Vec3::new(0.28, -0.19, 0.94).normalize_or(Vec3::Z),
                2.0,
            );
        }
    }
}

#[test]
fn glowing_meshes_are_drawn_by_their_densities() {
    let axis = Vec3::new(0.2, 0.1, 0.9).normalize_or(Vec3::Z);
    check("plane", &glowing(plane(Vec2::new(1.0, 0.6)).unwrap(), false), None, Vec3::ZERO, axis, 2.0);
    check(
        "two-sided",
        &glowing(plane(Vec2::new(1.0, 0.6)).unwrap(), true),
        None,
        Vec3::new(0.2, 0.1, 2.0),
        -Vec3::Z,
        2.0,
    );
    check("ball", &glowing(sphere(0.5, 8).unwrap(), false), None, Vec3::ZERO, axis, 2.0);
}

fn map(
    layout: Layout,
    size: [usize; 2],
    texel: impl Fn(usize, usize) -> Vec3,
    smooth: Interpolation,
) -> Environment {
    let texels = (0..size[0] * size[1]).map(|i| texel(i % size[0], i / size[0])).collect();
    Environment::new(layout, size, texels, smooth, 0.7).unwrap()
}

fn environments() -> Vec<(String, Environment)> {
    let mut all = vec![];
    for (layout, size) in [(Layout::Octahedral, [8, 8]), (Layout::LatLong, [12, 6])] {
        for smooth in [Interpolation::Nearest, Interpolation::Bilinear] {
            let named = |what: &str| format!("{what} {layout:?} {smooth:?}");
            let gradient = |x: usize, y: usize| Vec3::new(x as f32, y as f32, 1.0);
            let hot = |x: usize, y: usize| if [x, y] == [5, 2] { Vec3::splat(1e4) } else { Vec3::splat(0.1) };
            let lone = |x: usize, y: usize| if [x, y] == [0, 3] { Vec3::splat(1e4) } else { Vec3::ZERO };
            let random = |x: usize, y: usize| Vec3::splat(unit_float(hash_words(&[x as u32, y as u32])));
            all.push((named("constant"), map(layout, size, |_, _| Vec3::ONE, smooth)));
            all.push((named("gradient"), map(layout, size, gradient, smooth)));
            all.push((named("hot pixel"), map(layout, size, hot, smooth)));
            all.push((named("lone pixel"), map(layout, size, lone, smooth)));
            all.push((named("random"), map(layout, size, random, smooth)));
            let tiny = if layout == Layout::Octahedral { [2, 2] } else { [3, 2] };
            all.push((named("tiny"), map(layout, tiny, gradient, smooth)));
            all.push((named("one texel"), map(layout, [1, 1], |_, _| Vec3::ONE, smooth)));
        }
    }
    all
}

#[test]
fn environments_are_drawn_by_their_densities() {
    for (name, environment) in environments() {
        let total = Sampling {
            name: name.clone(),
            sample: &|u2, _| environment.sample(u2),
            pdf: &|wi| f64::from(environment.pdf_sr(wi)),
            axis: Vec3::Z,
            crowding: 1.0,
        }
        .check();
        assert!((total - 1.0).abs() < 3e-3, "{name}: {total}");
    }
}

/// Where there is light there is density, and the mean of L/pdf is the integral of L, by brute force over directions.
#[test]
fn environments_integrate_to_what_they_hold() {
    for (name, environment) in environments() {
        let (mut by_sampling, mut by_force) = (0.0, 0.0);
        let count = 20_000;
        for index in 0..count {
            let mut sampler = Sampler::of_sequence(index, 1);
            let wi = environment.sample(sampler.next_2d()).unwrap();
            by_sampling += f64::from(environment.radiance(wi).y / environment.pdf_sr(wi)) / f64::from(count);
            let u2 = sampler.next_2d();
            let z = 2.0 * u2.x - 1.0;
            let across = (1.0 - z * z).sqrt();
            let (sin, cos) = (std::f32::consts::TAU * u2.y).sin_cos();
            let anywhere = Vec3::new(across * cos, across * sin, z);
            let radiance = environment.radiance(anywhere);
            assert!(radiance == Vec3::ZERO || environment.pdf_sr(anywhere) > 0.0, "{name}");
            by_force += f64::from(radiance.y) * 4.0 * PI / f64::from(count);
        }
        // The brute force of a lone texel (1/72 of the sphere) with 20000 stratified points is good to about 2 %.
        assert!((by_sampling / by_force - 1.0).abs() < 0.03, "{name}: {by_sampling} {by_force}");
    }
}

/// Yaw turns the map counter-clockwise about +Z; the lat-long centre looks along +X, the right half to −Y.
#[test]
fn environments_lie_as_documented() {
    let texels = vec![Vec3::X, Vec3::Y, Vec3::Z, Vec3::ONE];
    let map =
        |yaw| Environment::new(Layout::LatLong, [4, 1], texels.clone(), Interpolation::Nearest, yaw).unwrap();
    let right_of_x = Vec3::new(1.0, -0.3, 0.0);
    assert_eq!(map(0.0).radiance(right_of_x), Vec3::Z);
    let quarter = std::f32::consts::FRAC_PI_2;
    assert_eq!(map(quarter).radiance(Vec3::new(0.3, 1.0, 0.0)), Vec3::Z);
}

/// Irradiance at `point` with normal `normal`, by drawing light points; and its standard error.
fn irradiance(scene: &Scene, point: Vec3, normal: Vec3, count: u32) -> (f64, f64) {
    let (accel, lights) = build(scene, None);
    let (mut sum, mut squares) = (0.0, 0.0);
    for index in 0..count {
        let u = |dimension| unit_float(hash_words(&[index, dimension, 77]));
        let Some(sample) = lights.sample(accel.geometry(), point, u(0), Vec2::new(u(1), u(2))) else {
            continue;
        };
        let value = f64::from(sample.radiance.x * sample.wi.dot(normal).max(0.0) / sample.pdf);
        sum += value;
        squares += value * value;
    }
    let n = f64::from(count);
    (sum / n, ((squares / n - (sum / n).powi(2)).max(0.0) / n).sqrt())
}

/// From afar a disc of any radius is a point of intensity I: E = I/d². A disc of radius r at distance d deviates by less
/// than 2 (r/d)².
#[test]
fn a_disc_is_a_point_from_afar() {
    for radius in [0.001, 0.1] {
        for distance in [5.0_f32, 10.0] {
            let scene = lamp(spot(radius, 40.0, 60.0), at(Vec3::Z * distance, down()));
            let (e, error) = irradiance(&scene, Vec3::ZERO, Vec3::Z, 4000);
            let expected = 8.0 / f64::from(distance).powi(2);
            let allowed = 3.0 * error + expected * (2.0 * f64::from(radius / distance).powi(2) + 1e-5);
            assert!((e - expected).abs() < allowed, "r = {radius}, d = {distance}: {e} {expected}");
        }
    }
    // Within the falloff: at 50°, t = ½ in the cosine only if the cosines say so.
    let angle = f32::to_radians(50.0);
    let position = Vec3::new(angle.sin(), 0.0, angle.cos()) * 10.0;
    let scene = lamp(spot(0.005, 40.0, 60.0), at(position, down()));
    let (e, error) = irradiance(&scene, Vec3::ZERO, position / 10.0, 4000);
    let [c, inner, outer] = [50.0_f64, 40.0, 60.0].map(|deg| deg.to_radians().cos());
    let expected = 8.0 * ((c - outer) / (inner - outer)).powi(2) / 100.0;
    assert!((e - expected).abs() < 3.0 * error + 1e-4 * expected, "{e} {expected}");
}

/// Howell's catalogue B-3: differential element to a parallel rectangle whose corner is on its normal (a, b, distance c),
/// and B-4: to a perpendicular one. E = π L F.
#[test]
fn rectangles_have_their_form_factors() {
    let (a, b, c) = (0.7_f64, 1.1, 0.9);
    let (x, y) = (a / c, b / c);
    let half = |x: f64, y: f64| x / (1.0 + x * x).sqrt() * (y / (1.0 + x * x).sqrt()).atan();
    let parallel = (half(x, y) + half(y, x)) / (2.0 * PI);
    let pose = at(Vec3::new(0.35, 0.55, 0.9), down());
    let (e, error) = irradiance(&lamp(rectangle(0.7, 1.1), pose), Vec3::ZERO, Vec3::Z, 20_000);
    assert!((e - PI * parallel).abs() < 3.0 * error, "parallel {e} ± {error}, {}", PI * parallel);
    // Perpendicular: the element at the origin looks along +z; the rectangle stands in the plane y = c, 0 ≤ x ≤ a,
    // 0 ≤ z ≤ b. F = (1/2π) [atan(1/Y) − Y/√(X²+Y²) · atan(1/√(X²+Y²))], X = b/a, Y = c/a.
    let (x, y) = (b / a, c / a);
    let root = (x * x + y * y).sqrt();
    let perpendicular = ((1.0 / y).atan() - y / root * (1.0 / root).atan()) / (2.0 * PI);
    let pose = at(Vec3::new(0.35, 0.9, 0.55), Quat::from_rotation_x(std::f32::consts::FRAC_PI_2));
    let (e, error) = irradiance(&lamp(rectangle(0.7, 1.1), pose), Vec3::ZERO, Vec3::Z, 20_000);
    assert!(
        (e - PI * perpendicular).abs() < 3.0 * error,
        "perpendicular {e} ± {error}, {}",
        PI * perpendicular
    );
}

/// Photons: their mean flux is the lights' power, and the irradiance they bring to a floor is that of light sampling.
#[test]
fn photons_carry_the_power() {
    let ball = sphere(0.3, 16).unwrap();
    let glow_power = PI * ball.area_m2();
    let spot_power = {
        let [inner, outer] = [40.0_f64, 60.0].map(|deg| deg.to_radians().cos());
        8.0 * 2.0 * PI * (1.0 - inner + (inner - outer) / 3.0)
    };
    let above = || at(Vec3::Z, down());
    for (scene, power) in [
        (lamp(spot(0.05, 40.0, 60.0), above()), spot_power),
        (lamp(rectangle(0.5, 0.4), above()), PI * 0.2),
        (glowing(ball, false), glow_power),
        (glowing(plane(Vec2::new(0.5, 0.4)).unwrap(), true), 2.0 * PI * 0.2),
    ] {
        let (accel, lights) = build(&scene, None);
        let count = 20_000;
        let (mut flux, mut floor, mut floor2) = (0.0, 0.0, 0.0);
        for index in 0..count {
            let u = |dimension| unit_float(hash_words(&[index, dimension, 5]));
            let (position, direction) = (Vec2::new(u(1), u(2)), Vec2::new(u(3), u(4)));
            let photon = lights.sample_emission(accel.geometry(), u(0), position, direction).unwrap();
            flux += f64::from(photon.flux.x) / f64::from(count);
            // A window of 0.4 × 0.4 m in the plane z = −1.
            let t = (-1.0 - photon.origin.z) / photon.direction.z;
            let place = (photon.origin + photon.direction * t).truncate();
            if t > 0.0 && place.abs().max_element() < 0.2 {
                let share = f64::from(photon.flux.x) / 0.16;
                floor += share / f64::from(count);
                floor2 += share * share / f64::from(count);
            }
        }
        assert!((flux / power - 1.0).abs() < 1e-3, "flux {flux}, power {power}");
        let error = ((floor2 - floor * floor) / f64::from(count)).sqrt();
        let probes = 25;
        let mean: f64 = (0..probes)
            .map(|probe| {
                let [x, y] = [probe % 5, probe / 5].map(|k| (k as f32 + 0.5) * 0.08 - 0.2);
                irradiance(&scene, Vec3::new(x, y, -1.0), Vec3::Z, 800).0 / f64::from(probes)
            })
            .sum();
        assert!(
            (floor - mean).abs() < 3.5 * error + 0.01 * mean,
            "photons {floor} ± {error}, light sampling {mean}"
        );
    }
}

/// Photons of a constant environment are a uniform field of rays: a convex body receives π · area of them (Cauchy).
#[test]
fn environment_photons_are_a_uniform_field() {
    let scene = glowing(sphere(0.5, 16).unwrap(), false);
    let dark = Scene {
        things: scene
            .things
            .into_iter()
            .map(|thing| Thing { materials: vec![Arc::new(Material::default())], ..thing })
            .collect(),
        lights: vec![],
    };
    let (accel, lights) = build(&dark, Some(Environment::constant(Vec3::ONE).unwrap()));
    let mesh = &accel.geometry().things()[0].mesh;
    let expected = PI * mesh.area_m2();
    let count = 20_000;
    let (mut sum, mut squares) = (0.0, 0.0);
    for index in 0..count {
        let u = |dimension| unit_float(hash_words(&[index, dimension, 6]));
        let (position, direction) = (Vec2::new(u(1), u(2)), Vec2::new(u(3), u(4)));
        let photon = lights.sample_emission(accel.geometry(), u(0), position, direction).unwrap();
        if accel.closest(&Ray::new(photon.origin, photon.direction, 0), Sees::Everything).is_some() {
            let flux = f64::from(photon.flux.x);
            sum += flux / f64::from(count);
            squares += flux * flux / f64::from(count);
        }
    }
    let error = ((squares - sum * sum) / f64::from(count)).sqrt();
    assert!((sum - expected).abs() < 3.5 * error, "{sum} ± {error}, {expected}");
}
