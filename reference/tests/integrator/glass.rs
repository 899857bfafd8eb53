//! Glass against Fresnel, Snell and Beer–Lambert.

use std::f64::consts::{PI, TAU};
use std::sync::atomic::AtomicBool;

use coshade_reference::integrator::Settings;
use coshade_reference::photon::{PhotonPaths, trace_photons};
use coshade_scene::shape::sphere;
use coshade_scene::{Material, Scene, World};
use glam::Vec3;

use crate::studio::*;

/// Unpolarised reflectance from air into an index, by the sine and tangent laws (written unlike the renderer's), and the
/// cosine inside.
fn fresnel(cos_outside: f64, index: f64) -> (f64, f64) {
    let outside = cos_outside.acos();
    let inside = (outside.sin() / index).asin();
    if outside < 1e-6 {
        return (((index - 1.0) / (index + 1.0)).powi(2), 1.0);
    }
    let s = ((outside - inside).sin() / (outside + inside).sin()).powi(2);
    let p = ((outside - inside).tan() / (outside + inside).tan()).powi(2);
    (f64::midpoint(s, p), inside.cos())
}

/// A plate between two skies: with F of one face and a = exp(−α′ d/cosθ_t),
/// R = F + F (1−F)² a²/(1 − F² a²) and T = (1−F)² a/(1 − F² a²).
#[test]
fn plate_reflects_and_transmits_with_all_inner_reflections() {
    let material = Material {
        attenuation_color: Vec3::new(0.5, 0.9, 1.0),
        attenuation_distance_m: 0.1,
        ..Material::glass(1.5)
    };
    let plate = real(block(8.0, 8.0, 0.1), material, at(0.0, 0.0, 0.0));
    let scene = Scene { things: vec![plate], lights: Vec::new() };
    let skies = [Vec3::new(1.0, 0.2, 0.4), Vec3::new(0.3, 2.0, 1.0)];
    let scene = trace(&scene, two_skies(skies[0], skies[1]));
    for angle_deg in [0.0_f64, 45.0, 75.0] {
        let (sin, cos) = angle_deg.to_radians().sin_cos();
        let target = Vec3::new(0.1, 0.2, 0.05);
        let eye = target + Vec3::new(0.0, sin as f32, cos as f32) * 2.0;
        let film = picture(&scene, &peephole(eye, target, 1e-3, 16), &samples(256));
        let (f, cos_inside) = fresnel(cos, 1.5);
        let expected = [0, 1, 2].map(|channel| {
            let color = [0.5_f64, 0.9, 1.0][channel];
            let a = color.powf(1.0 / cos_inside);
            let inner = (1.0 - f).powi(2) / (1.0 - f * f * a * a);
            let (reflected, transmitted) = (f + f * a * a * inner, a * inner);
            (reflected * f64::from(skies[0][channel]) + transmitted * f64::from(skies[1][channel])) as f32
        });
        // Rays start 32 ulps of 8 m off each face: the plate is 6e-4 thinner.
        mixed_of(&film).is(Vec3::from(expected), 6e-4, 4e-3);
    }
}

/// A body of the index of what is around it changes nothing but what it absorbs.
#[test]
fn glass_of_index_one_is_not_there() {
    let ball = real(faceted_ball(0.5, 16), Material::glass(1.0), at(0.0, 0.0, 1.0));
    let floor = real(square(3.0), glowing(Vec3::new(0.3, 0.5, 0.7), Vec3::ZERO), at(0.0, 0.0, 0.0));
    let scene = trace(&Scene { things: vec![ball, floor], lights: Vec::new() }, None);
    let film = picture(&scene, &peephole(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO, 1.0, 8), &samples(4));
    assert!(film.pixels.iter().all(|pixel| (pixel.mixed - Vec3::new(0.3, 0.5, 0.7)).length() < 1e-6));
}

/// A lamp before a glass ball in a black room: all flux that the ball reflects, lets through, and lets out after k inner
/// reflections, each order against the chain of Fresnel and Beer–Lambert. All chords of a ray within a ball are alike.
#[test]
fn flux_behind_a_ball_is_that_of_the_fresnel_chain() {
    const INTENSITY: f64 = 3.0;
    const DISTANCE: f64 = 4.0;
    const COLOR: f64 = 0.6;
    let half_angle = 10.0_f64;
    let material = Material {
        attenuation_color: Vec3::splat(COLOR as f32),
        attenuation_distance_m: 1.0,
        ..Material::glass(1.5)
    };
    let ball = real(sphere(1.0, 512).unwrap(), material, at(0.0, 0.0, 0.0));
    let room = Material { double_sided: true, ..lambert(Vec3::splat(0.5)) };
    let room = real(block(12.0, 12.0, 12.0), room, at(0.0, 0.0, 0.0));
    let lamp_at = facing(Vec3::new(0.0, 0.0, -DISTANCE as f32), Vec3::Z);
    let lamp = light(spot(INTENSITY as f32, half_angle as f32, 1e-3), lamp_at, World::Real);
    let scene = trace(&Scene { things: vec![ball, room], lights: vec![lamp] }, None);

    let steps = 20_000;
    let mut expected = [0.0_f64; 4];
    for step in 0..steps {
        let width = half_angle.to_radians() / f64::from(steps);
        let angle = (f64::from(step) + 0.5) * width;
        let flux = INTENSITY * TAU * angle.sin() * width;
        // Sine law in the triangle of lamp, centre, and point on the unit ball.
        let (f, cos_inside) = fresnel((1.0 - (DISTANCE * angle.sin()).powi(2)).sqrt(), 1.5);
        let a = COLOR.powf(2.0 * cos_inside);
        expected[0] += flux * f;
        for (order, sum) in expected.iter_mut().enumerate().skip(1) {
            *sum += flux * (1.0 - f).powi(2) * f.powi(order as i32 - 1) * a.powi(order as i32);
        }
    }
    let count = 150_000;
    let stop = AtomicBool::new(false);
    let photons =
        trace_photons(&scene, &Settings::default(), PhotonPaths::Caustics, count, [1, 0], &stop).unwrap();
    for (order, expected) in expected.into_iter().enumerate() {
        let arrived = photons.iter().filter(|photon| photon.scatterings as usize == order + 1);
        let (mut flux, mut squares) = (0.0_f64, 0.0_f64);
        for photon in arrived {
            flux += f64::from(photon.flux.x);
            squares += f64::from(photon.flux.x).powi(2);
        }
        let error = squares.sqrt();
        // 1 % for the main order is asked for; facets of 0.7° and their normals bend light a little.
        assert!(
            (flux - expected).abs() < 3.0 * error + 2e-3 * expected,
            "order {order}: {flux} ± {error}, {expected}"
        );
        if order == 1 {
            assert!((flux / expected - 1.0).abs() < 0.01, "{flux} {expected}");
            let emitted = INTENSITY * TAU * (1.0 - half_angle.to_radians().cos());
            assert!(expected < 0.7 * emitted && error < 0.005 * expected);
        }
    }
}

/// The brightness under a glass plate, gathered from photons: a far lamp straight above, E = T I/d'², where the plate
/// of thickness t moves the lamp nearer by t (1 − 1/n) for steep rays.
#[test]
fn light_under_a_plate_has_the_right_density() {
    let plate = real(block(0.5, 0.5, 0.1), Material::glass(1.5), at(0.0, 0.0, 0.5));
    let floor = real(square(1.0), lambert(Vec3::ONE), at(0.0, 0.0, 0.0));
    let lamp_at = facing(Vec3::new(0.0, 0.0, 4.0), -Vec3::Z);
    let lamp = light(spot(16.0, 3.0, 1e-3), lamp_at, World::Real);
    let scene = trace(&Scene { things: vec![plate, floor], lights: vec![lamp] }, None);
    let camera = peephole(Vec3::new(1.0, 0.0, 0.25), Vec3::ZERO, 0.05, 2);
    let estimate = over_seeds(8, |seed| {
        let options = coshade_reference::job::JobOptions {
            seed,
            photons_per_pass: Some(5000),
            photon_radius_m: Some(0.03),
            settings: depth(8),
            ..samples(4)
        };
        real_of(&picture(&scene, &camera, &options)).mean
    });
    let f = 0.04;
    let transmitted = (1.0 - f) / (1.0 + f);
    let distance = 4.0 - 0.1 * (1.0 - 1.0 / 1.5);
    let expected = transmitted * 16.0 / (distance * distance) / PI as f32;
    estimate.is(Vec3::splat(expected), 3e-3, 1e-2);
}
